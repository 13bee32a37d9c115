"""Engine variants one after the other, as a parameter study runs them: what each costs."""

from __future__ import annotations

import math
import resource
import time
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.structure.assembly import Assembly, assemble
from cranktrain.studies.run_up.steady import Job, SteadyRuns

SPEED = 2000.0 * math.pi / 30.0
SETTLED, HIGHEST_ORDER = 1e-3, 24.0


class Kind(NamedTuple):
    """What a study varies: levels, and whether each variant has a crank of its own."""

    settings: Settings
    source: str
    anew: bool


KINDS = {
    "torsional, structure reused": Kind(Settings(crank="torsional"), "ker-wilson", False),
    "torsional, structure anew": Kind(Settings(crank="torsional"), "ker-wilson", True),
    "solid, structure reused": Kind(Settings(bearings="impedance"), "", False),
}


def variant(kind: Kind, number: int) -> Engine:
    """The six with other pistons, and with other pins where its structure is to be made anew."""
    engine = load_engine("diesel_i6")
    share = 1.0 + 1e-3 * (number + 1)
    engine = replace(engine, cylinders=replace(engine.cylinders, piston_mass=share * engine.cylinders.piston_mass))
    if kind.source:
        engine = replace(engine, reduction=replace(engine.reduction, torsional_source=kind.source))
    if kind.anew:
        crank = engine.crankshaft
        engine = replace(engine, crankshaft=replace(crank, pin_diameter=crank.pin_diameter / (1.0 + 1e-4 * number)))
    return engine


def assembled(kind: Kind, engine: Engine) -> Assembly:
    """What an engine runs on."""
    return assemble(engine, kind.settings, inherit=not kind.source)


@cache
def first_assembly(name: str) -> Assembly:
    """That of a kind's first engine, which others with the same crank share."""
    return assembled(KINDS[name], variant(KINDS[name], 0))


def run_variant(name: str, number: int) -> tuple[float, int]:
    """Processor seconds of one variant to its settled cycle at 2000 rev/min, and the cycles that it took."""
    kind = KINDS[name]
    first = first_assembly(name)
    began = time.process_time()
    engine = variant(kind, number)
    made = assembled(kind, engine) if kind.anew else replace(first, engine=engine)
    found = SteadyRuns(Job(made, None, SETTLED, HIGHEST_ORDER, ("pulley.torsion",))).at(SPEED)
    return time.process_time() - began, found.cycles


def spent() -> float:
    """Processor seconds of this process and of its children that have ended."""
    kinds = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    return sum(use.ru_utime + use.ru_stime for use in map(resource.getrusage, kinds))


def new_structure(number: int) -> dict[str, Any]:
    """Finite elements and reduction of a crank that no cache holds: processor seconds, meshing's among them."""
    from cranktrain.structure.crank.reduction import reduced_crankshaft

    engine = variant(Kind(Settings(), "", True), number)
    began = spent()
    body = reduced_crankshaft(engine)
    return {"seconds": spent() - began, "degrees_of_freedom": int(body.quality["dofs_full"])}


def on_cluster(name: str, count: int, workers: int) -> dict[str, float]:
    """Variants on a Dask cluster of this machine: wall time and processor time, and what the tasks took of it."""
    from distributed import Client, LocalCluster

    settings: dict[str, Any] = {"n_workers": workers, "threads_per_worker": 1, "dashboard_address": None}
    with LocalCluster(**settings) as cluster, Client(cluster) as client:
        client.gather([client.submit(run_variant, name, -2 - k, pure=False) for k in range(2 * workers)])
        own, began = time.process_time(), time.perf_counter()
        before = client.run(time.process_time)
        found = client.gather(client.map(run_variant, [name] * count, range(count), pure=False))
        wall = time.perf_counter() - began
        after = client.run(time.process_time)
        spread = time.process_time() - own
    tasks = sum(seconds for seconds, _ in found)
    used = sum(after[worker] - before[worker] for worker in before)
    return {"workers": workers, "wall_s": wall, "tasks_s": tasks, "workers_s": used, "scheduler_s": spread}
