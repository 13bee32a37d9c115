"""Dimensionless film at a given eccentricity, as in tables: Sommerfeld number, attitude, side flow, friction.

Axes: x along the eccentricity, y at 90° in the sense of rotation. With ψ = c/R, width B, diameter D, rotation ω of the
journal in a bore at rest (for pure squeeze, ω is the rate of eccentricity ε̇ in every norm):

    So = F ψ²/(B D η ω),   forces the same way,   moments M ψ²/(B² D η ω),   pressure p ψ²/(η ω),
    side flow Q/((D/2)³ ψ ω) of both ends,
    friction μ_f/ψ = S/(2 So) + ½ ε sin β  with  S = ½∫∫ dφ dζ/H of a filled gap, 2π/√(1 − ε²) without tilt,

The friction is that of the journal: shear of the whole circumference plus half of e × F. This formula is from
Butenschön (1976), whose tables of steady rotation have p = 0 on the line of the widest gap.
"""

import math
from dataclasses import dataclass

import numpy as np

from cranktrain.core.errors import InputError, SolverError, nearest
from cranktrain.core.reduced_body import Array
from cranktrain.film.journal.film import OUT_SIZE, film_observables, film_shear, journal_film
from cranktrain.film.journal.grid import PRESETS, RUPTURES, Motion, cold_start, journal_work
from cranktrain.film.steady.bearing import SUPPLIES, bearing_grid
from cranktrain.film.steady.conserving_bearing import DEFAULT_GRID, conserving_film, conserving_grid

CAVITATION = (*RUPTURES, "mass-conserving")


@dataclass(frozen=True)
class PrescribedFilm:
    """Dimensionless result in the norms of the module; force and moment vector on the journal, (2,) each."""

    sommerfeld: float
    attitude: float
    side_flow: float
    friction: float
    p_max: float
    force: tuple[float, float]
    moment: tuple[float, float]


def prescribed_film(
    length_ratio: float,
    eccentricity: float,
    *,
    squeeze: float = 0.0,
    squeeze_only: bool = False,
    tilt: tuple[float, float] = (0.0, 0.0),
    cavitation: str = "reynolds",
    supply: str | None = None,
    grid: tuple[int, int] | None = None,
) -> PrescribedFilm:
    """Solve the film of a journal at a given eccentricity.

    Parameters
    ----------
    length_ratio : B/D
    eccentricity : ε in [0, 1)
    squeeze : ε̇/ω, in addition to the rotation
    squeeze_only : whether the motion is pure squeeze, ε̇ > 0, without rotation
    tilt : constant displacement of the journal's axis at the end ζ = +1, over the clearance, along x and y
    cavitation : reynolds, guembel, full or mass-conserving
    supply : widest-gap or none; by default widest-gap for rotation with reynolds (with squeeze ≥ 0) or mass-conserving
    grid : grid intervals around and over the width

    Raises
    ------
    InputError
        if no film exists for the input
    """
    _check(length_ratio, eccentricity, squeeze, squeeze_only, tilt, cavitation)
    feeds = cavitation in ("reynolds", "mass-conserving") and not squeeze_only
    # A journal that moves away from the wall displaces oil in the widest gap, which a groove there would drain.
    by_default = feeds and (squeeze >= 0.0 or cavitation == "mass-conserving")
    chosen = supply or ("widest-gap" if by_default else "none")
    if chosen not in SUPPLIES[:2]:
        raise InputError(f"supply '{chosen}' does not exist at a given eccentricity; {nearest(chosen, SUPPLIES[:2])}")
    if chosen == "widest-gap" and not feeds:
        raise InputError(
            "supply 'widest-gap' is for a journal that rotates, with cavitation reynolds or mass-conserving; use 'none'"
        )
    tilted = tuple(tilt) != (0.0, 0.0)
    if cavitation == "mass-conserving":
        if chosen == "none" and not squeeze_only:
            raise InputError(
                "a rotating film that conserves oil runs dry with --supply none; leave it out, or use reynolds"
            )
        grid = grid or ((DEFAULT_GRID[0], 24) if tilted else DEFAULT_GRID)
        return _conserving(length_ratio, eccentricity, squeeze, squeeze_only, tilt, chosen, grid)
    n_phi, n_z = grid or ((160, 24) if tilted else PRESETS["default"])
    film = bearing_grid(chosen, n_phi=n_phi, n_z=n_z, tilted=tilted, rupture=cavitation, ratio=length_ratio)
    work, active, out = journal_work(film), cold_start(film), np.zeros(OUT_SIZE)
    turning = 0.0 if squeeze_only else 0.5
    closing = 1.0 if squeeze_only else squeeze
    tx, ty = float(tilt[0]), float(tilt[1])
    at = Motion(eccentricity, 0.0, tx, ty, closing, -turning * eccentricity, turning * ty, -turning * tx)
    passes = journal_film(film, length_ratio**-2, at, work, active, out)
    if passes < 0:
        raise SolverError(f"film at eccentricity {eccentricity:g} not settled after {-passes} passes; change --grid")
    highest, flow = film_observables(film, work)
    shear = 0.0 if squeeze_only else film_shear(eccentricity, 0.0, tx, ty)
    force, leverage = 3.0 * out[:2], 1.5 * out[2:4]
    return _result(eccentricity, force, leverage, flow / length_ratio, 12.0 * highest, shear)


