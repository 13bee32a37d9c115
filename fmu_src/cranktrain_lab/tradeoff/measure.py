"""Runs of cases and their evaluation: cost from the processor's clock, error against a reference with equal start.

Every run of an engine and speed starts alike, from the motion of a settled cycle at the default step, and references
keep all cycles, so that a run of fewer cycles is judged over its own last one. The change in the last cycle is a
separate error. Compilation time is left out. Repeats are interleaved, case after case, because the machine's speed
drifts; the cost is their median.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from statistics import median
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.core.kernel import keep_record
from cranktrain.core.reduced_body import Array
from cranktrain.core.types import Progress
from cranktrain.dynamics.cycle_run import run_cycles
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.motion.film_memory import memory_offset, motion_size
from cranktrain.dynamics.motion.gas import trace_pressure
from cranktrain.dynamics.settled.judging import Settling
from cranktrain.dynamics.settled.motion import Motion, motion_of, put_motion
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import DEAREST, bearing_law
from cranktrain.film.laws.rigid_bore import rigid_bore
from cranktrain.loads.gas_pressure import CYCLE, GasTrace, gas_pressure, spline_coefficients
from cranktrain.results.strength.recorded_cycle import whole
from cranktrain.store.kept import Kept, digest
from cranktrain.structure.assembly import Assembly, assemble
from cranktrain_lab.tradeoff.case import Case
from cranktrain_lab.tradeoff.coupled import coupled_rows
from cranktrain_lab.tradeoff.other_method import OtherMethod, Unstable
from cranktrain_lab.tradeoff.point import OTHERS, OUTPUTS, Point


class Begun(NamedTuple):
    """Initial motion of a model's runs, with the memory of force laws (such as friction) and the settling error."""

    motion: Motion
    memory: Array
    settling: Settling


_SETTLED: dict[str, Begun] = {}
"""Initial motions of runs, computed once per process."""

HIGH_ORDERS = (12.0, 40.0)
"""Range of orders of pulley torsion with a separate error, because a coarse pressure trace affects them."""
FINE_SAMPLES = 7200
"""Samples of a trace of straight lines, so many that the model's spline through them hardly rounds the kinks."""
SETTLE = 1.0e-4
"""Largest settling error of the motion at which runs start."""
SLOW = 5.0
"""Duration, s, above which a run is not repeated, because a long run averages over drifts of the machine's speed."""


class Recorded(NamedTuple):
    """Outputs of a run over all cycles, at the ends of intervals of ``interval`` degrees, and the run's cost.

    ``values`` (2 + b, or 3 + 2b, samples): torsion, axial motion and least films of a solver that knows no more, else
    also shaft torque and vertical bearing forces. ``unsettled`` is what the motion at the start lacks of one that
    repeats; None where it repeats, or where the run starts from rest.
    """

    values: Array
    interval: float
    seconds: float  # processor seconds per simulated second
    counts: dict[str, int]
    unsettled: float | None = None


@dataclass(frozen=True)
class Entry:
    """Point to measure: the choice, its case, the reference case, and further parameters.

    ``other`` runs the case in place of the stage solver.
    """

    family: str
    label: str
    case: Case
    reference: Case
    error_kind: str
    more: dict[str, Any] = field(default_factory=dict)
    other: OtherMethod | None = None


def run(case: Case, say: Progress | None = None) -> Recorded:
    """Run a case; raises ``SolverError`` if it fails, ``InputError`` for an invalid case."""
    simulation, unsettled = _started(case, say or (lambda stage: None))
    bearings = len(case.engine.crankshaft.main_widths)
    names = ["pulley.torsion", "pulley.axial"]
    names += [f"bearing[{i + 1}].film_thickness_min" for i in range(bearings)]
    names += ["shaft.torque"] + [f"bearing[{i + 1}].force.y" for i in range(bearings)]
    places = [simulation.output_names.index(name) for name in names]
    count = round(720.0 / case.kept_deg) * case.cycles
    series = np.empty((count, simulation.outputs.size))
    if case.coupled_deg is None:
        h = case.simulated / count
        per_cycle = count // case.cycles
        begin = time.process_time()
        for first in range(0, count, per_cycle):  # cycle by cycle, so that an interrupt takes effect between cycles
            done = simulation.series(h, first + 1, series[first : first + per_cycle])
            if done < per_cycle:
                simulation.step((first + done + 1) * h)  # raises the error with its reason
        used = time.process_time() - begin
    else:
        used = (_coupled if case.scheme is None else coupled_rows)(simulation, case, series)
    values = series[:, places]
    counters = simulation.work.counters
    counts = {
        "steps": int(counters[at.N_STEPS]), "iterations": int(counters[at.N_ITERATIONS]),
        "rejected": int(counters[at.N_REJECTED]), "missed": int(counters[at.N_MISSED]),
    }  # fmt: skip
    return Recorded(np.ascontiguousarray(values.T), case.kept_deg, used / case.simulated, counts, unsettled)


