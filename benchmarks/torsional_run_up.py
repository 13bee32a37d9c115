"""Torsional run-up in the frequency domain: ``python benchmarks/torsional_run_up.py [ENGINE …]``.

300 speeds from 800 to 2600 rev/min, 48 half orders, by both rules, crank by a formula. Processor time, the least of
three; the trace of the gas pressure, which does not depend on speed, is made before. ``difference`` is the largest of
all orders and speeds between the rules, over the largest amplitude; ``one_speed`` that of the balance from the response
at one speed, solved by GMRES. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import sys
import time
from dataclasses import replace

import numpy as np
from _forced_torsion import torsional_response

from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import load_engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.crank.level import crank_body
from cranktrain.studies.torsion.frequency_run_up import RULES, frequency_run_up

SPEEDS = np.linspace(800.0, 2600.0, 300) * (math.pi / 30.0)
ORDERS = 0.5 * np.arange(1, 49)
SETTINGS = Settings(crank="torsional")


def main() -> int:
    """Measure and print."""
    result = {}
    for name in sys.argv[1:] or ("diesel_i6", "diesel_v8"):
        engine = load_engine(name)
        engine = replace(engine, reduction=replace(engine.reduction, torsional_source="ker-wilson"))
        body, gas = crank_body(engine, "torsional"), GasTrace.from_engine(engine)
        found, seconds = {}, {}
        for rule in RULES:
            taken = []
            for _ in range(3):
                began = time.process_time()
                found[rule] = frequency_run_up(engine, body, SETTINGS, SPEEDS, ORDERS, rule, gas).torsion
                taken.append(time.process_time() - began)
            seconds[rule] = round(min(taken), 3)
        linear, balance = (found[rule] for rule in RULES)
        largest = np.abs(balance).max()
        middle = SPEEDS.size // 2
        alone = torsional_response(engine, body, float(SPEEDS[middle]), gas, highest=24.0).pulley[1:]
        result[name] = {
            "processor_seconds": seconds,
            "difference": float(np.abs(balance - linear).max() / largest),
            "one_speed": float(np.abs(balance[middle] - alone).max() / np.abs(alone).max()),
        }
    print(json.dumps(result, indent=2))
    return 0


if __name__ == "__main__":
    sys.exit(main())
