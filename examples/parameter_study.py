"""A parameter study on a Dask cluster: twist of the six's crank over the stiffness of its rubber damper and the speed.

``python examples/parameter_study.py [PICTURE.png]`` runs the torsional crank until its outputs repeat, at each speed
with each stiffness, on a local cluster of ``dask.distributed`` (``pip install cranktrain[dask]``), or one after the
other where there is none. The twist is that of the pulley against the flywheel. A row for each stiffness is printed as
it comes; then the map is drawn.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace

import matplotlib
import numpy as np
from numpy.typing import NDArray

matplotlib.use("Agg")

import matplotlib.pyplot as plt

import cranktrain as ct
from cranktrain.results.figures import save_figure

SPEEDS_RPM = tuple(range(1200, 2801, 50))
RING_HZ = (90, 105, 120, 130, 140, 150, 160, 170, 180, 195, 210, 230, 250)
"""Frequencies of the ring on its rubber with the pulley at rest: stiffness is inertia times (2π f)²."""


def twist(ring_hz: float, speeds_rpm: Sequence[float]) -> list[float]:
    """Twist of the crank, degrees peak to peak, at each speed with one damper: a task of the study."""
    engine = ct.load_engine("diesel_i6")
    stiffness = engine.damper.ring_inertia * (2.0 * math.pi * ring_hz) ** 2
    engine = replace(engine, damper=replace(engine.damper, kind="rubber", stiffness=stiffness))
    found = []
    for speed in speeds_rpm:
        run = ct.simulate(engine, speed_rpm=speed, crank="torsional", damper=True)
        turned = run.last_cycle("pulley.torsion")[1] - run.last_cycle("flywheel.torsion")[1]
        found.append(math.degrees(np.ptp(turned)))
    return found


def results(rings: Sequence[float], speeds: Sequence[float]) -> Iterator[tuple[float, list[float]]]:
    """Rows of the study as they come, in any order."""
    try:
        from distributed import Client, as_completed
    except ImportError:
        print("parameter study: no Dask here (pip install cranktrain[dask]); one damper after the other", flush=True)
        for ring in rings:
            yield ring, twist(ring, speeds)
        return
    with Client(threads_per_worker=1, dashboard_address=None) as client:
        workers = len(client.scheduler_info()["workers"])
        print(f"parameter study: {len(rings)} dampers on {workers} workers", flush=True)
        tasks = {client.submit(twist, ring, speeds): ring for ring in rings}
        for done in as_completed(tasks):
            yield tasks[done], done.result()


def draw(path: str, rings: Sequence[float], speeds: Sequence[float], found: NDArray[np.float64]) -> None:
    """The map, and the largest torsion at any speed."""
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(11, 4.4), width_ratios=(2, 1), sharey=True, constrained_layout=True
    )
    filled = left.contourf(speeds, rings, found, levels=16, cmap="viridis")
    figure.colorbar(filled, ax=left, label="pulley against flywheel / deg peak to peak")
    left.set(xlabel="speed / (rev/min)", ylabel="ring on its rubber, pulley at rest / Hz")
    left.set_title("six, torsional crank, rubber damper", fontsize=10, loc="left")
    largest = found.max(axis=1)
    best = int(np.argmin(largest))
    left.axhline(rings[best], color="white", lw=1, ls="--")
    right.plot(largest, rings, "o-", ms=4)
    right.axhline(rings[best], color="0.5", lw=1, ls="--", label=f"least: {rings[best]:g} Hz")
    right.set(xlabel="largest at any speed / deg peak to peak")
    right.grid(alpha=0.3)
    right.legend(frameon=False)
    save_figure(figure, path)
    plt.close(figure)


def main(
    picture: str = "", rings: Sequence[float] = RING_HZ, speeds: Sequence[float] = SPEEDS_RPM
) -> dict[float, list[float]]:
    """Run the study; returns twist, degrees peak to peak, over the speeds by the ring's frequency, Hz."""
    found: dict[float, list[float]] = {}
    for ring, row in results(rings, speeds):
        found[ring] = row
        at = speeds[int(np.argmax(row))]
        print(f"{len(found)}/{len(rings)}: ring {ring:g} Hz, largest {max(row):.3f} deg at {at:g} rev/min", flush=True)
    if picture:
        draw(picture, rings, speeds, np.array([found[ring] for ring in rings]))
    return found


if __name__ == "__main__":
    main(*sys.argv[1:2])
