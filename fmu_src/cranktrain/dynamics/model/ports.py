"""Ports, which are the components of motion at which force laws act, and the connections that couple them.

Bodies fall into two groups: those that rotate with the crank's frame (crankshaft, free big ends, damper ring,
dynamometer) and stationary ones (block, pistons). Rotating ports, in axes of the frame, come in this order:

1. x and y of each main journal,
2. z of the thrust collar,
3. x and y of each crank pin under its rod, one pair for each cylinder,
4. x and y of each rod's big end, if films carry it,
5. if a bearing's law depends on tilt: the journal's end relative to its middle, x and y (slope times half the width,
  m); if the collar may tilt: its rotations about x and y (rad),
6. z of the flywheel relative to the connecting shaft, if the drive line has an axial path,
7. the pulley's rotation relative to the damper ring, if there is one,
8. the drive line's wind-up at the flywheel, if it has an axial path,
9. z-rotation of each pin under its rod, z-rotation of each main journal.

All but the last two groups are unknowns of a stage's Newton iteration. If journals are locked on their axis, a pin can
only rotate about it, so its rotation replaces its x and y. Stationary ports follow, in axes at rest:

1. with a flexible block: x and y of each main bore, z of the thrust faces, the bores' ends and the thrust faces'
  rotations if films depend on tilt, then z-rotation of each main bore, and of each liner its displacement across its
  cylinder at the upper and at the lower ring and its displacement along, and that of the head along;
2. with guided pistons: displacement across the cylinder and rotation of each piston at the height of its pin.

A *connection* is one force law with the Newton ports it couples; connections come as main journals, crank pins (or the
films of the big ends), thrust bearing, rods of free big ends, axial joint, damper. Laws between a rotating and a
stationary body act on the *relative* motion of their ports, see :mod:`cranktrain.dynamics.motion.relative`. No other
module uses this order, because each connection and each cylinder has its ports in its row.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.topology.damper import DamperRecord, damper_law
from cranktrain.dynamics.topology.pieces import REFERENCE_VISCOSITY
from cranktrain.dynamics.topology.slider_crank import SliderCrankRecord, slider_crank_law
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import AxialPath
from cranktrain.film.laws.bearings import Bearings, axial_joint_film, bearing_parameters, enter, law_films
from cranktrain.film.laws.films import MASS, Films, join_films, no_films
from cranktrain.film.laws.parameters import COLUMNS
from cranktrain.film.laws.register import BIG_END, Law

if TYPE_CHECKING:
    from cranktrain.film.elastic.bore_compliance import BoreCompliance
    from cranktrain.film.table.database import FilmTable

BoolArray = NDArray[np.bool_]
PIN_SCALE, PIN_SHARE = 1.0e-4, 1.0e-3
"""Displacement of a pin that counts like one clearance: in m, or as a fraction of the throw if that is more."""
TWIST_SCALE = 1.0e-2
"""Twist (rad) between pulley and damper ring that counts like one clearance."""


class Ports(NamedTuple):
    """Ports of an engine, without shapes of those of pistons, which move with their own two modes only.

    Attributes
    ----------
    turning, block : shapes of the ports of rotating bodies (m_t, n_t) and of the block (m_b, n_b)
    cylinders : (c, CYLINDER - PIN_PORT) ports and rows of each cylinder, see slots.PIN_PORT
    arrays : arrays of connections and ports, by their names in :class:`~cranktrain.dynamics.model.records.ModelArrays`
    """

    turning: Array
    block: Array
    cylinders: Array
    arrays: dict[str, Array]


class MainJournals(NamedTuple):
    """Data of the main bearings for the layout: half the width over which tilt counts and the scale of motion, m.

    If journals are locked on their axis, there are no bearings and b is 0.
    """

    half_widths: Array  # (b,) half the width over which a journal's tilt counts, m
    clearances: Array  # (b,) scale of motion of each journal, m
    tilted: BoolArray  # (b,) whether the bearing's law depends on the journal's tilt
    collar: bool  # whether the thrust bearing's law depends on the collar's tilt


class _Laid:
    """Ports of a group of bodies, numbered in the order in which they are added."""

    def __init__(self, first: int = 0) -> None:
        self.rows: list[Array] = []
        self.scales: list[float] = []
        self.end = first

    def lay(self, shapes: Array, scale: float | None = None) -> int:
        """Append ports with ``shapes`` (·, n), with a scale as Newton ports. Return the index of the first new port."""
        first = self.end
        self.rows.append(shapes)
        self.end += len(shapes)
        self.scales += [] if scale is None else [scale] * len(shapes)
        return first

    @property
    def shapes(self) -> Array:
        """Shapes of all ports, (m, n)."""
        return np.ascontiguousarray(np.concatenate(self.rows))


def lay_ports(
    engine: Engine,
    body: ReducedBody,
    crank_modes: int,
    journals: MainJournals,
    windup: Array,
    block: ReducedBody | None,
    pistons: Sequence[int],
) -> Ports:
    """Number and arrange all ports of an engine, and the connections that couple them.

    Parameters
    ----------
    body : all rotating bodies as one; has interfaces ``rod[i]`` if big ends are free, ``ring`` with a damper
    crank_modes : number of the crankshaft's modes, which come first
    windup : (n,) wind-up of the drive line at the flywheel, rad, used if the body has a ``shaft`` of an axial path
    block : the flexible block, or None
    pistons : cylinders (from 0) whose pistons are guided
    """
    index, shapes, laid = body.index, body.shapes, _Laid()
    mains = [index(f"main[{i + 1}]") for i in range(journals.clearances.size)]
    pins = [pin_shapes(engine, body, cylinder) for cylinder in range(engine.n_cylinders)]
    collar = index("thrust")
    rows = []
    for k, clearance in zip(mains, journals.clearances, strict=True):
        port = laid.lay(shapes[k, :2], clearance)
        rows.append(_row((port, port + 1), at.MAINS_SQUEEZE, at.MAINS_SHEAR, pairs=0))
    along = laid.lay(shapes[collar, 2:3], 0.5 * engine.thrust.clearance)
    cylinders = np.full((len(pins), at.CYLINDER - at.PIN_PORT), at.NO_PORT)
    thrust, limited = _lay_rods(engine, body, pins, laid, rows, along, cylinders)
    for i in np.flatnonzero(journals.tilted).tolist():
        _couple(rows[i], laid.lay(_tilt(shapes[mains[i]], journals.half_widths[i]), journals.clearances[i]))
    if journals.collar:
        radius = 0.25 * (engine.thrust.inner_diameter + engine.thrust.outer_diameter)
        _couple(rows[thrust], laid.lay(shapes[collar, 3:5], 0.5 * engine.thrust.clearance / radius))
        rows[thrust][at.PAIRS] = 1.0
    joint = damper = -1
    if "shaft" in body.interfaces:
        joint = len(rows)
        slip = shapes[index("flywheel"), 2:3] - shapes[index("shaft"), 2:3]
        rows.append(_row([laid.lay(slip, 0.5 * engine.thrust.clearance)], at.AXIAL_JOINT_LOSS))
    if "ring" in body.interfaces:
        damper = len(rows)
        twist = shapes[index("pulley"), 5:6] - shapes[index("ring"), 5:6]
        rows.append(_row([laid.lay(twist, TWIST_SCALE)], at.DAMPER_LOSS))
    if joint >= 0:
        rows[joint][at.TOLD] = laid.lay(windup[None])
    if mains:
        cylinders[:, at.PIN_TURN - at.PIN_PORT] = [laid.lay(pin[2:]) for pin in pins]
        for cylinder in cylinders[:, [at.PIN_ROW - at.PIN_PORT, at.PIN_TURN - at.PIN_PORT]].astype(int).tolist():
            rows[cylinder[0]][[at.SPIN, at.TURNED]] = cylinder[1]
        for row, k in zip(rows, mains, strict=False):
            row[[at.SPIN, at.TURNED]] = laid.lay(shapes[k, 5:6])
    if journals.collar:
        rows[thrust][at.TURNED] = rows[engine.thrust.main - 1][at.TURNED]
    liners = cylinders[:, at.LINER_PORT - at.PIN_PORT]
    still, pairs, axial = _block_ports(engine, block, journals, rows, thrust, laid.end, liners)
    layout = np.zeros(at.LAYOUT)
    layout[[at.CRANK_MODES, at.THRUST_ROW, at.JOINT_ROW, at.DAMPER_ROW]] = crank_modes, thrust, joint, damper
    layout[at.PORTS] = laid.end + len(still)
    layout[at.SLIDING] = joint >= 0 and engine.axial_path is not None and engine.axial_path.joint == "spline"
    cylinders[pistons, at.PISTON_PORT - at.PIN_PORT] = layout[at.PORTS] + 2.0 * np.arange(len(pistons))
    layout[at.PORTS] += 2 * len(pistons)
    for cylinder in cylinders.astype(int):
        ends = [at.PISTON_PORT - at.PIN_PORT, at.LINER_PORT - at.PIN_PORT]
        rows[cylinder[at.END_ROW - at.PIN_PORT]][[at.INNER, at.FOLLOWED]] = cylinder[ends]
    journal_ports = [row[at.FIRST] + k for row in rows[: len(mains)] for k in range(2)]
    arrays = {
        "connections": np.array(rows, dtype=np.int64), "scales": np.array(laid.scales), "pairs": pairs, "axial": axial,
        "limited": np.array([*((port, at.NO_PORT) for port in journal_ports), *limited]).reshape(-1, 2),
        "judged": np.array([*journal_ports, along], dtype=float), "layout": layout,
    }  # fmt: skip
    return Ports(laid.shapes, still, cylinders, arrays)


def _lay_rods(
    engine: Engine, body: ReducedBody, pins: list[Array], laid: _Laid, rows: list[Array], along: int, cylinders: Array
) -> tuple[int, list[tuple[float, float]]]:
    """Lay out the ports and connections of pins, thrust bearing (at port ``along``) and free big ends, in this order.

    Fills the columns of pins, big ends and rows in ``cylinders``. Returns the row of the thrust bearing, and pairs of a
    big end's port and its pin's port.
    """
    rods = [body.index(f"rod[{i + 1}]") for i in range(len(pins))] if "rod[1]" in body.interfaces else []
    turns = not rows
    pin_scale = max(PIN_SCALE, PIN_SHARE * max(engine.throws))
    held = [laid.lay(pin[2:], TWIST_SCALE) if turns else laid.lay(pin[:2], pin_scale) for pin in pins]
    scale = engine.big_end_bearing.clearance if engine.big_end_bearing is not None else pin_scale
    ends = [laid.lay(body.shapes[k, :2], scale) for k in rods]
    cylinders[:, (at.PIN_TURN if turns else at.PIN_PORT) - at.PIN_PORT] = held
    cylinders[:, [at.PIN_ROW - at.PIN_PORT, at.END_ROW - at.PIN_PORT]] = len(rows) + np.arange(len(pins))[:, None]
    on_pins = [(port,) if turns else (port, port + 1) for port in held]
    on_ends = [(port, port + 1) for port in ends]
    for c, ports in enumerate(on_pins):
        if ends:
            films = at.BIG_ENDS_SQUEEZE, at.BIG_ENDS_SHEAR
            rows.append(_row((*ports, *on_ends[c]), *films, pairs=0, shape=at.OF_EYE, cylinder=c))
        else:
            rows.append(_row(ports, pairs=-1 if turns else 0, cylinder=c))
            rows[-1][at.SPIN] = held[c] if turns else at.NO_PORT
    thrust = len(rows)
    rows.append(_row((along,), at.THRUST_LOSS))
    if ends:
        cylinders[:, at.END_PORT - at.PIN_PORT] = ends
        cylinders[:, at.END_ROW - at.PIN_PORT] = len(rows) + np.arange(len(pins))
    rows += [_row(ports, pairs=0, cylinder=c) for c, ports in enumerate(on_ends)]
    return thrust, [pair for end, pin in zip(on_ends, on_pins, strict=False) for pair in zip(end, pin, strict=True)]


def _row(ports: Iterable[int], *accounts: int, pairs: int = -1, shape: int = at.OF_PORTS, cylinder: int = -1) -> Array:
    """Row of ``ModelArrays.connections`` for a connection between the given Newton ports.

    Its power goes to the first account, that of its friction to the second one if the law rubs.
    """
    row = np.full(at.CONNECTION, at.NO_PORT)
    row[[at.COUPLED, at.PAIRS, at.SHAPE, at.OF_CYLINDER]] = 0.0, pairs, shape, cylinder
    row[at.ACCOUNT : at.ACCOUNT + len(accounts)], row[at.RUBS] = accounts, len(accounts) > 1
    for port in ports:
        row[at.FIRST + int(row[at.COUPLED])] = port
        row[at.COUPLED] += 1
    return row


def _couple(row: Array, first: int) -> None:
    """Add two Newton ports, ``first`` and the next one, to a connection."""
    size = int(row[at.COUPLED])
    row[at.FIRST + size : at.FIRST + size + 2] = first, first + 1
    row[at.COUPLED] += 2


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
    """Unit vectors across and along a cylinder whose bank is at ``angle`` (rad), in axes at rest, (3,) each."""
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([cos, sin, 0.0]), np.array([-sin, cos, 0.0])


def _tilt(shape: Array, half_width: float) -> Array:
    """Displacement of the end of a journal or bore relative to its middle, x and y, (2, n)."""
    return half_width * np.array([shape[4], -shape[3]])


def _block_ports(
    engine: Engine, body: ReducedBody | None, journals: MainJournals, rows: list[Array], thrust: int, first: int,
    liners: Array,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Shapes of the block's ports, from port ``first`` on, and the pairs that they form with rotating ports.

    Writes the ports of the bores' rotations into ``rows`` of the connections (``thrust`` is the thrust bearing's row),
    and the first port of each liner into ``liners``.
    """
    if body is None:
        return np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((0, 2))
    index, shapes, laid = body.index, body.shapes, _Laid(first)
    bores, faces = [index(f"bore[{i + 1}]") for i in range(journals.clearances.size)], index("thrust")
    pairs = [[rows[i][at.FIRST], laid.lay(shapes[k, :2])] for i, k in enumerate(bores)]
    axial = [[rows[thrust][at.FIRST], laid.lay(shapes[faces, 2:3])]]
    for i in np.flatnonzero(journals.tilted).tolist():
        pairs.append([rows[i][at.FIRST + 2], laid.lay(_tilt(shapes[bores[i]], journals.half_widths[i]))])
    if journals.collar:
        pairs.append([rows[thrust][at.FIRST + 1], laid.lay(shapes[faces, 3:5])])
    for i, k in enumerate(bores):
        rows[i][at.REACTS] = laid.lay(shapes[k, 5:6])
    for k in range(engine.n_cylinders):
        across, along = cylinder_axes(engine.cylinders.bank_angles[k])
        ends = (f"liner[{k + 1}].upper", f"liner[{k + 1}].lower", f"head[{k + 1}]")
        upper, lower, head = (shapes[index(end), :3] for end in ends)
        liners[k] = laid.lay(np.array([across @ upper, across @ lower, 0.5 * along @ (upper + lower), along @ head]))
    return laid.shapes, np.array(pairs, dtype=float).reshape(-1, 2), np.array(axial, dtype=float)


