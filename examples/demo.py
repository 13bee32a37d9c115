"""The whole chain in one run: engine file → finite elements → reduced body → FMU → fmpy → pictures in ``out/``.

Started by ``make demo``; ``python examples/demo.py [ENGINE]`` does the same in an environment where cranktrain is
installed.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")

import fmpy
import matplotlib.pyplot as plt

from cranktrain.core import machine_code
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.results import plots
from cranktrain.results.figures import save_figure
from cranktrain.results.orders.harmonics import last_cycle, order_spectrum
from cranktrain.results.pictures.files import save_picture
from cranktrain.results.pictures.modes import mode_picture
from cranktrain.results.tables import frequency_tables
from cranktrain.structure.crank.critical_speeds import critical_speeds
from cranktrain.structure.crank.modal import modal_report
from cranktrain.structure.crank.reduction import complete_crankshaft, reduced_crankshaft

ROOT = Path(__file__).resolve().parents[1]
SPEED_RPM = 2000.0
STOP_TIME = 0.5
COMMUNICATION_STEP = math.radians(2.5) / (SPEED_RPM * math.pi / 30.0)  # s, one internal step
STARTED = time.perf_counter()


def main(name: str = "diesel_i6", out: Path = Path("out")) -> dict[str, Any]:
    """Run all stages and say where the results are; returns what ``summary.json`` holds."""
    out.mkdir(exist_ok=True)
    engine = load_engine(name)
    # What the FMU is to run on is compiled beside the finite elements, the first time.
    compiling = subprocess.Popen([sys.executable, "-m", "cranktrain.fmu.native", "--package", "--kind", "cranktrain"])
    if __name__ == "__main__" and hasattr(os, "nice"):
        os.nice(10)  # what takes longest goes first; who imports this keeps the priority of its process
    try:
        say("engine file read; reducing its crankshaft (finite elements, about a minute the first time)")
        bare = reduced_crankshaft(engine, progress=say)
        say("frequencies and mode shapes")
        report = modal_report(engine, bare)
        report["critical_speeds"] = critical_speeds(engine, complete_crankshaft(engine, bare))
        draw_frequencies(engine, report, out)
        shape = mode_picture(engine, bare, "torsional", free=True)
        save_picture(out / "first_torsional_mode.png", shape, shape.enlargement)
        if compiling.poll() is None:
            say("waiting for the kernels' machine code")
            compiling.wait()
    finally:
        compiling.terminate()  # where something failed; else it has ended
    machine_code.library.cache_clear()  # there was none when this process first looked
    say("building the FMU")
    fmu = built_fmu(engine)
    say(f"fmpy runs {fmu.name}: {STOP_TIME:g} s at {SPEED_RPM:g} rev/min")
    series, factor = simulated(fmu)
    summary = draw_pulley(engine, series, out)
    draw_loads(engine, series, out)
    summary["real_time_factor"] = factor
    summary["first_torsional_hz"] = report["cranktrain"]["first_torsional_hz"]
    (out / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    say(f"real-time factor {factor:.2f} (wall seconds per simulated second, through fmpy)")
    say("done; look into " + ", ".join(str(path) for path in sorted(out.iterdir())))
    return summary


def say(text: str) -> None:
    """Print a line of progress with the seconds since the start."""
    print(f"[{time.perf_counter() - STARTED:6.1f} s] {text}", flush=True)


def draw_frequencies(engine: Engine, report: dict[str, Any], out: Path) -> None:
    """Tables of our frequencies beside the reference's, as a picture and as text."""
    tables = frequency_tables(engine, report)
    lines = []
    heights = [1 + len(table.rows) for table in tables]
    figure, axes = plt.subplots(
        len(tables), 1, figsize=(9.5, 0.27 * sum(heights) + 1.6), height_ratios=heights, constrained_layout=True
    )
    for ax, table in zip(axes, tables, strict=True):
        plots.plot_table(ax, table.header, table.rows, table.title)
        widths = [max(map(len, column)) for column in zip(table.header, *table.rows, strict=True)]
        lines += [
            table.title,
            *("  ".join(c.rjust(w) for c, w in zip(row, widths, strict=True)) for row in (table.header, *table.rows)),
            "",
        ]
    save(figure, out / "frequencies.png")
    (out / "frequencies.txt").write_text("\n".join(lines), encoding="utf-8")


