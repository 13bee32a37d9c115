"""Misfire: orders of the coupled six's torsion beside two estimates in the frequency domain.

``python benchmarks/misfire.py [RPM] [PICTURE.png]`` runs cranktrain and combustion as FMUs, the crank torsional, with
all cylinders and with one that is given no fuel. Both estimates take the pressures of each run as they came, and the
rods' torques. The first answers order by order, with the cycle mean of the rods' inertia
(:mod:`cranktrain.studies.torsion.shaft_orders`); in the balance inertia and piston's way are those of the angle that
each pin is at, which couples the orders. Prints amplitudes, zero to peak, and what the estimates miss, as JSON.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import cranktrain as ct
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.model import Engine
from cranktrain.loads.cylinder_volume import cylinder_volume
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.results.figures import save_figure
from cranktrain.results.orders.harmonics import order_amplitudes
from cranktrain.results.plots import BLUE, GREY, ORANGE
from cranktrain.structure.assembly import running_crank
from cranktrain.studies.torsion.frequency_run_up import frame_wobble
from cranktrain.studies.torsion.shaft_orders import ShaftOrders
from cranktrain_lab.coupling.modules import COMBUSTION, CRANKTRAIN
from cranktrain_lab.coupling.run import Coupled, Steps
from cranktrain_lab.coupling.supervised import run_supervised
from cranktrain_lab.coupling.virtual_engine import Partners, virtual_engine

CYLINDER, CYCLES, STEP_DEG, HIGHEST = 1, 24, 1.0, 24.0
POINTS = round(720.0 / STEP_DEG)
ORDERS = 0.5 * np.arange(1, 13)
"""Orders that are listed."""
SETTLED, ROUNDS = 1e-9, 200
BY_RATE = 0.01
"""Weight of a volume's rate beside the volume, where both tell the angle of a pin."""


def coupled(fmus: tuple[Path, Path], speed: float, misfire: bool) -> Coupled:
    """A run at a speed, rad/s; with ``misfire`` one cylinder has no fuel."""
    values: dict[str, dict[str, Any]] = {CRANKTRAIN: {"crank.level": "torsional"}}
    if misfire:
        values[COMBUSTION] = {f"cylinder[{CYLINDER}].fuel_mass": 0.0}
    make = partial(virtual_engine, Partners(*fmus, values=values), speed, "gauss-seidel", "own")
    return run_supervised(make, CYCLES * 4.0 * math.pi / speed, Steps(math.radians(STEP_DEG) / speed))


def last(run: Coupled, name: str) -> Array:
    """An output, or the time, over the last cycle, (POINTS,) from a whole cycle's start on."""
    return (run.times if name == "time" else run.of(name))[-POINTS - 1 : -1]


class Estimate:
    """The six that only twists, at one speed (rad/s), order by order."""

    def __init__(self, engine: Engine, speed: float) -> None:
        body = running_crank(engine, "torsional")
        self.structure = ShaftOrders(engine, body, Settings(crank="torsional"), GasTrace.from_engine(engine), HIGHEST)
        self.engine, self.speeds = engine, np.array([speed])
        self._transfer = self.structure.transfer(self.speeds, np.arange(self.structure.orders.size))[..., :-1]

    def pushes(self, run: Coupled, angles: Array) -> Array:
        """Gauge pressure times piston area, N, of all cylinders at crank angles of their own, (N, c) rad."""
        structure, found = self.structure, []
        for c in range(structure.throw.size):
            turned = self.pin_angles(run, c) % (4.0 * math.pi)
            pressure = last(run, f"{COMBUSTION}.cylinder[{c + 1}].pressure")
            found.append(np.interp(angles[:, c], turned, pressure, period=4.0 * math.pi))
        return (np.stack(found, axis=1) - structure.crankcase) * structure.area

    def pin_angles(self, run: Coupled, c: int) -> Array:
        """Angles of a cylinder's pin, to which its pressures belong, from how far its volume and the rate deviate.

        The volume tells the angle except at dead centres, where its rate does.
        """
        crank, speed = last(run, f"{CRANKTRAIN}.crank.angle"), self.speeds[0]
        name = f"{CRANKTRAIN}.cylinder[{c + 1}].volume_deviation"
        further, faster = last(run, name), last(run, f"{name}_rate") / speed
        phase, turn = self.engine.firing_angles[c], np.zeros(POINTS)
        volume, rise = cylinder_volume(self.engine, crank - phase, c)[:2]
        for _ in range(4):
            there, slope = cylinder_volume(self.engine, crank + turn - phase, c)[:2]
            bend = (cylinder_volume(self.engine, crank + turn + 1e-4 - phase, c)[1] - slope) / 1e-4
            off, off_rate = further - (there - volume), BY_RATE * (faster - (slope - rise))
            turn = turn + (slope * off + BY_RATE * bend * off_rate) / (slope**2 + (BY_RATE * bend) ** 2)
        return np.asarray(crank + turn)

    def linear(self, run: Coupled) -> Array:
        """Complex orders 0.5, 1, … of the pulley's torsion, rad, with the mean of the rods' inertia."""
        structure = self.structure
        angles = np.repeat(structure.angle[:, None], structure.throw.size, axis=1)
        still, push = structure.rods.torque(angles), self.pushes(run, angles)
        torques = still.weight - still.arm * push - 0.5 * still.slope * self.speeds[0] ** 2
        return self.torsion(self.respond(structure.spectrum(structure.on_pins(torques))))

    def balanced(self, run: Coupled) -> Array:
        """Likewise with the rods' exact torques at the motion found last, until nothing changes."""
        structure, speed = self.structure, self.speeds[0]
        motion = np.zeros(self._transfer.shape[1:3], dtype=complex)
        for _ in range(ROUNDS):
            turn = motion[:, : structure.pins]
            w = 1j * speed * structure.orders[:, None]
            turned, rate, swung = (structure.signal(w**k * turn)[:, structure.throw] for k in range(3))
            angles = structure.angle[:, None] + turned
            at, push = structure.rods.torque(angles), self.pushes(run, angles)
            torque = at.weight - at.arm * push - at.inertia * swung - 0.5 * at.slope * (speed + rate) ** 2
            torques = structure.spectrum(structure.on_pins(torque))
            held = structure.mean_feedback(self.speeds, motion[None])[0]
            before, motion = motion, self.respond(torques - held)
            if np.abs(motion - before).max() < SETTLED * np.abs(motion).max():
                return self.torsion(motion)
        raise SystemExit("the orders do not settle")

    def respond(self, torques: Array) -> Array:
        """Motions (k + 1, p + 4 + shafts) by torques (k + 1, p) on the pins."""
        return np.asarray((self._transfer[0] @ torques[..., None])[..., 0])

    def torsion(self, motion: Array) -> Array:
        """Complex orders of the pulley's torsion against the frame, order 0 left out."""
        structure = self.structure
        wobble = frame_wobble(self.speeds[0], self.speeds[0] * structure.orders)
        return np.asarray(motion[:, structure.at.pulley] - wobble * motion[:, structure.at.swing])[1:]


