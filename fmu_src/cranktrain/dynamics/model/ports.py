"""Ports: the components of motion at which force laws act, and which law couples which of them.

Bodies fall into two groups: those that turn with the crank's frame (crankshaft, free big ends, damper ring,
dynamometer) and stationary ones (block, pistons). Turning ports, in axes of the frame, come in this order:

1. x and y of each main journal,
2. z of the thrust collar,
3. x and y of each crank pin under its rod, one pair for each cylinder,
4. x and y of each rod's big end, where films carry it,
5. where journals feel tilt: their ends against their middle, x and y (slope times half the width, m); where the
   collar does: its rotations about x and y (rad),
6. z of the flywheel against the connecting shaft, where the drive line has an axial path,
7. the pulley's rotation against the damper ring's, where there is one,
8. the drive line's wind-up at the flywheel, where it has an axial path,
9. z-rotation of each pin under its rod, z-rotation of each main journal.

All but the last two groups are unknowns of a stage's Newton iteration. Where journals are locked on their axis a pin
can but turn about it: its rotation takes the place of its x and y. Stationary ports follow, in axes at rest:

1. with a flexible block: x and y of each main bore, z of the thrust faces, the bores' ends and the thrust faces'
   rotations where films feel tilt, then z-rotation of each main bore, and of each liner its displacement across its
   cylinder at the upper and at the lower ring and its displacement along;
2. with guided pistons: displacement across the cylinder and rotation of each piston at the height of its pin.

A *connection* is one force law with the Newton ports it couples; connections come as main journals, crank pins (or the
films of the big ends), thrust bearing, rods of free big ends, axial joint, damper. Laws between a turning and a
stationary body act on the *relative* motion of their ports, see :mod:`cranktrain.dynamics.motion.relative`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.topology.arrays import Added
from cranktrain.engine.model import Engine

BoolArray = NDArray[np.bool_]
PIN_SCALE = 1.0e-4
"""Displacement of a pin that counts as much as a clearance, m."""
TWIST_SCALE = 1.0e-2
"""Rotation against the damper's ring that counts as much, rad."""


class Ports(NamedTuple):
    """Shapes of the turning ports (m_t, n_t) and the block's (m_b, n_b), what joins them, and their layout.

    Each piston's two ports move with its own two modes only, all by the same shape, so they need none here.
    """

    turning: Array
    block: Array
    connections: Array  # (k, 5) number of Newton ports that each law couples, then those ports; see slots.COUPLED
    scales: Array  # (n_newton,)
    pairs: Array  # (r, 2) turning and stationary port of each x that a law takes relatively; y follows
    axial: Array  # (0 or 1, 2) likewise along the axis
    layout: Array


class MainJournals(NamedTuple):
    """What the layout needs of the main bearings: half the width over which tilt counts and the scale of motion, m.

    Journals that are locked on their axis have no bearing: b is 0.
    """

    half_widths: Array  # (b,)
    clearances: Array  # (b,)
    tilted: BoolArray  # (b,) whether its bearing feels its tilt
    collar: bool  # whether the thrust bearing's collar feels its tilt


