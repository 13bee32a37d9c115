"""Elastic films side by side: each lane against the solver of single films, whatever its neighbours."""

from __future__ import annotations

import math
from dataclasses import replace

import entry
import numpy as np
import pytest
from some import some

from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.file import load_engine
from cranktrain.film.elastic import grid as one
from cranktrain.film.elastic.begin import choose_cut, set_lane, turn_geometry
from cranktrain.film.elastic.content import CONTENT
from cranktrain.film.elastic.film import CONVERGED, NOT_CONVERGED, elastic_film, solve_group
from cranktrain.film.elastic.grid import LIMITS
from cranktrain.film.elastic.oil import oil_tables
from cranktrain.film.elastic.workspace import PREPARED, lane_work
from cranktrain.film.laws.ehd import IN_LOOP, ElasticMemory, elastic_arrays, elastic_memory
from cranktrain.structure.assembly import assemble

STEP = math.radians(2.0)
THICK = 3.45e8
"""Pa at which oil of 20 1/GPa after Barus flows a thousandth."""
FORCE = slice(one.FORCE, one.FORCE + 4)
STIFFNESS = slice(one.STIFFNESS, one.STIFFNESS + 16)
DAMPING = slice(one.DAMPING, one.DAMPING + 16)


class Films:
    """Films of an engine at the end of some steps, and a stage of the next one."""

    def __init__(self, name: str, rpm: float, steps: int, law: str = "none") -> None:
        engine = load_engine(name)
        speed = rpm * math.pi / 30.0
        made = assemble(engine, Settings(bearings="ehd", crank="beam", block="ground"))
        run = Simulation(made.engine, made.body, made.settings, None, made.parts)
        run.inputs[0] = speed
        run.initialize()
        h = STEP / speed
        run.series(h, 1, np.zeros((steps, run.outputs.size)))
        self.bore = entry.film_record(run)
        memory = self.bore.memory
        self.count = len(self.bore.viscosities)
        self.film: one.ElasticFilm = self.bore.film
        self.thick = law != "none"
        if self.thick:
            oil = oil_tables(replace(engine.oil, pressure_law=law), self.bore.viscosities)
            first = float(self.bore.viscosities[0])
            self.film = elastic_arrays(engine.main_bearing, first, made.parts.bore, IN_LOOP, oil)
        self.speed, self.elapsed, self.gain = speed, h, 0.4358665 * h
        self.start, self.shapes = memory.unknowns.copy(), memory.shapes.copy()
        theta, laws = entry.frame(run)[0], [entry.law(run, f"main[{i + 1}]") for i in range(self.count)]
        self.places, self.paces = (
            _turned(np.array(of_films), math.cos(theta), math.sin(theta))
            for of_films in ([law.place for law in laws], [law.velocity for law in laws])
        )
        self.next = self.places + 0.5 * h * self.paces

    def _memory(self) -> ElasticMemory:
        """Memory of the films at the start of the stage, without content."""
        memory = elastic_memory(self.film, self.count)._replace(content=np.zeros((self.count, CONTENT, 0)))
        memory.start[:], memory.unknowns[:] = self.start, self.start
        memory.start_place[:], memory.speeds[:] = self.places, self.speed
        memory.motions[:, 0], memory.motions[:, 1] = self.next, self.paces
        for rows in (memory.start_shapes, memory.known, memory.shapes):
            rows[:] = self.shapes
        return memory

    def alone(self, i: int) -> np.ndarray:
        """Results of film i in doubles; tangents belong to the state before the last step, so its limits are equal."""
        self.film.constants[one.STEP_LIMIT : one.STEP_LIMIT + 4] = (1.0e-4, 1.0e-4, *LIMITS[2:])
        memory, clock = self._memory(), (self.elapsed, self.gain)
        viscosity = float(self.bore.viscosities[i])
        self.bore.scratch.marks[:, :, PREPARED] = 0.0
        assert elastic_film(self.film, self.bore.scratch, i, clock, memory, viscosity, True) == CONVERGED
        return memory.out[i]

    def together(self, which: list[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Results, unknowns and shapes of films in lanes; none is kept of those whose oil hardly flows."""
        self.film.constants[one.STEP_LIMIT : one.STEP_LIMIT + 4] = (1.0e-4, 1.0e-4, 1.0e-5, 1.0e-9)
        work, memory = lane_work(self.film, 8, singles=True), self._memory()
        for lane in range(8):
            i = which[lane] if lane < len(which) else which[0]
            work.wanted[lane] = work.tangents[lane] = float(lane < len(which))
            turn_geometry(self.film, work, 0, lane, choose_cut(self.film, self.start[i]))
            set_lane(self.film, work, lane, i, self.bore.viscosities[i], memory)
        solve_group(self.film, work, 0, (self.elapsed, self.gain, 1.0), memory)
        for lane, i in enumerate(which):
            stiff = self.thick and self.alone(i)[one.PRESSURE_MAX] > THICK
            assert work.status[lane] == (NOT_CONVERGED if stiff else CONVERGED)
        return memory.out, memory.unknowns, memory.shapes


def _turned(pairs: np.ndarray, cos: float, sin: float) -> np.ndarray:
    """Pairs of components (b, 4) along a frame's axes, in space."""
    x, y = pairs[:, 0::2], pairs[:, 1::2]
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=2).reshape(pairs.shape)


CASES = {
    "six": ("diesel_i6", 2000.0, 187),
    "barus": ("diesel_i6", 2000.0, 187, "barus"),
    "single": ("single_petrol", 3000.0, 100),
    "twelve": ("v12_petrol", 5000.0, 150),
}


@pytest.fixture(scope="module", params=CASES)
def films(request: pytest.FixtureRequest) -> Films:
    return Films(*CASES[request.param])


def test_a_lane_holds_what_a_single_film_does(films: Films) -> None:
    which = list(range(min(films.count, 8)))
    outs, _, _ = films.together(which)
    for i in some(which):
        known, found = films.alone(i), outs[i]
        if not outs[i].any():
            assert known[one.PRESSURE_MAX] > THICK
            continue
        size = np.abs(known[FORCE]).max()
        assert found[FORCE] == pytest.approx(known[FORCE], abs=2.0e-6 * size)
        for part in (STIFFNESS, DAMPING):
            assert found[part] == pytest.approx(known[part], abs=2.0e-4 * np.abs(known[part]).max())
        for figure in (one.PRESSURE_MAX, one.FILM_MIN, one.OIL, one.FILL_MEAN, one.FRICTION_TORQUE, one.SUPPLY_FLOW):
            assert found[figure] == pytest.approx(known[figure], rel=1.0e-4)


def test_no_digit_of_a_film_depends_on_its_neighbours(films: Films) -> None:
    which = list(range(min(films.count, 8)))
    outs, unknowns, shapes = films.together(which)
    for i in which:
        alone, own_unknowns, own_shapes = films.together([i])
        assert np.array_equal(alone[i], outs[i]) and np.array_equal(own_unknowns[i], unknowns[i])
        assert np.array_equal(own_shapes[i], shapes[i])
    turned = which[::-1]
    others, _, _ = films.together(turned)
    assert np.array_equal(others[turned], outs[turned])
