"""Burn fraction at which the engine's mean torque equals the torque of its ``[load]`` at a speed.

The gas of c cylinders has the mean torque M = c ⟨p dV/dθ⟩; rods and pistons have no mean torque. Between motored and
full-load pressure M is linear in the fraction s of the burn,

    M(s) = M_0 + s (M_1 − M_0),    s = (T(Ω) − M_0)/(M_1 − M_0)

A run burns the fraction s = load (1 − falloff (Ω/Ω_b − 1)²) of the trace, which gives its ``load``.
"""

import math

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.units import RPM
from cranktrain.engine.model import Engine
from cranktrain.loads.cylinder_volume import cylinder_volume
from cranktrain.loads.gas_pressure import Gas, GasTrace

MOST = 2.0
"""Largest fraction of the full-load burn."""
_SETTLED, _ROUNDS = 1e-6, 50


def mean_torques(engine: Engine, gas: GasTrace) -> tuple[float, float]:
    """Return the mean torques of the gas, N m, motored and with the full burn of the trace."""
    angle = np.arange(gas.fired.size, dtype=np.float64) * (4.0 * math.pi / gas.fired.size)
    hung = [c for c, joint in enumerate(engine.articulations) if joint is not None]
    arm = (engine.n_cylinders - len(hung)) * cylinder_volume(engine, angle)[1]
    for c in hung:
        arm = arm + cylinder_volume(engine, angle, c)[1]
    return float(np.mean(gas.motored * arm)), float(np.mean(gas.fired * arm))


def mean_torque(engine: Engine, gas: GasTrace, speed: float) -> float:
    """Return the mean torque of the gas, N m, at a ``speed``, rad/s, with the full-load burn at this speed."""
    motored, full = mean_torques(engine, gas)
    return motored + full_share(gas, speed) * (full - motored)


def full_share(gas: GasTrace, speed: float) -> float:
    """Return the fraction of the trace's burn at full load and a ``speed``, rad/s."""
    return max(1.0 - gas.falloff * (speed / gas.best_speed - 1.0) ** 2, 0.0)


def balancing_load(engine: Engine, gas: Gas, speed: float) -> float:
    """Return the fraction of the full-load burn that balances the engine's load at a ``speed``, rad/s.

    Raises
    ------
    InputError
        if the engine has no ``[load]``, or cannot give its torque at this speed
    """
    if engine.load is None:
        raise InputError(
            f"engine '{engine.name}' has no [load]; add that table (kind, speed, torque or power), or give a fraction"
        )
    wanted, load = engine.load.torque_at(speed), 1.0
    for _ in range(_ROUNDS):  # iterated, because a trace of a map depends on the load
        before, load = load, _balance(engine, gas.at(speed, load), speed, wanted)
        if abs(load - before) <= _SETTLED * load:
            break
    return load


def _balance(engine: Engine, gas: GasTrace, speed: float, wanted: float) -> float:
    """Return the fraction of the burn at which a single trace gives the mean torque ``wanted``, N m."""
    motored, full = mean_torques(engine, gas)
    gain = full_share(gas, speed) * (full - motored)
    most = motored + MOST * gain
    if not motored < wanted <= most:
        raise InputError(
            f"[load] asks for {wanted:.4g} N m at {speed / RPM:.4g} rev/min, where the engine gives "
            f"{max(motored, 0.0):.4g} to {most:.4g} N m; change load.torque or load.power, or the speed"
        )
    return (wanted - motored) / gain
