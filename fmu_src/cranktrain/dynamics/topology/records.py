"""Arrays of bodies and of connections by terms in the running model, and the workspace of a stage for them."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from cranktrain.core.kernel import record
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.topology import slots as at
from cranktrain.dynamics.topology.pieces import FilmParts
from cranktrain.dynamics.topology.values import CRANK, REST, Frame
from cranktrain.film.laws.films import IntArray


@record
class Bodies(NamedTuple):
    """Arrays of B bodies with N modes and M ports in all; a body has at most W modes and V ports.

    Bodies in one group have common modes: N counts these modes once for each body, V counts the ports of a whole group.
    Ports of guided pistons are not among these, since a piston's two modes are its two ports.
    """

    rows: IntArray  # (B, BODY) see dynamics.topology.slots
    constants: Array  # (B, CONSTANTS)
    gyroscopic: Array  # (N, W) G transposed, of each body
    spin: Array  # (N, W) (K_σ − C) transposed
    centrifugal_load: Array  # (N,) modal centrifugal load at unit speed
    euler_load: Array  # (N,) modal load at unit angular acceleration
    translation: (
        Array  # (3, N) modal projection of a unit acceleration field, see ``ModelArrays.gravity`` for the crank
    )
    centre: Array  # (3, N) motion of the centre of mass in axes of the frame, x, y, z
    turn: Array  # (N,) rotation about z of each body as a whole
    shapes: Array  # (M, W) shapes of the ports of each body
    transposed: Array  # (N, V) shapes of the ports, transposed
    carried: Array  # (N, 6) motion with the block's rigid modes
    fastest: Array  # (FASTEST_SIZE,) highest speeds of frames, see slots


@record
class Links(NamedTuple):
    """Arrays of K connections with C components and T terms; their rows are in ``ModelArrays.connections``."""

    frames: Array  # (F, FRAME) of bodies, laws and directions
    terms: Array  # (T, TERM) in the order of their components
    starts: IntArray  # (C + 1,) first term of each component
    taken: IntArray  # (T, 2) port and body of each term
    scales: Array  # (C,) motion of each component that counts like one clearance
    meets: IntArray  # components that each component's force moves, one list after the other
    meet_starts: IntArray  # (C + 1,) first of these for each component
    on_engine: IntArray  # (C,) 1 if the force moves crank or block
    slides: Array  # (C, SLIDES) components along which frames of ends move, see slots
    leans: Array  # (L, LEAN) connections with an end that slides over a body, see slots
    interfaces: Array  # (I, INTERFACE) interfaces that connections hold, see slots
    ports: Array  # (P,) all ports that connections load
    bearings: Array  # (K, COLUMNS) parameters of films
    oil: Array  # (K,) own oil viscosity of a film, Pa s; 0 for the engine's oil, −1 without a film
    levers: Array  # (K,) motion (m or 1) of a tilt component per rotation of a tilted first end; 0: moments do not act
    shown: Array  # (O, SHOWN) source of each output


class Linear(NamedTuple):
    """Linear part of all bodies, for several step sizes."""

    scratch: Array  # (W, W) matrix S to be inverted
    inverse: Array  # (slots, N, W) S⁻¹ of each group, transposed
    response: Array  # (slots, M, W) S⁻¹Φᵀ, row per port
    compliance: Array  # (slots, M, V) Φ S⁻¹ Φᵀ, transposed


class LinkWork(NamedTuple):
    """Workspace of a stage for frames, and for components that are sums of terms."""

    frames: Array  # (F, MOVED) angle and place of each frame, and their derivatives by the crank angle
    coefficients: Array  # (T, 2) coefficient of each term, and rate of the coefficient
    gaps: Array  # (GAPS, C) motion, forces and steps of the components, see slots
    answered: Array  # (m,) motion of all ports by one component's force
    axes: Array  # (B, 2) displacement of each body's centre of mass across its axis, m
    newton: Array  # (1, n) step of all components, padded to a multiple of four
    sizes: Array  # (SIZES,) see slots; NaN at first


class Base(NamedTuple):
    """Model that a topology is added to: bodies ``crank`` and ``block``, numbers of modes, ports, connections.

    ``films`` are parts for films of added bearings, ``joined`` the modal coordinates (n, n_t) of bodies that have their
    modes in common with the crank, by name.
    """

    crank: ReducedBody | None
    block: ReducedBody | None
    modes: int
    turning_ports: int
    block_ports: int
    rows: int = 0
    films: FilmParts = FilmParts()
    joined: Mapping[str, Array] = MappingProxyType({})


class FrameNumbers(dict[Frame, int]):
    """Numbers given to frames in the order of their first use; those of crank and block come first."""

    @classmethod
    def of_engine(cls) -> FrameNumbers:
        """Numbers of the frames of crank (OF_CRANK) and block (OF_BLOCK)."""
        return cls({Frame(CRANK, 1.0): at.OF_CRANK, REST: at.OF_BLOCK})

    def __missing__(self, frame: Frame) -> int:
        self[frame] = len(self)
        return self[frame]
