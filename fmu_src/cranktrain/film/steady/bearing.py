"""Plain bearing under a steady load: equilibrium, friction, flow, stiffness and damping.

The equilibrium of film force and load is found by Newton's method with the tangents of the film, in the journal's two
displacements or, with a moment, in displacements and tilt. With F̂(e, v) of :mod:`cranktrain.film.journal.film` and
v = ė − ω̄ e_z×e (ω̄ half the speed of rotation), stiffness and damping follow without another solution:

    k = −∂F/∂x |_ẋ = −(F₀/c) [∂F̂/∂e − ½ ∂F̂/∂v (e_z×)],   c = −∂F/∂ẋ = −(F₀/(c ω)) ∂F̂/∂v,   F₀ = 6 η ω R L (R/c)².

Whirl threshold of a rigid rotor of mass m per bearing, from the 2 × 2 coefficients (Routh; Lund 1965):

    k_eq = (k_xx c_yy + k_yy c_xx − k_xy c_yx − k_yx c_xy)/(c_xx + c_yy),
    Ω_w² = [(k_eq − k_xx)(k_eq − k_yy) − k_xy k_yx]/(c_xx c_yy − c_xy c_yx),   ω_s² m = k_eq (ω/Ω_w)².

Supply. The position of the oil supply matters at small loads. ``widest-gap`` keeps p = 0 on the line of the widest gap,
like an axial groove there, as in the steady tables of Butenschön and of Raimondi and Boyd. It is the choice for steady
rotation. ``none`` leaves reformation to Reynolds' condition: attitude up to 4.4° more and side flow up to 14 % more at
L/D = 1, less than 0.5 % in load from ε = 0.4 on. ``two-axial`` are two grooves at ±90° to the load.
"""

import math
from dataclasses import dataclass

import numpy as np

from cranktrain.core.errors import InputError, SolverError, nearest
from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import four, plus, scaled
from cranktrain.core.reduced_body import Array
from cranktrain.film.journal.film import DAMPING, OUT_SIZE, STIFFNESS, film_observables, film_shear, journal_film
from cranktrain.film.journal.grid import (
    FULL,
    NODE_GRADING,
    RUPTURE,
    SIDES,
    JournalGrid,
    Motion,
    journal_grid,
    solved_film,
)
from cranktrain.film.journal.rupture_border import border_tangents

SUPPLIES = ("widest-gap", "none", "two-axial")
RESIDUAL = 1.0e-7
"""Tolerance of the force balance at an equilibrium, over the load."""
MOST_STEPS = 80


