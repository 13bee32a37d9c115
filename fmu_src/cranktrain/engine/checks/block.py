"""Checks of an engine block and its mounts; faults are refused in one line before any CAD kernel runs."""

import itertools
import math
from functools import partial

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.rigid_slices import inertia_tensor
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Block, Mounts
from cranktrain.engine.quantities import check_values, mm, need, need_equal_lengths

LEAST_GAP = 1e-3
"""Least distance between surfaces that must not meet, m; the mesher fails on thinner slivers."""
FREE = ("along x", "along y", "along z", "about x", "about y", "about z (roll)")
_of = partial(need, "block")


def check_block(engine: Engine, block: Block) -> None:
    """Refuse a block that has no material left, or no room for its cylinders and its crankshaft.

    Raises ``InputError``, one line that starts with the key, e.g. ``block.liner_thickness``.
    """
    check_values(block, "block")
    _check_cylinder_room(engine, block)
    _check_housings(engine, block)
    _check_banks(engine, block)
    text = f"{mm(block.mesh_size)} would take millions of elements; give at least {mm(0.1 * engine.cylinders.bore)}"
    _of("mesh_size", block.mesh_size >= 0.1 * engine.cylinders.bore, text)
    if engine.mounts is not None:
        _check_pads(block, engine.mounts, engine.crankshaft.main_positions)


def _check_cylinder_room(engine: Engine, b: Block) -> None:
    """Refuse liners that meet other liners, the walls or the bulkheads, and crank webs that strike the block."""
    crank, bore, wall = engine.crankshaft, 0.5 * engine.cylinders.bore, b.wall_thickness
    sweep, liner = crank.throw + crank.web_pin_radius, bore + b.liner_thickness
    pitch, nearest, end = _spacing(engine, b)
    rooms = {
        "crankcase_half_width": b.crankcase_half_width - wall,
        "skirt_depth": b.skirt_depth,
        "foot_height": b.foot_height - wall,
    }
    for key, room in rooms.items():
        _of(key, room > sweep, f"the crankshaft's webs sweep {mm(sweep)} and strike the block; widen it")
    text = (
        f"liners of {mm(2.0 * liner)} outside meet at a cylinder pitch of {mm(pitch)}; give at most "
        f"{mm(0.5 * (pitch - LEAST_GAP) - bore)}"
    )
    _of("liner_thickness", pitch - 2.0 * liner >= LEAST_GAP, text)
    least = mm(liner + wall + LEAST_GAP)
    text = f"the bank's walls cut its liners, {mm(2.0 * liner)} outside; give at least {least}"
    _of("bank_half_width", 2.0 * (b.bank_half_width - wall - liner) >= LEAST_GAP, text)
    thickness = b.bulkhead_thickness
    text = f"{mm(thickness)} is thicker than the housings in it, {mm(b.housing_thickness)}"
    _of("bulkhead_thickness", thickness <= b.housing_thickness, text)
    text = (
        f"{mm(thickness)} reaches into a cylinder, whose middle lies {mm(nearest)} from that of the main bearing; "
        f"give at most {mm(2.0 * (nearest - bore - LEAST_GAP))}"
    )
    _of("bulkhead_thickness", 0.5 * thickness + bore + LEAST_GAP <= nearest, text)
    narrowest = min(crank.main_widths)
    text = f"{mm(b.housing_thickness)} does not fit between the throws; the narrowest main journal has {mm(narrowest)}"
    _of("housing_thickness", b.housing_thickness < narrowest, text)
    text = (
        f"the end walls cut the first or last liner: {mm(end)} from the block's end to the cylinder's middle, "
        f"{mm(liner + wall)} needed; give thicker housings or thinner walls and liners"
    )
    _of("housing_thickness", end - wall - liner >= LEAST_GAP, text)