def _assembled(case: Case, say: Progress) -> Assembly:
    return assemble(case.engine, case.levels, say=say, table_resolution=case.table, cutoff_hz=case.cutoff_hz)


def _started(case: Case, say: Progress) -> tuple[Simulation, float | None]:
    """Return the simulation of a case at its start, and the settling error of its initial motion."""
    settings = case.settings
    if case.coupled_deg is not None:
        settings = replace(settings, gas_source="input")
    made = _assembled(case, say)
    gas = None if case.trace_deg is None else sampled_trace(case.engine, case.trace_deg, case.trace_rule)
    simulation = Simulation(case.engine, made.body, settings, gas, made.parts)
    simulation.inputs[0] = case.speed
    if case.coupled_deg is not None:
        # The first pressures are those at the initial crank angle, because no model exists yet.
        trace = GasTrace.from_engine(case.engine)
        share = 1.0 - trace.falloff * (case.speed / trace.best_speed - 1.0) ** 2
        table = spline_coefficients(trace.motored + share * (trace.fired - trace.motored))
        simulation.pressures[:] = gas_pressure(-np.array(case.engine.firing_angles), table)
    simulation.initialize()
    unsettled = _settle(simulation, case, made, gas)
    if case.film_grid is not None:
        _change_grid(simulation, case)
    return simulation, unsettled


def _settle(simulation: Simulation, case: Case, made: Assembly, gas: GasTrace | None) -> float | None:
    """Set an initialized simulation to a settled cycle of its model. Return ``Recorded.unsettled``.

    The cycle is that of the default method and step. The dearest films start from rest: a cycle of them takes minutes.
    Raises ``KeyboardInterrupt`` where the cycles before it are interrupted.
    """
    levels, plain = case.levels, Settings()
    if bearing_law(levels.bearings).cost == DEAREST:
        return None
    settings = replace(
        levels, integrator=plain.integrator, step=plain.step, control=plain.control, newton_tolerance=None,
        film_change=None, gas_source=plain.gas_source,
    )  # fmt: skip
    key = digest(
        __file__, case.engine, made.body.omega, settings, case.speed, case.table, case.trace_deg, case.trace_rule
    )
    if key not in _SETTLED:
        model = Simulation(case.engine, made.body, settings, gas, made.parts)
        model.inputs[0] = case.speed
        model.initialize()
        settling = whole(run_cycles(model, None, SETTLE, None, None)).settling
        motion = motion_of(model.state, model.model.omega2.size)
        _SETTLED[key] = Begun(motion, model.state[_memory(model)], settling)
    begun, state = _SETTLED[key], simulation.state
    put_motion(state, begun.motion)
    state[_memory(simulation)] = begun.memory
    simulation.state = state
    return None if begun.settling.repeats else begun.settling.worst[1]


def _memory(simulation: Simulation) -> slice:
    """Return the slice of the state with the memory of force laws and added connections, such as spline friction."""
    return slice(int(memory_offset(simulation.model, 0)), int(motion_size(simulation.model)))


def _coupled(simulation: Simulation, case: Case, series: Array) -> float:
    """Run with a master that sends pressures, store outputs in ``series``. Return processor seconds."""
    inner = round(case.kept_deg / (case.coupled_deg or case.kept_deg))
    h = case.simulated / (len(series) * inner)
    begin = time.process_time()
    for k in range(len(series)):
        for j in range(inner):
            _give_pressures(simulation)
            simulation.step((k * inner + j + 1) * h)
        series[k] = simulation.outputs
    return time.process_time() - begin


def _give_pressures(simulation: Simulation) -> None:
    """Set the pressures that a master with the built-in trace would send at the present angle and speed."""
    theta, omega = simulation.outputs[0], simulation.outputs[1]
    for c in range(simulation.engine.n_cylinders):
        simulation.inputs[1 + c] = trace_pressure(simulation.model, c, theta, omega)


def _change_grid(simulation: Simulation, case: Case) -> None:
    """Set the case's grid for films solved online."""
    model = simulation.model
    size = case.film_grid or (0, 0)
    record = rigid_bore(case.engine.plain_mains, model.bearings, None, model.laws.solved, size=size)
    model.laws.entry[list(case.engine.plain_numbers), 1] = keep_record(record, model.laws.entry)


