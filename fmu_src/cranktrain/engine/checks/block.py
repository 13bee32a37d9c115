"""Which parameters describe an engine block and its mounts: refused in one line before any CAD kernel sees them."""

from __future__ import annotations

import itertools
import math

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.engine.checks.crankshaft import in_mm
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Block, Mounts

LEAST_GAP = 1e-3
"""Least distance between surfaces that must not meet, m: the mesher fails on thinner slivers."""
FREE = ("along x", "along y", "along z", "about x", "about y", "about z (roll)")
STIFFNESSES = ("stiffness_x", "stiffness_y", "stiffness_z", "stiffness_rx", "stiffness_ry", "stiffness_rz")


def check_block(engine: Engine, block: Block) -> None:
    """Refuse a block that leaves no iron, or no room for its cylinders and its crankshaft.

    Raises
    ------
    InputError
        one line that starts with the key, e.g. ``block.liner_thickness``
    """
    b, crank, cylinders = block, engine.crankshaft, engine.cylinders
    bore, wall = 0.5 * cylinders.bore, b.wall_thickness
    sweep = crank.throw + crank.web_pin_radius
    pitch, nearest, end = _spacing(engine)
    liner = bore + b.liner_thickness
    sector = _half_sector(cylinders.bank_angles)
    pin_top, pin_low = engine.rod.length + crank.throw, engine.rod.length - crank.throw
    main = 0.5 * max(engine.main_bores)
    tall = b.foot_height - wall
    rules: tuple[tuple[bool, str, str], ...] = (
        *(
            (0.0 < value < 10.0, key, "must be positive and below 10 m; check its unit")
            for key, value in vars(b).items()
            if isinstance(value, float) and key.endswith(("height", "thickness", "width", "depth", "size"))
        ),
        (0.0 < b.poisson_ratio < 0.5, "poisson_ratio", "must lie in (0, 0.5)"),
        (b.damping_ratio < 1.0, "damping_ratio", f"{b.damping_ratio} is overcritical; give a ratio below 1"),
        (b.fixed_modes >= 1, "fixed_modes", "at least one fixed-interface mode is needed"),
        (
            min(b.crankcase_half_width - wall, b.skirt_depth, tall) > sweep,
            "crankcase_half_width"
            if b.crankcase_half_width - wall <= sweep
            else ("skirt_depth" if b.skirt_depth <= sweep else "foot_height"),
            f"the crankshaft's webs sweep {in_mm(sweep)} and strike the block; widen it",
        ),
        (
            pitch - 2.0 * liner >= LEAST_GAP,
            "liner_thickness",
            f"liners of {in_mm(2.0 * liner)} outside meet at a cylinder pitch of {in_mm(pitch)}; give at most "
            f"{in_mm(0.5 * (pitch - LEAST_GAP) - bore)}",
        ),
        (
            2.0 * (b.bank_half_width - wall - liner) >= LEAST_GAP,
            "bank_half_width",
            f"the bank's walls cut its liners, {in_mm(2.0 * liner)} outside; give at least "
            f"{in_mm(liner + wall + LEAST_GAP)}",
        ),
        (
            b.bulkhead_thickness <= b.housing_thickness,
            "bulkhead_thickness",
            f"{in_mm(b.bulkhead_thickness)} is thicker than the housings in it, {in_mm(b.housing_thickness)}",
        ),
        (
            0.5 * b.bulkhead_thickness + bore + LEAST_GAP <= nearest,
            "bulkhead_thickness",
            f"{in_mm(b.bulkhead_thickness)} reaches into a cylinder, whose middle lies {in_mm(nearest)} from that of "
            f"the main bearing; give at most {in_mm(2.0 * (nearest - bore - LEAST_GAP))}",
        ),
        (
            b.housing_thickness < min(crank.main_widths),
            "housing_thickness",
            f"{in_mm(b.housing_thickness)} does not fit between the throws; the narrowest main journal has "
            f"{in_mm(min(crank.main_widths))}",
        ),
        (
            end - wall - liner >= LEAST_GAP,
            "housing_thickness",
            f"the end walls cut the first or last liner: {in_mm(end)} from the block's end to the cylinder's middle, "
            f"{in_mm(liner + wall)} needed; give thicker housings or thinner walls and liners",
        ),
        (
            b.housing_half_width > main + wall,
            "housing_half_width",
            f"{in_mm(b.housing_half_width)} leaves no iron beside the main bore, {in_mm(2.0 * main)}",
        ),
        (
            b.housing_half_width <= b.crankcase_half_width - wall,
            "housing_half_width",
            f"{in_mm(b.housing_half_width)} goes through the crankcase's walls, {in_mm(b.crankcase_half_width - wall)} "
            "inside",
        ),
        (
            main + wall < b.housing_height <= tall,
            "housing_height",
            f"{in_mm(b.housing_height)} must lie between the main bore with a wall, {in_mm(main + wall)}, and "
            f"the foot of the banks, {in_mm(tall)}",
        ),
        (
            main + wall < b.cap_depth <= b.skirt_depth,
            "cap_depth",
            f"{in_mm(b.cap_depth)} must lie between the main bore with a wall, {in_mm(main + wall)}, and the "
            f"skirt, {in_mm(b.skirt_depth)}",
        ),
        (
            b.bulkhead_depth <= b.skirt_depth,
            "bulkhead_depth",
            f"{in_mm(b.bulkhead_depth)} goes below the skirt, {in_mm(b.skirt_depth)}",
        ),
        (
            b.side_height < tall,
            "side_height",
            f"{in_mm(b.side_height)} is not below the foot of the banks, {in_mm(tall)}",
        ),
        (
            b.bank_half_width <= b.foot_height * math.tan(sector),
            "bank_half_width",
            f"{in_mm(b.bank_half_width)} lets neighbouring banks overlap at their foot; give at most "
            f"{in_mm(b.foot_height * math.tan(sector))} or a larger foot_height",
        ),
        (
            b.deck_height - b.deck_thickness > b.foot_height,
            "deck_thickness",
            f"{in_mm(b.deck_thickness)} leaves nothing between foot and deck of the bank",
        ),
        (
            pin_top + 0.125 * 2.0 * crank.throw < b.deck_height,
            "deck_height",
            f"the piston pin rises to {in_mm(pin_top)} and its piston above the deck, {in_mm(b.deck_height)}; give "
            f"more than {in_mm(pin_top + 0.25 * crank.throw)}",
        ),
        (
            pin_low - 0.125 * 2.0 * crank.throw > tall,
            "foot_height",
            f"the piston pin sinks to {in_mm(pin_low)} and its piston out of the liner, which ends at {in_mm(tall)}; "
            f"give less than {in_mm(pin_low - 0.25 * crank.throw + wall)}",
        ),
        (
            engine.thrust.outer_diameter < 2.0 * min(b.housing_half_width, b.housing_height, b.cap_depth),
            "housing_half_width",
            f"the thrust faces, {in_mm(engine.thrust.outer_diameter)} outside, do not find room on their housing",
        ),
        (
            b.mesh_size >= 0.1 * cylinders.bore,
            "mesh_size",
            f"{in_mm(b.mesh_size)} would take millions of elements; give at least {in_mm(0.1 * cylinders.bore)}",
        ),
    )
    for holds, key, text in rules:
        if not holds:
            raise InputError(f"block.{key}: {text}")
    if engine.mounts is not None:
        _check_pads(block, engine.mounts, engine.crankshaft.main_positions)


