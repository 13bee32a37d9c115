"""Steady cycles at successive speeds.

Along the speed the periodic motion x(Ω) changes little: a speed starts from the line through its two neighbours,

    x(Ω) ≈ x₁ + (Ω − Ω₁) (x₁ − x₂)/(Ω₁ − Ω₂),

and cycles settle it from there (:mod:`cranktrain.dynamics.settled`). Films with a memory keep that of the nearest. A
speed without a neighbour within ``REACH`` starts from the static equilibrium.

A cycle begins at the shaft angle at which a start from the static equilibrium has it, so that steps and samples of a
speed lie at the same angles whichever speeds were finished before it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import SolverError
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.cycle_run import Result, balanced, run_cycles
from cranktrain.dynamics.model.records import dimensions
from cranktrain.dynamics.model.state import BODY, LEAD_ANGLE, LEAD_SPEED, SHAFT_ANGLE, film_offset
from cranktrain.dynamics.settled.collar import Learned
from cranktrain.dynamics.settled.cycles import Expected
from cranktrain.dynamics.settled.motion import Motion, motion_of, put_motion
from cranktrain.dynamics.simulation import Simulation
from cranktrain.dynamics.start.mean_motion import rigid_start
from cranktrain.loads.damper import STIFFNESS
from cranktrain.loads.gas_pressure import Gas
from cranktrain.loads.mean_load import balancing_load
from cranktrain.results.orders.harmonics import ComplexArray, order_amplitudes
from cranktrain.results.strength.recorded_cycle import whole
from cranktrain.structure.assembly import Assembly
from cranktrain.studies.run_up.free_decay import torsional_mode

FIRST = 200.0
"""Speed at which a model is initialised, rad/s, before it goes to the requested speeds."""
REACH = 0.05
"""Largest relative distance in speed of a neighbour whose motion serves as start in place of the static equilibrium."""
TWIST = "damper.twist"
"""Output ``damper.twist``, whose mean is undefined if the damper's ring is free to creep."""


@dataclass(frozen=True)
class Job:
    """Request common to all speeds of a run-up.

    Attributes
    ----------
    made : assembly of engine, body, settings and parts
    gas : pressure trace, or traces over speed; None for the engine's
    settle : largest settling error
    highest_order : highest order of the amplitudes
    outputs : outputs whose orders are wanted
    film_temperature : source of the films' temperatures, one of ``FILM_TEMPERATURES``
    damper_balance : true if the damper's temperature follows from its losses
    balanced : true if the burn balances the engine's ``[load]`` at each speed
    """

    made: Assembly
    gas: Gas | None
    settle: float
    highest_order: float
    outputs: tuple[str, ...]
    film_temperature: str = "engine"
    damper_balance: bool = False
    balanced: bool = False


class CycleStart(NamedTuple):
    """State of a steady motion at the start of a cycle."""

    speed: float  # rad/s
    motion: Motion
    shaft_angle: float  # rad
    films: Array  # film states that a later step needs (memory of the films)
    temperatures: Array | None  # film temperatures, K; None if the engine file gives them
    periodic: bool  # true if the next cycle equals this one
    learned: Learned | None = None  # mode that settles last


class SteadySpeed(NamedTuple):
    """Results of one speed in a run-up."""

    speed: float  # rad/s
    amplitudes: dict[str, ComplexArray]  # output → complex amplitudes (o,) of orders, SI
    extremes: dict[str, Array]  # output → least, mean and largest value over the cycle (3,), SI
    cycles: int
    repeats: int
    left: float
    parting: float
    start: CycleStart


