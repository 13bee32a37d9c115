"""The thrust bearing at a start: its film lifts the collar off one side, then the crank moves within the clearance.

``python examples/thrust_start.py [PICTURE.png]`` runs the solid crank of ``diesel_i6`` from rest, the collar leaning on
the free-end side, up to 1000 rev/min, and draws displacement and force over the crank's revolutions.
"""

from __future__ import annotations

import math
import sys
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")

import matplotlib.pyplot as plt

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.dynamics.model.state import POSITION, offset
from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.results.figures import save_figure
from cranktrain.structure.crank.reduction import running_body

ENGINE = "diesel_i6"
SPEED_RPM = 1000.0
RAMP, STOP, STEP = 0.6, 2.0, 2.0e-4  # s
AXIAL_MODE = 2  # rigid motion along z
BLUE, ORANGE, GREY = "#1f5a94", "#d9822b", "#8a8f98"


def main(picture: str = "docs/thrust_start.png", body: ReducedBody | None = None) -> float:
    """Run the start of the solid crank, or of another, and draw it; returns the largest way over the last turns, µm."""
    engine = load_engine(ENGINE)
    revolutions, place, force = started(engine, body or running_body(engine))
    limit = 0.5e6 * engine.thrust.clearance
    for first, last in ((0, 1), (1, 2), (2, 4), (revolutions[-1] - 2.0, revolutions[-1])):
        part = (revolutions >= first) & (revolutions < last)
        print(
            f"revolutions {first:5.1f} to {last:5.1f}: collar {place[part].min():6.1f} to {place[part].max():6.1f} um "
            f"of +-{limit:.0f} um, force {force[part].min():6.0f} to {force[part].max():6.0f} N"
        )
    draw(engine, revolutions, place, force, picture)
    return float(np.abs(place[revolutions >= revolutions[-1] - 2.0]).max())


def started(engine: Engine, body: ReducedBody) -> tuple[Any, Any, Any]:
    """Revolutions, displacement of the collar (µm) and force on it (N) of a start from rest."""
    simulation = Simulation(engine, body, Settings())
    simulation.inputs[0] = 0.0
    simulation.initialize()
    names = list(simulation.output_names)
    columns = [names.index(name) for name in ("crank.angle", "thrust.displacement", "thrust.force")]
    # At rest nothing centres the collar: it leans where it was left, here just touching the side towards the free end.
    state = simulation.state
    leaning = engine.thrust.contact_height - 0.5 * engine.thrust.clearance
    mode = offset(POSITION, simulation.model.omega2.size) + AXIAL_MODE
    state[mode] += (leaning - simulation.outputs[columns[1]]) / simulation.model.ends[2, AXIAL_MODE]
    simulation.state = state
    series = [simulation.outputs[columns].copy()]
    for k in range(1, round(STOP / STEP) + 1):
        simulation.inputs[0] = min(1.0, k * STEP / RAMP) * SPEED_RPM * math.pi / 30.0
        simulation.step(k * STEP)
        series.append(simulation.outputs[columns].copy())
    angle, place, force = np.array(series).T
    return angle / (2.0 * math.pi), 1e6 * place, force


def draw(engine: Engine, revolutions: Any, place: Any, force: Any, path: str) -> None:
    """Start on the left, the last cycle on the right."""
    figure, axes = plt.subplots(
        2, 2, figsize=(11, 6.2), sharex="col", sharey="row", width_ratios=[1.7, 1.0], constrained_layout=True
    )
    half, contact = 0.5e6 * engine.thrust.clearance, 1e6 * engine.thrust.contact_height
    end = math.floor(revolutions[-1])
    for column, (first, last, title) in enumerate(((0, 8, "start from rest"), (end - 2, end, "last cycle, periodic"))):
        part = (revolutions >= first) & (revolutions <= last)
        top, bottom = axes[:, column]
        top.plot(revolutions[part], place[part], color=BLUE, lw=1.4)
        for side in (-1, 1):
            top.axhline(side * half, color="black", lw=1.2)
            top.axhline(side * (half - contact), color=GREY, lw=0.8, ls="--")
        bottom.plot(revolutions[part], 1e-3 * force[part], color=ORANGE, lw=1.2)
        bottom.axhline(0.0, color=GREY, lw=0.6)
        top.set_title(title, fontsize=10, loc="left")
        bottom.set(xlim=(first, last), xlabel="crank revolutions")
        for ax in (top, bottom):
            ax.grid(alpha=0.25)
    axes[0, 0].axvspan(0, RAMP * SPEED_RPM / 120.0, color=GREY, alpha=0.15, lw=0)
    axes[0, 0].annotate("speed rises", (0.1, 0.45 * half), fontsize=8)
    axes[0, 0].annotate("clearance limits (dashed: contact begins)", (3.6, 0.86 * half), fontsize=8)
    axes[0, 0].set(ylabel="collar, + to the flywheel / µm", ylim=(-1.12 * half, 1.12 * half))
    axes[1, 0].set(ylabel="force on the collar / kN")
    axes[1, 1].set_xticks(np.arange(end - 2, end + 0.1, 0.5))
    figure.suptitle(
        f"{engine.title}: thrust bearing, 0 to {SPEED_RPM:g} rev/min in {RAMP:g} s, full load, solid crank", fontsize=11
    )
    save_figure(figure, path)
    plt.close(figure)


if __name__ == "__main__":
    main(*sys.argv[1:2])
