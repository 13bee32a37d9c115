"""All arrays of a run, from a topology and the additional data of a cranktrain.

:func:`pack` knows bodies, frames, connections and ports, no engine. :mod:`cranktrain.dynamics.model.arrays` reads an
engine into the plain values of a :class:`Cranktrain`; a topology alone makes a system of bodies and connections in
frames that turn at the given speed.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.build_mark import build_mark
from cranktrain.core.reduced_body import Array, ReducedBody, turning_stiffness
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.records import ModelArrays, no_block, no_lumps, plain_basis
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
KEPT = ("gyroscopic", "spin", "gravity", "ports", "tilts", "ends", "shafts", "lag", "rotor")
"""Arrays of which :class:`~cranktrain.dynamics.model.records.Lumps` has a copy."""


def no_body() -> ReducedBody:
    """Body without modes and interfaces."""
    z, n = np.zeros, 0
    return ReducedBody(
        "nothing", z(n), (), z((0, 3)), z((0, 6, n)), z((n, n)), z((n, n)), z((n, n)), z(n), z(n), z((3, n)), 0.0,
        z(3), z((3, 3)),
    )  # fmt: skip


def bare_arrays() -> dict[str, Any]:
    """Arrays, by their names in a model, of a system whose bodies and connections are all those of a topology."""
    z, layout, scalars = np.zeros, np.zeros(at.LAYOUT), np.zeros(at.SCALARS)
    layout[[at.THRUST_ROW, at.JOINT_ROW, at.DAMPER_ROW]] = at.NO_PORT
    scalars[[at.DRIVEN, at.BEST_SPEED]] = 1.0  # Its frames turn at the given speed.
    return {
        "axis_weights": z(0), "shafts": z((0, 0)), "shaft_laws": z((0, LAW)), "lag": z(0), "rotor": z(0),
        "ends": z((4, 0)), "tilts": z((0, 0)), "pins": z((0, 2)), "cylinders": z((0, at.CYLINDER)),
        "bearings": z((0, COLUMNS)), "big_ends": z((0, COLUMNS)), "damper": z(PARAMETERS), "gas": z((2, 1, 4)),
        "kinks": np.full(KINKS, NO_KINK), "scalars": scalars, "basis": plain_basis(), "lumps": no_lumps(),
        "block": no_block(), "connections": z((0, at.CONNECTION), dtype=np.int64), "scales": z(0), "limited": z((0, 2)),
        "judged": z(0), "pairs": z((0, 2)), "axial": z((0, 2)), "layout": layout,
    }  # fmt: skip


class Cranktrain(NamedTuple):
    """Data of a cranktrain in addition to its topology; sizes as in ModelArrays.

    Attributes
    ----------
    turning : all bodies that rotate with the crank's frame, as one; None without a crank
    joined : by name, modal coordinates (n, n_t) of bodies of the topology that have their modes in common with these
    block : the flexible block; None if the ground takes its place
    stationary : block and guided pistons as one; None for the block alone
    damping : (n,) modal damping of the turning and the stationary modes, 1/s; None without damping
    ports : shapes of the ports of the turning bodies (m_t, n_t) and of the block (m_b, n_b); None without ports
    laws : force laws of the connections in ``arrays``
    film_parts : parts for films of the topology's bearings
    arrays : arrays that become those of the model, by name; all others are those of :func:`bare_arrays`
    """

    turning: ReducedBody | None = None
    joined: Mapping[str, Array] = MappingProxyType({})
    block: ReducedBody | None = None
    stationary: ReducedBody | None = None
    damping: Array | None = None
    ports: tuple[Array, Array] | None = None
    laws: Films | None = None
    film_parts: FilmParts = FilmParts()
    arrays: Mapping[str, Any] = MappingProxyType({})


def pack(topology: Topology, own: Cranktrain | None = None) -> ModelArrays:
    """Arrays of a topology's bodies and connections, and of a cranktrain if ``own`` is given; compiles the force laws.

    The arrays of ``own`` become those of the model, so it is packed only once.
    :func:`cranktrain.dynamics.model.preparation.prepare_model` writes all values that depend on a run.
    ``InputError`` for an interface that a body lacks, or ends that a law does not join.
    """
    own, contiguous = own or Cranktrain(), np.ascontiguousarray
    arrays = bare_arrays() | dict(own.arrays)
    turning, standing = own.turning or no_body(), own.stationary or own.block or no_body()
    n_block = 0 if own.block is None else own.block.n_modes
    on_crank, on_block = own.ports or (np.zeros((0, turning.n_modes)), np.zeros((0, n_block)))
    modes, before = turning.n_modes + standing.n_modes, len(arrays["connections"])
    sizes = modes, len(on_crank), len(on_block), before
    more = lay_topology(topology, Base(own.turning, own.block, *sizes, own.film_parts, own.joined))
    add_topology_ports(arrays, more)
    layout = arrays["layout"]
    for slot, given in ((at.VALVE_HERE, at.VALVE_GIVEN), (at.AXIAL_HERE, at.AXIAL_GIVEN)):
        layout[slot] = given not in more.rows[:, at.TAKES]
    layout[at.WHIRLS] = any(map(whirls, (turning, *(body.reduced for body in topology.bodies))))
    crank = whole_body(np.concatenate((on_crank, more.crank)), 0, 0, OF_CRANK, 1.0)
    crank.rows[0, [WHIRLS, ENDS_GROUP]] = whirls(turning), not own.joined
    crank.gyroscopic[:] = turning.gyroscopic.T
    if own.turning is not None:
        crank.spin[:] = turning_stiffness(turning).T
    crank.centrifugal_load[:], crank.euler_load[:] = turning.centrifugal_load, turning.euler_load
    ports = len(on_crank) + len(more.crank)
    block = whole_body(np.concatenate((on_block, more.block)), turning.n_modes, ports, OF_BLOCK, 0.0)
    laws = no_films(0) if own.laws is None else own.laws
    count = len(arrays["connections"])
    model = ModelArrays(
        **arrays,
        omega2=contiguous(np.concatenate((turning.omega, standing.omega, more.omega)) ** 2),
        damping=np.concatenate((np.zeros(modes) if own.damping is None else own.damping, more.damping)),
        gravity=np.concatenate(
            (turning.translation, standing.translation, *(body.translation for body in more.bodies)), axis=1
        ),
        bodies=join_bodies((crank, block, *more.bodies), more.fastest),
        links=more.connections,
        laws=join_films(count, [(laws, range(before)), (more.laws, range(before, count))]),
        choices=np.zeros(at.CHOICES),
        stages=np.zeros(arrays["basis"].tables.shape[1:]),
        build=build_mark(),
    )
    return model._replace(lumps=model.lumps._replace(**{name: getattr(model, name).copy() for name in KEPT}))


def whirls(body: ReducedBody) -> bool:
    """True if rotation couples modes of a body by gyroscopic or centrifugal terms; pure twist has none."""
    stretched = body.stress_stiffness - body.centrifugal
    return bool(max(np.abs(part).max(initial=0.0) for part in (body.gyroscopic, stretched)) > LEAST_COUPLING)


def add_topology_ports(arrays: dict[str, Any], more: Laid) -> None:
    """Add rows of a topology's connections to the ``arrays`` of a model, and renumber the ports there.

    The topology's ports come after the crank's, after the block's, and between the block's and the pistons'.
    """
    on_crank = len(more.crank)
    moved = on_crank + len(more.block) + sum(len(body.shapes) for body in more.bodies)
    pairs, axial, rows, cylinders = (arrays[name] for name in ("pairs", "axial", "connections", "cylinders"))
    for column, by in (
        (pairs[:, 1], on_crank), (axial[:, 1], on_crank), (rows[:, at.REACTS], on_crank),
        (rows[:, at.FOLLOWED], on_crank), (rows[:, at.INNER], moved), (cylinders[:, at.LINER_PORT], on_crank),
        (cylinders[:, at.PISTON_PORT], moved),
    ):  # fmt: skip
        column[column >= 0.0] += by
    arrays["layout"][at.PORTS] += moved
    arrays["layout"][at.TERM_ROW] = len(rows)
    arrays["connections"] = np.concatenate((rows, more.rows))
