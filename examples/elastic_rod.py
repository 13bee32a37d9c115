"""An elastic connecting rod and its piston as bodies of their own, in place of those of one of an engine's cylinders.

    python examples/elastic_rod.py [PICTURE]

Frames, bodies and connections are tables of the engine file (docs/how-to/added_bodies.md). Shown is how far the piston
comes beyond the height that it has on a rigid rod of the same mass, and what the small end carries.
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

PARTS = """
[[frame]]
name = "rod"
motion = "rod"
cylinder = { value = 1, unit = "1", origin = "chosen" }

[[frame]]
name = "piston"
motion = "piston"
cylinder = { value = 1, unit = "1", origin = "chosen" }

[[body]]
name = "piston[1]"
frame = "piston"
mass = { value = 0.45, unit = "kg", origin = "chosen" }
inertia = { value = [3.5e-4, 3.5e-4, 3.5e-4], unit = "kg m^2", origin = "chosen" }
centre = { value = [0, 187, 49], unit = "mm", origin = "derived" }
interfaces = ["pin"]
x = { value = [0], unit = "mm", origin = "chosen" }
y = { value = [187], unit = "mm", origin = "derived", note = "throw and rod" }
z = { value = [49], unit = "mm", origin = "derived" }

[[connection]]
name = "big_end"
law = "film"
ends = ["crank.pin[1]", "rod[1].big"]
diameter = { value = 50, unit = "mm", origin = "chosen" }
width = { value = 20, unit = "mm", origin = "chosen" }
clearance = { value = 22, unit = "um", origin = "chosen" }
contact_height = { value = 1, unit = "um", origin = "chosen" }
contact_pressure = { value = 300, unit = "MPa", origin = "chosen" }

[[connection]]
name = "big_end_faces"
law = "spring"
ends = ["crank.pin[1]", "rod[1].big"]
stiffness = { value = [0, 0, 1e6], unit = "N/m", origin = "chosen" }
damping = { value = [0, 0, 1e2], unit = "N s/m", origin = "chosen" }
turning_stiffness = { value = [1e4, 1e4, 0], unit = "N m/rad", origin = "chosen" }
turning_damping = { value = [10, 10, 0], unit = "N m s/rad", origin = "chosen" }

[[connection]]
name = "small_end"
law = "film"
ends = ["piston[1].pin", "rod[1].small"]
diameter = { value = 21, unit = "mm", origin = "chosen" }
width = { value = 20, unit = "mm", origin = "chosen" }
clearance = { value = 10, unit = "um", origin = "chosen" }
contact_height = { value = 1, unit = "um", origin = "chosen" }
contact_pressure = { value = 300, unit = "MPa", origin = "chosen" }

[[connection]]
name = "faces"
law = "spring"
ends = ["piston[1].pin", "ground"]
stiffness = { value = [0, 0, 1e6], unit = "N/m", origin = "chosen" }
damping = { value = [0, 0, 1e2], unit = "N s/m", origin = "chosen" }
turning_stiffness = { value = [1e4, 1e4, 0], unit = "N m/rad", origin = "chosen" }
turning_damping = { value = [10, 10, 0], unit = "N m s/rad", origin = "chosen" }

[[connection]]
name = "skirt"
law = "liner"
ends = ["piston[1].pin", "ground"]
upper_stiffness = { value = 3e7, unit = "N/m", origin = "chosen" }
lower_stiffness = { value = 2e7, unit = "N/m", origin = "chosen" }
upper_height = { value = 15, unit = "mm", origin = "chosen" }
lower_height = { value = -20, unit = "mm", origin = "chosen" }
upper_damping = { value = 1e3, unit = "N s/m", origin = "chosen" }
lower_damping = { value = 1e3, unit = "N s/m", origin = "chosen" }
friction = { value = 0.05, unit = "1", origin = "chosen" }

[[connection]]
name = "gas"
law = "gas"
ends = ["piston[1].pin", "ground"]
bore = { value = 82, unit = "mm", origin = "chosen" }
cylinder = { value = 1, unit = "1", origin = "chosen" }
"""
ELASTIC = """
[[body]]
name = "rod[1]"
frame = "rod"
along = "y"
stations = { value = [0, 25, 125, 144], unit = "mm", origin = "chosen" }
areas = { value = [900, 210, 500], unit = "mm^2", origin = "chosen" }
second_moments = { value = [2e5, 2.2e4, 8e4], unit = "mm^4", origin = "chosen" }
interfaces = ["big", "small"]
y = { value = [0, 144], unit = "mm", origin = "chosen" }
z = { value = [49], unit = "mm", origin = "derived", note = "middle of the first pin" }
discs = ["big", "small"]
disc_masses = { value = [0.1, 0.044], unit = "kg", origin = "derived", note = "to the mass of the engine's own rod" }
disc_polar = { value = [2e-4, 2e-5], unit = "kg m^2", origin = "chosen" }
disc_diametral = { value = [1.5e-4, 1.5e-5], unit = "kg m^2", origin = "chosen" }
"""
RIGID = """
[[body]]
name = "rod[1]"
frame = "rod"
mass = { value = 0.56, unit = "kg", origin = "chosen" }
inertia = { value = [0.0022, 0.0004, 0.0022], unit = "kg m^2", origin = "chosen" }
centre = { value = [0, 84.1, 49], unit = "mm", origin = "derived" }
interfaces = ["big", "small"]
x = { value = [0, 0], unit = "mm", origin = "chosen" }
y = { value = [43, 187], unit = "mm", origin = "derived" }
z = { value = [49, 49], unit = "mm", origin = "derived" }
"""


def engine_with(rod: str) -> ct.load_engine:  # type: ignore[valid-type]
    """The four of the other example without its balancers, and with this rod."""
    plain = (HERE / "four_with_balancers.toml").read_text(encoding="utf-8").split("# Two shafts")[0]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "four.toml"
        path.write_text(plain + rod + PARTS, encoding="utf-8")
        return ct.load_engine(path)


def by_angle(run: ct.simulate, name: str) -> tuple[np.ndarray, np.ndarray]:  # type: ignore[valid-type]
    """Crank angle in degrees, rising, and an output."""
    angle = np.degrees(run["crank.angle_cycle"])
    order = np.argsort(angle)
    return angle[order], run[name][order]


def main() -> int:
    """Run, print and draw."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    engines = {"elastic rod": engine_with(ELASTIC), "rigid rod": engine_with(RIGID)}
    for speed in SPEEDS_RPM:
        runs = {name: ct.simulate(own, speed_rpm=speed, crank="beam", block="ground") for name, own in engines.items()}
        angle, height = by_angle(runs["elastic rod"], "piston[1].position.y")
        gained = 1e6 * (height - by_angle(runs["rigid rod"], "piston[1].position.y")[1])
        print(f"{speed:.0f} rev/min: an elastic rod lifts the piston by {gained.min():.0f} to {gained.max():.0f} µm")
        left.plot(angle, gained, label=f"{speed:.0f} rev/min")
    for name, run in runs.items():
        force = np.hypot(*(by_angle(run, f"connection[small_end].force.{way}")[1] for way in "xy"))
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
