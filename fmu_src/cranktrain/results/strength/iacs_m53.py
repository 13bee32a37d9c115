"""Rule IACS UR M53 for crankshafts: stress factors of fillets and oil bores, equivalent stress, fatigue strength.

Nominal stresses are those of the web, M/(B W²/6) and Q/(B W), and of pin and journal in torsion, 16 T D/(π(D⁴ − D_B⁴)).
Empirical factors convert them to stresses in the fillets of pin (α) and journal (β) and at the outlet of the pin's oil
bore (γ). The rule uses half the range over a cycle of each nominal stress. With σ_add for effects that a single throw
does not include, the equivalent alternating stresses are

    fillets    σ_v = √((σ_B + σ_add)² + 3 τ²)
    oil bore   σ_v = (σ_BO + 2 √(σ_BO² + 9/4 σ_TO²))/3

and the acceptability factor Q = σ_DW/σ_v must be 1.15 or more.

Source: IACS Unified Requirement M53, Calculation of crankshafts for I.C. engines, Rev. 1 (2004), sections 2 to 7. In
the empirical formulas lengths are over the pin's diameter D: overlap s, web thickness w and width b, fillet r, bores d.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.engine.limits import CrankStrength
from cranktrain.engine.parts import Crankshaft
from cranktrain.structure.crank.sections import bare_outline, web_width

Load = TypeVar("Load", float, Array)
ACCEPTABLE = 1.15
"""Least acceptability factor Q that the rule permits."""
ADDITIONAL_BENDING = 10.0e6
"""Alternating bending stress from misalignment, block deformation, axial and bending vibrations; trunk pistons, Pa."""
FORMING_FACTORS = {"grain-flow": 1.05, "free-form": 1.0, "cast-rolled": 0.93}
"""Factor K of the rule for the fatigue strength in fillets, by forming process."""
SMALLEST_RADIUS = 2.0e-3
"""Fillets and bores of a smaller radius are treated as having this radius, m."""
RANGES = {
    "s": (-math.inf, 0.5), "w": (0.2, 0.8), "b": (1.1, 2.2), "r_pin": (0.03, 0.13), "r_journal": (0.03, 0.13),
    "d_pin": (0.0, 0.8), "d_journal": (0.0, 0.8), "d_oil": (0.0, 0.2),
}  # fmt: skip
"""Range of validity (least, largest) of each ratio in the empirical formulas."""
_LEAST_OVERLAP = -0.5


@dataclass(frozen=True, kw_only=True)
class ThrowShape:
    """Dimensions of one throw in the rule's sense, m; bores are holes along the axes of pin and journal.

    ``web_width`` is the width halfway between journal and pin; recesses are depths of the fillets in the web.
    """

    pin_diameter: float
    journal_diameter: float
    throw: float
    web_thickness: float
    web_width: float
    pin_fillet: float
    journal_fillet: float
    oil_bore: float = 0.0
    pin_bore: float = 0.0
    journal_bore: float = 0.0
    pin_recess: float = 0.0
    journal_recess: float = 0.0

    @property
    def ratios(self) -> dict[str, float]:
        """Ratios of dimensions in the rule's formulas: lengths s, w, b, r and d over the pin's diameter, by name."""
        d = self.pin_diameter
        return {
            "s": (0.5 * (d + self.journal_diameter) - self.throw) / d,
            "w": self.web_thickness / d,
            "b": self.web_width / d,
            "r_pin": self.pin_fillet / d,
            "r_journal": self.journal_fillet / d,
            "d_pin": self.pin_bore / d,
            "d_journal": self.journal_bore / d,
            "d_oil": self.oil_bore / d,
        }

    @property
    def outside(self) -> tuple[str, ...]:
        """Texts on ratios outside the empirical formulas' range of validity, such as ``s = 0.557 (at most 0.5)``."""
        found = []
        for name, value in self.ratios.items():
            low, high = RANGES[name]
            if not low <= value <= high:
                found.append(f"{name} = {value:.3g} ({f'at most {high:g}' if value > high else f'at least {low:g}'})")
        return tuple(found)


def throw_shape(c: Crankshaft, pin: int) -> ThrowShape:
    """Throw of a pin (from 1) of a parametric crankshaft, with the web's width halfway between journal and pin."""
    throw = c.throws[pin - 1]
    middle = 0.5 * (0.5 * c.main_diameter + throw - 0.5 * c.pin_diameter)
    return ThrowShape(
        pin_diameter=c.pin_diameter,
        journal_diameter=c.main_diameter,
        throw=throw,
        web_thickness=c.web_thickness,
        web_width=float(web_width(bare_outline(c, throw), np.array([middle]))[0]),
        pin_fillet=c.fillet,
        journal_fillet=c.fillet,
        oil_bore=c.oil_hole_diameter,
    )


class FilletFactors(NamedTuple):
    """Stress concentration factors of pin (α) and journal (β) in bending, radial force and torsion."""

    alpha_b: float
    alpha_t: float
    beta_b: float
    beta_q: float
    beta_t: float


