"""Fidelity levels that provide an output, and the level to use instead if a level does not provide it.

An output is named as in the FMU's interface; indices in brackets do not matter. Results that are no variables of the
FMU are in :data:`RESULTS`. Levels are those of :mod:`cranktrain.engine.levels` and
:mod:`cranktrain.film.laws.register`, from the lowest to the highest.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict

from cranktrain.core.errors import InputError, nearest
from cranktrain.dynamics.outputs.register import FAMILIES
from cranktrain.engine.levels import BLOCKS, CRANKS, DAMPERS, PISTONS, Level, Levels, crank_level
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import BIG_END, PLAIN, ROLLER, bearing_law, bearing_levels

RESULTS: dict[str, Levels] = {
    "free_forces": Levels(),
    "critical_speeds": Levels(crank="torsional"),
    "torsional_frequencies": Levels(crank="torsional"),
    "bending_frequencies": Levels(crank="beam"),
    "stress": Levels(crank="solid", bearings="linear"),
}
"""Results that are not outputs of the running model."""

_WORDS = {"crank": "crank level", "bearings": "bearing level", "block": "block level", "big_ends": "big-end level"}


def variables() -> dict[str, Levels]:
    """Outputs of the running model without indices, and the lowest levels that provide each."""
    rows = [(family.name, *row) for family in FAMILIES.values() for row in family.outputs.items()]
    return {f"{family}.{name}".lstrip("."): Levels(**need) for family, name, need in rows}


def bearing_ladder(rollers: bool) -> tuple[str, ...]:
    """Levels of main bearings from the lowest to the highest: of roller bearings, or of plain ones."""
    return bearing_levels(ROLLER if rollers else PLAIN)


def ladders(rollers: bool) -> dict[str, tuple[str, ...]]:
    """Levels of each kind from the lowest to the highest; ``rollers``: the main bearings are roller bearings."""
    return {
        "crank": tuple(CRANKS),
        "bearings": bearing_ladder(rollers),
        "block": tuple(BLOCKS),
        "big_ends": bearing_levels(BIG_END),
        "pistons": tuple(PISTONS),
        "damper": tuple(DAMPERS),
    }


def plain_name(output: str) -> str:
    """Name of an output without the indices of its parts: ``bearing[3].force.x`` becomes ``bearing.force.x``."""
    return re.sub(r"\[([^][]|\[[^][]*\])*\]", "", output.strip())


def need(output: str) -> Levels:
    """Lowest levels that provide an output; ``InputError`` for an unknown output gives the nearest name."""
    name = plain_name(output)
    known = variables() | RESULTS
    if name not in known:
        raise InputError(f"output '{output}' does not exist; {nearest(name, known)}")
    return known[name]


def lowest_levels(outputs: Iterable[str], rollers: bool = False) -> Levels:
    """Lowest levels that provide all ``outputs``; ``rollers``: the main bearings are roller bearings.

    Raises ``InputError``: an output that does not exist, or an output of an oil film if the mains are roller bearings.
    """
    needs = [(output, need(output)) for output in outputs]
    film = [output for output, one in needs if one.film]
    if rollers and film:
        raise InputError(_no_film(film[0]))
    chosen = {}
    for kind, ladder in ladders(rollers).items():
        chosen[kind] = ladder[max((_place(ladder, getattr(one, kind)) for _, one in needs), default=0)]
    if CRANKS[chosen["crank"]].bends and not bearing_law(chosen["bearings"]).carries:
        chosen["bearings"] = next(level for level in bearing_ladder(rollers) if bearing_law(level).carries)
    return Levels(**chosen, film=bool(film))


def _place(ladder: tuple[str, ...], level: str) -> int:
    """Rank of a level on its ladder; the highest rank for a level of the other kind of bearing."""
    return ladder.index(level) if level in ladder else len(ladder) - 1


def refuse_beyond(
    levels: Levels, outputs: Iterable[str], frequency: float | None = None, engine: Engine | None = None
) -> None:
    """Refuse outputs, and a frequency, that the levels do not provide.

    Raises ``InputError``: one line that names the output, the level and the lowest sufficient level.

    Parameters
    ----------
    levels : pistons ``auto`` are guided in a flexible block
    outputs : names as in the FMU's interface or :data:`RESULTS`
    frequency : highest of interest, Hz; needs ``engine``
    """
    plain, rolling = bearing_ladder(rollers=False), bearing_ladder(rollers=True)
    given, crank, bearings = asdict(levels), levels.crank, levels.bearings
    if levels.pistons == "auto":
        given["pistons"] = "guided" if levels.block == "flexible" else "rigid"
    rollers = bearings not in plain or (engine is not None and engine.rollers_only)
    tables = ladders(rollers and bearings in rolling)
    for kind, ladder in tables.items():
        valid = (*plain, *rolling) if kind == "bearings" else ladder
        if given[kind] not in valid:
            raise InputError(f"{_WORDS.get(kind, kind)} '{given[kind]}' does not exist; {nearest(given[kind], valid)}")
    if not bearing_law(bearings).carries and CRANKS[crank].bends:
        raise InputError(
            f"bearing level '{bearings}' locks the axis of a crank that does not bend, not of crank level '{crank}'; "
            "use bearing level 'linear', or crank level 'torsional'"
        )
    for output in outputs:
        lowest = need(output)
        if lowest.film and rollers:
            raise InputError(_no_film(output))
        for kind, ladder in tables.items():
            level = given[kind]
            wanted = _place(ladder, getattr(lowest, kind))
            if ladder.index(level) < wanted:
                what, why = _WORDS.get(kind, kind), _reason(kind, getattr(lowest, kind))
                raise InputError(
                    f"'{output}' cannot be answered at {what} '{level}': {why}; use {what} '{ladder[wanted]}'"
                )
    if frequency is not None and engine is not None:
        _refuse_frequency(engine, crank, frequency)


def _reason(kind: str, wanted: str) -> str:
    """Reason why a level below the wanted one is not sufficient."""
    if kind == "big_ends":
        return "rigid big ends have no film"
    if kind != "bearings":
        rows: dict[str, Mapping[str, Level]] = {
            "crank": CRANKS,
            "block": BLOCKS,
            "pistons": PISTONS,
            "damper": DAMPERS,
        }
        return rows[kind][wanted].reason
    law = bearing_law(wanted)
    if law.tilt:
        return "it needs bearings that feel tilt"
    return "it needs an oil film" if law.film else "journals locked on their axis have neither motion nor load"


def _refuse_frequency(engine: Engine, crank: str, frequency: float) -> None:
    highest = crank_level(crank).highest_frequency(engine)
    if frequency <= highest:
        return
    higher = next((row.name for row in CRANKS.values() if row.highest_frequency(engine) >= frequency), None)
    if higher is not None:
        raise InputError(
            f"{frequency:g} Hz is above what crank level '{crank}' answers, {highest:.0f} Hz; "
            f"use crank level '{higher}'"
        )
    cut = engine.reduction.running_cutoff_hz
    raise InputError(
        f"{frequency:g} Hz is above the cut of the crank's modes, {cut:g} Hz; ask for at most {cut:g} Hz, or raise "
        f"reduction.running_cutoff_hz in the engine file"
    )


def _no_film(output: str) -> str:
    return (
        f"'{output}' cannot be answered: roller bearings have no oil film; "
        "bearing.force.x, .force.y, .eccentricity, .tilt and .moment they have"
    )
