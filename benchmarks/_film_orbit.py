"""Films of the six's main bearings along the orbits of its journals, for benchmarks of their cost and error.

Orbits are those of the running engine over one cycle at 2000 rev/min, a sample per degree: with films ``reynolds`` for
rigid bores, with films ``ehd`` for elastic ones, whose journals go further. Films are called as the running model calls
them, with tangents, each from where it stood a degree before. Elastic films remember their oil: the cycle is run
through twice, and what they remember at every sample is kept, so that a timed call begins as it did then.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from statistics import median
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.dynamics.simulation import Parts, Settings, Simulation
from cranktrain.engine.lubricant import oil_temperature, viscosity
from cranktrain.engine.model import Engine
from cranktrain.film.elastic.bore_compliance import BoreCompliance
from cranktrain.film.elastic.grid import ElasticGrid
from cranktrain.film.laws.bearings import Bearings, bearing_parameters, enter, law_films
from cranktrain.film.laws.ehd import IN_LOOP as ELASTIC_IN_LOOP
from cranktrain.film.laws.ehd import elastic_bore, elastic_law, film_values
from cranktrain.film.laws.films import (
    CLOSE_STAGE,
    CLOSE_STEP,
    COS,
    ELAPSED,
    FORCE,
    GAIN,
    MEMORY,
    OPEN_STAGE,
    OPEN_STEP,
    RUBBING,
    SIN,
    SPEED,
    STEP,
    Films,
    film_call,
    no_films,
)
from cranktrain.film.laws.register import PLAIN, bearing_law
from cranktrain.film.laws.rigid_bore import IN_LOOP as RIGID_IN_LOOP
from cranktrain.film.laws.rigid_bore import reynolds_law, rigid_bore, table_law
from cranktrain.film.table.database import FilmTable

Array = NDArray[np.float64]
kernel: Any = njit(error_model="numpy")

RUNNING = 2000.0 * math.pi / 30.0
STEPS = 720
RUN_IN = 150
"""Steps of the default size, just over half a cycle, before orbits are taken."""
SHORTEST = 0.02
LAPS = 2
"""Cycles until elastic films repeat themselves."""


@dataclass(frozen=True)
class Orbit:
    """Motion of middle and end of ``b`` journals in space, (STEPS + 1, b, 4) each, m and m/s."""

    places: Array
    velocities: Array

    def journals(self, chosen: slice) -> Orbit:
        """Motion of some of them."""
        return Orbit(self.places[:, chosen].copy(), self.velocities[:, chosen].copy())

    def repeated(self, count: int) -> Orbit:
        """As many journals on equal orbits."""
        return Orbit(np.tile(self.places, (1, count, 1)), np.tile(self.velocities, (1, count, 1)))

    @property
    def count(self) -> int:
        """Number of journals."""
        return int(self.places.shape[1])


@dataclass(frozen=True)
class OrbitFilms:
    """Films with the orbit of their journals; ``kept`` (STEPS + 1, b, ·) is what they remember at every sample."""

    films: Films
    orbit: Orbit
    kept: Array
    forces: Array
    """(STEPS, b, 4) N"""

    def first(self, count: int, steps: int) -> OrbitFilms:
        """The first films over the first steps."""
        o = self.orbit
        shorter = Orbit(o.places[: steps + 1, :count].copy(), o.velocities[: steps + 1, :count].copy())
        return OrbitFilms(self.films, shorter, self.kept[: steps + 1, :count].copy(), np.empty((steps, count, 4)))

    def call(self) -> None:
        """Force and tangents of all films at all samples; raises ``RuntimeError`` where one failed."""
        self._around(False)

    def carry(self) -> None:
        """The same, and every step closed: films remember in ``kept``."""
        self._around(True)

    def _around(self, carry: bool) -> None:
        o = self.orbit
        around(self.films, o.places, o.velocities, self.kept, _DURATION, self.forces, carry)
        if not np.isfinite(self.forces).all():
            raise RuntimeError("a film of the orbit has no force")


_DURATION = math.radians(720.0) / STEPS / RUNNING


def started(
    engine: Engine, body: ReducedBody, level: str, table: FilmTable | None = None, bore: BoreCompliance | None = None
) -> Simulation:
    """The engine with films of ``level`` after its run-in, default settings."""
    simulation = Simulation(engine, body, Settings(bearings=level), parts=Parts(table=table, bore=bore))
    simulation.inputs[0] = RUNNING
    simulation.initialize()
    for k in range(RUN_IN):
        simulation.step((k + 1) * simulation.settings.step / RUNNING)
    return simulation


def engine_orbit(simulation: Simulation) -> Orbit:
    """Orbits of all main journals over the next cycle."""
    films, begin = simulation.model.films, simulation.time
    motion = np.empty((2, STEPS + 1, *films.place.shape))
    for n in range(STEPS + 1):
        simulation.step(begin + (n + 1) * _DURATION)
        cos, sin = films.numbers[COS], films.numbers[SIN]
        for fixed, turning in zip(motion[:, n], (films.place, films.velocity), strict=True):
            fixed[:, ::2] = cos * turning[:, ::2] - sin * turning[:, 1::2]
            fixed[:, 1::2] = sin * turning[:, ::2] + cos * turning[:, 1::2]
    return Orbit(motion[0], motion[1])


@kernel
def around(films, places, velocities, kept, h, forces, carry):
    """Films over one cycle; ``carry``: close every step and keep what films remember in ``kept[1:]``."""
    out = films.out
    numbers = films.numbers
    numbers[ELAPSED] = h
    numbers[STEP] = h
    numbers[GAIN] = h
    for n in range(places.shape[0] - 1):
        for i in range(places.shape[1]):
            if films.traits[i, MEMORY] > 0.0:
                for k in range(4):
                    films.place[i, k] = places[n, i, k]
                film_call(films, OPEN_STEP, i, kept[n, i], out)
                film_call(films, OPEN_STAGE, i, kept[n, i], out)
            for k in range(4):
                films.place[i, k] = places[n + 1, i, k]
                films.velocity[i, k] = velocities[n + 1, i, k]
            film_call(films, FORCE, i, kept[n, i], out)
            for k in range(4):
                forces[n, i, k] = out[k]
            if carry:
                if film_call(films, CLOSE_STAGE, i, kept[n, i], out) != 0:
                    forces[n, i, 0] = math.nan
                film_call(films, CLOSE_STEP, i, kept[n + 1, i], out)


def oil(engine: Engine) -> float:
    """Viscosity at the running speed, Pa s."""
    return viscosity(engine.oil, oil_temperature(engine.oil, RUNNING))


def plane_films(engine: Engine, orbit: Orbit, level: str) -> OrbitFilms:
    """Films that feel no tilt; their moments are zero."""
    bearing, count = engine.plain_mains, orbit.count
    parameters = np.tile(bearing_parameters(bearing, oil(engine)), (count, 1))
    films = law_films(bearing_law(level), PLAIN, Bearings(parameters, bearing))
    films.numbers[SPEED] = films.numbers[RUBBING] = RUNNING
    films.numbers[COS] = 1.0
    return OrbitFilms(films, orbit, np.zeros((STEPS + 1, count, 1)), np.empty((STEPS, count, 4)))


def rigid_films(
    engine: Engine, orbit: Orbit, grid: tuple[int, int] = RIGID_IN_LOOP, table: FilmTable | None = None
) -> OrbitFilms:
    """Films solved in place on ``grid``, or read from ``table``."""
    bearing, count = engine.plain_mains, orbit.count
    films = _films(count)
    parameters = np.tile(bearing_parameters(bearing, oil(engine)), (count, 1))
    record = rigid_bore(bearing, parameters, table, films.solved, size=grid)
    enter(films, reynolds_law if table is None else table_law, record)
    return OrbitFilms(films, orbit, np.zeros((STEPS + 1, count, 1)), np.empty((STEPS, count, 4)))


def elastic_films(
    engine: Engine, orbit: Orbit, bore: BoreCompliance, grid: ElasticGrid = ELASTIC_IN_LOOP
) -> OrbitFilms:
    """Elastic films on ``grid`` that have run through the orbit until they repeat."""
    count = orbit.count
    films = _films(count)
    record = elastic_bore(engine.plain_mains, np.full(count, oil(engine)), bore, grid)
    size = film_values(record)
    films.traits[:, MEMORY] = size
    enter(films, elastic_law, record)
    result = OrbitFilms(films, orbit, np.zeros((STEPS + 1, count, size)), np.empty((STEPS, count, 4)))
    for _ in range(LAPS):
        result.carry()
        result.kept[0] = result.kept[-1]
    return result


def softest(bore: BoreCompliance, count: int) -> BoreCompliance:
    """The bore in its first ``count`` shapes; 0: rigid."""
    return replace(
        bore,
        coefficients=bore.coefficients[:count],
        compliance=bore.compliance[:count],
        load_coupling=bore.load_coupling[:count],
        captured=bore.captured[:count],
    )


def _films(count: int) -> Films:
    films = no_films(count)
    films.numbers[SPEED] = films.numbers[RUBBING] = RUNNING
    films.numbers[COS] = 1.0
    return films


def interleaved(cases: Sequence[Callable[[], None]], repeats: int) -> list[float]:
    """Median processor seconds of each case over ``repeats`` rounds; in turn, because the machine's speed drifts.

    Short cases are called often enough in each round for ``SHORTEST`` seconds.
    """
    calls = []
    for case in cases:
        case()
        calls.append(max(1, math.ceil(SHORTEST / _seconds(case, 1))))
    rounds = [[_seconds(case, n) for case, n in zip(cases, calls, strict=True)] for _ in range(repeats)]
    return [median(column) for column in zip(*rounds, strict=True)]


def _seconds(case: Callable[[], None], calls: int) -> float:
    """Processor seconds of a call."""
    start = time.process_time()
    for _ in range(calls):
        case()
    return max(time.process_time() - start, 1.0e-6) / calls
