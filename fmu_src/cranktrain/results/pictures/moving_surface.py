"""A surface that moves through one cycle and has colours: the source of every picture in space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.types import Array

Single = NDArray[np.float32]

SHOWN_MOTION = 0.03
"""Largest displacement of a picture over the surface's length, where the enlargement is not given."""


@dataclass(frozen=True, eq=False)
class MovingSurface:
    """Surface of p points in f frames of one cycle, the last of which leads over to the first.

    Frame k shows each point where a turn about z by ``turn[k]`` takes it from its place plus the enlarged displacement
    ``coordinates[k] @ shapes``.

    Attributes
    ----------
    title : of the picture
    points : (p, 3) m at rest, z along the crank axis
    triangles : (t, 3) into ``points``, their corners counter-clockwise from outside
    shapes : (m, p, 3) displacement per unit coordinate
    coordinates : (f, m)
    turn : (f,) rad
    values : (f, p) shown by the colours
    quantity : name of the values with their unit
    limits : values at the ends of the colour scale
    captions : (f,) text of each frame
    scale : text on the enlargement
    seconds : duration of the cycle on the screen
    """

    title: str
    points: Array
    triangles: NDArray[np.int32]
    shapes: Single
    coordinates: Array
    turn: Array
    values: Single
    quantity: str
    limits: tuple[float, float]
    captions: tuple[str, ...]
    scale: str = "motion enlarged {:g} times"
    seconds: float = 2.0

    @property
    def enlargement(self) -> float:
        """Enlargement at which the largest displacement is SHOWN_MOTION of the surface's length, in two digits."""
        largest = max(float(np.linalg.norm(self.displacement(k), axis=1).max()) for k in range(len(self.turn)))
        length = float(np.ptp(self.points, axis=0).max())
        return float(f"{SHOWN_MOTION * length / largest:.2g}") if largest > 0.0 else 1.0

    def displacement(self, frame: int) -> Array:
        """Displacement (p, 3) m in a frame, in axes that turn with the surface."""
        return np.asarray(np.tensordot(self.coordinates[frame], self.shapes, axes=1), dtype=np.float64)

    def places(self, frame: int, enlargement: float) -> Array:
        """Places (p, 3) of the points in a frame."""
        moved = self.points + enlargement * self.displacement(frame)
        cos, sin = np.cos(self.turn[frame]), np.sin(self.turn[frame])
        x, y, z = moved.T
        return np.column_stack((cos * x - sin * y, sin * x + cos * y, z))

    def principal_motions(self, least: float = 0.005) -> tuple[Array, Single]:
        """The motion in fewer shapes: coordinates (f, n) and shapes (n, p, 3), largest first.

        Each of those left out has less than ``least`` of the first one's size.
        """
        flat = self.shapes.reshape(len(self.shapes), -1).astype(np.float64)
        # Use the products of the shapes: their number is the square of the number of shapes, independent of the points.
        squares, own = np.linalg.eigh(flat @ flat.T)
        root = own * np.sqrt(np.maximum(squares, 0.0))
        left, sizes, _ = np.linalg.svd(self.coordinates @ root, full_matrices=False)
        kept = np.flatnonzero(sizes > least * sizes[0])
        coordinates = left[:, kept] * sizes[kept]
        back, *_ = np.linalg.lstsq(coordinates, self.coordinates, rcond=None)
        return coordinates, (back @ flat).reshape(len(kept), *self.points.shape).astype(np.float32)
