"""Stability map of the ringing of a contact that a step cannot resolve.

A journal of 10 kg rests in its bore on contact alone (the law of :mod:`cranktrain.film.laws.impedance` below its
contact height, at standstill, with an oil too thin to damp) and takes a small jolt. The contact is too stiff for the
step, so its force from step to step is determined by the method. Generalised-α multiplies this mode by ρ(hω) per step,
which falls from one to ρ∞ as hω grows. With ρ∞ = 1, the trapezoidal rule, the force alternates for ever.

Ringing is the largest contact force, less its mean, in TAIL steps after the first SETTLING, over its largest at all.
Found: the running model on the contact as it is. Theory: the same from powers of the method's matrix at ω = √(k/m),
k = 2 √(W N₀)/h_c the slope of N = N₀ ((h_c − h)/h_c)² under the load W.
"""

import math

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.state import ACCELERATION, MODAL_BLOCKS, STEP_LAST, STEP_REFERENCE
from cranktrain.dynamics.simulation import Simulation
from cranktrain.dynamics.time.integrators import integrator_table
from cranktrain.film.laws.parameters import CLEARANCE, CONTACT_HEIGHT, CONTACT_LOAD, FACTOR
from cranktrain_lab.stability.amplification import constant, step_matrix
from cranktrain_lab.stability.rotor import SPEED, default_method, default_step, film_rotor, modal_places
from cranktrain_lab.stability.stability_map import Axis, Progress, StabilityMap, curve, deviation, onset

MASS, LOAD = 10.0, 2000.0
"""Mass (kg) and load (N) of each bearing."""
SETTLING, TAIL, LEFT = 20, 10, 0.01
"""Number of steps within which ringing must end, number of later steps evaluated, and allowed remaining ringing."""
JOLT = 0.01
"""Initial displacement (jolt) as a fraction of the depth of contact."""
LEAST_RHO = 1.0e-6
"""Least spectral radius at infinity in the search for the largest radius at which ringing ends."""
THIN = 1.0e-9
"""Factor on the viscosity that makes the film negligible."""


class Contact:
    """Journal on its contact in the running model, for a generalised-α table or an integrator by name."""

    def __init__(self, integrator: str = "generalised-alpha") -> None:
        self.simulation = simulation = film_rotor(
            MASS, LOAD, 0.0, integrator=integrator, film_change=1e9, newton_tolerance=1e-11
        )
        model = simulation.model
        law = model.bearings[0]
        model.bearings[:, FACTOR] *= THIN
        model.scalars[at.STEP] = 1e9
        self.depth = float(law[CONTACT_HEIGHT]) * math.sqrt(LOAD / law[CONTACT_LOAD])
        self.omega = math.sqrt(2.0 * math.sqrt(LOAD * law[CONTACT_LOAD]) / law[CONTACT_HEIGHT] / MASS)
        self._blocks = modal_places(simulation, [0, 1], list(range(MODAL_BLOCKS)))
        state = simulation.state
        state[self._blocks] = 0.0
        place = law[CLEARANCE] - law[CONTACT_HEIGHT] + self.depth
        state[self._blocks[0, 1]] = -place * math.sqrt(simulation.body.mass)
        self._start = state

    def forces(self, h: float, count: int, table: Array | None = None) -> Array:
        """Return contact force over load, minus one, after each of ``count`` steps h (s) from the jolt."""
        simulation: Simulation = self.simulation
        if table is not None:
            simulation.model.stages[: len(table)] = table
        simulation.work.key[:] = -1.0
        state = self._start.copy()
        state[self._blocks[0, 1]] += JOLT * self.depth * math.sqrt(simulation.body.mass)
        state[STEP_REFERENCE] = state[STEP_LAST] = -1.0
        simulation.state = state
        begin, found = simulation.time, np.empty(count)
        for k in range(count):
            simulation.step(begin + (k + 1) * h)
            found[k] = simulation.state[self._blocks[ACCELERATION, 1]] * MASS / math.sqrt(simulation.body.mass) / LOAD
        return found


