"""All arrays of a run, from a topology and the additional data of a cranktrain.

:func:`pack` knows bodies, frames, connections and ports, no engine. :mod:`cranktrain.dynamics.model.arrays` reads an
engine into the plain values of a :class:`Cranktrain`; a topology alone makes a system of bodies and connections in
frames that turn at the given speed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from cranktrain.core.build_mark import build_mark
from cranktrain.core.reduced_body import Array, ReducedBody, turning_stiffness
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.records import (
    Basis,
    BlockArrays,
    Lumps,
    ModelArrays,
    Ports,
    no_block,
    no_lumps,
    no_ports,
    plain_basis,
)
from cranktrain.dynamics.topology.arrays import Laid, lay_topology
from cranktrain.dynamics.topology.body_arrays import join_bodies, whole_body
from cranktrain.dynamics.topology.pieces import FilmParts
from cranktrain.dynamics.topology.records import Base
from cranktrain.dynamics.topology.slots import ENDS_GROUP, OF_BLOCK, OF_CRANK, WHIRLS
from cranktrain.dynamics.topology.values import Topology
from cranktrain.film.laws.films import Films, join_films, no_films
from cranktrain.film.laws.parameters import COLUMNS
from cranktrain.loads.built_in_trace import KINKS, NO_KINK
from cranktrain.loads.damper import PARAMETERS
from cranktrain.loads.torsional_line import LAW

LEAST_COUPLING = 1.0e-12
"""Smallest coupling between mass-normalised modes by rotation; terms are of order one, smaller ones are rounding."""
OWN = (
    "axis_weights", "shafts", "shaft_laws", "lag", "rotor", "ends", "tilts", "bearings", "pins", "big_ends", "damper",
    "cylinders", "gas", "scalars", "kinks", "basis", "lumps",
)  # fmt: skip
"""Arrays of a :class:`Cranktrain` that become those of the model."""
KEPT = ("gyroscopic", "spin", "gravity", "ports", "tilts", "ends", "shafts", "lag", "rotor")
"""Arrays of which :class:`~cranktrain.dynamics.model.records.Lumps` has a copy."""


def no_body() -> ReducedBody:
    """Body without modes and interfaces."""
    z, n = np.zeros, 0
    return ReducedBody(
        "nothing", z(n), (), z((0, 3)), z((0, 6, n)), z((n, n)), z((n, n)), z((n, n)), z(n), z(n), z((3, n)), 0.0,
        z(3), z((3, 3)),
    )  # fmt: skip


def _plain_scalars() -> Array:
    """Scalars of a system whose frames turn at the given speed."""
    scalars = np.zeros(at.SCALARS)
    scalars[[at.DRIVEN, at.BEST_SPEED]] = 1.0
    return scalars


@dataclass(frozen=True, eq=False)
class Cranktrain:
    """Data of a cranktrain in addition to its topology; sizes as in ModelArrays, each part empty by default.

    Its arrays become those of the model, so each is packed only once.

    Attributes
    ----------
    turning : all bodies that rotate with the crank's frame, as one; None without a crank
    joined : by name, modal coordinates (n, n_t) of bodies of the topology that have their modes in common with these
    block : the flexible block; None if the ground takes its place
    stationary : block and guided pistons as one
    damping : (n,) modal damping of the turning and the stationary modes, 1/s
    ports, laws : ports of these bodies, and force laws of the connections between them
    film_parts : parts for films of the topology's bearings
    bearings, big_ends : parameters of main bearings and big ends
    pins, tilts, ends, axis_weights : places and motion of pins, journals, flywheel and pulley
    shafts, shaft_laws, lag, rotor : drive line in the turning modes
    cylinders : (c, CYLINDER) rods, pistons, phases and their ports, see dynamics.model.slots
    gas, kinks : pressure trace
    damper : parameters of the damper's law
    scalars, basis, lumps, block_arrays : constants, and arrays of the block
    """

    turning: ReducedBody | None = None
    joined: Mapping[str, Array] = field(default_factory=dict)
    block: ReducedBody | None = None
    stationary: ReducedBody = field(default_factory=no_body)
    damping: Array = field(default_factory=partial(np.zeros, 0))
    ports: Ports = field(default_factory=no_ports)
    laws: Films = field(default_factory=partial(no_films, 0))
    film_parts: FilmParts = field(default_factory=FilmParts)
    bearings: Array = field(default_factory=partial(np.zeros, (0, COLUMNS)))
    big_ends: Array = field(default_factory=partial(np.zeros, (0, COLUMNS)))
    pins: Array = field(default_factory=partial(np.zeros, (0, 2)))
    tilts: Array = field(default_factory=partial(np.zeros, (0, 0)))
    ends: Array = field(default_factory=partial(np.zeros, (4, 0)))
    axis_weights: Array = field(default_factory=partial(np.zeros, 0))
    shafts: Array = field(default_factory=partial(np.zeros, (0, 0)))
    shaft_laws: Array = field(default_factory=partial(np.zeros, (0, LAW)))
    lag: Array = field(default_factory=partial(np.zeros, 0))
    rotor: Array = field(default_factory=partial(np.zeros, 0))
    cylinders: Array = field(default_factory=partial(np.zeros, (0, at.CYLINDER)))
    gas: Array = field(default_factory=partial(np.zeros, (2, 1, 4)))
    kinks: Array = field(default_factory=partial(np.full, KINKS, NO_KINK))
    damper: Array = field(default_factory=partial(np.zeros, PARAMETERS))
    scalars: Array = field(default_factory=_plain_scalars)
    basis: Basis = field(default_factory=plain_basis)
    lumps: Lumps = field(default_factory=no_lumps)
    block_arrays: BlockArrays = field(default_factory=no_block)


def pack(topology: Topology, own: Cranktrain | None = None) -> ModelArrays:
    """Arrays of a topology's bodies and connections, and of a cranktrain if ``own`` is given; compiles the force laws.

    :func:`cranktrain.dynamics.model.preparation.prepare_model` writes all values that depend on a run.
    ``InputError`` for an interface that a body lacks, or ends that a law does not join.
    """
    own = own or Cranktrain()
    turning, standing, contiguous = own.turning or no_body(), own.stationary, np.ascontiguousarray
    modes, first = turning.n_modes + standing.n_modes, own.ports
    sizes = len(first.turning), len(first.block), len(first.connections)
    more = lay_topology(topology, Base(own.turning, own.block, modes, *sizes, own.film_parts, own.joined))
    ports = with_topology_ports(first, more, own.cylinders)
    for slot, given in ((at.VALVE_HERE, at.VALVE_GIVEN), (at.AXIAL_HERE, at.AXIAL_GIVEN)):
        ports.layout[slot] = given not in more.rows[:, at.TAKES]
    ports.layout[at.WHIRLS] = any(map(whirls, (turning, *(body.reduced for body in topology.bodies))))
    crank = whole_body(ports.turning, 0, 0, OF_CRANK, 1.0)
    crank.rows[0, [WHIRLS, ENDS_GROUP]] = whirls(turning), not own.joined
    crank.gyroscopic[:] = turning.gyroscopic.T
    if own.turning is not None:
        crank.spin[:] = turning_stiffness(turning).T
    crank.centrifugal_load[:], crank.euler_load[:] = turning.centrifugal_load, turning.euler_load
    block = whole_body(ports.block, turning.n_modes, len(ports.turning), OF_BLOCK, 0.0)
    arrays: dict[str, Any] = {name: getattr(own, name) for name in OWN}
    model = ModelArrays(
        **arrays,
        omega2=contiguous(np.concatenate((turning.omega, standing.omega, more.omega)) ** 2),
        damping=np.concatenate((own.damping, more.damping)),
        gravity=np.concatenate(
            (turning.translation, standing.translation, *(body.translation for body in more.bodies)), axis=1
        ),
        pairs=ports.pairs,
        axial=ports.axial,
        block=own.block_arrays,
        bodies=join_bodies((crank, block, *more.bodies), more.fastest),
        links=more.connections,
        laws=join_films(
            len(ports.connections), [(own.laws, range(sizes[2])), (more.laws, range(sizes[2], len(ports.connections)))]
        ),
        connections=ports.connections,
        scales=ports.scales,
        limited=ports.limited,
        judged=ports.judged,
        layout=ports.layout,
        choices=np.zeros(at.CHOICES),
        stages=np.zeros(own.basis.tables.shape[1:]),
        build=build_mark(),
    )
    return model._replace(lumps=own.lumps._replace(**{name: getattr(model, name).copy() for name in KEPT}))


def whirls(body: ReducedBody) -> bool:
    """True if rotation couples modes of a body by gyroscopic or centrifugal terms; pure twist has none."""
    stretched = body.stress_stiffness - body.centrifugal
    return bool(max(np.abs(part).max(initial=0.0) for part in (body.gyroscopic, stretched)) > LEAST_COUPLING)


def with_topology_ports(ports: Ports, more: Laid, cylinders: Array) -> Ports:
    """Ports extended by those of added connections on crank and block, and by those of added bodies.

    The new ports come after the crank's, after the block's, and between the block's and the pistons', respectively. The
    rows of ``cylinders`` (c, CYLINDER) get the new numbers of their ports.
    """
    on_crank, on_block, on_bodies = len(more.crank), len(more.block), sum(len(body.shapes) for body in more.bodies)
    pairs, axial, layout = (part.copy() for part in (ports.pairs, ports.axial, ports.layout))
    connections = ports.connections.copy()
    moved = on_crank + on_block + on_bodies
    for column, by in (
        (pairs[:, 1], on_crank), (axial[:, 1], on_crank), (connections[:, at.REACTS], on_crank),
        (connections[:, at.FOLLOWED], on_crank), (connections[:, at.INNER], moved),
        (cylinders[:, at.LINER_PORT], on_crank), (cylinders[:, at.PISTON_PORT], moved),
    ):  # fmt: skip
        column[column >= 0.0] += by
    layout[at.PORTS] += moved
    layout[at.TERM_ROW] = len(connections)
    return ports._replace(
        turning=np.concatenate((ports.turning, more.crank)) if on_crank else ports.turning,
        block=np.concatenate((ports.block, more.block)) if on_block else ports.block,
        connections=np.concatenate((connections, more.rows)), pairs=pairs, axial=axial,
        layout=layout,
    )  # fmt: skip
