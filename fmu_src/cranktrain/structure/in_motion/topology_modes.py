"""Modes of bodies and connections of a topology at rest, at crank angle 0.

Stiffness and mass are those of :mod:`cranktrain.dynamics.linear` without speed. Flanks of gears without
backlash are in contact; with backlash the gears are free, in the middle of their play.
"""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.linear import SmallMotions, mean_places
from cranktrain.dynamics.model.pack import Cranktrain, pack
from cranktrain.dynamics.tangents import tangents_in_rotation
from cranktrain.dynamics.topology import slots as at
from cranktrain.dynamics.topology.relations import groups, joined_crank
from cranktrain.dynamics.topology.values import BLOCK, CRANK, Topology


class TopologyModes(NamedTuple):
    """Modes of a topology by rising frequency.

    Attributes
    ----------
    frequencies_hz : (n,) 0 for free motion
    shapes : (m, n) modal coordinates of all bodies by mode, one after the other, those of the crank in its own modes;
        columns of unit modal mass
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
    given, of_crank, parts = crank, np.zeros((0, 0)), dict[str, Array]()
    if crank is not None:
        crank, of_crank, parts = _with_gears(topology, crank)
        body = crank.body
    on_crank, in_block = (0 if one is None else one.n_modes for one in (body, block))
    first = on_crank + in_block
    model = pack(topology, Cranktrain(turning=body, joined=parts, block=block))
    laws = tangents_in_rotation(model, places=mean_places(model)).mean()
    mass, _, stiffness = SmallMotions(model, still=True).equations(0.0, laws)
    if crank is not None:
        stiffness[:first, :first] += crank.stiffness - np.diag(model.omega2[:first])
        mass[:first, :first] = crank.mass
    root = np.linalg.inv(np.linalg.cholesky(mass))
    squares, found = np.linalg.eigh(root @ (0.5 * (stiffness + stiffness.T)) @ root.T)
    found = root.T @ found
    turns, shares = {}, {}
    turned = of_crank @ found[:on_crank]
    if given is not None:
        count = len(turned)
        shares[CRANK] = np.einsum("ik,ij,jk->k", turned, given.mass[:count, :count], turned)
    if block is not None:
        shares[BLOCK] = (found[on_crank:first] ** 2).sum(axis=0)
    in_modes: list[tuple[str, Array | None]] = [*parts.items()]
    for group in groups(topology):
        in_modes += [(one.name, None if group.parts is None else group.parts[k]) for k, one in enumerate(group.bodies)]
    for (name, part), row in zip(in_modes, model.bodies.rows[at.OTHERS :], strict=True):
        own_rows, modes = (slice(int(row[slot]), int(row[slot] + row[at.MODES])) for slot in (at.OWN_MODE, at.MODE))
        turns[name] = model.bodies.turn[own_rows] @ found[modes]
        moved = found[modes] if part is None else part @ found[modes]
        shares[name] = (moved**2).sum(axis=0)
    shapes = np.concatenate((turned, found[on_crank:]))
    return TopologyModes(np.sqrt(np.maximum(squares, 0.0)) / (2.0 * math.pi), shapes, turns, shares)


def _with_gears(topology: Topology, crank: CrankAtRest) -> tuple[CrankAtRest, Array, dict[str, Array]]:
    """Crank in the modes that it has in common with bodies on rigid gears, and modal coordinates of both in these."""
    n, body = crank.body.n_modes, crank.body
    geared = joined_crank(topology, body, np.zeros(n))
    if geared is None:
        return crank, np.eye(n), {}
    # The common modes hold stiffness and mass of the bodies themselves; the block's modes stay as they are.
    turn, common = geared.own, geared.body.omega
    beside = len(crank.mass) - n
    both = np.zeros((n + beside, common.size + beside))
    both[:n, : common.size], both[n:, common.size :] = turn, np.eye(beside)
    found = []
    for part, own, more in (
        (crank.stiffness, body.omega**2, common**2),
        (crank.mass, np.ones(n), np.ones(common.size)),
    ):
        rest = part.copy()
        rest[:n, :n] -= np.diag(own)
        joined = both.T @ rest @ both
        joined[: common.size, : common.size] += np.diag(more)
        found.append(joined)
    return crank._replace(body=geared.body, stiffness=found[0], mass=found[1]), turn, geared.parts
