"""Section loads of the crank over a recorded cycle: resultant of forces and inertia on one side of a cut.

The loads on the crank are those of main bearings, rods at the pins, thrust bearing, drive line (torque and axial
force), damper, added connections and gravity, and the inertia of its pieces (journals, pins, webs, each in two halves,
and attached parts), which move as rigid bodies with the neighbouring interfaces. Forces act at the displaced points.
These loads are not exactly balanced, because the pieces are not the elastic body and a run solves its equations to a
tolerance. The residual is distributed over the pieces as one rigid acceleration at each instant. :func:`imbalance`
gives the part of the residual that is due to the run, with the exact inertia of the reduced body's six rigid motions.

The elastic motion within a piece and moments on a tilting collar are left out.

The torque in a crank that was made from a table of discs and shafts is that of its shafts, because the inertias of the
table's discs differ from those of the crank's pieces: k ψ + c ψ̇ of the table's shaft at the cut, with its twist ψ. A
disc lies at the interface of its name. Other discs are placed as if all shafts to their neighbours had equal length, so
a branch lies at its root and does not contribute to the torque along the crank.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.reduced_body import Array, ReducedBody, rigid_coordinates, turning_stiffness
from cranktrain.core.rigid_slices import second_moments, skew
from cranktrain.engine.additions import split_end
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Crankshaft
from cranktrain.results.strength.recorded_cycle import RecordedCycle
from cranktrain.structure.crank.reduction import attached_parts
from cranktrain.structure.crank.sections import Piece, crank_pieces, interface_places, piece_moments
from cranktrain.structure.crank.shape import stations
from cranktrain.structure.stress.direct_solution import Instants

AXIS = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class PointLoads:
    """Forces (n, k, 3) N and moments (n, k, 3) N m at k points ``places`` (n, k, 3) m, in axes of the frame.

    ``z`` (k,) are the undeformed positions of the points along the crank, which decide on which side of a cut they lie.
    """

    z: Array
    places: Array
    forces: Array
    moments: Array

    def cut(self, z: float, point: Array) -> tuple[Array, Array]:
        """Force and moment (n, 3) about ``point`` (3,), m, of all loads in front of ``z`` on the part behind."""
        return self.resultant(self.z < z, point)

    def resultant(self, chosen: NDArray[np.bool_], point: Array) -> tuple[Array, Array]:
        """Force and moment (n, 3) about ``point`` (3,), m, of the ``chosen`` (k,) loads."""
        force = self.forces[:, chosen]
        moment = self.moments[:, chosen] + np.cross(self.places[:, chosen] - point, force)
        return force.sum(axis=1), moment.sum(axis=1)

    def joined(self, *others: "PointLoads") -> "PointLoads":
        """Point loads joined: these loads together with those of ``others``."""
        every = (self, *others)
        return PointLoads(
            np.concatenate([one.z for one in every]),
            *(
                np.concatenate([getattr(one, name) for one in every], axis=1)
                for name in ("places", "forces", "moments")
            ),
        )


class Mass(NamedTuple):
    """A rigid piece of the crank.

    The fields are mass, kg, centre of mass (3,), m, ∫ρ r rᵀ about the centre (3, 3), kg m², interfaces with which it
    moves, and the position along the crank at which it acts on it, m. This position is not the centre's, because for
    example a flywheel reaches over the journal in front of its flange.
    """

    mass: float
    centre: Array
    second: Array
    interfaces: tuple[str, ...]
    z: float


def crank_masses(engine: Engine) -> list[Mass]:
    """Half pieces of the crank and attached parts, each with the neighbouring interfaces."""
    places = interface_places(engine.crankshaft, engine.thrust.main)
    found = []
    for piece in crank_pieces(engine):
        middle = piece.middle
        for span in ((piece.span[0], middle), (middle, piece.span[1])):
            half = piece_moments(Piece(piece.kind, piece.number, span, piece.axis, piece.angle, piece.moments))
            mass, centre = float(half[0, 0]), half[0, 1:] / half[0, 0]
            second = half[1:, 1:] - mass * np.outer(centre, centre)
            found.append(Mass(mass, centre, second, _beside(engine.crankshaft, piece, places), centre[2]))
    for interface, part in attached_parts(engine):
        inertia = np.diag([part.diametral_inertia, part.diametral_inertia, part.polar_inertia])
        centre = np.array(places[interface]) + part.offset * AXIS
        found.append(Mass(part.mass, centre, second_moments(inertia), (interface,), places[interface][2]))
    w = engine.balance_weights
    if w is not None:
        for main, mass, r, angle, z in zip(w.mains, w.masses, w.radii, w.angles, w.offsets, strict=True):
            centre = np.array([-r * np.sin(angle), r * np.cos(angle), places[f"main[{main}]"][2] + z])
            found.append(Mass(mass, centre, np.zeros((3, 3)), (f"main[{main}]",), centre[2]))
    return found


def _beside(c: Crankshaft, piece: Piece, places: dict[str, tuple[float, float, float]]) -> tuple[str, ...]:
    """Names of the interfaces whose mean motion a piece of the crankshaft follows."""
    if piece.kind in ("main", "pin"):
        return (f"{piece.kind}[{piece.number}]",)
    if piece.kind in ("nose", "flange"):
        return ({"nose": "pulley", "flange": "flywheel"}[piece.kind],)
    if piece.kind == "web":
        web = stations(c).joins[piece.number - 1]
        return (*([f"main[{web.main}]"] if web.main else []), *(f"pin[{pin}]" for pin in web.pins))
    on_axis = np.hypot(*piece.axis) == 0.0
    near = {name: z for name, (_, _, z) in places.items() if name.startswith("main" if on_axis else "pin")}
    return (min(near, key=lambda name: abs(near[name] - piece.middle)),)


def crank_loads(cycle: RecordedCycle) -> PointLoads:
    """All loads on the crank over a cycle, with inertia and weight; the small residual is distributed by mass."""
    masses = crank_masses(cycle.engine)
    found = interface_loads(cycle).joined(mass_loads(cycle, masses))
    found = found.joined(_spread(masses, -_wrench(found), cycle.carried))
    if not cycle.body.shafts:
        return found
    own = np.cross(found.places, found.forces)[..., 2:] + found.moments[..., 2:]
    return replace(found, moments=found.moments - own * AXIS).joined(_couples(*shaft_couples(cycle)))


def imbalance(cycle: RecordedCycle) -> Array:
    """Residual force and moment (n, 6) of forces and inertia in the running model's own equations, N and N m.

    If journals are locked on their axis, only the last component is meaningful.
    """
    return _wrench(interface_loads(cycle)) + body_inertia(cycle)


def unbalanced_share(cycle: RecordedCycle) -> float:
    """Ratio of the largest :func:`imbalance` to the largest single load (forces, or torques if journals are locked)."""
    if cycle.carried:
        return float(np.abs(imbalance(cycle)[:, :3]).max() / np.abs(interface_loads(cycle).forces).max())
    torque = np.cross(*(getattr(interface_loads(cycle), name) for name in ("places", "forces")))[..., 2]
    return float(np.abs(imbalance(cycle)[:, 5]).max() / np.abs(torque).max())


def interface_loads(cycle: RecordedCycle) -> PointLoads:
    """Loads at the crank's interfaces: bearings, rods, thrust, drive line, axial path and damper."""
    found = [load for _, load in named_loads(cycle)]
    if cycle.body.shafts:
        found.append(_couples(*disc_couples(cycle)))
    return found[0].joined(*found[1:])


