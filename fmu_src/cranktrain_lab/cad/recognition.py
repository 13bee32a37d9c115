"""Recognition of a crankshaft's dimensions in the surface of a solid.

Journals and pins are full cylinders about parallel axes. The main axis is the axis whose cylinders extend farthest
along it; cylinders off this axis are pins. Disc-shaped webs differ from journals, because the axis of a pin lies
within them. Journals end at the planes of their webs; the gap between cylinder and plane is the fillet.

In the crank's frame z runs from the pulley to the flywheel, z = 0 is the middle of main journal 1, and pin 1 points
along y.
"""

import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain_lab.cad.round_faces import Faces, across, classified
from cranktrain_lab.cad.step_file import StepSolid

PARALLEL = np.cos(np.radians(0.2))
FULL = 0.75
"""Least fraction of a full cylinder in a journal's faces, because oil bores and keyways remove a little."""
SAME_RADIUS, SAME_AXIS = 5e-3, 2e-3
"""Largest relative difference of radii, and distance of axes over the radius, of cylinders that count as equal."""
LEAST_PIN = 0.3
"""Least ratio of a pin's radius to the radius of the largest journal on the axis. Thinner cylinders are dowels."""
ORBIT, ALIKE = 0.02, 1.4
"""Largest relative difference of throws, and largest ratio of diameters, of pins with different diameters."""
REACH = 0.35
"""Largest distance of a web's plane from the end of its journal's cylinder (the fillet), relative to the radius."""
LISTED = 12
"""Largest number of journals whose sizes a note lists."""
COLLAR = 1.05
"""Ratio of a crank end's radius to the mains' radius above which the end is a flange."""


class Given(NamedTuple):
    """User's statements on an ambiguous solid: diameters in mm, number of mains, end of the pulley."""

    main_diameter: float | None = None
    pin_diameter: float | None = None
    mains: int | None = None
    pulley_end: str | None = None


class Round(NamedTuple):
    """Full cylinder: axis (x, y), radius and ends along z, mm, and its faces."""

    axis: tuple[float, float]
    radius: float
    start: float
    end: float
    faces: tuple[int, ...]

    @property
    def middle(self) -> float:
        """Middle of the cylinder along z, mm."""
        return 0.5 * (self.start + self.end)


class Journal(NamedTuple):
    """Main journal or pin.

    Attributes
    ----------
    cylinder : running surface
    start, end : planes of its webs along z, mm
    fillets : extent of each fillet along z, mm; 0 if the cylinder ends at the plane
    """

    cylinder: Round
    start: float
    end: float
    fillets: tuple[float, float]

    @property
    def width(self) -> float:
        """Width of the journal between the webs, mm."""
        return self.end - self.start


class RecognisedCrank(NamedTuple):
    """Crank found in a solid, in the crank's frame, mm.

    Attributes
    ----------
    solid, faces : surface and faces in the crank's frame
    turn, shift : rotation and shift of points p of the file, turn @ p + shift
    mains, pins : from the pulley to the flywheel
    bays : number of pins from each main to the next
    nose, flange : cylinder at either end; None if the shaft ends with the journal
    ends : z of both ends
    doubts : warnings on features that the engine file cannot describe
    """

    solid: StepSolid
    faces: Faces
    turn: Array
    shift: Array
    mains: tuple[Journal, ...]
    pins: tuple[Journal, ...]
    bays: tuple[int, ...]
    nose: Round | None
    flange: Round | None
    ends: tuple[float, float]
    doubts: tuple[str, ...]


