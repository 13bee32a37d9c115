"""Write the example inputs of the FMU: ``python examples/fmu_input.py``.

``fmu_pressures.csv``: half a second at 2000 rev/min with the built-in full-load trace in every cylinder, as a
combustion model would give it, one row per 3 degrees. Pressure belongs to the crank's angle, which leads the
dynamometer's by the wind-up of the connecting shaft: without that lead of some degrees the torque is a fifth too high.

``fmu_pressures_fmi3.csv``: the same pressures for an FMU of FMI 3.0, whose input ``cylinder.pressure`` is an array: one
column, a row's elements with spaces between. FMPy takes no column of one number beside it: the speed is a start value.

``fmu_run_up.csv``: speed from 1500 to 2400 rev/min; the gas stays built in, since no pressure is given.

Columns are named as the FMU's inputs, in their SI units; FMPy interpolates.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from cranktrain.engine.file import load_engine
from cranktrain.loads.gas_pressure import CYCLE, GasTrace, gas_pressure, spline_coefficients

FOLDER = Path(__file__).resolve().parent
SPEED = 2000.0 * math.pi / 30.0
DURATION, STEP = 0.5, 2.5e-4


def main(folder: Path = FOLDER) -> float:
    """Write the files; returns the largest pressure, Pa."""
    engine = load_engine("diesel_i6")
    trace = GasTrace.from_engine(engine)
    share = 1.0 - trace.falloff * ((SPEED - trace.best_speed) / trace.best_speed) ** 2
    table = spline_coefficients(trace.motored + share * (trace.fired - trace.motored))
    swept = math.pi / 4.0 * engine.cylinders.bore**2 * 2.0 * engine.crankshaft.throw * engine.n_cylinders
    lead = trace.imep * swept / CYCLE / engine.drive_line.stiffness
    order = engine.cylinders.firing_order
    fires_at = {cylinder: place * CYCLE / len(order) for place, cylinder in enumerate(order)}
    largest = 0.0
    arrays = ["time,cylinder.pressure"]
    rows = ["time,speed," + ",".join(f"cylinder[{i + 1}].pressure" for i in range(len(order)))]
    for time in np.arange(round(DURATION / STEP) + 1) * STEP:
        pressures = [gas_pressure(SPEED * time + lead - fires_at[i + 1], table) for i in range(len(order))]
        largest = max(largest, *pressures)
        cells = [f"{round(p, -2):.0f}" for p in pressures]
        rows.append(f"{time:.5f},{SPEED:.6f},{','.join(cells)}")
        arrays.append(f"{time:.5f},{' '.join(cells)}")
    for name, lines in (("fmu_pressures", rows), ("fmu_pressures_fmi3", arrays)):
        (folder / f"{name}.csv").write_text("\n".join(lines), encoding="ascii")
    run_up = [(time, rpm * math.pi / 30.0) for time, rpm in ((0.0, 1500.0), (0.05, 1500.0), (0.5, 2400.0))]
    lines = ["time,speed"] + [f"{time:.2f},{speed:.6f}" for time, speed in run_up]
    (folder / "fmu_run_up.csv").write_text("\n".join(lines), encoding="ascii")
    return float(largest)


if __name__ == "__main__":
    main()