def _couples(z: Array, couples: Array) -> PointLoads:
    """Point loads of couples (n, k) about the axis at positions z (k,) on it."""
    places = np.broadcast_to(z[:, None] * AXIS, (*couples.shape, 3))
    return PointLoads(z, places, np.zeros(places.shape), couples[..., None] * AXIS)


def named_loads(cycle: RecordedCycle) -> list[tuple[str, PointLoads]]:
    """Loads at the crank's interfaces, each with the name of its interface."""
    engine, out = cycle.engine, cycle.outputs
    zero = np.zeros((cycle.angle.size, 3))
    found = []
    for i in range(1, len(engine.crankshaft.main_widths) + 1):
        name, tilt = f"bearing[{i}]", cycle.motion(f"main[{i}]")[:, 3:]
        moment = _to_frame(cycle, out[f"{name}.moment.x"], out[f"{name}.moment.y"])
        about = tilt[:, 0] * moment[:, 1] - tilt[:, 1] * moment[:, 0] - out[f"{name}.friction_torque"]
        force = _to_frame(cycle, out[f"{name}.force.x"], out[f"{name}.force.y"])
        found.append(_at(cycle, f"main[{i}]", force, moment + about[:, None] * AXIS))
    for c, (pin, offset) in enumerate(zip(engine.cylinders.pins, engine.rod_offsets, strict=True), 1):
        if engine.articulations[c - 1] is not None:
            continue  # the load of an articulated rod is included in that of its master rod's big end
        force = _to_frame(cycle, out[f"big_end[{c}].force.x"], out[f"big_end[{c}].force.y"])
        moment = -out[f"big_end[{c}].friction_torque"][:, None] * AXIS
        found.append(_at(cycle, f"pin[{pin}]", force, moment, offset))
    found.append(_at(cycle, "thrust", out["thrust.force"][:, None] * AXIS, zero, moves=False))
    axial = out["axial_path.force"] + cycle.axial_force
    found.append(_at(cycle, "flywheel", axial[:, None] * AXIS, zero, moves=False))
    if engine.line_on_crank:
        end = split_end(engine.drive_line.start)[1]
        found.append(_at(cycle, end, zero, -out["shaft.torque"][:, None] * AXIS))
    found.append(_at(cycle, "pulley", zero, out["damper.torque"][:, None] * AXIS))
    for name, load in cycle.added.items():
        across = load[:, :3] * (1.0 - AXIS)
        found.append(_at(cycle, name, across, load[:, 3:]))
        found.append(_at(cycle, name, load[:, :3] - across, zero, moves=False))
    return found


