"""Modes in motion: the damped eigenproblem of a crank with the cycle means of its force laws.

In the frame that turns with the crank at Ω, with the rotating bodies in modes q and the ports' relative motion d,

    M q̈ + (D + 2ΩG + Σ c_s t tᵀ) q̇ + [ω² + Ω² (K_σ − C) + Σ k_s t tᵀ] q = Σ Dᵀ (K̄ d + C̄ ḋ) + rods

where K̄ and C̄ are the cycle means of the derivatives of all films, of the running thrust bearing, of floating big
ends, of the axial joint of the drive line and of the damper (:mod:`cranktrain.structure.in_motion.cycle_means`), and t
the twists of the drive line's shafts with their stiffness k_s and damping c_s. The rods enter by their mean tangents
in uniform rotation of the rigid crank (:mod:`cranktrain.dynamics.tangents`). Solutions are q = Re x exp(λt).

A flexible block is stationary. In a mode of the crank it moves with the exponents λ, λ + iΩ and λ − iΩ,

    w = Re [(w₀ + w₊ exp(iΩt) + w₋ exp(−iΩt)) exp(λt)],
    d = u − ½ (I − iJ) w₊ − ½ (I + iJ) w₋ across the axis,  u − w₀ along it,  J = e_z ×,

and the equation of the block on its mounts holds for each of the three parts with its exponent. Two effects are left
out: further harmonics, which a block with direction-dependent stiffness would have, and the variation of the force laws
about their means over the cycle.

The first torsional mode is found by the response of the pulley (:mod:`cranktrain.structure.in_motion.residues`). Films
lock the journals of a short crank, and torsion then couples with bending in two or three modes. The mode with the
largest energy fraction of torsion may be so strongly damped that no order of a run peaks at its frequency. Energy
fractions therefore only select candidates, and the first torsional mode is the candidate with the largest ratio of
residue to damping under unit torques of the cylinders.

If all laws are linear and isotropic the method is exact. On films and rollers the large peaks of a run lie within 0.7 %
of the modes that contribute most to them, those of the shipped six within 0.5 %
(tests/properties/test_peak_modes.py, tests/literature/test_critical_speeds.py). The error is larger
for bearings of level ``linear`` with different springs across and upwards: in the turning frame their stiffness varies
with 2Ω about its mean without damping, and torsion comes out up to 1.1 % above the run.

Sources: Friswell, Penny, Garvey & Lees, *Dynamics of Rotating Machines* (2010), chapter 7; Hill's method: Wereley,
*Analysis and control of linear periodically time varying systems* (1991).
"""

import math
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig

from cranktrain.core.reduced_body import Array
from cranktrain.core.types import ComplexArray
from cranktrain.dynamics.linear import Equations, SmallMotions
from cranktrain.dynamics.model import slots
from cranktrain.dynamics.model.records import dimensions
from cranktrain.dynamics.simulation import Simulation, fitted_engine
from cranktrain.dynamics.tangents import Tangents, tangents_in_rotation
from cranktrain.engine.model import Engine
from cranktrain.loads.torsional_line import STIFFNESS
from cranktrain.structure.crank.modal import (
    KINDS,
    at_largest,
    cranktrain_modes,
    energy_shares,
    named_mode,
    rod_masses,
    torsional_frequencies,
)
from cranktrain.structure.in_motion.cycle_means import (
    CycleMeans,
    CycleTangents,
    films,
    plain_means,
    tangents_over_cycle,
    with_film_means,
    with_joint_mean,
)
from cranktrain.structure.in_motion.residues import order_forces, participations, unit_torques

SLOWEST_HZ, SLOWEST_SHARE = 60.0, 0.25
"""Lower bound of modes in motion: SLOWEST_HZ, or SLOWEST_SHARE of the first torsional frequency at rest if lower. Below
are the rotation on the connecting shaft and rigid motions of crank and block."""
OVERDAMPED = 0.5
"""Damping ratio from which a mode does not count as a vibration."""
FIRST_HZ, SETTLED, ROUNDS = 250.0, 1.0e-4, 10
"""Iteration for the means of films: first frequency, Hz, relative tolerance of the frequency, largest number of
rounds."""
SIDES = 4
"""Largest k of the side frequencies ω ± kΩ/2 that are included in the compliance of crank and block."""
MOSTLY_SHAFT = 0.5
"""A mode belongs to the drive line if its shafts hold at least this fraction of the mode's elastic energy."""
PARTS = (*KINDS, "block", "added")
PULLEY = 1
"""Row of ``ModelArrays.ends`` for the pulley's rotation."""


