"""Steady bearing with rough surfaces, pressure-dependent oil and elastic bore, by the general film solver.

The film is :func:`cranktrain.film.reynolds.field.solve_film` on the journal's gap

    h = c − (e + ζ t)·n + Σ_k δ_k s_k(φ, ζ),    n = (cos φ, sin φ),

with any model of rupture, flow factors of rough surfaces, and viscosity and density that depend on pressure. Asperities
add Greenwood and Tripp's contact pressure p_c(h) and the boundary friction μ p_c + τ₀ A_real/A. The bore deflects under
both pressures, δ_k = c_k ∫ w_k (p + p_c) dA, see :mod:`cranktrain.film.elastic.bore_compliance`.

The equilibrium of forces (and moments) and of the bore's shapes is one system for Newton's method. Its Jacobian is
computed by differences and updated by Broyden's rank-one correction. Stiffness and damping are differences between
films: stiffness between steady films, damping at an instant (the fill of an opening gap unchanged). The response of the
bore is eliminated, because the bore follows without delay.

Friction is that of a filled gap, as in :mod:`cranktrain.film.steady.bearing`: ∫ η(p) U R/h_T dA, half of e × F of the
film, and the friction of the asperities.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cranktrain.core.errors import SolverError
from cranktrain.core.kernel import kernel
from cranktrain.core.reduced_body import Array
from cranktrain.engine.lubricant import CONSTANT, density_factor, pressure_constants, pressure_factor
from cranktrain.engine.parts import Oil
from cranktrain.film.contact.asperity import FRICTION, SHEAR, SIGMA, contact_pressure, contact_table
from cranktrain.film.elastic.bore_compliance import BoreCompliance
from cranktrain.film.reynolds.field import FilmSolution, Supply, solve_film
from cranktrain.film.reynolds.liquid import Density
from cranktrain.film.reynolds.piezoviscosity import Law
from cranktrain.film.reynolds.rough_gap import Roughness
from cranktrain.film.steady.bearing import (
    Journal,
    SteadyBearing,
    SteadyState,
    bearing_grid,
    slope_levers,
    whirl_threshold,
)
from cranktrain.film.steady.conserving_bearing import ConservingGrid, conserving_grid

MOST_STEPS = 40
RESIDUAL = 1.0e-6
"""Tolerance of the equilibrium: force over the load, and shapes over the clearance."""
DIFFERENCE = 0.02
"""Step of finite differences: displacement over the gap or the eccentricity, velocity over the wedge velocity."""
OPEN = 0.5
"""Least gap of a rough film over the roughness, down to which flow factors are published."""
OPENINGS = 30
"""Limit of attempts to find a film that carries less load, at the start and by shorter steps."""
TOWARDS_CAP = -0.5 * math.pi
"""Angle of x (direction of the load or the given position) in the axes of an elastic bore: down onto the cap."""
GROWTH = 3.0
"""Largest factor by which a step may increase the residual."""
CLOSING = 0.5
"""Fraction of the film thickness, or of the roughness, by which a Newton step may close the film."""


@dataclass(frozen=True)
class Surroundings:
    """Models of cavitation, oil, surfaces and bore.

    Attributes
    ----------
    cavitation : model of :func:`cranktrain.film.reynolds.field.solve_film`
    oil : oil with ``pressure_law`` and ``compressibility``; None for constant properties
    roughness : roughness of the surfaces; None for smooth surfaces
    contact : constants of :func:`cranktrain.film.contact.asperity.contact_constants`; None for no contact
    bore : elastic bore; None for a rigid bore
    thinning : function of angles (n,) from x, rad, that returns η over the journal's viscosity; None for 1
    """

    cavitation: str = "mass-conserving"
    oil: Oil | None = None
    roughness: Roughness | None = None
    contact: Array | None = None
    bore: BoreCompliance | None = None
    thinning: Callable[[Array], Array] | None = None

    def laws(self, viscosity: float) -> tuple[Law | None, Density | None]:
        """Return the factors of viscosity and density over pressure, for ``viscosity`` (Pa s) at ambient pressure."""
        if self.oil is None:
            return None, None
        law, first, second = pressure_constants(self.oil, viscosity)

        def factors(pressure: Array) -> Array:
            out = np.empty(pressure.size)
            _viscosities(law, np.ascontiguousarray(pressure).ravel(), first, second, out)
            return out.reshape(pressure.shape)

        def densities(pressure: Array) -> tuple[Array, Array]:
            out = np.empty((2, pressure.size))
            _densities(np.ascontiguousarray(pressure).ravel(), out)
            return out[0].reshape(pressure.shape), out[1].reshape(pressure.shape)

        return None if law == CONSTANT else factors, None if self.oil.compressibility == "none" else densities


@dataclass(frozen=True)
class Loads:
    """Loads of one film, SI: forces (F_x, F_y, ∫ζ dF_x, ∫ζ dF_y) of film and asperities, resulting shape amplitudes."""

    force: Array
    touching: Array
    shapes: Array
    film: FilmSolution
    gap: Array
    rubbing: float  # friction torque of the asperities, N m
    pressing: float  # largest contact pressure, Pa
    area: float  # real contact area, m²
    rows: Array  # friction force of the asperities at each angle, N


class MixedBearing:
    """Analysis of steady bearings with equal models of cavitation, oil, surfaces and bore.

    Parameters
    ----------
    around : Surroundings
    supply, grid, groove : widest-gap, none or two-axial; grid intervals (around, across); extent of a groove, rad
    """

    def __init__(self, around: Surroundings, supply: str, grid: tuple[int, int], groove: float = 0.0) -> None:
        self.around, self.supply, self.grid, self.groove = around, supply, grid, groove
        self.table = contact_table()
        self.shapes = 0 if around.bore is None else len(around.bore.compliance)

    def state(
        self,
        journal: Journal,
        load: float | None,
        moment: tuple[float, float] | None = None,
        place: tuple[float, float] = (0.0, 0.0),
    ) -> SteadyState:
        """Find the equilibrium under ``load`` (N) and ``moment`` (N m), or at the given position ``place``.

        If ``load`` is None, ``place`` is the eccentricity over the clearance, and the load is a result.

        Raises
        ------
        InputError
            if the load is not above zero, or grid or grooves are invalid
        SolverError
            if no film is found that carries the load
        """
        running, y, steps = self.solved(journal, load, moment, place)
        return running.result(y, steps)

    def solved(
        self,
        journal: Journal,
        load: float | None,
        moment: tuple[float, float] | None = None,
        place: tuple[float, float] = (0.0, 0.0),
    ) -> tuple[Running, Array, int]:
        """Solve the equilibrium of :meth:`state`. Return Newton's method, its unknowns and its number of steps."""
        count = 0 if load is None else 2 if moment is None else 4
        wanted = np.zeros(4)
        y = np.zeros(4 + self.shapes)
        y[:2] = place
        if load is not None:
            y[:4] = self._guess(journal, load, moment)
            wanted[0] = -load
            if moment is not None:
                wanted[2:] = -2.0 / journal.width * np.asarray(moment)
        running = Running(self, journal, wanted, count)
        if load is not None:
            y = running.opened(self._nodes(journal, y), y)
        elif self.shapes:
            y = running.approached(self._nodes(journal, y), y)
        for turn in range(4):
            nodes = self._nodes(journal, y)
            before = y[:2].copy()
            y, steps = running.settle(nodes, y)
            if turn > 0 and np.abs(y[:2] - before).max() < 0.02:
                break
        return running, y, steps

    def _guess(self, journal: Journal, load: float, moment: tuple[float, float] | None) -> Array:
        """Return the position (4,) in a smooth rigid bearing, or in contact if no film carries the load."""
        rigid = bearing_grid(self.supply, n_phi=96, groove=self.groove, tilted=moment is not None)
        try:
            guess = SteadyBearing(rigid).state(journal, load, moment)
        except SolverError:
            if self.around.contact is None:
                raise
            return np.array([1.0 - float(self.around.contact[SIGMA]) / journal.clearance, 0.0, 0.0, 0.0])
        return np.concatenate((guess.eccentricity, guess.tilt))

    def _nodes(self, journal: Journal, y: Array) -> ConservingGrid:
        """Make the grid for a journal near ``y``."""
        return conserving_grid(y[:2], journal.width / journal.diameter, self.supply, *self.grid, self.groove)