def _result(eps: float, force: Array, leverage: Array, flow: float, p_max: float, shear: float) -> PrescribedFilm:
    """Return the result with all norms; ``leverage`` is ∫z dF in the norm of moments."""
    load = math.hypot(*force)
    fx, fy = float(force[0]), float(force[1])
    return PrescribedFilm(
        sommerfeld=load,
        attitude=math.atan2(fy, -fx) if load > 0.0 else math.nan,
        side_flow=flow,
        friction=0.5 * shear / load + 0.5 * eps * fy / load if load > 0.0 else math.nan,
        p_max=p_max,
        force=(fx, fy),
        moment=(0.0 - float(leverage[1]), float(leverage[0])),
    )


def _conserving(
    ratio: float,
    eps: float,
    squeeze: float,
    squeeze_only: bool,
    tilt: tuple[float, float],
    supply: str,
    grid: tuple[int, int],
) -> PrescribedFilm:
    place = np.array([eps, 0.0])
    turning, rate = (0.0, 1.0) if squeeze_only else (1.0, squeeze)
    film = conserving_film(conserving_grid(place, ratio, supply, *grid), ratio, place, tilt, (rate, 0.0), turning)
    shear = 0.0 if squeeze_only else film_shear(eps, 0.0, *tilt)
    return _result(eps, film.force, film.leverage, film.flow, film.p_max, shear)


def _check(
    ratio: float, eps: float, squeeze: float, squeeze_only: bool, tilt: tuple[float, float], cavitation: str
) -> None:
    if not (math.isfinite(ratio) and 1e-3 <= ratio <= 1e4):
        raise InputError(f"length ratio {ratio:g} is not within 0.001 to 10000: it is the width over the diameter")
    if not (math.isfinite(eps) and 0.0 <= eps < 1.0):
        raise InputError(
            f"eccentricity {eps:g} is not within 0 to 1: at 1 the surfaces touch and no film is left; 0.999 is possible"
        )
    if cavitation not in CAVITATION:
        raise InputError(f"cavitation '{cavitation}' does not exist; {nearest(cavitation, CAVITATION)}")
    if not math.isfinite(squeeze) or not all(map(math.isfinite, tilt)):
        raise InputError("squeeze and tilt must be finite numbers")
    if squeeze_only and squeeze != 0.0:
        raise InputError("squeeze-only has no rotation to relate --squeeze to; drop one of the two")
    a, b = tilt
    worst = max(math.hypot(eps + a, b), math.hypot(eps - a, b))
    if worst >= 1.0:
        size = math.hypot(a, b)
        along = abs(a) * eps / size
        possible = math.sqrt(along * along + 1.0 - eps * eps) - along
        raise InputError(
            f"with eccentricity {eps:g} a tilt of {a:g} {b:g} makes an edge touch (eccentricity {worst:.4g} there); in "
            f"this direction less than {possible:.4g} is possible, e.g. {0.99 * possible * a / size:.4g} "
            f"{0.99 * possible * b / size:.4g}"
        )
