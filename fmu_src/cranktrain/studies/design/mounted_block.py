"""Block, mounts and piston guidance of a new engine, so that it runs with ``--block flexible``.

Walls have the same ratio to the bore as those of the shipped in-line six (:data:`WALL` and others), and are thinner if
the cylinders stand closer. Heights follow from crank and rod. The mounts are four rubber springs. Their stiffness gives
the engine the natural frequencies :data:`MOUNT_HZ`. Its mass is that of the block's plates, the heads and the moving
parts.
"""

import itertools
import math

from cranktrain.core.errors import InputError
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Block as BlockPart
from cranktrain.engine.quantities import mm
from cranktrain.structure.block.shape import BlockPlan, block_plan, outlines
from cranktrain.structure.crank.sections import crank_moments
from cranktrain.studies.design.document import Block, Document, Entry, chosen, derived
from cranktrain.studies.design.layouts import BOXER
from cranktrain.studies.design.sizes import Sizes

WALL, LINER, BULKHEAD, BESIDE, DECK, COVER, PAD = 0.133, 0.067, 0.19, 0.11, 0.15, 0.057, 0.57
"""Dimensions of a block over the bore, from the shipped six-cylinder engine: thickness of walls, liners and bulkheads,
room next to the liners, deck, bottom cover, mounts' pads."""
VEE_WALL, VEE_LINER = 0.10, 0.05
"""Thickness of walls and liners of a V engine over the bore; smaller because its banks are closer; chosen."""
GAP = 1.5e-3
"""Least distance between surfaces of the block's solid that must not touch, m."""
HEAD = 9000.0
"""Mass of a cylinder's head, valve train and manifolds over the bore cubed, kg/m³; 8600 and 9300 in shipped engines."""
IRON, IRON_DENSITY = 110e9, 7200.0
"""Grey cast iron, Pa and kg/m³."""
MOUNT_HZ = (8.5, 10.5, 8.5)
"""Natural frequencies, Hz, of the engine on its mounts along x, y and z; chosen from a usual range of 5 to 15."""
MOUNT_RATIO = 0.07
"""Damping ratio of the mounts; chosen, rubber has 0.05 to 0.1."""
BEND = 2.9e-4
"""Rotational stiffness of a mount over its stiffness along y, m², at a bore of 0.105 m; scaled by the bore squared. The
shipped six-cylinder engine has 100 N m/rad and 4e5 N/m."""


def piston_guidance(s: Sizes) -> Block:
    """Table of the piston skirt: stiffness and damping of the shipped six-cylinder engine, scaled by the bore."""
    b = s.bore
    height = 0.75 if s.fuel_name == "diesel" else 0.6
    return Block("piston_guidance", "Skirt in the liner; used with --pistons guided and in a flexible block.", (
        derived("upper_stiffness", 5.7e8 * b, "N/m", "5.7e8 N/m^2 x B, as the shipped six: ring belt and upper skirt"),
        derived("lower_stiffness", 3.8e8 * b, "N/m", "3.8e8 N/m^2 x B, as the shipped six: lower skirt"),
        derived("upper_height", 190.0 * b, "mm", "0.19 B above the pin"),
        derived("lower_height", -285.0 * b, "mm", "0.285 B below the pin"),
        derived("upper_damping", 1.9e4 * b, "N s/m", "oil film on the skirt, as the shipped six over the bore"),
        derived("lower_damping", 1.9e4 * b, "N s/m", "oil film on the skirt, as the shipped six over the bore"),
        derived("mass_height", 50.0 * b, "mm", "0.05 B above the pin"),
        derived("tilt_inertia", s.piston_mass * b**2 * (0.75 + height**2) / 12.0, "kg m^2",
                f"a cylinder {height:g} B high: m (3 r^2 + h^2) / 12"),
        chosen("clearance", 0.0, "mm", "radial play of the skirt; 0: springs without play"),
        chosen("friction", 0.05, "1", "mixed lubrication of skirt and rings"),
        chosen("sliding_speed", 0.1, "m/s", "speed at which friction is full"),
    ))  # fmt: skip


