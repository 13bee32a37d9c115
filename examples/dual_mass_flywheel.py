"""A dual-mass flywheel behind the six, through its resonance at start-up, without and with friction of its bow springs.

    python examples/dual_mass_flywheel.py [PICTURE]

The flywheel is cut in two: the crank keeps the primary mass, the secondary one hangs on bow springs. Steady cycles from
cranking to idle speed show the twist of the springs at order 3, the six's firing order, and how much of the primary
mass' rotation the secondary one still has.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import matplotlib
import numpy as np

import cranktrain as ct
from cranktrain.engine.additions import BodyTable, ConnectionTable
from cranktrain.engine.connections import Coupling, Spring
from cranktrain.engine.model import Engine

matplotlib.use("Agg")
import matplotlib.pyplot as plt

STIFFNESS, DAMPING, SECONDARY = 3400.0, 8.0, 0.5
"""Bow springs, N m/rad and N m s/rad, and the secondary mass' inertia, kg m²."""
ORDER = 3
SPEEDS = np.arange(150.0, 825.0, 25.0)


def with_dual_mass(friction: float) -> Engine:
    """The six with half of its flywheel behind bow springs whose guides rub with ``friction`` N m."""
    engine = ct.load_engine("diesel_i6")
    z = engine.cylinder_positions[-1] + 0.2
    primary = replace(engine.flywheel, mass=16.0, polar_inertia=engine.flywheel.polar_inertia - SECONDARY)
    secondary = BodyTable(
        "secondary", "crank", mass=16.0, inertia=(0.3, 0.3, SECONDARY), centre=(0.0, 0.0, z), interfaces=("hub",),
        x=(0.0,), y=(0.0,), z=(z,),
    )  # fmt: skip
    ends = ("secondary.hub", "crank.flywheel")
    springs = Coupling(STIFFNESS, DAMPING, friction=friction, slip_speed=0.2)
    bearing = Spring((1e9, 1e9, 1e8), (3e4, 3e4, 3e3), (1e6, 1e6, 0.0), (1e3, 1e3, 0.0))
    return replace(
        engine, name="six_dual_mass", flywheel=primary, axial_path=None, body=(secondary,),
        connection=(
            ConnectionTable("bow_springs", "coupling", ends, coupling=springs),
            ConnectionTable("bearing", "spring", ends, spring=bearing),
        ),
    )  # fmt: skip


def swings(engine: Engine, rpm: float) -> tuple[complex, complex, float]:
    """Order 3 of the rotation of crank and secondary mass (rad, complex), and largest twist of the springs (rad)."""
    run = ct.simulate(engine, speed_rpm=rpm, crank="rigid", block="ground", load=0.3, settle=1e-4)
    found = []
    for name in ("flywheel.torsion", "secondary.rotation"):
        samples = run[name][-run.per_cycle :]  # of one cycle, where it repeats after several
        found.append(2.0 * np.fft.fft(samples)[2 * ORDER] / len(samples))
    twist = run["connection[bow_springs].twist"]
    return found[0], found[1], 0.5 * float(np.ptp(twist))


def main(picture: str | None = None, speeds: np.ndarray = SPEEDS) -> dict[float, np.ndarray]:
    """Run, print and draw; order 3 of crank and secondary mass over the speed (n, 2) by friction, N m."""
    found = {}
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    for friction in (0.0, 40.0):
        engine = with_dual_mass(friction)
        rows = [swings(engine, rpm) for rpm in speeds]
        found[friction] = np.array([row[:2] for row in rows])
        twist = np.degrees([abs(b - a) for a, b, _ in rows])
        worst = int(np.argmax(twist))
        print(f"friction {friction:g} N m: the springs twist most at {speeds[worst]:g} rev/min, {twist[worst]:.1f} deg")
        left.plot(speeds, twist, marker=".", label=f"friction {friction:g} N m")
        right.plot(speeds, [abs(b / a) for a, b, _ in rows], marker=".", label=f"friction {friction:g} N m")
    omega = ORDER * np.pi / 30.0 * speeds
    exact = (STIFFNESS + 1j * omega * DAMPING) / (STIFFNESS - SECONDARY * omega**2 + 1j * omega * DAMPING)
    right.plot(
        speeds, np.abs(exact), color="black", linewidth=0.8, linestyle="--", label="two masses, without friction"
    )
    left.set(xlabel="speed / rev/min", ylabel="twist of the bow springs, order 3 / deg")
    right.set(xlabel="speed / rev/min", ylabel="rotation of secondary over primary mass, order 3", yscale="log")
    right.set_yticks([0.2, 0.5, 1.0, 2.0, 5.0], labels=["0.2", "0.5", "1", "2", "5"])
    right.minorticks_off()
    left.legend()
    right.legend()
    if picture is not None:
        figure.savefig(picture, dpi=120)
    plt.close(figure)
    return found


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else None)
