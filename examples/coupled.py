"""Run the coupled six from Python: both FMUs under the reference master, pressures, torsion and its orders.

``python examples/coupled.py [PICTURE.png]`` builds the FMUs of cranktrain and combustion, runs ten cycles at
2000 rev/min with steps of 1 degree, Gauss-Seidel, and prints the summary of the last one. ``cranktrain couple
--no-valvetrain`` does the same from the command line.
"""

from __future__ import annotations

import math
import sys
import tempfile
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")

import matplotlib.pyplot as plt

import cranktrain as ct
from cranktrain.results import plots
from cranktrain.results.figures import save_figure
from cranktrain.results.orders.harmonics import last_cycle, order_spectrum
from cranktrain_lab.coupling.run import Coupled, Steps, run
from cranktrain_lab.coupling.virtual_engine import Partners, summary, virtual_engine

SPEED = 2000.0 * math.pi / 30.0
STEP = math.radians(1.0) / SPEED


def coupled(cranktrain: Path, combustion: Path, cycles: int = 10) -> Coupled:
    """Run two FMUs at the levels that they start with."""
    engine = virtual_engine(Partners(cranktrain, combustion, {}), SPEED, "gauss-seidel", "own")
    master = engine.master()
    try:
        master.initialize()
        return run(master, cycles * 4.0 * math.pi / SPEED, Steps(STEP), engine.bonds)
    finally:
        master.close()


def built(folder: Path) -> tuple[Path, Path]:
    """FMUs of cranktrain and combustion, without the levels that take minutes to make."""
    return ct.build_fmu("diesel_i6", folder, film_table=False, block=False), ct.build_fmu("combustion_i6", folder)


def draw(path: str, found: Coupled) -> None:
    """Pressures of all cylinders, torsion of the pulley over the last cycle, and its orders."""
    figure, (gas, motion, lines) = plt.subplots(1, 3, figsize=(14, 4), constrained_layout=True)
    angle = found.of("cranktrain.crank.angle")
    for c in range(1, 7):
        cycle = last_cycle(angle, found.of(f"combustion.cylinder[{c}].pressure"))
        gas.plot(np.linspace(0.0, 720.0, len(cycle), endpoint=False), 1e-6 * cycle, lw=1, label=f"cylinder {c}")
    gas.set(xlim=(0, 720), ylim=(0, 18), xlabel="crank angle / deg", ylabel="pressure / MPa")
    gas.legend(frameon=False, fontsize=8, ncols=3, loc="upper center")
    gas.grid(alpha=0.3)
    torsion = np.degrees(last_cycle(angle, found.of("cranktrain.pulley.torsion")))
    plots.plot_cycle(motion, torsion, "pulley torsion", "deg")
    plots.plot_orders(lines, *order_spectrum(torsion, 12.0), "pulley torsion", "deg")
    figure.suptitle("Coupled six at 2000 rev/min, 1 degree, Gauss–Seidel", fontsize=12)
    save_figure(figure, path)
    plt.close(figure)


def main(picture: str = "", fmus: tuple[Path, Path] | None = None, cycles: int = 10) -> dict[str, Any]:
    """Run, draw and print; returns the summary of the last cycle."""
    with tempfile.TemporaryDirectory() as folder:
        found = coupled(*(fmus or built(Path(folder))), cycles)
    told = summary(found, SPEED)
    print(
        f"pulley torsion {told['pulley']['torsion_deg']['peak_to_peak']:.3f} deg peak to peak, "
        f"IMEP {1e-5 * told['imep_pa']:.2f} bar, indicated torque {told['indicated_torque_nm']:.0f} N m"
    )
    if picture:
        draw(picture, found)
    return told


if __name__ == "__main__":
    main(*sys.argv[1:2])
