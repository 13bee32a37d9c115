"""Orders of the pulley under a measured gas trace beside those under the built-in one, as a Markdown note.

``python examples/measured_pressure.py TRACE.csv > docs/measured_pressure.md`` makes the note in ``docs/``; a second
argument names a picture of the two traces.
"""

from __future__ import annotations

import math
import sys

import matplotlib
import numpy as np

matplotlib.use("Agg")

import matplotlib.pyplot as plt

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.dynamics.simulation import Settings, simulate
from cranktrain.engine.file import load_engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.results.figures import save_figure
from cranktrain.results.plots import plot_pressure
from cranktrain.results.summary import run_summary
from cranktrain.structure.crank.reduction import running_body

ENGINE = "diesel_i6"
SPEED_RPM = 2000.0
CYCLES = 12
SHOWN_ORDERS = (0.5, 1.0, 1.5, 2.5, 3.0, 4.5, 6.0, 7.5, 9.0, 12.0)


def main(measured: str, picture: str = "", body: ReducedBody | None = None) -> float:
    """Run both traces on the solid crank, or another, and print the note; returns the ratio of the largest loads."""
    engine = load_engine(ENGINE)
    traces = {"built-in": GasTrace.from_engine(engine), "measured": GasTrace.from_csv(measured, engine)}
    body = body or running_body(engine)
    summaries = {
        name: run_summary(simulate(engine, body, Settings(), SPEED_RPM * math.pi / 30.0, CYCLES, gas=trace), "")
        for name, trace in traces.items()
    }
    print("# Measured against built-in gas trace\n")
    print(
        f"`{ENGINE}` at {SPEED_RPM:g} rev/min, solid crank, oil films, last of {CYCLES} cycles; orders are\n"
        "zero-to-peak amplitudes. Made by\n\n"
        "    python examples/measured_pressure.py TRACE.csv > docs/measured_pressure.md\n"
    )
    print(f"Measured trace: {traces['measured'].source}.\n")
    print("| | built-in | measured |\n| --- | --- | --- |")
    for label, value in (
        ("peak pressure / MPa", lambda t: f"{1e-6 * t.peak:.2f}"),
        ("at / deg after dead centre", lambda t: f"{math.degrees(t.peak_angle):.1f}"),
        ("mean effective pressure / MPa", lambda t: f"{1e-6 * t.imep:.2f}"),
    ):
        print(f"| {label} | {value(traces['built-in'])} | {value(traces['measured'])} |")
    for key, title in (("torsion_deg", "Pulley torsion / deg"), ("axial_um", "Pulley axial displacement / um")):
        columns = [summaries[name]["pulley"][key] for name in ("built-in", "measured")]
        orders = [dict(column["orders"]) for column in columns]
        print(f"\n{title}\n\n| order | built-in | measured | ratio |\n| --- | --- | --- | --- |")
        print("| peak to peak | " + " | ".join(f"{column['peak_to_peak']:.4g}" for column in columns), end=" | ")
        print(f"{columns[1]['peak_to_peak'] / columns[0]['peak_to_peak']:.2f} |")
        for order in SHOWN_ORDERS:
            built, measured = (lines[order] for lines in orders)
            print(f"| {order:g} | {built:.3g} | {measured:.3g} | {measured / built:.2f} |")
    load = {name: max(row["peak_load_n"] for row in summary["bearings"]) for name, summary in summaries.items()}
    film = {name: min(row["min_film_um"] for row in summary["bearings"]) for name, summary in summaries.items()}
    print(
        f"\nLargest main bearing load {1e-3 * load['built-in']:.1f} against {1e-3 * load['measured']:.1f} kN, thinnest"
    )
    print(f"film {film['built-in']:.2f} against {film['measured']:.2f} um.")
    if picture:
        figure, ax = plt.subplots(figsize=(9, 4.5), constrained_layout=True)
        fired = {name: trace.fired for name, trace in traces.items()}
        plot_pressure(ax, np.degrees(traces["measured"].angles), fired)
        save_figure(figure, picture)
    return float(load["measured"] / load["built-in"])


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("usage: python examples/measured_pressure.py TRACE.csv [PICTURE.png]")
    main(*sys.argv[1:3])