def laws_of(
    ports: Ports, mains: Films, big_ends: Films, rods: SliderCrankRecord, thrust: Films, path: AxialPath | None,
    damper: Array,
) -> Films:  # fmt: skip
    """Force laws of all connections; ``damper`` (PARAMETERS,) are the parameters of the damper's law."""
    of_pins, of_rods = (rods.rods[:, slot].astype(int).tolist() for slot in (at.PIN_ROW, at.END_ROW))
    rod_laws = enter(no_films(len(of_rods)), slider_crank_law, rods)
    rod_laws.traits[:, MASS] = 1.0
    parts: list[tuple[Films, Sequence[int]]] = [
        (mains, range(len(mains.entry))), (big_ends, of_pins), (rod_laws, of_rods),
    ]  # fmt: skip
    once = {
        at.THRUST_ROW: thrust,
        at.JOINT_ROW: None if path is None else axial_joint_film(path),
        at.DAMPER_ROW: enter(no_films(1), damper_law, DamperRecord(damper, np.zeros(0), np.zeros((2, 0)))),
    }
    for slot, law in once.items():
        row = int(ports.arrays["layout"][slot])
        if law is not None and row >= 0:
            parts.append((law, [row]))
    return join_films(len(ports.arrays["connections"]), parts)


def big_end_films(
    engine: Engine, law: Law, table: FilmTable | None, bore: BoreCompliance | None
) -> tuple[Array, Films]:
    """Parameters (c, COLUMNS) of the c big ends' films (0 without big-end bearings), and the force law of the films."""
    parameters = np.zeros((engine.n_cylinders, COLUMNS))
    if engine.big_end_bearing is not None:
        parameters[:] = bearing_parameters(engine.big_end_bearing, REFERENCE_VISCOSITY)
    parts = {"big_end_table": table, "big_end_bore": bore}
    bearings = Bearings(parameters, engine.big_end_bearing, parts=parts, oil=engine.oil)
    return parameters, law_films(law, BIG_END, bearings)
