"""Compressible liquid in a film that may rupture.

With r(p) = ρ(p)/ρ(0) and f(p) = η(p)/η(0) the mass flow, over ρ(0), and the content c of a node are

    q_x = Ū c h − h³/(12 η₀) ∂q/∂x,    q = ∫₀ᵖ r/f dp,    c = r where the gap is full, the fill θ where it is ruptured,

so the complementarity of :mod:`cranktrain.film.reynolds.cavitation` is unchanged, with q as the pressure, except for
r(q), which Newton's method linearises. The content of a face between two full nodes is the mean of both sides (second
order) as long as pressure carries more through it than compression does, and comes from upstream beyond. A Newton step
is taken in p or in q, whichever changes less: r is nearly linear in p, and the pressure-driven flow is linear in q.

Source: Almqvist and Wall, in Advances in Tribology (2016), doi 10.5772/63533 (complementarity of mass flow with
density and viscosity by pressure); Bertocchi et al., Tribol. Int. 67 (2013) 61.
"""

from collections.abc import Callable

import numpy as np

from cranktrain.core.errors import SolverError
from cranktrain.core.types import Array
from cranktrain.film.reynolds.cavitation import Balance, Liquid
from cranktrain.film.reynolds.piezoviscosity import Law, reduced_pressure, true_pressure, viscosity_factor

Density = Callable[[Array], tuple[Array, Array]]
"""r(p) = ρ(p)/ρ(0) and dr/dp (1/Pa) for an array of pressures (Pa), with r(0) = 1."""
STEPS = 200
SETTLED = 1e-9
"""Tolerance of the last Newton step: change of pressure over the largest pressure."""
PASSES = 3
"""Limit of active-set passes in a Newton step; more passes may not converge for nodes that fill again."""
GROWTH = 0.5
"""Limit of the rise of a pressure in a Newton step, over the largest pressure."""
Solve = Callable[[Balance, Array, int], tuple[Array, bool]]


def incompressible(shape: tuple[int, ...]) -> Liquid:
    """Return a liquid of constant density."""
    return Liquid(*(np.zeros(shape) for _ in Liquid._fields))


def mass_flow_law(law: Law | None, density: Density | None) -> Law | None:
    """Return viscosity over density, f/r, as one law for the reduced pressure q; None if both are constant."""
    if density is None:
        return law
    if law is None:
        return lambda p: 1.0 / density(p)[0]
    return lambda p: law(p) / density(p)[0]


def tangent(pressure: Array, law: Law, density: Density, balance: Balance, swell: Array) -> Liquid:
    """Return oil contents linearised in the reduced pressure q at ``pressure``; ``swell`` (m³/s) is that of Liquid."""
    content, by_pressure = density(pressure)
    slope = by_pressure * viscosity_factor(law, pressure)
    excess = content - 1.0 - slope * reduced_pressure(law, pressure)

    def ahead(axis: int, g: Array, c: Array) -> Array:
        """Return the weight of the downstream content: ½, or less if compression would carry oil upstream."""
        other = np.roll(slope, -1, axis=axis)
        carried = np.abs(c) * np.where(c > 0.0, other, slope)
        return np.asarray(np.minimum(0.5, g / np.maximum(carried, 1e-300)))

    return Liquid(excess, slope, swell, ahead(0, balance.g_x, balance.c_x), ahead(1, balance.g_z, balance.c_z))


def compressed_pressure(
    pressure: Array, law: Law, density: Density, problem: tuple[Balance, Array], solve: Solve
) -> tuple[Array, Balance]:
    """Solve for the pressure (Pa) of a film of compressible liquid. Return pressure and final balance.

    Parameters
    ----------
    pressure : given pressures at fixed nodes, an initial guess elsewhere, Pa
    law : f/r
    density : r and its derivative
    problem : balance of the incompressible liquid, and ``swell``
    solve : function (balance, reduced pressures at fixed nodes, limit of passes) that returns the reduced pressures of
        a balance with linear contents, and whether the ruptured nodes have converged

    Raises
    ------
    SolverError
        if Newton's method does not converge
    """
    balance, swell = problem
    change = highest = 0.0
    for _ in range(STEPS):
        linear = balance._replace(liquid=tangent(pressure, law, density, balance, swell))
        reduced = reduced_pressure(law, pressure)
        wanted, settled = solve(linear, reduced, PASSES)
        rising = wanted > reduced
        moved = pressure + (wanted - reduced) * viscosity_factor(law, pressure)
        if highest > 0.0:
            moved = np.minimum(moved, pressure + GROWTH * highest)
        moved[~rising] = true_pressure(law, wanted[~rising])
        change, pressure = float(np.abs(moved - pressure).max()), moved
        highest = float(np.abs(pressure).max())
        if settled and change <= SETTLED * highest:
            return pressure, balance._replace(liquid=tangent(pressure, law, density, balance, swell))
    raise SolverError(
        f"film: pressures of the compressible liquid did not settle (last change {change:.3g} Pa of {highest:.3g} Pa); "
        "the film may be too thin for this oil between rigid surfaces"
    )