def sampled_trace(engine: Engine, spacing_deg: float, rule: str) -> GasTrace:
    """Return the built-in trace sampled every ``spacing_deg`` and interpolated by a spline or by straight lines.

    Samples lie half a spacing beside the knots of the trace's own spline, which a measurement does not know either.
    """
    trace = GasTrace.from_engine(engine)
    count = round(720.0 / spacing_deg)
    spacing = CYCLE / count
    angles = spacing * (np.arange(count, dtype=np.float64) + 0.5)
    fine = CYCLE * np.arange(FINE_SAMPLES) / FINE_SAMPLES

    def sampled(values: Array) -> Array:
        table = spline_coefficients(values)
        found = gas_pressure(angles, table)
        if rule == "linear":
            return np.interp(fine, angles, found, period=CYCLE)
        between = spline_coefficients(found)
        return gas_pressure(fine - 0.5 * spacing, between)

    return replace(trace, motored=sampled(trace.motored), fired=sampled(trace.fired))


def key_of(case: Case) -> str:
    """Return the key of a case in the store."""
    from cranktrain.structure.crank.reduction import input_digest

    return digest(__file__, case, input_digest(case.engine))


def recorded(case: Case, store: Kept, say: Progress | None = None) -> tuple[Array, float]:
    """Return values of a case over all cycles and their interval (degrees), from the store or by a run."""
    key = key_of(case)
    kept = store.arrays(key)
    if kept is None:
        got = run(case, say)
        kept = {"values": got.values, "interval": np.array(got.interval), "seconds": np.array(got.seconds)}
        kept["unsettled"] = np.array(math.nan if got.unsettled is None else got.unsettled)
        store.keep_arrays(key, kept)
    return kept["values"], float(kept["interval"])


def unsettled_start(case: Case, store: Kept) -> float | None:
    """Return ``Recorded.unsettled`` of a stored case."""
    kept = store.arrays(key_of(case)) or {}
    left = float(kept.get("unsettled", math.nan))
    return None if math.isnan(left) else left


def differences(values: Array, interval: float, exact: Array, exact_interval: float, cycles: int) -> Array:
    """Return the relative error (rows,) in the last of ``cycles``; the reference may have more cycles."""
    every = interval / exact_interval
    if abs(every - round(every)) > 1e-9:
        raise InputError(
            f"outputs every {interval:g} deg do not fall on those of the reference, {exact_interval:g} deg"
        )
    rows = min(values.shape[0], exact.shape[0])
    per_cycle, fine = round(720.0 / interval), round(720.0 / exact_interval)
    wanted = exact[:rows, (cycles - 1) * fine : cycles * fine]
    against = wanted[:, round(every) - 1 :: round(every)]
    difference = values[:rows, (cycles - 1) * per_cycle : cycles * per_cycle] - against
    scale = np.std(wanted, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.sqrt(np.mean(difference**2, axis=1)) / scale)


def named_errors(errors: Array, bearings: int, films: bool) -> dict[str, float | None]:
    """Return errors by names of ``OUTPUTS`` and ``OTHERS``. For films and forces the worst main bearing counts."""

    def worst(rows: Array) -> float | None:
        finite = rows[np.isfinite(rows)]
        return float(finite.max()) if finite.size else None

    least = worst(errors[2 : 2 + bearings]) if films else None
    both = {"pulley_torsion": worst(errors[0:1]), "pulley_axial": worst(errors[1:2]), "bearing_film": least}
    rest = errors[2 + bearings :]
    return {**both, "shaft_torque": worst(rest[0:1]), "bearing_force": worst(rest[1:])}


def settling(got: Recorded, case: Case, films: bool) -> float | None:
    """Return the largest relative change of ``OUTPUTS`` in the last cycle, or None if the run has one cycle."""
    if case.cycles < 2:
        return None
    count = round(720.0 / got.interval)
    before = got.values[:, : got.values.shape[1] - count]
    changed = differences(got.values[:, count:], got.interval, before, got.interval, case.cycles - 1)
    named = named_errors(changed, len(case.engine.crankshaft.main_widths), films)
    return max((value for name in OUTPUTS if (value := named[name]) is not None), default=None)


def high_order_error(values: Array, interval: float, exact: Array, exact_interval: float, cycles: int) -> float:
    """Return the relative error of pulley torsion in the orders of ``HIGH_ORDERS``, in the last cycle."""

    def lines(rows: Array, every: float) -> Array:
        per_cycle = round(720.0 / every)
        cycle = rows[0, (cycles - 1) * per_cycle : cycles * per_cycle]
        # Samples lie at ends of intervals, so the first sample is one interval after the cycle's start.
        found = np.fft.rfft(cycle) / per_cycle
        turned = found * np.exp(-2j * math.pi * np.arange(found.size) / per_cycle)
        low, high = (round(2.0 * order) for order in HIGH_ORDERS)
        return np.asarray(turned[low:high])

    ours, theirs = lines(values, interval), lines(exact, exact_interval)
    n = min(ours.size, theirs.size)
    return float(np.linalg.norm(ours[:n] - theirs[:n]) / np.linalg.norm(theirs[:n]))