class Rods(NamedTuple):
    """Rods of the crank linearised about rotation: rows of the connections, mean tangents, and loads on the crank.

    The columns of ``loads`` (n_t, c + o) are the gas torques of 1 N m, then the forces of each order, see
    :mod:`cranktrain.structure.in_motion.residues`.
    """

    connections: NDArray[np.int64]
    tangents: Tangents
    loads: ComplexArray


class ModesInMotion(NamedTuple):
    """Modes in motion in order of rising frequency.

    Attributes
    ----------
    speed : rad/s
    values : (k,) eigenvalues λ, 1/s
    shapes : (n, k) in the coordinates of :class:`Equations`
    shares : (k, 4) fractions of bending, torsion, axial motion and block in the kinetic energy; (k, 5) with added
        bodies, whose motion in bands other than 0 counts as the block's
    in_shafts : (k,) elastic energy of the drive line's shafts over the largest kinetic energy
    by_torque : (k, c) residues of the pulley's rotation for a unit gas torque of each cylinder, rad/(N m s)
    by_order : (k, o) residues for the rods' forces of orders 0.5, 1, …, rad/s, with phases relative to the crank angle
    highest_hz : highest frequency of a mode with a name, Hz
    """

    speed: float
    values: ComplexArray
    shapes: ComplexArray
    shares: Array
    in_shafts: Array
    by_torque: ComplexArray
    by_order: ComplexArray
    highest_hz: float

    @property
    def hz(self) -> Array:
        """Frequencies |Im λ|/2π of the damped vibration, (k,) Hz."""
        return np.asarray(self.values.imag / (2.0 * math.pi))

    @property
    def damping_ratios(self) -> Array:
        """Damping ratios −Re λ/|λ|, (k,)."""
        return np.asarray(-self.values.real / np.abs(self.values))

    @property
    def answers(self) -> Array:
        """Rotation (k,) of the pulley at each mode's own frequency under a unit gas torque of each cylinder, rad/(N m).

        The result is the root of the sum of squares over the cylinders.
        """
        return np.asarray(np.linalg.norm(self.by_torque, axis=1) / -self.values.real)

    @property
    def orders(self) -> Array:
        """Orders (o,) of ``by_order``."""
        return np.asarray(0.5 * np.arange(1, self.by_order.shape[1] + 1))

    @property
    def of_crank(self) -> NDArray[np.bool_]:
        """True for modes (k,) of the crank, whose elastic energy is not mostly in the shafts of the drive line."""
        return np.asarray(self.in_shafts < MOSTLY_SHAFT)

    def at_resonance(self, lowest: float, highest: float) -> Array:
        """Torsion of the pulley (k, o), zero to peak in rad, by each order at its resonance with each mode.

        Zero if the resonance speed is not between ``lowest`` and ``highest``, rad/s.
        """
        speeds = self.values.imag[:, None] / self.orders
        sizes = np.abs(self.by_order) / -self.values.real[:, None]
        return np.asarray(np.where((speeds >= lowest) & (speeds <= highest), sizes, 0.0))

    def strongest(self, order: float, hz: float) -> int:
        """Index of the mode that contributes most to an order of the pulley's torsion at ``hz``, or −1."""
        k = round(2.0 * order) - 1
        if not (self.values.size and 0 <= k < self.by_order.shape[1]):
            return -1
        return int(np.argmax(np.abs(self.by_order[:, k] / (2.0j * math.pi * hz - self.values))))

    def named(self, number: int) -> int:
        """Index of the first (``number`` 1), second, … torsional mode, −1 if there is none.

        Energy fractions select the candidates, as in :mod:`cranktrain.structure.crank.modal`. The candidate with the
        largest of ``answers`` gets the name. Modes of the drive line do not count.
        """
        return self._chosen(number, self.answers)

    def twisting(self, number: int) -> int:
        """Index of the candidate for the first, second, … torsional mode with the largest energy fraction; −1 if none.

        It corresponds to the mode of a crank of level ``torsional``.
        """
        return self._chosen(number, None)

    def _chosen(self, number: int, answers: Array | None) -> int:
        """Index of a mode by :func:`cranktrain.structure.crank.modal.named_mode`; −1 if there is none."""
        of_crank = self.shares * self.of_crank[:, None]
        found = named_mode(self.hz, of_crank, "torsional", number, self.highest_hz, answers)
        return -1 if found is None else found

    @property
    def torsional(self) -> int:
        """Index of the first torsional mode; −1 if there is none."""
        return self.named(1)

    @property
    def torsional_hz(self) -> float:
        """Frequency of the first torsional mode, Hz; not a number where there is none."""
        return float(self.hz[self.torsional]) if self.torsional >= 0 else math.nan


