"""Main bearings of a run: their law, their data, and over which width tilt counts.

At level ``held`` there are none: a crank that only twists turns about an axis that is given.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.ports import MainJournals
from cranktrain.engine.lubricant import viscosity
from cranktrain.engine.model import Engine
from cranktrain.film.elastic.bore_compliance import BoreCompliance
from cranktrain.film.laws.bearings import tilted_films
from cranktrain.film.laws.films import Films
from cranktrain.film.laws.parameters import CLEARANCE, WIDTH
from cranktrain.film.laws.plane import CODES, bearing_parameters
from cranktrain.film.laws.register import bearing_law
from cranktrain.film.laws.roller import roller_parameters
from cranktrain.film.table.database import FilmTable

HELD = "held"


class Mains(NamedTuple):
    """Layout, parameters (b, 13) and films of the main bearings."""

    journals: MainJournals
    parameters: Array
    films: Films


def check_mains(engine: Engine, level: str) -> None:
    """Refuse a level that the engine's main bearings do not know; ``InputError``."""
    if level == HELD:
        return
    if engine.main_roller is not None and level not in ("roller", "linear"):
        raise InputError(
            f"bearing level '{level}' needs oil films, but the mains of engine '{engine.name}' are rollers; "
            "use roller or linear"
        )
    if engine.main_roller is None and level == "roller":
        raise InputError(
            f"bearing level 'roller' needs [main_roller], but the mains of engine '{engine.name}' are plain bearings; "
            "use impedance or another film"
        )


def main_bearings(
    engine: Engine,
    level: str,
    eta: float,
    temperatures: Array | None,
    table: FilmTable | None,
    bore: BoreCompliance | None,
) -> Mains:
    """Main bearings at a level, with films of viscosity ``eta``, or each at that of its own temperature (b,), K.

    Rollers know the levels ``roller`` and ``linear``, which is the same law with constant stiffness.

    Raises
    ------
    InputError
        a level that the engine's bearings do not know, or that lacks what it needs
    """
    check_mains(engine, level)
    count = len(engine.crankshaft.main_widths)
    if temperatures is not None and np.shape(temperatures) != (count,):
        raise InputError(f"film temperatures of the form {np.shape(temperatures)}; give one for each of {count} mains")
    if level == HELD:
        nothing = np.zeros(0)
        films = tilted_films(None, "linear", np.zeros((1, 13)))
        return Mains(MainJournals(nothing, nothing, False), np.zeros((0, 13)), films)
    if engine.main_roller is not None:
        rollers = replace(engine.main_roller, law="linear") if level == "linear" else engine.main_roller
        parameters = roller_parameters(rollers, CODES["roller"])
        films = tilted_films(None, "roller", parameters, rollers=rollers)
        return Mains(MainJournals(0.5 * parameters[:, WIDTH], parameters[:, CLEARANCE], True), parameters, films)
    bearing = engine.plain_mains
    etas = [eta] * count if temperatures is None else [viscosity(engine.oil, float(t)) for t in temperatures]
    parameters = np.array([bearing_parameters(bearing, own, level) for own in etas])
    journals = MainJournals(0.5 * parameters[:, WIDTH], parameters[:, CLEARANCE], bearing_law(level).tilt)
    return Mains(journals, parameters, tilted_films(bearing, level, parameters, table, bore))
