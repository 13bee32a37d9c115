"""Run of a simulation over cycles at constant speed: samples, settling and heat balance."""

import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Protocol

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.arrays import supply_temperature
from cranktrain.dynamics.model.records import dimensions
from cranktrain.dynamics.model.settings import ROW, ruling_law, usual_step
from cranktrain.dynamics.model.workspace import Work
from cranktrain.dynamics.outputs.register import Counts, judged_families, output_needs
from cranktrain.dynamics.settled.collar import Learned
from cranktrain.dynamics.settled.cycles import (
    NOTHING,
    Expected,
    Recorder,
    Stepped,
    plain_cycles,
    rewind,
    settled_cycles,
)
from cranktrain.dynamics.settled.judging import MOST_CYCLES, Judge, Settling
from cranktrain.dynamics.settled.samples import PowerSamples, Samples, Sink
from cranktrain.dynamics.warm_films import PASSES, SETTLED, balanced_temperatures, cycle_means
from cranktrain.engine.model import Engine
from cranktrain.film.laws.pressure_peak import pressure_peaks
from cranktrain.film.laws.register import Law
from cranktrain.loads.damper import balanced_temperature as damper_balance_temperature
from cranktrain.loads.damper import required_damper


class Run(Stepped, Protocol):
    """Interface of an initialised simulation that is run over cycles."""

    engine: Engine
    counts: Counts
    work: Work
    output_names: tuple[str, ...]
    film_temperatures: Array
    damper_temperature: float
    power_samples: PowerSamples | None

    @property
    def shown_outputs(self) -> tuple[str, ...]:
        """Names of the outputs that the levels model."""


@dataclass(frozen=True)
class Result:
    """Time series of one run, SI.

    ``time`` and ``angle`` (rad; of the shaft whose speed is given, else of the crank) are (n,), ``outputs`` maps each
    output's name to (n,); ``counters`` holds steps, newton_iterations, rejected_steps, missed_steps (of adaptive
    control) and limited_steps (communication steps that ``work_limit`` cut short); ``seconds`` is wall time without
    compilation and start. Samples are uniform in time, ``per_cycle`` of them in 720°. ``settling`` says how settled
    they are. A run until its outputs repeat keeps the last period only, while ``counters`` and ``seconds`` belong to
    the whole run. ``film_temperatures`` (b,), K, are those of the main bearings' films and ``passes`` is the number of
    runs to find them; everything else belongs to the last run. ``complete`` is False if an interrupt cut the run short;
    ``learned`` are the learned data of settling, if expected. ``step`` is the time between two samples, s. ``powers``
    (per_cycle + 1, POWERS), W, are those of the last cycle, see ``dynamics.model.slots``; None if the speed is free or
    no cycle was completed. ``film_peaks`` (b, PEAKS) are the largest pressures of elastic films in the last cycle, see
    :mod:`cranktrain.film.laws.pressure_peak`; None if films are not elastic.
    """

    time: Array
    angle: Array
    outputs: dict[str, Array]
    counters: dict[str, int]
    seconds: float
    real_time_factor: float
    per_cycle: int
    film_temperatures: Array
    settling: Settling
    passes: int = 1
    complete: bool = True
    learned: Learned | None = None
    powers: Array | None = None
    step: float = math.nan
    film_peaks: Array | None = None

    def last_cycle(self, name: str) -> tuple[Array, Array]:
        """Crank angle (rad, from 0) and values of one output over the last 720°, both ends included."""
        first = max(0, self.time.size - 1 - self.per_cycle)
        return self.angle[first:] - self.angle[first], self.outputs[name][first:]


def communication_step(speed: float, step: float) -> float:
    """Communication step (s) of a simulation: the largest that divides a cycle and is at most ``step`` (rad)."""
    step = step or math.radians(Law.step_deg)  # 0 if the level's default is not filled in yet
    return 4.0 * math.pi / speed / math.ceil(4.0 * math.pi / step - 1.0e-9)


def row_step(simulation: Run) -> float:
    """Time (s) between recorded rows of a run over cycles: a step, or the largest part of a step that ``ROW`` allows.

    A step is divided only if it is the default of the levels and the simulation passes over communication points.
    """
    speed, settings = float(simulation.inputs[0]), simulation.settings
    step = communication_step(speed, settings.step)
    usual = usual_step(ruling_law(settings.bearings, settings.big_ends, simulation.engine), simulation.engine)
    chosen = abs(settings.step - usual) > 1.0e-9 * usual
    if chosen or settings.dense_output == "off" or not dimensions(simulation.model).passes:
        return step
    return step / math.ceil(settings.step / ROW - 1.0e-9)