def _check_housings(engine: Engine, b: Block) -> None:
    """Refuse housings of the main bores that have no material around the bore, or reach beyond the crankcase."""
    main, wall, tall = 0.5 * max(engine.main_bores), b.wall_thickness, b.foot_height - b.wall_thickness
    width, inside, outside = b.housing_half_width, b.crankcase_half_width - wall, engine.thrust.outer_diameter
    text = f"{mm(width)} leaves no iron beside the main bore, {mm(2.0 * main)}"
    _of("housing_half_width", width > main + wall, text)
    # A width that is derived from the same two values may differ from a stated width by rounding.
    _of(
        "housing_half_width",
        width <= inside + 1e-9,
        f"{mm(width)} goes through the crankcase's walls, {mm(inside)} inside",
    )
    between = f"must lie between the main bore with a wall, {mm(main + wall)}, and"
    # The feet of inclined banks are higher above the crank axis than those of upright banks.
    above = min(tall / max(math.cos(angle), 0.5) for angle in engine.cylinders.bank_angles)
    text = f"{mm(b.housing_height)} {between} the foot of the banks, {mm(above)}"
    _of("housing_height", main + wall < b.housing_height <= above, text)
    text = f"{mm(b.cap_depth)} {between} the skirt, {mm(b.skirt_depth)}"
    _of("cap_depth", main + wall < b.cap_depth <= b.skirt_depth, text)
    text = f"{mm(b.bulkhead_depth)} goes below the skirt, {mm(b.skirt_depth)}"
    _of("bulkhead_depth", b.bulkhead_depth <= b.skirt_depth, text)
    text = f"the thrust faces, {mm(outside)} outside, do not find room on their housing"
    _of("housing_half_width", outside < 2.0 * min(width, b.housing_height, b.cap_depth), text)


def _check_banks(engine: Engine, b: Block) -> None:
    """Refuse banks that overlap or have no height between foot and deck, and pistons that leave their liners."""
    throw, length, tall = engine.crankshaft.throw, engine.rod.length, b.foot_height - b.wall_thickness
    text = f"{mm(b.side_height)} is not below the foot of the banks, {mm(tall)}"
    _of("side_height", b.side_height < tall, text)
    angles = sorted(set(engine.cylinders.bank_angles))
    # A single bank has slightly less than a right angle on either side.
    sector = min([after - before for before, after in itertools.pairwise(angles)] + [0.999 * math.pi])
    widest = b.foot_height * math.tan(0.5 * sector)
    text = (
        f"{mm(b.bank_half_width)} lets neighbouring banks overlap at their foot; give at most {mm(widest)} or a larger "
        "foot_height"
    )
    _of("bank_half_width", b.bank_half_width <= widest, text)
    text = f"{mm(b.deck_thickness)} leaves nothing between foot and deck of the bank"
    _of("deck_thickness", b.deck_height - b.deck_thickness > b.foot_height, text)
    top, low = length + throw + 0.25 * throw, length - throw - 0.25 * throw
    text = (
        f"the piston pin rises to {mm(length + throw)} and its piston above the deck, {mm(b.deck_height)}; give more "
        f"than {mm(top)}"
    )
    _of("deck_height", top < b.deck_height, text)
    text = (
        f"the piston pin sinks to {mm(length - throw)} and its piston out of the liner, which ends at {mm(tall)}; give "
        f"less than {mm(low + b.wall_thickness)}"
    )
    _of("foot_height", low > tall, text)


