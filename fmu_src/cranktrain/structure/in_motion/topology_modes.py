"""Modes of bodies and connections of a topology at rest, at crank angle 0.

Stiffness and mass are those of :mod:`cranktrain.structure.in_motion.linear` without speed. Flanks of gears without
backlash are in contact; with backlash the gears are free, in the middle of their play.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.model.pack import Cranktrain, no_body, pack
from cranktrain.dynamics.model.records import no_ports
from cranktrain.dynamics.tangents import tangents_at_rest
from cranktrain.dynamics.topology import slots as at
from cranktrain.dynamics.topology.relations import groups
from cranktrain.dynamics.topology.values import BLOCK, CRANK, Topology
from cranktrain.structure.in_motion.linear import SmallMotions


class TopologyModes(NamedTuple):
    """Modes of a topology by rising frequency.

    Attributes
    ----------
    frequencies_hz : (n,) 0 for free motion
    shapes : (n, n) modal coordinates of all bodies, one after the other, by mode; columns of unit modal mass
    rotations : by body (n,) its rotation about its frame's axis in each mode
    shares : by body (n,) its fraction of the kinetic energy of each mode; also of ``crank`` and ``block``
    """

    frequencies_hz: Array
    shapes: Array
    rotations: dict[str, Array]
    shares: dict[str, Array]


class CrankAtRest(NamedTuple):
    """Crankshaft at rest in its bearings: stiffness and mass (n, n) in the modes of its ``body``.

    Modes of a ``block`` on its mounts follow those of the crank.
    """

    body: ReducedBody
    stiffness: Array
    mass: Array
    block: ReducedBody | None = None


def topology_modes(topology: Topology, crank: CrankAtRest | None = None) -> TopologyModes:
    """Modes of bodies and connections, with the ``crank`` if it is given, in its block or on a block at rest.

    The modal coordinates of crank and block come first in ``shapes``. ``InputError`` if a connection holds a missing
    body.
    """
    body, block = (None, None) if crank is None else (crank.body, crank.block)
    for connection in topology.connections:
        if any({CRANK: body, BLOCK: block}.get(end.body, True) is None for end in connection.ends):
            raise InputError(f"connection '{connection.name}' holds the engine's own bodies, which are not there")
    on_crank, in_block = (0 if one is None else one.n_modes for one in (body, block))
    first = on_crank + in_block
    ports = no_ports()._replace(turning=np.zeros((0, on_crank)), block=np.zeros((0, in_block)))
    own = Cranktrain(turning=body, block=block, stationary=block or no_body(), damping=np.zeros(first), ports=ports)
    model = pack(topology, own)
    mass, _, stiffness = SmallMotions(model, still=True).equations(0.0, tangents_at_rest(model))
    if crank is not None:
        stiffness[:first, :first] += crank.stiffness - np.diag(model.omega2[:first])
        mass[:first, :first] = crank.mass
    root = np.linalg.inv(np.linalg.cholesky(mass))
    squares, found = np.linalg.eigh(root @ (0.5 * (stiffness + stiffness.T)) @ root.T)
    found = root.T @ found
    turns, shares = {}, {}
    if crank is not None:
        moving = found[:on_crank]
        shares[CRANK] = np.einsum("ik,ij,jk->k", moving, crank.mass[:on_crank, :on_crank], moving)
    if block is not None:
        shares[BLOCK] = (found[on_crank:first] ** 2).sum(axis=0)
    order = [(body.name, group, k) for group in groups(topology) for k, body in enumerate(group.bodies)]
    for (name, group, k), row in zip(order, model.bodies.rows[at.OTHERS :], strict=True):
        own_rows, modes = (slice(int(row[slot]), int(row[slot] + row[at.MODES])) for slot in (at.OWN_MODE, at.MODE))
        turns[name] = model.bodies.turn[own_rows] @ found[modes]
        moved = found[modes] if group.parts is None else group.parts[k] @ found[modes]
        shares[name] = (moved**2).sum(axis=0)
    return TopologyModes(np.sqrt(np.maximum(squares, 0.0)) / (2.0 * math.pi), found, turns, shares)
