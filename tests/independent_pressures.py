"""Pressure traces by formulas that the package does not have: Annand's and Hohenberg's heat, air of Gatowski's ratio.

    dp/dθ = [−γ p V' − (γ − 1) Q̇/ω] / V,    T = T₁ p V / (p₁ V₁),    γ(T) = γ₃₀₀ − 8.13e-5 (T − 300)

Heat to the walls is that of Hohenberg (SAE 790825), α = 130 V^-0.06 (p/bar)^0.8 T^-0.4 (c_m + 1.4)^0.8, or of Annand
(Proc. Inst. Mech. Eng. 177 (1963) 973), α = 0.49 λ/B Re^0.7; the ratio of heat capacities is that of J. A. Gatowski et
al. (SAE 841359). Combustion is Wiebe's function. Volume and its change are written out here too.
"""

import math

import numpy as np
from scipy.integrate import solve_ivp


def volume(angle, bore, stroke, rod, ratio):
    """Volume (n,) m³ over angles (n,) rad after dead centre, and its derivative."""
    area, r = math.pi * bore**2 / 4.0, stroke / 2.0
    s, c = np.sin(angle), np.cos(angle)
    root = np.sqrt(rod**2 - (r * s) ** 2)
    return area * stroke / (ratio - 1.0) + area * (r + rod - r * c - root), area * (r * s + r * r * s * c / root)


def hohenberg(p, t, v, piston_speed, bore):
    """Heat transfer coefficient, W/m²K."""
    return 130.0 * v**-0.06 * (1e-5 * p) ** 0.8 * t**-0.4 * (piston_speed + 1.4) ** 0.8


def annand(p, t, v, piston_speed, bore):
    """Heat transfer coefficient, W/m²K; viscosity and conductivity of air by Sutherland's law and a power of T."""
    viscosity = 1.458e-6 * t**1.5 / (t + 110.4)
    conductivity = 0.0262 * (t / 300.0) ** 0.8
    return 0.49 * conductivity / bore * (p / (287.0 * t) * piston_speed * bore / viscosity) ** 0.7


def trace(
    cylinder,
    rpm,
    intake,
    temperature,
    wall,
    heat=hohenberg,
    fuel=0.0,
    start=-8.0,
    closes=-130.0,
    gamma=1.392,
    cycle=720,
):
    """Angles (n,) deg from −cycle/2 on, half a degree apart, and pressures (n,) Pa of one cycle.

    ``cylinder``: bore, stroke, rod, m, and compression ratio; ``fuel``: heat released, J, from ``start`` on, deg;
    ``closes``: intake's end, deg. Before it and from −closes on the pressure is that of the intake.
    """
    omega = math.pi / 30.0 * rpm
    bore, stroke, _, _ = cylinder
    first = math.radians(closes)
    v1 = float(volume(first, *cylinder)[0])
    area, speed = math.pi * bore**2 / 4.0, stroke * omega / math.pi

    def slope(theta, y):
        p = y[0]
        v, dv = (float(one) for one in volume(theta, *cylinder))
        t = temperature * p * v / (intake * v1)
        ratio = gamma - 8.13e-5 * (t - 300.0)
        lost = heat(p, t, v, speed, bore) * (2.0 * area + 4.0 * v / bore) * (t - wall) / omega
        x = (theta - math.radians(start)) / math.radians(50.0)
        released = fuel * 6.9 * 2.5 / math.radians(50.0) * x**1.5 * math.exp(-6.9 * x**2.5) if fuel and x > 0.0 else 0.0
        return [(-ratio * p * dv + (ratio - 1.0) * (released - lost)) / v]

    angle = np.arange(-cycle / 2.0, cycle / 2.0, 0.5)
    inside = (angle >= closes) & (angle <= -closes)
    found = solve_ivp(slope, (first, -first), [intake], t_eval=np.radians(angle[inside]), rtol=1e-9, atol=0.1,
                      max_step=math.radians(0.5))  # fmt: skip
    pressure = np.full(angle.size, float(intake))
    pressure[inside] = found.y[0]
    return angle, pressure