def built_fmu(engine: Engine) -> Path:
    """Path of the engine's FMU, built by the command that users give, without the levels that take minutes to make."""
    command = [sys.executable, str(ROOT / "build_fmu.py"), engine.name, "-o", "out", "--levels", "basic"]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    return Path(done.stdout.strip().splitlines()[-1])


def simulated(fmu: Path) -> tuple[Any, float]:
    """Outputs of the FMU in fmpy, and wall seconds per simulated second of its steps (start and compilation aside)."""
    clock: list[tuple[float, float]] = []

    def stepped(now: float, _: Any) -> bool:
        clock.append((now, time.perf_counter()))
        return True

    loads = [f"bearing[{i}].force.{axis}" for i in range(1, 8) for axis in "xy"]
    series = fmpy.simulate_fmu(
        str(fmu),
        stop_time=STOP_TIME,
        output_interval=COMMUNICATION_STEP,
        start_values={"speed": SPEED_RPM * math.pi / 30.0},
        output=["crank.angle", "pulley.torsion", "pulley.axial", *loads],
        step_finished=stepped,
    )
    (first, began), (last, ended) = clock[0], clock[-1]
    return series, (ended - began) / (last - first)


def draw_pulley(engine: Engine, series: Any, out: Path) -> dict[str, Any]:
    """Pulley torsion and axial displacement over the last cycle with their orders; returns their numbers."""
    figure, axes = plt.subplots(2, 2, figsize=(12, 7.5), constrained_layout=True)
    summary: dict[str, Any] = {}
    motions = (
        ("pulley.torsion", 180.0 / math.pi, "pulley torsion", "deg"),
        ("pulley.axial", 1e6, "pulley axial displacement", "µm"),
    )
    for row, (name, scale, quantity, unit) in zip(axes, motions, strict=True):
        cycle = scale * last_cycle(series["crank.angle"], series[name])
        orders, amplitudes = order_spectrum(cycle, 12.0)
        plots.plot_cycle(row[0], cycle, quantity, unit)
        plots.plot_orders(row[1], orders, amplitudes, quantity, unit)
        key = f"{name.replace('.', '_')}_{'deg' if unit == 'deg' else 'um'}"
        summary[key] = {
            "peak_to_peak": float(np.ptp(cycle)),
            "orders": [[float(o), float(a)] for o, a in zip(orders, amplitudes, strict=True)],
        }
    figure.suptitle(f"{engine.title} at {SPEED_RPM:g} rev/min, full load, oil films; FMU run by fmpy", fontsize=12)
    save(figure, out / "pulley.png")
    return summary


def draw_loads(engine: Engine, series: Any, out: Path) -> None:
    """Gas trace and main bearing loads of the run."""
    trace = GasTrace.from_engine(engine)
    figure, axes = plt.subplots(2, 4, figsize=(15, 7.5), constrained_layout=True)
    plots.plot_pressure(axes[0, 0], np.degrees(trace.angles), {"fired": trace.fired, "motored": trace.motored})
    axes[0, 0].set_title("built-in gas trace, full load", fontsize=10, loc="left")
    for i, ax in enumerate(axes.flat[1:], start=1):
        forces = (last_cycle(series["crank.angle"], series[f"bearing[{i}].force.{axis}"]) for axis in "xy")
        plots.plot_bearing_load(ax, *forces, f"oil film force on main journal {i}")
    figure.suptitle(f"{engine.title} at {SPEED_RPM:g} rev/min: loads over the last cycle", fontsize=12)
    save(figure, out / "loads.png")


def save(figure: Any, path: Path) -> None:
    """Write a figure and close it."""
    save_figure(figure, path)
    plt.close(figure)


if __name__ == "__main__":
    main(*sys.argv[1:2])
