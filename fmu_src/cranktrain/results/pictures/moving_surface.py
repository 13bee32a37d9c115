"""Coloured surface that moves through one cycle, the data of every three-dimensional picture."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.types import Array

Single = NDArray[np.float32]

SHOWN_MOTION = 0.03
"""Largest displacement in a picture over the surface's length, if no enlargement is given."""


@dataclass(frozen=True, eq=False)
class MovingSurface:
    """Surface of p points in f frames of one cycle, which can be repeated without a jump.

    In frame k the enlarged displacement ``coordinates[k] @ shapes`` is added to each point, and the surface is rotated
    about z by ``turn[k]``.

    Attributes
    ----------
    title : title of the picture
    points : (p, 3) undeformed positions, m, z along the crank axis
    triangles : (t, 3) rows of ``points``, corners counter-clockwise from outside
    shapes : (m, p, 3) displacement per unit coordinate
    coordinates : (f, m) coordinates of the shapes
    turn : (f,) rotation about z, rad
    values : (f, p) values shown as colours
    quantity : name and unit of the values
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
        """Enlargement, to two digits, at which the largest displacement is SHOWN_MOTION of the surface's length."""
        largest = max(float(np.linalg.norm(self.displacement(k), axis=1).max()) for k in range(len(self.turn)))
        length = float(np.ptp(self.points, axis=0).max())
        return float(f"{SHOWN_MOTION * length / largest:.2g}") if largest > 0.0 else 1.0

    def displacement(self, frame: int) -> Array:
        """Displacement (p, 3), m, in a frame, in axes that rotate with the surface."""
        return np.asarray(np.tensordot(self.coordinates[frame], self.shapes, axes=1), dtype=np.float64)

    def places(self, frame: int, enlargement: float) -> Array:
        """Positions (p, 3) of the points in a frame."""
        moved = self.points + enlargement * self.displacement(frame)
        cos, sin = np.cos(self.turn[frame]), np.sin(self.turn[frame])
        x, y, z = moved.T
        return np.column_stack((cos * x - sin * y, sin * x + cos * y, z))

    def principal_motions(self, least: float = 0.005) -> tuple[Array, Single]:
        """Motion of the surface as a sum of n shapes (n, p, 3) with coordinates (f, n) for f frames, largest first.

        Shapes smaller than ``least`` times the largest are left out.
        """
        flat = self.shapes.reshape(len(self.shapes), -1).astype(np.float64)
        # Shapes follow from their matrix of products, whose size does not depend on the number of points.
        squares, own = np.linalg.eigh(flat @ flat.T)
        root = own * np.sqrt(np.maximum(squares, 0.0))
        left, sizes, _ = np.linalg.svd(self.coordinates @ root, full_matrices=False)
        kept = np.flatnonzero(sizes > least * sizes[0])
        coordinates = left[:, kept] * sizes[kept]
        back, *_ = np.linalg.lstsq(coordinates, self.coordinates, rcond=None)
        return coordinates, (back @ flat).reshape(len(kept), *self.points.shape).astype(np.float32)
