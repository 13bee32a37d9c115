"""A petrol four on rubber and on hydraulic mounts: stiffness over frequency, forces over speed, and a start.

    python examples/engine_mounts.py [PICTURE]

Block and gearbox are a standing body of ``[mounts]``, as a CAD program states it, so that no block is meshed.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import matplotlib
import numpy as np

import cranktrain as ct
from cranktrain.engine.mount_dynamics import MountDynamics
from cranktrain.engine.parts import Mounts
from cranktrain_lab.mounts.stiffness import support_of
from cranktrain_lab.mounts.study import passage, study

matplotlib.use("Agg")
import matplotlib.pyplot as plt

RPM = np.pi / 30.0
START, LOAD = 400.0, 0.3
"""Rise of the speed at the start, rev/min per s, and fraction of the full-load burn."""
PLACES = {"x": (-0.24, 0.24, -0.2, 0.2), "y": 4 * (0.05,), "z": (0.06, 0.06, 0.52, 0.52)}
ALONG, LOSS = (1.5e5, 2.5e5, 1.5e5), 0.1
"""Stiffness of a mount along x, y, z, N/m, and the loss factor of the rubber at 10 Hz."""
BODY = {"standing_mass": 135.0, "standing_centre": (0.0, 0.1, 0.32), "standing_inertia": (9.5, 8.0, 4.5)}
FLUID = MountDynamics(
    "fluid", ("y",), (1, 2, 3, 4), fluid_stiffness=1.2e5, fluid_mass=18.0, fluid_damping=700.0
)  # fmt: skip


def four() -> ct.Engine:
    """Shipped four without its balancer shafts, on rubber mounts."""
    values = {f"stiffness_{axis}": 4 * (k,) for axis, k in zip("xyz", ALONG, strict=True)}
    values |= {f"damping_{axis}": 4 * (LOSS * k / (20.0 * np.pi),) for axis, k in zip("xyz", ALONG, strict=True)}
    turning = {f"{noun}_r{axis}": 4 * (k,) for axis in "xyz" for noun, k in (("stiffness", 50.0), ("damping", 0.1))}
    plain = ct.load_engine("four_petrol").without_additions
    return replace(plain, mounts=Mounts(**PLACES, **values, **turning, **BODY))


def main() -> int:
    """Compute both, print the largest motions of the start, and draw."""
    rubber = four()
    engines = {"rubber": rubber, "hydraulic": replace(rubber, mount_dynamics=(FLUID,))}
    figure, ((first, second), (third, fourth)) = plt.subplots(2, 2, figsize=(10, 7), layout="constrained")
    hz, speeds = np.geomspace(1.0, 100.0, 200), np.linspace(600.0, 6000.0, 109)
    for name, engine in engines.items():
        stiffness = np.array([support_of(engine, np.zeros(3)).at(2.0 * np.pi * one)[1] for one in hz])
        first.semilogx(hz, 1e-3 * np.abs(stiffness), label=name)
        second.semilogx(hz, np.degrees(np.angle(stiffness)), label=name)
        made = study(engine, speeds * RPM, 1.0, (2.0,))
        third.plot(speeds, np.abs(made.response.frame[:, 0, 1]), label=name)
        start = passage(made, START * RPM, LOAD)
        fourth.plot(start.run.time, 1e3 * start.run.centre[:, 5], label=name, lw=1.0)
        roll = 1e3 * np.abs(start.run.centre[:, 5]).max()
        periodic = 1e3 * start.centre[:, 5].max()
        modes = ", ".join(f"{one.name} {one.hz:.1f} Hz" for one in made.modes)
        print(f"{name}: {modes}; the start rolls by {roll:.1f} mrad, periodic cycles by {periodic:.1f}")
    first.set(xlabel="frequency / Hz", ylabel="dynamic stiffness / N/mm", title="one mount, upwards")
    second.set(xlabel="frequency / Hz", ylabel="loss angle / deg", title="one mount, upwards")
    third.set(xlabel="speed / rev/min", ylabel="force / N", title="order 2 on the frame, upwards", ylim=(0, None))
    fourth.set(xlabel="time / s", ylabel="roll / mrad", title=f"start at {START:.0f} rev/min per s")
    for ax in (first, second, third, fourth):
        ax.grid(alpha=0.25)
        ax.legend()
    if len(sys.argv) > 1:
        figure.savefig(sys.argv[1], dpi=110)
    return 0


if __name__ == "__main__":
    sys.exit(main())
