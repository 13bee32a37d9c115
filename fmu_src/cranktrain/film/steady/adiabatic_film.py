r"""Temperature along the film of a steady bearing whose friction heats the oil, uniform over gap and width.

The flow Q(φ) of the whole width carries heat from row to row. Oil leaves the ends at the temperature of its row:

    ρ c_p Q dT/dx = λ Φ(x),
    Φ = ∫ [θ η U²/h + h³/(12 η) |∇p|²] dz + friction of asperities

θ is the fill; in the ruptured part the oil flows in streaks, so shear is proportional to θ. λ = 1 is the adiabatic
film; for λ < 1 the fraction 1 − λ of the local heat goes to journal and bore. At a supply the returning oil mixes with
fresh oil,

    T = (m Q_r T_r + (Q − m Q_r) T_s)/Q,

with the flow Q after the supply and Q_r before it (at most Q). All the hot oil is carried over for m = 1; the groove
replaces it for m = 0.

The heat balance is exact: ρ c_p Σ Q_side (T − T_s) + heat of the exchanged oil = λ Σ Φ.

Limits: without friction T = T_s. In a uniform gap c without side flow ∫ dT/η(T) = 2 U x/(ρ c_p c²), which for
η = η₀ exp(−β (T − T₀)) gives T − T₀ = ln(1 + 2 β η₀ U x/(ρ c_p c²))/β.

Sources: A. Cameron, The Principles of Lubrication (Longmans, 1966), adiabatic bearings; W. F. Cope, Proc. R. Soc. A 197
(1949) 201.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import SolverError
from cranktrain.core.reduced_body import Array
from cranktrain.film.reynolds.field import FilmSolution
from cranktrain.film.reynolds.volumes import node_faces, rectangle

TURNS = 2000
"""Limit of revolutions of the oil until its temperature is periodic."""
SAME = 1.0e-9
"""Change within a revolution, K, below which the temperature counts as periodic."""


class Row(NamedTuple):
    """Rows of a film at n angles: flow (n,) to the next row, m³/s, and heat (n,) of each row, W."""

    flow: Array
    heat: Array


class Warmth(NamedTuple):
    """Result: temperatures (n,), K; heat taken up by the oil, W; flow out of the ends, m³/s, and its temperature, K."""

    temperature: Array
    heat: float
    side_flow: float
    outlet: float


def film_rows(film: FilmSolution, speed: float, length: float, rubbing: Array) -> Row:
    """Return flow and heat of the rows of a solved film.

    Parameters
    ----------
    film : film that is periodic in x
    speed : surface speed of the journal in a bore at rest, m/s
    length : circumference, m
    rubbing : friction force of asperities in each row, N (n,)
    """
    grid = rectangle(film.x, film.z, (length, float(film.z[-1])), True)
    faces = node_faces(film.h, grid)
    eta_x = 0.5 * (film.viscosity + np.roll(film.viscosity, -1, axis=0))
    eta_z = 0.5 * (film.viscosity + np.roll(film.viscosity, -1, axis=1))
    step_z = np.where(grid.step_z > 0.0, grid.step_z, 1.0)
    fall_x = film.pressure - np.roll(film.pressure, -1, axis=0)
    fall_z = film.pressure - np.roll(film.pressure, -1, axis=1)
    pushed_x = faces.cube_x / (12.0 * eta_x * grid.step_x[:, None]) * fall_x
    pushed_z = faces.cube_z / (12.0 * eta_z * step_z) * fall_z
    # The solver takes the end strips as full all around; here their oil flows as in the adjacent nodes.
    fill = np.minimum(film.fill, 1.0)
    fill[:, [0, -1]] = fill[:, [1, -2]]
    flow = (0.5 * speed * faces.film_x * fill + pushed_x).sum(axis=1)
    sheared = (fill * film.viscosity / film.h * film.areas).sum(axis=1) * speed * speed
    along = (pushed_x * fall_x).sum(axis=1)
    pushed = 0.5 * (along + np.roll(along, 1)) + (pushed_z * fall_z).sum(axis=1)
    return Row(flow, sheared + pushed + rubbing * speed)


def temperatures(
    rows: Row, fed: NDArray[np.bool_], supply: float, per_volume: float, share: float = 1.0, carried: float = 1.0
) -> Warmth:
    """Solve for the temperature of each row.

    Parameters
    ----------
    rows : rows of a film
    fed : (n,) True for rows of a supply; at least one
    supply : temperature of the supplied oil, K
    per_volume : ρ c_p, J/(m³ K)
    share : λ, fraction of the friction that heats the oil
    carried : m, fraction of the hot oil that passes a supply

    Raises
    ------
    SolverError
        if oil circulates without fresh supply, or flows against the rotation somewhere
    """
    n = fed.size
    if not rows.flow.min() > 0.0:
        raise SolverError(
            "adiabatic film: somewhere the oil flows against the rotation, so the temperature is undefined; take a "
            "smaller load or eccentricity, or the heat balance of the whole film"
        )
    start = int(np.flatnonzero(fed & ~np.roll(fed, 1))[0]) if not fed.all() else 0
    order = (start + np.arange(n)) % n
    flow, heat, is_fed = rows.flow[order], share * rows.heat[order] / per_volume, fed[order]
    # A row takes half of the heat of the adjacent intervals; heat within a supply goes to the oil that leaves it.
    rise = 0.5 * (heat + np.roll(heat, -1)) / flow
    rise = np.where(is_fed & np.roll(is_fed, -1), 0.0, rise)
    warm = np.full(n, supply)
    last = supply
    for _ in range(TURNS):
        came = last
        value = came
        for i in range(n):
            if is_fed[i]:
                old = (
                    carried * min(flow[i - 1], flow[i]) if (i == 0 or not is_fed[i - 1]) else min(flow[i - 1], flow[i])
                )
                value = (old * value + (flow[i] - old) * supply) / flow[i]
            warm[i] = value
            value = value + rise[i]
        last = value
        if not np.isfinite(last) or last > supply + 2000.0:
            raise SolverError(
                "adiabatic film: the oil would be more than 2000 K hotter than its supply, because hardly any is fed; "
                "give a groove, a larger load or eccentricity, or less --carry-over"
            )
        if abs(last - came) < SAME:
            break
    else:
        raise SolverError("adiabatic film: too little oil is fed for its temperature to settle; give a groove")
    lost = np.roll(flow, 1) - flow
    side = float(lost[~is_fed].sum())
    outlet = float((lost * warm)[~is_fed].sum()) / side if side > 0.0 else supply
    temperature = np.empty(n)
    temperature[order] = warm
    return Warmth(temperature, share * float(rows.heat.sum()), side, outlet)