class SteadyRuns:
    """One model that is run at successive speeds.

    Attributes
    ----------
    simulation : simulation at the start of a cycle of the last speed
    """

    def __init__(self, job: Job) -> None:
        self._job = job
        made = job.made
        settings = replace(made.settings, film_temperature="engine")  # heat is balanced here, cycle by cycle
        self.simulation = Simulation(made.engine, made.body, settings, job.gas, made.parts)
        self.simulation.inputs[0] = FIRST
        self.simulation.initialize()  # loads the kernels

    def at(self, speed: float, near: Sequence[CycleStart] = ()) -> SteadySpeed:
        """Steady motion at a speed (rad/s), started from motions at neighbouring speeds ``near``, the nearest first.

        Raises ``InputError``; ``SolverError`` for a step that fails.
        """
        result = self.settled(speed, near)
        job, simulation = self._job, self.simulation
        state = simulation.state
        n = simulation.model.omega2.size
        learned = result.learned
        if learned is None and result.settling.repeats == 1:  # the mode that settles last, measured with an impulse
            mode = torsional_mode(simulation)
            learned = None if mode is None else Learned(mode)
        start = CycleStart(
            speed=speed,
            motion=motion_of(state, n),
            shaft_angle=float(state[SHAFT_ANGLE]),
            films=state[self._films_begin :].copy(),
            temperatures=simulation.film_temperatures if job.film_temperature != "engine" else None,
            periodic=result.settling.repeats == 1,
            learned=learned,
        )
        settling = result.settling
        return SteadySpeed(
            speed, _amplitudes(job, result, speed), self._extremes(result), settling.cycles, settling.repeats,
            settling.worst[1], settling.parting, start,
        )  # fmt: skip

    def settled(self, speed: float, near: Sequence[CycleStart]) -> Result:
        """Settled cycle or cycles at a speed (rad/s), started from motions at neighbouring speeds ``near``.

        If a start from neighbours leads to no period, or to a step that fails, the speed starts once more by itself.
        """
        begun = useful(near, speed)
        try:
            result = self._settled(speed, begun)
        except SolverError:
            if not begun:
                raise
            return self._settled(speed, ())
        return result if result.settling.repeats or not begun else self._settled(speed, ())

    def _settled(self, speed: float, near: Sequence[CycleStart]) -> Result:
        expected = self.enter(speed, near)
        job, simulation = self._job, self.simulation

        def run() -> Result:
            return run_cycles(simulation, None, job.settle, None, None, expected=expected)

        result = run()
        if job.film_temperature != "engine" or job.damper_balance:
            result = balanced(simulation, None, run, result, job.film_temperature, job.damper_balance)
        return whole(result)

    def _extremes(self, result: Result) -> dict[str, Array]:
        """Least, mean and largest value of every output.

        Nothing restores the ring of a viscous damper, so the mean of its twist depends only on earlier motion. The
        extremes of the twist are therefore taken about its mean.
        """
        values = np.array(list(result.outputs.values()))
        found = np.stack((values.min(axis=1), values[:, 1:].mean(axis=1), values.max(axis=1)), axis=1)
        extremes: dict[str, Array] = dict(zip(result.outputs, found, strict=True))
        if self.simulation.settings.damper != "none" and self.simulation.model.damper[STIFFNESS] == 0.0:
            extremes[TWIST] = extremes[TWIST] - extremes[TWIST][1]
        return extremes

    @property
    def _films_begin(self) -> int:
        """Index in a state at which the memory of the films begins."""
        size = dimensions(self.simulation.model)
        return int(film_offset(size.modes, size.ports))

    def enter(self, speed: float, near: Sequence[CycleStart]) -> Expected:
        """Bring the simulation to the start of a cycle at a speed; returns the expected motion."""
        simulation = self.simulation
        if self._job.balanced:
            load = balancing_load(simulation.engine, self._job.gas or simulation.gas, speed)
            simulation.settings = replace(simulation.settings, gas_load=load)
        known = useful(near, speed)
        if not known:
            simulation.inputs[0] = speed
            simulation.initialize()
            return Expected()
        simulation.go_on_at(speed)
        state = simulation.state
        first = known[0]
        motion = first.motion
        if len(known) > 1 and first.periodic and known[1].periodic:
            second = known[1]
            share = (speed - first.speed) / (first.speed - second.speed)
            motion = motion.plus(first.motion.minus(second.motion), share)
        state[BODY : self._films_begin] = state[LEAD_ANGLE] = state[LEAD_SPEED] = 0.0
        put_motion(state, motion)
        state[SHAFT_ANGLE] = -rigid_start(simulation.model, speed).windup
        state[self._films_begin :] = first.films
        simulation.state = state
        if first.temperatures is not None:
            simulation.film_temperatures = first.temperatures
        return Expected(not first.periodic, first.learned, tries=True)


def useful(near: Sequence[CycleStart], speed: float) -> list[CycleStart]:
    """Motions of neighbouring speeds that are close enough to serve as start, nearest first."""
    return [start for start in near if abs(start.speed - speed) <= REACH * speed]


def _amplitudes(job: Job, result: Result, speed: float) -> dict[str, ComplexArray]:
    """Orders of the wanted outputs, with phases relative to the crank's mean rotation, not to the shaft's."""
    cycles = (result.time.size - 1) // result.per_cycle
    ahead = float(np.mean((result.outputs["crank.angle"] - speed * result.time)[1:]))
    found = {}
    for name in job.outputs:
        # Orders are of samples from one step after the cycle's start on, without the initial sample.
        orders, amplitudes = order_amplitudes(result.outputs[name][1:], job.highest_order, cycles)
        found[name] = amplitudes * np.exp(-1j * orders * (ahead + speed * result.time[1]))
    return found
