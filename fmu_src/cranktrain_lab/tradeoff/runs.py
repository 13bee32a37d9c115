"""Runs of models for the studies: the motion in which they begin, cycles with their time, and the coupled ones.

Every run of an engine and speed starts alike, from the motion of a settled cycle at the default step. Compilation time
is left out.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import keep_record
from cranktrain.core.reduced_body import Array
from cranktrain.core.types import Progress
from cranktrain.dynamics.cycle_run import run_cycles
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.arrays import Parts
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
from cranktrain.modules.combustion import file as combustion_file
from cranktrain.modules.combustion.simulation import CombustionSimulation
from cranktrain.modules.register import module_files, module_of_engine
from cranktrain.results.strength.recorded_cycle import whole
from cranktrain.store.kept import digest
from cranktrain.structure.assembly import Assembly, assemble
from cranktrain_lab.coupling.master import Master
from cranktrain_lab.coupling.modules import COMBUSTION, CRANKTRAIN, OWN
from cranktrain_lab.coupling.simulation_unit import SimulationUnit
from cranktrain_lab.coupling.virtual_engine import gas_connections, gas_exchange, volume_connections
from cranktrain_lab.tradeoff.case import Case


class Begun(NamedTuple):
    """Initial motion of a model's runs, with the memory of force laws (such as friction) and the settling error."""

    motion: Motion
    memory: Array
    settling: Settling


_SETTLED: dict[str, Begun] = {}
"""Initial motions of runs, computed once per process."""

FINE_SAMPLES = 7200
"""Samples of a trace of straight lines, so many that the model's spline through them hardly rounds the kinks."""
SETTLE = 1.0e-4
"""Largest settling error of the motion at which runs start."""


class Recorded(NamedTuple):
    """Outputs of a run over all cycles, at the ends of intervals of ``interval`` degrees, and the run's cost.

    ``values`` (2 + b, or 3 + 2b, samples): torsion, axial motion and least films of a solver that knows no more, else
    also shaft torque and vertical bearing forces. ``unsettled`` is the settling error of the initial
    motion; None if that motion repeats, or if the run starts from rest.
    """

    values: Array
    interval: float
    seconds: float  # processor seconds per simulated second
    counts: dict[str, int]
    unsettled: float | None = None


def run(case: Case, say: Progress | None = None) -> Recorded:
    """Run a case; raises ``SolverError`` if it fails, ``InputError`` for an invalid case."""
    simulation, unsettled = started(case, say or (lambda stage: None))
    bearings = len(case.engine.crankshaft.main_widths)
    names = ["pulley.torsion", "pulley.axial"]
    names += [f"bearing[{i + 1}].film_thickness_min" for i in range(bearings)]
    names += ["shaft.torque"] + [f"bearing[{i + 1}].force.y" for i in range(bearings)]
    places = [simulation.output_names.index(name) for name in names]
    count = round(720.0 / case.kept_deg) * case.cycles
    series = np.empty((count, simulation.outputs.size))
    if case.coupled_deg is None:
        h, per_cycle = case.simulated / count, count // case.cycles
        cycles = range(0, count, per_cycle)  # cycle by cycle, so that an interrupt takes effect between cycles
        used = sum(timed(simulation, h, first, series[first : first + per_cycle]) for first in cycles)
    else:
        used = _coupled(simulation, case, series)
    values = series[:, places]
    counters = simulation.work.counters
    counts = {
        "steps": int(counters[at.N_STEPS]), "iterations": int(counters[at.N_ITERATIONS]),
        "rejected": int(counters[at.N_REJECTED]), "missed": int(counters[at.N_MISSED]),
    }  # fmt: skip
    return Recorded(np.ascontiguousarray(values.T), case.kept_deg, used / case.simulated, counts, unsettled)


def assembled(case: Case, say: Progress) -> Assembly:
    """Return bodies and parts of a case's run."""
    return assemble(case.engine, case.levels, say=say, table_resolution=case.table, cutoff_hz=case.cutoff_hz)


