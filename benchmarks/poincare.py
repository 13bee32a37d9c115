"""Whether motions of the six at high speeds repeat, and if not, whether they part.

    python benchmarks/poincare.py                                         # one JSON object
    python benchmarks/poincare.py --picture docs/theory/poincare.png      # and the return maps

Level ``impedance``. After 60 plain cycles 200 more are looked at. The picture has the place of the thrust collar at the
start of each cycle over that at the start of the cycle before (the return map of a Poincaré section).
``repeats_every_cycles`` up to 24 cycles, 0 where none differs by less than 0.1 %; ``part_by`` is the factor by which a
cycle and the one most like it are farther apart after the next one, all outputs together, where they do not repeat;
``between_lines`` is the share of the axial motion's energy that lies beside the orders 0.5, 1, 1.5, …: none where each
cycle is the same.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks._engine_run import engine_and_body

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.cycle_run import communication_step, output_judge
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.settled.cycles import Recorder, rewind
from cranktrain.dynamics.settled.longer_periods import parting, same
from cranktrain.dynamics.simulation import Simulation

RPM = math.pi / 30.0
BEFORE, CYCLES, LONGEST, TOLERANCE = 60, 200, 24, 1.0e-3
SPEEDS = (2200.0, 2220.0, 2240.0, 2300.0, 2380.0, 2600.0)


def cycles_at(simulation: Simulation, speed: float) -> Array:
    """Outputs (cycles, samples, outputs) at a speed (rad/s)."""
    simulation.inputs[0] = speed
    simulation.initialize()
    step = communication_step(speed, simulation.settings.step)
    recorder = Recorder(simulation, step, round(4.0 * math.pi / speed / step))
    recorder.cycles(BEFORE)
    rewind(simulation, BEFORE)
    return np.array([_cycle(recorder) for _ in range(CYCLES)])


def _cycle(recorder: Recorder) -> Array:
    rows = recorder.cycles(1)[1:]
    rewind(recorder.simulation, 1)
    return rows


def measured(simulation: Simulation, rpm: float) -> tuple[dict[str, Any], Array]:
    """Figures at one speed, and the collar's place (cycles,), m, at the end of each cycle."""
    cycles = cycles_at(simulation, rpm * RPM)
    columns = {name: i for i, name in enumerate(simulation.output_names)}
    judge = output_judge(simulation.counts, columns)
    axial = cycles[:, :, columns["pulley.axial"]].ravel()
    energy = np.abs(np.fft.rfft(axial - axial.mean())) ** 2
    every = next((p for p in range(1, LONGEST + 1) if same(judge, cycles[-1], cycles[-1 - p], TOLERANCE)), 0)
    figures = {
        "repeats_every_cycles": every,
        "part_by": None if every else parting(judge, cycles),
        "between_lines": 1.0 - float(energy[::CYCLES].sum() / energy.sum()),
    }
    return figures, cycles[:, -1, columns["thrust.displacement"]]


def draw(path: Path, sections: dict[str, Array], figures: dict[str, Any]) -> None:
    """Return maps of all speeds beside one another."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 5.6), layout="constrained")
    for axes, (rpm, section) in zip(
        figure.subplots(2, 3, sharex=True, sharey=True).flat, sections.items(), strict=False
    ):
        axes.plot([-100.0, 100.0], [-100.0, 100.0], color="0.7", linewidth=0.8)
        axes.plot(1e6 * section[:-1], 1e6 * section[1:], ".", markersize=3.5)
        every = figures[rpm]["repeats_every_cycles"]
        axes.set_title(f"{rpm} rev/min: " + ({0: "no period", 1: "every cycle"}.get(every, f"every {every} cycles")))
        axes.grid(alpha=0.3)
    figure.supxlabel("thrust collar at the start of a cycle / µm")
    figure.supylabel("at the start of the next / µm")
    figure.savefig(path, dpi=110)


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--speeds", type=float, nargs="+", default=SPEEDS, metavar="N")
    parser.add_argument("--picture", type=Path, metavar="FILE")
    chosen = parser.parse_args()
    engine, body = engine_and_body()
    simulation = Simulation(engine, body, Settings())
    figures: dict[str, Any] = {}
    sections: dict[str, Array] = {}
    for rpm in chosen.speeds:
        figures[f"{rpm:g}"], sections[f"{rpm:g}"] = measured(simulation, rpm)
    if chosen.picture is not None:
        draw(chosen.picture, sections, figures)
    print(json.dumps(figures, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
