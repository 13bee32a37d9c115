"""Stability map of the onset of oil whirl with each integrator, which depends on numerical damping.

A rigid rotor on two of the six's films at constant speed and load; its mass moves it through the threshold of its
speed parameter, so that the film's equilibrium, K and C stay. Whirl sets in where ω √(c m/W) reaches the threshold of
these coefficients (:func:`~cranktrain.film.steady.bearing.whirl_threshold`). A method that takes energy out of resolved
motion hides it.

Found: the whole running model over one revolution, from its own periodic orbit (which shooting finds) and from states
beside it: onset is where the largest multiplier of that map has the size one. Theory of a method: its table applied to
the linear film in the turning frame, in plain NumPy, over the same revolution.

In that frame a load at rest turns backwards. If a method follows the load with an error in velocity, this error acts on
the film as squeeze, and the equilibrium position of the journal changes. The error of backward Euler's ė is ½ hΩ² e,
outwards, so the journal lies nearer to the middle, and the film is linearised about this position
(:func:`film_as_seen`).
"""

import math
from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq, root

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.simulation import Simulation
from cranktrain.dynamics.time.integrators import carried, family, integrator_table
from cranktrain.dynamics.time.table import ALPHA_F, ALPHA_M, BETA, GAMMA, HEAD, STAGES
from cranktrain.film.laws.impedance import MapFilm, journal_force
from cranktrain.film.laws.parameters import CLEARANCE
from cranktrain.film.steady.bearing import whirl_threshold
from cranktrain_lab.stability.amplification import scaled, step_matrix
from cranktrain_lab.stability.rotor import (
    SPEED,
    LinearFilm,
    default_method,
    film_at,
    film_law,
    film_rotor,
    modal_places,
)
from cranktrain_lab.stability.stability_map import Axis, Onset, Progress, StabilityMap, curve, deviation, onset

ECCENTRICITY = 0.4
METHODS = ("generalised-alpha:0.6",)
OTHERS = ("hht:-0.1", "bdf2")
"""Integrators of every map in addition to backward Euler and the default, and more for the full map."""
LOWEST, HIGHEST = 0.7, 3.0
"""Search range of the onset, as ratios of speed to threshold."""
LEAST = 0.05
"""Lower bound of the search (speed over threshold) if whirl has already set in at the lowest speed."""
APART = 0.15
"""Spacing of the logarithms of speed in the first, coarse search."""
KICK = 1.0e-4
"""Displacement from the orbit for differences over a revolution, in clearances and clearances times ω."""
NEWTON = 1.0e-11
"""Tolerance of Newton's method, small enough not to disturb differences of size KICK."""
_TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


def threshold_mass(film: LinearFilm, clearance: float) -> float:
    """Return the mass on the film (kg) at which whirl sets in at the present speed."""
    parameter, _ = whirl_threshold(film.stiffness, film.damping, film.load, clearance, SPEED)
    return parameter**2 * film.load / (clearance * SPEED**2)


def film_as_seen(method: str, step: float, law: MapFilm, film: LinearFilm, mass: float) -> LinearFilm:
    """Return the film linearised about the journal position at which a method holds its load; step in rad.

    A steady journal r is q = r exp(−iΩt) in the frame. Methods with one film evaluation per step approximate its rates
    by their difference formulas. Methods with several stages follow it to their order and count as exact.
    """
    table, h = integrator_table(method), step / SPEED
    z = np.exp(-1j * step)
    if family(table).name == "newmark":
        alpha_m, alpha_f, beta, gamma = table[HEAD, [ALPHA_M, ALPHA_F, BETA, GAMMA]]
        auxiliary = (z - 1.0) / (h * h * (0.5 - beta + beta * z) + h * h * (1.0 - gamma + gamma * z) / (z - 1.0))
        velocity = auxiliary * h * (1.0 - gamma + gamma * z) / (z - 1.0)
        rate = auxiliary * ((1.0 - alpha_m) * z + alpha_m) / ((1.0 - alpha_f) * z + alpha_f)
    elif family(table).name == "bdf2":
        velocity = (1.5 - 2.0 / z + 0.5 / z**2) / h
        rate = velocity**2
    elif table[HEAD, STAGES] == 1.0:
        velocity = (1.0 - 1.0 / z) / h
        rate = velocity**2
    else:
        return film
    out = np.zeros(16)

    def unbalanced(place: Array) -> Array:
        r = law.clearance * complex(place[0], place[1])
        v = (velocity + 1j * SPEED) * r
        a = (rate + 2j * SPEED * velocity - SPEED**2) * r
        journal_force(r.real, r.imag, v.real, v.imag, 0.5 * SPEED, law, out)
        return np.array([out[0] - mass * a.real, out[1] - film.load - mass * a.imag]) / film.load

    found = root(unbalanced, film.place / law.clearance, tol=1e-12)
    unbalanced(found.x)
    stiffness, damping = -out[2:6].reshape(2, 2), -out[6:10].reshape(2, 2)
    return LinearFilm(law.clearance * found.x, stiffness, damping, film.load)


