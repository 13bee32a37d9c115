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
    """Arrays of B added bodies with N modes in all (W of the largest) and M ports (V of the one that has most).

    Bodies in one group have common modes: N counts these modes once for each body, V counts the ports of a whole group.
    """

    rows: Array  # (B, BODY) see dynamics.topology.slots
    gyroscopic: Array  # (N, W) G transposed, of each body
    spin: Array  # (N, W) (K_σ − C) transposed
    centrifugal_load: Array  # (N,)
    euler_load: Array  # (N,)
    translation: Array  # (3, N)
    centre: Array  # (3, N) motion of the centre of mass in axes of the frame, x, y, z
    turn: Array  # (N,) rotation about z of each body as a whole
    shapes: Array  # (M, W)
    transposed: Array  # (N, V)
    carried: Array  # (N, 6) motion with the block's rigid modes
    fastest: Array  # (FASTEST_SIZE,) highest speeds of frames, see slots


@record
class AddedConnections(NamedTuple):
    """Arrays of K pieces of connections with C components and T terms."""

    frames: Array  # (F, FRAME) of bodies, laws and directions
    rows: Array  # (K, CONNECTION)
    table: Array  # (K, 5) number of components and the Newton components, as ModelArrays.connections
    terms: Array  # (T, TERM) in the order of their components
    starts: Array  # (C + 1,) first term of each component
    scales: Array  # (C,)
    meets: Array  # (C, C + 1) 1 if a component's force moves another one; last column: any of the engine's own
    order: Array  # (n,) all components, including the engine's, in the order of their elimination
    slides: Array  # (C, SLIDES)
    leans: Array  # (L, LEAN)
    interfaces: Array  # (I, INTERFACE)
    ports: Array  # (P,) all ports that connections load
    entry: IntArray  # (K, 3) addresses of the law and of its record, and its number in the record
    place: Array  # (K, 4)
    velocity: Array  # (K, 4)
    numbers: Array  # (NUMBERS,)
    out: Array  # (SIZE,)
    bearings: Array  # (K, COLUMNS) of films
    oil: Array  # (K,) own viscosity of a film, Pa s; 0: the engine's oil, −1: no film
    traits: Array  # (K, TRAITS) see slots
    remembered: IntArray  # (K + 1,) offset of the memory of each piece; last the size of all
    shown: Array  # (O, SHOWN) source of each output
    hooks: IntArray  # (HOOKS,) addresses of kernels that a stage calls, see dynamics.motion.added_hooks


class AddedWork(NamedTuple):
    """Workspace of a stage for added bodies and connections."""

    scratch: Array  # (W, W)
    inverse: Array  # (slots, N, W)
    response: Array  # (slots, M, W)
    compliance: Array  # (slots, M, V)
    frames: Array  # (F, MOVED) angle and place of each frame, and their derivatives by the crank angle
    coefficients: Array  # (T, 2) of each term, and its rate
    permuted: Array  # (n, n) the Newton matrix in the order of elimination
    gaps: Array  # (GAPS, C)
    answered: Array  # (m,) motion of all ports by one component's force
    axes: Array  # (B, 2) displacement of each body's centre of mass across its axis, m
    blocks: Array  # (K, 16)
    factored: Array  # (K, 16)
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
    """Workspace for a model with ``ports`` and ``newton`` components in all."""
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
    """Numbers of frames, in the order of their first use."""

    def __missing__(self, frame: Frame) -> int:
        self[frame] = len(self)
        return self[frame]