def fillet_factors(throw: ThrowShape) -> FilletFactors:
    """Empirical stress concentration factors of the fillets; their range of validity is :attr:`ThrowShape.outside`.

    Bending and radial force give a von Mises stress, torsion a shear stress. UR M53, section 3.
    """
    of = throw.ratios
    s, w, b, d_g, d_h = max(of["s"], _LEAST_OVERLAP), of["w"], of["b"], of["d_journal"], of["d_pin"]
    gap = 1.0 - s
    recess = (throw.pin_recess + throw.journal_recess) / throw.pin_diameter
    recessed = max(1.0 + recess * (1.8 + 3.2 * s), 1.0)
    f_sw = (
        _polynomial(w, -4.1883, 29.2004, -77.5925, 91.9454, -40.0416)
        + gap * _polynomial(w, 9.5440, -58.3480, 159.3415, -192.5846, 85.2916)
        + gap**2 * _polynomial(w, -3.8399, 25.0444, -70.5571, 87.0328, -39.1832)
    )
    alpha_b = (
        2.6914 * f_sw * 2.1790 * w**0.7171 * _polynomial(b, 0.6840, -0.0077, 0.1473) * 0.2081 * of["r_pin"] ** -0.5231
        * _polynomial(d_g, 0.9993, 0.27, -1.0211, 0.5306) * _polynomial(d_h, 0.9978, 0.3145, -1.5241, 2.4147)
    )  # fmt: skip
    g_sw = (
        _polynomial(w, -1.7625, 2.9821, -1.5276)
        + gap * _polynomial(w, 5.1169, -5.8089, 3.1391)
        + gap**2 * _polynomial(w, -2.1567, 2.3297, -1.2952)
    )
    beta_b = (
        2.7146 * g_sw * 2.2422 * w**0.7548 * _polynomial(b, 0.5616, 0.1197, 0.1176)
        * 0.1908 * of["r_journal"] ** -0.5568
        * _polynomial(d_g, 1.0012, -0.6441, 1.2265) * _polynomial(d_h, 1.0022, -0.1903, 0.0073)
    )  # fmt: skip
    beta_q = (
        3.0128 * _polynomial(gap, 0.4368, 2.1630, -1.5212) * w / (0.0637 + 0.9369 * w) * (b - 0.5)
        * 0.5331 * of["r_journal"] ** -0.2038 * _polynomial(d_h, 0.9937, -1.1949, 1.7373)
    )  # fmt: skip
    alpha_t = _torsion_factor(of["r_pin"], s, w, b)
    same = throw.pin_diameter == throw.journal_diameter and throw.pin_fillet == throw.journal_fillet
    beta_t = alpha_t if same else _torsion_factor(throw.journal_fillet / throw.journal_diameter, s, w, b)
    return FilletFactors(recessed * alpha_b, alpha_t, recessed * beta_b, recessed * beta_q, beta_t)


def _torsion_factor(r: float, s: float, w: float, b: float) -> float:
    return 0.8 * r ** (-0.322 + 0.1015 * (1.0 - s)) * _polynomial(b, 7.8955, -10.654, 5.3482, -0.857) * w**-0.145


def _polynomial(x: float, *coefficients: float) -> float:
    return sum(c * x**k for k, c in enumerate(coefficients))


def oil_bore_factors(ratio: float) -> tuple[float, float]:
    """Factors γ_B and γ_T at the outlet of a radial oil bore; ``ratio`` of its diameter to the pin's is 0 to 0.2."""
    return _polynomial(ratio, 3.0, -5.88, 34.6), _polynomial(ratio, 4.0, -6.0, 30.0)


def web_bending(throw: ThrowShape, moment: Load) -> Load:
    """Nominal bending stress of the web, Pa, by the moment (…) N m in the plane of the throw at the web's middle."""
    return moment * (6.0 / (throw.web_width * throw.web_thickness**2))


def web_tension(throw: ThrowShape, force: Load) -> Load:
    """Nominal stress of the web, Pa, by the radial force (…) N."""
    return force / (throw.web_width * throw.web_thickness)


def torsion(diameter: float, bore: float, torque: Load) -> Load:
    """Nominal shear stress, Pa, of a journal of this diameter and bore, m, by a torque (…) N m."""
    return torque * (16.0 * diameter / (math.pi * (diameter**4 - bore**4)))


def pin_bending(throw: ThrowShape, moment: Load) -> Load:
    """Nominal bending stress of the pin, Pa, by a moment (…) N m towards the outlet of its oil bore."""
    d = throw.pin_diameter
    return moment * (32.0 * d / (math.pi * (d**4 - throw.pin_bore**4)))


def fillet_stress(bending: float, shear: float, additional: float = ADDITIONAL_BENDING) -> float:
    """Equivalent alternating stress of a fillet, Pa, from its alternating bending and shear stress, Pa."""
    return math.hypot(bending + additional, math.sqrt(3.0) * shear)


def oil_bore_stress(bending: float, shear: float) -> float:
    """Equivalent alternating stress at the outlet of an oil bore, Pa, from γ_B σ_BON and γ_T τ_N, Pa."""
    return (bending + 2.0 * math.hypot(bending, 1.5 * shear)) / 3.0


def fatigue_strength(strength: CrankStrength, diameter: float, radius: float, fillet: bool = True) -> float:
    """Fatigue strength σ_DW, the endurable alternating equivalent stress for unlimited life, Pa.

    ``diameter`` is that of pin or journal, ``radius`` that of its fillet or of the oil bore, m. The forming factor is
    used only for a ``fillet``. UR M53, section 6.
    """
    tensile = 1e-6 * strength.tensile_strength
    forming = FORMING_FACTORS[strength.forming]
    factor = forming if fillet else min(forming, 1.0)
    size = 0.264 + 1.073 * (1e3 * diameter) ** -0.2
    notch = 196.0 / tensile * math.sqrt(1.0 / (1e3 * max(radius, SMALLEST_RADIUS)))
    return 1e6 * factor * (0.42 * tensile + 39.3) * (size + (785.0 - tensile) / 4900.0 + notch)
