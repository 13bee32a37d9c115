"""Levels of main bearings that feel the journal's tilt: which law, from which data."""

from __future__ import annotations

from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import keep_record, kernel_address
from cranktrain.core.reduced_body import Array
from cranktrain.engine.parts import PlainBearing, RollerBearings
from cranktrain.film.elastic.bore_compliance import BoreCompliance
from cranktrain.film.laws.ehd import elastic_bore, elastic_law, film_size
from cranktrain.film.laws.films import SIZE, Films, no_films
from cranktrain.film.laws.parameters import VISCOSITY
from cranktrain.film.laws.rigid_bore import aligned_law, reynolds_law, rigid_bore, table_law
from cranktrain.film.laws.roller import roller_law, roller_seats
from cranktrain.film.table.database import FilmTable

KERNELS = {"table": table_law, "reynolds": reynolds_law, "ehd": elastic_law, "roller": roller_law}


def tilted_films(
    bearing: PlainBearing | None,
    level: str,
    parameters: Array,
    table: FilmTable | None = None,
    bore: BoreCompliance | None = None,
    rollers: RollerBearings | None = None,
) -> Films:
    """Films of the main journals, equal but for their viscosity, or their roller bearings; compiles their law.

    Parameters
    ----------
    bearing : for films
    level : table, reynolds, ehd or roller; any other feels no tilt
    parameters : (b, 13) of each bearing, see :mod:`cranktrain.film.laws.parameters`
    table : for level ``table``
    bore : for level ``ehd``
    rollers : for level ``roller``, which reads nothing else

    Raises
    ------
    InputError
        where a level lacks what it needs, or the table is of another bearing
    """
    films = no_films(len(parameters))
    if level not in KERNELS:
        return films
    if level == "roller":
        if rollers is None:
            raise InputError("bearing level 'roller' needs [main_roller] in the engine file; add it, or take a film")
        return _entered(films, roller_seats(rollers), roller_law)
    if bearing is None:
        raise InputError(
            f"bearing level '{level}' needs [main_bearing], which the engine file lacks; take level roller or linear"
        )
    if level == "table" and table is None:
        ratio = bearing.width / bearing.diameter
        raise InputError(f"bearing level 'table' needs a film table of L/D {ratio:.4g}; make it by film-table")
    if level == "ehd":
        if bore is None:
            raise InputError("bearing level 'ehd' needs the bore's compliance; make it by structure.saddle")
        record: Any = elastic_bore(bearing, parameters[:, VISCOSITY], bore)
        films.values[0] = film_size(record.film)
    else:
        record = rigid_bore(bearing, parameters, table if level == "table" else None, films.solved)
    return _entered(films, record, KERNELS[level])


def floating_films(
    bearing: PlainBearing | None, level: str, parameters: Array, table: FilmTable | None = None
) -> Films:
    """Films of big ends at level ``table``; ``parameters`` (c, 13), ``table`` may lack tilt.

    Raises
    ------
    InputError
        without a table, or with one of another bearing
    """
    films = no_films(len(parameters))
    if level != "table" or bearing is None:
        return films
    if table is None:
        ratio = bearing.width / bearing.diameter
        raise InputError(f"big-end level 'table' needs a film table of L/D {ratio:.4g}; make it by film-table")
    return _entered(films, rigid_bore(bearing, parameters, table, films.solved, tilted=False), aligned_law)


def _entered(films: Films, record: Any, law: Any) -> Films:
    """Films with the addresses of their law, compiled here, and of its record."""
    films.entry[1] = keep_record(record, films.entry)
    film, out = np.zeros(1), np.zeros(SIZE)
    films.entry[0] = kernel_address(law, 0, 0, 0, films.place[0], films.velocity[0], films.numbers, film, out)
    return films