def run_cycles(
    simulation: Run,
    cycles: int | None,
    settle: float,
    progress: Callable[[float], None] | None,
    say: Callable[[str], None] | None,
    sink: Sink | None = None,
    expected: Expected = NOTHING,
) -> Result:
    """Run cycles at constant speed from the present state of a simulation at time 0."""
    speed = float(simulation.inputs[0])
    h = row_step(simulation)
    recorder = Recorder(simulation, h, round(4.0 * math.pi / speed / h))
    driven = simulation.settings.boundary != "torque"
    simulation.power_samples = powers = PowerSamples(recorder.per_cycle)
    powers.begin(simulation.work.powers)
    shown = simulation.shown_outputs
    columns = {name: i for i, name in enumerate(simulation.output_names) if name in shown}
    judge = output_judge(simulation.counts, columns)
    samples = Samples(columns, h, speed if driven else None, sink)
    if cycles is not None:
        samples.begin(cycles * recorder.per_cycle + 1)
        recorded = plain_cycles(recorder, judge, cycles, settle, progress, samples if sink else None)
    else:
        try:
            recorded = settled_cycles(recorder, judge, settle, MOST_CYCLES, progress, say, expected)
        except BaseException:
            samples.keep_all(recorder.under_way)
            raise
        samples.keep_all(recorded.rows)
    rows = recorded.rows
    times, angle = samples.axes(rows, recorded.first)
    counters = simulation.work.counters
    if counters[at.N_MISSED] > 0.0:
        warnings.warn(
            f"{counters[at.N_MISSED]:.0f} of {counters[at.N_STEPS]:.0f} steps missed the tolerance of "
            f"{simulation.settings.tolerance:g} at the shortest step; use a shorter solver.step, or a larger tolerance",
            stacklevel=2,
        )
    limited = counters[at.N_LIMITED]
    if limited > 0.0:
        warnings.warn(
            f"{limited:.0f} communication steps took the {simulation.settings.work_limit:g} iterations of "
            "solver.work_limit and went on at less accuracy; allow more",
            stacklevel=2,
        )
    return Result(
        time=times,
        angle=angle,
        outputs={name: rows[:, i].copy() for name, i in columns.items()},
        counters={
            "steps": int(counters[at.N_STEPS]),
            "newton_iterations": int(counters[at.N_ITERATIONS]),
            "rejected_steps": int(counters[at.N_REJECTED]),
            "missed_steps": int(counters[at.N_MISSED]),
            "limited_steps": int(counters[at.N_LIMITED]),
        },
        seconds=recorder.seconds,
        real_time_factor=recorder.seconds / (recorder.taken * h),
        per_cycle=recorder.per_cycle,
        film_temperatures=simulation.film_temperatures,
        settling=recorded.settling,
        complete=recorded.complete,
        learned=recorded.learned,
        powers=powers.cycle if driven and recorded.complete else None,
        step=h,
        film_peaks=pressure_peaks(simulation.model.films.entry),
    )


def damper_power(result: Result) -> float:
    """Mean power that the damper dissipates over the last cycle, W."""
    return float(result.outputs["damper.heat"][-result.per_cycle :].mean())


def balanced(
    simulation: Run,
    cycles: int | None,
    run: Callable[[], Result],
    result: Result,
    films: str,
    damper: bool,
) -> Result:
    """Repeat a run until its temperatures balance its dissipated power; ``films`` is one of ``FILM_TEMPERATURES``."""
    engine = simulation.engine
    inlet = supply_temperature(engine, simulation.settings, float(simulation.inputs[0]))
    bounds: tuple[str, ...] = ()
    for passes in range(1, PASSES + 1):
        changes, warmer, warmth = [], simulation.film_temperatures, 0.0
        if films != "engine":
            before = warmer
            means = cycle_means(result.outputs, before.size, result.per_cycle)
            warmer, bounds = balanced_temperatures(engine, inlet, before, *means, films == "adiabatic")
            changes.append(float(np.abs(warmer - before).max()))
        if damper:
            warmth = damper_balance_temperature(required_damper(engine), damper_power(result))
            changes.append(abs(warmth - simulation.damper_temperature))
        result = replace(result, passes=passes)
        if max(changes) < SETTLED or passes == PASSES or not result.complete:
            break
        if cycles is not None:
            rewind(simulation, cycles)
        if films != "engine":
            simulation.film_temperatures = warmer
        if damper:
            simulation.damper_temperature = warmth
        result = run()
    held = [i for i, bound in enumerate(bounds) if bound]
    if held:
        names = ", ".join(f"main[{i + 1}]" for i in held)
        warnings.warn(f"heat balance bounded at {names}; main[{held[0] + 1}]: {bounds[held[0]]}", stacklevel=2)
    if max(changes) >= SETTLED:
        warnings.warn(
            f"heat balance not settled by pass {passes}: temperatures would still change by {max(changes):.2g} K; "
            "run more cycles",
            stacklevel=2,
        )
    return result


def output_judge(counts: Counts, columns: Mapping[str, int]) -> Judge:
    """Judge of whether outputs have settled, for recorded rows with the given columns."""
    judged, of_block = _judged(counts)
    return Judge({name: [columns[n] for n in names if n in columns] for name, names in judged.items()}, of_block)


@cache
def _judged(counts: Counts) -> tuple[dict[str, list[str]], frozenset[str]]:
    """Outputs by which settling is judged, by output family, and the families that show motion of the block."""
    judged, needs = judged_families(counts), output_needs(counts)
    return judged, frozenset(name for name, names in judged.items() if "block" in needs[names[0]])
