"""Modes of a topology by itself, at crank angle 0 and without turning: what its bodies and connections are at rest.

With the terms B of all components, d = B u, and the tangents ∂F/∂d of the laws at rest, the bodies' own modes q obey
q̈ + [diag(ω²) − Φᵀ Bᵀ (∂F/∂d) B Φ] q = 0. Flanks of gears without backlash are closed there; with backlash they stand
free in the middle of their play.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import call_kernel, kernel
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.topology import slots as at
from cranktrain.dynamics.topology.arrays import Base, added
from cranktrain.dynamics.topology.relations import groups
from cranktrain.dynamics.topology.values import BLOCK, CRANK, Topology
from cranktrain.film.laws.films import BY_PLACE, FORCE, NUMBERS, SIZE


class TopologyModes(NamedTuple):
    """Modes by rising frequency.

    Attributes
    ----------
    frequencies_hz : (n,) 0 for motion that nothing holds
    shapes : (n, n) modal coordinates of all bodies, one after the other, by mode; columns of unit modal mass
    rotations : by body (n,) its rotation about its frame's axis in each mode
    """

    frequencies_hz: Array
    shapes: Array
    rotations: dict[str, Array]


@kernel
def law_at(law, record, index, place, velocity, numbers, out):
    """Let the law at an address answer a motion of its components, forces and tangents into ``out``; its status."""
    return call_kernel(law, (record, FORCE, index, place, velocity, numbers, out, out))


def topology_modes(topology: Topology) -> TopologyModes:
    """Modes of bodies and connections without an engine; ``InputError`` where a connection holds crank or block."""
    for connection in topology.connections:
        if any(end.body in (CRANK, BLOCK) for end in connection.ends):
            raise InputError(f"connection '{connection.name}' holds the engine's own bodies, which are not there")
    made = added(topology, Base(None, None, 0, 0, 0, 0))
    bodies, links = made.bodies, made.connections
    n = made.omega.size
    shapes = np.zeros((bodies.shapes.shape[0], n))
    for row in bodies.rows:
        m, k = int(row[at.MODE]), int(row[at.MODES])
        p = slice(int(row[at.OWN_PORT]), int(row[at.OWN_PORT] + row[at.PORTS]))
        shapes[p, m : m + k] = bodies.shapes[p, :k]
    measured = np.zeros((links.scales.size, n))
    for component, port, amplitude, _, angle in links.terms:
        measured[int(component)] += amplitude * math.cos(angle) * shapes[int(port)]
    stiffness = np.diag(made.omega**2)
    for k, row in enumerate(links.rows):
        rows = measured[int(row[at.FIRST]) : int(row[at.FIRST] + row[at.SIZE])]
        out, (law, record, index) = np.zeros(SIZE), links.entry[k].tolist()
        law_at(law, record, index, np.zeros(4), np.zeros(4), np.zeros(NUMBERS), out)
        tangent = out[BY_PLACE : BY_PLACE + 16].reshape(4, 4)[: len(rows), : len(rows)]
        stiffness -= rows.T @ tangent @ rows
    squares, found = np.linalg.eigh(0.5 * (stiffness + stiffness.T))
    turns = {}
    order = [body.name for group in groups(topology) for body in group.bodies]
    for name, row in zip(order, bodies.rows, strict=True):
        own, modes = (slice(int(row[k]), int(row[k] + row[at.MODES])) for k in (at.OWN_MODE, at.MODE))
        turns[name] = bodies.turn[own] @ found[modes]
    return TopologyModes(np.sqrt(np.maximum(squares, 0.0)) / (2.0 * math.pi), found, turns)
