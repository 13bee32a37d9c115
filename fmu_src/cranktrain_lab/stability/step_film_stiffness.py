"""Stability map of the longest explicit step in a stiff film, and of the longest implicit step of the running model.

A journal of 10 kg a bearing in the six's film at 2000 rev/min. Near its equilibrium the film is a stiffness K and a
damping C that both grow without end as the gap closes; the largest |λ| of m ü + C u̇ + K u = 0 is some C/m, a motion
that dies within microseconds and that an explicit step must resolve all the same. Theory: spectral radius one of the
methods' matrices on that linear film. Found: the same methods marched in the film as it is, not linear, by
:func:`~cranktrain.film.laws.impedance.journal_force`.

The product's methods are A-stable, so no step is unstable for a film that does not whirl. Their step is limited by
Newton's iteration on the nonlinear film. The journal's load is multiplied by thirty, as in firing, and one step must
move the journal to its new position. The result is the shortest step that the running model rejects and halves. There
is no theory for this limit.
"""

import math

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.film.laws.impedance import MapFilm
from cranktrain_lab.stability.explicit import METHODS, ROWS, FilmedJournal, amplification, march, spectral_radius
from cranktrain_lab.stability.rotor import (
    SPEED,
    LinearFilm,
    default_method,
    default_step,
    film_at,
    film_law,
    film_rotor,
)
from cranktrain_lab.stability.stability_map import Axis, Onset, Progress, StabilityMap, curve, deviation, onset

MASS = 10.0
"""Mass of the journal, kg: a seventh of the six's crank without flywheel, so light that no film whirls."""
LOAD = 1000.0
"""Load (N) of the model from which the bearing's data are read. The journal is placed at each eccentricity
afterwards."""
STEPS, LIMIT = 4000, 100.0
"""Largest number of explicit steps, and factor of growth or decay of the fastest motion at which stepping ends."""
KICK = 1.0e-4
"""Initial velocity of the fastest motion over the surface speed, small enough for a linear film force."""
RADIUS = 1.0 + 1.0e-9
"""Spectral radius above which motion counts as growing (one plus rounding)."""
BLOW = 30.0
"""Factor of the sudden increase of the journal's load."""
LONGEST, LEAST = 90.0, 1.0e-3
"""Longest and shortest step of the running model that are tried, degrees (some films reject 0.1 degrees)."""


BRACKET, LEAST_SHARE = np.array([0.5, 5.0]), 1.0e-3
"""Search range of an explicit method's limit, and least step tried, in units of 1/|λ| of the fastest motion."""


def journal_system(film: LinearFilm, mass: float) -> Array:
    """Return the first-order matrix (4, 4) of a journal in its linear film."""
    return np.block([[np.zeros((2, 2)), np.eye(2)], [-film.stiffness / mass, -film.damping / mass]])


def theoretical_limit(method: str, system: Array) -> Onset:
    """Return the longest stable step of an explicit method by theory, s."""
    shortest = 1.0 / float(np.abs(np.linalg.eigvals(system)).max())

    def fails(h: float) -> bool:
        return spectral_radius(amplification(method, h, system)) > RADIUS

    return onset(fails, shortest * BRACKET, 1e-7, LEAST_SHARE * shortest)


def marched_limit(method: str, film: LinearFilm, mass: float, law: MapFilm) -> Onset:
    """Return the longest step (s) at which an explicit method lets the fastest motion in the nonlinear film decay."""
    system = journal_system(film, mass)
    # Left and right eigenvector (4,) of the fastest motion, which does not oscillate.
    (values, right), (others, left) = np.linalg.eig(system), np.linalg.eig(system.T)
    k = int(np.abs(values).argmax())
    shortest = 1.0 / float(abs(values[k]))
    left, right = left[:, int(np.abs(others - values[k]).argmin())].real, right[:, k].real
    start = np.concatenate((film.place, np.zeros(2)))
    away = KICK * law.clearance * SPEED * right / np.abs(right[2:]).max()
    journal = FilmedJournal(mass, film.load, 0.5 * SPEED, law)
    watched, work = np.stack((left, start)), np.zeros((ROWS, 16))

    def fails(h: float) -> bool:
        y = start + away
        march(METHODS[method], h, STEPS, LIMIT, journal, watched, y, work)
        return not abs(left @ (y - start)) < abs(left @ away)

    return onset(fails, shortest * BRACKET, 1e-5, LEAST_SHARE * shortest)


