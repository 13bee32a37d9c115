"""Stress histories of fillets and oil bores over a cycle, from the sub-models of the throws."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.rigid_slices import TURN
from cranktrain.core.types import Array
from cranktrain.engine.parts import Crankshaft
from cranktrain.results.strength.assessment import BORE_GRADIENT, FILLET_GRADIENT
from cranktrain.results.strength.cut_loads import AXIS, PointLoads, bare_instants, crank_loads
from cranktrain.results.strength.fatigue import FilletHistory
from cranktrain.results.strength.recorded_cycle import RecordedCycle
from cranktrain.structure.stress.direct_solution import Instants
from cranktrain.structure.stress.fillet_factors import free_surface
from cranktrain.structure.stress.nodal_stress import von_mises
from cranktrain.structure.stress.sub_model import CUTS, FilletModes, cut_places

CONVERGED = 0.03
"""Largest ratio of smallest to largest |principal stress| at the peak of a fillet whose mesh is converged."""
_BATCH = 16
_JUDGED = 4
_BESIDE = 1e-3
"""Distance from a cut, m, below which a load counts as beyond the cut."""


@dataclass(frozen=True, eq=False)
class FilletPeak:
    """Point of the greatest stress of a fillet or oil bore over a cycle of k samples.

    Attributes
    ----------
    name : name of the fillet
    place : (3,) position, m
    angle : (k,) crank angle, rad
    tensor : (k, 6) stress, Pa, components xx, yy, zz, xy, yz, zx in axes of the frame, from the cuts' resultants
    peak : index of the sample of the greatest von Mises stress
    free_surface : ratio of smallest to largest |principal stress| at this sample; 0 for a fully resolved surface
    by_motion : greatest von Mises stress of any point if the cuts follow the crank's motion, Pa
    """

    name: str
    place: Array
    angle: Array
    tensor: Array
    peak: int
    free_surface: float
    by_motion: float

    @property
    def converged(self) -> bool:
        """True if the mesh of the sub-model resolves the stress peak."""
        return self.free_surface <= CONVERGED

    @property
    def von_mises(self) -> float:
        """Greatest von Mises stress, Pa."""
        return float(von_mises(self.tensor[self.peak]))


@dataclass(frozen=True, eq=False)
class FilletRun:
    """A fillet or oil bore over a cycle: two sets of coordinates (k, n + LOADS + CUTS) of its stress modes."""

    modes: FilletModes
    angle: Array
    by_motion: Array
    by_resultants: Array

    def scanned(self, drive: Array) -> tuple[Array, NDArray[np.intp]]:
        """Greatest von Mises stress over the cycle of each of s points, (s,) Pa, and the index of its sample (s,)."""
        modes, driven = self.modes.modes, drive.astype(np.float32)
        flat = modes.reshape(len(modes), -1)
        greatest = np.zeros(len(self.modes.points), dtype=np.float32)
        sample = np.zeros(greatest.size, dtype=np.intp)
        for first in range(0, len(driven), _BATCH):
            part = (driven[first : first + _BATCH] @ flat).reshape(-1, *modes.shape[1:])
            values = von_mises(part.transpose(1, 0, 2))
            highest = values.max(axis=0)
            higher = highest > greatest
            sample[higher] = first + values[:, higher].argmax(axis=0)
            greatest[higher] = highest[higher]
        return greatest.astype(float), sample

    def tensor(self, node: int) -> Array:
        """Stress (k, 6) of one point over the cycle from the cuts' resultants, Pa."""
        return np.asarray(self.by_resultants @ self.modes.modes[:, :, node], dtype=np.float64)

    @property
    def peak(self) -> FilletPeak:
        """Point of the greatest von Mises stress."""
        greatest, sample = self.scanned(self.by_resultants)
        node = int(greatest.argmax())
        tensor, peak = self.tensor(node), int(sample[node])
        resolved = free_surface(tensor[peak][:, None])
        by_motion = float(self.scanned(self.by_motion)[0].max())
        return FilletPeak(self.modes.name, self.modes.points[node], self.angle, tensor, peak, resolved, by_motion)

    def histories(self, c: Crankshaft) -> list[FilletHistory]:
        """Stress histories for fatigue at the points of the greatest peaks and ranges, all with the same name."""
        greatest, sample = self.scanned(self.by_resultants)
        reference = self.by_resultants[sample[greatest.argmax()]]
        ranges, _ = self.scanned(self.by_resultants - reference)
        bore = "hole" in self.modes.name
        gradient = 2.0 * BORE_GRADIENT / c.oil_hole_diameter if bore else FILLET_GRADIENT / c.fillet
        found = []
        for node in sorted({*greatest.argsort()[-_JUDGED:].tolist(), *ranges.argsort()[-_JUDGED:].tolist()}):
            tensor = self.tensor(node)
            resolved = free_surface(tensor[sample[node]][:, None]) <= CONVERGED
            found.append(FilletHistory(fatigue_name(self.modes.name), self.angle, tensor, gradient, resolved))
        return found


def fatigue_name(place: str) -> str:
    """Name in fatigue assessment of a sub-model's fillet or oil bore: ``pin[1] rear fillet`` → ``web[2].pin``."""
    journal, number = place[: place.index("[")], int(place[place.index("[") + 1 : place.index("]")])
    if journal == "oil hole":
        return f"pin[{number}].oil_bore"
    rear = int(place.endswith("rear fillet"))
    web = 2 * number - 1 + rear if journal == "pin" else 2 * number - 2 + rear
    return f"web[{web}].{journal}"


def fillet_runs(bare: ReducedBody, cycle: RecordedCycle, fillets: Iterable[FilletModes]) -> list[FilletRun]:
    """Fillets and oil bores over a recorded cycle, or over the last one of several.

    ``bare``: bare crankshaft in all its modes.
    """
    cycle = cycle.last()
    at, loads = bare_instants(cycle), crank_loads(cycle)
    found = []
    for modes in fillets:
        drive = throw_drive(bare, at, modes.throw)
        held = np.zeros((len(drive), CUTS))
        freed = modes.by_resultants(drive, cut_wrenches(cycle.engine.crankshaft, loads, modes.throw))
        driven = (np.hstack((drive, motions)) for motions in (held, freed))
        found.append(FilletRun(modes, cycle.crank_angle, *driven))
    return found


def cut_wrenches(c: Crankshaft, loads: PointLoads, throw: int) -> Array:
    """Force and moment (k, CUTS) about the middle of each cut by all loads beyond the cut and on its main journal."""
    front, rear = cut_places(c, throw)
    beyond = ((loads.z < front + _BESIDE, front), (loads.z > rear - _BESIDE, rear))
    return np.hstack([part for chosen, z in beyond for part in loads.resultant(chosen, z * AXIS)])


def throw_drive(bare: ReducedBody, at: Instants, throw: int) -> Array:
    """Drive (k, n + LOADS) of a throw's sub-models, see :mod:`cranktrain.structure.stress.sub_model`."""
    row = bare.index(f"pin[{throw}]")
    acceleration = at.acceleration @ bare.shapes[row].T
    turned = 2.0 * at.speed[:, None] * (at.velocity @ bare.shapes[row, :3].T)
    turned += at.speed_rate[:, None] * bare.positions[row]
    acceleration[:, :3] += turned @ TURN.T - at.gravity
    acceleration[:, 5] += at.speed_rate
    loads = [at.loads[:, bare.index(name)] for name in (f"pin[{throw}]", f"main[{throw}]", f"main[{throw + 1}]")]
    return np.column_stack((at.position, *loads, acceleration, at.speed**2))
