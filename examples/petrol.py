"""Run the spark-ignition combustion of the petrol four by itself: load by throttle, mixture, speed, and the spark.

``python examples/petrol.py [PICTURE.png]`` prints a table of docs/combustion.md and draws its picture.
"""

from __future__ import annotations

import math
import sys
from dataclasses import replace

import matplotlib
import numpy as np

matplotlib.use("Agg")

import matplotlib.pyplot as plt

from cranktrain.modules.combustion.file import load
from cranktrain.modules.combustion.performance import STEP, mean_pressure, performance, settled_cycle
from cranktrain.modules.combustion.settings import CycleSettings
from cranktrain.modules.register import module_files
from cranktrain.results.figures import save_figure

RPM = math.pi / 30.0
SPEED = 3000.0 * RPM
ATMOSPHERE = {"exhaust_pressure": 1.05e5}
CASES = {
    "rated speed": (5100.0 * RPM, {}),
    "full load": (SPEED, {}),
    "not charged": (SPEED, {"intake_pressure": 1.0e5, **ATMOSPHERE}),
    "throttled": (SPEED, {"intake_pressure": 0.5e5, **ATMOSPHERE}),
    "throttled, rich": (SPEED, {"intake_pressure": 0.5e5, "air_ratio": 0.87, **ATMOSPHERE}),
    "throttled, lean": (SPEED, {"intake_pressure": 0.5e5, "air_ratio": 1.25, **ATMOSPHERE}),
    "throttled, 15 % exhaust gas": (SPEED, {"intake_pressure": 0.5e5, "intake_share": 0.15, **ATMOSPHERE}),
    "idle": (900.0 * RPM, {"intake_pressure": 0.32e5, **ATMOSPHERE}),
}
"""Speed, rad/s, and changes of the settings."""
DRAWN = ("full load", "not charged", "throttled", "throttled, lean")
SPARKS_DEG = np.arange(-45.0, 1.0, 5.0)


def settings(case: str) -> CycleSettings:
    """The four's combustion in a case."""
    return replace(load(module_files()["combustion_four"]), **CASES[case][1])


def draw(path: str) -> None:
    """Pressure of a cylinder in some cases, and mean pressure over the spark's angle."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), constrained_layout=True)
    for case in DRAWN:
        speed = CASES[case][0]
        pressure = settled_cycle(settings(case), speed)["cylinder[1].pressure"]
        angle = (math.degrees(STEP) * np.arange(1, pressure.size + 1) + 360.0) % 720.0 - 360.0
        order = np.argsort(angle)
        left.plot(angle[order], 1e-6 * pressure[order], label=case)
        found = [mean_pressure(replace(settings(case), injection_angle=math.radians(a)), speed) for a in SPARKS_DEG]
        right.plot(SPARKS_DEG, np.array(found) / max(found), label=case)
    left.set(xlim=(-120, 150), xlabel="crank angle after firing dead centre / deg", ylabel="cylinder pressure / MPa")
    right.set(
        ylim=(0.7, 1.01),
        xlabel="spark after firing dead centre / deg",
        ylabel="mean effective pressure over its largest",
    )
    for ax in (left, right):
        ax.grid(alpha=0.3)
        ax.legend(frameon=False)
    save_figure(figure, path)


def main(picture: str = "") -> float:
    """Print the table, draw the picture; returns the peak pressure at rated speed, Pa."""
    print("| case | speed / (rev/min) | intake / bar | lambda | residual / % | burn / deg | peak / MPa | at / deg "
          "| IMEP / MPa | g/kWh, indicated |")  # fmt: skip
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for case, (speed, _) in CASES.items():
        own, row = settings(case), settled_cycle(settings(case), speed)
        of = {name: float(values[-1]) for name, values in row.items()}
        spark = round((own.injection_angle + 4.0 * math.pi) / STEP) - 1
        point = performance(own, speed)
        work = point.fuel_consumption * point.brake_pressure / point.indicated_pressure
        print(
            f"| {case} | {speed / RPM:.0f} | {1e-5 * own.intake_pressure:.2f} | {own.air_ratio:g} "
            f"| {100.0 * row['cylinder[1].products'][spark]:.1f} | {math.degrees(of['cylinder[1].burn_duration']):.0f} "
            f"| {1e-6 * point.peak_pressure:.2f} | {math.degrees(point.peak_angle):.1f} "
            f"| {1e-6 * point.indicated_pressure:.3f} | {3.6e9 * work:.0f} |"
        )
    if picture:
        draw(picture)
    return performance(settings("rated speed"), CASES["rated speed"][0]).peak_pressure


if __name__ == "__main__":
    main(*sys.argv[1:2])
