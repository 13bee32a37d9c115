"""Surface stress of the crankshaft over a cycle, by superposition of its stress modes.

σ(t) = Σ σ_j q_j(t) + Ω² σ_c with the modal coordinates q of the running model and the static correction σ_c of the
centrifugal load, see :mod:`cranktrain.structure.stress.stress_modes`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.threads import one_thread
from cranktrain.core.types import Array
from cranktrain.results.strength.cut_loads import bare_instants, wrenches
from cranktrain.results.strength.recorded_cycle import RecordedCycle
from cranktrain.store.hdf5 import write_result
from cranktrain.structure.crank.reduction import complete_crankshaft
from cranktrain.structure.stress.direct_solution import direct_solution
from cranktrain.structure.stress.features import surface_features
from cranktrain.structure.stress.nodal_stress import von_mises
from cranktrain.structure.stress.stress_modes import ShapedCrank, StressModes

Tensors = NDArray[np.float32]

BATCH = 8
"""Number of instants whose stresses are superposed at once; so few fit into the processor's cache."""
CHECKED = 8
"""Number of equally spaced instants of a cycle that are solved directly for the check."""


class HotSpot(NamedTuple):
    """Point of the greatest von Mises stress of a feature over the cycle (SI; angle rad)."""

    feature: str
    node: int
    place: Array
    stress: float
    angle: float


