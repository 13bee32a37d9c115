"""Steady bearing whose viscosity follows from its friction heat: equilibrium and heat balance solved together."""

from collections.abc import Callable
from dataclasses import dataclass

from cranktrain.engine.lubricant import viscosity
from cranktrain.engine.parts import Oil
from cranktrain.film.steady.bearing import SteadyState
from cranktrain.film.steady.heat_balance import MEAN, effective_temperature


@dataclass(frozen=True)
class WarmBearing:
    """Result: equilibrium at the ``viscosity`` (Pa s) of the ``effective`` temperature; ``outlet`` temperature (K)."""

    state: SteadyState
    effective: float
    outlet: float
    viscosity: float


def warm_bearing(oil: Oil, inlet: float, speed: float, run: Callable[[float], SteadyState]) -> WarmBearing:
    """Solve a bearing with the heat balance λ P = ρ c_p Q (T_out − T_in), viscosity at the mean of both temperatures.

    Parameters
    ----------
    oil : oil with viscosity law, density, heat capacity and the fraction λ of the friction that heats the oil
    inlet : temperature of the supplied oil, K
    speed : speed of the journal, rad/s
    run : function that returns the equilibrium at a viscosity (Pa s); its flow out of the ends carries the heat

    Raises
    ------
    InputError, SolverError
        those of :func:`cranktrain.film.steady.heat_balance.effective_temperature` and of ``run``
    """
    states: dict[float, SteadyState] = {}

    def at(eta: float) -> SteadyState:
        if eta not in states:
            states[eta] = run(eta)
        return states[eta]

    warm = effective_temperature(oil, inlet, lambda eta: at(eta).friction_torque * speed, lambda eta: at(eta).flow)
    eta = viscosity(oil, warm)
    return WarmBearing(at(eta), warm, inlet + (warm - inlet) / MEAN, eta)
