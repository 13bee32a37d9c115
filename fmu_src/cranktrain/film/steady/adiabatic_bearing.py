"""Steady bearing whose oil warms along the film, with equilibrium, viscosity and temperature solved together.

The viscosity at each angle follows from the oil temperature at this angle, uniform over gap and width
(:mod:`cranktrain.film.steady.adiabatic_film`). Film, equilibrium and temperature are solved alternately until no
temperature changes by more than ``SETTLED``. Stiffness and damping are those for a fixed temperature field.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.reduced_body import Array
from cranktrain.engine.lubricant import viscosity
from cranktrain.engine.parts import Oil
from cranktrain.film.steady.adiabatic_film import Warmth, film_rows, temperatures
from cranktrain.film.steady.bearing import Journal, SteadyState
from cranktrain.film.steady.mixed_bearing import MixedBearing

SETTLED = 0.01
"""Tolerance of the temperatures, K."""
TURNS = 60
RELAXATION = 0.7
"""Relaxation factor of the temperature change in each iteration."""


@dataclass(frozen=True)
class AdiabaticBearing:
    """Equilibrium of a bearing with the temperatures of its film.

    Attributes
    ----------
    state : the equilibrium
    angle, temperature : (n,) increasing angle from the load in the sense of rotation, rad, and temperature, K
    mixed : temperature after the supply, K (after the first of several supplies)
    outlet : mean temperature of the oil that leaves at the ends, K
    heat : heat that the oil takes up, W
    """

    state: SteadyState
    angle: Array
    temperature: Array
    mixed: float
    outlet: float
    heat: float


class _Field:
    """Viscosity over the angle, as a factor of the viscosity at supply temperature."""

    def __init__(self, oil: Oil, supply: float, angle: Array, temperature: Array) -> None:
        ratio = [viscosity(oil, float(one)) / viscosity(oil, supply) for one in temperature]
        order = np.argsort(angle % (2.0 * math.pi))
        self.angle, self.ratio = (angle % (2.0 * math.pi))[order], np.array(ratio)[order]
        self.temperature = temperature[order]

    def __call__(self, angle: Array) -> Array:
        return np.interp(angle, self.angle, self.ratio, period=2.0 * math.pi)

    def at(self, angle: Array) -> Array:
        """Return the temperature at angles, K."""
        return np.interp(angle, self.angle, self.temperature, period=2.0 * math.pi)


def adiabatic_bearing(
    oil: Oil,
    supply: float,
    bearing: MixedBearing,
    journal: Journal,
    load: float | None,
    place: tuple[float, float] = (0.0, 0.0),
    carried: float = 1.0,
) -> AdiabaticBearing:
    """Solve a bearing whose oil takes up the fraction ``oil.heat_share`` of the friction along the film.

    Parameters
    ----------
    oil : viscosity law, density, heat capacity, and the fraction of the friction that stays in the oil (1: adiabatic)
    supply : temperature of the supplied oil, K
    bearing : bearing with mass-conserving cavitation and a supply
    journal : journal, whose viscosity is replaced by that at supply temperature
    load, place : as for :meth:`MixedBearing.state`
    carried : fraction of the hot oil that the journal carries past a supply

    Raises
    ------
    InputError
        if the film does not conserve oil, or a fraction lies outside [0, 1]
    SolverError
        if there is no equilibrium, or temperatures do not converge
    """
    around = bearing.around
    if around.cavitation != "mass-conserving":
        raise InputError("adiabatic film: heat travels with the oil, so oil must be conserved; take mass-conserving")
    if not 0.0 <= carried <= 1.0:
        raise InputError(f"adiabatic film: carried fraction {carried:g} of the hot oil is not within 0 to 1")
    journal = replace(journal, viscosity=viscosity(oil, supply))
    field: _Field | None = None
    for _ in range(TURNS):
        own = MixedBearing(replace(around, thinning=field), bearing.supply, bearing.grid, bearing.groove)
        running, y, steps = own.solved(journal, load, None, place)
        loads = running.loads(y)
        radius = journal.radius
        rows = film_rows(loads.film, journal.speed * radius, 2.0 * math.pi * radius, loads.rows)
        phi = running.nodes.phi
        found: Warmth = temperatures(
            rows, running.nodes.fed, supply, oil.density * oil.heat_capacity, oil.heat_share, carried
        )
        before = np.full(phi.size, supply) if field is None else field.at(phi)
        change = found.temperature - before
        if field is not None and np.abs(change).max() < SETTLED:
            state = running.result(y, steps)
            towards = math.atan2(-loads.force[1], -loads.force[0])
            angle = (phi - towards) % (2.0 * math.pi)
            order = np.argsort(angle)
            fed = int(np.flatnonzero(running.nodes.fed & ~np.roll(running.nodes.fed, -1))[0])
            return AdiabaticBearing(
                state, angle[order], found.temperature[order], float(found.temperature[fed]), found.outlet, found.heat
            )
        field = _Field(oil, supply, phi, before + (1.0 if field is None else RELAXATION) * change)
    raise SolverError(
        f"adiabatic film: temperatures did not settle within {TURNS} turns, the last one changed them by "
        f"{np.abs(change).max():.2g} K; take a smaller load or speed, or the heat balance of the whole film"
    )