def find_crank(solid: StepSolid, given: Given = Given()) -> RecognisedCrank:  # noqa: B008 - nothing is stated
    """Find journals, pins and ends of a crankshaft.

    Raises ``InputError`` if the solid is no crankshaft, or is ambiguous and needs :class:`Given`. The message states
    what was found.
    """
    faces = classified(solid)
    direction = _axis_direction(solid, faces)
    turn = np.vstack((*across(direction), direction))
    x, y = _main_axis(solid, moved(faces, turn, np.zeros(3)))
    shift = np.array([-x, -y, 0.0])
    on_axis, off_axis = _by_axis(_rounds(moved(faces, turn, shift)))
    mains, _ = _mains_and_pins(solid, on_axis, off_axis, given)
    if _flip(solid, given, turn, on_axis, mains):
        half = np.diag([1.0, -1.0, -1.0])
        turn, shift = half @ turn, half @ shift
    # The z axis is now the main axis from the pulley to the flywheel.
    on_axis, off_axis = _by_axis(_rounds(moved(faces, turn, shift)))
    mains, pins = _mains_and_pins(solid, on_axis, off_axis, given)
    first = _journal(moved(faces, turn, shift), mains[0])
    x, y = pins[0].axis
    c, s = y / np.hypot(x, y), x / np.hypot(x, y)
    final = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    turn, shift = final @ turn, final @ shift - [0.0, 0.0, 0.5 * (first.start + first.end)]
    own = moved(faces, turn, shift)
    on_axis, off_axis = _by_axis(_rounds(own))
    mains, pins = _mains_and_pins(solid, on_axis, off_axis, given)
    main_journals = tuple(_journal(own, main) for main in mains)
    pin_journals = tuple(_journal(own, pin) for pin in pins)
    bays = tuple(
        sum(before.middle < pin.middle < after.middle for pin in pins) for before, after in itertools.pairwise(mains)
    )
    nodes = solid.nodes @ turn.T + shift
    ends = float(nodes[:, 2].min()), float(nodes[:, 2].max())
    first, last = main_journals[0], main_journals[-1]
    front = [one for one in on_axis if one.end <= first.start + 1e-3 and one.end - one.start > 0.0]
    rear = [one for one in on_axis if one.start >= last.end - 1e-3]
    seat = [one for one in front if one.radius < first.cylinder.radius * COLLAR] or front
    return RecognisedCrank(
        solid._replace(nodes=nodes), own, turn, shift, main_journals, pin_journals, bays,
        max(seat, key=lambda one: one.radius * (one.end - one.start), default=None),
        max(rear, key=lambda one: one.radius, default=None), ends, _doubts(main_journals, pin_journals),
    )  # fmt: skip


def moved(faces: Faces, turn: Array, shift: Array) -> Faces:
    """Return a solid's faces in rotated and shifted axes."""
    return faces._replace(
        normal=faces.normal @ turn.T,
        centre=faces.centre @ turn.T + shift,
        corners=tuple(points @ turn.T + shift for points in faces.corners),
    )


def _axis_direction(solid: StepSolid, faces: Faces) -> Array:
    """Return the direction of most cylinders by area, with its largest component positive."""
    chosen = np.flatnonzero(faces.round)
    if chosen.size == 0:
        raise InputError(
            f"{solid.path}: no crankshaft: {len(faces.area)} faces, none of which is a cylinder; give the crankshaft "
            "with its journals as cylinders"
        )
    directions, area = faces.normal[chosen], faces.area[chosen]
    near = np.abs(directions @ directions.T) > PARALLEL
    best = int(np.argmax(near @ area))
    own = directions[near[best]] * np.sign(directions[near[best]] @ directions[best])[:, None]
    # Directions are weighted by squared area, because large faces have the most accurate direction.
    weight = area[near[best]] ** 2
    mean = (weight[:, None] * own).sum(axis=0)
    mean = mean / np.linalg.norm(mean)
    return np.asarray(mean * np.sign(mean[int(np.argmax(np.abs(mean)))]))