@dataclass(frozen=True, eq=False)
class CrankStress:
    """Stresses of a crankshaft over a cycle.

    Attributes
    ----------
    cycle : recorded cycle with k samples, sorted by crank angle
    modes : (r + 1, 6, s) float32 stress in the running model's modes and for Ω² = 1
    surface : positions and triangles of the s nodes
    features : names of features of the surface, and index (s,) of each node's feature
    """

    cycle: RecordedCycle
    modes: Tensors
    surface: StressModes
    features: tuple[tuple[str, ...], NDArray[np.intp]]

    @classmethod
    def of(cls, bare: ReducedBody, surface: StressModes, cycle: RecordedCycle) -> "CrankStress":
        """Make the stresses over the last recorded cycle; ``bare`` is the bare crankshaft in all modes."""
        with one_thread():
            modes = surface.of_running(complete_crankshaft(cycle.engine, bare), cycle.body)
        return cls(cycle.last(), modes, surface, surface_features(cycle.engine.crankshaft, surface.points))

    @cached_property
    def angle(self) -> Array:
        """Crank angle (k,), rad, increasing from 0 to less than 4π."""
        return self.cycle.crank_angle

    @cached_property
    def coordinates(self) -> Tensors:
        """Factors of the stress modes at k samples: modal coordinates and Ω² as columns (k, r + 1)."""
        return np.column_stack((self.cycle.position, self.cycle.speed**2)).astype(np.float32)

    def tensors(self, samples: slice | NDArray[np.intp]) -> Tensors:
        """Stress (k, 6, s) Pa at samples of the cycle."""
        chosen = self.coordinates[samples]
        return (chosen @ self.modes.reshape(len(self.modes), -1)).reshape(len(chosen), *self.modes.shape[1:])

    def von_mises(self, samples: slice | NDArray[np.intp]) -> Tensors:
        """Von Mises stress (k, s) Pa at samples of the cycle."""
        return von_mises(self.tensors(samples).transpose(1, 0, 2))

    def nearest(self, angle: float) -> int:
        """Index of the sample nearest to a crank angle, rad."""
        apart = (self.angle - angle + 2.0 * np.pi) % (4.0 * np.pi) - 2.0 * np.pi
        return int(np.abs(apart).argmin())

    def history(self, node: int) -> Array:
        """Stress (k, 6) Pa of one node over the cycle."""
        return np.asarray(self.coordinates @ self.modes[:, :, node], dtype=float)

    @cached_property
    def envelope(self) -> tuple[Tensors, NDArray[np.intp]]:
        """Greatest von Mises stress (s,) of each node over the cycle, Pa, and the index of its sample (s,)."""
        return self._scanned[:2]

    @cached_property
    def greatest(self) -> tuple[Tensors, NDArray[np.intp]]:
        """Greatest von Mises stress (k,) of the surface at each sample, Pa, and its node (k,)."""
        return self._scanned[2:]

    @cached_property
    def _scanned(self) -> tuple[Tensors, NDArray[np.intp], Tensors, NDArray[np.intp]]:
        """Results of :meth:`envelope` and :meth:`greatest`, computed together in one pass over the cycle."""
        count, nodes = len(self.coordinates), self.modes.shape[2]
        envelope, when = np.full(nodes, -1.0, dtype=np.float32), np.zeros(nodes, dtype=np.intp)
        greatest, where = np.empty(count, dtype=np.float32), np.empty(count, dtype=np.intp)
        for first in range(0, count, BATCH):
            part = self.von_mises(slice(first, first + BATCH))
            highest = part.max(axis=0)
            higher = highest > envelope
            when[higher] = first + part[:, higher].argmax(axis=0)
            envelope[higher] = highest[higher]
            where[first : first + BATCH] = part.argmax(axis=1)
            greatest[first : first + BATCH] = part.max(axis=1)
        return envelope, when, greatest, where

    def hot_spots(self) -> list[HotSpot]:
        """Point of greatest stress of each feature (fillet, oil hole, journal, web), the greatest first."""
        names, number = self.features
        envelope, when = self.envelope
        spots = []
        for k, name in enumerate(names):
            own = np.flatnonzero(number == k)
            if own.size:
                node = int(own[envelope[own].argmax()])
                angle = float(self.angle[when[node]])
                spots.append(HotSpot(name, node, self.surface.points[node], float(envelope[node]), angle))
        return sorted(spots, key=lambda spot: -spot.stress)

    def save(self, path: Path, attributes: dict[str, str | int | float]) -> Path:
        """Write modal coordinates, loads, envelope and surface to an HDF5 file, SI."""
        cycle, (envelope, when) = self.cycle, self.envelope
        datasets: dict[str, tuple[NDArray[Any], str]] = {
            "angle": (self.angle, "rad"),
            "modal_coordinates": (cycle.position, "kg^0.5 m"),
            "modal_velocities": (cycle.velocity, "kg^0.5 m/s"),
            "interface_loads": (wrenches(cycle), "N, N m"),
            "greatest_von_mises": (self.greatest[0], "Pa"),
            "surface_points": (self.surface.points, "m"),
            "surface_triangles": (self.surface.triangles, "1"),
            "envelope_von_mises": (envelope, "Pa"),
            "envelope_angle": (self.angle[when], "rad"),
        }
        return write_result(path, datasets, attributes)


class StaticCheck(NamedTuple):
    """Difference of superposed stresses from direct finite-element solutions under the same loads and accelerations.

    ``relative`` is the greatest von Mises stress of the difference over that of the direct solution, at the worst
    instant; ``angles`` (c,) rad are the instants.
    """

    relative: float
    angles: Array


def static_check(stress: CrankStress, crank: ShapedCrank, say: Callable[[str], None]) -> StaticCheck:
    """Compare stresses at some instants of a cycle with direct solutions."""
    say("direct solutions for the static check")
    samples = np.unique(np.linspace(0, len(stress.angle), CHECKED, endpoint=False).astype(np.intp))
    with one_thread():
        displacement, _ = direct_solution(crank, stress.cycle.engine, bare_instants(stress.cycle.at(samples)))
    operator, dofs = crank.surface_stress
    direct = operator(displacement[dofs]).transpose(1, 0, 2)
    difference = von_mises(stress.tensors(samples).transpose(1, 0, 2) - direct).max(axis=1)
    return StaticCheck(float((difference / von_mises(direct).max(axis=1)).max()), stress.angle[samples])
