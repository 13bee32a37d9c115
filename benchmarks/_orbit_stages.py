"""Elastic films of an engine's mains along given orbits, by the stages of an integrator.

The orbit of each journal is that of the running engine, or one made up, as a Fourier series over a cycle. The
velocities of the series are given to the stages; places follow from them by the rule of the integrator, as in the
running model, so that gaps grow from step to step by exactly what the films are told.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cranktrain.core.kernel import RECORDS
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation
from cranktrain.dynamics.time.integrators import integrator_table
from cranktrain.dynamics.time.table import C_V, EXPLICIT_FIRST, FIRST_STAGE, HEAD, NODE, STAGES
from cranktrain.engine.file import load_engine
from cranktrain.engine.lubricant import oil_temperature, viscosity
from cranktrain.film.elastic.grid import FILM_MIN, OIL, SIDE_FLOW, SUPPLY_FLOW
from cranktrain.film.elastic.workspace import lane_work
from cranktrain.film.laws.bearings import enter
from cranktrain.film.laws.ehd import ElasticBore, elastic_bore, elastic_law, film_values
from cranktrain.film.laws.films import (
    CLOSE_STAGE,
    CLOSE_STEP,
    COS,
    ELAPSED,
    FORCE,
    GAIN,
    LINE_UP,
    MEMORY,
    OPEN_STAGE,
    OPEN_STEP,
    RUBBING,
    SIN,
    SPEED,
    STAGE,
    STEP,
    film_call,
    no_films,
)
from cranktrain.structure.assembly import assemble

Array = NDArray[np.float64]
kernel: Any = njit(error_model="numpy")

SAMPLES = 360
"""Samples of an orbit, every two degrees."""
HARMONICS = 40
"""Of the cycle, in the Fourier series of an orbit; chosen: a film's peak of pressure lasts some 20 degrees."""
CYCLE = 4.0 * math.pi


@kernel
def act(films, action, places, velocities, memory, row):
    """Let every film act at its place and velocity, (b, 4); ``row`` of the stage for OPEN_STAGE. Sum of statuses."""
    failed = 0
    for i in range(places.shape[0]):
        for k in range(4):
            films.place[i, k] = places[i, k]
            films.velocity[i, k] = velocities[i, k]
        failed += film_call(films, action, i, row if action == OPEN_STAGE else memory[i], films.out)
    return failed


@dataclass(frozen=True)
class Orbits:
    """Fourier series over the crank angle of b journals: means (b, 4), m, and coefficients (HARMONICS, b, 4)."""

    bore: ElasticBore
    speed: float  # rad/s
    means: Array
    series: NDArray[np.complex128]

    def at(self, angles: Array) -> tuple[Array, Array]:
        """Places (n, b, 4), m, and velocities, m/s, at ``angles`` (n,), rad."""
        orders = 0.5 * np.arange(1, HARMONICS + 1)
        waves = np.exp(1j * np.outer(angles, orders))
        places = self.means + 2.0 * np.tensordot(waves, self.series, 1).real
        rates = 2.0 * np.tensordot(1j * orders * waves, self.series, 1).real
        return places, self.speed * rates


def engine_orbits(name: str, rpm: float, cycles: int = 2) -> Orbits:
    """Orbits of the mains of an engine in its last cycle of a run with elastic films."""
    made = assemble(load_engine(name), Settings(bearings="ehd", crank="beam", block="ground"))
    run = Simulation(made.engine, made.body, made.settings, None, made.parts)
    speed = rpm * math.pi / 30.0
    run.inputs[0] = speed
    run.initialize()
    bore = RECORDS[int(run.model.films.entry[0, 1])]
    films, count = run.model.films, len(bore.viscosities)
    places = np.empty((SAMPLES, count, 4))
    for n in range(cycles * SAMPLES):
        run.step((n + 1) * CYCLE / SAMPLES / speed)
        cos, sin, place = films.numbers[COS], films.numbers[SIN], films.place[:count]
        places[n % SAMPLES, :, ::2] = cos * place[:, ::2] - sin * place[:, 1::2]
        places[n % SAMPLES, :, 1::2] = sin * place[:, ::2] + cos * place[:, 1::2]
    return orbits_through(bore, speed, places)


def worst_orbit(name: str, rpm: float, highest: float) -> Orbits:
    """One main of an engine on an orbit whose eccentricity rises to ``highest`` and falls to 0.3 twice a cycle."""
    made = assemble(load_engine(name), Settings(bearings="ehd", crank="rigid", block="ground"))
    plain, speed = made.engine.plain_mains, rpm * math.pi / 30.0
    thin = viscosity(made.engine.oil, oil_temperature(made.engine.oil, speed))
    bore = elastic_bore(plain, np.full(1, thin), made.parts.bore)
    t = np.arange(SAMPLES) * CYCLE / SAMPLES
    size, angle = 0.5 * (highest + 0.3) - 0.5 * (highest - 0.3) * np.cos(t), -1.2 + np.sin(0.5 * t) + 0.4 * np.cos(t)
    middle = np.stack([size * np.cos(angle), size * np.sin(angle)], axis=1)
    tilt = 0.03 * np.stack([np.sin(0.5 * t), np.cos(t)], axis=1)
    places = plain.clearance * np.concatenate([middle, tilt], axis=1)[:, None]
    return orbits_through(bore, speed, places)


