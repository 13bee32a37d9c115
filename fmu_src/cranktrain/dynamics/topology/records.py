"""Arrays of added bodies and connections in the running model, and the memory of a stage for them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import record
from cranktrain.core.memory import zeros
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.topology import slots as at
from cranktrain.dynamics.topology.pieces import FilmParts
from cranktrain.dynamics.topology.values import Frame
from cranktrain.film.laws.films import IntArray


@record
class AddedBodies(NamedTuple):
    """Arrays of B added bodies with N modes and M ports in all; a body has at most W modes and V ports.

    Bodies in one group have common modes: N counts these modes once for each body, V counts the ports of a whole group.
    """

    rows: Array  # (B, BODY) see dynamics.topology.slots
    gyroscopic: Array  # (N, W) G transposed, of each body
    spin: Array  # (N, W) (K_σ − C) transposed
    centrifugal_load: Array  # (N,) modal centrifugal load at unit speed
    euler_load: Array  # (N,) modal load at unit angular acceleration
    translation: Array  # (3, N) modal projection of a unit acceleration field
    centre: Array  # (3, N) motion of the centre of mass in axes of the frame, x, y, z
    turn: Array  # (N,) rotation about z of each body as a whole
    shapes: Array  # (M, W) shapes of the ports of each body
    transposed: Array  # (N, V) shapes of the ports, transposed
    carried: Array  # (N, 6) motion with the block's rigid modes
    fastest: Array  # (FASTEST_SIZE,) highest speeds of frames, see slots


@record
class AddedConnections(NamedTuple):
    """Arrays of K pieces of connections with C components and T terms."""

    frames: Array  # (F, FRAME) of bodies, laws and directions
    rows: Array  # (K, CONNECTION) see slots
    table: Array  # (K, 5) number of components and the Newton components, as ModelArrays.connections
    terms: Array  # (T, TERM) in the order of their components
    starts: Array  # (C + 1,) first term of each component
    scales: Array  # (C,) motion of each component that counts like one clearance
    meets: Array  # (C, C + 1) 1 if a component's force moves another component; last column: any engine component
    order: Array  # (n,) all components, including the engine's, in the order of their elimination
    slides: Array  # (C, SLIDES) components along which frames of ends move, see slots
    leans: Array  # (L, LEAN) connections with an end that slides over a body, see slots
    interfaces: Array  # (I, INTERFACE) interfaces that connections hold, see slots
    ports: Array  # (P,) all ports that connections load
    entry: IntArray  # (K, 3) addresses of the law and of its record, and its number in the record
    place: Array  # (K, 4) displacement of each piece's components
    velocity: Array  # (K, 4) velocity of each piece's components
    numbers: Array  # (NUMBERS,) further input of the force laws
    out: Array  # (SIZE,) results of a force law
    bearings: Array  # (K, COLUMNS) parameters of films
    oil: Array  # (K,) own oil viscosity of a film, Pa s; 0 for the engine's oil, −1 without a film
    traits: Array  # (K, TRAITS) see slots
    remembered: IntArray  # (K + 1,) offset of the memory of each piece; last value: size of the whole memory
    shown: Array  # (O, SHOWN) source of each output
    hooks: IntArray  # (HOOKS,) addresses of kernels that a stage calls, see dynamics.motion.added_hooks


class AddedWork(NamedTuple):
    """Workspace of a stage for added bodies and connections."""

    scratch: Array  # (W, W)
    inverse: Array  # (slots, N, W)
    response: Array  # (slots, M, W)
    compliance: Array  # (slots, M, V)
    frames: Array  # (F, MOVED) angle and place of each frame, and their derivatives by the crank angle
    coefficients: Array  # (T, 2) coefficient of each term, and rate of the coefficient
    permuted: Array  # (n, n) the Newton matrix in the order of elimination
    gaps: Array  # (GAPS, C) motion, forces and steps of the components, see slots
    answered: Array  # (m,) motion of all ports by one component's force
    axes: Array  # (B, 2) displacement of each body's centre of mass across its axis, m
    blocks: Array  # (K, 16) force tangents of each piece, 4 × 4 row-major
    factored: Array  # (K, 16) force tangents from which the Newton matrix was made
    newton: Array  # (1, n) step of all components, padded to a multiple of four
    sizes: Array  # (SIZES,) see slots; NaN at first


class Base(NamedTuple):
    """Model that a topology is added to: bodies ``crank`` and ``block``, numbers of modes, ports and components.

    ``films`` are parts for films of added bearings.
    """

    crank: ReducedBody | None
    block: ReducedBody | None
    modes: int
    turning_ports: int
    block_ports: int
    newton: int
    films: FilmParts = FilmParts()


def added_work(bodies: AddedBodies, connections: AddedConnections, ports: int, newton: int, slots: int) -> AddedWork:
    """Workspace for a model with ``ports`` ports and ``newton`` components of motion in all."""
    n, w = bodies.gyroscopic.shape
    m, v = bodies.shapes.shape[0], bodies.transposed.shape[1]
    k, c, t = len(connections.rows), len(connections.scales), len(connections.terms)
    f = len(connections.frames)
    z = zeros
    return AddedWork(
        z((w, w)), z((slots, n, w)), z((slots, m, w)), z((slots, m, v)), z((f, at.MOVED)), z((t, 2)),
        z((newton, newton)), z((at.GAPS, c)),
        z(ports), z((len(bodies.rows), 2)), z((k, 16)), z((k, 16)), z((1, -4 * (-newton // 4))),
        np.full(at.SIZES, np.nan),
    )  # fmt: skip


class FrameNumbers(dict[Frame, int]):
    """Numbers given to frames in the order of their first use."""

    def __missing__(self, frame: Frame) -> int:
        self[frame] = len(self)
        return self[frame]
