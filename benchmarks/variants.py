"""Cost of variants: ``python benchmarks/variants.py [--torsional 400] [--solid 60] [--workers 1 2] [--engine NAME]``.

``torsional``: linear run-ups of 81 speeds with twist, damper heat and shaft stress; ``solid``: runs in time of the
solid crank at one speed, its body kept. For each number of workers wall seconds, milliseconds for a variant, seconds
for 10,000 (1,000) variants, and ``efficiency``, the time of one worker over that of w, divided by w. Models are made
and kernels loaded before the clock starts; a first short study warms them up. ``sobol_error`` is the largest error of
total indices above 0.1 of two masses against Gauss's quadrature, ``den_hartog_error`` that of the least amplification
for an inertia ratio of 1/20. Prints one JSON object.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.polynomial.legendre import leggauss

import cranktrain as ct
from cranktrain.core.typed_file import record
from cranktrain_lab.variants.running import Means, Outcome, run_variants
from cranktrain_lab.variants.study import study_of
from cranktrain_lab.variants.tables import StudyTable

SPEEDS = 81
SOBOL_ROWS = 4096
EVALUATIONS = 1500
SPANS = {"inertia_ratio": (0.15, 0.35), "frequency_ratio": (0.75, 0.95), "damping_ratio": (0.1, 0.3)}
FORCE = 0.9
POINTS = 24


def study(engine: Any, kind: str, count: int) -> Any:
    """A study of so many variants: tolerances of flywheel, pulley, rods and load, and of the ring of a damper."""
    low, high = (speed * 30.0 / math.pi for speed in engine.speeds)
    vary: dict[str, Any] = {
        key: {"distribution": "normal", "deviation": "1 %"}
        for key in ("flywheel.mass", "pulley.mass", "rod.big_end_mass")
    } | {"load": {"low": 0.95, "high": 1.05}}
    outputs = ["twist", "shaft.stress"]
    if engine.damper is not None:
        vary["damper.ring_inertia"], outputs = {"low": "-10 %", "high": "+10 %"}, [*outputs, "damper.heat"]
    table: dict[str, Any] = {"outputs": outputs, "vary": vary, "design": {"n": count}, "inherit": False}
    if kind == "torsional":
        table["speeds"] = {"from": low, "to": high, "points": SPEEDS}
    else:
        table |= {
            "crank": "solid",
            "speeds_rpm": [0.8 * high],
            "outputs": ["pulley.torsion", "largest bearing.force.y"],
        }
    return study_of(record(StudyTable, table), kind, engine=engine)


def seconds(asked: Any, workers: int) -> tuple[float, int]:
    """Wall seconds of a study without its preparation, and failed variants."""
    with tempfile.TemporaryDirectory() as folder:
        outcome = Outcome()
        run_variants(asked, Path(folder) / "variants", Means(workers=workers), outcome=outcome)
    return outcome.seconds - outcome.preparation, outcome.failed


def costs(engine: Any, kind: str, count: int, whole: int, workers: list[int]) -> dict[str, Any]:
    seconds(study(engine, kind, 2), 1)
    found: dict[str, Any] = {"variants": count}
    alone = 0.0
    for number in workers:
        taken, failed = seconds(study(engine, kind, count), number)
        alone = taken if number == 1 else alone
        found[f"workers_{number}"] = {
            "seconds": round(taken, 3), "ms_per_variant": round(1e3 * taken / count, 2),
            f"seconds_for_{whole}": round(taken / count * whole, 1), "failed": failed,
            **({"efficiency": round(alone / number / taken, 3)} if alone and number > 1 else {}),
        }  # fmt: skip
    return found


def amplitude(mu: Any, f: Any, zeta: Any) -> Any:
    fluid, g2 = (2.0 * zeta * FORCE) ** 2, FORCE**2
    below = fluid * (g2 - 1.0 + mu * g2) ** 2 + (mu * f**2 * g2 - (g2 - 1.0) * (g2 - f**2)) ** 2
    return np.sqrt((fluid + (g2 - f**2) ** 2) / below)


def total_indices() -> list[float]:
    """Total Sobol indices of the amplitude by quadrature."""
    x, w = leggauss(POINTS)
    x, w = 0.5 * (x + 1.0), 0.5 * w
    axes = [low + (high - low) * x for low, high in SPANS.values()]
    values = amplitude(*np.meshgrid(*axes, indexing="ij"))
    mean = np.einsum("i,j,k,ijk", w, w, w, values)
    variance = np.einsum("i,j,k,ijk", w, w, w, values**2) - mean**2
    found = []
    for k in range(3):
        rest = np.moveaxis(values, k, -1) @ w
        found.append(float(1.0 - (np.einsum("i,j,ij", w, w, rest**2) - mean**2) / variance))
    return found


def closed_forms() -> dict[str, float]:
    study = {key: ("uniform", *span) for key, span in SPANS.items()}
    names = list(SPANS)
    found = ct.vary(
        lambda v: {"amplitude": float(amplitude(*(v[name] for name in names)))}, study, outputs=["amplitude"],
        n=SOBOL_ROWS, method="sensitivity",
    ).sensitivities()["amplitude"]  # fmt: skip
    errors = [abs(one["total"] / exact - 1.0) for one, exact in zip(found, total_indices(), strict=True) if exact > 0.1]
    table = {
        "model": "two-mass", "outputs": ["amplification"],
        "vary": {"frequency_ratio": {"low": 0.5, "high": 1.5}, "damping_ratio": {"low": 0.01, "high": 1.0}},
        "derived": {"inertia_ratio": {"formula": "0.05 + 0 * damping_ratio"}},
        "optimize": {"minimize": "amplification", "evaluations": EVALUATIONS},
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        from cranktrain_lab.variants.optimum import find_optimum

        best = find_optimum(study_of(record(StudyTable, table), "two"), Path(folder) / "x", Means(workers=1))
    return {"sobol_error": max(errors), "den_hartog_error": best.outputs["amplification"] / math.sqrt(41.0) - 1.0}


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.partition(":")[0])
    parser.add_argument("--engine", default="diesel_i6")
    parser.add_argument("--torsional", type=int, default=400, metavar="N")
    parser.add_argument("--solid", type=int, default=60, metavar="N")
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    options = parser.parse_args()
    engine = ct.load_engine(options.engine)
    found: dict[str, Any] = {"engine": engine.name}
    if options.torsional:
        found["torsional"] = costs(engine, "torsional", options.torsional, 10_000, options.workers)
    if options.solid:
        found["solid"] = costs(engine, "solid", options.solid, 1000, options.workers)
    found |= closed_forms()
    found["largest_memory_mb"] = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0, 1)
    print(json.dumps(found, indent=2))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