_MOTIONS: WeakKeyDictionary[Simulation, SmallMotions] = WeakKeyDictionary()
_RODS: WeakKeyDictionary[Simulation, tuple[float, Rods]] = WeakKeyDictionary()
"""Linearised rods at the last speed of each simulation; they do not depend on the iterated means of the films."""


def modes_in_motion(simulation: Simulation) -> ModesInMotion:
    """Modes about the settled cycle that begins at a simulation's state; the state is not changed.

    Films have the means at the first torsional frequency, found by iteration. Raises ``SolverError`` for a step that
    fails, or a law without tangents.
    """
    return modes_in_means(simulation, settled_means(simulation)[0])


def settled_means(simulation: Simulation) -> tuple[CycleMeans, float]:
    """Cycle means of the force laws for vibration at the first torsional frequency, and this frequency, Hz."""
    found = tangents_over_cycle(simulation)
    means = with_joint_mean(simulation, found, plain_means(found, FIRST_HZ), FIRST_HZ)
    hz = modes_in_means(simulation, means).torsional_hz
    for _ in range(ROUNDS):
        before = hz
        means = consistent_means(simulation, found, means, before if math.isfinite(before) else FIRST_HZ)
        hz = modes_in_means(simulation, means).torsional_hz
        if abs(hz - before) <= SETTLED * before:
            break
    return means, hz


def consistent_means(simulation: Simulation, tangents: CycleTangents, means: CycleMeans, hz: float) -> CycleMeans:
    """Means at ``hz`` with each film in series with crank and block, in which all other films are as in ``means``."""
    model, equations = simulation.model, equations_in_motion(simulation, means)
    omega, found = 2.0 * math.pi * hz, films(model)
    if not found:
        return with_joint_mean(simulation, tangents, means, hz)
    felt = [np.zeros((len(parts), len(parts)), dtype=complex) for _, parts in found]
    motions = small_motions(simulation)
    motion = motions.components()
    for side in (*range(-SIDES, 0), *range(1, SIDES + 1)):
        s = 1j * (omega + 0.5 * side * means.speed)
        dynamic = s**2 * equations.mass + s * equations.damping + equations.stiffness
        compliance = motion @ np.linalg.solve(dynamic, motion.conj().T)
        for (k, parts), sum_of_sides in zip(found, felt, strict=True):
            size, numbers = len(parts), motions.numbers(k)
            apart = np.eye(numbers.size)[:size]
            if size < numbers.size:  # relative motion of a pin and its floating big end
                apart = np.hstack((np.eye(size), -np.eye(size)))
            own = apart @ compliance[np.ix_(numbers, numbers)] @ apart.T
            law = -means.laws.place[k, :size, :size] - s * means.laws.velocity[k, :size, :size]
            # Compliance of crank and block at this film's ports without the film itself, (G⁻¹ − Z̄)⁻¹.
            sum_of_sides += np.linalg.solve(np.eye(size) - own @ law, own) / (2.0 * SIDES)
    return with_joint_mean(simulation, tangents, with_film_means(model, tangents, means, felt, hz), hz)


def modes_in_means(simulation: Simulation, means: CycleMeans) -> ModesInMotion:
    """Modes of a running model with given means of its force laws."""
    equations = equations_in_motion(simulation, means)
    engine = fitted_engine(simulation.engine, simulation.settings)
    highest = engine.reduction.running_cutoff_hz
    at_rest = torsional_frequencies(*cranktrain_modes(engine, simulation.body), highest)[0]
    on_rods = rods_in_motion(simulation, means.speed).loads
    loads, turning = np.zeros((len(equations.mass), on_rods.shape[1]), dtype=complex), len(on_rods)
    loads[:turning] = on_rods
    values, shapes, taken = vibrations(equations, slowest_hz(at_rest), loads)
    residues = (simulation.model.ends[PULLEY] @ shapes[:turning])[:, None] * taken
    count = engine.n_cylinders
    shares = _shares(simulation, engine, shapes)
    # Ratio (k,) of the elastic energy of the drive line's shafts in each mode to the mode's largest kinetic energy.
    kinetic = np.abs(values) ** 2 * np.einsum("ik,ij,jk->k", shapes.conj(), equations.mass, shapes).real
    elastic = np.zeros(values.size)
    for twist, law in zip(simulation.model.shafts, simulation.model.shaft_laws, strict=True):
        elastic += law[STIFFNESS] * np.abs(twist @ shapes[: twist.size]) ** 2
    in_shafts = elastic / kinetic
    return ModesInMotion(
        means.speed, values, shapes, shares, in_shafts, residues[:, :count], residues[:, count:], highest
    )


