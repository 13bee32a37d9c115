"""Dimensionless oil-conserving film of a journal bearing at a given journal position.

Rupture and reformation follow from the oil balance of :mod:`cranktrain.film.reynolds.field`. In the ruptured region the
fill is determined by the oil that the surfaces carry, and the film reforms where this oil fills the gap. If oil is
supplied on the line of the widest gap, the film equals that of Reynolds' rupture. With grooves it reforms later,
because a groove in a narrow gap feeds less oil than the wider gap behind it can hold.

The motion is steady. A rate of the eccentricity is an instantaneous one, with unchanged fill of an opening gap. Oil
comes from the supply only; a gap without rotation is initially full.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.reduced_body import Array
from cranktrain.film.journal.grid import GRADING, axial_nodes
from cranktrain.film.reynolds.field import Edges, Supply, solve_film
from cranktrain.film.steady.bearing import bearing_grid

PSI = 1.0e-3
"""Clearance over radius used in the solution; dimensionless results do not depend on its value."""
DEFAULT_GRID = (160, 16)


@dataclass(frozen=True)
class ConservingGrid:
    """Grid with nodes (n_phi,) in φ from ``start`` on and (n_z,) in ζ, weights of integrals over ζ, supply nodes."""

    phi: Array
    zeta: Array
    weight: Array
    fed: NDArray[np.bool_]


@dataclass(frozen=True)
class ConservingFilm:
    """Result: force and ∫z dF on the journal, over B D η ω/ψ² (and B), flow over R³ ψ ω, p_max over η ω/ψ²."""

    force: Array
    leverage: Array
    flow: float
    p_max: float


def conserving_grid(
    eccentricity: Array, ratio: float, supply: str, n_phi: int, n_z: int, groove: float = 0.0
) -> ConservingGrid:
    """Make the grid for a journal near ``eccentricity`` (2,) over c in a bearing of B/D ``ratio``.

    ``supply`` is widest-gap, none or two-axial (grooves of ``groove`` rad each). Raises ``InputError`` if the grid is
    too coarse or grooves overlap.
    """
    if supply == "two-axial":
        circle = bearing_grid(supply, n_phi=n_phi, n_z=n_z, groove=groove)
        phi = np.unwrap(np.arctan2(circle.circle[1], circle.circle[0]))
        fed = circle.blocked[:, 0] > 0.0
    else:
        bearing_grid(supply, n_phi=n_phi, n_z=n_z)
        size = float(np.hypot(*eccentricity))
        towards = math.atan2(eccentricity[1], eccentricity[0]) if size > 0.0 else 0.0
        gamma = 2.0 * math.pi * np.arange(n_phi) / n_phi
        m = GRADING * min(size, 1.0)
        # Nodes start at the widest gap and are concentrated at the least gap.
        across, along = math.sqrt(1.0 + m) * np.sin(0.5 * gamma), math.sqrt(1.0 - m) * np.cos(0.5 * gamma)
        phi = towards + math.pi + 2.0 * np.arctan2(across, along)
        fed = np.zeros(n_phi, dtype=bool)
        fed[0] = supply == "widest-gap"
    s = np.linspace(-1.0, 1.0, n_z + 1)
    zeta, weight = axial_nodes(s, ratio)
    # Pressure vanishes at the ends, so end corrections make the sum over inner nodes of fourth order.
    weight *= 2.0 / n_z
    weight[[1, -2]] *= 7.0 / 6.0
    weight[[2, -3]] *= 23.0 / 24.0
    weight[[0, -1]] = 0.0
    return ConservingGrid(phi, zeta, weight, fed)


def conserving_film(
    grid: ConservingGrid,
    ratio: float,
    eccentricity: Array,
    tilt: tuple[float, float] = (0.0, 0.0),
    rate: tuple[float, float] = (0.0, 0.0),
    turning: float = 1.0,
) -> ConservingFilm:
    """Solve the film of a journal at ``eccentricity`` and ``tilt`` (over c) in a bore at rest.

    ``rate`` is the rate of the eccentricity over ω, ``turning`` the speed of the journal over ω. Raises ``SolverError``
    if the film does not converge.
    """
    n = np.array([np.cos(grid.phi), np.sin(grid.phi)])
    h = PSI * (1.0 - (eccentricity @ n)[:, None] - np.outer(np.asarray(tilt) @ n, grid.zeta))
    width = 2.0 * ratio
    supplies: tuple[Supply, ...] = ()
    if grid.fed.any():
        supplies = (Supply("supply", np.repeat(grid.fed[:, None], grid.zeta.size, axis=1), 0.0),)
    squeeze = np.repeat((-PSI * (np.asarray(rate) @ n))[:, None], grid.zeta.size, axis=1)
    film = solve_film(
        h, (2.0 * math.pi, width), speeds=(turning, 0.0), viscosity=1.0, squeeze=squeeze, periodic=True, edges=Edges(),
        supplies=supplies, nodes=(grid.phi - grid.phi[0], 0.5 * width * (grid.zeta + 1.0)),
    )  # fmt: skip
    around = film.areas.sum(axis=1) / width
    pressed = film.pressure * around[:, None] * grid.weight
    unit = 0.25 * PSI**2
    force = -unit * (n @ pressed.sum(axis=1))
    leverage = -0.5 * unit * (n @ (pressed @ grid.zeta))
    # Flow out of an end is the flow through the last inner face plus the squeeze flow of the strip beyond, if filled.
    flow = 0.0
    for end, inside in ((0, 1), (-1, -2)):
        step = 0.5 * width * abs(grid.zeta[end] - grid.zeta[inside])
        pressure = film.pressure[:, inside]
        middle = 0.5 * (h[:, end] + h[:, inside])
        slope = PSI * (n[::-1] * np.array([[1.0], [-1.0]])).T @ (eccentricity + grid.zeta[end] * np.asarray(tilt))
        strip = -(0.5 * turning * slope + squeeze[:, end]) * (0.5 * step)
        out = middle**3 / (12.0 * step) * pressure + np.where(pressure > 0.0, strip, 0.0)
        flow += float((out * around).sum()) / PSI
    return ConservingFilm(force, leverage, flow, film.p_max * PSI**2)