def linear_growth(method: str, step: float, law: MapFilm, film: LinearFilm, mass: float) -> float:
    """Return the whirl's growth per revolution, ln, of a method on the linear film in the frame; step in rad."""
    seen = film_as_seen(method, step, law, film, mass)
    stiffness, damping = seen.stiffness / mass, seen.damping / mass

    def system(t: float) -> tuple[Array, Array]:
        cos, sin = math.cos(SPEED * t), math.sin(SPEED * t)
        turn = np.array([[cos, -sin], [sin, cos]])
        c, k = turn.T @ damping @ turn, turn.T @ stiffness @ turn
        return k + SPEED * c @ _TURN - SPEED**2 * np.eye(2), c + 2.0 * SPEED * _TURN

    count = round(2.0 * math.pi / step)
    h, table = 2.0 * math.pi / SPEED / count, integrator_table(method)
    # In the rotating frame the film is periodic in half a revolution.
    half = count // 2 if count % 2 == 0 else count
    over = np.eye(2 * len(carried(table)))
    for k in range(half):
        over = scaled(step_matrix(table, h, system, k * h).real, table, SPEED) @ over
    return math.log(float(np.abs(np.linalg.eigvals(over)).max())) * count / half


def running_growth(method: str, step: float, film: LinearFilm, mass: float) -> float:
    """Return the whirl's growth per revolution, ln, of the running model with its nonlinear film; step in rad."""
    simulation = film_rotor(mass, film.load, integrator=method, step=step, newton_tolerance=NEWTON)
    count = round(2.0 * math.pi / step)
    blocks = carried(simulation.model.stages)
    at = modal_places(simulation, [0, 1], [block for block, _ in blocks]).ravel()
    # Modal size of a displacement by one clearance, and of its rates at the rotor's speed.
    size = simulation.model.bearings[0, CLEARANCE] * math.sqrt(simulation.body.mass)
    unit = np.repeat([size * SPEED**power for _, power in blocks], 2)
    matrix = np.eye(at.size)
    # Two-step methods begin with an artificial previous step.
    _revolved(simulation, count)
    for _ in range(2):
        # The closed orbit of the numerical method differs slightly from the film's equilibrium.
        start, end = simulation.state, _revolved(simulation, count)
        # Matrix of a revolution about an orbit from start to end, scaled by unit.
        columns = []
        for k in range(at.size):
            beside = start.copy()
            beside[at[k]] += KICK * unit[k]
            simulation.state = beside
            columns.append((_revolved(simulation, count) - end)[at] / (KICK * unit))
        matrix = np.array(columns).T
        start[at] += unit * np.linalg.solve(np.eye(at.size) - matrix, (end - start)[at] / unit)
        simulation.state = start
    return math.log(float(np.abs(np.linalg.eigvals(matrix)).max()))


def _revolved(simulation: Simulation, count: int) -> Array:
    """Return the state after a revolution in ``count`` steps."""
    begin, h = simulation.time, 2.0 * math.pi / SPEED / count
    for k in range(count):
        simulation.step(begin + (k + 1) * h)
    return simulation.state