def _rounds(faces: Faces) -> list[Round]:
    """Return full cylinders along z, from adjoining faces with equal axis and radius."""
    chosen = [int(k) for k in np.flatnonzero(faces.round & (np.abs(faces.normal[:, 2]) > PARALLEL))]
    pieces = []
    for k in chosen:
        z, n = faces.corners[k][:, 2], faces.normal[k]
        at = faces.centre[k] + (z.mean() - faces.centre[k][2]) / n[2] * n
        pieces.append((at[0], at[1], faces.radius[k], float(z.min()), float(z.max()), k))
    pieces.sort(key=lambda piece: piece[3])
    groups: list[list[Any]] = []
    for piece in pieces:
        for group in groups:
            x, y, r = group[0][:3]
            reach = max(one[4] for one in group) + 1e-3 * r
            same = abs(r - piece[2]) < SAME_RADIUS * r and np.hypot(x - piece[0], y - piece[1]) < SAME_AXIS * r
            if same and piece[3] <= reach:
                group.append(piece)
                break
        else:
            groups.append([piece])
    found = []
    for group in groups:
        start, end = min(one[3] for one in group), max(one[4] for one in group)
        weights = np.array([faces.area[one[5]] for one in group])
        x, y, r = (float(np.average([one[k] for one in group], weights=weights)) for k in range(3))
        if weights.sum() > FULL * 2.0 * np.pi * r * (end - start):
            found.append(Round((x, y), r, start, end, tuple(one[5] for one in group)))
    return sorted(found, key=lambda one: one.middle)


def _by_axis(rounds: Sequence[Round], origin: tuple[float, float] = (0.0, 0.0)) -> tuple[list[Round], list[Round]]:
    """Split cylinders into two lists: cylinders about an axis along z, and all others."""
    off = [np.hypot(one.axis[0] - origin[0], one.axis[1] - origin[1]) > 0.02 * one.radius for one in rounds]
    on_axis = [one for one, away in zip(rounds, off, strict=True) if not away]
    return on_axis, [one for one, away in zip(rounds, off, strict=True) if away]


def _main_axis(solid: StepSolid, faces: Faces) -> tuple[float, float]:
    """Return x, y of the main axis, mm, which is the axis whose cylinders extend farthest along it."""
    rounds = _rounds(faces)
    if not rounds:
        raise InputError(
            f"{solid.path}: no crankshaft: no cylinder goes round by more than {100 * FULL:.0f} % (a half crank, cut "
            "along its axis?): give the whole crankshaft"
        )
    coaxial = [_by_axis(rounds, one.axis)[0] for one in rounds]
    spans = [max(one.end for one in same) - min(one.start for one in same) for same in coaxial]
    longest = [one for one, span in zip(rounds, spans, strict=True) if span > 0.999 * max(spans)]
    weights = [one.radius * (one.end - one.start) for one in longest]
    x, y = (float(np.average([one.axis[k] for one in longest], weights=weights)) for k in range(2))
    return x, y


def _mains_and_pins(
    solid: StepSolid, on_axis: list[Round], off_axis: list[Round], given: Given
) -> tuple[list[Round], list[Round]]:
    """Return main journals and pins among the full cylinders; an ``InputError`` lists the cylinders found."""
    said = f"{solid.path}: no crankshaft"
    largest = max(on_axis, key=lambda one: one.radius * (one.end - one.start)).radius
    pins = [one for one in off_axis if one.radius > LEAST_PIN * largest and not _is_disc(one, largest)]
    pins = _of_diameter(solid, pins, given.pin_diameter, "pin")
    if not pins:
        sizes = ", ".join(sorted({f"{2 * one.radius:.4g}" for one in on_axis}))
        raise InputError(
            f"{said}: cylinders of {sizes} mm on one axis and no pin off it; give a solid with journals and pins"
        )
    pins = _thinnest(off_axis, pins, largest)
    least = min(one.radius for one in pins)
    throw = max(float(np.hypot(*one.axis)) for one in pins)
    shafts = [one for one in on_axis if one.radius < throw + 0.5 * least]
    shafts = _of_diameter(solid, shafts, given.main_diameter, "main")
    first, last = pins[0], pins[-1]
    before = [one for one in shafts if one.end <= first.start]
    after = [one for one in shafts if one.start >= last.end]
    between = [one for one in shafts if one.start >= first.end and one.end <= last.start]
    if not before or not after:
        side = "before the first" if not before else "behind the last"
        raise InputError(
            f"{said}: {len(pins)} pins of {2 * least:.4g} mm, and no main journal {side} pin (a part of a crank?): "
            "give the whole crankshaft"
        )
    radius = _main_radius(before, after, between)
    mains = [_nearest(before, radius, first.start)]
    for one, other in itertools.pairwise(pins):
        gap = [shaft for shaft in between if shaft.start >= one.end and shaft.end <= other.start]
        if gap:
            same = _merged([shaft for shaft in gap if abs(shaft.radius - radius) < 0.02 * radius])
            mains.append(max(same or gap, key=lambda shaft: shaft.radius * (shaft.end - shaft.start)))
    mains.append(_nearest(after, radius, last.end))
    if given.mains is not None and len(mains) != given.mains:
        places = ", ".join(f"{2 * one.radius:.4g}" for one in mains)
        raise InputError(
            f"{solid.path}: found {len(mains)} main journals (diameters {places} mm), --mains says {given.mains}: "
            "state --main-diameter-mm, or leave --mains out"
        )
    return mains, pins