def measured(
    entries: Sequence[Entry],
    store: Kept,
    repeats: int = 1,
    say: Progress | None = None,
    advance: Callable[[], None] | None = None,
) -> list[Point]:
    """Measure entries and return their points. Stored runs are not repeated, and each run is stored at once.

    ``say`` is told each run before it starts, ``advance`` is called after each that was run or was not needed.
    """
    told = say or (lambda stage: None)
    for turn in range(repeats):
        for entry in entries:
            key = _entry_key(entry)
            kept = store.entry(key)
            done = 0 if kept is None else len(kept["costs"])
            failed = kept is not None and kept["status"] != "ok"
            slow = kept is not None and any(cost * entry.case.simulated > SLOW for cost in kept["costs"])
            if not (failed or slow or done > turn):
                told(f"{entry.family}: {entry.label}" + (f", repeat {turn + 1}" if turn else ""))
                store.keep(key, _measure(entry, store, kept, told))
            if advance is not None:
                advance()
    return [_point(entry, store.entry(_entry_key(entry)) or {}) for entry in entries]


def _entry_key(entry: Entry) -> str:
    other = [] if entry.other is None else [entry.other.key]
    return digest(__file__, key_of(entry.case), key_of(entry.reference), *other)


def _measure(entry: Entry, store: Kept, kept: dict[str, Any] | None, say: Progress) -> dict[str, Any]:
    """Run an entry once more and return its data for the store."""
    case, other = entry.case, entry.other
    unsettled: list[float | None] = []

    def started(wanted: Case) -> Simulation:
        simulation, left = _started(wanted, say)
        unsettled.append(left)
        return simulation

    try:
        exact, exact_interval = recorded(entry.reference, store, say)
        if other is None:
            got = run(case, say)
        else:
            values, used, counts = other.run(case, started)
            got = Recorded(values, case.kept_deg, used / case.simulated, counts, *unsettled[:1])
    except Unstable as problem:
        return _failure("unstable", problem)
    except CranktrainError as problem:
        return _failure(f"failed: {problem}", problem)
    if kept is not None and kept["costs"]:
        return {**kept, "costs": [*kept["costs"], got.seconds]}
    errors = differences(got.values, got.interval, exact, exact_interval, case.cycles)
    laws = [bearing_law(one.levels.bearings) for one in (case, entry.reference)]
    films = all(law.film for law in laws)
    named = named_errors(errors, len(case.engine.crankshaft.main_widths), films)
    if not all(law.carries for law in laws):
        named["pulley_axial"] = named["bearing_force"] = None
    status, found = ("ok", {}) if other is None else other.judged(case, started)
    details: dict[str, Any] = {**got.counts, **found}
    details["settling"] = settling(got, case, films)
    starts = {"start_unsettled": got.unsettled, "reference_start_unsettled": unsettled_start(entry.reference, store)}
    details |= {name: left for name, left in starts.items() if left is not None}
    details["modes"] = _assembled(case, say).body.n_modes
    details["high_orders"] = high_order_error(got.values, got.interval, exact, exact_interval, case.cycles)
    return {
        "costs": [got.seconds],
        "status": status,
        "error": {name: named[name] for name in OUTPUTS},
        "other_errors": {name: named[name] for name in OTHERS},
        "details": details,
    }


def _failure(status: str, problem: Exception) -> dict[str, Any]:
    """Return the data for the store of an entry whose run failed."""
    details = {"why": " ".join(str(problem).split())}
    errors = {"error": dict.fromkeys(OUTPUTS), "other_errors": dict.fromkeys(OTHERS)}
    return {"costs": [], "status": status, **errors, "details": details}


def _point(entry: Entry, kept: dict[str, Any]) -> Point:
    """Return the point of an entry from its stored data."""
    details = kept["details"]
    parameters = {
        **entry.case.parameters(), **entry.more, **details, "error_kind": entry.error_kind,
        "repeats": len(kept["costs"]),
    }  # fmt: skip
    return Point(
        family=entry.family,
        label=entry.label,
        parameters=parameters,
        seconds_per_simulated_second=median(kept["costs"]) if kept["costs"] else None,
        error=kept["error"],
        status=kept["status"],
        other_errors=kept["other_errors"],
    )
