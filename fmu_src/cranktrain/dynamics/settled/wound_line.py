"""The drive line in slow wind-up by the crank, including added connections between the crank and its discs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import lump_slots as of
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.records import ModelArrays, dimensions
from cranktrain.dynamics.tangents import law_at
from cranktrain.dynamics.topology import slots as top
from cranktrain.dynamics.topology.frames import coefficients_at
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, COS, NUMBERS, SIZE
from cranktrain.loads.torsional_line import AT_FLYWHEEL, DAMPING, LEADING, STIFFNESS

SLIDING = 1.0e3
"""Rate of a component, in scales (0.001 rad of a twist) a second, at which connections have their tangents; chosen."""


class Wound(NamedTuple):
    """The drive line in slow wind-up: modal motion (n_t,) per rotation of the crank, stiffness and damping."""

    turn: Array
    stiffness: float
    damping: float

    @classmethod
    def of(cls, model: ModelArrays) -> Wound:
        """Slow wind-up of the drive line's own shafts and of added connections."""
        laws, turn = model.shaft_laws, model.euler_load - model.lag
        # Rows without stiffness, lead and flywheel are dampers only, see dynamics.model.hysteresis.
        damps = ~laws[:, [STIFFNESS, LEADING, AT_FLYWHEEL]].any(axis=1)
        lost = float(laws[damps, DAMPING] @ (model.shafts[damps] @ turn) ** 2)
        own = cls(turn, float(model.scalars[at.SHAFT_K]), float(model.scalars[at.SHAFT_C]) + lost)
        stiffness, damping = line_tangents(model)
        train = train_rotations(model)
        rotors = np.arange(model.lag.size) >= dimensions(model).crank_modes
        rotors &= np.abs(model.shafts[~damps]).max(axis=0, initial=0.0) > 0.0
        rotors &= ~train.any(axis=0) & (model.rotor == 0.0)
        free = np.vstack((np.eye(model.lag.size)[rotors], train))
        if not (free @ stiffness).any():
            return own
        for matrix, column in ((stiffness, STIFFNESS), (damping, DAMPING)):
            matrix += model.shafts.T @ (model.shaft_laws[:, column, None] * model.shafts)
        # For a unit rotation of the crank, each rotor of the drive line is in equilibrium with its springs.
        turn = model.euler_load - train.sum(axis=0)
        turn[rotors | (model.rotor != 0.0)] = 0.0
        turn -= free.T @ np.linalg.lstsq(free @ stiffness @ free.T, free @ (stiffness @ turn), rcond=None)[0]
        return cls(turn, float(turn @ stiffness @ turn), float(turn @ damping @ turn))


def wind_train(model: ModelArrays) -> None:
    """Write to a model how the springs between crank and drive line share in the wind-up at the start of a run."""
    found, line, first = Wound.of(model), float(model.scalars[at.SHAFT_K]), dimensions(model).crank_modes
    if line > 0.0 and found.stiffness > 0.0:
        model.lag[first:] = (model.euler_load - found.turn)[first:]
        model.lumps.lag[:] = model.lag
        model.lumps.traits[of.AHEAD] = 1.0 / found.stiffness - 1.0 / line
        model.scalars[at.SHAFT_K] = found.stiffness


def train_rotations(model: ModelArrays) -> Array:
    """Modal motion (k, n_t) of the bodies between crank and drive line that turn with their frames, a row for each."""
    rows, n = model.bodies.rows[top.OTHERS :], model.ports.shape[1]
    found = [
        model.bodies.constants[b, top.RATE] * model.of_body(b, "euler_load")
        for b, row in enumerate(rows, top.OTHERS)
        if row[top.MODE] < n and row[top.TIED] > 0
    ]
    return np.array(found).reshape(-1, n)


def line_tangents(model: ModelArrays) -> tuple[Array, Array]:
    """Stiffness and damping (n_t, n_t) of added connections between the engine's rotating bodies, as they slide.

    At rest friction that slides would damp like a stiff damper.
    """
    links, turning = model.links, model.ports.shape[0]
    n = model.ports.shape[1]
    found = np.zeros((2, n, n))
    rows, elsewhere = np.zeros((links.scales.size, n)), np.zeros(links.scales.size, dtype=bool)
    for term, coefficient in zip(links.terms, coefficients_at(links.frames, links.terms, 0.0), strict=True):
        component, port = int(term[top.COMPONENT]), int(term[top.TERM_PORT])
        if port < turning:
            rows[component] += coefficient * model.ports[port]
        else:
            elsewhere[component] = True
    numbers, out = np.zeros(NUMBERS), np.zeros(SIZE)
    numbers[COS] = 1.0
    begin = int(model.layout[at.TERM_ROW])
    for entry, row in zip(model.laws.entry[begin:].tolist(), model.connections[begin:], strict=True):
        count = row[at.COUPLED]
        own = slice(row[at.GAP], row[at.GAP] + count)
        if elsewhere[own].any():
            continue
        velocity = np.zeros(4)
        velocity[:count] = SLIDING * links.scales[own]
        law_at(*entry, np.zeros(4), velocity, numbers, out)
        for matrix, first in zip(found, (BY_PLACE, BY_VELOCITY), strict=True):
            tangent = out[first : first + 16].reshape(4, 4)[:count, :count]
            matrix -= rows[own].T @ tangent @ rows[own]
    return found[0], found[1]
