"""Propulsion shafting of a two-stroke six: torsional stress over speed against the rule IACS UR M68.

    python examples/ship_shafting.py [PICTURE]

A low-speed engine drives a propeller through an intermediate and a propeller shaft. The burn balances the propeller's
torque at each speed. Order 6, the firing order, meets the 1-node mode of the shafting at 42 rev/min, where both shafts
exceed the limit for continuous operation: the range around it is barred.
"""

from __future__ import annotations

import sys
from typing import Any

import matplotlib
import numpy as np

import cranktrain as ct
from cranktrain.dynamics.model.settings import Settings
from cranktrain.results.run_up.figures import stress_figure
from cranktrain.results.strength.iacs_m68 import shaft_stresses
from cranktrain.structure.crank.level import crank_body
from cranktrain.studies.torsion.frequency_run_up import HARMONIC_BALANCE, frequency_run_up
from cranktrain.studies.torsion.line_modes import line_report

matplotlib.use("Agg")

ENGINE = "two_stroke_six"
SPEEDS = np.arange(25.0, 111.0)
ORDERS = tuple(float(order) for order in range(1, 25))


def main(picture: str | None = None, speeds: np.ndarray = SPEEDS) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Compute, print and draw: the first mode of the shafting, and each shaft's stress over speeds (n,) rev/min."""
    engine = ct.load_engine(ENGINE)
    body = crank_body(engine, "torsional")
    mode = next(one for one in line_report(engine, body)["modes"] if "1-node" in one["shape"])
    print(f"{mode['shape']}: {mode['hz']:.2f} Hz, order 6 meets it at {mode['critical_rpm']['6']:.1f} rev/min")
    run = frequency_run_up(
        engine, body, Settings(crank="torsional"), speeds * np.pi / 30.0, ORDERS, HARMONIC_BALANCE, balanced=True
    )
    stresses = shaft_stresses(engine, run)
    for entry in stresses:
        worst = entry["worst"]
        print(
            f"{entry['shaft']}: {worst['stress_mpa']:.1f} MPa at {worst['rpm']:.0f} rev/min, continuous limit "
            f"{worst['continuous_mpa']:.1f} MPa: {entry['verdict']}"
        )
        if entry["barred_rpm"] is not None:
            print("  barred from {:.1f} to {:.1f} rev/min".format(*entry["barred_rpm"]))
    if picture is not None:
        stress_figure(run, stresses, engine.title).savefig(picture, dpi=120)
    return mode, stresses


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else None)
