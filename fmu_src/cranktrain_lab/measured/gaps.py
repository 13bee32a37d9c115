"""Gaps of a wheel: how often they recur, which wheel that makes of the teeth that were stated, and pulses beside them.

A signal shows after how many teeth its gap recurs. It does not show whether that is a revolution, because a wheel of
three equal gaps looks like one of a third of the teeth that turns three times as fast. So only usual wheels are taken
from the signal alone.

The voltage of an inductive pick-up is zero in a gap. One of its two crossings is that of a tooth's middle and lies
between two equal half waves; the other one lies between two teeth, and beside a gap it begins or ends in the flat zero.
That crossing is late or early by a good part of a pitch each revolution, which adds false whole orders. The pulses on
either side of a gap are therefore compared with a cubic in the number of the tooth through three teeth on either side.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain_lab.measured.wheel import Numbered, Wheel

USUAL = frozenset(
    ((12, 1), (24, 1), (24, 2), (32, 2), (36, 1), (36, 2), (40, 1), (48, 2), (58, 2), (60, 1), (60, 2), (62, 2),
     (120, 1), (120, 2), (120, 4), (360, 1), (360, 2), (720, 1))
)  # fmt: skip
"""Teeth and missing teeth of wheels of one gap that are in use."""
MOST_GAP, FEWEST_GAPS, FEWEST_APART = 4, 3, 8
"""Largest interval of a gap in pitches; gaps from which a pattern is seen, and teeth between them at least."""
ALIKE, COVERED = 0.7, 0.6
"""Fraction of the distances between gaps that are equal, and of the teeth that lie between such gaps, at least."""
BESIDE, RATIO = 0.03, 5.0
"""Deviation of a pulse beside a gap, in pitches and over that of other teeth, from which the pulse is wrong."""
MOST_GAPS = 6


class Gap(NamedTuple):
    """A gap that recurs: teeth from one to the next as if none were missing, and the teeth missing in it."""

    apart: int
    missing: int


def recurring_gap(times: Array) -> Gap | None:
    """Gap that recurs in the times (k,) s of pulses; None where there is none, or pulses are too uneven."""
    from scipy.ndimage import median_filter

    if times.size < 16:
        return None
    intervals = np.diff(times)
    ratio = intervals / median_filter(intervals, size=9, mode="nearest")
    steps = np.maximum(1, np.rint(ratio)).astype(int)
    gaps = np.flatnonzero((steps > 1) & (steps <= MOST_GAP))
    if gaps.size < FEWEST_GAPS:
        return None
    apart = np.diff(np.cumsum(steps)[gaps])
    usual = int(np.median(apart))
    whole = bool(usual > FEWEST_APART and np.mean(apart == usual) > ALIKE)
    if not whole or usual * np.count_nonzero(apart == usual) < COVERED * (steps.sum() - 2 * usual):
        return None
    return Gap(usual, int(np.median(steps[gaps])) - 1)


def recognised(wheel: Wheel, times: Array, where: str) -> tuple[Wheel, list[str]]:
    """Wheel of which the teeth that were stated and the gap that recurs are, and a remark where it is another one.

    The teeth may be those as if none were missing (60) or those counted (58), those from gap to gap, or of a revolution
    of several gaps. ``InputError``: teeth that no number of such gaps makes.
    """
    gap = recurring_gap(times)
    if gap is None or wheel.gaps > 1 or wheel.missing not in (0, gap.missing):
        return wheel, []
    present = gap.apart - gap.missing
    if wheel.teeth % gap.apart == 0:
        found = Wheel(wheel.teeth, gap.missing, wheel.teeth // gap.apart)
    elif wheel.teeth % present == 0:
        gaps = wheel.teeth // present
        found = Wheel(gaps * gap.apart, gap.missing, gaps)
    else:
        raise InputError(
            f"{where}: gaps of {gap.missing} teeth are {gap.apart} teeth apart, not {wheel.teeth}; "
            f"check the count of teeth, e.g. {gap.apart} with {gap.missing} missing"
        )
    remarks = []
    if found.teeth != wheel.teeth:
        remarks.append(f"{where}: {wheel.teeth} are the teeth that are there; taken as a wheel of {found.name}")
    elif not wheel.missing:
        remarks.append(f"{where}: a gap of {gap.missing} recurs; taken as a wheel of {found.name}")
    return found, remarks


def untold(wheel: Wheel, where: str) -> list[str]:
    """Remark on a wheel of several equal gaps whose tooth 0 no index pulse marks."""
    if wheel.gaps < 2:
        return []
    return [
        f"{where}: {wheel.gaps} equal gaps a revolution ({wheel.name}); which of them precedes tooth 0 cannot be told, "
        f"so angles may be off by multiples of {360.0 / wheel.gaps:g} deg, and with them phases of orders that are no "
        f"multiple of {wheel.gaps}; give a once-a-revolution pulse, --index CHANNEL"
    ]


def wheel_of(gap: Gap | None, speed: float, where: str) -> Wheel:
    """Wheel of a signal whose teeth nobody stated; ``InputError`` asks for them where the gap does not say them.

    ``speed`` is that of a revolution from gap to gap, rev/min.
    """
    if gap is None:
        raise InputError(f"{where}: has no gap that says its teeth a revolution; give --teeth N")
    if gap not in USUAL:
        told = ", ".join(
            f"{Wheel(n * gap.apart, gap.missing, n).name} at {speed / n:.0f} rev/min" for n in range(1, MOST_GAPS - 1)
        )
        raise InputError(
            f"{where}: gaps of {gap.missing} teeth recur every {gap.apart} teeth, which is no usual wheel of one gap; "
            f"equal gaps look alike at any speed: it may be {told}, on average; give the teeth a revolution, e.g. "
            f"--teeth {3 * gap.apart}"
        )
    return Wheel(*gap)


def beside_gaps(numbered: Numbered, wheel: Wheel) -> dict[int, float]:
    """Deviations of the pulses before (−1) and behind (0) the gaps, in pitches, where they exceed those of others."""
    sector = wheel.sector
    if not wheel.missing or sector.teeth < 10 + 2 * wheel.missing:
        return {}
    wide = wheel.missing + 1
    own = {-1: -wide, 0: 0}
    around = np.array([-wide - 3, -wide - 2, -wide - 1, 1, 2, 3])
    first = -(int(numbered.teeth[0]) // sector.teeth) * sector.teeth
    places = np.full(int(numbered.teeth[-1]) + first + 1, math.nan)
    places[numbered.teeth + first] = numbered.times
    behind = np.arange(sector.teeth * (1 + (wide + 3) // sector.teeth), places.size - 3)
    taken = places[behind[:, None] + around]
    shape = np.vander(around - around.mean(), 4)
    found: dict[int, float] = {}
    for side, place in own.items():
        weights = np.linalg.lstsq(shape.T, np.vander([place - around.mean()], 4)[0], rcond=None)[0]
        pitch = (taken[:, -1] - taken[:, 0]) / (around[-1] - around[0])
        off = (places[behind + place] - taken @ weights) / pitch
        sizes = np.array([_median(off[behind % sector.teeth == k]) for k in range(sector.teeth)])
        if abs(sizes[0]) > max(BESIDE, RATIO * _median(np.abs(sizes[1:]))):
            found[side] = float(sizes[0])
    return found


def _median(values: Array) -> float:
    """Median of the values that are numbers; 0 where none is."""
    values = values[np.isfinite(values)]
    return float(np.median(values)) if values.size else 0.0


def without_wrong(numbered: Numbered, wheel: Wheel, wrong: dict[int, float]) -> Numbered:
    """Pulses without those beside the gaps that are ``wrong``."""
    sector = wheel.sector
    drop = [0 if side == 0 else sector.pulses - 1 for side in wrong]
    keep = ~np.isin(numbered.teeth % sector.teeth, drop)
    return replace(numbered, times=numbered.times[keep], teeth=numbered.teeth[keep])
