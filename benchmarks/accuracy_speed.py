"""Error against cost of every integrator on the real engine: ``python benchmarks/accuracy_speed.py``.

2000 rev/min, solid crank, six cycles, impedance and linear bearings. Prints one JSON object and draws
out/accuracy_speed.png. Real-time factors are seconds per simulated second, medians over interleaved repeats, from the
processor's clock; the wall's stand beside them.
"""

from __future__ import annotations

import json
import math
import os
import sys
from functools import partial
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from _engine_run import QUANTITIES, engine_and_body, errors, interleaved, reference, run
from matplotlib.ticker import NullFormatter

from cranktrain.dynamics.model import Settings, resolved

OUT = Path(__file__).resolve().parents[1] / "out"
REPEATS = 3
LADDERS = {
    "sdirk4": (6.0, 4.0, 3.0, 2.0, 1.0, 0.5),
    "sdirk3": (4.0, 3.0, 2.0, 1.0, 0.5),
    "sdirk2": (3.0, 2.0, 1.0, 0.5, 0.25),
    "tr-bdf2": (3.0, 2.0, 1.0, 0.5, 0.25),
    "generalised-alpha:0.6": (2.0, 1.0, 0.5, 0.25, 0.125),
    "generalised-alpha:0.8": (2.0, 1.0, 0.5, 0.25, 0.125),
    "backward-euler": (0.5, 0.25, 0.125),
}
MARKS = ("o", "s", "^", "v", "D", "P", "x")


def measure() -> dict[str, Any]:
    """Every method at every step, on both bearing levels."""
    engine, body = engine_and_body()
    result: dict[str, Any] = {"speed_rpm": 2000, "cycles": 6, "modes": body.n_modes, "quantities": QUANTITIES}
    default = Settings()
    for bearings in ("impedance", "linear"):
        print(f"accuracy_speed: {bearings} bearings", file=sys.stderr, flush=True)
        exact, doubt = reference(engine, body, bearings)
        ladder = [(name, deg) for name, steps in LADDERS.items() for deg in steps]
        own = (resolved(default).integrator, round(math.degrees(default.step), 9))
        if own not in ladder:
            ladder.append(own)
        cases = [
            partial(run, engine, body, Settings(bearings=bearings, integrator=name, step=math.radians(deg)))
            for name, deg in ladder
        ]
        rows = []
        for (name, deg), (got, process, wall) in zip(ladder, interleaved(cases, REPEATS), strict=True):
            torsion, axial = errors(got.values, got.interval_deg, exact)
            row = {
                "integrator": name,
                "step_deg": deg,
                "torsion_error": float(torsion),
                "axial_error": float(axial),
                "real_time_factor": process,
                "wall_real_time_factor": wall,
                "iterations_per_stage": float(got.counters[2] / got.counters[1]),
                "rejected_steps": int(got.counters[3]),
            }
            rows.append(row)
            if (name, deg) == own:
                result[f"default_{bearings}"] = row
        result[bearings] = {"reference_doubt": doubt.tolist(), "runs": rows}
    return result


def draw(result: dict[str, Any], path: Path) -> None:
    """Chart of both errors over the real-time factor, one column per bearing level."""
    figure, axes = plt.subplots(2, 2, figsize=(11.0, 8.4), sharex=True, sharey=True, layout="constrained")
    for column, bearings in enumerate(("impedance", "linear")):
        for row, (key, quantity) in enumerate((("torsion_error", "torsion"), ("axial_error", "axial motion"))):
            ax = axes[row, column]
            for mark, name in zip(MARKS, LADDERS, strict=True):
                runs = [r for r in result[bearings]["runs"] if r["integrator"] == name]
                runs.sort(key=lambda r: -r["step_deg"])
                x, y = [r["real_time_factor"] for r in runs], [r[key] for r in runs]
                ax.loglog(x, y, marker=mark, lw=1.2, ms=5, label=name)
                for r, a, b in ((runs[0], x[0], y[0]), (runs[-1], x[-1], y[-1])):
                    ax.annotate(
                        f"{r['step_deg']:g}°",
                        (a, b),
                        textcoords="offset points",
                        xytext=(4, 4),
                        fontsize=7,
                        color="#555",
                    )
            own = result[f"default_{bearings}"]
            ax.plot(own["real_time_factor"], own[key], "o", ms=14, mfc="none", mec="black", label="default", ls="none")
            ax.axhline(3e-3, color="#8a8f98", lw=0.8, ls="--")
            ax.grid(which="both", alpha=0.2)
            ax.set_title(f"pulley {quantity}, {bearings} bearings", fontsize=10, loc="left")
            if column == 0:
                ax.set_ylabel("relative error, RMS over the last cycle / 1")
            if row == 1:
                ax.set_xlabel("real-time factor: processor s per simulated s / 1")
    axes[1, 0].xaxis.set_minor_formatter(NullFormatter())
    axes[1, 0].set_xticks([0.1, 0.2, 0.3, 0.5, 1.0, 2.0], ["0.1", "0.2", "0.3", "0.5", "1", "2"])
    axes[0, 0].legend(fontsize=7, frameon=False)
    path.parent.mkdir(exist_ok=True)
    temporary = path.with_name(f".{path.name}")
    figure.savefig(temporary, dpi=130, format="png")
    os.replace(temporary, path)


def main() -> int:
    """Measure, draw, print."""
    result = measure()
    path = OUT / "accuracy_speed.png"
    draw(result, path)
    print(json.dumps({**result, "chart": str(path.relative_to(OUT.parent))}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
