"""Surface of the crankshaft with stresses over a cycle for display, in float32 at every few degrees."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.results.pictures.moving_surface import MovingSurface, Single
from cranktrain.results.pictures.running import USUAL_STRESS, running_skin
from cranktrain.results.strength.stress import BATCH, CrankStress
from cranktrain.structure.stress.nodal_stress import principal, von_mises

VON_MISES, PRINCIPAL = "von_mises", "principal"
STRESSES = {VON_MISES: "von Mises stress", PRINCIPAL: "largest principal stress, signed"}
"""Stresses that colours can show, with titles; of the three principal stresses the one of largest magnitude."""
LARGEST = 60_000
"""Largest number of triangles that is displayed; larger surfaces are coarsened."""


@dataclass(frozen=True, eq=False)
class CrankSurface:
    """Surface of the crankshaft with p points at f crank angles (SI).

    Attributes
    ----------
    points : (p, 3) points at rest, m
    triangles : (t, 3) point indices
    shapes : (m, p, 3) displacement per unit coordinate, m
    coordinates : (f, m) coordinates of the shapes
    turn : (f,) rotation of the crank, rad
    stresses : each of :data:`STRESSES`, (f, p) Pa
    """

    points: Array
    triangles: NDArray[np.int32]
    shapes: Single
    coordinates: Array
    turn: Array
    stresses: dict[str, Single]

    @property
    def enlargement(self) -> float:
        """Initial enlargement of the deformation on a page."""
        return self._moving.enlargement

    @property
    def _moving(self) -> MovingSurface:
        """Return the surface for pictures, coloured by the von Mises stress."""
        return MovingSurface(
            title="", points=self.points, triangles=self.triangles, shapes=self.shapes, coordinates=self.coordinates,
            turn=self.turn, values=self.stresses[VON_MISES], quantity="", limits=(0.0, 1.0),
            captions=("",) * len(self.turn),
        )  # fmt: skip

    def limits(self, stress: str) -> tuple[float, float]:
        """Return lower and upper end (Pa) of a stress's colour scale, which is the same over the whole cycle."""
        values = self.stresses[stress]
        top = float(np.quantile(np.abs(values), USUAL_STRESS))
        return (-top if stress == PRINCIPAL else 0.0), top

    def extreme(self, stress: str, frame: int) -> tuple[float, Array]:
        """Return the stress of largest magnitude in a frame, Pa, and its position (3,) on the crank at rest, m."""
        values = self.stresses[stress][frame]
        node = int(np.abs(values).argmax())
        return float(values[node]), self.points[node]

    @property
    def reduced(self) -> "CrankSurface":
        """Return the surface with the same motion, stored with the least number of shapes for display."""
        coordinates, shapes = self._moving.principal_motions()
        return replace(self, coordinates=coordinates, shapes=shapes)


def crank_surface_of(engine: Engine, running: ReducedBody, stress: CrankStress, degrees: int) -> CrankSurface:
    """Return the surface of a run's crankshaft every ``degrees``; errors as ``running_skin``."""
    moving = running_skin(engine, running, stress, degrees)
    skin, samples = moving.skin, moving.samples
    count = stress.surface.points.shape[0]
    found = {name: np.empty((len(samples), count), dtype=np.float32) for name in STRESSES}
    for first in range(0, len(samples), BATCH):
        rows = slice(first, first + BATCH)
        tensors = stress.tensors(samples[rows])
        found[VON_MISES][rows] = von_mises(tensors.transpose(1, 0, 2))
        for row, tensor in zip(found[PRINCIPAL][rows], tensors, strict=True):
            values = principal(np.asarray(tensor, dtype=float))
            row[:] = np.where(values[:, 2] >= -values[:, 0], values[:, 2], values[:, 0])
    surface = CrankSurface(
        skin.points, skin.triangles, skin.modes, moving.coordinates, stress.angle[samples],
        {name: np.ascontiguousarray(values[:, skin.origin]) for name, values in found.items()},
    )  # fmt: skip
    return coarser(surface, LARGEST).reduced


def coarser(surface: CrankSurface, most: int) -> CrankSurface:
    """Coarsen a surface to about ``most`` triangles by merging the points in each cube of a grid.

    The point with the largest von Mises stress of the cycle in each cube is kept, so the maximum of a frame may move
    within its cube. A surface with up to ``most`` triangles is unchanged.
    """
    if len(surface.triangles) <= most:
        return surface
    low, spread = surface.points.min(axis=0), float(np.ptp(surface.points, axis=0).max())
    greatest = surface.stresses[VON_MISES].max(axis=0)
    order = np.argsort(-greatest, kind="stable")
    cells = int((len(surface.points) * most / len(surface.triangles)) ** 0.5)
    while True:
        cube = np.floor((surface.points - low) * (cells / spread)).astype(np.int64) @ (1, 1 << 20, 1 << 40)
        # Points are ordered by stress, so the first point of each cube has the largest stress.
        _, first, group = np.unique(cube[order], return_index=True, return_inverse=True)
        kept = order[first]
        number = np.empty(len(cube), dtype=np.int32)
        number[order] = group
        found = number[surface.triangles]
        flat = (found[:, 0] == found[:, 1]) | (found[:, 1] == found[:, 2]) | (found[:, 2] == found[:, 0])
        triangles = found[~flat]
        if len(triangles) <= most:
            break
        cells = int(0.9 * cells)
    stresses = {name: np.ascontiguousarray(values[:, kept]) for name, values in surface.stresses.items()}
    return replace(
        surface, points=surface.points[kept], triangles=triangles, shapes=surface.shapes[:, kept], stresses=stresses
    )
