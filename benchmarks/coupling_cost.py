"""What a communication step of the coupled FMUs costs, and who takes it: ``python benchmarks/coupling_cost.py``.

Cranktrain, combustion and valve train of an engine (``[diesel_i6|diesel_v8]``) at 2000 rev/min, Gauss–Seidel, by
communication step in degrees of crank angle: processor time over simulated time, medians over blocks of steps that are
taken in turn, so that the figures of one run compare on a busy machine too. ``one_process``: the run as ``run`` takes
it, with every point recorded; of it each unit's own functions, and ``master``, all the rest. ``supervised``: the
process of a supervised run, from two runs of different length. ``python``: the same as ``one_process``, but with every
unit's functions called from Python. ``fmi3`` and ``fmi3_python``: both with FMUs of FMI 3.0, whose pressures are an
array. ``intermediate``: with these and exchange inside a step, ``intermediate_python`` with the functions of the
cranktrain alone called from Python. ``usual_method``: as ``one_process``, but with the cranktrain's usual integrator.
``crank_alone``: the cranktrain with its built-in gas, at its own steps. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import resource
import sys
import tempfile
import time
from collections.abc import Collection
from functools import partial
from pathlib import Path
from statistics import median
from typing import NamedTuple

import cranktrain as ct
from cranktrain_lab.coupling.fmu_unit import FmuUnit
from cranktrain_lab.coupling.master import Master
from cranktrain_lab.coupling.modules import COMBUSTION, CRANKTRAIN, VALVETRAIN
from cranktrain_lab.coupling.run import Record, Steps
from cranktrain_lab.coupling.supervised import run_supervised
from cranktrain_lab.coupling.unit import Around
from cranktrain_lab.coupling.virtual_engine import INTEGRATOR, Partners, VirtualEngine, virtual_engine

SPEED = 2000.0 * math.pi / 30.0
STEPS_DEG = 1.0, 1.5, 3.0
MODULES = {"diesel_i6": ("combustion_i6", "valvetrain_i6"), "diesel_v8": ("combustion_v8", "valvetrain_v8")}
BLOCKS, BLOCK = 40, 120
CYCLES = 4, 24
"""Cycles of the shorter and of the longer supervised run."""


def started(engine: VirtualEngine, called: Collection[str] = ()) -> Master:
    """Its initialized master, which calls the functions of the units ``called`` itself, without compiled turns."""
    units = [Around(unit) if name in called else unit for name, unit in engine.units.items()]
    master = Master(units, engine.connections, engine.exchange, engine.outputs)
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


class Fmus(NamedTuple):
    """Files of cranktrain, combustion and valve train."""

    cranktrain: Path
    combustion: Path
    valvetrain: Path

    @classmethod
    def built(cls, name: str, folder: Path, fmi: str) -> Fmus:
        """Those of an engine, of a version of FMI."""
        folder.mkdir()
        modules = [ct.build_fmu(module, folder, fmi=fmi) for module in MODULES[name]]
        return cls(ct.build_fmu(name, folder, film_table=False, fmi=fmi), *modules)

    def partners(self, integrator: str | None = None) -> Partners:
        """With the cranktrain's integrator, or the one that the coupling chooses."""
        values = {} if integrator is None else {CRANKTRAIN: {INTEGRATOR: integrator}}
        return Partners(self.cranktrain, self.combustion, values, self.valvetrain)


class Way(NamedTuple):
    """A way to run: whose functions are called from Python, and a scheme."""

    partners: Partners
    called: Collection[str] = ()
    scheme: str = "gauss-seidel"


def measure(two: Fmus, three: Fmus, step_deg: float) -> dict[str, float]:
    """Figures of one communication step, with FMUs of FMI 2.0 and of 3.0."""
    size = math.radians(step_deg) / SPEED
    everyone = COMBUSTION, VALVETRAIN, CRANKTRAIN
    ways = {
        "one_process": Way(two.partners()), "python": Way(two.partners(), everyone),
        "fmi3": Way(three.partners()), "fmi3_python": Way(three.partners(), everyone),
        "intermediate": Way(three.partners(), (), "intermediate"),
        "intermediate_python": Way(three.partners(), (CRANKTRAIN,), "intermediate"),
        "stages": Way(three.partners(), (), "stages"),
        "usual_method": Way(two.partners(integrator="auto")),
    }  # fmt: skip
    engines = {key: virtual_engine(way.partners, SPEED, way.scheme, "own", size) for key, way in ways.items()}
    masters = {key: started(engine, ways[key].called) for key, engine in engines.items()}
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
    make = partial(virtual_engine, two.partners(), SPEED, "gauss-seidel", "own", size)
    return figures | {"supervised": supervised(make, size)}


def main() -> int:
    """Measure and print."""
    name = sys.argv[1] if len(sys.argv) > 1 else "diesel_i6"
    if name not in MODULES:
        print(f"coupling_cost: no combustion ships for '{name}'; valid: {', '.join(MODULES)}", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as folder:
        two, three = (Fmus.built(name, Path(folder) / f"fmi{fmi[0]}", fmi) for fmi in ("2.0", "3.0"))
        figures: dict[str, object] = {"crank_alone": crank_alone(two.cranktrain)}
        for step_deg in STEPS_DEG:
            print(f"coupling cost: {step_deg:g} deg", file=sys.stderr, flush=True)
            figures[f"{step_deg:g}"] = measure(two, three, step_deg)
    print(json.dumps(figures, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
