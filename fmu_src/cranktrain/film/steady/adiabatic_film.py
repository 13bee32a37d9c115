r"""Temperature along the film of a steady bearing whose friction heats its oil: one value over gap and width.

The flow Q(φ) of the whole width carries heat from row to row; what leaves at the ends leaves as warm as it is there:

    ρ c_p Q dT/dx = λ Φ(x),
    Φ = ∫ [θ η U²/h + h³/(12 η) |∇p|²] dz + friction of asperities

θ is the fill: in the ruptured part the oil runs in streaks, which are sheared as they are. With λ = 1 nothing passes
into journal and bore, the adiabatic film; less leaves them their fraction at each place. At a supply the oil that comes
round mixes with fresh oil,

    T = (m Q_r T_r + (Q − m Q_r) T_s)/Q,

Q the flow behind the supply and Q_r that before it (at most Q). All the hot oil is carried over for m = 1; at m = 0 the
groove exchanges it.

The heat balance closes: ρ c_p Σ Q_side (T − T_s) + the heat of the oil that is exchanged = λ Σ Φ.

Limits: without friction T = T_s. In a uniform gap c that nothing leaves, ∫ dT/η(T) = 2 U x/(ρ c_p c²), which for
η = η₀ exp(−β (T − T₀)) is T − T₀ = ln(1 + 2 β η₀ U x/(ρ c_p c²))/β.

Sources: A. Cameron, The Principles of Lubrication (Longmans, 1966), adiabatic bearings; W. F. Cope, Proc. R. Soc. A 197
(1949) 201.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import SolverError
from cranktrain.core.reduced_body import Array
from cranktrain.film.reynolds.field import FilmSolution
from cranktrain.film.reynolds.volumes import node_faces, rectangle

TURNS = 2000
"""Most turns of the oil until its temperature repeats."""
SAME = 1.0e-9
"""Change of a turn, K, from which on it does."""


class Row(NamedTuple):
    """A film by its rows at n angles: flow (n,) to the next row, m³/s, and heat (n,) of each row, W."""

    flow: Array
    heat: Array


class Warmth(NamedTuple):
    """Temperatures (n,), K; heat that the oil takes, W; flow out of the ends, m³/s, and its mean temperature, K."""

    temperature: Array
    heat: float
    side_flow: float
    outlet: float


def film_rows(film: FilmSolution, speed: float, length: float, rubbing: Array) -> Row:
    """Flow and heat of a solved film.

    Parameters
    ----------
    film : periodic in x
    speed : of the journal's surface in a bore at rest, m/s
    length : of a turn, m
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
    # The solver has the end strips full all round; the oil in them runs on as it does beside them.
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
    """Temperature of each row.

    Parameters
    ----------
    rows : of a film
    fed : (n,) rows of a supply; at least one
    supply : temperature of the oil supplied, K
    per_volume : ρ c_p, J/(m³ K)
    share : λ
    carried : m

    Raises
    ------
    SolverError
        oil that runs round without any being fed, or that does not run in the sense of rotation everywhere
    """
    n = fed.size
    if not rows.flow.min() > 0.0:
        raise SolverError(
            "adiabatic film: the oil of some place runs against the rotation, so its heat has no way on; take a "
            "smaller load or eccentricity, or the heat balance of the whole film"
        )
    start = int(np.flatnonzero(fed & ~np.roll(fed, 1))[0]) if not fed.all() else 0
    order = (start + np.arange(n)) % n
    flow, heat, is_fed = rows.flow[order], share * rows.heat[order] / per_volume, fed[order]
    # A row takes half of the heat of the intervals beside it; within a supply it is the oil's that leaves it.
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