def mounted_block(made: Document, s: Sizes) -> tuple[Block, Block]:
    """Tables ``[block]`` and ``[mounts]``; ``InputError`` if the cylinders leave no room for the block."""
    block = _block(s, made.engine)
    engine = made.with_blocks(block, _mounts(s, made.engine, block, 1.0)).engine
    return block, _mounts(s, engine, block, mounted_mass(engine))


def _block(s: Sizes, engine: Engine) -> Block:
    """Table of a block around the engine's crank and cylinders."""
    b, crank, rod = s.bore, engine.crankshaft, engine.rod.length
    if s.layout.form == BOXER:
        raise InputError("--mounts: there is no parametric block for a boxer; leave the option out, or take your own "
                         "mesh of the block (--block-mesh)")  # fmt: skip
    housing = min(crank.main_widths) - 0.02 * b
    places, mains = engine.cylinder_positions, engine.crankshaft.main_positions
    banks = engine.cylinders.bank_angles
    pitches = [math.inf]
    for angle in set(banks):
        row = sorted(z for z, own in zip(places, banks, strict=True) if own == angle)
        pitches += [after - before for before, after in itertools.pairwise(row)]
    nearest = min(abs(z - main) for z in places for main in mains)
    pitch, end = min(pitches), min(min(places) - mains[0], mains[-1] - max(places))
    thick, thin = (VEE_WALL, VEE_LINER) if s.vee else (WALL, LINER)
    liner = min(thin * b, 0.5 * (pitch - b - GAP))
    wall = min(thick * b, end + 0.5 * housing - 0.5 * b - liner - GAP)
    bulkhead = min(BULKHEAD * b, 2.0 * (nearest - 0.5 * b - GAP), housing)
    sweep = crank.throw + crank.web_pin_radius
    heavy = max(sweep, crank.counterweight_radius)
    low, high = sweep + wall + 2.0 * GAP, rod - 1.25 * crank.throw + wall - GAP
    foot = min(max(heavy + wall + 0.03 * b, low), 0.5 * (low + high)) if low < high else low
    half = 0.5 * b + liner + wall + GAP
    lean = math.radians(0.5 * s.layout.bank_deg) if s.vee else 0.0
    # Distance between the feet of a V's banks, so large that an edge between the feet stays inside the walls.
    apart = (half * math.cos(lean) + wall * math.tan(0.5 * lean) + GAP) / math.sin(lean) if lean else 0.0
    foot = max(foot, apart)
    for name, size in (("bulkheads", bulkhead - 0.05 * b), ("walls", wall - 0.04 * b), ("liners", liner - 0.03 * b)):
        if size < 0.0:
            raise InputError(
                f"--mounts: cylinders {mm(nearest)} from the middle of a main bearing leave no room for the {name} of "
                "the parametric block; leave the option out, or take your own mesh of the block (--block-mesh)"
            )
    if foot > high:
        raise InputError(
            f"--mounts: the pistons would leave their liners, which begin {mm(foot - wall)} above the crank; give a "
            f"rod of {math.ceil(1e3 * (foot - wall + 1.25 * crank.throw + GAP))} mm or more (--rod-mm)"
        )
    inside = max(heavy + 0.04 * b, 0.5 * max(engine.main_bores) + 1.2 * wall, 0.55 * engine.thrust.outer_diameter)
    room = (foot * math.sin(lean) - wall * math.tan(0.5 * lean) - GAP) / math.cos(lean) if lean else math.inf
    bank = min(half + BESIDE * b, max(room, half))
    skirt = heavy + 0.15 * b
    tall = foot - wall
    top = min(1.0 * b, 0.98 * tall)
    cap = min(0.95 * b, 0.98 * skirt)
    six = "of the shipped six"
    text = "One casting around crank and cylinders, with its bottom cover; heads are masses on the deck."
    return Block("block", text, (
        chosen("youngs_modulus", 1e-9 * IRON, "GPa", "grey cast iron"),
        chosen("poisson_ratio", 0.26, "1", "cast iron"), chosen("density", IRON_DENSITY, "kg/m^3", "cast iron"),
        _mm("deck_height", rod + crank.throw + 0.67 * b, "throw, rod and 0.67 B from the piston pin to its crown"),
        _mm("deck_thickness", DECK * b, f"{DECK:g} B, {six}"),
        _mm("foot_height", foot, f"clear of webs, counterweights{' and the other bank' if foot == apart else ''}"),
        _mm("bank_half_width", bank, "liner and wall with room for water"),
        _mm("liner_thickness", liner, f"{thin:g} B, or less where cylinders stand closer"),
        _mm("crankcase_half_width", inside + wall, "outside; clear of webs and counterweights"),
        _mm("side_height", min(0.57 * b, 0.9 * tall), "0.57 B"),
        _mm("skirt_depth", skirt, "webs and counterweights and 0.15 B"),
        _mm("wall_thickness", wall, f"{thick:g} B, or less where the outer cylinders stand closer to the ends"),
        _mm("bulkhead_thickness", bulkhead, f"{BULKHEAD:g} B, {six}, or up to the cylinders"),
        _mm("bulkhead_depth", 0.9 * skirt, "0.9 of the skirt: caps tied to it"),
        _mm("housing_thickness", housing, "0.02 B less than the narrowest main journal"),
        _mm("housing_half_width", inside - GAP, "up to the walls"),
        _mm("housing_height", top, "B, or up to the foot"),
        _mm("cap_depth", cap, "0.95 B"), _mm("cover_thickness", COVER * b, f"{COVER:g} B, {six}"),
        _mm("pad_size", PAD * b, f"{PAD:g} B, {six}"),
        derived("head_mass", HEAD * b**3, "kg", f"of each cylinder, with valve train: {1e-3 * HEAD:g} g/cm^3 x B^3"),
        _mm("head_height", 0.52 * b, "0.52 B above the deck"),
        chosen("damping_ratio", 0.02, "1", "every elastic mode of the block"),
        _mm("mesh_size", 0.40 * b, "largest element edge"),
        chosen("fixed_modes", 120, "", "fixed-interface modes kept"),
        derived("running_cutoff_hz", float(f"{73.5 / b:.2g}"), "Hz", "73.5 m/s over B; modes of the running model"),
    ))  # fmt: skip