def check_mounts(mounts: Mounts) -> None:
    """Refuse mounts that do not match each other, or leave the engine free to move as a whole.

    Raises
    ------
    InputError
        one line that starts with the key, or says which motion is free
    """
    count = len(mounts.x)
    if not count:
        raise InputError("mounts.x: is empty; give the place of each mount")
    for key, entries in vars(mounts).items():
        if len(entries) != count:
            raise InputError(f"mounts.{key}: {len(entries)} entries for {count} mounts in mounts.x; give one for each")
    stiffness = mount_stiffness(mounts)
    # Metres and radians are compared at the mounts' own distance from their middle.
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


def mount_stiffness(mounts: Mounts) -> np.ndarray:
    """Stiffness (6, 6) of all mounts against motion of the engine as a whole about their middle; N/m, N, N m/rad."""
    places = np.array(mounts.positions)
    total = np.zeros((6, 6))
    for (x, y, z), stiffness in zip(places - places.mean(axis=0), mounts.stiffness, strict=True):
        motion = np.eye(6)
        motion[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
        total += motion.T @ (np.array(stiffness)[:, None] * motion)
    return total


def _spacing(engine: Engine) -> tuple[float, float, float]:
    """Least distance of cylinders in a bank, of a cylinder from a main bearing, and from the block's end, m."""
    cylinders, places = engine.cylinders, engine.cylinder_positions
    pitches = [math.inf]
    for angle in set(cylinders.bank_angles):
        row = sorted(z for z, own in zip(places, cylinders.bank_angles, strict=True) if own == angle)
        pitches += [b - a for a, b in itertools.pairwise(row)]
    mains = engine.crankshaft.main_positions
    half = 0.5 * engine.block.housing_thickness if engine.block is not None else 0.0
    nearest = min(abs(z - main) for z in places for main in mains)
    return min(pitches), nearest, min(min(places) - mains[0], mains[-1] - max(places)) + half


def _half_sector(bank_angles: tuple[float, ...]) -> float:
    """Half the least angle between banks, at most that of a bank alone (a right angle, less rounding)."""
    angles = sorted(set(bank_angles))
    return 0.5 * min([b - a for a, b in itertools.pairwise(angles)] + [0.999 * math.pi])


def _check_pads(block: Block, mounts: Mounts, mains: tuple[float, ...]) -> None:
    half = 0.5 * block.pad_size
    front, rear = mains[0] - 0.5 * block.housing_thickness, mains[-1] + 0.5 * block.housing_thickness
    clear = block.crankcase_half_width + half
    for k, (x, y, z) in enumerate(mounts.positions, 1):
        if abs(x) < clear:
            raise InputError(
                f"mounts.x: mount {k} at {in_mm(x)} lies inside the crankcase; give at least {in_mm(clear)} to either "
                "side"
            )
        if not -block.skirt_depth <= y <= block.side_height - block.pad_size:
            raise InputError(
                f"mounts.y: the pad of mount {k} stands on {in_mm(y)} and must meet the crankcase's upright wall, "
                f"{in_mm(-block.skirt_depth)} to {in_mm(block.side_height - block.pad_size)}"
            )
        if not front + half <= z <= rear - half:
            raise InputError(
                f"mounts.z: mount {k} at {in_mm(z)} does not lie along the block, {in_mm(front + half)} to "
                f"{in_mm(rear - half)}"
            )