def _thinnest(off_axis: list[Round], pins: list[Round], largest: float) -> list[Round]:
    """Return pins among cylinders off the axis: the thinnest cylinders, and other diameters with an equal throw.

    Collars and round webs about a pin's axis are excluded, because they adjoin a thinner cylinder, the pin.
    """
    least = min(one.radius for one in pins)
    surest = [one for one in pins if one.radius < 1.02 * least]
    orbit = float(np.median([np.hypot(*one.axis) for one in surest]))

    low, high = max(LEAST_PIN * largest, least / ALIKE), ALIKE * least
    found = [
        one
        for one in off_axis
        if one in surest
        or (abs(np.hypot(*one.axis) - orbit) < ORBIT * orbit and low < one.radius < high and not _is_disc(one, largest))
    ]
    return _merged([one for one in found if not any(_adjoins(one, other) for other in found)])


def _adjoins(one: Round, other: Round) -> bool:
    """True if ``other`` is a thinner cylinder about the same axis that adjoins ``one``, at most a fillet apart."""
    apart = np.hypot(one.axis[0] - other.axis[0], one.axis[1] - other.axis[1])
    gap = max(one.start, other.start) - min(one.end, other.end)
    return bool(other.radius < 0.98 * one.radius and apart < SAME_AXIS * 10.0 * one.radius and gap < REACH * one.radius)


def _is_disc(one: Round, main_radius: float) -> bool:
    """True if a cylinder off the axis surrounds the main journal, as a round web does."""
    return float(np.hypot(*one.axis)) + 0.9 * main_radius < one.radius


def _of_diameter(solid: StepSolid, rounds: list[Round], diameter: float | None, what: str) -> list[Round]:
    """Return cylinders of a stated diameter, mm, within one per cent; all if none is stated."""
    if diameter is None:
        return rounds
    own = [one for one in rounds if abs(2.0 * one.radius - diameter) < 0.01 * diameter]
    if not own:
        sizes = ", ".join(sorted({f"{2 * one.radius:.4g}" for one in rounds})) or "none"
        raise InputError(
            f"{solid.path}: no cylinder of --{what}-diameter-mm {diameter:g}; diameters found there: {sizes} mm"
        )
    return own


def _merged(rounds: list[Round]) -> list[Round]:
    """Merge cylinders of equal axis and radius that only a groove separates."""
    found: list[Round] = []
    for one in sorted(rounds, key=lambda each: each.middle):
        if found:
            before = found[-1]
            apart = np.hypot(one.axis[0] - before.axis[0], one.axis[1] - before.axis[1])
            lengths = (one.end - one.start) + (before.end - before.start)
            if apart < SAME_AXIS * one.radius and one.start - before.end < 0.25 * lengths:
                found[-1] = before._replace(end=max(one.end, before.end), faces=(*before.faces, *one.faces))
                continue
        found.append(one)
    return found


def _main_radius(before: list[Round], after: list[Round], between: list[Round]) -> float:
    """Return the mains' radius: the radius with most area between pins, else the nearest radius on both sides."""
    if between:
        return _commonest(between)
    for one in sorted(before, key=lambda each: -each.end):
        if any(abs(one.radius - other.radius) < 0.02 * one.radius for other in after):
            return one.radius
    return _commonest([before[-1], after[0]])


