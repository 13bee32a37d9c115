"""Main bearings of a run: force law, data, and the width over which a journal's tilt has an effect."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.ports import MainJournals
from cranktrain.dynamics.topology.pieces import REFERENCE_VISCOSITY
from cranktrain.engine.model import Engine
from cranktrain.film.laws.bearings import Bearings, bearing_parameters, enter_law
from cranktrain.film.laws.films import Films, no_films
from cranktrain.film.laws.parameters import CLEARANCE, COLUMNS, VISCOSITY, WIDTH
from cranktrain.film.laws.register import PLAIN, ROLLER, Law, bearing_law, usual_level
from cranktrain.film.laws.roller import roller_parameters

if TYPE_CHECKING:
    from cranktrain.film.elastic.bore_compliance import BoreCompliance
    from cranktrain.film.table.database import FilmTable


class Mains(NamedTuple):
    """Layout, parameters (b, COLUMNS) and films of the main bearings; b is 0 if journals are locked."""

    journals: MainJournals
    parameters: Array
    films: Films


def mains_kind(engine: Engine) -> str:
    """Kind of main bearings whose force law the bearing level selects: plain if the engine has any, else rollers."""
    return ROLLER if engine.rollers_only else PLAIN


def check_mains(engine: Engine, level: str) -> None:
    """Raise ``InputError`` for a bearing level that has no force law for the engine's main bearings."""
    kind = mains_kind(engine)
    if kind in bearing_law(level).forms:
        return
    if kind == ROLLER:
        raise InputError(
            f"bearing level '{level}' needs oil films, but the mains of engine '{engine.name}' are rollers; "
            f"use {usual_level(ROLLER)} or linear"
        )
    lacks = "needs [main_roller], but the mains" if engine.main_roller is None else "needs rollers, but some mains"
    raise InputError(
        f"bearing level '{level}' {lacks} of engine '{engine.name}' are plain bearings; "
        f"use {usual_level(PLAIN)} or another film"
    )


def roller_law(level: str) -> Law:
    """Force law of roller bearings next to plain mains of a ``level``: the law of the level, else the default law."""
    law = bearing_law(level)
    return law if ROLLER in law.forms else bearing_law(usual_level(ROLLER))


def main_bearings(
    engine: Engine,
    level: str,
    table: FilmTable | None,
    bore: BoreCompliance | None,
) -> Mains:
    """Main bearings at a level, with films of ``REFERENCE_VISCOSITY``.

    Raises
    ------
    InputError
        a level that has no law for the engine's bearings, or whose table or bore is missing
    """
    check_mains(engine, level)
    count, law = len(engine.crankshaft.main_widths), bearing_law(level)
    laws = {PLAIN: (law, engine.plain_numbers), ROLLER: (roller_law(level), engine.roller_mains)}
    parameters = np.zeros((count if law.carries else 0, COLUMNS))
    if law.carries and engine.main_roller is not None:
        parameters[list(engine.roller_mains)] = roller_parameters(engine.main_roller)
    if law.carries and engine.main_bearing is not None:
        parameters[:, VISCOSITY] = REFERENCE_VISCOSITY
        parameters[list(engine.plain_numbers)] = bearing_parameters(engine.main_bearing, REFERENCE_VISCOSITY)
    parts = {"table": table, "bore": bore}
    bearings = Bearings(parameters, engine.main_bearing, engine.main_roller, parts, oil=engine.oil)
    films = no_films(len(parameters))._replace(solved=bearings.solved)
    tilted = np.zeros(len(parameters), dtype=bool)
    for kind, (own, which) in laws.items():
        if which and law.carries:
            enter_law(films, which, own, kind, bearings)
            tilted[list(which)] = own.forms[kind].tilt
    collar = law.clearance and not law.square_collar
    journals = MainJournals(0.5 * parameters[:, WIDTH], parameters[:, CLEARANCE], tilted, collar)
    return Mains(journals, parameters, films)
