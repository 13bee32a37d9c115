"""Firing angles: crank angle of each cylinder's firing dead centre, from throws, banks and firing order.

A throw at angle α points along the bank at angle β when θ = β − α, once per revolution; the order determines in which
revolution the cylinder fires. From each cylinder of the order to the next the crank turns to the next dead centre. If
these intervals together are shorter than a cycle, whole revolutions remain, which are added to the shortest intervals.
Example: a twin on one pin, with 45 degrees between its banks, fires at 0 and 405 degrees, not at 0 and 45. Cylinders
at the same dead centre that follow each other in the order fire together if that makes the firing even. An engine that
fires differently states angles or intervals.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, Protocol

from cranktrain.core.errors import InputError
from cranktrain.engine.parts import Compressor, Crankshaft, Cylinders, Rod

REVOLUTION = 2.0 * math.pi
SAME = 1.0e-6
"""Difference (rad) below which two dead centres are equal."""
LATER = 1.0e-9
"""Angle (rad) after a dead centre from which the next dead centre is searched."""
STATED = math.radians(0.5)
"""Largest difference (rad) between a stated firing angle and the dead centre of the throw."""
EVEN = math.radians(1.0)
"""Difference of firing intervals (rad) below which firing is even."""


class Engine(Protocol):
    """Parts of an engine that determine its firing angles."""

    @property
    def crankshaft(self) -> Crankshaft: ...  # noqa: D102
    @property
    def cylinders(self) -> Cylinders: ...  # noqa: D102
    @property
    def rod(self) -> Rod: ...  # noqa: D102
    @property
    def compressor(self) -> Compressor | None: ...  # noqa: D102


def dead_centres(crank: Crankshaft, cylinders: Cylinders, rod: Rod) -> list[float]:
    """Crank angle at which each cylinder's throw points along its bank, rad; for cylinder 1 in [0, 2π).

    For a cylinder with an offset axis it is the angle at which throw and rod are in line.
    """
    found = _centres(crank, cylinders, rod)
    return [(found[0] + LATER) % REVOLUTION - LATER, *found[1:]]


def _centres(crank: Crankshaft, cylinders: Cylinders, rod: Rod) -> list[float]:
    """Crank angle (rad) at which each cylinder's throw points along its bank; cylinder 1 may be in any revolution."""
    throws = [crank.throw_angles[pin - 1] for pin in cylinders.pins]
    found = [bank - throw for throw, bank in zip(throws, cylinders.bank_angles, strict=True)]
    if cylinders.axis_offsets:
        reach = [rod.length + crank.throws[pin - 1] for pin in cylinders.pins]
        leads = [math.asin(offset / r) for offset, r in zip(cylinders.axis_offsets, reach, strict=True)]
        found = [angle - lead for angle, lead in zip(found, leads, strict=True)]
    return found


def firing_angles(engine: Engine) -> tuple[float, ...]:
    """Crank angle of each cylinder's firing dead centre, in the order of cylinder numbers, rad.

    Cylinder 1 fires in the first revolution. ``InputError`` if the throws cannot fire in the stated order or at the
    stated angles.
    """
    cylinders = engine.cylinders
    dead, order, cycle = dead_centres(engine.crankshaft, cylinders, engine.rod), cylinders.firing_order, cylinders.cycle
    if engine.compressor is not None:  # every cylinder compresses whenever it reaches dead centre
        return tuple((angle + LATER) % cycle - LATER for angle in dead)
    if cylinders.firing_angles:
        return _as_stated(dead, cylinders.firing_angles, cycle, "firing_angles")
    if cylinders.firing_intervals:
        return _by_intervals(dead, order, cylinders.firing_intervals, cycle)
    at = order.index(1)
    order = order[at:] + order[:at]
    gaps = intervals_of(dead, order, cycle)
    if gaps is None:
        within = f"within {math.degrees(cycle):g} deg"
        raise _refused(f"the throws do not reach dead centre in this order {within}", dead, cylinders)
    if min(gaps) < SAME and not is_even(gaps):
        at = int(min(range(len(gaps)), key=gaps.__getitem__))
        both = f"{order[at]} and {order[(at + 1) % len(order)]}"
        raise _refused(f"cylinders {both} would fire together, others at uneven intervals", dead, cylinders)
    angles, angle = [0.0] * len(order), dead[order[0] - 1]
    angles[order[0] - 1] = angle
    for gap, cylinder in zip(gaps, order[1:], strict=False):
        # The firing angle is taken from the throw itself, because a sum of intervals has rounding errors.
        before = angle + LATER
        after = (dead[cylinder - 1] - before) % REVOLUTION + before
        angle = after + REVOLUTION * round((angle + gap - after) / REVOLUTION)
        angles[cylinder - 1] = angle
    return tuple(angle - cycle if angle >= cycle - SAME else angle for angle in angles)


