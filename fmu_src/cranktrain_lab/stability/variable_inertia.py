"""Stability map of parametric resonance: a crank on an elastic shaft, whose inertia varies with the angle by its rod.

A piston on a very long rod gives the crank J(θ) = J₀ (1 − ε cos 2θ). With the shaft's stiffness k and the angle
φ by which the crank leads uniform rotation θ = Ω t, small motions about it obey

    J φ̈ + J′ Ω φ̇ + (k + ½ J″ Ω²) φ = 0,

or over θ, with ν = ω_n/Ω and ω_n² = k/J₀: (J φ′)′ + (ν² J₀ + ½ J″) φ = 0, of period π. Floquet's theory: where the
monodromy matrix (its determinant is 1) has a trace beyond ±2, motion grows without any force. The first band lies
about ν = 1 and is classically ε/2 wide, 1 ± ε/4 (put cos θ or sin θ in and keep their own harmonic); the second about
ν = 2 has a width of order ε².

The product's side is no such equation: a rigid crank in the running model with a rod and piston of
:mod:`cranktrain.loads.slider_crank`, nonlinear and undamped, integrated as any run is. What it takes
to turn uniformly, ½ J′ Ω² = ε J₀ Ω² sin 2θ, comes through the shaft, whose far end is driven with just the wobble
(ε/ν²) sin 2θ: otherwise the crank would swing, and the bands move by some ε²/2. Three runs over half a turn, two of
them displaced a little, give the monodromy matrix by differences.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.state import (
    INPUTS_NOW,
    LAST_INTERVAL,
    LEAD_ANGLE,
    LEAD_SPEED,
    POSITION,
    SAMPLES,
    SHAFT_ANGLE,
    SHAFT_SPEED,
    VELOCITY,
    offset,
)
from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain_lab.stability.rotor import NOTHING, resting_state, rotor_body, rotor_engine
from cranktrain_lab.stability.stability_map import Axis, Progress, StabilityMap, bisected, curve, deviation

THROW, NATURAL = 0.5, 100.0
"""Throw (m) and natural angular frequency ω_n (rad/s) of the crank, chosen arbitrarily."""
LENGTH = 1.0e4
"""Ratio of rod length to throw, at which the rod's obliquity changes the inertia by 1e-4."""
STIFF = 1.0e12
"""Stiffness of the bearings, N/m, so high that the bearings have no effect."""
STEP = math.radians(2.5)
INTEGRATOR = "sdirk4"
"""Integrator of the runs. All stages are implicit, so the integrator needs no initial acceleration."""
KICK = 1.0e-4
"""Initial displacement (rad), and initial velocity over Ω, of runs for the monodromy matrix."""
GROWS = 1.0e-4
"""Least growth over half a turn that counts as unstable. Numerical errors are smaller."""
BANDS = {1: (0.6, 1.15), 2: (1.85, 2.01)}
"""Ranges of ν = ω_n/Ω that contain the instability bands about 1 and 2 for all ε of the map."""
WIDER = np.array([1.5, 3.0, 6.0])
"""Distances from the middle of an instability band, in half widths, at which a stable motion is searched in turn."""
ZOOMS, ZOOMED = 6, 41
"""Nested grids of ν in which the largest growth is found, each between two neighbours of the previous grid."""
_EXPLANATION = """\
Twice a turn the piston borrows the crank's energy and gives it back. Where the shaft's natural frequency is about \
the speed (ν = 1) or twice it (ν = 2), a swinging crank gets back more than it lent: no force is needed, and no \
integrator is at fault. The motion itself is unstable, and a step that follows it must let it grow.
The first band is about ε/2 wide and leans to lower ν; the second has a width of order ε². Between them nothing \
grows.
Damping closes them: a damping ratio ζ the first one for ε below 4 ζ. Over the throws of a six second order \
cancels, so that little of it is left; a single cylinder or a twin may have all of it.
What to do: keep speeds away from ω_n and ω_n/2, spread the reciprocating masses over the turn, or damp."""


