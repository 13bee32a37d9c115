"""Flow through a valve as an isentropic nozzle, choked or not, made smooth where the pressures are equal.

    ṁ = A p₁/√(R T₁) ψ(p₂/p₁),   ψ² = 2γ/(γ−1) (π^(2/γ) − π^((γ+1)/γ)),  π not below its critical value

Near equal pressures ψ behaves like √(1 − π), with an infinite slope. Within 1 − π < δ it is therefore multiplied by
√s (15 − 10 s + 3 s²)/8 with s = (1 − π)/δ. The product is linear at equal pressures and twice continuously
differentiable at δ.

The effective area is that of valve curtain and port in series, A = 1/√(1/A_c² + 1/A_p²), with A_c = n c π d l and
A_p = n c_p π d²/4. A built-in lift is L (4 s (1 − s))² between opening and closing.

Source: J. B. Heywood, Internal Combustion Engine Fundamentals (1988), section 6.3 and appendix C.
"""

import math

from cranktrain.core.kernel import inlined_kernel

EVEN = 5.0e-3
"""Relative pressure difference δ below which the valve flow is linear in the difference."""


@inlined_kernel
def nozzle_flow(area, pressure, temperature, constant, gamma, behind):
    """Mass flow, kg/s, from a pressure (Pa) and temperature (K) through an area (m²) to the pressure ``behind``."""
    critical = (2.0 / (gamma + 1.0)) ** (gamma / (gamma - 1.0))
    ratio = behind / pressure
    smooth = 1.0
    if ratio > 1.0 - EVEN:
        s = (1.0 - ratio) / EVEN
        if s <= 0.0:
            return 0.0
        smooth = math.sqrt(s) * (15.0 - 10.0 * s + 3.0 * s * s) / 8.0
    # The difference of the two powers without cancellation: π^(2/γ) (1 − π^((γ−1)/γ)).
    logarithm = math.log(max(ratio, critical))
    psi2 = -math.exp(2.0 / gamma * logarithm) * math.expm1((gamma - 1.0) / gamma * logarithm)
    psi = math.sqrt(2.0 * gamma / (gamma - 1.0) * psi2)
    return area * pressure / math.sqrt(constant * temperature) * psi * smooth


@inlined_kernel
def flow_slope(area, temperature, constant, pressure, behind):
    """Bound of dṁ/dp, kg/(s Pa), for a flow between two pressures: largest within δ, smaller for larger differences."""
    apart = max(abs(pressure - behind) / pressure, EVEN)
    return area * 15.0 / 8.0 * math.sqrt(2.0 / (constant * temperature * apart))


@inlined_kernel
def valve_area(lift, diameter, count, curtain, port):
    """Effective area, m², of ``count`` valves of a diameter at a lift (m), by ``curtain`` and ``port`` coefficients."""
    if lift <= 0.0:
        return 0.0
    narrow = curtain * math.pi * diameter * lift
    wide = port * 0.25 * math.pi * diameter * diameter
    return count * narrow * wide / math.sqrt(narrow * narrow + wide * wide)


@inlined_kernel
def built_in_lift(angle, opens, closes, highest):
    """Lift, m, at a crank angle within the cycle (rad) of a valve with given opening and closing angles."""
    s = (angle - opens) / (closes - opens)
    if s <= 0.0 or s >= 1.0:
        return 0.0
    rise = 4.0 * s * (1.0 - s)
    return highest * rise * rise
