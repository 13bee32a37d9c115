"""Stress histories of the fillets over a cycle, from the sub-models of the throws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.reduced_body import TURN, ReducedBody
from cranktrain.results.strength.crank_cycle import CrankCycle
from cranktrain.structure.stress.fillet_factors import free_surface
from cranktrain.structure.stress.nodal_stress import von_mises
from cranktrain.structure.stress.sub_model import FilletModes

Array = NDArray[np.float64]

CONVERGED = 0.03
"""Least over largest principal stress at the peak, up to which a fillet counts as converged."""
_BATCH = 16


@dataclass(frozen=True, eq=False)
class FilletPeak:
    """Hottest place of a fillet or oil hole over a cycle of k samples.

    Attributes
    ----------
    name : of the fillet
    place : (3,) m
    angle : (k,) crank angle, rad
    tensor : (k, 6) stress, Pa, components xx, yy, zz, xy, yz, zx in axes of the frame
    peak : sample of the greatest von Mises stress
    free_surface : least over largest principal stress by size then; 0 at a surface that is fully resolved
    """

    name: str
    place: Array
    angle: Array
    tensor: Array
    peak: int
    free_surface: float

    @property
    def converged(self) -> bool:
        """Whether the mesh resolves the peak."""
        return self.free_surface <= CONVERGED

    @property
    def von_mises(self) -> float:
        """Greatest von Mises stress, Pa."""
        return float(von_mises(self.tensor[self.peak]))


def fillet_peaks(bare: ReducedBody, running: ReducedBody, cycle: CrankCycle, modes: FilletModes) -> list[FilletPeak]:
    """Hottest place of each fillet and oil hole of a throw, by von Mises stress.

    Parameters
    ----------
    bare, running : crankshaft without parts in all its modes, and that of the run
    """
    drive = throw_drive(bare, running, cycle, modes.throw).astype(np.float32)
    flat = modes.modes.reshape(len(modes.modes), -1)
    greatest = np.zeros(len(modes.points), dtype=np.float32)
    for first in range(0, len(drive), _BATCH):
        part = (drive[first : first + _BATCH] @ flat).reshape(-1, *modes.modes.shape[1:])
        np.maximum(greatest, von_mises(part.transpose(1, 0, 2)).max(axis=0), out=greatest)
    found = []
    for k, name in enumerate(modes.features):
        own = np.flatnonzero(modes.number == k)
        node = own[greatest[own].argmax()]
        tensor = np.asarray(drive @ modes.modes[:, :, node], dtype=np.float64)
        peak = int(von_mises(tensor.T).argmax())
        resolved = free_surface(tensor[peak][:, None])
        found.append(FilletPeak(name, modes.points[node], cycle.angle, tensor, peak, resolved))
    return found


def throw_drive(bare: ReducedBody, running: ReducedBody, cycle: CrankCycle, throw: int) -> Array:
    """Drive (k, n + LOADS) of a throw's sub-model, see :mod:`cranktrain.structure.stress.sub_model`."""
    basis = np.eye(running.n_modes) if running.basis is None else running.basis
    row = bare.index(f"pin[{throw}]")
    position, rate, second = (part @ basis.T for part in (cycle.position, cycle.velocity, cycle.acceleration))
    acceleration = second @ bare.shapes[row].T
    turned = 2.0 * cycle.speed[:, None] * (rate @ bare.shapes[row, :3].T)
    turned += cycle.speed_rate[:, None] * bare.positions[row]
    acceleration[:, :3] += turned @ TURN.T - cycle.gravity
    acceleration[:, 5] += cycle.speed_rate
    loads = [cycle.loads[:, bare.index(name)] for name in (f"pin[{throw}]", f"main[{throw}]", f"main[{throw + 1}]")]
    return np.column_stack((position, *loads, acceleration, cycle.speed**2))