def whirl_onset(growth: Callable[[float], float], critical: float, low: float = LOWEST, high: float = HIGHEST) -> Onset:
    """Ratio of the speed at which the growth rate ``growth(mass)`` first crosses zero to the theoretical threshold.

    If the growth rate is already positive at ``low``, smaller speeds are searched. Far above the threshold a method
    that damps more than the film drives may hold the rotor again.
    """

    def at(ratio: float) -> float:
        return growth(ratio**2 * critical)

    places = np.geomspace(low, high, max(2, math.ceil(math.log(high / low) / APART) + 1))
    return onset(lambda ratio: at(ratio) > 0.0, places, 0.0, LEAST, lambda a, b: float(brentq(at, a, b, xtol=5e-5)))


def compute(quick: bool, progress: Progress) -> StabilityMap:
    """Compute the map over step and speed."""
    degrees = np.array([1.25, 2.5, 5.0, 10.0] if quick else [0.25, 0.5, 1.0, 1.5, 2.5, 4.0, 5.0, 7.5, 10.0, 15.0])
    law: MapFilm = film_law(film_rotor(10.0, 1000.0).model.bearings[0])
    film = film_at(ECCENTRICITY, law)
    critical = threshold_mass(film, law.clearance)
    methods = ("backward-euler", default_method(), *METHODS, *(() if quick else OTHERS))
    theory = [[Onset(math.inf)] * degrees.size for _ in methods]
    found = [list(row) for row in theory]
    for i, method in enumerate(methods):
        for j, step in enumerate(np.radians(degrees)):
            progress(f"onset by {method} at {degrees[j]:g} deg", (i * degrees.size + j) / (len(methods) * degrees.size))
            expected = whirl_onset(lambda mass, m=method, s=step: linear_growth(m, s, law, film, mass), critical)  # type: ignore[misc]
            theory[i][j] = found[i][j] = expected
            if expected.found:
                found[i][j] = whirl_onset(
                    lambda mass, m=method, s=step: running_growth(m, s, film, mass),  # type: ignore[misc]
                    critical, 0.96 * expected, 1.04 * expected,
                )  # fmt: skip
    ratios = np.linspace(0.8, 1.5, 29)
    growth = np.array(
        [[linear_growth(methods[0], step, law, film, r**2 * critical) for step in np.radians(degrees)] for r in ratios]
    )
    source = "the method's table on the linear film in the turning frame, over a revolution"
    whole = "the running model over a revolution: multiplier of size one"
    physical = np.array([degrees[0], degrees[-1]])
    progress("done", 1.0)
    return StabilityMap(
        name="oil_whirl",
        title=f"Onset of oil whirl by integrator, film at eccentricity {ECCENTRICITY:g}",
        rows=Axis("speed over the threshold of whirl", "", ratios),
        columns=Axis("step", "deg of crank angle", degrees, log=True),
        stable=growth < 0.0,
        measure=growth,
        measure_label="growth of the whirl per revolution under backward Euler, ln",
        theory=(
            curve("threshold of the film's K and C", physical, np.ones(2), "closed form, film.bearing.whirl_threshold"),
            *(curve(method, degrees, theory[i], source) for i, method in enumerate(methods)),
        ),
        numerical=tuple(curve(method, degrees, found[i], whole) for i, method in enumerate(methods)),
        max_deviation=deviation(np.array(found), np.array(theory)),
        explanation=_explanation(methods, degrees, np.array(found)),
        failure="whirl seen by backward Euler",
    )


def _explanation(methods: tuple[str, ...], degrees: Array, found: Array) -> str:
    """Return the explanation of the map, with its numbers."""
    at = int(np.argmin(np.abs(degrees - 2.5)))
    errors = [float(np.nanmax(np.abs(row[: at + 1] - 1.0))) for row in found[1:]]
    accurate = ", ".join(f"{m} {100.0 * e:.1g} %" for m, e in zip(methods[1:], errors, strict=True))
    return (
        "A film whirls when its cross stiffness outweighs its damping. The threshold belongs to the film; a method "
        "that damps resolved motion moves it.\n"
        f"Backward Euler at {degrees[at]:g} deg sees whirl set in {100.0 * (found[0, at] - 1.0):.1f} % late in speed, "
        "in proportion to the step: what lies between the curves is a rotor that whirls and a run that does not.\n"
        f"Up to {degrees[at]:g} deg the others are off by at most: {accurate}.\n"
        "Judge whirl with a method of second order or higher, and halve the step once to see that the onset stays."
    )
