"""Running a cranktrain: the object that the FMU drives, and a whole simulation at constant speed.

Both call the same :func:`~cranktrain.dynamics.step_control.advance`; that they agree to the last bit is a test.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cranktrain.dynamics.integrators import integrator_table
from cranktrain.dynamics.mean_motion import rigid_start
from cranktrain.dynamics.model import (
    AMBIENT,
    ModelArrays,
    Settings,
    build_model,
    dimensions,
    make_work,
    resolved,
    supply_temperature,
)
from cranktrain.dynamics.outputs import advance_and_observe, observe, output_names
from cranktrain.dynamics.stage import OK
from cranktrain.dynamics.state import (
    MAX_INPUTS,
    SHAFT_ANGLE,
    SHAFT_SPEED,
    TIME,
    offset,
    state_size,
)
from cranktrain.dynamics.step_control import GIVEN, MAX_HALVINGS, settle
from cranktrain.dynamics.warm_films import (
    PASSES,
    SETTLED,
    balanced_temperatures,
    check_level,
    cycle_means,
    warn_of_bounds,
    warn_unsettled,
)
from cranktrain.engine import Engine
from cranktrain.errors import InputError, SolverError
from cranktrain.film.bore_compliance import BoreCompliance
from cranktrain.film.database import FilmTable
from cranktrain.film.parameters import CLEARANCE
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.reduced_body import Array, ReducedBody, rigid

__all__ = ["Result", "Settings", "Simulation", "simulate"]

LONGEST_STEP = 1.0
"""Longest communication step, s: beyond it inputs held or extrapolated have no meaning."""
SLOWEST = 100.0 * math.pi / 30.0
"""Lowest speed of a simulation over cycles, rad/s."""
_RPM = 30.0 / math.pi


class Simulation:
    """A cranktrain that is stepped from outside: set ``inputs``, call ``step``, read ``outputs``.

    Parameters
    ----------
    engine : the engine
    body : its crankshaft with flywheel and pulley attached
    settings : levels, integrator, step and sources
    gas : pressure trace in place of the engine's built-in one
    table : films of the main bearings, for level ``table``
    bore : elastic main bores, for level ``ehd``
    big_end_table : films of the big ends, for their level ``table``; may lack tilt
    temperatures : (b,) of the main bearings' films, K; without them all are as warm as the engine's oil

    Attributes
    ----------
    inputs : (1 + cylinders,) speed (rad/s), then absolute cylinder pressures (Pa); set in place before each step
    output_names : names of the outputs
    outputs : values in that order (SI), valid after ``initialize`` and after each step
    """

    def __init__(
        self,
        engine: Engine,
        body: ReducedBody,
        settings: Settings | None = None,
        gas: GasTrace | None = None,
        table: FilmTable | None = None,
        bore: BoreCompliance | None = None,
        temperatures: Array | None = None,
        big_end_table: FilmTable | None = None,
    ) -> None:
        self.engine = engine
        self.settings = resolved(settings or Settings())
        self.body = rigid(body) if self.settings.crank == "rigid" else body
        self.table = integrator_table(self.settings.integrator)
        self.film_table = table
        self.bore = bore
        self.big_end_table = big_end_table
        self._temperatures = temperatures
        self.gas = gas or GasTrace.from_engine(engine)
        if not (math.isfinite(self.settings.step) and self.settings.step > 0.0):
            raise InputError(f"internal step must be a positive angle, got {math.degrees(self.settings.step):g} deg")
        self.output_names = output_names(len(engine.crankshaft.main_widths), engine.n_cylinders)
        self.outputs = np.zeros(len(self.output_names))
        self.inputs = np.full(1 + engine.n_cylinders, AMBIENT)
        self.inputs[0] = 0.0
        if self.inputs.size > MAX_INPUTS:
            raise InputError(f"at most {MAX_INPUTS - 1} cylinders, engine '{engine.name}' has {engine.n_cylinders}")
        self._state: Array | None = None

    def initialize(self, time: float = 0.0) -> None:
        """Start from the static equilibrium under the present inputs; loads the kernels. Raises ``InputError``."""
        self._check_inputs()
        self._oil_temperature = supply_temperature(self.engine, self.settings, float(self.inputs[0]))
        model = self._model()
        size = dimensions(model)
        state = np.zeros(state_size(size.modes, size.ports, size.films))
        work = make_work(model, state.size)
        state[TIME] = time
        if settle(model, work, state, self.inputs, *self._start(model)) != OK:
            raise SolverError(
                f"no static equilibrium at {self.inputs[0] * _RPM:.0f} rev/min: a film cannot carry the load at the "
                "start; lower the pressures or check clearance and viscosity"
            )
        work.counters[:] = 0.0
        self.model, self.work, self._state = model, work, state
        observe(model, work, state, self.outputs)
        self._warm()

    def _model(self) -> ModelArrays:
        return build_model(
            self.engine, self.body, replace(self.settings, oil_temperature=self._oil_temperature),
            float(self.inputs[0]), self.gas, self.table, self.film_table, self.bore, self._temperatures,
            self.big_end_table,
        )  # fmt: skip

    @property
    def film_temperatures(self) -> Array:
        """Temperatures of the main bearings' films, (b,) K; assigning others goes on from the present state.

        Known after ``initialize``.
        """
        self._current()
        if self._temperatures is not None:
            return np.array(self._temperatures, dtype=float)
        return np.full(len(self.engine.crankshaft.main_widths), self._oil_temperature)

    @film_temperatures.setter
    def film_temperatures(self, temperatures: Array) -> None:
        state = self._current()
        before, self._temperatures = self._temperatures, temperatures
        try:
            self.model = self._model()
        except InputError:
            self._temperatures = before
            raise
        self.work = make_work(self.model, state.size)
        observe(self.model, self.work, state, self.outputs)

    def _start(self, model: ModelArrays) -> tuple[float, float, float]:
        """Start in rotation: with pressures from outside nothing is known of the cycle to come."""
        given = np.abs(self.inputs[1:] - AMBIENT).max() > GIVEN
        if self.settings.gas_source == "input" or (self.settings.gas_source == "auto" and given):
            return 0.0, 0.0, 0.0
        return rigid_start(model, float(self.inputs[0]))

    def _warm(self) -> None:
        """Run one step on a copy, so that compiling never falls into the first real step."""
        state = self.state
        outputs = np.zeros_like(self.outputs)
        advance_and_observe(self.model, self.work, state, self.inputs, state[TIME] + 1.0e-6, outputs)
        self.work.counters[:] = 0.0
        self.work.key[:] = -1.0

    def _check_inputs(self) -> None:
        speed = self.inputs[0]
        if not math.isfinite(speed) or speed < 0.0:
            raise InputError(f"speed must be finite and not negative, got {speed * _RPM:g} rev/min")
        for k, p in enumerate(self.inputs[1:]):
            if not math.isfinite(p) or p < 0.0:
                raise InputError(
                    f"cylinder[{k + 1}].pressure must be finite and not negative (absolute, Pa), got {p:g}"
                )

    @property
    def time(self) -> float:
        """Time of the state, s."""
        return float(self._current()[TIME])

    @property
    def state(self) -> Array:
        """The whole state as a copy, (n,); assigning a vector of the same length restores it."""
        return self._current().copy()

    @state.setter
    def state(self, vector: Array) -> None:
        state = self._current()
        if np.shape(vector) != state.shape:
            raise InputError(f"a state of this model has {state.size} values, got {np.size(vector)}")
        state[:] = vector
        observe(self.model, self.work, state, self.outputs)

    def _current(self) -> Array:
        if self._state is None:
            raise InputError("the model is not initialised yet; call initialize() first")
        return self._state

    def step(self, t_end: float) -> None:
        """Advance to ``t_end`` (s). On an error the state stays at the last good time.

        Raises
        ------
        InputError
            inputs that are not numbers or negative, a step that is zero, negative or absurdly long
        SolverError
            a step that fails after the last halving
        """
        state = self._current()
        self._check_inputs()
        interval = t_end - state[TIME]
        if not interval > 0.0:
            raise InputError(f"communication step must be positive, got {interval:g} s at t = {state[TIME]:g} s")
        if interval > LONGEST_STEP:
            raise InputError(
                f"communication step of {interval:g} s at t = {state[TIME]:g} s is too long; at most {LONGEST_STEP:g} s"
            )
        if advance_and_observe(self.model, self.work, state, self.inputs, t_end, self.outputs) != OK:
            raise SolverError(self._failure(state))

    def _failure(self, state: Array) -> str:
        n = self.model.omega2.size
        u = self.model.ports[: 2 * self.model.bearings.shape[0]] @ state[offset(0, n) : offset(1, n)]
        eps = np.hypot(u[::2], u[1::2]) / self.model.bearings[:, CLEARANCE]
        worst = int(eps.argmax())
        angle = math.degrees(state[SHAFT_ANGLE] % (4.0 * math.pi))
        return (
            f"step failed at t = {state[TIME]:.6g} s, crank angle {angle:.1f} deg, {state[SHAFT_SPEED] * _RPM:.0f} "
            f"rev/min after {MAX_HALVINGS} halvings: film of main[{worst + 1}] lost (eccentricity {eps[worst]:.3f}); "
            "use a smaller solver.step, or check pressures, clearance and oil temperature"
        )


@dataclass(frozen=True)
class Result:
    """Time series of one run, SI.

    ``time`` and ``angle`` (frame, rad) are (n,), ``outputs`` maps each output's name to (n,); ``counters`` holds steps,
    newton_iterations and rejected_steps; ``seconds`` is wall time without compilation and start. Samples are uniform in
    time, ``per_cycle`` of them to 720°. ``film_temperatures`` (b,), K, are those of the main bearings' films and
    ``passes`` the runs that it took to find them; all else tells of the last of these.
    """

    time: Array
    angle: Array
    outputs: dict[str, Array]
    counters: dict[str, int]
    seconds: float
    real_time_factor: float
    per_cycle: int
    film_temperatures: Array
    passes: int = 1

    def last_cycle(self, name: str) -> tuple[Array, Array]:
        """Crank angle (rad, from 0) and values of one output over the last 720°, both ends included."""
        first = max(0, self.time.size - 1 - self.per_cycle)
        return self.angle[first:] - self.angle[first], self.outputs[name][first:]


def communication_step(speed: float, step: float) -> float:
    """Communication step (s) of a simulation: the largest that divides a cycle and is at most ``step`` (rad)."""
    return 4.0 * math.pi / speed / math.ceil(4.0 * math.pi / step - 1.0e-9)


def simulate(
    engine: Engine,
    body: ReducedBody,
    settings: Settings,
    speed: float,
    cycles: int,
    gas: GasTrace | None = None,
    progress: Callable[[float], None] | None = None,
    table: FilmTable | None = None,
    bore: BoreCompliance | None = None,
    heat_balance: bool = False,
    big_end_table: FilmTable | None = None,
) -> Result:
    """Run ``cycles`` cycles at constant ``speed`` (rad/s) and keep every output at every step.

    ``table`` serves level ``table``, ``bore`` level ``ehd``, ``big_end_table`` big ends at level ``table``. With
    ``heat_balance`` each main's film is as warm as its friction makes it (:mod:`cranktrain.dynamics.warm_films`): the
    run repeats, going on where it ended, until no temperature changes by more than ``SETTLED``, at most ``PASSES``
    times; the last run is the result.
    ``progress`` is called with the share of a run done, in [0, 1]. An interrupt ends the run early and keeps what it
    has.

    Raises
    ------
    InputError
        speed below 100 rev/min, no cycle, a heat balance of bearings without oil
    SolverError
        a step that fails
    """
    if not (math.isfinite(speed) and speed >= SLOWEST * (1.0 - 1.0e-9)):
        raise InputError(f"cycles need at least 100 rev/min, got {speed * _RPM:g}; the FMU takes any speed from 0")
    if cycles < 1:
        raise InputError(f"at least one cycle must run, got {cycles}")
    if heat_balance:
        check_level(settings.bearings)
    simulation = Simulation(engine, body, replace(settings), gas, table, bore, big_end_table=big_end_table)
    simulation.inputs[0] = speed
    simulation.initialize()
    result = _run(simulation, cycles, progress)
    if not heat_balance:
        return result
    inlet, change = supply_temperature(engine, settings, speed), math.inf
    for passes in range(1, PASSES + 1):
        temperatures = simulation.film_temperatures
        means = cycle_means(result.outputs, temperatures.size, result.per_cycle)
        warmer, bounds = balanced_temperatures(engine, inlet, temperatures, *means)
        change = float(np.abs(warmer - temperatures).max())
        result = replace(result, passes=passes)
        if change < SETTLED or passes == PASSES or result.time.size <= cycles * result.per_cycle:
            break
        _rewind(simulation, cycles)
        simulation.film_temperatures = warmer
        result = _run(simulation, cycles, progress)
    warn_of_bounds(bounds)
    if change >= SETTLED:
        warn_unsettled(change, passes)
    return result


def _rewind(simulation: Simulation, cycles: int) -> None:
    """Call the present state the start: time from 0, the crank's angle less the cycles that it has turned."""
    state = simulation.state
    state[TIME] = 0.0
    state[SHAFT_ANGLE] -= 4.0 * math.pi * cycles
    simulation.state = state