@dataclass(frozen=True, eq=False)
class SingleCrank:
    """Started crank with one rod; ``epsilon`` is the relative variation of its inertia."""

    simulation: Simulation
    epsilon: float

    @classmethod
    def of(cls, epsilon: float) -> "SingleCrank":
        """Return a crank of the running model whose mean inertia and shaft give ω_n."""
        engine = rotor_engine()
        engine = replace(engine, crankshaft=replace(engine.crankshaft, throw=THROW))
        body = rotor_body(engine, 1.0e4)
        mean = float(body.inertia[2, 2]) / (1.0 - epsilon)
        bearing = engine.main_bearing
        assert bearing is not None
        engine = replace(
            engine,
            cylinders=replace(engine.cylinders, piston_mass=2.0 * mean * epsilon / THROW**2),
            # The rod is equal to two point masses, without residual inertia.
            rod=replace(engine.rod, length=LENGTH * THROW, inertia=0.5 * NOTHING * (LENGTH * THROW) ** 2),
            main_bearing=replace(bearing.in_rigid_bores, stiffness_x=STIFF, stiffness_y=STIFF),
            drive_line=replace(
                engine.drive_line, stiffness=mean * NATURAL**2, damping=0.0, speed_filter_time=0.0
            ),
        )  # fmt: skip
        settings = Settings(
            crank="rigid", bearings="linear", gas_source="input", gravity=0.0, integrator=INTEGRATOR,
            # The step is long enough for one step per communication step even at the shaft's highest speed.
            step=2.0 * STEP, reconstruction="interpolate", newton_tolerance=1.0e-11,
        )  # fmt: skip
        simulation = Simulation(engine, body, settings)
        simulation.inputs[0] = NATURAL
        simulation.initialize()
        return cls(simulation, epsilon)

    def monodromy(self, nu: float) -> Array:
        """Return the matrix (2, 2) of half a turn at Ω = ω_n/ν for (φ, φ̇/Ω)."""
        rest, displaced, hastened = (self.after(nu, *start) for start in ((0.0, 0.0), (KICK, 0.0), (0.0, KICK)))
        return np.column_stack((displaced - rest, hastened - rest)) / KICK

    def after(self, nu: float, lead: float, rate: float, half_turns: int = 1) -> Array:
        """Return φ and φ̇/Ω, (2,), after some half turns from the initial values ``lead`` and ``rate``."""
        simulation = self.simulation
        speed = NATURAL / nu
        wobble = 2.0 * self.epsilon / nu**2
        n = simulation.model.omega2.size
        unit = float(simulation.model.scalars[at.RIGID_ROTATION])
        q, v = offset(POSITION, n) + 5, offset(VELOCITY, n) + 5
        steps = half_turns * round(math.pi / STEP)
        h = STEP / speed
        state = resting_state(simulation, speed)
        state[SHAFT_SPEED] = state[INPUTS_NOW] = speed * (1.0 + wobble)
        state[LAST_INTERVAL], state[SAMPLES] = h, 1.0
        state[q] = lead / unit
        state[v] = speed * (rate - wobble) / unit
        simulation.inputs[0] = speed
        simulation.state = state
        for k in range(1, steps + 1):
            simulation.inputs[0] = speed * (1.0 + wobble * math.cos(2.0 * speed * k * h))
            simulation.step(k * h)
        end = simulation.state
        angle = end[SHAFT_ANGLE] + end[LEAD_ANGLE] + unit * end[q] - math.pi * half_turns
        return np.array([angle, (end[SHAFT_SPEED] + end[LEAD_SPEED] + unit * end[v]) / speed - 1.0])

    def growth(self, nu: float) -> float:
        """Return the largest growth factor over half a turn in the product's runs."""
        return float(np.abs(np.linalg.eigvals(self.monodromy(nu))).max())


def floquet(epsilon: float, nu: Array | float, steps: int = 400) -> tuple[Array, Array]:
    """Return trace and determinant (k,) of the exact monodromy matrix over θ = π, by fourth-order Runge–Kutta steps."""
    nu = np.atleast_1d(np.asarray(nu, dtype=float))
    y = np.zeros((2, 2, nu.size))
    y[0, 0] = y[1, 1] = 1.0
    h = math.pi / steps

    def rate(theta: float, y: Array) -> Array:
        inertia = 1.0 - epsilon * math.cos(2.0 * theta)
        slope, bend = 2.0 * epsilon * math.sin(2.0 * theta), 4.0 * epsilon * math.cos(2.0 * theta)
        return np.stack((y[1], (-slope * y[1] - (nu**2 + 0.5 * bend) * y[0]) / inertia))

    for k in range(steps):
        theta = k * h
        a = rate(theta, y)
        b = rate(theta + 0.5 * h, y + 0.5 * h * a)
        c = rate(theta + 0.5 * h, y + 0.5 * h * b)
        d = rate(theta + h, y + h * c)
        y = y + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
    return y[0, 0] + y[1, 1], y[0, 0] * y[1, 1] - y[0, 1] * y[1, 0]


