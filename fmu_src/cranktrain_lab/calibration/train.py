"""Matrices of cranktrain and block that are fast to rebuild: some milliseconds for the modes of an engine.

Bare crankshaft and block are truncated once at frequencies well above the targets, with exact statics at all attached
parts (:func:`cranktrain.core.reduced_body.truncate`). Flywheel, pulley, clutch, balance weights, rods, heads,
mounts and bearings then follow the engine's values. Definitions are those of :mod:`cranktrain.structure.crank.modal`
and :mod:`cranktrain.structure.block.modal`, from which frequencies differ by less than 1e-3 below 700 Hz.

Changes of bodies with their dimensions, from the difference of two finite-element geometries at the interfaces.

A free dimension needs one more mesh, at the bound farther from the engine's value. Both meshes are condensed
on their interfaces, K = Ψᵀ K Ψ and M = Ψᵀ M Ψ with the constraint modes Ψ (Guyan 1965), and their difference per unit
of the dimension acts at the interfaces of the engine's own reduced body:

    K(p) = diag(ω²) + Φᵀ (p − p₀) ΔK Φ,      M(p) = I + Φᵀ (p − p₀) ΔM Φ

If the dimension moves an interface, both matrices are referred to the motion at the old position by a rigid link.
Otherwise rigid motion would strain the difference. This gives frequency changes to first order, except that
fixed-interface modes keep their frequencies and attached parts their positions. The result of a search is meshed and
fitted again, so it contains no error of the linearisation.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, eigh

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array, ReducedBody, truncate
from cranktrain.core.rigid_slices import skew
from cranktrain.core.threads import one_thread
from cranktrain.core.types import Progress
from cranktrain.dynamics.linear import Equations
from cranktrain.engine.model import Engine
from cranktrain.store.kept import Kept
from cranktrain.structure.block import reduction as of_block
from cranktrain.structure.block.modal import RIGID_HZ
from cranktrain.structure.block.reduction import heads
from cranktrain.structure.crank import modal
from cranktrain.structure.crank import reduction as of_crank
from cranktrain.structure.crank.modal import at_largest
from cranktrain.structure.crank.reduction import attached_parts, running_loads
from cranktrain.structure.fem.craig_bampton import condensed
from cranktrain.structure.in_motion.eigenproblem import slowest_hz, vibrations
from cranktrain.structure.in_motion.residues import unit_torques

CRANK, BLOCK = "crankshaft", "block"


class Change(NamedTuple):
    """Change of a body's stiffness and mass per unit of a dimension, at the m interfaces of the body, (6 m, 6 m)."""

    body: str
    stiffness: Array
    mass: Array


def digests(engine: Engine, flexible: bool) -> dict[str, str]:
    """Return a digest of the data that determine each body's finite elements."""
    found = {CRANK: of_crank.input_digest(engine)}
    return found | ({BLOCK: of_block.input_digest(engine)} if flexible else {})


def changes(engine: Engine, other: Engine, step: float, flexible: bool, say: Progress) -> list[Change]:
    """Return changes of the bodies per unit of a dimension that is ``step`` larger in ``other``; may be empty."""
    before, after = digests(engine, flexible), digests(other, flexible)
    found = []
    for body in before:
        if before[body] != after[body]:
            (k0, m0, at), (k1, m1, there) = (_condensed(body, e, say) for e in (engine, other))
            if k0.shape != k1.shape:
                raise InputError(f"the dimension changes the interfaces of the {body}; leave it out of [parameters]")
            carried = np.eye(k0.shape[0])
            for i, shift in enumerate(there - at):
                carried[6 * i : 6 * i + 3, 6 * i + 3 : 6 * i + 6] = -skew(shift)
            found.append(Change(body, (carried.T @ k1 @ carried - k0) / step, (carried.T @ m1 @ carried - m0) / step))
    return found


def _condensed(body: str, engine: Engine, say: Progress) -> tuple[Array, Array, Array]:
    """Return stiffness and mass of the meshed body at its interfaces, and their positions; cached for the user."""
    kept = Kept("calibration")
    key = f"{body}-with-places-{digests(engine, body == BLOCK)[body]}"
    found: Mapping[str, Array] | None = kept.arrays(key)
    if found is None:
        task = (of_block if body == BLOCK else of_crank).reduction_task(engine)
        model = task.model(lambda stage: say(f"{body}: {stage}"))
        say(f"{body}: condensing on its interfaces")
        with one_thread():
            interfaces = task.interfaces(model)
            stiffness, mass = condensed(model, interfaces)
        found = {"stiffness": np.asarray(stiffness), "mass": np.asarray(mass), "places": interfaces.positions}
        kept.keep_arrays(key, found)
    return found["stiffness"], found["mass"], found["places"]


