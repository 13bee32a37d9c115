"""Parts of a crankshaft's surface from its dimensions: fillet, oil hole, journal or web of each surface point."""

from math import hypot

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.types import Array
from cranktrain.engine.parts import Crankshaft
from cranktrain.structure.crank.shape import oil_main, pin_centre, stations

NEAR = 0.2
"""Largest distance of a surface point from a fillet's torus, over the fillet's radius, for points of the fillet."""
ELSEWHERE = "web"


def surface_features(crankshaft: Crankshaft, points: Array) -> tuple[tuple[str, ...], NDArray[np.intp]]:
    """Names of a crankshaft's features, and index (s,) of the feature of each surface point (s, 3), m.

    ``pin[1] front fillet`` is at the end of pin 1 towards the pulley, ``rear`` at the end towards the flywheel. On a
    user's own mesh the positions of features are still those of the engine file's dimensions.
    """
    c = crankshaft
    at = stations(c)
    names: list[str] = [ELSEWHERE]
    number = np.zeros(len(points), dtype=np.intp)

    def mark(name: str, where: NDArray[np.bool_]) -> None:
        if where.any():
            number[where & (number == 0)] = len(names)
            names.append(name)

    journals = [(f"pin[{i}]", pin_centre(c, i)[:2], 0.5 * c.pin_diameter, span) for i, span in enumerate(at.pins, 1)]
    journals += [(f"main[{i}]", (0.0, 0.0), 0.5 * c.main_diameter, span) for i, span in enumerate(at.mains, 1)]
    if c.oil_holes:
        for i in range(1, len(at.pins) + 1):
            if oil_main(c, i):
                mark(f"oil hole[{i}]", _on_oil_hole(c, i, points))
    for name, centre, radius, (start, end) in journals:
        along = np.hypot(points[:, 0] - centre[0], points[:, 1] - centre[1])
        for side, z, inward in (("front", start, 1.0), ("rear", end, -1.0)):
            depth = inward * (points[:, 2] - z)
            beside = np.hypot(along - radius - c.fillet, depth - c.fillet)
            on_arc = (np.abs(beside - c.fillet) < NEAR * c.fillet) & (depth < 1.01 * c.fillet) & (depth > -1e-6)
            mark(f"{name} {side} fillet", on_arc & (along < radius + 1.01 * c.fillet))
        inside = (points[:, 2] > start - 1e-6) & (points[:, 2] < end + 1e-6)
        mark(name, inside & (np.abs(along - radius) < NEAR * c.fillet))
    mark("nose", points[:, 2] < at.nose[1] + 1e-6)
    mark("flange", points[:, 2] > at.flange[0] - 1e-6)
    return tuple(names), number


def _on_oil_hole(c: Crankshaft, pin: int, points: Array) -> NDArray[np.bool_]:
    """True for points on the oil bore from the far side of a main journal to the outer side of its pin."""
    x, y, z_pin = pin_centre(c, pin)
    start, end = stations(c).mains[oil_main(c, pin) - 1]
    z_main, throw = 0.5 * (start + end), c.throws[pin - 1]
    rise = throw + 0.5 * (c.pin_diameter + c.main_diameter)
    length = hypot(rise, z_pin - z_main)
    along = np.array([x / throw * rise, y / throw * rise, z_pin - z_main]) / length
    foot = np.array([-x / throw * 0.5 * c.main_diameter, -y / throw * 0.5 * c.main_diameter, z_main])
    way = points - foot
    beside = np.linalg.norm(way - (way @ along)[:, None] * along, axis=1)
    return np.abs(beside - 0.5 * c.oil_hole_diameter) < 0.5 * NEAR * c.oil_hole_diameter