@dataclass(frozen=True)
class Journal:
    """Plain bearing and its running condition, in SI units; ``InputError`` for invalid values.

    diameter, width, clearance (radial) in m, viscosity in Pa s, speed in rad/s (> 0).
    """

    diameter: float
    width: float
    clearance: float
    viscosity: float
    speed: float

    def __post_init__(self) -> None:
        for name in ("diameter", "width", "clearance", "viscosity", "speed"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise InputError(f"{name} of the bearing is {value:g}; it must be above zero")
        if self.clearance > 0.05 * self.diameter:
            raise InputError(
                f"radial clearance {1e6 * self.clearance:g} um is more than a twentieth of the diameter "
                f"{1e3 * self.diameter:g} mm; film theory ends there, give the clearance in um and the diameter in mm"
            )

    @property
    def radius(self) -> float:
        """Half the diameter, m."""
        return 0.5 * self.diameter

    @property
    def force_unit(self) -> float:
        """F₀ = 6 η ω R L (R/c)², N."""
        return 6.0 * self.viscosity * self.speed * self.radius * self.width * (self.radius / self.clearance) ** 2


@dataclass(frozen=True)
class SteadyState:
    """Equilibrium of a journal in SI units, with axes x along the load and y at 90° in the sense of rotation.

    eccentricity (2,) and tilt (2,) over the clearance; attitude from the load to the eccentricity, rad; least film, m;
    flow out of both ends, m³/s; friction torque on the journal (it brakes), N m; stiffness and damping (2, 2) or, with
    tilt, (4, 4) for (x, y, slopes dx/dz, dy/dz) against (F_x, F_y, ∫z dF_x, ∫z dF_y); whirl threshold ω_s √(c m/W),
    infinite if the journal is stable at all speeds, 0 if at none; Newton iterations. In addition, from
    :mod:`cranktrain.film.steady.mixed_bearing`: the load and its part carried by asperities, N, their part of the
    friction torque, N m, their largest pressure, Pa, the real contact area, m², and the largest displacement of the
    bore, m.
    """

    eccentricity: Array
    tilt: Array
    attitude: float
    least_film: float
    flow: float
    friction_torque: float
    largest_pressure: float
    stiffness: Array
    damping: Array
    whirl_threshold: float
    whirl_ratio: float
    sommerfeld: float
    iterations: int
    load: float = math.nan
    contact_load: float = 0.0
    contact_torque: float = 0.0
    contact_pressure: float = 0.0
    contact_area: float = 0.0
    bore_opening: float = 0.0


def bearing_grid(
    supply: str = "widest-gap",
    *,
    n_phi: int = 0,
    n_z: int = 16,
    tilted: bool = False,
    rupture: str = "reynolds",
    groove: float = math.radians(20.0),
    ratio: float = 0.0,
) -> JournalGrid:
    """Make the film grid of a steady bearing; ``groove`` is the extent of each axial groove, rad.

    ``ratio`` (B/D, if known) concentrates axial nodes at the ends of wide bearings.

    The default (n_phi = 0), 160 (with grooves 192) × 16, has errors of all coefficients below 0.5 % of the largest in
    the matrix; for the force alone 96 × 16 is as accurate.
    """
    if supply not in SUPPLIES:
        raise InputError(f"supply '{supply}' does not exist; {nearest(supply, SUPPLIES)}")
    if supply == "two-axial":
        if not 0.0 < groove < math.pi:
            raise InputError(
                f"two grooves of {math.degrees(groove):g} deg overlap or vanish; each takes between 0 and 180 deg"
            )
        places = ((0.5 * math.pi, groove), (1.5 * math.pi, groove))
        return journal_grid(n_phi or 192, n_z, half=not tilted, rupture=rupture, grooves=places, ratio=ratio)
    fed = supply == "widest-gap" and rupture == "reynolds"
    return journal_grid(n_phi or 160, n_z, half=not tilted, rupture=rupture, fed_at_widest=fed, ratio=ratio)


class SteadyBearing:
    """Analysis of steady bearings on one grid, whose memory is reused.

    Parameters
    ----------
    grid : result of :func:`bearing_grid`
    """

    def __init__(self, grid: JournalGrid) -> None:
        self.grid = grid
        self.film = solved_film(grid)
        self.out = np.zeros(OUT_SIZE)
        self.system = np.zeros((4, 5))

    def state(self, journal: Journal, load: float, moment: tuple[float, float] | None = None) -> SteadyState:
        """Find the equilibrium under ``load`` (N, along x) and, if given, ``moment`` (∫z dF_x, ∫z dF_y, N m).

        Raises
        ------
        InputError
            if the load is not above zero, or a moment acts on a grid of half the width
        SolverError
            if Newton's method finds no film that carries the load
        """
        if not (math.isfinite(load) and load > 0.0):
            raise InputError(f"load {load:g} N must be above zero: without load the journal runs at the centre")
        if moment is not None and self.grid.settings[SIDES] > 1.5:
            raise InputError("a moment needs the film over the full width; build the grid with tilted=True")
        unit = journal.force_unit
        ratio = journal.width / journal.diameter
        applied = np.zeros(4)
        applied[0] = load / unit
        if moment is not None:
            applied[2:] = np.asarray(moment) / (unit * 0.5 * journal.width)
        size, attitude = first_guess(ratio, applied[0], full=int(self.grid.settings[RUPTURE]) == FULL)
        state = np.array([size * math.cos(attitude), size * math.sin(attitude), 0.0, 0.0])
        freedoms = 2 if moment is None else 4
        self.film.active[0, 0] = -1.0
        steps = equilibrium(self.film, ratio**-2, applied, 0.5, freedoms, state, self.out, self.system)
        if steps < 0:
            tilted = "" if moment is None else f" and moments {moment[0]:g} {moment[1]:g} N m"
            raise SolverError(
                f"no film carries {load:g} N{tilted} (Sommerfeld number {3.0 * applied[0]:.4g}): after {-steps} steps "
                f"its least thickness is {_least(*state):.2g} of the clearance; take a smaller load"
                f"{tilted and ' or moment'}, or more speed or viscosity"
            )
        return self._result(journal, load, state, freedoms, steps)

    def _result(self, journal: Journal, load: float, state: Array, freedoms: int, steps: int) -> SteadyState:
        out, c = self.out, journal.clearance
        k_hat = -out[STIFFNESS:DAMPING].reshape(4, 4)[:freedoms, :freedoms]
        c_hat = -out[DAMPING:].reshape(4, 4)[:freedoms, :freedoms]
        turn = np.kron(np.eye(freedoms // 2), [[0.0, -1.0], [1.0, 0.0]])
        scale = slope_levers(journal, freedoms) * journal.force_unit / c
        stiffness = scale * (k_hat - 0.5 * c_hat @ turn)
        damping = scale * c_hat / journal.speed
        ex, ey, tx, ty = state.tolist()
        highest, flow = film_observables(self.grid, self.film.work)
        radius, speed = journal.radius, journal.speed
        fx, fy = journal.force_unit * out[:2]
        shear = journal.viscosity * radius**3 * journal.width * speed / c * film_shear(ex, ey, tx, ty)
        worst = max(math.hypot(ex + tx, ey + ty), math.hypot(ex - tx, ey - ty))
        threshold, ratio = whirl_threshold(stiffness[:2, :2], damping[:2, :2], load, c, speed)
        return SteadyState(
            eccentricity=state[:2].copy(),
            tilt=state[2:].copy(),
            attitude=math.atan2(ey, ex),
            least_film=c * (1.0 - worst),
            flow=2.0 * c * radius**3 / journal.width * speed * flow,
            friction_torque=shear + 0.5 * c * (ex * fy - ey * fx),
            largest_pressure=12.0 * journal.viscosity * speed * (radius / c) ** 2 * highest,
            stiffness=stiffness,
            damping=damping,
            whirl_threshold=threshold,
            whirl_ratio=ratio,
            sommerfeld=3.0 * load / journal.force_unit,
            iterations=steps,
        )


def slope_levers(journal: Journal, freedoms: int) -> Array:
    """Return factors (n, n) from coefficients by end displacements to coefficients by slopes (end = slope L/2)."""
    lever = np.array([1.0, 1.0, 0.5 * journal.width, 0.5 * journal.width])[:freedoms]
    return np.outer(lever, lever)


def whirl_threshold(stiffness: Array, damping: Array, load: float, c: float, speed: float) -> tuple[float, float]:
    """Return the threshold ω_s √(c m/W) and the whirl frequency over the speed, from (2, 2) coefficients.

    The result is (inf, 0) if the rotor is stable at all speeds; the threshold is 0 if at none (k_eq ≤ 0).
    """
    (kxx, kxy), (kyx, kyy) = stiffness
    (cxx, cxy), (cyx, cyy) = damping
    equivalent = (kxx * cyy + kyy * cxx - kxy * cyx - kyx * cxy) / (cxx + cyy)
    whirl2 = ((equivalent - kxx) * (equivalent - kyy) - kxy * kyx) / (cxx * cyy - cxy * cyx)
    if whirl2 <= 0.0:
        return (math.inf, 0.0) if equivalent > 0.0 else (0.0, 0.0)
    ratio = math.sqrt(whirl2) / speed
    if equivalent <= 0.0:
        return 0.0, ratio
    return math.sqrt(equivalent * c / load) / ratio, ratio


def first_guess(ratio: float, load: float, full: bool = False) -> tuple[float, float]:
    """Estimate eccentricity and attitude (rad) of a bearing of width-to-diameter ``ratio`` under ``load`` over F₀.

    The compliances of half (or full) films of a short (Ocvirk) and a long (Sommerfeld) bearing are added. The error is
    up to some 20 %.
    """
    low, high = -16.0, -1.0e-9
    for _ in range(50):
        middle = 0.5 * (low + high)
        eps = 1.0 - math.exp(middle)
        left = 1.0 - eps * eps
        # A full film has twice the force across the line of centres, and no force along it.
        around = math.pi * math.sqrt(left)
        short = ratio**2 * eps / (6.0 * left**2) * (2.0 * around if full else math.hypot(4.0 * eps, around))
        wide = eps / ((2.0 + eps * eps) * left) * (2.0 * around if full else math.hypot(2.0 * eps, around))
        if 1.0 / (1.0 / short + 1.0 / wide) > load:
            low = middle
        else:
            high = middle
    eps = 1.0 - math.exp(0.5 * (low + high))
    return eps, 0.5 * math.pi if full else math.atan2(math.pi * math.sqrt(1.0 - eps * eps), 4.0 * eps)


@kernel
def equilibrium(film, ratio2, applied, half_speed, freedoms, state, out, system):
    """Find the journal position (and tilt) at which the film carries ``applied`` (4,), over F₀ at speed one.

    ``film`` is a JournalFilm; ``state`` (4,) = (e, t) is the initial guess, then the result; ``freedoms`` is 2 or 4;
    ``out`` (36,) is the film's result; ``system`` (4, 5) is scratch. Each step leaves at least a third of the least
    film. Returns the number of steps, negative without convergence.
    """
    grid, work, active = film
    load = 0.0
    for j in range(freedoms):
        load = max(load, abs(applied[j]))
    for step in range(1, MOST_STEPS + 1):
        ex, ey, tx, ty = four(state, 0)
        at = Motion(ex, ey, tx, ty, half_speed * ey, -half_speed * ex, half_speed * ty, -half_speed * tx)
        if journal_film(grid, ratio2, at, work, active, out) < 0:
            return -step
        worst = 0.0
        for j in range(freedoms):
            system[j, freedoms] = -applied[j] - out[j]
            worst = max(worst, abs(system[j, freedoms]))
            for k in range(0, freedoms, 2):
                place = STIFFNESS + 4 * j + k
                rate = DAMPING + 4 * j + k
                system[j, k] = out[place] - half_speed * out[rate + 1]
                system[j, k + 1] = out[place + 1] + half_speed * out[rate]
        if worst <= RESIDUAL * load:
            return -step if border_tangents(grid, at, work, active, out) != 0 else step
        size2 = ex * ex + ey * ey
        if freedoms == 2 and grid.settings[NODE_GRADING] > 0.0 and size2 > 0.0:
            # Nodes (and supply) of a plain bore follow the journal, so film and force only rotate with the attitude.
            # Derivatives along the eccentricity are those of the film.
            for j in range(2):
                along = (system[j, 0] * ex + system[j, 1] * ey) / size2
                across = (-out[1] if j == 0 else out[0]) / size2
                system[j, 0] = along * ex - across * ey
                system[j, 1] = along * ey + across * ex
        if _solve_small(system, freedoms) != 0:
            return -step
        share = 1.0
        size = 0.0
        for j in range(freedoms):
            size = max(size, abs(system[j, freedoms]))
        if size > 0.3:
            share = 0.3 / size
        gap = _least(ex, ey, tx, ty)
        for _ in range(60):
            x, y, a, b = plus((ex, ey, tx, ty), scaled(share, four(system[:, freedoms], 0)))
            if _least(x, y, a if freedoms == 4 else tx, b if freedoms == 4 else ty) >= 0.35 * gap:
                break
            share *= 0.7
        for j in range(freedoms):
            state[j] += share * system[j, freedoms]
    return -MOST_STEPS


@kernel
def _least(ex, ey, tx, ty):
    """Return the least film over the clearance."""
    a = math.sqrt((ex + tx) * (ex + tx) + (ey + ty) * (ey + ty))
    b = math.sqrt((ex - tx) * (ex - tx) + (ey - ty) * (ey - ty))
    return 1.0 - max(a, b)


@kernel
def _solve_small(a, n):
    """Solve a system (n, n + 1) by Gauss with pivots; the solution replaces the last column. Returns 1 if singular."""
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[best, k]):
                best = i
        if a[best, k] == 0.0:
            return 1
        for j in range(k, n + 1):
            kept = a[k, j]
            a[k, j] = a[best, j]
            a[best, j] = kept
        for i in range(k + 1, n):
            share = a[i, k] / a[k, k]
            for j in range(k, n + 1):
                a[i, j] -= share * a[k, j]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            a[k, n] -= a[k, j] * a[j, n]
        a[k, n] /= a[k, k]
    return 0