def product_limit(film: LinearFilm, mass: float, tried: int) -> Onset:
    """Return the shortest step (rad) of the running model that Newton's iteration rejects after the load increase."""
    simulation = film_rotor(mass, film.load)
    simulation.model.scalars[at.GRAVITY] *= BLOW
    start = simulation.state

    def rejected(step: float) -> bool:
        simulation.state = start
        simulation.work.counters[at.N_REJECTED] = 0.0
        simulation.model.scalars[at.STEP] = 1.01 * step
        simulation.step(simulation.time + step / SPEED)
        return bool(simulation.work.counters[at.N_REJECTED] > 0.0)

    return onset(rejected, np.radians(np.geomspace(0.1, LONGEST, tried)), 1e-2, math.radians(LEAST))


def compute(quick: bool, progress: Progress) -> StabilityMap:
    """Compute the stability map over step and film stiffness."""
    count, tried = (8, 21) if quick else (20, 61)
    eccentricities = 1.0 - np.geomspace(0.9, 0.02, count)
    law = film_law(film_rotor(MASS, LOAD).model.bearings[0])
    films = [film_at(float(eps), law) for eps in eccentricities]
    systems = [journal_system(film, MASS) for film in films]
    stiffness = np.array([np.linalg.norm(film.stiffness, 2) for film in films])
    fastest = np.array([np.abs(np.linalg.eigvals(system)).max() for system in systems])
    degrees = np.geomspace(1e-4, LONGEST, 40 if quick else 90)
    to_degrees = math.degrees(SPEED)
    theory, numerical, differences = [], [], []
    for k, method in enumerate(METHODS):
        progress(f"{method} marched in the film", 0.05 * k)
        limits = [theoretical_limit(method, system).scaled(to_degrees) for system in systems]
        marched = [marched_limit(method, film, MASS, law).scaled(to_degrees) for film in films]
        differences.append(deviation(np.array(marched), np.array(limits)))
        theory.append(curve(method, limits, stiffness, "spectral radius 1 of the method on the linear film"))
        numerical.append(curve(method, marched, stiffness, "bisection, marched in the film by its kernel"))
    rejected = []
    for k, film in enumerate(films):
        progress(f"the product's step at eccentricity {eccentricities[k]:.2f}", 0.1 + 0.9 * k / count)
        rejected.append(product_limit(film, MASS, tried).scaled(math.degrees(1.0)))
    source = f"the running model, {default_method()}: first step after the load became thirty times itself"
    numerical.append(curve("the product's step, halved by Newton's iteration", rejected, stiffness, source))
    explicit = theory[0]
    limit = np.interp(np.log(stiffness), np.log(explicit.points[:, 1]), np.log(explicit.points[:, 0]))
    progress("done", 1.0)
    return StabilityMap(
        name="step_film_stiffness",
        title="Step against the stiffness of the oil film, 10 kg a journal at 2000 rev/min",
        rows=Axis("film stiffness", "N/m", stiffness, log=True),
        columns=Axis("step", "deg of crank angle", degrees, log=True),
        stable=np.log(degrees)[None, :] <= limit[:, None],
        measure=np.log10(np.radians(degrees)[None, :] / SPEED * fastest[:, None]),
        measure_label="log10 of step times fastest rate of the film, h |λ|",
        theory=tuple(theory),
        numerical=tuple(numerical),
        max_deviation=max(differences),
        explanation=_explanation(numerical[0].points[:, 0], eccentricities, np.array(rejected)),
        failure="explicit Runge-Kutta (rk4) blows up",
    )


def _explanation(marched: Array, eccentricities: Array, rejected: Array) -> str:
    """Return the explanation of the map, with its numbers."""
    failing = np.isfinite(rejected)
    newton = (
        f"A film at eccentricity {eccentricities[failing][0]:.2f} or above that takes a thirtyfold blow makes the "
        f"product reject steps from {np.min(rejected[failing]):.2g} deg on: it halves them, and goes on."
        if failing.any()
        else f"A thirtyfold blow on the load makes the product reject no step up to {LONGEST:g} deg."
    )
    return (
        f"An explicit step must resolve the fastest motion of the film, |λ| = C/m: {marched[0]:.2g} deg at "
        f"eccentricity {eccentricities[0]:.2g}, {marched[-1]:.1g} deg at {eccentricities[-1]:.2g}.\n"
        "That motion dies within microseconds and matters to nobody; A-stable implicit methods step over it, "
        "and no step bounds them.\n"
        f"What ends an implicit step is Newton's iteration on a film that closes. {newton}\n"
        f"So accuracy chooses the step, not stability. The default, {default_method()} at {default_step():g} deg, "
        "halves none of its steps in fired cycles of a single, a four, a six and a V12 up to their highest speeds "
        "(decision 0018)."
    )
