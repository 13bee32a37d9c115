"""Temperatures of the main bearings' films, from the heat balance of each over a cycle of a run.

A journal's work on its film over a cycle, friction torque times speed plus the work of its centre against the force,
becomes heat. A fraction of it leaves with the oil that pressure drives out of both ends, the rest through journal and
housing (:mod:`cranktrain.film.steady.heat_balance`). The oil is supplied at the engine's temperature. A bearing warms
up in seconds or more, but a cycle takes hundredths of a second. So the balance uses mean values, and the film's
temperature is constant over the cycle.

``adiabatic`` leaves all of the heat in the oil, which warms along the film; the film's viscosity is the mean over its
length (:func:`cranktrain.film.steady.heat_balance.adiabatic_temperature`).

The power of a journal's tilting is left out; big ends and the thrust bearing stay at the engine's temperature.
"""

from collections.abc import Mapping

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import PLAIN, bearing_law, bearing_levels
from cranktrain.film.steady.heat_balance import adiabatic_temperature, balanced_temperature

SETTLED = 0.5
"""Largest change of a film's temperature (K) at which the heat balance counts as settled."""
PASSES = 6
"""Most runs that a heat balance repeats."""


def check_level(bearings: str) -> None:
    """Raise ``InputError`` for a bearing level without oil films."""
    if not bearing_law(bearings).film:
        oiled = [level for level in bearing_levels(PLAIN) if bearing_law(level).film]
        raise InputError(
            f"bearing level '{bearings}' has no oil that friction warms; "
            f"choose {', '.join(oiled[:-1])} or {oiled[-1]}, or film temperature 'engine'"
        )


def cycle_means(outputs: Mapping[str, Array], bearings: int, samples: int) -> tuple[Array, Array]:
    """Mean friction power (W) and oil flow (m³/s) of each main bearing, (b,), over the last ``samples``.

    ``outputs`` are time series of the running model, evenly spaced.
    """
    powers, flows = np.zeros(bearings), np.zeros(bearings)
    for i in range(bearings):

        def last(name: str, of: str = f"bearing[{i + 1}]") -> Array:
            return outputs[f"{of}.{name}"][-samples:]

        shear = last("friction_torque") * last("speed.relative")
        squeeze = last("force.x") * last("velocity.x") + last("force.y") * last("velocity.y")
        powers[i], flows[i] = (shear - squeeze).mean(), last("oil_flow").mean()
    return powers, flows


def balanced_temperatures(
    engine: Engine, inlet: float, temperatures: Array, powers: Array, flows: Array, adiabatic: bool = False
) -> tuple[Array, tuple[str, ...]]:
    """Balanced temperatures (b,), K, of films that ran at ``temperatures``; and for each the reason for a bound, or "".

    Rollers stay at the inlet's temperature.
    """
    balance = adiabatic_temperature if adiabatic else balanced_temperature
    found = [
        balance(engine.oil, inlet, *map(float, values)) if i in engine.plain_numbers else (inlet, "")
        for i, values in enumerate(zip(temperatures, powers, flows, strict=True))
    ]
    return np.array([temperature for temperature, _ in found]), tuple(bound for _, bound in found)
