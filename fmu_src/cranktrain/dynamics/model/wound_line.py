"""Slow rotations of crank and drive line against each other, on the shafts and added connections between them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.linear import SmallMotions
from cranktrain.dynamics.model import lump_slots as of
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.records import ModelArrays, dimensions
from cranktrain.dynamics.tangents import law_at
from cranktrain.dynamics.topology import slots as top
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, COS, NUMBERS, SIZE
from cranktrain.loads.torsional_line import DAMPING, STIFFNESS

SLIDING = 1.0e3
"""Rate of a component, in scales (0.001 rad of a twist) a second, at which connections have their tangents; chosen."""


class Line(NamedTuple):
    """Slow rotations of crank and drive line with the m inertias between which its springs act.

    Attributes
    ----------
    turns : (m, n_t) modal motion by the rotation of each inertia: of the crank with all that turns with it, then of
       each rotor and body of the drive line; their sum rotates the whole engine in the ratios of its frames
    stiffness, damping : (s, m, m) of shafts and added connections, for each of s intervals of a motion
    """

    turns: Array
    stiffness: Array
    damping: Array

    @classmethod
    def of(cls, model: ModelArrays, motions: Array) -> Line:
        """Inertias of a model in s + 1 successive ``motions`` (s + 1, 2, n), modal displacement and velocity of each.

        Derivatives of forces are secants between two motions, so that friction that reverses between them counts as it
        should. With one motion they are tangents there as connections slide, because friction at rest would damp like a
        stiff damper. Elastic bodies of the drive line twist as at rest.
        """
        found = line_tangents(model, motions)
        for k, column in enumerate((STIFFNESS, DAMPING)):
            found[:, k] += model.shafts.T @ (model.shaft_laws[:, column, None] * model.shafts)
        stiffness = found[:, 0].mean(axis=0)
        sizes, mode = dimensions(model), np.arange(model.lag.size)
        train, first = _train(model)
        springs = model.shafts[model.shaft_laws[:, STIFFNESS] > 0.0]
        rotors = (model.euler_load != 0.0) & (np.abs(springs).max(axis=0, initial=0.0) > 0.0)
        rotors &= (mode >= sizes.crank_modes) & (mode < first) & (model.rotor == 0.0)
        behind = np.vstack((np.diag(model.euler_load)[rotors], train))
        turns = np.vstack((model.euler_load - behind.sum(axis=0), behind))
        turns[0, model.rotor != 0.0] = 0.0  # The dynamometer does not turn.
        elastic = (mode >= first) & (model.omega2[: mode.size] > 0.0)
        found[:, 0] += np.diag(np.where(elastic, model.omega2[: mode.size], 0.0))
        own = found[:, 0].mean(axis=0)
        turns[:, elastic] -= np.linalg.solve(own[np.ix_(elastic, elastic)], stiffness[elastic] @ turns.T).T
        return cls(turns, turns @ found[:, 0] @ turns.T, turns @ found[:, 1] @ turns.T)


def wind_train(model: ModelArrays) -> None:
    """Write to a model how the springs between crank and drive line share in the wind-up at the start of a run."""
    still, first = np.zeros((1, 2, model.omega2.size)), dimensions(model).crank_modes
    line, shafts = Line.of(model, still), float(model.scalars[at.SHAFT_K])
    if shafts <= 0.0 or not line_tangents(model, still)[0, 0].any():
        return
    # For a unit rotation of the crank, each other inertia is in equilibrium with its springs.
    matrix = line.stiffness[0]
    follow = np.append(1.0, -np.linalg.lstsq(matrix[1:, 1:], matrix[1:, 0], rcond=None)[0])
    stiffness = float(follow @ matrix @ follow)
    if stiffness > 0.0:
        model.lag[first:] = (model.euler_load - follow @ line.turns)[first:]
        model.lumps.lag[:] = model.lag
        model.lumps.traits[of.AHEAD] = 1.0 / stiffness - 1.0 / shafts
        model.scalars[at.SHAFT_K] = stiffness


def _train(model: ModelArrays) -> tuple[Array, int]:
    """Modal motion (k, n_t) by rotation of bodies between crank and drive line, and the first of their modes."""
    n = model.ports.shape[1]
    found, first = list[Array](), n
    for b, row in enumerate(model.bodies.rows[top.OTHERS :], top.OTHERS):
        if row[top.MODE] >= n or not row[top.TIED]:
            continue
        turn = model.bodies.constants[b, top.RATE] * model.of_body(b, "euler_load")
        moved = model.bodies.translation[:, row[top.OWN_MODE] : row[top.OWN_MODE] + row[top.MODES]]
        first = min([first, *np.flatnonzero(moved.any(axis=0)).tolist()])
        # Bodies joined by rigid gears turn together.
        together = [k for k, other in enumerate(found) if (other * turn).any()]
        for k in together:
            turn = turn + found[k]
        found = [other for k, other in enumerate(found) if k not in together] + [turn]
    return np.array(found).reshape(-1, n), first


def line_tangents(model: ModelArrays, motions: Array) -> Array:
    """Stiffness and damping (s, 2, n_t, n_t) of added connections between the engine's rotating bodies along a motion.

    See :class:`Line` for ``motions``. There is one interval, s = 1, if no connection acts between these bodies.
    """
    n, links, begin = model.ports.shape[1], model.links, int(model.layout[at.TERM_ROW])
    found = np.zeros((max(1, len(motions) - 1), 2, n, n))
    rows = SmallMotions(model, still=True).components() if begin < len(model.connections) else found
    for entry, row in zip(model.laws.entry[begin:].tolist(), model.connections[begin:], strict=True):
        own = slice(row[at.GAP], row[at.GAP] + row[at.COUPLED])
        if rows[own, n:].any():
            continue
        between = rows[own, :n]
        moved = motions[:, :, :n] @ between.T
        if len(motions) == 1:
            moved = np.stack((moved[0], moved[0]))
            moved[:, 1] = SLIDING * links.scales[own]
        tangents = np.array([_secants(entry, *pair) for pair in pairwise(moved)])
        found -= np.einsum("ij,skil,lm->skjm", between, tangents, between)
    return found if found.any() else found[:1]


def _secants(entry: Sequence[int], before: Array, after: Array) -> tuple[Array, Array]:
    """Derivatives (c, c) of a law's forces by place and velocity that give its change between two motions (2, c).

    They are its tangents where these give the change already.
    """
    count, numbers, out = before.shape[1], np.zeros(NUMBERS), np.zeros(SIZE)
    numbers[COS] = 1.0

    def called(place: Array, velocity: Array) -> tuple[Array, Array, Array]:
        law_at(*entry, np.pad(place, (0, 4 - count)), np.pad(velocity, (0, 4 - count)), numbers, out)
        by_place, by_velocity = (
            out[first : first + 16].reshape(4, 4)[:count, :count].copy() for first in (BY_PLACE, BY_VELOCITY)
        )
        return out[:count].copy(), by_place, by_velocity

    (x, v), (x1, v1) = before, after
    first, (middle, by_place, _), (last, _, by_velocity) = called(x, v)[0], called(x1, v), called(x1, v1)
    for by, change, step in ((by_place, middle - first, x1 - x), (by_velocity, last - middle, v1 - v)):
        if step.any():
            by += np.outer(change - by @ step, step) / (step @ step)
    return by_place, by_velocity
