"""The V8's FMU with and without its torsional damper: ``python examples/fmu_v8.py [FILE.fmu] [-o FOLDER]``.

FMPy runs the FMU twice at a speed where order 8 of the gas meets the crank's first torsional mode, and a picture shows
the pulley's torsion over the last cycle with its orders. Without a file the FMU is built into ``dist/``, which takes
some minutes the first time: crankshaft and block in finite elements.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")

import fmpy
import matplotlib.pyplot as plt

from cranktrain.results.figures import save_figure
from cranktrain.results.orders.harmonics import last_cycle, order_spectrum

ROOT = Path(__file__).resolve().parents[1]
SPEED_RPM = 2284.0  # where order 8 is largest on ground (benchmarks/damper.py); in the block torsion is at 296 Hz
CYCLES = 10
STEP = 1e-4  # s, 1.3 degrees of crank angle
HIGHEST_ORDER = 16.0
COLOURS = {"none": "#c44e52", "fitted": "#1f5fa8"}
LABELS = {"none": "without damper", "fitted": "with viscous damper"}


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Run both and draw the picture; returns the torsion of order 8 without and with damper, degrees."""
    parser = argparse.ArgumentParser(description="The V8's pulley torsion with and without damper.")
    parser.add_argument("fmu", nargs="?", help="CranktrainDieselV8.fmu; built where not given")
    parser.add_argument("-o", "--output", default="out", metavar="FOLDER", help="where the picture goes (default: out)")
    chosen = parser.parse_args(arguments)
    fmu = Path(chosen.fmu) if chosen.fmu else built_fmu()
    if not fmu.is_file():
        sys.exit(f"fmu_v8: no file '{fmu}'; python build_fmu.py diesel_v8 makes one")
    runs = {level: simulated(fmu, level) for level in LABELS}
    folder = Path(chosen.output)
    folder.mkdir(parents=True, exist_ok=True)
    picture = folder / "v8_damper.png"
    found = draw(runs, picture)
    print(picture)
    return found


def built_fmu() -> Path:
    """Path of the FMU, built by the command that users give."""
    command = [sys.executable, str(ROOT / "build_fmu.py"), "diesel_v8", "-o", "dist"]
    return Path(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()[-1])


def simulated(fmu: Path, damper: str) -> Any:
    """Time series of one run from the engine's start at speed."""
    begin = time.perf_counter()
    result = fmpy.simulate_fmu(
        str(fmu),
        start_values={"speed": SPEED_RPM * math.pi / 30.0, "block.level": "ground", "damper.level": damper},
        output=["crank.angle", "pulley.torsion", "damper.heat", "damper.temperature"],
        output_interval=STEP,
        stop_time=CYCLES * 120.0 / SPEED_RPM,
    )
    print(f"{LABELS[damper]}: {time.perf_counter() - begin:.1f} s, kernels' compilation included")
    return result


def draw(runs: dict[str, Any], picture: Path) -> dict[str, float]:
    """Torsion over the last cycle, its orders, and what the damper turns into heat; order 8 of each run."""
    found = {}
    figure, (cycle, spectrum) = plt.subplots(2, 1, figsize=(10, 7.5), constrained_layout=True)
    for place, (level, run) in enumerate(runs.items()):
        torsion = np.degrees(last_cycle(run["crank.angle"], run["pulley.torsion"]))
        alternating = torsion - torsion.mean()
        label = f"{LABELS[level]}: {np.ptp(torsion):.3f} deg peak to peak"
        if level == "fitted":
            heat = last_cycle(run["crank.angle"], run["damper.heat"]).mean()
            label += f"; damper at {run['damper.temperature'][-1] - 273.15:.0f} °C turns {heat:.0f} W into heat"
        angles = np.arange(alternating.size) * (720.0 / alternating.size)
        cycle.plot(angles, alternating, color=COLOURS[level], lw=1.5, label=label)
        orders, amplitudes = order_spectrum(torsion, HIGHEST_ORDER)
        spectrum.bar(orders + 0.2 * (place - 0.5), amplitudes, width=0.2, color=COLOURS[level], label=LABELS[level])
        found[level] = float(amplitudes[15])
        named = ", ".join(f"order {order}: {amplitudes[2 * order - 1]:.4f} deg" for order in (4, 8, 12))
        print(f"{label}; {named}")
    cycle.set(
        xlim=(0, 720), xticks=np.arange(0, 721, 90), xlabel="crank angle over the last cycle / deg",
        ylabel="alternating pulley torsion / deg", title=f"Pulley of the V8 at {SPEED_RPM:g} rev/min, full load",
    )  # fmt: skip
    spectrum.set(
        xlim=(0, HIGHEST_ORDER + 0.5), xticks=np.arange(0, HIGHEST_ORDER + 0.1, 1.0),
        xlabel="order / oscillations per revolution", ylabel="pulley torsion, zero to peak / deg",
    )  # fmt: skip
    for ax in (cycle, spectrum):
        ax.grid(alpha=0.25)
        ax.legend(frameon=False, loc="upper right")
    cycle.margins(y=0.25)
    save_figure(figure, picture)
    plt.close(figure)
    return found


if __name__ == "__main__":
    main()
