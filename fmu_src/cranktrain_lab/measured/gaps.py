"""Gaps of a toothed wheel: recurrence of gaps, the wheel that follows from it, and pulses next to gaps.

A signal shows after how many teeth its gap recurs. It does not show whether this is a revolution, because a wheel with
three equal gaps looks like a wheel with a third of the teeth at three times the speed. Only usual wheels are therefore
recognised from the signal alone.

The voltage of an inductive pick-up is zero in a gap. One of its two crossings belongs to the middle of a tooth and lies
between two equal half waves. The other lies between two teeth, and next to a gap it begins or ends in the flat zero.
This crossing is late or early by a considerable fraction of a pitch once per revolution, which adds false whole orders.
The pulses on either side of a gap are therefore compared with a cubic through three teeth on either side.
"""

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
"""Numbers of teeth and of missing teeth of usual wheels with one gap."""
MOST_GAP, FEWEST_GAPS, FEWEST_APART = 4, 3, 8
"""Largest interval of a gap in pitches, least number of gaps for a pattern, and least number of teeth between them."""
ALIKE, COVERED = 0.7, 0.6
"""Least fraction of gaps at equal distances, and least fraction of all teeth between gaps at these distances."""
BESIDE, RATIO = 0.03, 5.0
"""Largest deviation of a valid pulse next to a gap, in pitches, and relative to the deviation of other teeth."""
MOST_GAPS = 6


class Gap(NamedTuple):
    """Recurring gap: number of teeth from one gap to the next with missing teeth, and missing teeth in the gap."""

    apart: int
    missing: int


def pitches(times: Array) -> Array:
    """Return the intervals (k − 1,) between times (k,) of pulses, relative to their local median."""
    from scipy.ndimage import median_filter

    intervals = np.diff(times)
    return np.asarray(intervals / median_filter(intervals, size=9, mode="nearest"))


def recurring_gap(times: Array) -> Gap | None:
    """Return the gap that recurs in times (k,) s of pulses; None if there is none, or pulses are too uneven."""
    if times.size < 16:
        return None
    steps = np.maximum(1, np.rint(pitches(times))).astype(int)
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
    """Return the wheel with the stated teeth and the recurring gap, and a remark if it differs from the stated wheel.

    Stated teeth may include the missing ones (60) or not (58), and may be counted from gap to gap or per revolution
    with several gaps. ``InputError`` if no number of such gaps gives the stated teeth.
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
    """Return a remark on a wheel with several equal gaps and no index pulse that marks tooth 0."""
    if wheel.gaps < 2:
        return []
    return [
        f"{where}: {wheel.gaps} equal gaps a revolution ({wheel.name}); which of them precedes tooth 0 cannot be told, "
        f"so angles may be off by multiples of {360.0 / wheel.gaps:g} deg, and with them phases of orders that are no "
        f"multiple of {wheel.gaps}; give a once-a-revolution pulse, --index CHANNEL"
    ]


def wheel_of(gap: Gap | None, speed: float, where: str) -> Wheel:
    """Return the wheel of a signal without stated teeth; raises ``InputError`` if the gap does not determine it.

    ``speed``, rev/min, assumes one revolution from gap to gap.
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
    """Return excessive deviations of the pulses before (key −1) and after (key 0) the gaps, in pitches."""
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
    """Return the median of the finite values, 0 if there are none."""
    values = values[np.isfinite(values)]
    return float(np.median(values)) if values.size else 0.0


def without_wrong(numbered: Numbered, wheel: Wheel, wrong: dict[int, float]) -> Numbered:
    """Return the pulses without wrong pulses next to gaps; ``wrong`` are their deviations, see ``beside_gaps``."""
    sector = wheel.sector
    drop = [0 if side == 0 else sector.pulses - 1 for side in wrong]
    keep = ~np.isin(numbered.teeth % sector.teeth, drop)
    return replace(numbered, times=numbered.times[keep], teeth=numbered.teeth[keep])
