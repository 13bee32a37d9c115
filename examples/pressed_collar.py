"""Axial resonance of a crank whose thrust collar is pressed to one side.

``python examples/pressed_collar.py [PICTURE.png]`` runs the shipped six with a floating collar, held by its
drive line as the engine file has it, and with a collar that 3 kN press towards the pulley, as a clutch does, while
nothing else holds the crank. It draws the half orders of the pulley's axial motion over their frequency.

A closed collar is a spring between crank and ground, and the crank vibrates against it at about 292 Hz: that is the
axial frequency which the reference measured. A floating collar is no spring, so there is no such mode: in bearings, and
with a floating collar, the crank's own axial mode lies at 441 Hz.
"""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")

import matplotlib.pyplot as plt

from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.results.figures import save_figure
from cranktrain.structure.assembly import assemble
from cranktrain.studies.constant_speed import Request
from cranktrain.studies.run_up.plan import job_of, run_up_speeds
from cranktrain.studies.run_up.steady import SteadyRuns

ENGINE = "diesel_i6"
FORCE = -3000.0  # N, towards the pulley
ORDERS = np.arange(10.0, 14.5, 0.5)
BAND = 262.0, 325.0  # Hz, between the torsional peak and the next modes
SPEEDS = 1200.0, 1700.0, 10.0  # rev/min
PARTS = ("axial.bearing", "axial.crank")
MEASURED = 292.0
COLOURS = {"pressed": "#d9822b", "floating": "#1f5a94"}


def main(picture: str = "out/pressed_collar.png", crank: str = "solid", speeds: Any = SPEEDS) -> dict[str, Any]:
    """Run both collars and draw them; returns what :func:`figures` says of each."""
    engine = load_engine(ENGINE)
    cases = {
        "pressed": axial_orders(replace(engine, axial_path=None), crank, speeds, FORCE),
        "floating": axial_orders(engine, crank, speeds, None),
    }
    found = {name: figures(*case) for name, case in cases.items()}
    for name, said in found.items():
        peaks = ", ".join(f"{hz:.0f}" for hz in said["maxima_hz"]) or "none"
        print(
            f"{name}: maxima of orders at {peaks} Hz, median {said['median_hz']:.1f} Hz; "
            f"collar {said['collar_um']:.1f} um and crank {said['crank_um']:.1f} um peak to peak"
        )
    draw({name: case[:2] for name, case in cases.items()}, picture)
    return found


def axial_orders(engine: Engine, crank: str, speeds: Any, force: float | None) -> tuple[Any, Any, Any]:
    """Frequencies (s, o), Hz, and amplitudes (s, o), µm, of the axial orders; largest motion of the parts, µm."""
    request = Request(speed_rpm=speeds[0], crank=crank, axial_force_n=force)
    made = assemble(engine, request.settings(engine))
    runs, near = SteadyRuns(job_of(replace(request, settle=1e-4), made, None, PARTS, ORDERS[-1])), []
    rows, parts = [], []
    for speed in run_up_speeds(*speeds):
        found = runs.at(speed, near)
        near = [found.start, *near[:2]]
        rows.append(1e6 * np.abs(found.amplitudes["pulley.axial"])[np.round(2.0 * ORDERS).astype(int) - 1])
        parts.append([1e6 * (found.extremes[name][2] - found.extremes[name][0]) for name in PARTS])
    return np.outer(run_up_speeds(*speeds), ORDERS) / (2.0 * math.pi), np.array(rows), np.array(parts).mean(axis=0)


def figures(frequencies: Any, amplitudes: Any, parts: Any) -> dict[str, Any]:
    """Frequencies at which orders have a maximum within the band that is well above both its ends, and the parts."""
    maxima = []
    for hz, um in zip(frequencies.T, amplitudes.T, strict=True):
        inside = (hz >= BAND[0]) & (hz <= BAND[1])
        own = um[inside]
        if own.size > 4 and own.max() > 1.3 * max(own[0], own[-1]):
            maxima.append(float(hz[inside][np.argmax(own)]))
    median = float(np.median(maxima)) if maxima else math.nan
    return {"maxima_hz": maxima, "median_hz": median, "collar_um": float(parts[0]), "crank_um": float(parts[1])}


def draw(cases: dict[str, tuple[Any, Any]], path: str) -> None:
    """Orders over frequency, one axis a collar."""
    figure, axes = plt.subplots(len(cases), 1, figsize=(9, 6.5), sharex=True, constrained_layout=True)
    for ax, (name, (frequencies, amplitudes)) in zip(axes, cases.items(), strict=True):
        for order, hz, um in zip(ORDERS, frequencies.T, amplitudes.T, strict=True):
            ax.plot(hz, um, color=COLOURS[name], lw=0.9, alpha=0.7)
            inside = (hz > BAND[0]) & (hz < BAND[1])
            if inside.any():
                at = int(np.flatnonzero(inside)[np.argmax(um[inside])])
                ax.annotate(f"{order:g}", (hz[at], um[at]), fontsize=7)
        ax.axvline(MEASURED, color="black", lw=0.8, ls="--")
        ax.set(title=f"{name} collar", ylabel="axial order / µm", xlim=(230.0, 340.0), ylim=(0.0, None))
        ax.grid(alpha=0.25)
    axes[-1].set_xlabel("frequency of the order / Hz; dashed: 292 Hz, measured by the reference")
    figure.suptitle("In-line six: orders 10 to 14 of the pulley's axial motion", fontsize=11)
    save_figure(figure, path)
    plt.close(figure)


if __name__ == "__main__":
    main(*sys.argv[1:2])
