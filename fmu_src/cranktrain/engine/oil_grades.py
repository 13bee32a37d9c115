"""Engine oils by SAE grade: typical viscosities, and constants of Vogel's law through them.

SAE J300 (2021) bounds the kinematic viscosity at 100 °C of a grade by its second number, and the viscosity at 150 °C
and a shear rate of 1e6 1/s (HTHS) from below:

    20    6.9 to 9.3 mm²/s,   2.6 mPa s
    30    9.3 to 12.5 mm²/s,  2.9 mPa s
    40    12.5 to 16.3 mm²/s, 3.5 mPa s (0W, 5W, 10W), 3.7 mPa s (15W)

The number before W limits viscosities at low temperatures only. The oil of a grade is assumed in the middle of its band
at 100 °C. Its viscosity at 40 °C follows from a viscosity index (ASTM D2270) that is usual for such oils; index and
density at 15 °C are chosen values, not those of a product. The viscosity is η = ρν with a density that falls by 0.065 %
of its value at 15 °C per kelvin. Vogel's law η = a exp(b / (T − c)) goes through η at 40, 100 and 150 °C, the last from
Walther's law (ASTM D341) through the first two. The two viscosities in a product's data sheet describe that product
better. Multigrade oils are thinner at the shear rates of a bearing, which none of these laws includes.
"""

import math
from dataclasses import replace
from typing import NamedTuple

from cranktrain.core.errors import InputError
from cranktrain.engine.parts import Oil
from cranktrain.engine.quantities import ZERO_CELSIUS

EXPANSION = 6.5e-4
"""Relative decrease of an oil's density per kelvin; the density at 15 °C is the reference."""
WARM, HOT, HOTTEST, COOL = (ZERO_CELSIUS + one for one in (40.0, 100.0, 150.0, 15.0))
SAME = 1.0e-9
"""Relative difference up to which a value stated in addition to a grade counts as the grade's own value."""


class Grade(NamedTuple):
    """Typical oil of a grade: kinematic viscosities at 40 and 100 °C, mm²/s, and density at 15 °C, kg/m³."""

    warm: float
    hot: float
    density: float


GRADES = {
    "0W-20": Grade(42.0, 8.1, 845.0),
    "0W-30": Grade(61.6, 10.9, 850.0),
    "5W-30": Grade(63.2, 10.9, 855.0),
    "10W-30": Grade(72.3, 10.9, 870.0),
    "0W-40": Grade(83.5, 14.4, 850.0),
    "5W-40": Grade(88.1, 14.4, 855.0),
    "10W-40": Grade(99.0, 14.4, 870.0),
    "15W-40": Grade(109.0, 14.4, 880.0),
}
"""Typical oils by grade; their viscosity indices are 170, 170, 165, 140, 180, 170, 150 and 135."""


def graded(oil: Oil) -> Oil:
    """Oil with density and constants of Vogel's law from its grade; unchanged if it has no grade.

    A given density is kept. ``InputError`` if constants of a law are given as well.
    """
    if oil.grade not in GRADES:  # no grade, or a grade that the check of the oil refuses
        return oil
    a, b, c = vogel_constants(GRADES[oil.grade])
    given = [
        key
        for key, value in (("vogel_a", a), ("vogel_b", b), ("vogel_c", c))
        if getattr(oil, key) and not math.isclose(getattr(oil, key), value, rel_tol=SAME)
    ]
    given += ["walther_viscosities"] if oil.walther_viscosities else ["law"] if oil.law != "vogel" else []
    if given:
        raise InputError(
            f"oil.{given[0]}: is given beside grade '{oil.grade}', which has its own law; leave one of them out"
        )
    density = oil.density or _density(GRADES[oil.grade], HOT)
    return replace(oil, density=density, vogel_a=a, vogel_b=b, vogel_c=c)


def vogel_constants(grade: Grade) -> tuple[float, float, float]:
    """Constants a (Pa s), b (K), c (K) of Vogel's law through the viscosities at 40, 100 and 150 °C."""
    t1, t2, t3 = WARM, HOT, HOTTEST
    # Kinematic viscosity, mm²/s, by Walther's law through the values at 40 and 100 °C.
    low, high = (math.log10(math.log10(nu + 0.7)) for nu in (grade.warm, grade.hot))
    at = low + (high - low) * math.log(t3 / WARM) / math.log(HOT / WARM)
    points = ((t1, grade.warm), (t2, grade.hot), (t3, float(10.0**10.0**at - 0.7)))
    y1, y2, y3 = (math.log(1e-6 * nu * _density(grade, t)) for t, nu in points)
    ratio = (y1 - y2) / (y2 - y3) * (t3 - t2) / (t2 - t1)
    c = (ratio * t1 - t3) / (ratio - 1.0)
    b = (y1 - y2) * (t1 - c) * (t2 - c) / (t2 - t1)
    return math.exp(y2 - b / (t2 - c)), b, c


def _density(grade: Grade, temperature: float) -> float:
    return grade.density * (1.0 - EXPANSION * (temperature - COOL))