def intervals_of(dead: Sequence[float], order: Sequence[int], cycle: float) -> list[float] | None:
    """Intervals (n,) from each cylinder of a firing order to the next; None if their sum exceeds a cycle."""
    following = [*order[1:], order[0]]
    gaps = [(dead[b - 1] - dead[a - 1] + SAME) % REVOLUTION - SAME for a, b in zip(order, following, strict=True)]
    gaps = [max(gap, 0.0) for gap in gaps]
    wanted = round(cycle / REVOLUTION)
    for _ in range(wanted - round(sum(gaps) / REVOLUTION)):
        shortest = min(gaps)
        last = max(k for k, gap in enumerate(gaps) if gap <= shortest + SAME)
        gaps[last] += REVOLUTION
    return gaps if round(sum(gaps) / REVOLUTION) == wanted else None


def intervals(angles: Sequence[float], cycle: float) -> tuple[float, ...]:
    """Intervals between firings, rad, in time order; the last one leads to the first firing of the next cycle."""
    sequence = sorted(angles)
    return tuple(b - a for a, b in pairwise([*sequence, sequence[0] + cycle]))


def is_even(gaps: Sequence[float]) -> bool:
    """True if all firing intervals are equal, apart from zero intervals of cylinders that fire together."""
    apart = [gap for gap in gaps if gap > EVEN]
    return max(apart) - min(apart) < EVEN and len(gaps) % len(apart) == 0


def even_order(dead: Sequence[float], cycle: float) -> tuple[int, ...]:
    """Firing order from cylinder 1 on that fires evenly; empty if no order does."""
    count, step = len(dead), cycle / len(dead)
    left, found = list(range(2, count + 1)), [1]
    for k in range(1, count):
        wanted = dead[0] + k * step
        near = [c for c in left if abs((dead[c - 1] - wanted + math.pi) % REVOLUTION - math.pi) < EVEN]
        if not near:
            return ()
        left.remove(near[0])
        found.append(near[0])
    return tuple(found)


def uneven(engine: Engine) -> Iterator[str]:
    """Warning, with a remedy, for a firing order with uneven intervals that the engine file does not state."""
    cylinders, cycle = engine.cylinders, engine.cylinders.cycle
    if cylinders.firing_angles or cylinders.firing_intervals or engine.compressor is not None:
        return
    gaps = intervals(firing_angles(engine), cycle)
    if is_even(gaps):
        return
    dead = dead_centres(engine.crankshaft, cylinders, engine.rod)
    mirrored = [-angle % REVOLUTION for angle in dead]
    other_way, order = intervals_of(mirrored, cylinders.firing_order, cycle), even_order(dead, cycle)
    if other_way is not None and is_even(other_way):
        remedy = "turned the other way it fires evenly: negate crankshaft.throw_angles and cylinders.bank_angles; "
    else:
        remedy = f"{'-'.join(map(str, order))} fires evenly; " if order else ""
    yield (
        f"cylinders.firing_order: fires at uneven intervals, {degrees(gaps)} deg; {remedy}"
        "state cylinders.firing_intervals if that is intended"
    )


def firing_summary(engine: Engine) -> dict[str, Any]:
    """Firing ``order`` from cylinder 1 on, and ``intervals_deg`` from each cylinder to the next."""
    angles, cycle = firing_angles(engine), engine.cylinders.cycle
    after = [(angle - angles[0] + SAME) % cycle - SAME for angle in angles]
    order = sorted(range(len(after)), key=after.__getitem__)
    gaps = intervals(after, cycle)
    return {"order": [k + 1 for k in order], "intervals_deg": [round(math.degrees(gap), 6) for gap in gaps]}