def _mounts(s: Sizes, engine: Engine, block: Block, mass: float) -> Block:
    """Table of four mounts next to the crankcase, for a supported mass, kg."""
    size = {entry.key: entry.si for entry in block.entries}
    mains, half, pad = engine.crankshaft.main_positions, size["crankcase_half_width"], size["pad_size"]
    first = mains[0] - 0.5 * size["housing_thickness"] + 0.5 * pad + GAP
    last = mains[-1] + 0.5 * size["housing_thickness"] - 0.5 * pad - GAP
    x, y = half + 0.5 * pad + 0.05 * s.bore, min(-0.285 * s.bore, size["side_height"] - pad - GAP)
    share = 0.17 if len(mains) > 3 else 0.0
    front, rear = (max(first, min(last, mains[0] + one * (mains[-1] - mains[0]))) for one in (share, 1.0 - share))
    k = [mass * (2.0 * math.pi * hz) ** 2 / 4.0 for hz in MOUNT_HZ]
    c = [2.0 * MOUNT_RATIO * one / (2.0 * math.pi * hz) for one, hz in zip(k, MOUNT_HZ, strict=True)]
    rubber = f"a quarter of {mass:.3g} kg at %g Hz; motions of three cylinders and more lie at 5 to 15 Hz"
    entries: list[Entry] = [
        chosen("x", _mms([-x, x, -x, x]), "mm", "beside the crankcase"),
        chosen("y", _mms(4 * [y]), "mm", "lower face of the pads"),
        chosen("z", _mms([front, front, rear, rear]), "mm", "0.17 and 0.83 of the length between the outer mains"),
    ]  # fmt: skip
    for axis, one, hz in zip("xyz", k, MOUNT_HZ, strict=True):
        entries.append(derived(f"stiffness_{axis}", 4 * [one], "N/m", rubber % hz))
    turning = BEND * k[1] * (s.bore / 0.105) ** 2
    for axis in "xyz":
        entries.append(derived(f"stiffness_r{axis}", 4 * [turning], "N m/rad", "of a rubber block, as the shipped six"))
    for axis, one in zip("xyz", c, strict=True):
        entries.append(derived(f"damping_{axis}", 4 * [one], "N s/m", f"{MOUNT_RATIO:g} of critical"))
    for axis in "xyz":
        entries.append(
            derived(f"damping_r{axis}", 4 * [0.01 * turning], "N m s/rad", "of a rubber block, as the shipped six")
        )
    return Block("mounts", "Four mounts to the ground.", tuple(entries))


