"""A system test of the virtual engine: scenarios of harness.toml, and torsion with and without misfire as a picture.

``python examples/harness.py [PICTURE.png]`` builds the FMUs and runs five scenarios, half a minute once kernels are
compiled; result files and report go into ``harness_results``.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from cranktrain.cli.main import main as cranktrain
from cranktrain.results.figures import save_figure
from cranktrain.results.orders.harmonics import last_cycle, order_spectrum
from cranktrain.results.plots import BLUE, ORANGE
from cranktrain.store.hdf5 import read_result

FILE = Path(__file__).with_suffix(".toml")
SHOWN = {"normal": BLUE, "misfire": ORANGE}
HIGHEST = 6.0


def main(picture: str = "harness.png", folder: str = "harness_results") -> float:
    """Run and draw; returns by how much the misfire raises order 0.5."""
    code = cranktrain(["harness", str(FILE), "--output", folder, "--html", f"{folder}/report.html"])
    if code:
        raise SystemExit(code)
    figure = Figure(figsize=(11.0, 3.8), dpi=120, layout="constrained")
    over_angle, over_order = figure.subplots(1, 2)
    amplitudes = {}
    for k, (name, colour) in enumerate(SHOWN.items()):
        data, _ = read_result(Path(folder) / f"{name}.h5")
        cycle = last_cycle(data["cranktrain/crank.angle"][0], np.degrees(data["cranktrain/pulley.torsion"][0]))
        orders, amplitudes[name] = order_spectrum(cycle, HIGHEST)
        over_angle.plot(np.arange(cycle.size) * 720.0 / cycle.size, cycle, color=colour, lw=1.5, label=name)
        over_order.bar(orders + (k - 0.5) * 0.18, amplitudes[name], width=0.18, color=colour, label=name)
    over_angle.set(xlim=(0, 720), xticks=range(0, 721, 120), xlabel="angle over the last cycle / deg")
    over_angle.set_ylabel("pulley torsion / deg")
    over_order.set(yscale="log", xlabel="order / oscillations per revolution", xticks=np.arange(1.0, HIGHEST + 0.1))
    over_order.set_ylabel("pulley torsion, zero to peak / deg")
    for ax in (over_angle, over_order):
        ax.grid(alpha=0.25)
        ax.legend(frameon=False, fontsize=9)
    figure.suptitle("In-line six at 2000 rev/min, all cylinders and without fuel in cylinder 1", fontsize=11)
    save_figure(figure, picture)
    rise = float(amplitudes["misfire"][0] / amplitudes["normal"][0])
    assert math.isfinite(rise)
    print(f"order 0.5 rises {rise:.1f}-fold; report: {folder}/report.html, picture: {picture}")
    return rise


if __name__ == "__main__":
    main(*sys.argv[1:])
