"""The whole six: what block, pistons and damper cost, and how far a step of 0.5 degrees is from a finer one.

Cost is a ratio inside one run: medians over rounds in which every case takes its turn. The error is the RMS of the
difference over that of the alternating part, against the same model at a quarter of the step by sdirk4; real-time
factors are processor time of all cycles but the first over simulated time, on this machine now.
"""

from __future__ import annotations

import math
import statistics
import time
from typing import Any

import numpy as np

from cranktrain.dynamics.cycle_run import Result, communication_step
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation, simulate
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import Assembly, assemble

SPEED = 2000.0 * math.pi / 30.0
ROUNDS = 9
CYCLES = 6
LEVELS = {
    "ground, rigid pistons": Settings(),
    "ground, guided pistons": Settings(pistons="guided"),
    "flexible block": Settings(block="flexible"),
    "flexible block, damper": Settings(block="flexible", damper="fitted"),
}
STEPS = (("generalised-alpha", 0.5), ("sdirk2", 0.5), ("sdirk4", 0.5), ("sdirk4", 2.5))


def step_costs() -> dict[str, float]:
    """Microseconds per step of each of ``LEVELS`` with impedance films at the default step."""
    running = [_started(settings) for settings in LEVELS.values()]
    h = communication_step(SPEED, Settings().step)
    costs: list[list[float]] = [[] for _ in running]
    for _ in range(ROUNDS):
        for own, simulation in zip(costs, running, strict=True):
            begin, steps = simulation.time, simulation.work.counters[0]
            clock = time.process_time()
            for k in range(1, 145):
                simulation.step(begin + k * h)
            own.append(1e6 * (time.process_time() - clock) / (simulation.work.counters[0] - steps))
    return {name: statistics.median(own) for name, own in zip(LEVELS, costs, strict=True)}


def errors(bearings: str) -> list[dict[str, Any]]:
    """Real-time factor and errors of the whole engine, block, pistons and damper, at each of ``STEPS``."""
    reference, _ = _run(bearings, "sdirk4", 0.125)
    rows = []
    for integrator, step in STEPS:
        run, factor = _run(bearings, integrator, step)
        found = {name: relative_error(run, reference, name) for name in ("pulley.torsion", "pulley.axial")}
        rows.append({"integrator": integrator, "step_deg": step, "real_time_factor": factor, **found})
    return rows


def relative_error(run: Result, reference: Result, name: str) -> float:
    """RMS of the difference over the last cycle over the RMS of the reference's alternating part."""
    angle, exact = reference.last_cycle(name)
    there, values = run.last_cycle(name)
    difference = np.interp(angle, there, values) - exact
    return float(np.sqrt(np.mean(difference**2)) / np.std(exact))


def _made(settings: Settings) -> Assembly:
    return assemble(load_engine("diesel_i6"), settings)


def _started(settings: Settings) -> Simulation:
    made = _made(settings)
    simulation = Simulation(made.engine, made.body, settings, parts=made.parts)
    simulation.inputs[0] = SPEED
    simulation.initialize()
    return simulation


def _run(bearings: str, integrator: str, step_deg: float) -> tuple[Result, float]:
    """A run, and the processor time of its cycles after the first over the time that they simulate."""
    settings = Settings(
        bearings=bearings, block="flexible", damper="fitted", integrator=integrator, step=math.radians(step_deg)
    )
    made = _made(settings)
    spent, clock = [], time.process_time()
    for cycles in (1, CYCLES):  # the shorter one takes start and compilation away
        result = simulate(made.engine, made.body, settings, SPEED, cycles, parts=made.parts)
        spent.append(time.process_time() - clock)
        clock = time.process_time()
    return result, (spent[1] - spent[0]) / ((CYCLES - 1) * 4.0 * math.pi / SPEED)


def main() -> None:
    """Print both tables."""
    costs = step_costs()
    ground = costs["ground, rigid pistons"]
    guided = costs["ground, guided pistons"]
    print("| level (impedance films, 2.5 deg) | us per step | over ground | over ground with guided pistons |")
    print("| --- | --- | --- | --- |")
    for name, cost in costs.items():
        print(f"| {name} | {cost:.0f} | {cost / ground:.2f} | {cost / guided:.2f} |")
    for bearings in ("impedance", "table"):
        print(f"\n| whole engine, {bearings} films | real-time factor | error torsion | error axial |")
        print("| --- | --- | --- | --- |")
        for row in errors(bearings):
            print(
                f"| {row['integrator']} {row['step_deg']:g} deg | {row['real_time_factor']:.2f} | "
                f"{row['pulley.torsion']:.1e} | {row['pulley.axial']:.1e} |"
            )


if __name__ == "__main__":
    main()
