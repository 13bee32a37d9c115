"""Fit the burn of the combustion module to a measured pressure trace, and hold it against peaks over the speed.

``python examples/combustion_calibration.py TRACE.csv PEAKS.csv [PICTURE.png]`` prints the table of docs/combustion.md.
TRACE has crank angle (degrees, firing dead centre at 360) and pressure (MPa), PEAKS speed (rev/min) and peak pressure
(MPa). The engine measured is a six of bore 105, stroke 137 and rod 207 mm (Mendes, Meirelles, Zampieri 2008). What is
not known of it is fitted with the burn: compression ratio, fuel and start of injection; the trace's speed is that of
the equal peak. Manifold pressures are read from the trace.
"""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import matplotlib
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, least_squares

matplotlib.use("Agg")

import matplotlib.pyplot as plt

from cranktrain.modules.combustion.file import load
from cranktrain.modules.combustion.settings import CycleSettings
from cranktrain.modules.combustion.simulation import CombustionSimulation
from cranktrain.modules.register import module_files
from cranktrain.results.figures import save_figure

Array = NDArray[np.float64]

BORE, STROKE, ROD = 0.105, 0.137, 0.207
RPM = math.pi / 30.0
FROM, TO = -90.0, 120.0
"""Crank angles, deg, between which the trace is fitted: valves closed, burn and expansion."""
STEP = math.radians(0.5)


class Fitted(NamedTuple):
    """A value that is fitted: field of the settings, name, unit, unit in SI, start and bounds in the unit."""

    field: str
    name: str
    unit: str
    scale: float
    start: float
    low: float
    high: float


DEG = math.pi / 180.0
VALUES = (
    Fitted("compression_ratio", "compression ratio", "1", 1.0, 16.0, 12.0, 20.0),
    Fitted("fuel_mass", "fuel of a cylinder and cycle", "mg", 1e-6, 95.0, 50.0, 160.0),
    Fitted("injection_angle", "start of injection", "deg", DEG, -10.0, -30.0, 5.0),
    Fitted("premixed_factor", "factor of the premixed share", "1", 1.0, 0.926, 0.4, 1.5),
    Fitted("premixed_duration", "duration of the premixed burn", "deg", DEG, 8.0, 3.0, 30.0),
    Fitted("diffusion_duration", "duration of the diffusion burn", "deg", DEG, 60.0, 25.0, 130.0),
    Fitted("diffusion_exponent", "exponent of the diffusion burn", "1", 1.0, 0.8, 0.1, 3.0),
)


def measured(path: str) -> Array:
    """Two columns of a file, (n, 2)."""
    return np.array([[float(word) for word in line.split(";")] for line in Path(path).read_text().split("\n") if line])


def cylinder(trace: Array, speed: float) -> CycleSettings:
    """One cylinder of the engine measured, before the fit."""
    return replace(
        load(module_files()["combustion_i6"]),
        name="measured_six",
        bore=BORE,
        stroke=STROKE,
        rod_length=ROD,
        firing_angles=(0.0,),
        intake_pressure=1e6 * _plateau(trace, 60.0, 180.0),
        exhaust_pressure=1e6 * _plateau(trace, 670.0, 720.0),
        reference_speed=speed,
    )


def _plateau(trace: Array, first: float, last: float) -> float:
    inside = (trace[:, 0] >= first) & (trace[:, 0] <= last)
    return float(np.mean(trace[inside, 1]))


def cycle(settings: CycleSettings, speed: float) -> tuple[Array, Array]:
    """Crank angles, deg after firing dead centre, and pressures, MPa, of a settled cycle from −180 deg on."""
    simulation = CombustionSimulation(replace(settings, start_cycles=4.0, angle_source="speed"))
    simulation.inputs[:2] = speed, 3.0 * math.pi
    simulation.initialize()
    place = simulation.output_names.index("cylinder[1].pressure")
    pressures = []
    for k in range(round(2.0 * math.pi / STEP)):
        simulation.step((k + 1) * STEP / speed)
        pressures.append(1e-6 * simulation.outputs[place])
    return -180.0 + np.degrees(STEP) * np.arange(1, len(pressures) + 1), np.array(pressures)


def with_values(settings: CycleSettings, values: Array) -> CycleSettings:
    """Settings with the fitted values, given in their units."""
    return replace(settings, **{v.field: v.scale * float(x) for v, x in zip(VALUES, values, strict=True)})