def firing_text(engine: Engine) -> str:
    """Firing order and intervals as a sentence."""
    found = firing_summary(engine)
    gaps = found["intervals_deg"]
    even = max(gaps) - min(gaps) < math.degrees(EVEN)
    every = f"every {gaps[0]:g} deg" if even else f"at intervals of {', '.join(f'{gap:g}' for gap in gaps)} deg"
    fires = "Fires" if engine.compressor is None else "Compresses"
    return f"{fires} {'-'.join(map(str, found['order']))}, {every}"


def degrees(angles: Sequence[float]) -> str:
    """Angles in degrees as text, for a sentence."""
    return ", ".join(f"{math.degrees(angle):.4g}" for angle in angles)


def from_first_cylinder(crank: Crankshaft, cylinders: Cylinders, rod: Rod) -> tuple[float, ...]:
    """Throw angles turned so that cylinder 1 fires at crank angle 0, rad; unchanged if it already does."""
    pin = cylinders.pins[0] if cylinders.pins else 0
    if not 1 <= pin <= len(crank.throw_angles) or not cylinders.bank_angles:
        return crank.throw_angles  # the checks report the fault
    n = len(cylinders.pins)
    given = len(cylinders.axis_offsets) in (0, n) and len(cylinders.bank_angles) == n
    if not given or not all(1 <= own <= len(crank.throw_angles) for own in cylinders.pins):
        return crank.throw_angles  # the checks report the fault
    turn = _centres(crank, cylinders, rod)[0]
    off = (turn + math.pi) % REVOLUTION - math.pi
    return crank.throw_angles if abs(off) < SAME else tuple(angle + off for angle in crank.throw_angles)


def _refused(reason: str, dead: Sequence[float], cylinders: Cylinders) -> InputError:
    """Error with an even firing order as a hint: the stated order with two cylinders exchanged, or any even order."""
    order = cylinders.firing_order
    near = [
        (*order[:i], order[j], *order[i + 1 : j], order[i], *order[j + 1 :])
        for i in range(1, len(order))
        for j in range(i + 1, len(order))
    ]
    found = ((other, intervals_of(dead, other, cylinders.cycle)) for other in near)
    hint = next(
        (other for other, gaps in found if gaps is not None and is_even(gaps)), even_order(dead, cylinders.cycle)
    )
    text = f"{'-'.join(map(str, hint))} would do; " if hint else ""
    return InputError(
        f"cylinders.firing_order: {reason}; {text}change firing_order or crankshaft.throw_angles, or state "
        "cylinders.firing_intervals if that is intended"
    )


def _as_stated(dead: Sequence[float], stated: Sequence[float], cycle: float, key: str) -> tuple[float, ...]:
    """Stated angles (rad, in the order of cylinder numbers) moved to the exact dead centres of the throws."""
    found = []
    for number, (own, angle) in enumerate(zip(dead, stated, strict=True), 1):
        reached = dead[0] + (angle - stated[0]) % cycle
        off = (own - reached + math.pi) % REVOLUTION - math.pi
        if abs(off) > STATED:
            later = ", or 360 deg later" if cycle > 1.5 * REVOLUTION else ""
            raise InputError(
                f"cylinders.{key}: cylinder {number} would fire {math.degrees(reached - dead[0]):.4g} deg after "
                f"cylinder 1, but its throw is at dead centre {math.degrees((own - dead[0]) % REVOLUTION):.4g} deg "
                f"after it{later}; change it, crankshaft.throw_angles or cylinders.bank_angles"
            )
        found.append(reached + off)
    return tuple(found)


def _by_intervals(
    dead: Sequence[float], order: Sequence[int], gaps: Sequence[float], cycle: float
) -> tuple[float, ...]:
    if abs(sum(gaps) - cycle) > STATED:
        raise InputError(
            f"cylinders.firing_intervals: they sum up to {math.degrees(sum(gaps)):.6g} deg, a cycle has "
            f"{math.degrees(cycle):g}; give one for each cylinder of firing_order, the last one from the last cylinder "
            "to the first"
        )
    stated, angle = [0.0] * len(order), 0.0
    for cylinder, gap in zip(order, gaps, strict=True):
        stated[cylinder - 1] = angle
        angle += gap
    return _as_stated(dead, stated, cycle, "firing_intervals")