def mounted_mass(engine: Engine) -> float:
    """Mass on the mounts, kg: the block's plates and boxes with the heads, crankshaft, flywheel, rods and pistons."""
    plan, rod = block_plan(engine), engine.rod
    moving = engine.n_cylinders * (rod.big_end_mass + rod.small_end_mass + engine.cylinders.piston_mass)
    crank = float(crank_moments(engine)[0, 0]) + engine.flywheel.mass + engine.pulley.mass
    return _casting(plan) + plan.block.head_mass * engine.n_cylinders + crank + moving


def _casting(plan: BlockPlan) -> float:
    """Mass of the block without heads, kg; overlaps of banks with the crankcase are counted once, roughly."""
    b: BlockPart = plan.block
    outer, inner = (_area(polygon) for polygon in outlines(plan))
    front, rear = plan.ends
    mains, length = len(plan.mains), rear - front
    volume = (outer - inner) * length
    # Fraction of the crankcase's height that a bulkhead covers, down to bulkhead_depth.
    reach = min(1.0, (b.bulkhead_depth + b.side_height) / (b.skirt_depth + b.side_height))
    volume += mains * b.bulkhead_thickness * inner * reach
    volume += (
        mains
        * (b.housing_thickness - b.bulkhead_thickness)
        * 2.0
        * b.housing_half_width
        * (b.housing_height + b.cap_depth)
    )
    volume -= mains * b.housing_thickness * 0.25 * math.pi * max(plan.bores) ** 2
    volume += 2.0 * b.crankcase_half_width * length * b.cover_thickness
    tall, bore = b.deck_height - b.deck_thickness - b.foot_height, plan.cylinder_bore
    hole = 0.25 * math.pi * (bore + 2.0 * b.liner_thickness) ** 2
    for bank in plan.banks:
        width, cylinders = 2.0 * b.bank_half_width, len(bank.cylinders)
        volume += tall * b.wall_thickness * 2.0 * (width + length)
        volume += (width * length - cylinders * hole) * (b.deck_thickness + b.wall_thickness)
        liner = hole - 0.25 * math.pi * bore**2
        volume += cylinders * liner * (b.deck_height - b.foot_height + b.wall_thickness)
    return b.density * volume


def _area(polygon: list[tuple[float, float]]) -> float:
    """Area of an anticlockwise polygon."""
    following = [*polygon[1:], polygon[0]]
    return 0.5 * sum(x * v - u * y for (x, y), (u, v) in zip(polygon, following, strict=True))


def _mm(key: str, metres: float, note: str) -> Entry:
    return derived(key, 1e3 * metres, "mm", note)


def _mms(metres: list[float]) -> list[float]:
    return [1e3 * one for one in metres]
