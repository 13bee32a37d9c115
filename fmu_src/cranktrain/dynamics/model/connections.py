"""Force laws of an engine's own connections, one for each row that :mod:`.ports` lays out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.mains import REFERENCE_VISCOSITY
from cranktrain.dynamics.model.records import Ports
from cranktrain.dynamics.topology.damper import damper_law, told_damper
from cranktrain.dynamics.topology.slider_crank import SliderCrankRecord, slider_crank_law
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import AxialPath
from cranktrain.film.laws.bearings import Bearings, axial_joint_film, bearing_parameters, enter, law_films
from cranktrain.film.laws.films import MASS, Films, join_films, no_films
from cranktrain.film.laws.parameters import COLUMNS
from cranktrain.film.laws.register import BIG_END, Law

if TYPE_CHECKING:
    from cranktrain.film.elastic.bore_compliance import BoreCompliance
    from cranktrain.film.table.database import FilmTable


def laws_of(
    ports: Ports, mains: Films, big_ends: Films, rods: SliderCrankRecord, thrust: Films, path: AxialPath | None,
    damper: Array,
) -> Films:  # fmt: skip
    """Force laws of all connections; ``damper`` (PARAMETERS,) are the parameters of the damper's law."""
    of_pins, of_rods = (rods.rods[:, slot].astype(int).tolist() for slot in (at.PIN_ROW, at.END_ROW))
    rod_laws = enter(no_films(len(of_rods)), slider_crank_law, rods)
    rod_laws.traits[:, MASS] = 1.0
    parts: list[tuple[Films, Sequence[int]]] = [
        (mains, range(len(mains.entry))), (big_ends, of_pins), (rod_laws, of_rods),
    ]  # fmt: skip
    once = {
        at.THRUST_ROW: thrust,
        at.JOINT_ROW: None if path is None else axial_joint_film(path),
        at.DAMPER_ROW: enter(no_films(1), damper_law, told_damper(damper)),
    }
    for slot, law in once.items():
        row = int(ports.layout[slot])
        if law is not None and row >= 0:
            parts.append((law, [row]))
    return join_films(len(ports.connections), parts)


def big_end_films(
    engine: Engine, law: Law, table: FilmTable | None, bore: BoreCompliance | None
) -> tuple[Array, Films]:
    """Parameters (c, COLUMNS) of the c big ends' films (0 without big-end bearings), and the force law of the films."""
    parameters = np.zeros((engine.n_cylinders, COLUMNS))
    if engine.big_end_bearing is not None:
        parameters[:] = bearing_parameters(engine.big_end_bearing, REFERENCE_VISCOSITY)
    parts = {"big_end_table": table, "big_end_bore": bore}
    bearings = Bearings(parameters, engine.big_end_bearing, parts=parts, oil=engine.oil)
    return parameters, law_films(law, BIG_END, bearings)