def _commonest(rounds: list[Round]) -> float:
    def area(radius: float) -> float:
        same = (one for one in rounds if abs(one.radius - radius) < 0.02 * radius)
        return sum(one.radius * (one.end - one.start) for one in same)

    return max((one.radius for one in rounds), key=area)


def _nearest(rounds: list[Round], radius: float, z: float) -> Round:
    """Return the cylinder of this radius nearest to a position z, or the nearest of any radius if none has it."""
    same = _merged([one for one in rounds if abs(one.radius - radius) < 0.02 * radius])
    return min(same or rounds, key=lambda one: abs(one.middle - z))


def _flip(solid: StepSolid, given: Given, turn: Array, on_axis: list[Round], mains: list[Round]) -> bool:
    """True if the pulley is at the end of larger z; ``InputError`` if the ends are ambiguous and it is not stated."""
    axis = int(np.argmax(np.abs(turn[2])))
    sign = 1.0 if turn[2, axis] > 0.0 else -1.0
    low, high = ("-" if sign > 0 else "+") + "xyz"[axis], ("+" if sign > 0 else "-") + "xyz"[axis]
    if given.pulley_end is not None:
        if given.pulley_end not in (low, high):
            text = f"--pulley-end {given.pulley_end}: the crank lies along {low[1]}; give {low} or {high}"
            raise InputError(f"{solid.path}: {text}")
        return given.pulley_end == high
    radius = float(np.median([one.radius for one in mains]))
    front = max((one.radius for one in on_axis if one.end <= mains[0].start + 0.1 * radius), default=0.0)
    rear = max((one.radius for one in on_axis if one.start >= mains[-1].end - 0.1 * radius), default=0.0)
    wide = front > COLLAR * radius, rear > COLLAR * radius
    if wide[0] == wide[1]:
        ends = "both ends have a flange" if wide[0] else "neither end has a flange"
        raise InputError(
            f"{solid.path}: {ends} (largest diameters {2 * front:.4g} mm at {low}, {2 * rear:.4g} mm at {high}): state "
            f"where the pulley is, --pulley-end {low} or {high}"
        )
    return wide[0]


def _journal(faces: Faces, cylinder: Round) -> Journal:
    """Return a cylinder with the planes of its webs and its fillets."""
    planes = np.flatnonzero(faces.plane & (np.abs(faces.normal[:, 2]) > PARALLEL))
    reach = REACH * cylinder.radius
    touching = []
    for k in planes:
        points = faces.corners[k]
        near = np.hypot(points[:, 0] - cylinder.axis[0], points[:, 1] - cylinder.axis[1]).min()
        if near < cylinder.radius + 1.2 * reach:
            touching.append(float(points[:, 2].mean()))
    z = np.array(touching)
    slack = 1e-3 * cylinder.radius
    before = z[(z <= cylinder.start + slack) & (z > cylinder.start - reach)]
    after = z[(z >= cylinder.end - slack) & (z < cylinder.end + reach)]
    start = float(before.max()) if before.size else cylinder.start
    end = float(after.min()) if after.size else cylinder.end
    fillets = max(cylinder.start - start, 0.0), max(end - cylinder.end, 0.0)
    return Journal(cylinder, start, end, fillets)


def _doubts(mains: tuple[Journal, ...], pins: tuple[Journal, ...]) -> tuple[str, ...]:
    """Return warnings on dimensions that vary along the crank but have one value in the engine file."""
    found = []
    for what, values in (
        ("main journals have diameters", [2.0 * one.cylinder.radius for one in mains]),
        ("pins have diameters", [2.0 * one.cylinder.radius for one in pins]),
        ("pins have widths", [one.width for one in pins]),
    ):
        if np.ptp(values) > 0.02:
            each = f" ({', '.join(f'{value:.2f}' for value in values)})" if len(values) <= LISTED else ""
            found.append(f"{what} of {min(values):.2f} to {max(values):.2f} mm{each}; the engine file has their median")
    return tuple(found)
