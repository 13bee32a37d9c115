"""A steady bearing whose viscosity follows from its own heat: equilibrium and heat balance together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from cranktrain.engine.lubricant import viscosity
from cranktrain.engine.parts import Oil
from cranktrain.film.steady.bearing import SteadyState
from cranktrain.film.steady.heat_balance import MEAN, effective_temperature


@dataclass(frozen=True)
class WarmBearing:
    """Equilibrium at the ``viscosity`` (Pa s) of the ``effective`` temperature; oil leaves at ``outlet`` (both K)."""

    state: SteadyState
    effective: float
    outlet: float
    viscosity: float


def warm_bearing(oil: Oil, inlet: float, speed: float, run: Callable[[float], SteadyState]) -> WarmBearing:
    """Bearing at which λ P = ρ c_p Q (T_out − T_in), viscosity taken at the mean of both temperatures.

    Parameters
    ----------
    oil : viscosity law, density, heat capacity and the share λ of the friction that warms it
    inlet : temperature of the oil supplied, K
    speed : of the journal, rad/s
    run : equilibrium at a viscosity (Pa s); its flow out of the ends carries the heat

    Raises
    ------
    InputError, SolverError
        of :func:`cranktrain.film.steady.heat_balance.effective_temperature` and of ``run``
    """
    states: dict[float, SteadyState] = {}

    def at(eta: float) -> SteadyState:
        if eta not in states:
            states[eta] = run(eta)
        return states[eta]

    warm = effective_temperature(oil, inlet, lambda eta: at(eta).friction_torque * speed, lambda eta: at(eta).flow)
    eta = viscosity(oil, warm)
    return WarmBearing(at(eta), warm, inlet + (warm - inlet) / MEAN, eta)