class Running:
    """Newton's method for one journal, with unknowns y over the clearance: eccentricity, tilt, shapes."""

    def __init__(self, bearing: MixedBearing, journal: Journal, wanted: Array, count: int) -> None:
        self.bearing, self.journal, self.wanted = bearing, journal, wanted
        self.free = np.r_[np.arange(count), np.arange(4, 4 + bearing.shapes)]
        self.law, self.density = bearing.around.laws(journal.viscosity)
        self.unit = float(np.abs(wanted).max()) or 1.0
        self.last: FilmSolution | None = None
        stiffens = self.law is not None
        self.hint = ", or an elastic bore or less pressure_viscosity: oil may stiffen without bound" if stiffens else ""

    def place(self, nodes: ConservingGrid) -> None:
        """Set the grid, and compute normals, bore shapes and their weights on it."""
        bore = self.bearing.around.bore
        self.nodes, self.last = nodes, None
        self.normal = np.array([np.cos(nodes.phi), np.sin(nodes.phi)])
        self.forms = np.zeros((0, nodes.phi.size, nodes.zeta.size))
        self.weights = self.forms
        if bore is not None:
            angles = nodes.phi + TOWARDS_CAP
            self.forms = bore.shapes(angles, nodes.zeta)
            self.weights = bore.compliance[:, None, None] * bore.weights(angles, nodes.zeta)

    def gap(self, y: Array) -> Array:
        """Return h over the clearance, (n_φ, n_ζ)."""
        tilt = np.outer(y[2:4] @ self.normal, self.nodes.zeta)
        return np.asarray(1.0 - (y[:2] @ self.normal)[:, None] - tilt + np.tensordot(y[4:], self.forms, 1))

    def loads(self, y: Array, rate: Array | None = None) -> Loads:
        """Compute the loads of the film at ``y`` and, if given, at a ``rate`` (4,) of eccentricity and tilt, 1/s."""
        journal, around, nodes = self.journal, self.bearing.around, self.nodes
        c, radius, width = journal.clearance, journal.radius, journal.width
        gap = c * self.gap(y)
        nominal = gap if around.roughness is None else np.maximum(gap, OPEN * around.roughness.height)
        squeeze = np.zeros_like(gap)
        if rate is not None:
            squeeze -= c * ((rate[:2] @ self.normal)[:, None] + np.outer(rate[2:] @ self.normal, nodes.zeta))
        viscosity = np.full(gap.shape, journal.viscosity)
        if around.thinning is not None:
            viscosity *= around.thinning(nodes.phi)[:, None]
        fed = np.repeat(nodes.fed[:, None], nodes.zeta.size, axis=1)
        film = solve_film(
            nominal, (2.0 * math.pi * radius, width), speeds=(journal.speed * radius, 0.0), viscosity=viscosity,
            pressure_viscosity=self.law, density=self.density, roughness=around.roughness, squeeze=squeeze,
            periodic=True, supplies=(Supply("supply", fed, 0.0),) if fed.any() else (), cavitation=around.cavitation,
            nodes=(radius * (nodes.phi - nodes.phi[0]), 0.5 * width * (nodes.zeta + 1.0)), guess=self.last,
        )  # fmt: skip
        self.last = film
        pressed = film.pressure * (0.5 * film.areas.sum(axis=1)[:, None] * nodes.weight)
        touched, rows, pressing, area = np.zeros_like(pressed), np.zeros(len(pressed)), 0.0, 0.0
        if around.contact is not None:
            out = np.empty((2, gap.size))
            _touch(gap.ravel(), around.contact, self.bearing.table, out)
            touched = out[0].reshape(gap.shape) * film.areas
            true = out[1].reshape(gap.shape) * film.areas
            pressing, area = float(out[0].max()), float(true.sum())
            rows = (around.contact[FRICTION] * touched + around.contact[SHEAR] * true).sum(axis=1)
        parts = [
            -np.concatenate((self.normal @ part.sum(axis=1), self.normal @ (part @ nodes.zeta)))
            for part in (pressed, touched)
        ]
        shapes = np.tensordot(self.weights, pressed + touched, 2)
        return Loads(parts[0] + parts[1], parts[1], shapes, film, gap, float(rows.sum()) * radius, pressing, area, rows)

    def residual(self, y: Array, loads: Loads) -> Array:
        """Return the residual (free,): forces over the largest applied force, shapes over the clearance."""
        missing = (loads.force - self.wanted) / self.unit
        shapes = y[4:] - loads.shapes / self.journal.clearance
        return np.concatenate((missing, shapes))[self.free]

    def opened(self, nodes: ConservingGrid, y: Array) -> Array:
        """Return a position between ``y`` and the centre whose film force is moderate, as start of Newton's method."""
        self.place(nodes)
        rough = self.bearing.around.roughness
        for _ in range(OPENINGS):
            least = float(self.gap(y).min())
            if rough is None or least > 0.5 * rough.height / self.journal.clearance:
                try:
                    if np.abs(self.loads(y).force).max() < 1.5 * self.unit:
                        break
                except SolverError:
                    pass
            y = y * (1.0 - min(0.2 * max(least, 1e-3), 0.1))
        return y

    def approached(self, nodes: ConservingGrid, y: Array) -> Array:
        """Find the shapes at the position of ``y``, which may lie beyond the undeformed bore, by steps towards it."""
        place, reached = y[:2].copy(), 0.0
        share = min(1.0, 0.8 / max(float(np.hypot(*place)), 1e-12))
        for _ in range(2 * OPENINGS):
            try:
                opened, _ = self.settle(nodes, np.concatenate((share * place, y[2:])))
            except SolverError:
                share = 0.5 * (reached + share)
                continue
            if share >= 1.0:
                return opened
            y, reached = opened, share
            share = min(1.0, share + CLOSING * float(self.gap(y).min()) / float(np.hypot(*place)))
        raise SolverError(f"no film found at eccentricity {np.hypot(*place):.4g}, only up to {reached:.3g} times that")

    def jacobian(self, y: Array, at: Array) -> Array:
        """Return derivatives of the residual by the free unknowns, by finite differences that open the film.

        Rough surfaces may approach until their mean planes meet; the gap of the oil is at least OPEN.
        """
        columns, rough = [], self.bearing.around.roughness
        least = float(self.gap(y).min())
        if rough is not None:
            least = max(abs(least), OPEN * rough.height / self.journal.clearance)
        for k in self.free:
            step = 0.02 * least if k < 4 else 0.02 * max(least, 0.01)
            moved = y.copy()
            moved[k] += -math.copysign(abs(step), y[k]) if k < 4 else step
            columns.append((self.residual(moved, self.loads(moved)) - at) / (moved[k] - y[k]))
        return np.array(columns).T

    def settle(self, nodes: ConservingGrid, y: Array) -> tuple[Array, int]:
        """Iterate Newton's method on one grid. Return the unknowns and the number of steps."""
        self.place(nodes)
        here = self.residual(y, self.loads(y))
        if not self.free.size:
            return y, 0
        jacobian = self.jacobian(y, here)
        for steps in range(1, MOST_STEPS + 1):
            if np.abs(here).max() <= RESIDUAL:
                return y, steps
            change = np.zeros_like(y)
            change[self.free] = -np.linalg.solve(jacobian, here)
            moved, there = self._tried(y, change * self._share(y, change), np.abs(here).max())
            step = (moved - y)[self.free]
            length = float(step @ step)
            if length == 0.0:
                break
            slow = np.abs(there).max() > 0.3 * np.abs(here).max()
            jacobian = jacobian + np.outer(there - here - jacobian @ step, step) / length
            y, here = moved, there
            if slow:
                jacobian = self.jacobian(y, here)
        carried = "film and bore settle" if self.free[0] > 1 else f"film carries {self.unit:g} N"
        raise SolverError(
            f"no {carried} on a grid {self.bearing.grid[0]} x {self.bearing.grid[1]}: relative residual "
            f"{np.abs(here).max():.2g}; change the grid, take less load or more viscosity{self.hint}"
        )

    def _tried(self, y: Array, change: Array, before: float) -> tuple[Array, Array]:
        """Return unknowns and film after a step that is shortened until the residual is not far above ``before``."""
        for _ in range(OPENINGS):
            try:
                there = self.residual(y + change, self.loads(y + change))
                if np.abs(there).max() < GROWTH * before:
                    return y + change, there
            except SolverError:
                pass
            change = 0.5 * change
        return y, np.full(self.free.size, before)

    def _share(self, y: Array, change: Array) -> float:
        """Return the fraction of a step that keeps the film open."""
        rough = self.bearing.around.roughness
        gap = self.gap(y)
        least = 0.0 if rough is None else rough.height / self.journal.clearance
        room = np.maximum(gap, least)
        closing = float(((gap - self.gap(y + change)) / room).max())
        return min(1.0, CLOSING / max(closing, 1e-12), 0.3 / max(float(np.abs(change).max()), 1e-12))

    def coefficients(self, y: Array, count: int) -> tuple[Array, Array]:
        """Return stiffness times c and damping times c ω, (count, count) N, with the bore's response eliminated."""
        k = self.bearing.shapes
        size = float(np.hypot(*y[:2]))
        away = DIFFERENCE * min(max(float(self.gap(y).min()), 1e-4), max(size, 1e-4))
        fast = DIFFERENCE * 0.5 * max(size, 1e-4) * self.journal.speed

        def slopes(of: int, step: float, moving: bool) -> Array:
            pair = []
            for sign in (1.0, -1.0):
                moved, rate = y.copy(), np.zeros(4)
                (rate if moving else moved)[of] += sign * step
                loads = self.loads(moved, rate if moving else None)
                pair.append(np.concatenate((loads.force, loads.shapes / self.journal.clearance)))
            return (pair[0] - pair[1]) / (2.0 * step)

        by_shapes = np.array([slopes(4 + j, away, False) for j in range(k)]).T.reshape(4 + k, k)
        answer = np.linalg.inv(np.eye(k) - by_shapes[4:])
        found = []
        for step, moving in ((away, False), (fast, True)):
            by = np.array([slopes(j, step, moving) for j in range(count)]).T
            found.append(-(by[:4] + by_shapes[:4] @ answer @ by[4:])[:count])
        return found[0], found[1] * self.journal.speed

    def side_flow(self, film: FilmSolution) -> float:
        """Return the flow out of both ends, m³/s, with the squeeze flow of end strips next to a film under pressure.

        The solver takes the strips as full all around, so that their squeeze flow sums to zero.
        """
        flow = film.flows["z0"] + film.flows["z1"]
        for end, inside in ((0, 1), (-1, -2)):
            h, strip = film.h[:, end], 0.5 * abs(film.z[inside] - film.z[end])
            gained = 0.25 * (np.roll(h, -1) - np.roll(h, 1)) * self.journal.speed * self.journal.radius * strip
            flow -= float(gained[film.pressure[:, inside] > 0.0].sum())
        return flow

    def result(self, y: Array, steps: int) -> SteadyState:
        """Return the steady state at the solution ``y``."""
        journal = self.journal
        c, radius = journal.clearance, journal.radius
        count = 4 if 3 in self.free else 2
        stiffness, damping = self.coefficients(y, count)
        here = self.loads(y)
        # Results are in axes along the load, which differ from x if the position was given.
        towards = math.atan2(-here.force[1], -here.force[0])
        turn_back = np.array([[math.cos(towards), math.sin(towards)], [-math.sin(towards), math.cos(towards)]])
        turned = np.kron(np.eye(count // 2), turn_back)
        stiffness, damping = turned @ stiffness @ turned.T, turned @ damping @ turned.T
        scale = slope_levers(journal, count) / c
        stiffness, damping = scale * stiffness, scale * damping / journal.speed
        load = float(np.hypot(*here.force[:2]))
        threshold, whirl = whirl_threshold(stiffness[:2, :2], damping[:2, :2], load, c, journal.speed)
        film, force = here.film, here.force - here.touching
        drag = float((film.viscosity / film.h * film.areas).sum()) * journal.speed * radius * radius
        turn = 0.5 * c * float(y[0] * force[1] - y[1] * force[0])
        place, tilt = turn_back @ y[:2], turn_back @ y[2:4]
        return SteadyState(
            eccentricity=place,
            tilt=tilt,
            attitude=math.atan2(place[1], place[0]),
            least_film=float(here.gap.min()),
            flow=self.side_flow(film),
            friction_torque=drag + turn + here.rubbing,
            largest_pressure=film.p_max,
            stiffness=stiffness,
            damping=damping,
            whirl_threshold=threshold,
            whirl_ratio=whirl,
            sommerfeld=3.0 * load / journal.force_unit,
            iterations=steps,
            load=load,
            contact_load=float(np.hypot(*here.touching[:2])),
            contact_torque=here.rubbing,
            contact_pressure=here.pressing,
            contact_area=here.area,
            bore_opening=float(c * np.abs(np.tensordot(y[4:], self.forms, 1)).max()) if y.size > 4 else 0.0,
        )


@kernel
def _viscosities(law, pressures, first, second, out):
    """Compute η/η₀ at every pressure (n,), in ``out`` (n,)."""
    for k in range(pressures.shape[0]):
        out[k], _ = pressure_factor(law, pressures[k], first, second)


@kernel
def _densities(pressures, out):
    """Compute ρ/ρ₀ and its derivative at every pressure (n,), in ``out`` (2, n)."""
    for k in range(pressures.shape[0]):
        out[0, k], out[1, k] = density_factor(pressures[k])


@kernel
def _touch(gaps, constants, table, out):
    """Compute contact pressure (Pa) and fraction of area in contact at every gap (n,), m, in ``out`` (2, n)."""
    for k in range(gaps.shape[0]):
        p, _, area = contact_pressure(gaps[k], constants, table)
        out[0, k] = p
        out[1, k] = area
