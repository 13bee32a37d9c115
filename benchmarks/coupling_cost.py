"""What a communication step of the coupled FMUs costs, and who takes it: ``python benchmarks/coupling_cost.py``.

Cranktrain, combustion and valve train of an engine (``[diesel_i6|diesel_v8]``) at 2000 rev/min, Gauss–Seidel, by
communication step in degrees of crank angle: processor time over simulated time, medians over blocks of steps that are
taken in turn, so that the figures of one run compare on a busy machine too. ``one_process``: the run as ``run`` takes
it, with every point recorded; of it each unit's own functions, and ``master``, all the rest. ``supervised``: the
process of a supervised run, from two runs of different length. ``python``: the same as ``one_process``, but with every
unit's functions called from Python. ``usual_method``: as ``one_process``, but with the cranktrain's usual integrator.
``crank_alone``: the cranktrain with its built-in gas, at its own steps. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import resource
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from statistics import median

import cranktrain as ct
from cranktrain.coupling.fmu_unit import FmuUnit
from cranktrain.coupling.master import Master
from cranktrain.coupling.modules import CRANKTRAIN
from cranktrain.coupling.run import Record, Steps
from cranktrain.coupling.supervised import run_supervised
from cranktrain.coupling.unit import Around
from cranktrain.coupling.virtual_engine import INTEGRATOR, Partners, VirtualEngine, virtual_engine

SPEED = 2000.0 * math.pi / 30.0
STEPS_DEG = 1.0, 1.5, 3.0
MODULES = {"diesel_i6": ("combustion_i6", "valvetrain_i6"), "diesel_v8": ("combustion_v8", "valvetrain_v8")}
BLOCKS, BLOCK = 40, 120
CYCLES = 4, 24
"""Cycles of the shorter and of the longer supervised run."""


def started(engine: VirtualEngine, compiled: bool = True) -> Master:
    """Its initialized master; without ``compiled`` turns it calls all units' functions itself."""
    units = engine.units.values() if compiled else [Around(unit) for unit in engine.units.values()]
    master = Master(list(units), engine.connections, engine.exchange, engine.outputs)
    master.initialize()
    return master


def steps_taken(master: Master, engine: VirtualEngine, size: float) -> float:
    """Processor time over simulated time of a block of steps."""
    record, begin = Record(master, engine.bonds), time.process_time()
    for _ in range(BLOCK):
        master.step(master.time + size)
        record.take()
    return (time.process_time() - begin) / (BLOCK * size)


def units_in_turn(master: Master, engine: VirtualEngine, size: float) -> dict[str, float]:
    """The same by unit: what its own functions take within a block of steps."""
    turns = master._turns
    assert turns is not None
    whole, names, spent = turns.take, [unit.name for unit in master._order], dict.fromkeys(engine.units, 0.0)

    def take(what: int, first: int, end: int, at: float, step: float) -> None:
        for k in range(first, end):
            begin = time.process_time()
            whole(what, k, k + 1, at, step)
            spent[names[k]] += time.process_time() - begin

    turns.take = take  # type: ignore[method-assign]
    steps_taken(master, engine, size)
    turns.take = whole  # type: ignore[method-assign]
    return {name: seconds / (BLOCK * size) for name, seconds in spent.items()}


def supervised(make: partial[VirtualEngine], size: float) -> float:
    """Processor time over simulated time of a supervised run's process, its start left out."""
    spent = []
    for cycles in CYCLES:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        run_supervised(make, cycles * 4.0 * math.pi / SPEED, Steps(size))
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return (spent[1] - spent[0]) / ((CYCLES[1] - CYCLES[0]) * 4.0 * math.pi / SPEED)


def crank_alone(path: Path) -> float:
    """Processor time over simulated time of the cranktrain with built-in gas, at communication steps of 5 degrees."""
    unit, size = FmuUnit(path, CRANKTRAIN, {"speed": SPEED}), math.radians(5.0) / SPEED
    unit.link([], ["pulley.torsion", "pulley.axial", "shaft.torque"])
    unit.initialize(0.0)
    found = []
    for block in range(BLOCKS):
        begin = time.process_time()
        for k in range(BLOCK):
            unit.step((block * BLOCK + k) * size, size)
            unit.read()
        found.append((time.process_time() - begin) / (BLOCK * size))
    unit.close()
    return median(found)


def measure(fmus: tuple[Path, Path, Path], step_deg: float) -> dict[str, float]:
    """Figures of one communication step."""
    size = math.radians(step_deg) / SPEED
    partners = Partners(fmus[0], fmus[1], {}, fmus[2])
    usual = Partners(fmus[0], fmus[1], {CRANKTRAIN: {INTEGRATOR: "auto"}}, fmus[2])
    ways = {"one_process": (partners, True), "python": (partners, False), "usual_method": (usual, True)}
    engines = {way: virtual_engine(chosen, SPEED, "gauss-seidel", "own", size) for way, (chosen, _) in ways.items()}
    masters = {way: started(engine, ways[way][1]) for way, engine in engines.items()}
    found: dict[str, list[float]] = {}
    for block in range(BLOCKS + 1):
        for way, master in masters.items():
            taken = steps_taken(master, engines[way], size)
            if block:
                found.setdefault(way, []).append(taken)
        parts = units_in_turn(masters["one_process"], engines["one_process"], size)
        for name, taken in parts.items() if block else ():
            found.setdefault(name, []).append(taken)
    for master in masters.values():
        master.close()
    figures = {name: median(values) for name, values in found.items()}
    figures["master"] = figures["one_process"] - sum(figures[name] for name in engines["one_process"].units)
    make = partial(virtual_engine, partners, SPEED, "gauss-seidel", "own", size)
    return figures | {"supervised": supervised(make, size)}


def main() -> int:
    """Measure and print."""
    name = sys.argv[1] if len(sys.argv) > 1 else "diesel_i6"
    if name not in MODULES:
        print(f"coupling_cost: no combustion ships for '{name}'; valid: {', '.join(MODULES)}", file=sys.stderr)
        return 2
    combustion, valvetrain = MODULES[name]
    with tempfile.TemporaryDirectory() as folder:
        fmus = (
            ct.build_fmu(name, folder, film_table=False),
            ct.build_fmu(combustion, folder),
            ct.build_fmu(valvetrain, folder),
        )
        figures: dict[str, object] = {"crank_alone": crank_alone(fmus[0])}
        for step_deg in STEPS_DEG:
            print(f"coupling cost: {step_deg:g} deg", file=sys.stderr, flush=True)
            figures[f"{step_deg:g}"] = measure(fmus, step_deg)
    print(json.dumps(figures, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
