"""Spark-ignition cycles against those of a chemistry library, ``tests/data/spark_reference.json``."""

import json
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from combustion_cycles import RPM, output, turn

from cranktrain.modules.combustion import slots as at
from cranktrain.modules.combustion.gas import enthalpy, gas_table, stoichiometric_air
from cranktrain.modules.combustion.mixture import mixture, vapour_shift
from cranktrain.modules.combustion.settings import CycleSettings
from cranktrain.modules.combustion.simulation import CombustionSimulation

REFERENCE = json.loads((Path(__file__).parents[1] / "data" / "spark_reference.json").read_text("utf-8"))
HYDROGEN = 18.0 / 8.0
HEATING_VALUE = 44.65e6
"""Of iso-octane vapour, J/kg; see :func:`test_heating_value`."""
SPEED = 3000.0 * RPM


def settings(**changes):
    """The reference's cylinder, closed and without wall heat."""
    usual = dict(
        name="reference", title="reference", bore=REFERENCE["bore"], stroke=REFERENCE["stroke"],
        rod_length=REFERENCE["rod"], compression_ratio=REFERENCE["compression_ratio"], firing_angles=(0.0,),
        sparks=1.0, intake_pressure=1e5, intake_temperature=360.0, exhaust_pressure=1e5, exhaust_temperature=900.0,
        wall_temperature=400.0, wall_factor=0.0, injection_angle=math.radians(REFERENCE["spark_deg"]),
        heating_value=HEATING_VALUE, hydrogen_per_carbon=HYDROGEN, reference_speed=SPEED,
        premixed_duration=math.radians(REFERENCE["duration_deg"]), premixed_exponent=REFERENCE["exponent"],
        intake_diameter=0.03, intake_count=2, intake_opens=-6.4, intake_closes=-2.0, intake_lift=0.0,
        exhaust_diameter=0.03, exhaust_count=2, exhaust_opens=2.4, exhaust_closes=6.4, exhaust_lift=0.0,
        curtain=0.65, port=0.75, start_cycles=0.0, angle_source="speed", tolerance=1e-8,
    )  # fmt: skip
    return CycleSettings(**(usual | changes))


@cache
def cycle(name):
    """Pressures, Pa, of the module at whole degrees from the closing to the opening of the valves."""
    burns = REFERENCE["cases"][name].get("burns", 1.0)
    return burn(name, burn(name, 1.0)[1] if burns else 1.0)[0]


def burn(name, factor):
    """Pressures with a burn's duration over ``factor``, and the duration that came out over the reference's."""
    case, made = REFERENCE["cases"][name], settings()
    made = settings(premixed_duration=made.premixed_duration / factor)
    simulation = CombustionSimulation(made)
    simulation.inputs[0], simulation.inputs[1] = SPEED, math.radians(REFERENCE["closes_deg"])
    simulation.initialize()
    state, base = simulation.state, simulation.bases[0]
    share, t, mass = case["residual"], case["temperature"], case["mass"]
    fuel = mass * (1.0 - share) / (1.0 + case["air_ratio"] * stoichiometric_air(HYDROGEN))
    ratio = 1.0 / case["air_ratio"]
    h, _, r, _ = mixture(simulation._model, share, fuel / mass, ratio, case["pressure"] / t, t)
    state[base + at.MASS], state[base + at.PRODUCTS], state[base + at.VAPOUR] = mass, share * mass, fuel
    state[base + at.ENERGY], state[base + at.RATIO] = mass * (h - r * t), ratio
    state[base + at.TEMPERATURE], state[base + at.PRESSURE] = t, case["pressure"]
    # Closed valves have their state kept, for Woschni's motored pressure.
    state[base + at.CLOSED] = state[base + at.CLOSED_VOLUME] = state[base + at.CLOSED_PRESSURE] = 1.0
    if case.get("burns", 1.0):
        state[base + at.PHASE], state[base + at.SOI] = at.ARMED, made.injection_angle
    else:
        state[base + at.PHASE] = at.BURNING
    simulation.state = state
    first = output(simulation, simulation.outputs, "cylinder[1].pressure")
    rows = turn(simulation, REFERENCE["opens_deg"] - REFERENCE["closes_deg"], 1.0)
    pressures = np.concatenate([[case["pressure"]], output(simulation, rows, "cylinder[1].pressure")])
    duration = output(simulation, rows[-1], "cylinder[1].burn_duration") / made.premixed_duration
    return pressures, duration


if __name__ == "__main__":
    for name, case in REFERENCE["cases"].items():
        own = cycle(name)
        for kind in ("one_zone", "two_zones"):
            ref = np.array(case[kind])
            d = own / ref - 1
            k = np.abs(d).argmax()
            print(f"{name:12s} {kind:10s} worst {100*d[k]:+.3f} % at {REFERENCE['closes_deg']+k:.0f}, peak {100*(own.max()/ref.max()-1):+.3f} %, of peak {100*np.abs(own-ref).max()/ref.max():.3f} start {100*(own[1]/ref[1]-1):.3f}")
