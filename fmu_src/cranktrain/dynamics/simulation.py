"""Simulation of a cranktrain: the object that the FMU drives, and a whole run at constant speed.

Both call the same :func:`~cranktrain.dynamics.time.communication.advance`; a test checks that they agree bitwise.
"""

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from cranktrain.core.errors import CranktrainError, InputError, SolverError
from cranktrain.core.reduced_body import Array, ReducedBody, rigid
from cranktrain.core.run_entries import RunEntries
from cranktrain.core.stepped_model import SteppedModel
from cranktrain.core.units import RPM
from cranktrain.dynamics import run_record
from cranktrain.dynamics.cycle_run import Result, balanced, damper_power, run_cycles
from cranktrain.dynamics.load_torque import LoadFollower, LoadTorque
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model import state as st
from cranktrain.dynamics.model.arrays import Parts, build_model, common_crank, supply_temperature
from cranktrain.dynamics.model.bodies import bends
from cranktrain.dynamics.model.choices import run_numbers
from cranktrain.dynamics.model.numbers import LEAST_STEP
from cranktrain.dynamics.model.records import ModelArrays, dimensions
from cranktrain.dynamics.model.settings import Settings, axial_force, resolved
from cranktrain.dynamics.model.state import state_size
from cranktrain.dynamics.model.workspace import Work, make_work
from cranktrain.dynamics.outputs.register import Outputs, families_of, observers, output_counts, output_needs
from cranktrain.dynamics.run_record import LONGEST_STEP, WANTED, Run
from cranktrain.dynamics.settled.judging import FREE_CYCLES, TOLERANCE
from cranktrain.dynamics.settled.samples import PowerSamples, Sink
from cranktrain.dynamics.start.mean_motion import rigid_start
from cranktrain.dynamics.time.communication import end_step_here
from cranktrain.dynamics.time.stage import FIRST_CONTRACTION
from cranktrain.dynamics.time.status import OK, REFUSALS, REMEDIES, SINGULAR, STALLED, STEP_RANGE
from cranktrain.dynamics.time.step_control import MAX_HALVINGS, ports_at_state
from cranktrain.dynamics.topology.own_law import own_failure
from cranktrain.dynamics.warm_films import check_level
from cranktrain.engine.levels import crank_level
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import SLOWEST_RPM
from cranktrain.engine.torsional_chain import DYNAMOMETER
from cranktrain.film.laws.parameters import CLEARANCE
from cranktrain.film.laws.register import bearing_law
from cranktrain.loads.damper import power_warning, required_damper, with_damper_housing
from cranktrain.loads.gas_pressure import Gas, GasTrace, gas_tables
from cranktrain.loads.torsional_line import torsional_line

__all__ = ["Parts", "Settings", "Simulation", "simulate"]

SLOWEST = SLOWEST_RPM * RPM
"""Lowest speed of a simulation over cycles, rad/s."""
BEHIND_PRESSURES = {
    "shaft.load_torque": "N m",
    "valvetrain.torque": "N m",
    "flywheel.axial_force": "N",
    "pressure.angle": "rad",
}
"""Inputs that follow the cylinder pressures and belong to no cylinder, with their units."""


def check_far_end(engine: Engine) -> None:
    """Refuse a drive line with a free far end, because nothing would set or load the engine's speed; ``InputError``."""
    line = engine.drive_line_chain
    if line is not None and DYNAMOMETER not in (*line.starts, *line.ends):
        raise InputError(
            f"drive line of engine '{engine.name}' ends freely; a run in time needs a shaft to '{DYNAMOMETER}', which "
            "holds its speed or carries its load; add a soft one, or take --method harmonic-balance"
        )


def input_units(engine: Engine) -> dict[str, str]:
    """Inputs of an engine's runs, in order, with their units."""
    pressures, deviations = (
        {f"cylinder[{i + 1}].{name}": unit for i in range(engine.n_cylinders)}
        for name, unit in (("pressure", "Pa"), ("deviation_taken", "m^3"))
    )
    return {"speed": "rad/s", **pressures, **BEHIND_PRESSURES, **deviations}


