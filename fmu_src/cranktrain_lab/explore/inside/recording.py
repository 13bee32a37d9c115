"""Run at one speed until its cycles repeat, recorded for display."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cranktrain.core.units import RPM
from cranktrain.dynamics.simulation import Simulation, fitted_engine
from cranktrain.engine.model import Engine
from cranktrain.results.strength.recorded_cycle import RecordedCycle, recorded_cycle
from cranktrain.results.strength.stress import CrankStress
from cranktrain.structure.assembly import assemble
from cranktrain.structure.crank.reduction import reduced_crankshaft
from cranktrain.structure.stress.stress_modes import stress_modes
from cranktrain.studies.constant_speed import Request
from cranktrain_lab.explore.background import Advance, Say
from cranktrain_lab.explore.inside.crank_surface import crank_surface_of
from cranktrain_lab.explore.inside.cycle import FRAME_DEG, InsideCycle, Repeated, bearing_looks
from cranktrain_lab.explore.inside.film_record import FilmWatch

SETTLE = 1.0e-3
STRESSED = "solid"
"""Crank level whose surface has stresses."""


@dataclass(frozen=True)
class SteadyJob:
    """Base class of jobs with steady cycles: engine, levels, load, (first) speed (rad/s), and settling error."""

    engine: Engine
    crank: str
    bearings: str
    big_ends: str
    load: float
    speed: float
    settle: float = SETTLE

    def check(self) -> None:
        """Raise ``InputError`` for settings that the engine cannot run, before any work."""
        self.request().settings(self.engine)

    def request(self) -> Request:
        """Return the request of the run, at its first speed."""
        levels: dict[str, Any] = {"crank": self.crank, "bearings": self.bearings, "big_ends": self.big_ends}
        fitted = self.engine.damper is not None
        return Request(speed_rpm=self.speed / RPM, settle=self.settle, damper=fitted, load=self.load, **levels)


class LookInside(SteadyJob):
    """Job that records a cycle at one speed for display."""

    def work(self, path: Path, say: Say, advance: Advance) -> str:
        """Run, and write the cycle to ``path``; raises errors of the package."""
        self.record(say, advance)[0].save(path)
        return ""

    def record(
        self, say: Callable[[str], None], advance: Callable[[str, float], None]
    ) -> tuple[InsideCycle, RecordedCycle, CrankStress | None]:
        """Run and return the cycle for display, with the recorded cycle and stresses it was made from.

        Raises ``InputError``, ``SolverError``, ``StoreError``.
        """
        request = self.request()
        settings = replace(request.settings(self.engine), gas_load=self.load)
        modes = stress_modes(self.engine, None, say) if settings.crank == STRESSED else None
        made = assemble(self.engine, settings, say=say)
        simulation = Simulation(self.engine, made.body, made.settings, None, made.parts)
        simulation.inputs[0] = request.speed
        watch = FilmWatch(simulation)
        cycle = recorded_cycle(
            simulation, fitted_engine(self.engine, made.settings), self.settle,
            lambda share: advance("cycles until they repeat", 0.9 * share), say, watch.look,
        )  # fmt: skip
        advance("loads and films", 0.9)
        order = cycle.last_samples
        shown = {name: cycle.outputs[name] for name in simulation.shown_outputs}
        films = {name: film.at(order) for name, film in watch.films().items()}
        looks = bearing_looks(Repeated.of(shown, order, request.speed), self.engine)
        looks = tuple(
            replace(one, film=films[one.name].at([one.sample(frame) for frame in range(720 // FRAME_DEG)]))
            if one.name in films
            else one
            for one in looks
        )
        stress = surface = None
        if modes is not None:
            advance("stresses over the cycle", 0.92)
            stress = CrankStress.of(reduced_crankshaft(self.engine), modes, cycle)
            surface = crank_surface_of(self.engine, cycle.body, stress, FRAME_DEG)
        chosen = made.settings
        levels = {"crank": chosen.crank, "bearings": chosen.bearings, "big_ends": chosen.big_ends}
        found = InsideCycle(self.engine.name, request.speed, levels, looks, surface, attributes={"load": self.load})
        return found, cycle, stress
