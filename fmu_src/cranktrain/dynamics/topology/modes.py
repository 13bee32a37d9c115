"""Modes of bodies and connections of a topology at rest, at crank angle 0.

With the terms B of all components, d = B u, and the tangents ∂F/∂d of the laws at rest, the bodies' own modes q obey
q̈ + [diag(ω²) − Φᵀ Bᵀ (∂F/∂d) B Φ] q = 0. Flanks of gears without backlash are in contact; with backlash the gears are
free, in the middle of their play.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import call_kernel, kernel
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.model import slots as model
from cranktrain.dynamics.topology import slots as at
from cranktrain.dynamics.topology.arrays import lay_topology
from cranktrain.dynamics.topology.frames import coefficients_at
from cranktrain.dynamics.topology.own_law import own_failure
from cranktrain.dynamics.topology.records import Base
from cranktrain.dynamics.topology.relations import groups, joined_crank
from cranktrain.dynamics.topology.values import BLOCK, CRANK, Topology
from cranktrain.film.laws.films import BY_PLACE, COS, FORCE, NUMBERS, SIZE


class TopologyModes(NamedTuple):
    """Modes of a topology by rising frequency.

    Attributes
    ----------
    frequencies_hz : (n,) 0 for free motion
    shapes : (m, n) modal coordinates of all bodies by mode, one after the other, those of the crank in its own modes;
        columns of unit modal mass
    rotations : by body (n,) its rotation about its frame's axis in each mode
    shares : by body (n,) its fraction of the kinetic energy of each mode; of ``crank`` too, if there is one
    """

    frequencies_hz: Array
    shapes: Array
    rotations: dict[str, Array]
    shares: dict[str, Array]


class CrankAtRest(NamedTuple):
    """Crankshaft at rest in its bearings: stiffness and mass (n, n) in the modes of its ``body``."""

    body: ReducedBody
    stiffness: Array
    mass: Array


@kernel
def law_at(law, record, index, place, velocity, numbers, out):
    """Call the force law at an address: forces and tangents are written to ``out``. Return the status of the law."""
    return call_kernel(law, (record, FORCE, index, place, velocity, numbers, out, out))


def topology_modes(topology: Topology, crank: CrankAtRest | None = None) -> TopologyModes:
    """Modes of bodies and connections, with the ``crank`` if it is given, on a block at rest.

    The crank's modal coordinates come first in ``shapes``. ``InputError`` if a connection holds a missing body.
    """
    for connection in topology.connections:
        if any(end.body == BLOCK or (end.body == CRANK and crank is None) for end in connection.ends):
            raise InputError(f"connection '{connection.name}' holds the engine's own bodies, which are not there")
    given, of_crank, parts = crank, np.zeros((0, 0)), dict[str, Array]()
    if given is not None:
        crank, of_crank, parts = _with_gears(topology, given)
    first = of_crank.shape[1]
    made = lay_topology(topology, Base(None if crank is None else crank.body, None, first, 0, 0, joined=parts))
    bodies, links = made.bodies, made.connections
    n, on_crank = first + made.omega.size, len(made.crank)
    shapes = np.zeros((on_crank + bodies.shapes.shape[0], n))
    shapes[:on_crank, :first] = made.crank
    for row in bodies.rows:
        m, k = int(row[at.MODE]), int(row[at.MODES])
        p = slice(int(row[at.OWN_PORT]), int(row[at.OWN_PORT] + row[at.PORTS]))
        shapes[on_crank:][p, m : m + k] = bodies.shapes[p, :k]
    measured = np.zeros((links.scales.size, n))
    for row, coefficient in zip(links.terms, coefficients_at(links.frames, links.terms, 0.0), strict=True):
        measured[int(row[at.COMPONENT])] += coefficient * shapes[int(row[at.TERM_PORT])]
    stiffness, mass = np.diag(np.concatenate((np.zeros(first), made.omega)) ** 2), np.eye(n)
    if crank is not None:
        stiffness[:first, :first], mass[:first, :first] = crank.stiffness, crank.mass
    numbers = np.zeros(NUMBERS)
    numbers[COS] = 1.0
    for k, row in enumerate(made.rows):
        rows = measured[int(row[model.GAP]) : int(row[model.GAP] + row[model.COUPLED])]
        out, (law, record, index) = np.zeros(SIZE), made.laws.entry[k].tolist()
        if law_at(law, record, index, np.zeros(4), np.zeros(4), numbers, out) != 0:
            raise InputError(own_failure(made.laws.entry[k : k + 1, 1]) or "a law of a connection has no force at rest")
        tangent = out[BY_PLACE : BY_PLACE + 16].reshape(4, 4)[: len(rows), : len(rows)]
        stiffness -= rows.T @ tangent @ rows
    root = np.linalg.inv(np.linalg.cholesky(mass))
    squares, found = np.linalg.eigh(root @ (0.5 * (stiffness + stiffness.T)) @ root.T)
    found = root.T @ found
    turns, shares = {}, {}
    turned = of_crank @ found[:first]
    if given is not None:
        shares[CRANK] = np.einsum("ik,ij,jk->k", turned, given.mass, turned)
    in_modes: list[tuple[str, Array | None]] = [*parts.items()]
    for group in groups(topology):
        in_modes += [
            (body.name, None if group.parts is None else group.parts[k]) for k, body in enumerate(group.bodies)
        ]
    for (name, part), row in zip(in_modes, bodies.rows, strict=True):
        own, modes = (slice(int(row[slot]), int(row[slot] + row[at.MODES])) for slot in (at.OWN_MODE, at.MODE))
        turns[name] = bodies.turn[own] @ found[modes]
        moved = found[modes] if part is None else part @ found[modes]
        shares[name] = (moved**2).sum(axis=0)
    shapes = np.concatenate((turned, found[first:]))
    return TopologyModes(np.sqrt(np.maximum(squares, 0.0)) / (2.0 * math.pi), shapes, turns, shares)


def _with_gears(topology: Topology, crank: CrankAtRest) -> tuple[CrankAtRest, Array, dict[str, Array]]:
    """Crank in the modes that it has in common with bodies on rigid gears, and modal coordinates of both in these."""
    n, body = crank.body.n_modes, crank.body
    geared = joined_crank(topology, body, np.zeros(n))
    if geared is None:
        return crank, np.eye(n), {}
    # The common modes contain stiffness and mass of the bodies themselves, without those of bearings and rods.
    bearings, rods = (
        geared.own.T @ part @ geared.own for part in (crank.stiffness - np.diag(body.omega**2), crank.mass - np.eye(n))
    )
    common = geared.body.omega
    return CrankAtRest(geared.body, bearings + np.diag(common**2), rods + np.eye(common.size)), geared.own, geared.parts