def check_mounts(mounts: Mounts) -> None:
    """Refuse mounts whose lists of values differ in length, or that do not hold the engine in all six rigid motions.

    Raises ``InputError``, one line that starts with the key, or names the free motion.
    """
    need("mounts", "x", len(mounts.x) > 0, "is empty; give the place of each mount")
    need_equal_lengths(mounts, "mounts", *(key for key in vars(mounts) if not key.startswith("standing")))
    _check_standing(mounts)
    stiffness = mount_stiffness(mounts)
    # Rotations are scaled by the mounts' largest distance from their centre, to compare radians with metres.
    places = np.array(mounts.positions)
    reach = max(float(np.linalg.norm(places - places.mean(axis=0), axis=1).max()), 0.1)
    scale = np.array([1.0, 1.0, 1.0, *3 * (1.0 / reach,)])
    values, motions = np.linalg.eigh(scale[:, None] * stiffness * scale)
    if values[0] <= 1e-9 * max(values[-1], 1e-300):
        free = FREE[int(np.abs(motions[:, 0]).argmax())]
        raise InputError(
            f"mounts: they leave the engine free to move {free}; give stiffness in that direction or mounts that do "
            "not lie on one line"
        )


def _check_standing(mounts: Mounts) -> None:
    """Refuse a standing body that is not whole, or whose inertia no body has."""
    centre, given = mounts.standing_centre, mounts.standing_inertia
    if not (mounts.standing_mass or centre or given):
        return
    need("mounts", "standing_mass", mounts.standing_mass > 0.0, "is missing; the standing body needs it")
    need("mounts", "standing_centre", len(centre) == 3, f"{len(centre)} values; give x, y and z")
    need("mounts", "standing_inertia", len(given) in (3, 6), f"{len(given)} values; give three moments, or six")
    values = np.linalg.eigvalsh(inertia_tensor(given))
    text = "no body has it: each principal moment is positive and at most the sum of the others"
    need("mounts", "standing_inertia", values[0] > 0.0 and values[2] <= (1.0 + 1e-9) * (values[0] + values[1]), text)


def mount_stiffness(mounts: Mounts) -> np.ndarray:
    """Stiffness (6, 6) of all mounts for rigid motion of the engine about their centre; N/m, N, N m/rad."""
    places = np.array(mounts.positions)
    total = np.zeros((6, 6))
    for (x, y, z), stiffness in zip(places - places.mean(axis=0), mounts.stiffness, strict=True):
        motion = np.eye(6)
        motion[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
        total += motion.T @ (np.array(stiffness)[:, None] * motion)
    return total


def _spacing(engine: Engine, block: Block) -> tuple[float, float, float]:
    """Least distances between cylinders of a bank, of cylinder and main bearing, and of cylinder and block end, m."""
    cylinders, places = engine.cylinders, engine.cylinder_positions
    pitches = [math.inf]
    for angle in set(cylinders.bank_angles):
        row = sorted(z for z, own in zip(places, cylinders.bank_angles, strict=True) if own == angle)
        pitches += [b - a for a, b in itertools.pairwise(row)]
    mains = engine.crankshaft.main_positions
    half = 0.5 * block.housing_thickness
    nearest = min(abs(z - main) for z in places for main in mains)
    return min(pitches), nearest, min(min(places) - mains[0], mains[-1] - max(places)) + half


def _check_pads(block: Block, mounts: Mounts, mains: tuple[float, ...]) -> None:
    """Refuse mounts whose pads do not meet the crankcase's walls."""
    half, of = 0.5 * block.pad_size, partial(need, "mounts")
    front = mains[0] - 0.5 * block.housing_thickness + half
    rear = mains[-1] + 0.5 * block.housing_thickness - half
    clear, low, high = block.crankcase_half_width + half, -block.skirt_depth, block.side_height - block.pad_size
    for k, (x, y, z) in enumerate(mounts.positions, 1):
        text = f"mount {k} at {mm(x)} lies inside the crankcase; give at least {mm(clear)} to either side"
        of("x", abs(x) >= clear, text)
        text = f"the pad of mount {k} stands on {mm(y)} and must meet the crankcase's wall, {mm(low)} to {mm(high)}"
        of("y", low <= y <= high, text)
        text = f"mount {k} at {mm(z)} does not lie along the block, {mm(front)} to {mm(rear)}"
        of("z", front <= z <= rear, text)