def figures(fmus: tuple[Path, Path], rpm: float) -> dict[str, Any]:
    """Amplitudes in millidegrees of the listed orders, with and without misfire, coupled and estimated."""
    speed = rpm * math.pi / 30.0
    estimate = Estimate(ct.load_engine("diesel_i6"), speed)
    found: dict[str, Any] = {"rpm": rpm, "cylinder": CYLINDER, "orders": ORDERS.tolist()}
    for name, misfire in (("normal", False), ("misfire", True)):
        found[name] = of_run(estimate, coupled(fmus, speed, misfire))
    return found


def of_run(estimate: Estimate, run: Coupled) -> dict[str, Any]:
    """Orders of a run, mdeg, and how far estimate and balance are from them."""
    torsion = run.of(f"{CRANKTRAIN}.pulley.torsion")
    motion, before = torsion[-POINTS - 1 : -1], torsion[-2 * POINTS - 1 : -POINTS - 1]
    measured = np.abs(order_amplitudes(motion, ORDERS[-1])[1])
    found: dict[str, Any] = {"coupled_mdeg": 1e3 * np.degrees(measured)}
    for name, orders in (("linear", estimate.linear(run)), ("balance", estimate.balanced(run))):
        found[f"{name}_mdeg"] = 1e3 * np.degrees(np.abs(orders[: ORDERS.size]))
        found[f"{name}_off"] = np.abs(orders[: ORDERS.size]) / measured - 1.0
    cycles = float(np.ptp(motion - before) / np.ptp(motion))
    return {key: values.tolist() for key, values in found.items()} | {"cycles_differ": cycles}


def draw(found: dict[str, Any], picture: str) -> None:
    """Orders of the run and what both estimates say, with misfire and without."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 3.8), dpi=120, layout="constrained")
    colours = {"coupled": BLUE, "linear": ORANGE, "balance": GREY}
    for ax, name in zip(figure.subplots(1, 2, sharey=True), ("normal", "misfire"), strict=True):
        for k, (kind, colour) in enumerate(colours.items()):
            label = {
                "coupled": "coupled FMUs",
                "linear": "estimate, mean inertia",
                "balance": "balance, varying inertia",
            }[kind]
            ax.bar(ORDERS + (k - 1) * 0.13, found[name][f"{kind}_mdeg"], width=0.13, color=colour, label=label)
        ax.set(yscale="log", xticks=np.arange(1, 7), xlabel="order / oscillations per revolution", title=name)
        ax.grid(alpha=0.25)
    figure.axes[0].set_ylabel("pulley torsion, zero to peak / mdeg")
    figure.axes[0].legend(frameon=False, fontsize=9)
    save_figure(figure, picture)


def main() -> int:
    """Measure, print and draw."""
    rpm = float(sys.argv[1]) if len(sys.argv) > 1 else 2000.0
    with tempfile.TemporaryDirectory() as folder:
        fmus = (
            ct.build_fmu("diesel_i6", folder, film_table=False, block=False),
            ct.build_fmu("combustion_i6", folder),
        )
        found = figures(fmus, rpm)
    print(json.dumps(found, indent=1))
    if len(sys.argv) > 2:
        draw(found, sys.argv[2])
    return 0


if __name__ == "__main__":
    sys.exit(main())