def lay_ports(
    engine: Engine,
    body: ReducedBody,
    crank_modes: int,
    journals: MainJournals,
    windup: Array,
    block: ReducedBody | None,
    pistons: bool,
) -> Ports:
    """Lay out the ports of an engine.

    Parameters
    ----------
    body : what turns; holds ``rod[i]`` too where big ends are free, ``ring`` where there is a damper
    crank_modes : its first modes, which are the crankshaft's
    windup : (n,) wind-up of the drive line at the flywheel, rad, where the body holds a ``shaft`` of an axial path
    block : the flexible block, or nothing
    pistons : whether they are guided
    """
    index, shapes = body.index, body.shapes
    mains = [index(f"main[{i + 1}]") for i in range(journals.clearances.size)]
    rods = [index(f"rod[{i + 1}]") for i in range(engine.n_cylinders)] if "rod[1]" in body.interfaces else []
    collar = index("thrust")
    b, c = len(mains), engine.n_cylinders
    pins = [pin_shapes(engine, body, cylinder) for cylinder in range(c)]
    rows = [shapes[k, :2] for k in mains] + [shapes[collar, 2:3]]
    turns = b == 0
    rows += [pin[2:] if turns else pin[:2] for pin in pins] + [shapes[k, :2] for k in rods]
    clearances = np.repeat(journals.clearances, 2).tolist()
    scales = clearances + [0.5 * engine.thrust.clearance] + ([TWIST_SCALE] * c if turns else [PIN_SCALE] * (2 * c))
    if engine.big_end_bearing is not None:
        scales += [engine.big_end_bearing.clearance] * (2 * len(rods))
    first_pin, first_rod = 2 * b + 1, 2 * b + 1 + 2 * c
    tilts = len(scales)
    laws = [[2 * i, 2 * i + 1] for i in range(b)]
    laws += _pin_laws(c, first_pin, first_rod if rods else 0, turns)
    thrust_law = len(laws)
    laws.append([2 * b])
    rod_laws = len(laws)
    laws += [[first_rod + 2 * k, first_rod + 2 * k + 1] for k in range(len(rods))]
    for i in np.flatnonzero(journals.tilted).tolist():
        rows += [_tilt(shapes[mains[i]], journals.half_widths[i])]
        laws[i] += [len(scales), len(scales) + 1]
        scales += [journals.clearances[i]] * 2
    if journals.collar:
        rows += [shapes[collar, 3:5]]
        radius = 0.25 * (engine.thrust.inner_diameter + engine.thrust.outer_diameter)
        laws[thrust_law] += [len(scales), len(scales) + 1]
        scales += [0.5 * engine.thrust.clearance / radius] * 2
    axial_joint = len(laws) if "shaft" in body.interfaces else 0
    if axial_joint:
        rows += [shapes[index("flywheel"), 2:3] - shapes[index("shaft"), 2:3]]
        laws.append([len(scales)])
        scales += [0.5 * engine.thrust.clearance]
    damper, ring = len(scales), "ring" in body.interfaces
    if ring:
        rows += [shapes[index("pulley"), 5:6] - shapes[index("ring"), 5:6]]
        scales += [TWIST_SCALE]
        laws.append([damper])
    rows += [windup[None]] if axial_joint else []
    if not turns:
        rows += [pin[2:] for pin in pins] + [shapes[k, 5:6] for k in mains]
    turning = np.ascontiguousarray(np.concatenate(rows))
    table = _law_table(laws)
    if journals.collar:
        table[thrust_law, at.TURNED] = len(turning) - b + engine.thrust.main - 1
    layout = np.zeros(at.LAYOUT)
    layout[: at.DAMPER + 1] = [
        first_rod if rods else 0, thrust_law, rod_laws, crank_modes, body.n_modes, damper if ring else 0,
    ]  # fmt: skip
    still, pairs, axial = _block_ports(engine, block, journals, len(turning), tilts, layout)
    layout[at.PORTS] = len(turning) + len(still)
    layout[at.JOURNAL_ROTATIONS], layout[at.MAINS] = len(turning) - b, len(engine.crankshaft.main_widths)
    layout[at.PIN_ROTATIONS] = first_pin if turns else len(scales) + (axial_joint > 0)
    layout[at.AXIAL_JOINT], layout[at.WINDUP] = axial_joint, len(scales)
    layout[at.SLIDING] = axial_joint > 0 and engine.axial_path is not None and engine.axial_path.joint == "spline"
    if pistons:
        layout[at.PISTONS] = layout[at.PORTS]
        layout[at.PORTS] += 2 * c
    return Ports(turning, still, table, np.array(scales), pairs, axial, layout)


def _pin_laws(cylinders: int, first_pin: int, first_rod: int, turns: bool) -> list[list[int]]:
    """Newton ports of each cylinder's law: of its pin, whose journals turn alone or move, and of its free big end."""
    found = []
    for k in range(cylinders):
        pin = [first_pin + k] if turns else [first_pin + 2 * k, first_pin + 2 * k + 1]
        found.append([*pin, first_rod + 2 * k, first_rod + 2 * k + 1] if first_rod else pin)
    return found


