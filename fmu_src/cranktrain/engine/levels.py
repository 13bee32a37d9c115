"""The registers of fidelity levels, except for bearings (:mod:`cranktrain.film.laws.register`).

Crank: ``rigid`` moves as a whole; ``torsional`` also twists; ``beam`` also bends and stretches; ``solid`` has stresses.
Each level is one row. Rows are ordered from the lowest to the highest level. Command line, FMU interface, plan and
studies read these tables. :mod:`cranktrain.studies.output_levels` lists the levels that each output needs;
:mod:`cranktrain.structure.crank.level` makes the body of a crank level.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from cranktrain.core.errors import InputError, nearest
from cranktrain.engine.model import Engine

RIGID_SHARE = 0.25
"""Ratio of a rigid crank's highest valid frequency to the first torsional one; its error is 1/(1 − 1/16) − 1 = 7 %."""
RIGID_CUT_SHARE = 0.02
"""Highest valid frequency of a rigid crank over the running model's cut-off, if no torsional frequency is published."""
TORSIONAL_SHARE = 0.25
"""Highest valid frequency of a torsional crank over the running model's cut-off. It is above the second torsional
frequency of both shipped engines, which this level predicts within 6 %, and below the third."""


@dataclass(frozen=True)
class Level:
    """A fidelity level of one kind.

    Attributes
    ----------
    title : description in one line, for help and documentation
    reason : why a lower level is not sufficient if this level is needed
    """

    name: str
    title: str
    reason: str = ""


@dataclass(frozen=True)
class CrankLevel(Level):
    """A fidelity level of the crank: source of its body, and range of validity.

    Attributes
    ----------
    highest_frequency : function of an engine: highest frequency at which the level is valid, Hz
    needs_solid : true if it is made from the solid body, which takes a minute if it is not in the cache
    takes_mesh : true if a user's own mesh of the crankshaft is used
    bends : true if deformation moves journals across the axis, so that the crank needs bearings that carry it
    inherits : level whose damping in motion is used, because this level cannot compute it; empty if none
    """

    highest_frequency: Callable[[Engine], float] = lambda engine: engine.reduction.running_cutoff_hz
    needs_solid: Callable[[Engine], bool] = lambda engine: False
    takes_mesh: bool = False
    elastic: bool = True
    bends: bool = True
    inherits: str = ""


def _rigid_frequency(engine: Engine) -> float:
    cut = engine.reduction.running_cutoff_hz
    shapes = zip(engine.published.cranktrain_hz, engine.published.cranktrain_shapes, strict=True)
    torsional = next((hz for hz, shape in shapes if shape == "torsional"), 0.0)
    return min(cut, RIGID_SHARE * torsional if torsional > 0.0 else RIGID_CUT_SHARE * cut)


def _table(*rows: Level) -> dict[str, Level]:
    return {row.name: row for row in rows}


CRANKS: dict[str, CrankLevel] = {
    row.name: row
    for row in (
        CrankLevel(
            "rigid",
            "moves as a whole, made from dimensions or the user's own mesh",
            highest_frequency=_rigid_frequency,
            takes_mesh=True,
            elastic=False,
            bends=False,
        ),
        CrankLevel(
            "torsional",
            "discs on a shaft that twists",
            "a rigid crank does not twist",
            highest_frequency=lambda engine: TORSIONAL_SHARE * engine.reduction.running_cutoff_hz,
            needs_solid=lambda engine: engine.reduction.torsional_source.startswith("solid"),
            takes_mesh=True,
            bends=False,
            inherits="beam",
        ),
        CrankLevel(
            "beam",
            "beams that twist, bend and stretch",
            "it needs a crank that bends and stretches",
        ),
        CrankLevel(
            "solid",
            "elastic modes of the finite-element crankshaft",
            "stresses need the solid crank",
            needs_solid=lambda engine: True,
            takes_mesh=True,
        ),
    )
}
"""Crank levels from the lowest to the highest."""
BLOCKS = _table(
    Level("ground", "main bores at rest"),
    Level("flexible", "elastic modes of the finite-element block on its mounts", "the ground does not move"),
)
PISTONS = _table(
    Level("rigid", "pistons on their axes"),
    Level("guided", "springs between skirt and liner", "rigid pistons stay on their axis"),
)
DAMPERS = _table(
    Level("none", "without damper"),
    Level("fitted", "with the engine's torsional damper on the pulley", "the run is without damper"),
)
ENCODERS = ("pin", "pulley", "flywheel")
"""Locations of the encoder of a pressure trace: each cylinder's own pin, or one end of the crank for all cylinders."""


@dataclass(frozen=True)
class Levels:
    """One level of each kind; as a requirement the lowest sufficient level. ``film`` excludes roller bearings."""

    crank: str = "rigid"
    bearings: str = "held"
    block: str = "ground"
    big_ends: str = "rigid"
    pistons: str = "rigid"
    damper: str = "none"
    film: bool = False


def crank_level(name: str) -> CrankLevel:
    """Register row of a crank level; ``InputError`` with the nearest name if the level does not exist."""
    if name not in CRANKS:
        raise InputError(f"crank level '{name}' does not exist; {nearest(name, CRANKS)}")
    return CRANKS[name]


def described(rows: Iterable[Any]) -> str:
    """Text of the names and titles of a register's rows: ``name (title); …``."""
    return "; ".join(f"{row.name} ({row.title})" for row in rows)