def fit(settings: CycleSettings, trace: Array, speed: float) -> tuple[Array, float]:
    """Values, in their units, that meet the trace best, and the RMS of what is left, MPa."""
    angles = trace[:, 0] - 360.0
    inside = (angles > FROM) & (angles < TO)

    def missed(values: Array) -> Array:
        at, pressures = cycle(with_values(settings, values), speed)
        return np.asarray(np.interp(angles[inside], at, pressures) - trace[inside, 1])

    bounds = [v.low for v in VALUES], [v.high for v in VALUES]
    start = [v.start for v in VALUES]
    found = least_squares(missed, start, bounds=bounds, x_scale=np.abs(start), diff_step=1e-3, max_nfev=60)
    return found.x, float(np.sqrt(np.mean(found.fun**2)))


def meeting_start(settings: CycleSettings, speed: float, peak: float) -> float:
    """Start of injection, deg, with which the peak pressure is ``peak``, MPa; NaN where none is."""

    def missed(start: float) -> float:
        return float(cycle(replace(settings, injection_angle=start * DEG), speed)[1].max()) - peak

    low, high = -15.0, 10.0
    return float(brentq(missed, low, high, xtol=0.02)) if missed(low) > 0.0 > missed(high) else math.nan


def draw(path: str, trace: Array, curve: tuple[Array, Array], peaks: Array, runs: Array) -> None:
    """Picture of the trace with the fitted cycle, and of the peaks over the speed."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), constrained_layout=True)
    left.plot(*curve, label="combustion module, fitted")
    left.plot(trace[:, 0] - 360.0, trace[:, 1], "k.", ms=4, label="measured")
    left.set(xlim=(-120, 180), xlabel="crank angle after firing dead centre / deg", ylabel="cylinder pressure / MPa")
    right.plot(runs[:, 0], runs[:, 1], "o-", ms=3, label="fuel, timing, manifolds of the fit")
    right.plot(peaks[:, 0], peaks[:, 1], "k.", ms=6, label="measured, full load")
    right.set(xlabel="speed / (rev/min)", ylabel="peak pressure / MPa", ylim=(0, None))
    for ax in (left, right):
        ax.grid(alpha=0.3)
        ax.legend(frameon=False)
    save_figure(figure, path)


def main(trace_file: str, peaks_file: str, picture: str = "") -> tuple[Array, float]:
    """Fit, print the tables, draw; returns the values and the RMS of what is left, MPa."""
    trace, peaks = measured(trace_file), measured(peaks_file)
    speed = float(peaks[np.argmin(abs(peaks[:, 1] - trace[:, 1].max())), 0])
    settings = cylinder(trace, speed * RPM)
    values, left = fit(settings, trace, speed * RPM)
    fitted = with_values(settings, values)
    curve = cycle(fitted, speed * RPM)
    top, top_measured = int(curve[1].argmax()), int(trace[:, 1].argmax())
    print("| fitted at " + f"{speed:.0f} rev/min | value | unit |\n| --- | --- | --- |")
    for value, x in zip(VALUES, values, strict=True):
        print(f"| {value.name} | {x:.3g} | {value.unit} |")
    print("\n| | measured | fitted |\n| --- | --- | --- |")
    print(f"| peak pressure / MPa | {trace[:, 1].max():.2f} | {curve[1].max():.2f} |")
    print(f"| at / deg | {trace[top_measured, 0] - 360.0:.1f} | {curve[0][top]:.1f} |")
    print(f"| RMS between {FROM:.0f} and {TO:.0f} deg / MPa | | {left:.2f} |")
    speeds = peaks[peaks[:, 0] < speed + 50.0]
    runs = np.array([[n, cycle(fitted, n * RPM)[1].max()] for n in speeds[:, 0]])
    print("\n| speed / (rev/min) | measured peak / MPa | computed | start of injection that meets it / deg |")
    print("| --- | --- | --- | --- |")
    for (n, p), (_, computed) in list(zip(speeds, runs, strict=True))[::3]:
        print(f"| {n:.0f} | {p:.1f} | {computed:.1f} | {meeting_start(fitted, n * RPM, p):.1f} |")
    if picture:
        draw(picture, trace, curve, peaks, runs)
    return values, left


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit("usage: python examples/combustion_calibration.py TRACE.csv PEAKS.csv [PICTURE.png]")
    main(*sys.argv[1:4])
