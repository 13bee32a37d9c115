"""What each level of detail answers, and which level to take instead where it does not.

Crank: ``rigid`` moves as a whole; ``torsional`` also twists; ``beam`` also bends and stretches; ``solid`` has stresses.
Main bearings: ``held`` lets a rigid or torsional crank only turn; ``linear`` is a spring and damper, so it has loads
and motions; ``impedance`` is a film, so it has gaps, pressures and friction; ``table`` and above feel tilt; ``roller``
has loads, moments and tilt, and no film. Block: ``ground`` stands still; ``flexible`` moves on its mounts. Big ends
have a film from ``impedance`` on, pistons a motion in their cylinders where ``guided``, a damper where ``fitted``.

An output is named as in the FMU's interface; indices in brackets do not matter. Results that are no variables of the
FMU are in :data:`RESULTS`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from cranktrain.core.errors import InputError, nearest
from cranktrain.engine.model import Engine

CRANKS = ("rigid", "torsional", "beam", "solid")
"""Crank levels from the lowest to the highest."""
BEARINGS = ("held", "linear", "impedance", "table", "reynolds", "ehd")
"""Levels of plain main bearings from the lowest to the highest; rollers have ``held``, ``linear``, ``roller``."""
BLOCKS = ("ground", "flexible")
BIG_ENDS = ("rigid", "impedance", "table")
PISTONS = ("rigid", "guided")
DAMPERS = ("none", "fitted")

RIGID_SHARE = 0.25
"""Share of the first torsional frequency up to which a rigid crank answers: there 1/(1 − 1/16) is 7 % too little."""
RIGID_CUT_SHARE = 0.02
"""Likewise over the running model's cut-off, where the engine file publishes no torsional frequency."""
TORSIONAL_SHARE = 0.25
"""Share of the running model's cut-off up to which discs on a shaft answer: above the second torsional frequency of
either shipped engine, which they meet within 6 %, below the third."""


@dataclass(frozen=True)
class Levels:
    """One level of each kind; as a need: the lowest that serves. ``film``: rollers do not serve."""

    crank: str = "rigid"
    bearings: str = "held"
    block: str = "ground"
    big_ends: str = "rigid"
    pistons: str = "rigid"
    damper: str = "none"
    film: bool = False


_TURNS = Levels()
_TWISTS = Levels(crank="torsional")
_BENDS = Levels(crank="beam", bearings="linear")
_LOADED = Levels(bearings="linear")
_FILM = Levels(bearings="impedance", film=True)
_TILTS = Levels(crank="beam", bearings="table")
_STANDS = Levels(bearings="linear", block="flexible")
_GUIDED = Levels(pistons="guided")
_FLOATS = Levels(big_ends="impedance")
_DAMPED = Levels(crank="torsional", damper="fitted")

_AXES = ("x", "y", "z")

VARIABLES: dict[str, Levels] = {
    **dict.fromkeys(("crank.angle", "crank.speed", "flywheel.torsion", "shaft.torque"), _TURNS),
    "pulley.torsion": _TWISTS,
    "pulley.axial": _BENDS,
    **dict.fromkeys(("bearing.force.x", "bearing.force.y", "bearing.position.x", "bearing.position.y"), _LOADED),
    **dict.fromkeys(("bearing.velocity.x", "bearing.velocity.y", "bearing.speed.relative"), _LOADED),
    **dict.fromkeys(("bearing.eccentricity", "bearing.velocity.effective"), Levels(bearings="impedance")),
    **dict.fromkeys(("bearing.film_thickness_min", "bearing.pressure_max", "bearing.friction_torque"), _FILM),
    **dict.fromkeys(("bearing.oil_flow", "bearing.speed.gap", "bearing.speed.effective"), _FILM),
    **dict.fromkeys(("bearing.gap.angle", "bearing.gap.side", "bearing.gap.rate"), _FILM),
    **dict.fromkeys(("bearing.tilt", "bearing.moment.x", "bearing.moment.y"), _TILTS),
    **dict.fromkeys(("thrust.force", "thrust.displacement"), _BENDS),
    **dict.fromkeys(("cylinder.volume", "cylinder.piston_position"), _TURNS),
    **dict.fromkeys(("big_end.force.x", "big_end.force.y"), _TURNS),
    **{f"big_end.{name}": _FLOATS for name in ("position.x", "position.y", "eccentricity", "film_thickness_min")},
    **{f"big_end.{name}": _FLOATS for name in ("pressure_max", "friction_torque", "oil_flow")},
    **dict.fromkeys(("piston.side_force", "piston.friction"), _TURNS),
    **dict.fromkeys(("piston.lateral", "piston.tilt"), _GUIDED),
    **{f"mount.{kind}.{axis}": _STANDS for kind in ("force", "moment") for axis in _AXES},
    **{f"engine.{kind}.{axis}": _STANDS for kind in ("position", "rotation") for axis in _AXES},
    "cover.acceleration": _STANDS,
    **{f"damper.{name}": _DAMPED for name in ("torque", "heat", "twist", "temperature")},
    **{f"solver.{name}": _TURNS for name in ("residual", "substeps", "iterations", "online_films")},
}
"""Outputs of the running model without their indices, and the lowest levels that answer each."""

RESULTS: dict[str, Levels] = {
    "free_forces": _TURNS,
    "critical_speeds": _TWISTS,
    "torsional_frequencies": _TWISTS,
    "bending_frequencies": Levels(crank="beam"),
    "stress": Levels(crank="solid", bearings="linear"),
}
"""Results that are no outputs of the running model."""