def _at(
    cycle: RecordedCycle, interface: str, force: Array, moment: Array, beside: float = 0.0, moves: bool = True
) -> tuple[str, PointLoads]:
    """Name of an interface and a load at it, at distance ``beside`` along z from its middle.

    As in the running model, a force across the axis acts at the displaced point (its own rotation moves it along its
    circle), without axial displacement. A force along the axis is not displaced across it (``moves`` false).
    """
    own, motion = cycle.body.positions[cycle.body.index(interface)], cycle.motion(interface)
    moved = motion[:, :3] + beside * np.cross(motion[:, 3:], AXIS)
    turn = motion[:, 5:]
    moved = moved + (np.cos(turn) - 1.0) * own + (np.sin(turn) - turn) * np.cross(AXIS, own)
    place = own + beside * AXIS + float(moves) * (1.0 - AXIS) * moved
    return interface, PointLoads(np.array([own[2] + beside]), place[:, None], force[:, None], moment[:, None])


def _to_frame(cycle: RecordedCycle, x: Array, y: Array) -> Array:
    """Vector (n, 3) in axes of the frame, from its components in axes at rest."""
    cos, sin = np.cos(cycle.angle), np.sin(cycle.angle)
    return np.stack([cos * x + sin * y, cos * y - sin * x, np.zeros_like(x)], axis=1)


def weight(cycle: RecordedCycle) -> Array:
    """Acceleration of gravity (n, 3) in axes of the frame, m/s²."""
    return _to_frame(cycle, np.zeros_like(cycle.angle), np.full_like(cycle.angle, -cycle.gravity))