CRANK_CUTOFF_HZ, BLOCK_CUTOFF_HZ = 3000.0, 1100.0
MODES = 32
"""Number of computed modes of the cranktrain. The free crankshaft has half as many."""


class Modes(NamedTuple):
    """Frequencies (Hz) of k modes, mode shapes of unit modal mass (n, k), and energy fractions of kinds and block."""

    hz: Array
    modes: Array
    shares: Array


class Matrices(NamedTuple):
    """Stiffness and mass matrix of a system, and damping matrix if the system has damping."""

    stiffness: Array
    mass: Array
    damping: Array | None = None


class FilmMeans(NamedTuple):
    """Linearised films and thrust collar of a run, for small motions in axes of the rotating crank.

    Attributes
    ----------
    stiffness, damping : (b, 2, 2) of each main, N/m and N s/m
    collar : axial stiffness (N/m) and damping (N s/m)
    hz : first torsional frequency of the complete eigenproblem, to which the frequency of the train is scaled
    """

    stiffness: Array
    damping: Array
    collar: tuple[float, float]
    hz: float


class Train:
    """Cranktrain of bodies without attached parts, on ground if there is no ``block``.

    Parameters
    ----------
    engine : engine that defines the parts at the interfaces; its values may change later
    crank, block : bare reduced bodies
    changes : changes of the bodies per unit of each dimension
    films : linearised films of a run, for modes in motion
    """

    def __init__(
        self,
        engine: Engine,
        crank: ReducedBody,
        block: ReducedBody | None,
        changes: Mapping[str, Sequence[Change]],
        films: FilmMeans | None = None,
    ) -> None:
        ends = [(name, component) for name in ("pulley", "flywheel") for component in range(6)]
        self.crank = truncate(crank, CRANK_CUTOFF_HZ, running_loads(engine) + ends)
        self.block: ReducedBody | None = None
        if block is not None:
            loaded = [name for name in block.interfaces if name.startswith(("bore", "head", "thrust"))]
            self.block = truncate(block, BLOCK_CUTOFF_HZ, [(name, k) for name in loaded for k in range(6)])
        bodies = {CRANK: (self.crank, CRANK_CUTOFF_HZ), BLOCK: (self.block, BLOCK_CUTOFF_HZ)}
        self._changes = {
            key: [(change.body, *_at_modes(change, *bodies[change.body])) for change in entries]
            for key, entries in changes.items()
        }
        self.films, self._scale = films, 1.0
        if films is not None:
            self._scale = films.hz / self._first_in_motion(engine, self.in_motion(engine, {}))

    def crankshaft(self, engine: Engine, dimensions: Mapping[str, float]) -> Matrices:
        """Return matrices of the free crankshaft with attached parts; ``dimensions`` are changes of the bodies."""
        found = self._bare(self.crank, CRANK, dimensions)
        for name, part in attached_parts(engine):
            inertia = np.diag([part.diametral_inertia, part.diametral_inertia, part.polar_inertia])
            _attach(found.mass, self.crank, name, part.mass, inertia, (0.0, 0.0, part.offset))
        if (w := engine.balance_weights) is not None:
            for main, mass, r, angle, z in zip(w.mains, w.masses, w.radii, w.angles, w.offsets, strict=True):
                at = (-r * np.sin(angle), r * np.cos(angle), z)
                _attach(found.mass, self.crank, f"main[{main}]", mass, np.zeros((3, 3)), at)
        return found

    def cranktrain(self, engine: Engine, dimensions: Mapping[str, float]) -> Matrices:
        """Return matrices of the crankshaft with rods in its bearings, on ground or in its block on mounts."""
        free = self.crankshaft(engine, dimensions)
        free.mass[:] += modal.rod_masses(engine, self.crank)
        if self.block is None:
            return Matrices(free.stiffness + modal.bearing_stiffness(engine, self.crank), free.mass)
        block = self._bare(self.block, BLOCK, dimensions)
        for name, mass, inertia, offset in heads(engine):
            _attach(block.mass, self.block, name, mass, inertia, offset)
        stiffness = block_diag(free.stiffness, block.stiffness)
        springs = modal.bearing_stiffness(engine, self.crank, self.block)
        return Matrices(stiffness + springs, block_diag(free.mass, block.mass))

    def in_motion(self, engine: Engine, dimensions: Mapping[str, float]) -> Matrices:
        """Return matrices of the crankshaft with rods on the mean stiffness and damping of the films."""
        assert self.films is not None
        free, crank = self.crankshaft(engine, dimensions), self.crank
        free.mass[:] += modal.rod_masses(engine, crank)
        damping = np.zeros_like(free.mass)
        laws = zip(self.films.stiffness, self.films.damping, strict=True)
        for i, (stiffness, damper) in enumerate(laws, 1):
            rows = crank.shapes[crank.index(f"main[{i}]"), :2]
            free.stiffness[:] += rows.T @ stiffness @ rows
            damping += rows.T @ damper @ rows
        row = crank.shapes[crank.index("thrust"), 2]
        free.stiffness[:] += self.films.collar[0] * np.outer(row, row)
        return Matrices(free.stiffness, free.mass, damping + self.films.collar[1] * np.outer(row, row))

    def motion_modes(self, engine: Engine, of: Matrices) -> Modes:
        """Return the first torsional mode in motion, with its frequency corrected to the complete eigenproblem."""
        hz = self._scale * self._first_in_motion(engine, of)
        return Modes(np.array([hz]), np.zeros((len(of.mass), 1)), np.array([[0.0, 1.0, 0.0, 0.0]]))

    def _first_in_motion(self, engine: Engine, of: Matrices) -> float:
        """Return the first torsional frequency of the train in motion, Hz."""
        assert of.damping is not None
        rest = self.cranktrain_modes(engine, of)
        at_rest = modal.torsional_frequencies(rest.hz, rest.shares)[0]
        equations = Equations(of.mass, of.damping, of.stiffness)
        values, shapes, taken = vibrations(equations, slowest_hz(at_rest), unit_torques(engine, self.crank))
        pulley = self.crank.shapes[self.crank.index("pulley"), 5] @ shapes
        answers = np.abs(pulley) * np.linalg.norm(taken, axis=1) / -values.real
        hz, shares = values.imag / (2.0 * np.pi), modal.energy_shares(engine, self.crank, at_largest(shapes), rods=True)
        return modal.first_torsional(hz, shares, answers=answers)

    def crankshaft_modes(self, engine: Engine, of: Matrices) -> Modes:
        """Return elastic modes of the free crankshaft."""
        squares, modes = eigh(*of[:2], subset_by_index=[0, min(MODES // 2 + 5, len(of.mass) - 1)])
        modes = modes[:, 6:]
        shares = modal.energy_shares(engine, self.crank, modes, rods=False)
        return Modes(_hz(squares[6:]), modes, np.column_stack((shares, np.zeros(len(shares)))))

    def cranktrain_modes(self, engine: Engine, of: Matrices) -> Modes:
        """Return modes of the cranktrain with free rotation, without modes of the whole engine on its mounts."""
        squares, modes = eigh(*of[:2], subset_by_index=[1, min(MODES, len(of.mass) - 1)])
        crank = modes[: self.crank.n_modes]
        mass = of.mass[: self.crank.n_modes, : self.crank.n_modes]
        part = np.einsum("ik,ij,jk->k", crank, mass, crank)
        shares = part[:, None] * modal.energy_shares(engine, self.crank, crank, rods=True)
        hz = _hz(squares)
        elastic = hz > (RIGID_HZ if self.block is not None else 1.0)
        return Modes(hz[elastic], modes[:, elastic], np.column_stack((shares, 1.0 - part))[elastic])

    def _bare(self, body: ReducedBody, name: str, dimensions: Mapping[str, float]) -> Matrices:
        stiffness, mass = np.diag(body.omega**2), np.eye(body.n_modes)
        for key, difference in dimensions.items():
            for of, more_stiffness, more_mass in self._changes[key]:
                if of == name:
                    stiffness += difference * more_stiffness
                    mass += difference * more_mass
        return Matrices(stiffness, mass)


def _at_modes(change: Change, body: ReducedBody | None, cutoff_hz: float) -> tuple[Array, Array]:
    """Return stiffness and mass of a change in a body's modes; static modes above the cut-off gain no mass."""
    assert body is not None
    rows = body.shapes.reshape(-1, body.n_modes)
    moving = rows * (body.frequencies_hz <= cutoff_hz)
    return rows.T @ change.stiffness @ rows, moving.T @ change.mass @ moving


def _attach(
    matrix: Array, body: ReducedBody, name: str, mass: float, inertia: Array, offset: Array | Sequence[float]
) -> None:
    """Add a rigid part at an interface to a mass matrix; ``inertia`` (3, 3) about its centre of mass."""
    rows = body.shapes[body.index(name)]
    centre = rows[:3] - skew(np.asarray(offset)) @ rows[3:]
    matrix += mass * centre.T @ centre + rows[3:].T @ inertia @ rows[3:]


def _hz(squares: Array) -> Array:
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi))