def exact_band(epsilon: float, band: int) -> tuple[float, float]:
    """Return lower and upper ν of a band of instability, from the exact monodromy matrix; NaN if there is none."""
    # The trace is −2 at the edges of the first band, and +2 at the edges of the second band.
    sign = -1.0 if band % 2 else 1.0

    def beyond(nu: Array | float) -> Array:
        return np.asarray(sign * floquet(epsilon, nu)[0] - 2.0)

    low, high = BANDS[band]
    for _ in range(ZOOMS):
        grid = np.linspace(low, high, ZOOMED)
        found = beyond(grid)
        top = int(np.argmax(found))
        if found[top] > 0.0:
            break
        low, high = float(grid[max(0, top - 1)]), float(grid[min(ZOOMED - 1, top + 1)])
    else:
        return math.nan, math.nan
    inside = float(grid[top])
    lower, upper = (float(brentq(lambda nu: beyond(nu)[0], outside, inside)) for outside in BANDS[band])
    return lower, upper


def found_band(crank: SingleCrank, about: tuple[float, float]) -> tuple[float, float]:
    """Return lower and upper ν of the band in which the product's crank grows, searched from the middle of ``about``.

    An edge is NaN if there is growth even at ``WIDER`` times the half width of ``about``, or none in the middle.
    """
    if not np.isfinite(about).all():
        return math.nan, math.nan
    middle, half = 0.5 * (about[0] + about[1]), 0.5 * (about[1] - about[0])

    def grows(nu: float) -> bool:
        return crank.growth(nu) > 1.0 + GROWS

    def edge(side: float) -> float:
        outside = next((nu for nu in middle + side * half * WIDER if not grows(nu)), math.nan)
        return (
            bisected(grows, min(middle, outside), max(middle, outside), 2.0e-5) if math.isfinite(outside) else math.nan
        )

    return edge(-1.0), edge(1.0)


LARGEST, LOWEST = 0.3, 0.8
"""Largest ε and least ν of the map; beyond 2 ε = ν² the far end of the shaft would have to rotate backwards."""


def compute(quick: bool, progress: Progress) -> StabilityMap:
    """Compute the map of the relative variation of inertia over ν = ω_n/Ω."""
    shares = np.linspace(0.05, LARGEST, 5 if quick else 16)
    ratios = np.linspace(LOWEST, 2.1, 27 if quick else 79)
    growth = np.zeros((shares.size, ratios.size))
    edges = {(band, side): np.full((2, shares.size), np.nan) for band in BANDS for side in (0, 1)}
    for i, share in enumerate(shares):
        progress(f"crank whose inertia varies by {share:.3g}", i / shares.size)
        crank = SingleCrank.of(float(share))
        growth[i] = [crank.growth(float(nu)) for nu in ratios]
        for band in BANDS:
            exact = exact_band(float(share), band)
            found = found_band(crank, exact)
            for side in (0, 1):
                edges[band, side][:, i] = exact[side], found[side]
    theory, simulated = [], []
    # The curve of a band goes along the band's lower edge and back along the upper edge.
    rows = np.concatenate((shares[::-1], shares))
    for band in BANDS:
        both = np.concatenate((edges[band, 0][:, ::-1], edges[band, 1]), axis=1)
        name = f"band about ν = {band}"
        theory.append(curve(name, both[0], rows, "Floquet: monodromy matrix of the linear equation"))
        simulated.append(curve(name, both[1], rows, "rod in the running model, differences of runs"))
    classical = np.concatenate((1.0 - 0.25 * shares[::-1], 1.0 + 0.25 * shares))
    theory.append(curve("classical first band, 1 ± ε/4", classical, rows, "first harmonic"))
    return StabilityMap(
        name="variable_inertia",
        title="Parametric resonance by the rods' varying inertia: an undamped crank on its shaft",
        rows=Axis("share ε of the inertia that varies", "", shares),
        columns=Axis("natural frequency over speed ν = ω_n/Ω", "", ratios),
        stable=growth <= 1.0 + GROWS,
        measure=growth,
        measure_label="growth over half a turn",
        theory=tuple(theory),
        numerical=tuple(simulated),
        max_deviation=max(deviation(pair[1], pair[0]) for pair in edges.values()),
        explanation=_EXPLANATION,
        failure="motion grows",
    )
