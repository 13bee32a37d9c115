"""How cost grows: ``python -m benchmarks.cost_law [PICTURE.png]``, and what 10,000 engine variants take.

Processor time of a cycle at 2000 rev/min and the default step, medians over rounds in which every case takes its turn,
against one number at a time: modes of the solid crank at equal ports; ports, and films solved online, of in-line
engines of 2 to 12 cylinders with equally many modes; nodes of the films' grid. Processor time of a run-up against its
speeds and its workers. Exponents are slopes of straight lines through logarithms, with their standard error and the RMS
of what they leave: local laws, since each cost has a part that does not grow.

Variants are engines run to a settled cycle, some twenty of each kind, in this process and on a Dask cluster of two
workers (extra ``dask``). What 10,000 take is that times their number over workers and efficiency: nothing of it was
run. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    os.environ.update({f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")})
ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402
from benchmarks._cost_law_chart import draw  # noqa: E402
from benchmarks._variants import KINDS, SPEED, on_cluster, run_variant, spent  # noqa: E402

from cranktrain.core.kernel import keep_record  # noqa: E402
from cranktrain.dynamics.cycle_run import communication_step  # noqa: E402
from cranktrain.dynamics.model.settings import Settings  # noqa: E402
from cranktrain.dynamics.simulation import Simulation  # noqa: E402
from cranktrain.engine.file import load_engine  # noqa: E402
from cranktrain.engine.model import Engine  # noqa: E402
from cranktrain.film.laws.rigid_bore import rigid_bore  # noqa: E402
from cranktrain.structure.assembly import Assembly, assemble  # noqa: E402
from cranktrain.studies.run_up.plan import run_up_speeds  # noqa: E402
from cranktrain.studies.run_up.run_up import Means, run_up  # noqa: E402
from cranktrain.studies.run_up.steady import Job  # noqa: E402

ROUNDS, DEAR_ROUNDS = 9, 3
CUTOFFS_HZ = (500.0, 1000.0, 2000.0, 3500.0, 5500.0, 8000.0, 12000.0)
CYLINDERS, FILM_CYLINDERS = (2, 3, 4, 6, 8, 12), (2, 3, 4, 6, 8)
EQUAL_MODES = 72
GRIDS = ((24, 6), (32, 8), (48, 8), (64, 12), (96, 16))
SPEED_COUNTS, WORKER_COUNTS, RUN_UP_SPEEDS = (5, 9, 17, 33, 65), (1, 2), 33
FIRST_RPM, LAST_RPM = 1000.0, 1900.0
VARIANTS, MANY, CLUSTER_WORKERS = 20, 10_000, 2
NEW = "solid, structure anew"


class Case:
    """A running model, cycle by cycle."""

    def __init__(self, made: Assembly, grid: tuple[int, int] | None = None) -> None:
        self.run = Simulation(made.engine, made.body, made.settings, None, made.parts)
        self.run.inputs[0] = SPEED
        self.run.initialize()
        if grid is not None:
            model = self.run.model
            record = rigid_bore(made.engine.plain_mains, model.bearings, None, model.laws.solved, size=grid)
            model.films.entry[:, 1] = keep_record(record, model.laws.entry)
        self._step = communication_step(SPEED, made.settings.step)
        self._rows = np.zeros((round(4.0 * math.pi / SPEED / self._step), self.run.outputs.size))
        self._done = self.run.series(self._step, 1, self._rows)  # compiled, and past the start

    def cycle(self) -> float:
        """Processor seconds of the next one."""
        began = time.process_time()
        self._done += self.run.series(self._step, self._done + 1, self._rows)
        return time.process_time() - began

    @property
    def modes(self) -> int:
        """Of the crank."""
        return int(self.run.model.omega2.size)

    @property
    def ports(self) -> int:
        """Coordinates at which forces act."""
        return int(self.run.model.ports.shape[0])


def medians(cases: Sequence[Case], rounds: int) -> list[float]:
    """Median processor time of a cycle of each, which take turns."""
    taken = [[case.cycle() for case in cases] for _ in range(rounds)]
    return [statistics.median(each) for each in zip(*taken, strict=True)]


def fitted(sizes: Sequence[float], costs: Sequence[float]) -> dict[str, float | None]:
    """Exponent of cost ~ size^p with its standard error, and the RMS of what the line leaves of ln cost."""
    x, y = np.log(sizes), np.log(costs)
    if len(sizes) < 3:
        return {"exponent": float(np.polyfit(x, y, 1)[0]), "standard_error": None, "scatter": None}
    (slope, begin), covariance = np.polyfit(x, y, 1, cov=True)
    left = float(np.sqrt(np.mean((y - slope * x - begin) ** 2)))
    return {"exponent": float(slope), "standard_error": float(np.sqrt(covariance[0, 0])), "scatter": left}


def law(sizes: Sequence[float], costs: Sequence[float], **more: Any) -> dict[str, Any]:
    """Sizes, costs (s) and their law."""
    return {"sizes": list(sizes), "seconds": [float(f"{cost:.4g}") for cost in costs], **fitted(sizes, costs), **more}


def in_line(count: int) -> Engine:
    """An in-line engine of so many of the six's cylinders, which fire one after the other at even intervals."""
    six = load_engine("diesel_i6")
    crank, cylinders = six.crankshaft, six.cylinders
    between = 4.0 * math.pi / count
    shaft = replace(
        crank, throw_angles=tuple(-k * between % (2.0 * math.pi) for k in range(count)),
        counterweights=(True,) * (2 * count),
        main_widths=(crank.main_widths[0], *[crank.main_widths[1]] * (count - 1), crank.main_widths[-1]),
    )  # fmt: skip
    fired = replace(
        cylinders, firing_order=tuple(range(1, count + 1)), pins=tuple(range(1, count + 1)), bank_angles=(0.0,) * count
    )
    return replace(six, crankshaft=shaft, cylinders=fired, thrust=replace(six.thrust, main=count // 2 + 1), block=None)


def of_equal_modes(count: int, bearings: str) -> Assembly:
    """A beam crank of so many throws with nearly ``EQUAL_MODES`` modes."""
    engine, settings = in_line(count), Settings(crank="beam", bearings=bearings)
    whole = assemble(engine, settings, cutoff_hz=1e9, inherit=False)
    cutoffs = np.unique(whole.body.frequencies_hz[6:]) * (1.0 + 1e-6)
    low, high = 0, len(cutoffs) - 1
    while low < high:
        middle = (low + high) // 2
        if assemble(engine, settings, cutoff_hz=float(cutoffs[middle]), inherit=False).body.n_modes < EQUAL_MODES:
            low = middle + 1
        else:
            high = middle
    return assemble(engine, settings, cutoff_hz=float(cutoffs[low]), inherit=False)


def cycle_laws() -> dict[str, Any]:
    """Cost of a cycle against modes, ports, films and nodes of their grid."""
    six = load_engine("diesel_i6")
    solid = [Case(assemble(six, Settings(bearings="impedance"), cutoff_hz=cutoff)) for cutoff in CUTOFFS_HZ]
    modes = law([case.modes for case in solid], medians(solid, ROUNDS), ports=solid[0].ports)
    engines = [Case(of_equal_modes(count, "linear")) for count in CYLINDERS]
    numbers = [case.modes for case in engines]
    ports = law([case.ports for case in engines], medians(engines, ROUNDS), cylinders=CYLINDERS, modes=numbers)
    filmed = [Case(of_equal_modes(count, "reynolds")) for count in FILM_CYLINDERS]
    films = law([count + 1 for count in FILM_CYLINDERS], medians(filmed, DEAR_ROUNDS))
    made = assemble(six, Settings(crank="beam", bearings="reynolds"))
    gridded = [Case(made, grid) for grid in GRIDS]
    nodes = law([around * across for around, across in GRIDS], medians(gridded, DEAR_ROUNDS), grids=GRIDS)
    return {"modes": modes, "ports": ports, "films": films, "grid": nodes}


def run_up_laws() -> dict[str, Any]:
    """Cost of a run-up against its speeds and workers; a beam crank on impedance films, settled to 1e-3."""
    made = assemble(load_engine("diesel_i6"), Settings(crank="beam", bearings="impedance"))
    job = Job(made, None, 1e-3, 24.0, ("pulley.torsion",))

    def taken(count: int, workers: int) -> tuple[float, float, float]:
        """Processor and wall seconds, and cycles run."""
        speeds = run_up_speeds(FIRST_RPM, LAST_RPM, (LAST_RPM - FIRST_RPM) / (count - 1))
        with tempfile.TemporaryDirectory() as folder:
            before = spent()
            outcome = run_up(job, speeds, Path(folder) / "run-up.h5", Means(workers=workers), {})
            seconds = spent() - before
        assert outcome.run_up is not None
        return seconds, outcome.seconds, float(outcome.run_up.cycles.sum())

    taken(SPEED_COUNTS[0], 1)
    counts = [taken(count, 1) for count in SPEED_COUNTS]
    speeds = law(SPEED_COUNTS, [each[0] for each in counts], cycles=[each[2] for each in counts])
    both = [taken(RUN_UP_SPEEDS, workers) for workers in WORKER_COUNTS]
    workers = law(
        WORKER_COUNTS, [each[0] for each in both], wall_s=[each[1] for each in both], cycles=[b[2] for b in both]
    )
    return {"speeds": speeds, "workers": workers}


def new_structure() -> dict[str, Any]:
    """Making a solid crank anew, in a process with an empty cache."""
    code = (
        "import json; from benchmarks._variants import new_structure; from cranktrain.core import kernel; "
        "print('FOUND', json.dumps(new_structure(1)))"
    )
    with tempfile.TemporaryDirectory() as folder:
        paths = os.pathsep.join([str(ROOT), str(ROOT / "fmu_src")])
        variables = os.environ | {"CRANKTRAIN_CACHE": folder, "PYTHONPATH": paths}
        done = subprocess.run(
            [sys.executable, "-c", code], env=variables, stdout=subprocess.PIPE, text=True, check=True
        )
    return dict(json.loads(done.stdout.rpartition("FOUND ")[2]))


def variants() -> dict[str, Any]:
    """What a variant costs here and on a cluster, and what 10,000 would."""
    result: dict[str, Any] = {}
    for name in KINDS:
        run_variant(name, -1)
        found = [run_variant(name, number) for number in range(VARIANTS)]
        costs = [seconds for seconds, _ in found]
        row = {
            "variants": VARIANTS, "seconds": statistics.median(costs), "spread": statistics.stdev(costs),
            "cycles": statistics.mean(cycles for _, cycles in found),
        }  # fmt: skip
        try:
            row["cluster"] = on_cluster(name, VARIANTS, CLUSTER_WORKERS)
        except ImportError:
            row["cluster"] = {"absent": "needs distributed, of the extra dask"}
        result[name] = row
    result["structure"] = new_structure()
    return {"measured": result, "extrapolated": extrapolated(result)}


def extrapolated(found: Mapping[str, Any]) -> dict[str, dict[str, float | None]]:
    """Hours of 10,000 variants: N t/w on one machine, N t (1 + overhead)/w on a cluster of w workers.

    Overhead is what workers and scheduler need beyond the tasks, the same for each variant. New solid structures add
    their own t.
    """
    rows = {name: (found[name], found[name]["seconds"]) for name in KINDS}
    solid = found["solid, structure reused"]
    rows[NEW] = (solid, solid["seconds"] + found["structure"]["seconds"])
    hours = {}
    for name, (row, seconds) in rows.items():
        cluster = row["cluster"]
        overhead = None
        if "absent" not in cluster:
            extra = cluster["workers_s"] + cluster["scheduler_s"] - cluster["tasks_s"]
            overhead = max(extra, 0.0) / (VARIANTS * seconds)
        alone = MANY * seconds / 3600.0
        hours[name] = {
            "measured": 1 if name == NEW else VARIANTS,
            "seconds_each": seconds,
            "processor_hours": alone,
            "hours_on_one_machine_of_two": alone / 2.0,
            "overhead": overhead,
            "hours_on_a_cluster_of_two": None if overhead is None else alone * (1.0 + overhead) / 2.0,
            "hours_on_a_cluster_of_a_hundred": None if overhead is None else alone * (1.0 + overhead) / 100.0,
        }
    return hours


def main(*options: str) -> int:
    """Measure, draw and print."""
    say = lambda text: print(f"cost_law: {text}", file=sys.stderr, flush=True)  # noqa: E731
    say("cycles")
    found = cycle_laws()
    say("run-ups")
    found |= run_up_laws()
    say("variants")
    found["variants"] = variants()
    if options:
        draw(found, Path(options[0]))
    print(json.dumps(found, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