def _run(simulation: Simulation, cycles: int, progress: Callable[[float], None] | None) -> Result:
    """Cycles at constant speed from the simulation's state, whose time is 0."""
    speed = float(simulation.inputs[0])
    h = communication_step(speed, simulation.settings.step)
    per_cycle = round(4.0 * math.pi / speed / h)
    count = per_cycle * cycles
    series = np.empty((count + 1, simulation.outputs.size))
    times: Array = np.arange(count + 1, dtype=np.float64) * h
    series[0] = simulation.outputs
    done, wall = 0, 0.0
    try:
        for cycle in range(cycles):
            start = time.perf_counter()
            for k in range(cycle * per_cycle + 1, (cycle + 1) * per_cycle + 1):
                simulation.step(times[k])
                series[k] = simulation.outputs
                done = k
            wall += time.perf_counter() - start
            if progress is not None:
                progress((cycle + 1) / cycles)
    except KeyboardInterrupt:
        if done < per_cycle:
            raise
    series, times = series[: done + 1], times[: done + 1]
    counters = simulation.work.counters
    return Result(
        time=times,
        angle=series[:, 0].copy(),
        outputs={name: series[:, i].copy() for i, name in enumerate(simulation.output_names)},
        counters={
            "steps": int(counters[0]),
            "newton_iterations": int(counters[2]),
            "rejected_steps": int(counters[3]),
        },
        seconds=wall,
        real_time_factor=wall / float(times[-1]),
        per_cycle=per_cycle,
        film_temperatures=simulation.film_temperatures,
    )
