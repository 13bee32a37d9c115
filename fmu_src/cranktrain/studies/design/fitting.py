"""Values of a new engine file that are fitted on the engine itself: heat, counterweights and flywheel."""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.loads.cylinder_volume import cylinder_volume
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.crank.sections import bare_outline, crank_moments, web_moments
from cranktrain.studies.design.balance import free_forces
from cranktrain.studies.design.layouts import BOXER
from cranktrain.studies.design.sizes import SKIRT, Sizes

STEEL = 7850.0
"""Density of the crankshaft and of discs, kg/m³."""
FALLOFF = 0.25
"""Fraction by which the heat per cycle is lower at twice the speed of the largest torque."""
IRREGULARITY = 0.15
"""Degree of irregularity at the lowest speed and full load, (largest − least speed)/mean speed."""
GYRATION = 1.35
"""Radius of gyration of the flywheel over the larger of bore and throw."""
LEAST_FLYWHEEL = 1.5
"""Least mass of the flywheel, for a clutch, over the mass of a steel cube whose edge is the bore."""
AMBIENT = 1e5
"""Pressure in the crankcase, Pa."""
BISECTIONS = 40


class Fitted(NamedTuple):
    """Values of a new engine that are fitted by evaluating the engine with all its other values.

    Attributes
    ----------
    heat : of a cycle, J
    radius, balanced : of the counterweights, m, and the part of the masses that they balance
    flywheel : its polar inertia, kg m²
    """

    heat: float
    radius: float
    balanced: float
    flywheel: float


def full_load(s: Sizes) -> float:
    """Mean effective pressure at the speed of the largest torque, Pa, that gives the required one at rated speed."""
    return s.imep / (1.0 - FALLOFF * (s.rated / s.best - 1.0) ** 2)


def balanced_mass(s: Sizes) -> str:
    """Text on the masses that the counterweights balance."""
    return "the rotating masses of the throw" + (" and half the oscillating ones" if oscillating(s) else "")


def oscillating(s: Sizes) -> float:
    """Fraction of the oscillating masses that counterweights balance; half if the layout has a free first order."""
    free = free_forces(s.layout)
    return 0.5 if s.layout.form != BOXER and max(free.first, free.first_moment) > 1e-6 else 0.0


def counterweight(s: Sizes, engine: Engine) -> tuple[float, float]:
    """Radius, m, of half discs that balance a throw, and the fraction of the masses that they balance."""
    # Masses of one throw with both its webs; a pair of split pins counts as one throw.
    crank, pins = engine.crankshaft, 2 if s.layout.split else 1
    rods = pins * s.rods_on_pin
    pin = pins * 0.25 * math.pi * crank.pin_diameter**2 * crank.pin_width * STEEL
    moving = rods * (s.big_end_mass + oscillating(s) * (s.small_end_mass + s.piston_mass))

    def moment(radius: float) -> float:
        """Static moment of both webs along the throw, kg m."""
        own = bare_outline(crank, crank.throw)._replace(weight_radius=radius, weight_half_width=radius)
        return 2.0 * STEEL * s.web * float(web_moments(own)[0, 2])

    wanted = (pin + moving) * s.throw + moment(0.0)
    low, high = (s.proportions.about_main + 0.005) * s.bore, s.rod_length - s.throw - SKIRT * s.bore
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if wanted + moment(middle) - moment(0.0) > 0.0 else (low, middle)
    return high, (moment(0.0) - moment(high)) / wanted


def flywheel_inertia(s: Sizes, engine: Engine, trace: GasTrace) -> float:
    """Polar inertia, kg m², that keeps the irregularity at the lowest speed with crank, rods and pistons.

    The excess work is that of the gas torque of all cylinders over its mean. The disc that a clutch needs remains where
    the crank alone has this inertia.
    """
    _, slope = cylinder_volume(engine, trace.angles)
    one = (trace.fired - AMBIENT) * slope
    shifted = [
        np.interp(trace.angles - firing, trace.angles, one, period=4.0 * math.pi) for firing in engine.firing_angles
    ]
    torque: Array = np.sum(shifted, axis=0)
    excess = float(np.ptp(np.cumsum(torque - torque.mean()))) * 4.0 * math.pi / torque.size
    wanted = excess / (IRREGULARITY * s.lowest**2) - crank_inertia(s, engine)
    return max(wanted, LEAST_FLYWHEEL * STEEL * s.bore**3 * gyration(s) ** 2)


def crank_inertia(s: Sizes, engine: Engine) -> float:
    """Polar inertia of crankshaft and mean rods, without flywheel and pulley, kg m²."""
    moments = crank_moments(engine)
    rods = engine.n_cylinders * (s.big_end_mass + 0.5 * (s.small_end_mass + s.piston_mass)) * s.throw**2
    return float(moments[1, 1] + moments[2, 2]) + rods


def gyration(s: Sizes) -> float:
    """Radius of gyration of the flywheel, m."""
    return GYRATION * max(s.bore, s.throw)
