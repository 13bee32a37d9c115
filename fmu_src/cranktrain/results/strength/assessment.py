"""Acceptability factors of the rule and stress histories for fatigue, from the loads of webs and pins.

Histories use the rule's factors as stress concentrations at every instant. Nominal bending and radial force give stress
along the fillet's profile, torsion gives shear, and both are assumed greatest at the same point. At the rim of an oil
bore the stress is that of a hole in a plate, σ (1 − 2 cos 2φ) − 4 τ sin 2φ at the angle φ from the pin's axis, with the
rule's γ in place of 3 and 4; the worst point counts.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.engine.limits import CrankStrength
from cranktrain.results.strength import iacs_m53
from cranktrain.results.strength.fatigue import FilletHistory, Judgement
from cranktrain.results.strength.iacs_m53 import ThrowShape, fillet_factors, oil_bore_factors
from cranktrain.results.strength.throw_loads import PinLoads, WebLoads

FILLET_GRADIENT = 2.3
"""Relative stress gradient of a fillet times its radius (FKM guideline, shoulders in bending)."""
BORE_GRADIENT = 7.0 / 3.0
"""Relative stress gradient at a hole in a plate under tension times its radius (Kirsch)."""
RIM = 36
"""Number of points on half of the rim of an oil bore."""


class RuleRow(NamedTuple):
    """Rule's assessment of a fillet or oil bore: alternating bending, shear, equivalent stress; strength (Pa); Q."""

    name: str
    bending: float
    shear: float
    equivalent: float
    strength: float
    acceptability: float


def half_range(history: Array) -> float:
    """Alternating part of a history (n,), half its range."""
    return 0.5 * float(np.ptp(history))


def rule_rows(
    throws: Sequence[ThrowShape], strength: CrankStrength, webs: Sequence[WebLoads], pins: Sequence[PinLoads]
) -> list[RuleRow]:
    """Assessment of both fillets of every web, then of the oil bores, by IACS UR M53; ``throws`` by pin.

    An oil bore is assumed on the side of the pin away from the crank's axis, where bending in the throw's plane acts.
    """
    rows = []

    def row(name: str, bending: float, shear: float, diameter: float, radius: float, fillet: bool = True) -> RuleRow:
        present = (iacs_m53.fillet_stress if fillet else iacs_m53.oil_bore_stress)(bending, shear)
        endured = iacs_m53.fatigue_strength(strength, diameter, radius, fillet)
        return RuleRow(name, bending, shear, present, endured, endured / present if present > 0.0 else math.inf)

    for web in webs:
        throw = throws[web.pin - 1]
        factors = fillet_factors(throw)
        bending = iacs_m53.web_bending(throw, half_range(web.bending))
        tension = iacs_m53.web_tension(throw, half_range(web.radial))
        pin, journal = throw.pin_diameter, throw.journal_diameter
        shear = iacs_m53.torsion(pin, throw.pin_bore, half_range(web.pin_torque))
        name = f"web[{web.number}]"
        rows.append(row(f"{name}.pin", factors.alpha_b * bending, factors.alpha_t * shear, pin, throw.pin_fillet))
        shear = iacs_m53.torsion(journal, throw.journal_bore, half_range(web.journal_torque))
        bending = factors.beta_b * bending + factors.beta_q * tension
        rows.append(row(f"{name}.main", bending, factors.beta_t * shear, journal, throw.journal_fillet))
    for load in pins:
        throw = throws[load.number - 1]
        if throw.oil_bore > 0.0:
            gamma_b, gamma_t = oil_bore_factors(throw.oil_bore / throw.pin_diameter)
            bending = gamma_b * iacs_m53.pin_bending(throw, half_range(load.bending))
            shear = gamma_t * iacs_m53.torsion(throw.pin_diameter, throw.pin_bore, half_range(load.torque))
            name = f"pin[{load.number}].oil_bore"
            rows.append(row(name, bending, shear, throw.pin_diameter, 0.5 * throw.oil_bore, False))
    return rows


def nominal_histories(
    throws: Sequence[ThrowShape], angles: Array, webs: Sequence[WebLoads], pins: Sequence[PinLoads]
) -> list[FilletHistory]:
    """Stress histories of both fillets of every web and around every oil bore, from nominal stresses and factors.

    A bore has one history for each of ``RIM`` points, all with the same name. ``converged`` is true if the throw (by
    the number of its pin in ``throws``) lies within the range of validity of the factors.
    """
    found = []

    def history(name: str, along: Array, shear: Array, gradient: float) -> FilletHistory:
        tensor = np.zeros((angles.size, 6))
        tensor[:, 0], tensor[:, 3] = along, shear
        return FilletHistory(name, angles, tensor, gradient, not throw.outside)

    for web in webs:
        throw = throws[web.pin - 1]
        factors = fillet_factors(throw)
        bending, tension = iacs_m53.web_bending(throw, web.bending), iacs_m53.web_tension(throw, web.radial)
        shear = factors.alpha_t * iacs_m53.torsion(throw.pin_diameter, throw.pin_bore, web.pin_torque)
        name = f"web[{web.number}]"
        found.append(history(f"{name}.pin", factors.alpha_b * bending, shear, FILLET_GRADIENT / throw.pin_fillet))
        shear = factors.beta_t * iacs_m53.torsion(throw.journal_diameter, throw.journal_bore, web.journal_torque)
        along = -(factors.beta_b * bending + factors.beta_q * tension)
        found.append(history(f"{name}.main", along, shear, FILLET_GRADIENT / throw.journal_fillet))
    for load in pins:
        throw = throws[load.number - 1]
        if throw.oil_bore > 0.0:
            gamma_b, gamma_t = oil_bore_factors(throw.oil_bore / throw.pin_diameter)
            # Positive bending presses the throw together and causes compression at the outer side of the pin, where the
            # bore is.
            bending = -gamma_b / 3.0 * iacs_m53.pin_bending(throw, load.bending)
            shear = gamma_t / 4.0 * iacs_m53.torsion(throw.pin_diameter, throw.pin_bore, load.torque)
            for turn in np.linspace(0.0, math.pi, RIM, endpoint=False):
                along = bending * (1.0 - 2.0 * math.cos(2.0 * turn)) - 4.0 * shear * math.sin(2.0 * turn)
                name = f"pin[{load.number}].oil_bore"
                found.append(history(name, along, np.zeros_like(along), 2.0 * BORE_GRADIENT / throw.oil_bore))
    return found


def judged(
    histories: Sequence[FilletHistory],
    strength: CrankStrength,
    judge: Callable[[FilletHistory, CrankStrength], Judgement],
) -> list[Judgement]:
    """Worst judgement among the stress histories of each name, in the order of the histories."""
    worst: dict[str, Judgement] = {}
    for history in histories:
        found = judge(history, strength)
        if history.name not in worst or found.safety_factor < worst[history.name].safety_factor:
            worst[history.name] = found
    return list(worst.values())
