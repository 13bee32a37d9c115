"""Warnings of implausible runs: a fired cycle that takes work, a speed without heat, a load that drives or stalls."""

from collections.abc import Iterator

import numpy as np

from cranktrain.core.units import RPM
from cranktrain.engine.checks.plausible import COMPRESSOR, heat_of_air
from cranktrain.engine.model import Engine
from cranktrain.loads.cylinder_volume import mean_effective_pressure
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.loads.mean_load import full_share

MOST_LOAD = 1.05
"""Largest load torque, over the mean torque of the gas, at which an engine can hold its speed."""


def run_doubts(engine: Engine, gas: GasTrace, speed: float, load: float, load_torque: float | None) -> Iterator[str]:
    """Yield warnings of a run at ``speed`` (rad/s), ``load`` and an optional load torque (N m)."""
    share = max(load, 0.0) * full_share(gas, speed)
    if load > 0.0 and share == 0.0:
        yield (
            f"combustion.falloff: {gas.falloff:.3g} leaves no heat at {speed / RPM:.5g} rev/min, "
            f"{speed / gas.best_speed:.3g} times best_speed; the run is motored, lessen it or give a measured trace"
        )
    motored = float(np.mean([mean_effective_pressure(engine, own.motored) for own in gas.own or (gas,)]))
    work = motored + share * (gas.imep - motored)
    burns = share > 0.0 and not heat_of_air(engine) < COMPRESSOR
    if burns and gas.built_in and work <= 0.0:
        yield (
            f"the mean effective pressure is {1e-5 * work:.3g} bar at load {load:g}, so a fired run takes work; check "
            "combustion.heat, intake_pressure and exhaust_pressure"
        )
    if load_torque is None or not burns:
        return
    torque = work * engine.displacement / engine.cylinders.cycle
    if load_torque < 0.0:
        yield f"a load torque of {load_torque:.4g} N m drives the fired engine; a load is positive"
    elif engine.drive_line_chain is None and load_torque > MOST_LOAD * torque:
        yield (
            f"a load torque of {load_torque:.4g} N m is more than the gas gives, {torque:.4g} N m in the mean; the "
            "engine slows down and stalls"
        )