def input_names(engine: Engine) -> tuple[str, ...]:
    """Names of the inputs of an engine's runs, in order."""
    return tuple(input_units(engine))


class Simulation(SteppedModel):
    """A cranktrain that is stepped from outside: set ``inputs``, call ``step``, read ``outputs``.

    Parameters
    ----------
    engine : the engine
    body : its crankshaft with flywheel, pulley and all other fixed parts; once initialized, in the modes of the model,
       which it may have in common with bodies on rigid gears
    settings : levels, integrator, step and sources
    gas : pressure trace in place of the engine's built-in one
    parts : film tables, elastic bores and block that the levels of the settings need
    temperatures : (b,) of the main bearings' films, K. The default is the temperature of the engine's oil, or with
       ``film_temperature`` heat-balance or adiabatic the result of a run at the speed of the start

    Attributes
    ----------
    inputs : (5 + 2 cylinders,) speed (rad/s), absolute cylinder pressures (Pa), the load torque (N m) on the
        dynamometer, which acts at boundary ``torque`` only, the torque (N m) that the valve train takes from the
        crank's front end, the axial force (N) on the flywheel, positive away from the pulley, the crank angle (rad)
           that the pressures belong to, and the deviation (m³) of each cylinder's volume that its pressure belongs to,
           0 if not known; set in place before each step
    pressures : the pressures among them
    input_rates : (5 + 2 cylinders,) rates of the inputs, 1/s, over the next communication step: an input continues from
       its value at the given rate under every reconstruction; NaN, the initial value, gives no rate
    input_names, output_names : as in the FMU
    outputs : values in that order (SI), valid after ``initialize`` and after each step; if ``on_demand`` is set before,
       only those that :meth:`read` was called for
    counts : numbers of members of the output families
    load_law : load torque over angle and speed of the loaded end, which sets that input and its rate before each step;
       None leaves the input as set by the user
    power_samples : store for the powers of each step, or None
    """

    def __init__(
        self,
        engine: Engine,
        body: ReducedBody,
        settings: Settings | None = None,
        gas: Gas | None = None,
        parts: Parts | None = None,
        temperatures: Array | None = None,
    ) -> None:
        check_far_end(engine)
        self.engine = engine
        self.settings = resolved(settings or Settings(), engine)
        self.body = self._given_body = self._fitting(body)
        self.parts = parts or Parts()
        self._temperatures = temperatures
        self._gas: Gas = gas or GasTrace.from_engine(engine)
        if not LEAST_STEP <= self.settings.step < math.inf:
            raise InputError(f"{REFUSALS[STEP_RANGE]}, not {self.settings.step:g} rad")
        self.counts = output_counts(engine, self.parts.topology)
        self._needs = output_needs(self.counts)
        self.output_names = tuple(self._needs)
        self.outputs = np.zeros(len(self.output_names))
        self.input_names = input_names(engine)
        self._inputs = np.zeros(len(self.input_names))
        self.input_rates = np.full(self._inputs.size, np.nan)
        self.pressures = self.inputs[1 : 1 + engine.n_cylinders]
        self.pressures[:] = at.AMBIENT
        self.inputs[engine.n_cylinders + at.AXIAL_INPUT] = axial_force(self.settings, engine)
        self._load = engine.n_cylinders + at.LOAD_INPUT
        self.load_law: LoadFollower | None = None
        self._end_speed = torsional_line(engine).end_speed
        self.on_demand, self._watched = False, set[int]()
        self.power_samples: PowerSamples | None = None
        if self.inputs.size > st.MAX_INPUTS:
            most = (st.MAX_INPUTS - at.OTHER_INPUTS) // at.CYLINDER_INPUTS
            raise InputError(f"at most {most} cylinders, engine '{engine.name}' has {engine.n_cylinders}")

    def _fitting(self, body: ReducedBody) -> ReducedBody:
        """The body at the settings' crank level; ``InputError`` for a body that bends at a level without bending."""
        level = crank_level(self.settings.crank)
        if not level.elastic:
            return rigid(body)
        if not level.bends and bends(body):
            raise InputError(
                f"body '{body.name}' bends, which one of crank level '{level.name}' does not; take a body that "
                "cranktrain.assemble makes, or call it crank level solid"
            )
        return body

    def initialize(self, time: float = 0.0) -> None:
        """Start from the static equilibrium under the present inputs; loads the kernels. Raises ``InputError``."""
        self._check_inputs()
        if self.settings.film_temperature != "engine":
            self._temperatures = self._balanced_temperatures()
        self._oil_temperature = supply_temperature(self.engine, self.settings, float(self.inputs[0]))
        model = self._model()
        self.body = common_crank(self.engine, self._given_body, self.settings, self.parts)
        size = dimensions(model)
        state = np.zeros(state_size(size.modes, size.ports, size.films, size.passes))
        work, counts = make_work(model, state.size, input_rates=self.input_rates), self.counts
        observed = observers(counts, model, work, state, self.outputs)
        entries = self._entries_of(model, work, state, observed)
        status = entries.start(time)
        if status != OK:
            where = f"no static equilibrium at {self.inputs[0] / RPM:.0f} rev/min"
            raise SolverError(f"{where}: {own_failure(model.laws.entry[:, 1]) or '{}; {}'.format(*REMEDIES[status])}")
        self.model, self.work, self._state, self._entries = model, work, state, entries
        self._observed, self._families_of = observed, families_of(counts)
        self._observe()
        self._warm()
        if self.on_demand:
            self._observed.families[:, WANTED] = 0
            self._watched.clear()

    @property
    def gas(self) -> GasTrace:
        """Pressure trace at the present speed and load."""
        return self._gas.at(float(self.inputs[0]), self.settings.gas_load)

    def follow_gas(self) -> None:
        """Switch to the pressure trace of the present speed, in a run whose speed has changed."""
        self._end_step()
        self.model.gas[:] = gas_tables(self.gas)

    told = "took the work that is allowed and went on at less accuracy; solver.limited tells of others"

    @property
    def limited(self) -> bool:
        """True if the last communication step reached ``work_limit`` and was cut short."""
        return bool(self._current()[st.LIMITED] > 0.0)

    @property
    def load_torque(self) -> float:
        """Torque on the dynamometer among the inputs, N m."""
        return float(self.inputs[self._load])

    @load_torque.setter
    def load_torque(self, torque: float) -> None:
        self.inputs[self._load] = torque

    @property
    def shown_outputs(self) -> tuple[str, ...]:
        """Names of the outputs that the fidelity levels model; without bearings, outputs of bearings are left out."""
        if bearing_law(self.settings.bearings).carries:
            return self.output_names
        return tuple(name for name, need in self._needs.items() if "bearings" not in need or "block" in need)

    def _end_step(self) -> None:
        """End a step under way at the present time, before the model is replaced."""
        state = self._current()
        if state[st.UNDER_WAY] > 0.0:
            end_step_here(self.model, self.work, state)

    def _model(self) -> ModelArrays:
        return build_model(
            self.engine, self._given_body, replace(self.settings, oil_temperature=self._oil_temperature),
            float(self.inputs[0]), self.gas, self.parts, self._temperatures,
        )  # fmt: skip

    @property
    def film_temperatures(self) -> Array:
        """Temperatures (b,), K, of the films of b main bearings; assigning new temperatures keeps the present state.

        Known after ``initialize``.
        """
        self._current()
        if self._temperatures is not None:
            return np.array(self._temperatures, dtype=float)
        return np.full(len(self.engine.crankshaft.main_widths), self._oil_temperature)

    @film_temperatures.setter
    def film_temperatures(self, temperatures: Array) -> None:
        self._remake("_temperatures", temperatures)

    def _remake(self, name: str, value: Any) -> None:
        """Make the model with another value of an attribute, at the present state; ``InputError`` changes nothing."""
        state, before = self._current(), getattr(self, name)
        setattr(self, name, value)
        try:
            model = self._model()
        except InputError:
            setattr(self, name, before)
            raise
        self._end_step()
        self.model, self.work = model, make_work(model, state.size, input_rates=self.input_rates)
        self._observe()

    @property
    def damper_temperature(self) -> float:
        """Temperature of the damper, K; assigning a new temperature keeps the present state."""
        self._current()
        return float(self.model.scalars[at.DAMPER_TEMPERATURE])

    @damper_temperature.setter
    def damper_temperature(self, temperature: float) -> None:
        self._remake("settings", replace(self.settings, damper_temperature=temperature))

    def go_on_at(self, speed: float) -> None:
        """Make the present state the start of a run at another ``speed`` (rad/s), with its oil and damper temperatures.

        Motion and films stay as they are. Raises ``InputError`` for an invalid speed.
        """
        state = self._current()
        self._end_step()
        self.inputs[0] = speed
        self._check_inputs()
        self._oil_temperature = supply_temperature(self.engine, self.settings, speed)
        self.model = self._model()
        # Factors belong to the old speed, and input samples to the old run.
        self.work.key[:] = -1.0
        self.work.counters[:] = 0.0
        state[[st.TIME, st.SAMPLES, st.LAST_INTERVAL, st.SHAFT_ACCELERATION]] = 0.0
        state[st.SHAFT_SPEED] = state[st.OMEGA_REFERENCE] = speed
        state[st.STEP_REFERENCE] = state[st.STEP_LAST] = -1.0
        state[st.CONTRACTION] = FIRST_CONTRACTION

    def _balanced_temperatures(self) -> Array:
        """Temperatures (b,), K, of the main bearings' films, from a run at the present speed until outputs repeat."""
        if not self.inputs[0] >= SLOWEST * (1.0 - 1.0e-9):
            raise InputError(
                f"the heat balance of films needs a start at {SLOWEST_RPM:g} rev/min or more, got "
                f"{self.inputs[0] / RPM:g}; set the speed before the initialization, or take film temperature 'engine'"
            )
        settings = replace(self.settings, boundary="speed", gas_source="builtin")
        return simulate(
            self.engine, self._given_body, settings, float(self.inputs[0]), gas=self._gas, parts=self.parts
        ).film_temperatures

    def steady_torque(self) -> float:
        """Load torque (N m) that holds the speed of ``inputs`` under the built-in gas trace, without friction."""
        self._oil_temperature = supply_temperature(self.engine, self.settings, float(self.inputs[0]))
        return rigid_start(self._model(), float(self.inputs[0])).torque

    def _entries_of(self, model: ModelArrays, work: Work, state: Array, observed: Outputs) -> RunEntries:
        temperatures = np.zeros(len(self.engine.crankshaft.main_widths))
        if self._temperatures is not None:
            temperatures[:] = self._temperatures
        settings = replace(self.settings, oil_temperature=self._oil_temperature)
        numbers = run_numbers(settings, self.engine, self.parts.data)
        run = Run(model, work, state, self._inputs, observed, numbers, temperatures)
        return RunEntries("cranktrain", run, run_record)

    def _warm(self) -> None:
        """Run one step and undo it, so that the first real step includes no compilation."""
        if not self._entries.compiles:
            return
        state, outputs = self.state, self.outputs.copy()
        self._entries.advance(float(state[st.TIME]) + 1.0e-6)
        self._current()[:], self.outputs[:] = state, outputs
        self.work.counters[:] = 0.0
        self.work.key[:] = -1.0

    def _check_inputs(self) -> None:
        values = self.inputs.tolist()
        if math.isfinite(sum(values)) and min(values[: self._load]) >= 0.0:
            return
        for k, ((what, unit), value) in enumerate(zip(input_units(self.engine).items(), values, strict=True)):
            if math.isfinite(value) and (value >= 0.0 or k >= self._load):
                continue
            if k == 0:
                raise InputError(f"speed must be finite and not negative, got {value / RPM:g} rev/min")
            if k < self._load:
                raise InputError(f"{what} must be finite and not negative (absolute, Pa), got {value:g}")
            raise InputError(f"{what} must be finite ({unit}), got {value:g}")

    def _check_state(self, vector: Array) -> None:
        if vector[st.METHOD] not in (0.0, self._current()[st.METHOD]):
            raise InputError(
                f"this state is not one of integrator '{self.settings.integrator}'; restore it where the integrator is "
                "that of its run"
            )

    def _observe(self) -> None:
        self._entered().observe()
        if self.power_samples is not None:
            self.power_samples.begin(self.work.powers)

    def _entered(self) -> RunEntries:
        """Entries of the present model and workspace, made again if model or workspace was replaced."""
        run = self._entries.run
        if run.model is not self.model or run.work is not self.work:
            self._entries = self._entries_of(self.model, self.work, self._current(), self._observed)
        return self._entries

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
        if self.load_law is not None:
            self._follow_load(t_end)
        status = self._entered().advance(t_end)
        if status != OK:
            self._check_inputs()
            raise self._error(status, t_end, state)
        if self.power_samples is not None:
            self.power_samples.add(self.work.powers)

    def _follow_load(self, t_end: float) -> None:
        """Set the load torque and its rate for a step to ``t_end``."""
        assert self.load_law is not None
        torque, rate = self.load_law.over(self.model, self._current(), self._end_speed, t_end)
        self.inputs[self._load], self.input_rates[self._load] = torque, rate

    def read(self, places: Sequence[int]) -> list[float]:
        """Read outputs by position; with ``on_demand`` the families of these outputs are observed from now on."""
        if self.on_demand and not self._watched.issuperset(places):
            self._watched.update(places)
            for place in places:
                self._observed.families[list(self._families_of[place]), WANTED] = 1
            self._observe()
        return super().read(places)

    def series(self, step: float, first: int, rows: Array) -> int:
        """Take steps to ``(first + k) step`` (s) and keep their outputs in row k of ``rows``.

        Inputs stay as they are. Returns the number of steps taken; after an early stop, :meth:`step` raises the reason.
        """
        self._current()
        advance, outputs, samples = self._entered().advance, self.outputs, self.power_samples
        for k in range(len(rows)):
            if self.load_law is not None:
                self._follow_load((first + k) * step)
            if advance((first + k) * step) != OK:
                return k
            rows[k] = outputs
            if samples is not None:
                samples.add(self.work.powers)
        return len(rows)

    def _error(self, status: int, t_end: float, state: Array) -> CranktrainError:
        """Error to raise for the failure status of a step to ``t_end`` (s) that no input explains."""
        interval = t_end - state[st.TIME]
        if not interval > 0.0:
            return InputError(f"communication step must be positive, got {interval:g} s at t = {state[st.TIME]:g} s")
        if interval > LONGEST_STEP:
            return InputError(
                f"communication step of {interval:g} s at t = {state[st.TIME]:g} s is too long; "
                f"at most {LONGEST_STEP:g} s"
            )
        if status == STALLED:
            return SolverError(
                f"the load torque of {self.load_torque:g} N m stalls the engine at t = {t_end:g} s; it does not run "
                "backwards: lower the torque"
            )
        return SolverError(self._failure(status, state))

    def _failure(self, status: int, state: Array) -> str:
        cause, remedy = REMEDIES[status]
        own = own_failure(self.model.laws.entry[:, 1])
        ports_at_state(self.model, self.work, state)
        d = self.work.port[at.RELATIVE, : 2 * self.model.bearings.shape[0]]
        eps = np.hypot(d[::2], d[1::2]) / self.model.bearings[:, CLEARANCE]
        lost = ""
        if eps.size and status != SINGULAR:
            worst = int(eps.argmax())
            lost = f", film of main[{worst + 1}] lost (eccentricity {eps[worst]:.3f})"
        angle = math.degrees(state[st.SHAFT_ANGLE] % (4.0 * math.pi))
        return (
            f"step failed at t = {state[st.TIME]:.6g} s, crank angle {angle:.1f} deg, "
            f"{state[st.SHAFT_SPEED] / RPM:.0f} rev/min after {MAX_HALVINGS} halvings: "
            f"{own or f'{cause}{lost}; {remedy}'}"
        )


