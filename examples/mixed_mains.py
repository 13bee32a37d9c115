"""The six with a roller bearing at main 1, beside the pulley, and plain films at all other mains.

    python examples/mixed_mains.py

In an engine file the same is the table ``[main_roller]`` with ``mains = [1]`` beside ``[main_bearing]``.
"""

from __future__ import annotations

from dataclasses import replace

import cranktrain as ct
from cranktrain.engine.parts import RollerBearings

SPEED_RPM = 2000.0
ROLLER, TRACK = 0.012, 0.080
"""Diameters of the rollers and of the journal that they run on, m."""


def main() -> int:
    """Run both engines and print what their mains carry."""
    engine = ct.load_engine("diesel_i6")
    rollers = RollerBearings(
        rollers=(20,), roller_diameter=(ROLLER,), roller_length=(0.024,), pitch_diameter=(TRACK + ROLLER,),
        clearance=(30e-6,), stiffness=(8e8,), tilt_stiffness=(3e4,), damping=(2e4,), tilt_damping=(2.0,),
        ring_mass=(0.6,), profile=(0.00035,), mains=(1,),
    )  # fmt: skip
    runs = [ct.simulate(own, speed_rpm=SPEED_RPM) for own in (engine, replace(engine, main_roller=rollers))]
    print("main   largest force / kN    least film / um    friction / N m     (films alone | roller at main 1)")
    for i in range(1, len(engine.crankshaft.main_widths) + 1):
        load = [1e-3 * max(abs(run[f"bearing[{i}].force.y"])) for run in runs]
        film = [1e6 * min(run[f"bearing[{i}].film_thickness_min"]) for run in runs]
        drag = [run[f"bearing[{i}].friction_torque"].mean() for run in runs]
        films = f"{film[0]:8.2f} | {film[1]:<8.2f}" if i > 1 else f"{film[0]:8.2f} | none    "
        print(f"{i:4d} {load[0]:10.1f} | {load[1]:<8.1f} {films} {drag[0]:8.2f} | {drag[1]:.2f}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