def with_radius(rho: float) -> Array:
    """Return the table of generalised-α with this spectral radius at infinite frequency."""
    return integrator_table(f"generalised-alpha:{rho:.17g}")


def linear_forces(table: Array, omega_h: float, count: int) -> Array:
    """Return linear contact forces, up to a factor, by powers of a method's step matrix, with acceleration as state."""
    matrix = step_matrix(table, 1.0, constant(np.array([[omega_h**2]]), np.zeros((1, 1)))).real
    state, found = np.eye(matrix.shape[0])[0], np.empty(count)
    for k in range(count):
        state = matrix @ state
        found[k] = state[ACCELERATION]
    return found


def ringing(forces: Array) -> float:
    """Return the remaining ringing after SETTLING steps, relative to its largest value."""
    return float(np.abs(forces[SETTLING:]).max() / np.abs(forces).max())


def compute(quick: bool, progress: Progress) -> StabilityMap:
    """Compute the map over the step and the spectral radius at infinity ρ∞."""
    degrees = np.geomspace(0.05, 10.0, 13 if quick else 33)
    rhos = np.linspace(0.0, 1.0, 21 if quick else 51)
    steps, count = np.radians(degrees) / SPEED, SETTLING + TAIL
    contact = Contact()
    rings = np.empty((rhos.size, degrees.size))
    theory, found = [], []
    places = np.array([LEAST_RHO, 1.0])
    for j, h in enumerate(steps):
        progress(f"steps of {degrees[j]:.2g} deg", j / degrees.size)
        rings[:, j] = [ringing(contact.forces(h, count, with_radius(rho))) for rho in rhos]

        def linear(rho: float, h: float = h) -> bool:
            return ringing(linear_forces(with_radius(rho), contact.omega * h, count)) > LEFT

        def running(rho: float, h: float = h) -> bool:
            return ringing(contact.forces(h, count, with_radius(rho))) > LEFT

        theory.append(onset(linear, places, 1e-5, LEAST_RHO))
        found.append(onset(running, places, 1e-4, LEAST_RHO))
    default = Contact("auto").forces(math.radians(default_step()) / SPEED, count)
    progress("done", 1.0)
    return StabilityMap(
        name="contact_ringing",
        title=f"Ringing of a contact after {SETTLING} steps, {MASS:g} kg on {contact.omega**2 * MASS:.2g} N/m",
        rows=Axis("spectral radius at infinity of generalised-alpha", "", rhos),
        columns=Axis("step", "deg of crank angle at 2000 rev/min", degrees, log=True),
        stable=rings <= LEFT,
        measure=np.log10(np.maximum(rings, 1e-12)),
        measure_label="log10 of the ringing left",
        theory=(curve("1 % left", degrees, theory, "powers of the method's matrix at the contact's frequency"),),
        numerical=(curve("1 % left", degrees, found, "the running model on its contact"),),
        max_deviation=deviation(np.array(found), np.array(theory)),
        explanation=_explanation(degrees, contact, np.array(found), ringing(default)),
        failure=f"rings beyond {SETTLING} steps",
    )


def _explanation(degrees: Array, contact: Contact, found: Array, default: float) -> str:
    """Return the explanation of the map, with its numbers."""
    resolved = math.degrees(SPEED / contact.omega)
    return (
        f"Left of {resolved:.2g} deg (hω = 1) steps resolve the contact, and it rings as an undamped contact does; "
        "right of that, what rings is the method.\n"
        "There the mode alternates and shrinks by ρ(hω) a step, down to ρ∞: the trapezoidal rule (ρ∞ = 1) never lets "
        "it go, and its contact forces are noise.\n"
        f"From 2.5 deg on it is over in {SETTLING} steps for ρ∞ below {found[degrees >= 2.5].min():.2f}; the "
        f"default, {default_method()} at {default_step():g} deg, leaves {default:.1g} of it.\n"
        "For bearings that touch, take an L-stable method, or generalised-α with ρ∞ of 0.6 or less."
    )