def fitted_engine(engine: Engine, settings: Settings) -> Engine:
    """Engine with the damper's housing fixed to the pulley, if the settings have the damper fitted."""
    return with_damper_housing(engine) if settings.damper == "fitted" else engine


def simulate(
    engine: Engine,
    body: ReducedBody,
    settings: Settings,
    speed: float,
    cycles: int | None = None,
    gas: Gas | None = None,
    progress: Callable[[float], None] | None = None,
    parts: Parts | None = None,
    damper_balance: bool = False,
    load_torque: float | LoadTorque | None = None,
    settle: float = TOLERANCE,
    say: Callable[[str], None] | None = None,
    sink: Sink | None = None,
) -> Result:
    """Run at constant ``speed`` (rad/s) until the outputs repeat, or ``cycles`` cycles, and keep every output.

    Without ``cycles`` the run ends when the settling error of every output family is at most ``settle``, or after
    ``MOST_CYCLES`` cycles (:mod:`cranktrain.dynamics.settled`), and keeps the last period. ``parts`` hold the input
    that the levels need. With ``film_temperature`` heat-balance or adiabatic the temperature of each main's film
    follows from its friction (:mod:`cranktrain.dynamics.warm_films`), with ``damper_balance`` that of the damper from
    its losses. The run is then repeated from where it ended until no temperature changes by more than ``SETTLED``, at
    most ``PASSES`` times, and the last run is the result. At boundary ``torque`` the dynamometer is loaded by
    ``load_torque`` (N m, or a law over its angle and speed), or by the torque that holds the speed; ``speed`` is then
    the speed at the start, and a cycle is the time of a cycle at this speed.
    ``progress`` is called with the fraction of the run done, in [0, 1], ``say`` with cycles and settling error. An
    interrupt ends the run early and keeps its samples. With a ``sink`` all samples go there, also those of a failing
    run; the result then holds the last cycles only, so that memory does not grow with their number.

    Raises
    ------
    InputError
        speed below 20 rev/min, no cycle, a heat balance of bearings without oil or of no damper, a load torque at
        boundary ``speed``
    SolverError
        a step that fails
    """
    if not (math.isfinite(speed) and speed >= SLOWEST * (1.0 - 1.0e-9)):
        raise InputError(
            f"cycles need at least {SLOWEST_RPM:g} rev/min, got {speed / RPM:g}; the FMU takes any speed from 0"
        )
    if cycles is not None and cycles < 1:
        raise InputError(f"at least one cycle must run, got {cycles}")
    if not 0.0 < settle < 1.0:
        raise InputError(f"the tolerance of the settling error must lie between 0 and 1, got {settle:g}; e.g. 1e-3")
    warmed = settings.film_temperature != "engine"
    if warmed:
        check_level(resolved(settings, engine).bearings)
    if load_torque is not None and settings.boundary != "torque":
        raise InputError(f"a load torque acts at boundary 'torque' only, not '{settings.boundary}'; change one of them")
    if damper_balance and settings.damper != "fitted":
        raise InputError(f"the heat balance of a damper needs damper 'fitted', not '{settings.damper}'")
    # The heat balance of the films is made here, after each run.
    simulation = Simulation(engine, body, replace(settings, film_temperature="engine"), gas, parts)
    simulation.inputs[0] = speed
    if simulation.settings.boundary == "torque":
        if isinstance(load_torque, LoadTorque):
            simulation.load_law = LoadFollower(load_torque)
            load_torque = load_torque.at(0.0, simulation._end_speed * speed)
        simulation.load_torque = simulation.steady_torque() if load_torque is None else load_torque
        cycles = FREE_CYCLES if cycles is None else cycles
    simulation.initialize()

    def run() -> Result:
        return run_cycles(simulation, cycles, settle, progress, say, sink)

    result = run()
    if warmed or damper_balance:
        result = balanced(simulation, cycles, run, result, settings.film_temperature, damper_balance)
    if simulation.settings.damper == "fitted":
        line = power_warning(required_damper(engine), damper_power(result))
        if line is not None:
            warnings.warn(line, stacklevel=2)
    return result