def mass_loads(cycle: RecordedCycle, masses: list[Mass]) -> PointLoads:
    """Weight and inertia of the pieces over a cycle: d'Alembert's forces, and moments about their centres."""
    omega, change = cycle.speed[:, None, None], cycle.acceleration[:, None, None]
    turn = skew(AXIS)
    steady = change * turn - omega**2 * np.diag(1.0 - AXIS)
    pull = weight(cycle)
    places, forces, moments = [], [], []
    for mass in masses:
        moved, rate, second = (_piece_motion(cycle, mass, k) for k in range(3))
        place = mass.centre + moved[:, :3]
        acceleration = second[:, :3] + 2.0 * omega[:, 0] * (rate[:, :3] @ turn.T)
        acceleration = acceleration + (steady @ place[:, :, None])[:, :, 0]
        # A point at r from a piece's centre has the acceleration G r relative to it; G is ``gradient``.
        gradient = skew(second[:, 3:]) + 2.0 * omega * (turn @ skew(rate[:, 3:])) + steady
        turned = np.eye(3) + skew(moved[:, 3:])
        lever = turned @ mass.second @ np.swapaxes(turned, 1, 2) @ np.swapaxes(gradient, 1, 2)
        places.append(place)
        forces.append(mass.mass * (pull - acceleration))
        moments.append(np.stack([lever[:, j, i] - lever[:, i, j] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1))
    z = np.array([mass.z for mass in masses])
    return PointLoads(z, np.stack(places, 1), np.stack(forces, 1), np.stack(moments, 1))


def _piece_motion(cycle: RecordedCycle, mass: Mass, rate: int) -> Array:
    """Translation of a piece's centre and its rotation (n, 6), or their rates, as the mean over its interfaces."""
    found = []
    for interface in mass.interfaces:
        motion = cycle.motion(interface, rate)
        arm = mass.centre - cycle.body.positions[cycle.body.index(interface)]
        found.append(np.concatenate([motion[:, :3] + np.cross(motion[:, 3:], arm), motion[:, 3:]], axis=1))
    return np.mean(found, axis=0)


def body_inertia(cycle: RecordedCycle) -> Array:
    """Weight and inertia of the whole body in the running model, force and moment about the origin (n, 6)."""
    body, omega, six = cycle.body, cycle.speed[:, None], slice(0, 6)
    pull = weight(cycle)
    q, v, a = cycle.position, cycle.velocity, cycle.change
    modal = (
        pull @ body.translation[:, six]
        + omega**2 * body.centrifugal_load[six]
        - cycle.acceleration[:, None] * body.euler_load[six]
        - a[:, six]
        - 2.0 * omega * (v @ body.gyroscopic[six].T)
        - cycle.acceleration[:, None] * (q @ body.gyroscopic[six].T)
        - omega**2 * (q @ turning_stiffness(body)[six].T)
    )
    wrench = modal @ np.linalg.inv(rigid_coordinates(body))
    displaced = q @ body.translation.T
    wrench[:, 5] += np.cross(displaced, pull)[:, 2]
    return np.asarray(wrench)


def _wrench(loads: PointLoads) -> Array:
    """Resultant force and moment about the origin (n, 6) of all loads."""
    return np.concatenate(loads.resultant(np.ones(loads.z.size, dtype=bool), np.zeros(3)), axis=1)


def _spread(masses: list[Mass], lacking: Array, carried: bool) -> PointLoads:
    """Residual force and moment (n, 6) about the origin, distributed as loads of one rigid acceleration of all pieces.

    If journals are locked on their axis, only the moment about the axis is known.
    """
    centres = np.array([mass.centre for mass in masses])
    inertias = np.array([np.trace(mass.second) * np.eye(3) - mass.second for mass in masses])
    weights = np.array([mass.mass for mass in masses])
    # Translation of each piece's centre, and rotation of the piece, in each of the six rigid motions.
    arms = np.concatenate([np.tile(np.eye(3), (weights.size, 1, 1)), -skew(centres)], axis=2)
    turns = np.concatenate([np.zeros((3, 3)), np.eye(3)], axis=1)
    matrix = np.einsum("k,kai,kaj->ij", weights, arms, arms) + turns.T @ inertias.sum(axis=0) @ turns
    if carried:
        rigid = np.linalg.solve(matrix, lacking.T).T
    else:
        rigid = np.zeros_like(lacking)
        rigid[:, 5] = lacking[:, 5] / matrix[5, 5]
    forces = weights[:, None] * np.einsum("kai,ni->nka", arms, rigid)
    moments = np.einsum("kab,nb->nka", inertias, rigid[:, 3:])
    return PointLoads(np.array([mass.z for mass in masses]), np.broadcast_to(centres, forces.shape), forces, moments)


def bare_instants(cycle: RecordedCycle) -> Instants:
    """All samples of a cycle in the modes of the bare crankshaft, without attached parts."""
    body = cycle.body
    basis = np.eye(body.n_modes) if body.basis is None else body.basis
    return Instants(
        position=cycle.position @ basis.T,
        velocity=cycle.velocity @ basis.T,
        acceleration=(cycle.change + cycle.damping * cycle.velocity) @ basis.T,
        loads=wrenches(cycle),
        speed=cycle.speed,
        speed_rate=cycle.acceleration,
        gravity=weight(cycle),
    )


def wrenches(cycle: RecordedCycle) -> Array:
    """Force and moment (n, m, 6) at each of the m interfaces, N and N m."""
    found = np.zeros((cycle.angle.size, len(cycle.body.interfaces), 6))
    for name, load in named_loads(cycle):
        row = cycle.body.index(name)
        every = np.ones(load.z.size, dtype=bool)
        found[:, row] += np.concatenate(load.resultant(every, cycle.body.positions[row]), axis=1)
    return found


def shaft_couples(cycle: RecordedCycle) -> tuple[Array, Array]:
    """Positions z (k,), m, and couples (n, k), N m, about the axis whose sum in front of a cut is the cut's torque."""
    body = cycle.body
    places = disc_places(body)
    z, couples = [], []
    for row, name, (spring, damper, _) in zip(body.twists, body.shafts, body.shaft_laws.tolist(), strict=True):
        if spring > 0.0:
            torque = spring * (cycle.position @ row) + damper * (cycle.velocity @ row)
            z += [places[end] for end in _ends(name)]
            couples += [torque, -torque]
    return np.array(z), np.array(couples).T


def disc_couples(cycle: RecordedCycle) -> tuple[Array, Array]:
    """Positions z (k,), m, and couples (n, k), N m, about the axis of discs with absolute damping."""
    body = cycle.body
    places = disc_places(body)
    found = np.flatnonzero(body.shaft_laws[:, 0] == 0.0).tolist()
    z = [places[body.shafts[k].removeprefix("disc ")] for k in found]
    return np.array(z), -(cycle.velocity @ body.twists[found].T) * body.shaft_laws[found, 1]


def disc_places(body: ReducedBody) -> dict[str, float]:
    """Position z of each disc, m, by name."""
    pairs = [_ends(name) for name, law in zip(body.shafts, body.shaft_laws, strict=True) if law[0] > 0.0]
    found = {end: float(body.positions[body.index(end), 2]) for end in _flat(pairs) if end in body.interfaces}
    others = sorted(set(_flat(pairs)) - found.keys())
    matrix, right = np.zeros((len(others), len(others))), np.zeros(len(others))
    for pair in pairs:
        for one, other in (pair, pair[::-1]):
            if one in found:
                continue
            at = others.index(one)
            matrix[at, at] += 1.0
            if other in found:
                right[at] += found[other]
            else:
                matrix[at, others.index(other)] -= 1.0
    return found | dict(zip(others, np.linalg.solve(matrix, right).tolist(), strict=True))


def _ends(shaft: str) -> tuple[str, str]:
    """Names of the two discs of a shaft from its name, without the number of a parallel shaft after the comma."""
    one, _, other = shaft.partition(" to ")
    return one, other.partition(", ")[0]


def _flat(pairs: Iterable[tuple[str, str]]) -> list[str]:
    return [end for pair in pairs for end in pair]
