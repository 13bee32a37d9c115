"""An in-line four with and without its two balancer shafts: forces on the mounts, and what gears and bearings carry.

    python examples/balancers.py [PICTURE]

The engine file is ``examples/four_with_balancers.toml``: the shafts, their bearings and gears are tables in it.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np

import cranktrain as ct

matplotlib.use("Agg")
import matplotlib.pyplot as plt

SPEED_RPM = 4000.0
HERE = Path(__file__).parent


def mount_force(run: ct.simulate) -> np.ndarray:  # type: ignore[valid-type]
    """Vertical force of all mounts over the last cycle, N."""
    return np.sum([run.last_cycle(f"mount[{k}].force.y")[1] for k in range(1, 5)], axis=0)


def orders(force: np.ndarray) -> np.ndarray:
    """Amplitudes of the first twelve half orders of a cycle, both of whose ends are given."""
    samples = force[:-1]
    return 2.0 * np.abs(np.fft.rfft(samples))[1:13] / len(samples)


def main() -> int:
    """Run both, print and draw."""
    engine = ct.load_engine(HERE / "four_with_balancers.toml")
    plain = replace(engine, frame=(), body=(), connection=())
    runs = {
        name: ct.simulate(own, speed_rpm=SPEED_RPM, block="flexible")
        for name, own in (("with balancers", engine), ("without", plain))
    }
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    at = 0.5 * np.arange(1, 13)
    for k, (name, run) in enumerate(runs.items()):
        found = orders(mount_force(run))
        print(f"{name}: {found[3]:.1f} N of order 2 on the mounts")
        left.bar(at + 0.18 * (k - 0.5), found, width=0.18, label=name)
    left.set(xlabel="order", ylabel="vertical force on the mounts / N", title=f"{SPEED_RPM:.0f} rev/min")
    left.legend()
    run = runs["with balancers"]
    for name, label in (("crank_gear", "crank and first shaft"), ("balancer_gear", "first and second shaft")):
        angle, force = run.last_cycle(f"connection[{name}].force.tangential")
        right.plot(np.degrees(angle), force, label=label)
    right.set(xlabel="crank angle / deg", ylabel="tangential force of the gears / N", xlim=(0, 720), title="gears")
    right.legend()
    if len(sys.argv) > 1:
        figure.savefig(sys.argv[1], dpi=110)
    return 0


if __name__ == "__main__":
    sys.exit(main())