def at_start(
    made: Assembly, settings: Settings, speed: float, gas: GasTrace | None = None, parts: Parts | None = None,
    pressures: Array | float = at.AMBIENT,
) -> Simulation:  # fmt: skip
    """Return an initialized simulation of assembled bodies at a shaft speed (rad/s).

    ``parts`` take the place of the assembled ones; ``pressures`` (Pa) are those at the start of a master that gives
    them.
    """
    simulation = Simulation(made.engine, made.body, settings, gas, parts or made.parts)
    simulation.inputs[0] = speed
    simulation.pressures[:] = pressures
    simulation.initialize()
    return simulation


def timed(simulation: Simulation, h: float, taken: int, rows: Array) -> float:
    """Fill ``rows`` (k, outputs) by steps of ``h`` (s) after ``taken`` of them. Return processor seconds."""
    begin = time.process_time()
    done = simulation.series(h, taken + 1, rows)
    while done < len(rows):
        simulation.step((taken + done + 1) * h)  # raises the error with its reason
        rows[done] = simulation.outputs
        done += 1
    return time.process_time() - begin


def started(case: Case, say: Progress) -> tuple[Simulation, float | None]:
    """Return the simulation of a case at its start, and the settling error of its initial motion."""
    settings = case.settings
    pressures: Array | float = at.AMBIENT
    if case.coupled_deg is not None:
        # The first pressures are those at the initial crank angle, because no model exists yet.
        settings = replace(settings, gas_source="input")
        trace = GasTrace.from_engine(case.engine)
        share = 1.0 - trace.falloff * (case.speed / trace.best_speed - 1.0) ** 2
        table = spline_coefficients(trace.motored + share * (trace.fired - trace.motored))
        pressures = gas_pressure(-np.array(case.engine.firing_angles), table)
    made = assembled(case, say)
    gas = None if case.trace_deg is None else sampled_trace(case.engine, case.trace_deg, case.trace_rule)
    simulation = at_start(made, settings, case.speed, gas, pressures=pressures)
    unsettled = _settle(simulation, case, made, gas)
    if case.film_grid is not None:
        record = rigid_bore(
            case.engine.plain_mains, simulation.model.bearings, None, simulation.model.laws.solved, size=case.film_grid
        )
        entry = simulation.model.laws.entry
        entry[list(case.engine.plain_numbers), 1] = keep_record(record, entry)
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
        model = at_start(made, settings, case.speed, gas)
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


def has_combustion(engine: Engine) -> bool:
    """True if a combustion is shipped for an engine."""
    try:
        return bool(module_of_engine(COMBUSTION, engine.name))
    except InputError:
        return False


def _coupled(simulation: Simulation, case: Case, rows: Array) -> float:
    """Fill ``rows`` (k, outputs) by a coupled run of a simulation at its start. Return processor seconds.

    The master sends the pressures of the built-in trace at the present angle and speed, or, with a scheme, couples the
    combustion, in this process without FMUs.
    """
    assert case.coupled_deg is not None
    inner = round(case.kept_deg / case.coupled_deg)
    h = case.simulated / (len(rows) * inner)

    def sending(until: float) -> None:
        theta, omega = simulation.outputs[0], simulation.outputs[1]
        for c in range(simulation.engine.n_cylinders):
            simulation.inputs[1 + c] = trace_pressure(simulation.model, c, theta, omega)
        simulation.step(until)

    step = sending if case.scheme is None else _coupling(simulation, case, case.scheme)
    begin = time.process_time()
    for k in range(len(rows)):
        for j in range(inner):
            step((k * inner + j + 1) * h)
        rows[k] = simulation.outputs
    return time.process_time() - begin


def _coupling(simulation: Simulation, case: Case, scheme: str) -> Callable[[float], Any]:
    """Return the step to a time (s) of a master that couples the combustion by a scheme."""
    assert case.exchange is not None
    gas = CombustionSimulation(combustion_file.load(module_files()[module_of_engine(COMBUSTION, case.engine.name)]))
    gas.inputs[0] = case.speed
    units = [SimulationUnit(COMBUSTION, gas), SimulationUnit(CRANKTRAIN, simulation, begin=lambda: None)]
    cylinders = case.engine.n_cylinders
    connections = gas_connections(cylinders, case.exchange == OWN) + volume_connections(cylinders)
    master = Master(units, connections, gas_exchange(scheme, case.exchange))
    master.initialize()
    return master.step
