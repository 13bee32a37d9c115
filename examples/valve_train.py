"""Run the valve train of the six by itself: figures over the speed, and lift and cam force below and above its limit.

``python examples/valve_train.py [PICTURE.png [ICON.png]]`` prints the table of docs/valve_train.md and draws its
picture, and the small one that the FMU carries.
"""

from __future__ import annotations

import math
import sys

import matplotlib
import numpy as np
from numpy.typing import NDArray

matplotlib.use("Agg")

import matplotlib.pyplot as plt

from cranktrain.modules.register import module_files
from cranktrain.modules.valve_train.file import load
from cranktrain.modules.valve_train.simulation import ValveTrainSimulation
from cranktrain.results.figures import save_figure

SPEEDS_RPM = (1000.0, 2000.0, 2300.0, 3000.0, 3200.0, 3500.0, 3800.0)
SHOWN_RPM = (2000.0, 3800.0)
STEP = math.radians(0.5)
Run = dict[str, NDArray[np.float64]]


def cycle(speed_rpm: float) -> Run:
    """Outputs of a settled cycle of the six, by name."""
    simulation = ValveTrainSimulation(load(module_files()["valvetrain_i6"]))
    speed = speed_rpm * math.pi / 30.0
    simulation.inputs[simulation.input_names.index("crank.speed")] = speed
    simulation.initialize()
    rows = []
    for k in range(round(8.0 * math.pi / STEP)):
        simulation.step((k + 1) * STEP / speed)
        rows.append(simulation.outputs.copy())
    last = np.array(rows[len(rows) // 2 :])
    found = {name: last[:, k] for k, name in enumerate(simulation.output_names)}
    return {**found, "angle_deg": np.degrees(STEP) * np.arange(1, last.shape[0] + 1)}


def table(runs: dict[float, Run]) -> str:
    """Markdown of the runs' figures; of lines the worst."""
    header = (
        "speed / (rev/min)", "mean torque / N m", "torque / N m", "cam force / kN", "cam pressure / MPa",
        "seating / (m/s)", "contact lost / %", "bounce / mm", "drive apart / %",
    )  # fmt: skip
    lines = ["| " + " | ".join(header) + " |", "|" + " --- |" * len(header)]
    for speed, run in runs.items():

        def worst(name: str, run: Run = run) -> float:
            return max(float(values.max()) for key, values in run.items() if key.endswith(name))

        torque = run["valvetrain.torque"]
        cells = (
            f"{speed:.0f}", f"{torque.mean():.1f}", f"{torque.min():.0f} to {torque.max():.0f}",
            f"{1e-3 * worst('_cam_force'):.1f}", f"{1e-6 * worst('_cam_pressure'):.0f}",
            f"{worst('_seating_velocity'):.2f}", f"{100.0 * run['contact.loss'][-1]:.1f}",
            f"{1e3 * worst('_bounce'):.2f}", f"{100.0 * run['drive.apart'][-1]:.0f}",
        )  # fmt: skip
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def draw(path: str, runs: dict[float, Run]) -> None:
    """Lift and force of an intake cam, and the torque on the crank over a cycle."""
    figure, axes = plt.subplots(3, 1, figsize=(9, 8.5), sharex=True, constrained_layout=True)
    for speed in SHOWN_RPM:
        run, label = runs[speed], f"{speed:.0f} rev/min"
        for ax, name, factor in (
            (axes[0], "cylinder[1].intake_lift", 1e3), (axes[1], "cylinder[1].intake_cam_force", 1e-3),
            (axes[2], "valvetrain.torque", 1.0),
        ):  # fmt: skip
            ax.plot(run["angle_deg"], factor * run[name], lw=1, label=label)
    for ax, text in zip(axes, ("intake lift / mm", "cam force / kN", "torque on the crank / N m"), strict=True):
        ax.set(ylabel=text, xlim=(0, 720))
        ax.grid(alpha=0.3)
    axes[0].legend(frameon=False)
    axes[-1].set(xlabel="crank angle / deg")
    save_figure(figure, path)


def draw_icon(path: str, run: Run) -> None:
    """Lifts of cylinder 1 alone."""
    figure, ax = plt.subplots(figsize=(2.0, 1.5), constrained_layout=True)
    for kind in ("intake", "exhaust"):
        ax.plot(run["angle_deg"], 1e3 * run[f"cylinder[1].{kind}_lift"], lw=2)
    ax.set(xticks=[], yticks=[], title="valve lifts")
    save_figure(figure, path)


def main(picture: str = "", icon: str = "") -> float:
    """Print the table, draw the pictures; returns the mean torque at 2000 rev/min, N m."""
    runs = {speed: cycle(speed) for speed in SPEEDS_RPM}
    print(table(runs))
    if picture:
        draw(picture, runs)
    if icon:
        draw_icon(icon, runs[SHOWN_RPM[0]])
    return float(runs[2000.0]["valvetrain.torque"].mean())


if __name__ == "__main__":
    main(*sys.argv[1:3])
