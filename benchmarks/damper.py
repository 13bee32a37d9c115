"""What a torsional damper does, in the frequency domain and in time: ``python benchmarks/damper.py [ENGINE ORDER …]``.

For each order (by default 8 and 12 of the V8) the speed at which the pulley's torsion is largest without damper, in the
frequency domain; there, its amplitude without and with the damper, both ways; and the largest amplitude with damper
around that speed. Bearings at level ``linear``, full load, damper as warm as its table says. Runs in time take 14
cycles at steps of 1 degree. Prints one JSON object; ``ratio`` is with over without damper, ``deviation`` the run's
ratio over the predicted one less 1.
"""

from __future__ import annotations

import json
import math
import sys

import numpy as np
from _forced_torsion import Ring, forced_torsion, order_peak

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.dynamics.simulation import Settings, simulate
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.loads.damper import damper_parameters, damper_temperature, required_damper, with_damper_housing
from cranktrain.structure.crank.modal import cranktrain_modes, torsional_frequencies
from cranktrain.structure.crank.reduction import complete_crankshaft, reduced_crankshaft, running_body

RPM = math.pi / 30.0
BAND = 0.65, 1.1
CYCLES = 14


def main() -> int:
    """Measure and print."""
    name, *orders = sys.argv[1:] or ["diesel_v8", "8", "12"]
    engine = load_engine(name)
    damper = required_damper(engine)
    bare = reduced_crankshaft(engine)
    housed = with_damper_housing(engine)
    body, housed_body = running_body(engine, bare), running_body(housed, bare)
    torsional = torsional_frequencies(*cranktrain_modes(engine, complete_crankshaft(engine, bare)))[0]
    result = {}
    for order in (float(text) for text in orders):
        print(f"damper: {engine.name}, order {order:g}", file=sys.stderr, flush=True)
        middle = 2.0 * math.pi * torsional / order
        band = (BAND[0] * middle, BAND[1] * middle)
        free = order_peak(engine, body, order, band)
        ring = Ring(damper_parameters(damper, damper_temperature(damper, free.speed)), damper.ring_inertia)
        damped = forced_torsion(housed, housed_body, free.speed, ring)
        peak = order_peak(housed, housed_body, order, band, ring)
        run = run_amplitude(engine, body, free.speed, order, "none")
        damped_run = run_amplitude(housed, housed_body, free.speed, order, "fitted")
        predicted = damped.amplitude(order) / free.amplitude(order)
        result[f"order {order:g}"] = {
            "rpm": free.speed / RPM,
            "predicted_deg": [math.degrees(free.amplitude(order)), math.degrees(damped.amplitude(order))],
            "run_deg": [math.degrees(run), math.degrees(damped_run)],
            "predicted_ratio": predicted,
            "run_ratio": damped_run / run,
            "deviation": damped_run / run / predicted - 1.0,
            "power_w": damped.power,
            "peak_with_damper": {"rpm": peak.speed / RPM, "deg": math.degrees(peak.amplitude(order))},
            "peak_ratio": peak.amplitude(order) / free.amplitude(order),
        }
    print(json.dumps(result, indent=1))
    return 0


def run_amplitude(engine: Engine, body: ReducedBody, speed: float, order: float, damper: str) -> float:
    """Amplitude of the pulley's torsion of an order in a run's last cycle, rad."""
    settings = Settings(bearings="linear", step=math.radians(1.0), damper=damper)
    run = simulate(engine, body, settings, speed, CYCLES)
    signal = run.outputs["pulley.torsion"][-1 - run.per_cycle : -1]
    return float(2.0 / signal.size * np.abs(np.fft.rfft(signal)[round(2.0 * order)]))


if __name__ == "__main__":
    sys.exit(main())