def _law_table(laws: list[list[int]]) -> Array:
    """Table of the connections, see ``ModelArrays.connections``."""
    table = np.zeros((len(laws), 5))
    for row, law in zip(table, laws, strict=True):
        row[at.COUPLED] = len(law)
        row[at.FIRST : at.FIRST + len(law)] = law
    return table


def with_added_ports(ports: Ports, more: Added) -> Ports:
    """The ports with those that added connections hold on crank and block, and of added bodies.

    They come behind the crank's, behind the block's, and between the block's and the pistons'.
    """
    on_crank, on_block, on_bodies = len(more.crank), len(more.block), more.bodies.shapes.shape[0]
    layout, pairs, axial = ports.layout.copy(), ports.pairs.copy(), ports.axial.copy()
    for slot in (at.BORE_ROTATIONS, at.LINERS):
        layout[slot] += on_crank if layout[slot] > 0.0 else 0.0
    pairs[:, 1] += on_crank
    axial[:, 1] += on_crank
    layout[at.PORTS] += on_crank + on_block + on_bodies
    if layout[at.PISTONS] > 0.0:
        layout[at.PISTONS] += on_crank + on_block + on_bodies
    return ports._replace(
        turning=np.concatenate((ports.turning, more.crank)) if on_crank else ports.turning,
        block=np.concatenate((ports.block, more.block)) if on_block else ports.block,
        pairs=pairs, axial=axial, layout=layout,
    )  # fmt: skip


def pin_shapes(engine: Engine, body: ReducedBody, cylinder: int) -> Array:
    """Shapes x, y and z-rotation (3, n) of a crank pin where the rod of ``cylinder`` (from 0) sits."""
    pin = body.shapes[body.index(f"pin[{engine.cylinders.pins[cylinder]}]")]
    place = np.array(pin[[0, 1, 5]])
    offset = engine.rod_offsets[cylinder]
    if offset != 0.0:
        place[0] += offset * pin[4]
        place[1] -= offset * pin[3]
    return place


def cylinder_axes(angle: float) -> tuple[Array, Array]:
    """Unit vectors across and along a cylinder whose bank is at ``angle``, in axes at rest, (3,) each."""
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([cos, sin, 0.0]), np.array([-sin, cos, 0.0])


def _tilt(shape: Array, half_width: float) -> Array:
    """End displacement of a journal or bore against its middle, x and y, (2, n)."""
    return half_width * np.array([shape[4], -shape[3]])


def _block_ports(
    engine: Engine, body: ReducedBody | None, journals: MainJournals, first: int, tilts: int, layout: Array
) -> tuple[Array, Array, Array]:
    """Shapes of the block's ports, from port ``first`` on, with the pairs they form; adds to the layout."""
    if body is None:
        return np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((0, 2))
    index, shapes = body.index, body.shapes
    b = len(engine.crankshaft.main_widths)
    bores = [index(f"bore[{i + 1}]") for i in range(b)]
    faces = index("thrust")
    rows: list[Array] = [shapes[k, :2] for k in bores] + [shapes[faces, 2:3]]
    pairs = [[2 * i, first + 2 * i] for i in range(b)]
    turned: list[Array] = []
    turned += [_tilt(shapes[bores[i]], journals.half_widths[i]) for i in np.flatnonzero(journals.tilted)]
    if journals.collar:
        turned += [shapes[faces, 3:5]]
    pairs += [[tilts + 2 * i, first + 2 * b + 1 + 2 * i] for i in range(len(turned))]
    rows += turned
    layout[at.BORE_ROTATIONS] = first + sum(len(row) for row in rows)
    rows += [shapes[k, 5:6] for k in bores]
    layout[at.LINERS] = first + sum(len(row) for row in rows)
    for k in range(engine.n_cylinders):
        across, along = cylinder_axes(engine.cylinders.bank_angles[k])
        upper, lower = (shapes[index(f"liner[{k + 1}].{end}"), :3] for end in ("upper", "lower"))
        rows.append(np.array([across @ upper, across @ lower, 0.5 * along @ (upper + lower)]))
    return (
        np.ascontiguousarray(np.concatenate(rows)),
        np.array(pairs, dtype=float),
        np.array([[2.0 * b, first + 2.0 * b]]),
    )
