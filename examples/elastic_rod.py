"""Elastic connecting rods between oil films, from one table of the engine file (docs/how-to/added_bodies.md).

    python examples/elastic_rod.py [PICTURE]

Shown is how far the first piston comes beyond the height that it has on a rigid rod of the same mass, and what the
small end carries.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import matplotlib
import numpy as np

import cranktrain as ct

matplotlib.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
SPEEDS_RPM = (2000.0, 5000.0)

RODS = """
[rod_shape]
stations = { value = [0, 25, 125, 144], unit = "mm", origin = "chosen" }
areas = { value = [900, 200, 400], unit = "mm^2", origin = "chosen" }
second_moments = { value = [2e5, 2.2e4, 8e4], unit = "mm^4", origin = "chosen" }
big_end = { value = "impedance", origin = "chosen" }
small_end = { value = "impedance", origin = "chosen" }
small_end_diameter = { value = 21, unit = "mm", origin = "chosen" }
small_end_width = { value = 20, unit = "mm", origin = "chosen" }
small_end_clearance = { value = 10, unit = "um", origin = "chosen" }
"""
RIGID = 'youngs_modulus = { value = 1e4, unit = "GPa", origin = "chosen", note = "a rod that hardly gives" }'


def engine_with(rods: str) -> ct.load_engine:  # type: ignore[valid-type]
    """The four of the other example without its balancers, and with these rods."""
    plain = (HERE / "four_with_balancers.toml").read_text(encoding="utf-8").split("# Two shafts")[0]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "four.toml"
        path.write_text(plain + rods, encoding="utf-8")
        return ct.load_engine(path)


def by_angle(run: ct.simulate, name: str) -> tuple[np.ndarray, np.ndarray]:  # type: ignore[valid-type]
    """Crank angle in degrees, rising, and an output."""
    angle = np.degrees(run["crank.angle_cycle"])
    order = np.argsort(angle)
    return angle[order], run[name][order]


def main() -> int:
    """Run, print and draw."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    engines = {"elastic rod": engine_with(RODS), "rigid rod": engine_with(RODS + RIGID)}
    for speed in SPEEDS_RPM:
        runs = {name: ct.simulate(own, speed_rpm=speed, crank="beam", block="ground") for name, own in engines.items()}
        angle, height = by_angle(runs["elastic rod"], "piston[1].position.y")
        gained = 1e6 * (height - by_angle(runs["rigid rod"], "piston[1].position.y")[1])
        print(f"{speed:.0f} rev/min: an elastic rod lifts the piston by {gained.min():.0f} to {gained.max():.0f} µm")
        left.plot(angle, gained, label=f"{speed:.0f} rev/min")
    for name, run in runs.items():
        force = np.hypot(*(by_angle(run, f"connection[small_end_1].force.{way}")[1] for way in "xy"))
        print(f"{speed:.0f} rev/min, {name}: small end carries {1e-3 * force.max():.2f} kN")
        right.plot(angle, 1e-3 * force, label=name)
    left.axhline(0.0, color="0.8", linewidth=0.8)
    left.set(xlabel="crank angle / deg", ylabel="piston over that of a rigid rod / µm", xlim=(0, 720))
    right.set(xlabel="crank angle / deg", ylabel="force in the small end / kN", xlim=(0, 720), ylim=(0, None))
    right.set_title(f"{speed:.0f} rev/min")
    left.set_title("an elastic rod under gas and inertia")
    left.legend()
    right.legend()
    if len(sys.argv) > 1:
        figure.savefig(sys.argv[1], dpi=120)
    return 0


if __name__ == "__main__":
    sys.exit(main())