def orbits_through(bore: ElasticBore, speed: float, places: Array) -> Orbits:
    """Fourier series through samples (SAMPLES, b, 4) of a cycle, which need not close."""
    spectrum = np.fft.rfft(places, axis=0) / len(places)
    return Orbits(bore, speed, spectrum[0].real, spectrum[1 : HARMONICS + 1])


@dataclass
class Cycle:
    """Films after each of ``steps`` steps."""

    unknowns: Array  # (b, N) at the end
    content: Array  # (steps, b) m³
    impulses: Array  # (steps, b, 4) ∫ F dt by the weights of the stages, N s
    forces: Array  # (steps, b, 4) N
    least: Array  # (steps, b) least film, m
    gained: Array  # (steps, b) ∫ (supply − side flow) dt by the weights, m³
    switched: float  # nodes that changed sides, a step and film


class StagedFilms:
    """Films of some orbits, stepped by an integrator; ``lanes``: side by side in singles, else one by one."""

    def __init__(self, orbits: Orbits, lanes: bool = False) -> None:
        self.orbits, bore = orbits, orbits.bore
        count = len(bore.viscosities)
        self.bore = bore._replace(lanes=lane_work(bore.film, count if lanes else 0, singles=True))
        films = no_films(count)
        films.numbers[SPEED] = films.numbers[RUBBING] = orbits.speed
        films.numbers[COS], films.numbers[SIN] = 1.0, 0.0
        films.traits[:, MEMORY] = film_values(bore)
        enter(films, elastic_law, self.bore)
        self.films = films
        self.memory = np.zeros((count, film_values(bore)))
        self.end = np.zeros(count), np.zeros((count, 4))

    def cycle(self, integrator: str, steps: int) -> Cycle:
        """One cycle from and into ``memory``."""
        table = integrator_table(integrator)
        stages, begin = int(table[HEAD, STAGES]), int(table[HEAD, EXPLICIT_FIRST])
        rows = table[FIRST_STAGE : FIRST_STAGE + stages]
        h = CYCLE / steps / self.orbits.speed
        times = (np.arange(steps)[:, None] + rows[:, NODE]) * CYCLE / steps
        velocities = self.orbits.at(times.ravel())[1].reshape(steps, stages, -1, 4)
        place = self.orbits.at(np.zeros(1))[0][0]
        count, out = len(place), self.bore.memory.out
        size = self.bore.memory.start.shape[1]
        kept = Cycle(np.empty(0), np.empty((steps, count)), *np.empty((2, steps, count, 4)),
                     *np.empty((2, steps, count)), 0.0)  # fmt: skip
        numbers, films = self.films.numbers, self.films
        flows, forces = np.zeros((stages, count)), np.zeros((stages, count, 4))
        impulse, gained = np.zeros((count, 4)), np.zeros(count)
        switched = 0
        flows[-1], forces[-1] = self.end
        for n in range(steps):
            sides = self.memory[:, :size] < 0.0
            act(films, OPEN_STEP, place, velocities[n, 0], self.memory, rows[0])
            flows[0], forces[0] = flows[-1], forces[-1]
            for s in range(begin, stages):
                numbers[ELAPSED], numbers[STEP] = rows[s, NODE] * h, h
                numbers[GAIN], numbers[STAGE] = table[HEAD, C_V] * h, s
                at = place + h * np.tensordot(rows[s, : s + 1], velocities[n, : s + 1], 1)
                for action in (OPEN_STAGE, LINE_UP, FORCE, LINE_UP, CLOSE_STAGE):
                    if act(films, action, at, velocities[n, s], self.memory, rows[s]) != 0:
                        raise RuntimeError(f"a film of step {n} has no solution")
                flows[s] = out[:, SUPPLY_FLOW] - out[:, SIDE_FLOW]
                forces[s] = out[:, :4]
            place = at
            act(films, CLOSE_STEP, place, velocities[n, -1], self.memory, rows[0])
            weights = h * rows[-1, :stages]
            impulse += np.tensordot(weights, forces, 1)
            gained += weights @ flows
            kept.content[n], kept.impulses[n], kept.gained[n] = out[:, OIL], impulse, gained
            kept.forces[n], kept.least[n] = forces[-1], out[:, FILM_MIN]
            switched += int((sides != (self.memory[:, :size] < 0.0)).sum())
        self.end = flows[-1].copy(), forces[-1].copy()
        kept.unknowns = self.memory[:, :size].copy()
        kept.switched = switched / steps / count
        return kept
