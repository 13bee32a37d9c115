"""Pressures from a master: ``python benchmarks/coupling.py [torsional|solid]``, what order, delay and step cost.

A partner reads ``crank.angle`` and answers with the built-in trace at it. ``now``: it answers before the model steps
(Gauss–Seidel, or a file); ``late``: both step at once (Jacobi), so that its pressures belong to the angle one
communication step before; ``told``: likewise with ``gas.delay`` 1, which rule ``polytropic`` heeds; ``turned``: it
turns the angle on by ``crank.speed`` first.

Of the six at 2000 rev/min, by reconstruction and communication step in degrees of crank angle, over a cycle
after CYCLES cycles: RMS of the difference of the pulley's torsion from the run with built-in gas over the RMS of its
alternating part, and the error of the mean shaft torque. ``repeats`` is how much the last cycle differs from the one
before it, likewise. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import sys
from dataclasses import dataclass, replace

import numpy as np

import cranktrain as ct
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.settings import RECONSTRUCTIONS
from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.loads.gas_pressure import CYCLE, gas_pressure

SPEED = 2000.0 * math.pi / 30.0
STEPS_DEG = 0.75, 1.5, 3.0, 6.0
INTERNAL_DEG = 0.75
CYCLES = 24
SAMPLES = round(720 / STEPS_DEG[-1])
"""Points of a cycle at which runs are compared: those that all communication steps meet."""


@dataclass(frozen=True)
class Order:
    """How a master passes pressures on: late or not, what the model is told, the angle turned on or not."""

    late: bool = False
    delay: float = 0.0
    turned: bool = False


ORDERS = {
    "now": Order(),
    "late": Order(late=True),
    "told": Order(late=True, delay=1.0),
    "turned": Order(True, 0.0, True),
}


class Partner:
    """Pressures of the built-in trace at a crank angle, as a combustion model would give them."""

    def __init__(self, simulation: Simulation) -> None:
        scalars = simulation.model.scalars
        x = SPEED / scalars[at.BEST_SPEED] - 1.0
        self.share = max(0.0, scalars[at.GAS_LOAD] * (1.0 - scalars[at.FALLOFF] * x * x))
        self.motored, self.rise = simulation.model.gas
        self.phases = simulation.engine.firing_angles

    def pressures(self, angle: float) -> list[float]:
        """Absolute pressures (c,), Pa."""
        after = [angle - phase for phase in self.phases]
        return [float(gas_pressure(a, self.motored) + self.share * gas_pressure(a, self.rise)) for a in after]


def run(level: str, step_deg: float, rule: str, order: Order | None) -> tuple[Array, Array]:
    """Torsion (rad) and shaft torque (N m) over the last two cycles, each (2, SAMPLES); no order: built-in gas."""
    assembly = ct.assemble(ct.load_engine("diesel_i6"), Settings(crank=level, step=math.radians(INTERNAL_DEG)))
    delay = order.delay if order else 0.0
    settings = replace(assembly.settings, reconstruction=rule, gas_delay=delay, integrator="auto")
    simulation = Simulation(assembly.engine, assembly.body, settings, parts=assembly.parts)
    simulation.inputs[0] = SPEED
    simulation.initialize()
    partner = Partner(simulation)
    h = math.radians(step_deg) / SPEED
    count = round(CYCLE / math.radians(step_deg))
    before = angle = simulation.outputs[0]
    kept = np.empty((2 * count, 2))
    shown = [simulation.output_names.index(name) for name in ("pulley.torsion", "shaft.torque")]
    for k in range(CYCLES * count):
        if order is not None:
            read = before if order.late else angle
            simulation.pressures[:] = partner.pressures(read + (SPEED * h if order.turned and k else 0.0))
        simulation.step((k + 1) * h)
        before, angle = angle, simulation.outputs[0]
        kept[k % (2 * count)] = simulation.outputs[shown]
    every = count // SAMPLES
    torsion, torque = kept[every - 1 :: every].T.reshape(2, 2, SAMPLES)
    return torsion, torque


def main() -> int:
    """Measure and print."""
    level = sys.argv[1] if len(sys.argv) > 1 else "torsional"
    torsion, torque = run(level, INTERNAL_DEG, "hold", None)
    swing, mean = float(np.std(torsion[1])), float(torque[1].mean())

    def error(values: Array) -> float:
        return float(np.sqrt(np.mean(values**2))) / swing

    figures: dict[str, object] = {"built-in": {"mean_torque": mean, "repeats": error(torsion[1] - torsion[0])}}
    for rule in (rule for rule in RECONSTRUCTIONS if rule != "stages"):  # whose inputs no communication point gives
        for name, order in ORDERS.items():
            if order.delay > 0.0 and rule != "polytropic":
                continue
            rows = {}
            for step in STEPS_DEG:
                print(f"coupling: {rule}, {name}, {step:g} deg", file=sys.stderr, flush=True)
                found, load = run(level, step, rule, order)
                rows[f"{step:g}"] = {
                    "torsion": error(found[1] - torsion[1]),
                    "mean_torque": float(load[1].mean()) / mean - 1.0,
                    "repeats": error(found[1] - found[0]),
                }
            figures[f"{rule}, {name}"] = rows
    print(json.dumps(figures, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
