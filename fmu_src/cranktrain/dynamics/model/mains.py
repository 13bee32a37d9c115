"""Main bearings of a run: their law, their data, and over which width tilt counts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.ports import MainJournals
from cranktrain.engine.model import Engine
from cranktrain.film.elastic.bore_compliance import BoreCompliance
from cranktrain.film.laws.bearings import Bearings, bearing_parameters, law_films
from cranktrain.film.laws.films import Films
from cranktrain.film.laws.parameters import CLEARANCE, COLUMNS, WIDTH
from cranktrain.film.laws.past_cycle import PastCycles
from cranktrain.film.laws.register import PLAIN, ROLLER, bearing_law, usual_level
from cranktrain.film.laws.roller import roller_parameters
from cranktrain.film.table.database import FilmTable

REFERENCE_VISCOSITY = 0.01
"""Viscosity (Pa s) of all oil in a model that is not prepared yet: any that every law takes."""


class Mains(NamedTuple):
    """Layout, parameters (b, COLUMNS) and films of the main bearings; b is 0 where journals are locked."""

    journals: MainJournals
    parameters: Array
    films: Films


def mains_kind(engine: Engine) -> str:
    """Kind of an engine's main bearings, see :mod:`cranktrain.film.laws.register`."""
    return PLAIN if engine.main_roller is None else ROLLER


def check_mains(engine: Engine, level: str) -> None:
    """Refuse a level that the engine's main bearings do not know; ``InputError``."""
    kind = mains_kind(engine)
    if kind in bearing_law(level).forms:
        return
    if kind == ROLLER:
        raise InputError(
            f"bearing level '{level}' needs oil films, but the mains of engine '{engine.name}' are rollers; "
            f"use {usual_level(ROLLER)} or linear"
        )
    raise InputError(
        f"bearing level '{level}' needs [main_roller], but the mains of engine '{engine.name}' are plain bearings; "
        f"use {usual_level(PLAIN)} or another film"
    )


def main_bearings(
    engine: Engine,
    level: str,
    table: FilmTable | None,
    bore: BoreCompliance | None,
    cycles: PastCycles | None = None,
) -> Mains:
    """Main bearings at a level, with films of ``REFERENCE_VISCOSITY``.

    Raises
    ------
    InputError
        a level that the engine's bearings do not know, or that lacks what it needs
    """
    check_mains(engine, level)
    count, law, kind = len(engine.crankshaft.main_widths), bearing_law(level), mains_kind(engine)
    if not law.carries:
        parameters = np.zeros((0, COLUMNS))
    elif engine.main_roller is not None:
        parameters = roller_parameters(engine.main_roller)
    else:
        parameters = np.tile(bearing_parameters(engine.plain_mains, REFERENCE_VISCOSITY), (count, 1))
    parts = {"table": table, "bore": bore, "cycles": cycles}
    bearings = Bearings(parameters, engine.main_bearing, engine.main_roller, parts, oil=engine.oil)
    films = law_films(law, kind, bearings)
    collar = law.clearance and not law.square_collar
    journals = MainJournals(0.5 * parameters[:, WIDTH], parameters[:, CLEARANCE], law.forms[kind].tilt, collar)
    return Mains(journals, parameters, films)