_WHY = {
    "crank": {
        "torsional": "a rigid crank does not twist",
        "beam": "it needs a crank that bends and stretches",
        "solid": "stresses need the solid crank",
    },
    "bearings": {
        "linear": "held mains carry the crank without motion or load",
        "impedance": "it needs an oil film",
        "table": "it needs bearings that feel tilt",
    },
    "block": {"flexible": "the ground does not move"},
    "big_ends": {"impedance": "rigid big ends have no film"},
    "pistons": {"guided": "rigid pistons stay on their axis"},
    "damper": {"fitted": "the run is without damper"},
}
_WORDS = {"crank": "crank level", "bearings": "bearing level", "block": "block level", "big_ends": "big-end level"}
_LADDERS = {
    "crank": CRANKS,
    "bearings": BEARINGS,
    "block": BLOCKS,
    "big_ends": BIG_ENDS,
    "pistons": PISTONS,
    "damper": DAMPERS,
}


def plain_name(output: str) -> str:
    """Name of an output without the indices of its parts: ``bearing[3].force.x`` becomes ``bearing.force.x``."""
    return re.sub(r"\[[^]]*\]", "", output.strip())


def need(output: str) -> Levels:
    """Lowest levels that answer one output; ``InputError`` with the nearest name for one that does not exist."""
    name = plain_name(output)
    known = VARIABLES | RESULTS
    if name not in known:
        raise InputError(f"output '{output}' does not exist; {nearest(name, known)}")
    return known[name]


def lowest_levels(outputs: Iterable[str], rollers: bool = False) -> Levels:
    """Lowest levels that answer all ``outputs``; ``rollers``: the main bearings are roller bearings.

    Raises
    ------
    InputError
        an output that does not exist, or one of an oil film where the mains are rollers
    """
    needs = [(output, need(output)) for output in outputs]
    chosen = {
        kind: max((getattr(one, kind) for _, one in needs), key=ladder.index, default=ladder[0])
        for kind, ladder in _LADDERS.items()
    }
    film = [output for output, one in needs if one.film]
    if rollers and film:
        raise InputError(_no_film(film[0]))
    if chosen["crank"] in ("beam", "solid") and chosen["bearings"] == "held":
        chosen["bearings"] = "linear"
    if rollers and chosen["bearings"] not in ("held", "linear"):
        chosen["bearings"] = "roller"
    return Levels(**chosen, film=bool(film))


def refuse_beyond(
    crank: str,
    bearings: str,
    outputs: Iterable[str],
    frequency: float | None = None,
    *,
    engine: Engine | None = None,
    block: str = "ground",
    big_ends: str = "rigid",
    pistons: str = "auto",
    damper: str = "none",
) -> None:
    """Refuse outputs, and a frequency, that the levels do not answer.

    Parameters
    ----------
    crank, bearings, block, big_ends, pistons, damper : levels; pistons ``auto`` are guided in a flexible block
    outputs : names as in the FMU's interface or :data:`RESULTS`
    frequency : highest of interest, Hz; needs ``engine``

    Raises
    ------
    InputError
        one line that names the output, the level and the one that can
    """
    rollers = bearings == "roller" or (engine is not None and engine.main_roller is not None)
    given = {
        "crank": crank,
        "bearings": bearings,
        "block": block,
        "big_ends": big_ends,
        "pistons": ("guided" if block == "flexible" else "rigid") if pistons == "auto" else pistons,
        "damper": damper,
    }
    for kind, ladder in _LADDERS.items():
        valid = (*ladder, "roller") if kind == "bearings" else ladder
        if given[kind] not in valid:
            raise InputError(f"{_WORDS.get(kind, kind)} '{given[kind]}' does not exist; {nearest(given[kind], valid)}")
    if bearings == "held" and crank in ("beam", "solid"):
        raise InputError(
            f"bearing level 'held' holds the axis of a crank that does not bend, not of crank level '{crank}'; "
            "use bearing level 'linear', or crank level 'torsional'"
        )
    for output in outputs:
        lowest = need(output)
        if lowest.film and rollers:
            raise InputError(_no_film(output))
        for kind, ladder in _LADDERS.items():
            wanted, level = getattr(lowest, kind), given[kind]
            if kind == "bearings" and level == "roller":
                continue
            if ladder.index(level) < ladder.index(wanted):
                why = _WHY[kind][wanted]
                instead = "roller" if kind == "bearings" and rollers and wanted != "linear" else wanted
                what = _WORDS.get(kind, kind)
                raise InputError(f"'{output}' cannot be answered at {what} '{level}': {why}; use {what} '{instead}'")
    if frequency is not None and engine is not None:
        _refuse_frequency(engine, crank, frequency)


def highest_frequency(engine: Engine, crank: str) -> float:
    """Frequency, Hz, up to which a crank level answers; the running model's cut-off for ``beam`` and ``solid``.

    A rigid crank's limit follows the published first torsional frequency, or the cut-off where none is published.
    """
    if crank not in CRANKS:
        raise InputError(f"crank level '{crank}' does not exist; {nearest(crank, CRANKS)}")
    cut = engine.reduction.running_cutoff_hz
    if crank == "rigid":
        named = zip(engine.published.cranktrain_hz, engine.published.cranktrain_shapes, strict=True)
        torsional = next((hz for hz, shape in named if shape == "torsional"), 0.0)
        return min(cut, RIGID_SHARE * torsional if torsional > 0.0 else RIGID_CUT_SHARE * cut)
    return TORSIONAL_SHARE * cut if crank == "torsional" else cut


def _refuse_frequency(engine: Engine, crank: str, frequency: float) -> None:
    highest = highest_frequency(engine, crank)
    if frequency <= highest:
        return
    higher = next((level for level in CRANKS if highest_frequency(engine, level) >= frequency), None)
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
