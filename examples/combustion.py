"""Run the combustion module of the six by itself: cylinder pressures at three speeds, and the torque with a misfire.

``python examples/combustion.py [PICTURE.png]`` prints the tables of docs/combustion.md and draws its picture. The
second table is the full load of both shipped engines.
"""

from __future__ import annotations

import math
import sys

import matplotlib
import numpy as np
from numpy.typing import NDArray

matplotlib.use("Agg")

import matplotlib.pyplot as plt

from cranktrain.modules.combustion.file import load
from cranktrain.modules.combustion.performance import performance
from cranktrain.modules.combustion.simulation import CombustionSimulation
from cranktrain.modules.register import module_files
from cranktrain.results.figures import save_figure

SPEEDS_RPM = (1000.0, 1500.0, 2000.0)
ENGINES = ("diesel_i6", "diesel_v8")
MISSING = 3
"""Cylinder without fuel in the run with a misfire."""
STEP = math.radians(0.5)


def cycle(speed_rpm: float, misfire: int = 0) -> dict[str, NDArray[np.float64]]:
    """Outputs of a settled cycle of the six from firing dead centre of cylinder 1 on, by name."""
    simulation = CombustionSimulation(load(module_files()["combustion_i6"]))
    speed = speed_rpm * math.pi / 30.0
    simulation.inputs[simulation.input_names.index("crank.speed")] = speed
    if misfire:
        simulation.inputs[simulation.input_names.index(f"cylinder[{misfire}].fuel_mass")] = 0.0
    simulation.initialize()
    rows = []
    for k in range(round(8.0 * math.pi / STEP)):
        simulation.step((k + 1) * STEP / speed)
        rows.append(simulation.outputs.copy())
    last = np.array(rows[len(rows) // 2 :])
    found = {name: last[:, k] for k, name in enumerate(simulation.output_names)}
    return {**found, "angle_deg": np.degrees(STEP) * np.arange(1, last.shape[0] + 1)}


def draw(
    path: str, runs: dict[float, dict[str, NDArray[np.float64]]], misfired: dict[str, NDArray[np.float64]]
) -> None:
    """Pressure of cylinder 1 about its firing dead centre, and torque over a cycle."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), constrained_layout=True)
    for speed, run in runs.items():
        angle = (run["angle_deg"] + 360.0) % 720.0 - 360.0
        order = np.argsort(angle)
        left.plot(angle[order], 1e-6 * run["cylinder[1].pressure"][order], label=f"{speed:.0f} rev/min")
    left.set(xlim=(-120, 150), xlabel="crank angle after firing dead centre / deg", ylabel="cylinder pressure / MPa")
    fastest = runs[SPEEDS_RPM[-1]]
    for run, label in ((fastest, "all cylinders fire"), (misfired, f"cylinder {MISSING} without fuel")):
        right.plot(run["angle_deg"], 1e-3 * run["indicated.torque"], lw=1, label=label)
    title = f"{SPEEDS_RPM[-1]:.0f} rev/min"
    right.set(
        xlim=(0, 720), ylim=(-1.6, 3.5), xlabel="crank angle / deg", ylabel="indicated torque / kN m", title=title
    )
    for ax in (left, right):
        ax.grid(alpha=0.3)
        ax.legend(frameon=False)
    save_figure(figure, path)


def full_load() -> None:
    """Print air, pressures and consumption of both engines at their fuel."""
    print(
        "\n| engine | speed / (rev/min) | air ratio | peak / compression pressure | BMEP / MPa | FMEP / MPa "
        "| torque / N m | BSFC / (g/kWh) |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for engine in ENGINES:
        settings = load(module_files()[engine.replace("diesel", "combustion")])
        for speed in SPEEDS_RPM:
            point = performance(settings, speed * math.pi / 30.0)
            print(
                f"| {engine} | {speed:.0f} | {point.air_ratio:.2f} | {point.peak_ratio:.2f} "
                f"| {1e-6 * point.brake_pressure:.2f} | {1e-6 * point.friction_pressure:.3f} "
                f"| {point.torque:.0f} | {3.6e9 * point.fuel_consumption:.0f} |"
            )


def main(picture: str = "") -> float:
    """Print the tables, draw the picture; returns the peak pressure at the last speed, Pa."""
    runs = {speed: cycle(speed) for speed in SPEEDS_RPM}
    print(
        "| speed / (rev/min) | peak / MPa | at / deg | IMEP / MPa | torque / N m | delay / ms | heat to the walls / % |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for speed, run in runs.items():
        of = {name: float(values[-1]) for name, values in run.items()}
        print(
            f"| {speed:.0f} | {1e-6 * of['cylinder[1].pressure_peak']:.2f} "
            f"| {math.degrees(of['cylinder[1].peak_angle']):.1f} | {1e-6 * of['indicated.pressure_mean']:.3f} "
            f"| {of['indicated.torque_mean']:.0f} | {1e3 * of['cylinder[1].ignition_delay']:.3f} "
            f"| {100.0 * of['cylinder[1].wall_heat'] / of['cylinder[1].heat_released']:.1f} |"
        )
    full_load()
    if picture:
        draw(picture, runs, cycle(SPEEDS_RPM[-1], MISSING))
    return float(runs[SPEEDS_RPM[-1]]["cylinder[1].pressure_peak"][-1])


if __name__ == "__main__":
    main(*sys.argv[1:2])