def slowest_hz(torsional_hz: float | None) -> float:
    """Lowest frequency of a mode in motion, Hz, for a crank with this first torsional frequency at rest."""
    return SLOWEST_HZ if torsional_hz is None else min(SLOWEST_HZ, SLOWEST_SHARE * torsional_hz)


def equations_in_motion(simulation: Simulation, means: CycleMeans) -> Equations:
    """Equations of small motions of a running model with the ``means`` of its force laws; coordinates of SmallMotions.

    The first coordinates are those of all bodies that turn with the crank, of which the crank's own come first.
    """
    laws, rods = Tangents(*(part.copy() for part in means.laws)), rods_in_motion(simulation, means.speed)
    for part, own in zip(laws[:3], rods.tangents, strict=False):
        part[rods.connections] = own[rods.connections]
    for row in simulation.model.connections[rods.connections]:
        ports = row[slots.FIRST : slots.FIRST + row[slots.COUPLED]]
        laws.forces[ports], laws.displaced[ports] = rods.tangents.forces[ports], 0.0
    return small_motions(simulation).equations(means.speed, laws)


def small_motions(simulation: Simulation) -> SmallMotions:
    """Coordinates of small motions of a running model, made once."""
    if simulation not in _MOTIONS:
        _MOTIONS[simulation] = SmallMotions(simulation.model)
    return _MOTIONS[simulation]


def vibrations(
    equations: Equations, slowest: float, loads: NDArray[Any]
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Oscillatory eigenvalues (k,) above ``slowest`` Hz in order of rising frequency, and their shapes (n, k).

    The third array (k, l) has the modes' participations in ``loads`` (n, l), see
    :func:`cranktrain.structure.in_motion.residues.participations`.
    """
    values, left, right = eig(equations.first_order, left=True)
    kept = np.flatnonzero((values.imag > 2.0 * math.pi * slowest) & (-values.real < OVERDAMPED * np.abs(values)))
    kept = kept[np.argsort(values[kept].imag)]
    left, right = left[:, kept], right[:, kept]
    return values[kept], right[: len(equations.mass)], participations(equations.mass, left, right, loads)


def rods_in_motion(simulation: Simulation, speed: float) -> Rods:
    """Linearised rods of a running model at a speed, rad/s, cached for the last speed."""
    known = _RODS.get(simulation)
    if known is None or known[0] != speed:
        known = _RODS[simulation] = speed, _rods(simulation, speed)
    return known[1]


def _rods(simulation: Simulation, speed: float) -> Rods:
    """Linearise the force laws of the rods about uniform rotation at a speed, rad/s."""
    model, motions = simulation.model, small_motions(simulation)
    connections, t = model.cylinders[:, slots.END_ROW].astype(np.int64), model.ports.shape[1]
    found = tangents_in_rotation(model, speed, connections)
    torques = np.zeros((t, len(connections)))
    torques[: simulation.body.n_modes] = unit_torques(simulation.engine, simulation.body)
    ports = [port for row in model.connections[connections] for port in row[slots.FIRST :][: row[slots.COUPLED]]]
    rows = motions.components()[np.concatenate([motions.numbers(k) for k in connections.tolist()]), :t]
    loads = np.hstack((torques, rows.T @ order_forces(found.forces[:, ports])))
    return Rods(connections, found.mean(), loads.astype(np.complex128))


def _shares(simulation: Simulation, engine: Engine, shapes: ComplexArray) -> Array:
    """Fractions (k, 4) of bending, torsion, axial motion and block in the kinetic energy; with added bodies (k, 5)."""
    body, size, motions = simulation.body, dimensions(simulation.model), small_motions(simulation)
    crank = at_largest(shapes[: size.crank_modes])
    kinds = energy_shares(engine, body, crank, rods=True)
    mass = np.eye(size.crank_modes) + rod_masses(engine, body)
    own = shapes[: size.crank_modes]
    in_crank = np.einsum("ik,ij,jk->k", own.conj(), mass, own).real
    rest = np.sum(np.abs(shapes[size.turning_modes :]) ** 2, axis=0)
    parts = [(in_crank / (in_crank + rest))[:, None] * kinds]
    added = (motions.mode >= size.modes - motions.added) & (motions.band == 0.0)
    in_added = np.sum(np.abs(shapes[added]) ** 2, axis=0)
    parts += [(part / (in_crank + rest))[:, None] for part in (rest - in_added, in_added)[: 1 + np.any(added)]]
    return np.hstack(parts)
