"""Models of a scene: its engine at any pair of levels, cut-off, integrator and step, ready to run.

Bodies, film tables and elastic bores come from the cache or are made at their first use.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

from cranktrain.core.types import Progress
from cranktrain.dynamics.cycle_run import Result
from cranktrain.dynamics.model.settings import Settings, resolved
from cranktrain.dynamics.settled.judging import TOLERANCE
from cranktrain.dynamics.simulation import simulate
from cranktrain.film.laws.register import bearing_law
from cranktrain.loads.gas_pressure import Gas
from cranktrain.loads.pressure_map import read_gas
from cranktrain.structure.assembly import Assembly, assemble
from cranktrain.studies.scene import Scene

SETTLING_SHARE = 0.1
"""Largest settling error as a fraction of a scene's accuracy."""


@dataclass(frozen=True)
class Case:
    """One way to run a scene: levels, cut-off of the solid crank's modes (Hz), integrator and step (rad)."""

    crank: str
    bearings: str
    cutoff: float
    integrator: str
    step: float

    @property
    def levels(self) -> tuple[str, str]:
        """Crank level and bearing level."""
        return self.crank, self.bearings

    def __str__(self) -> str:
        """Text of levels, method and step."""
        return f"{self.crank}/{self.bearings}, {self.integrator} {math.degrees(self.step):g} deg"


class SceneModel:
    """Common data of all runs of one scene.

    Parameters
    ----------
    scene : the scene
    progress : receives the name of each stage of long work
    """

    def __init__(self, scene: Scene, progress: Progress | None = None) -> None:
        self.scene = scene
        self.say: Progress = progress or (lambda _: None)

    @property
    def all_modes(self) -> float:
        """Cut-off frequency of the crank's modes, Hz, with which no mode is left out."""
        return self.scene.engine.reduction.running_cutoff_hz

    @property
    def own_cutoff(self) -> float:
        """Cut-off frequency of the crank's modes, Hz: as fixed by the scene, else so high that all modes are kept."""
        return self.scene.cutoff or self.all_modes

    def settings(self, case: Case) -> Settings:
        """Complete settings of a case."""
        s = self.scene
        return resolved(
            Settings(
                crank=case.crank,
                bearings=case.bearings,
                big_ends=s.big_ends,
                block=s.block,
                pistons=s.pistons,
                damper=s.damper,
                integrator=case.integrator,
                step=case.step,
                gas_load=s.load,
                encoder=s.pressure.encoder if s.pressure else "pin",
                film_temperature=s.film_temperature if bearing_law(case.bearings).film else "engine",
            ),
            s.engine,
        )

    def assembly(self, case: Case) -> Assembly:
        """Assembly (bodies and parts of a run) of a case."""
        return assemble(self.scene.engine, self.settings(case), say=self.say, cutoff_hz=case.cutoff)

    @cached_property
    def gas(self) -> Gas | None:
        """Measured pressures of the scene, or None for the built-in combustion."""
        given = self.scene.pressure
        if given is None:
            return None
        gas = read_gas(given.file, self.scene.engine, given.unit, given.tdc_deg)
        gas.tell_ends(self.scene.speeds, self.scene.load)
        return gas

    @property
    def settle(self) -> float:
        """Largest settling error of a run that ends when its outputs repeat: a fraction of the scene's accuracy."""
        return min(TOLERANCE, SETTLING_SHARE * self.scene.accuracy)

    def run(
        self, case: Case, speed: float, cycles: int | None = None, progress: Callable[[float], None] | None = None
    ) -> Result:
        """Run a case at a speed (rad/s) for ``cycles``, by default as the scene states, or else until outputs repeat.

        Raises ``InputError``: levels that the engine lacks; ``SolverError``: a step that fails; ``KeyboardInterrupt``:
        also where an interrupt has ended the run early: half a run is none.
        """
        made, wanted = self.assembly(case), cycles or self.scene.cycles
        run = simulate(
            made.engine, made.body, made.settings, speed, wanted, self.gas, progress, made.parts, settle=self.settle
        )
        if not run.complete:
            raise KeyboardInterrupt
        return run

    def case(self, crank: str, bearings: str, integrator: str, step: float) -> Case:
        """Case of these levels, integrator and step, with the scene's cut-off of the crank's modes."""
        return Case(crank, bearings, self.own_cutoff, integrator, step)

    def refined(self, case: Case) -> Case:
        """The same case with half the step, for its numerical error."""
        return replace(case, step=0.5 * case.step)
