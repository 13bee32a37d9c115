"""Big ends that float in their films: each rod's big-end mass as a free point in the turning frame.

A point mass has two modes in the plane, and its displacement from the undeformed pin is exact at any angle. The rest of
the rod and the piston stay eliminated onto it, as they are onto a rigid pin.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from cranktrain.engine import Engine
from cranktrain.reduced_body import Array, ReducedBody


def with_big_ends(body: ReducedBody, engine: Engine) -> ReducedBody:
    """Append one free point mass per cylinder to the crankshaft, with interfaces ``rod[i]`` at the undeformed pins."""
    root = math.sqrt(engine.rod.big_end_mass)
    places = np.array([body.positions[body.index(f"pin[{pin}]")] for pin in engine.cylinders.pins])
    count = len(places)
    n, added = body.n_modes, 2 * count

    def extend(matrix: Array, block: Array) -> Array:
        out = np.zeros((n + added, n + added))
        out[:n, :n] = matrix
        out[n:, n:] = np.kron(np.eye(count), block)
        return out

    shapes = np.zeros((len(body.interfaces) + count, 6, n + added))
    shapes[: len(body.interfaces), :, :n] = body.shapes
    for i in range(count):
        for axis in range(2):
            shapes[len(body.interfaces) + i, axis, n + 2 * i + axis] = 1.0 / root
    translation = np.zeros((3, n + added))
    translation[:, :n] = body.translation
    for axis in range(2):
        translation[axis, n + axis :: 2] = root
    turned = np.stack([-places[:, 1], places[:, 0]], axis=1)
    return replace(
        body,
        omega=np.append(body.omega, np.zeros(added)),
        interfaces=body.interfaces + tuple(f"rod[{i + 1}]" for i in range(count)),
        positions=np.concatenate([body.positions, places]),
        shapes=shapes,
        # ∫ρ φ_i·(e_z×φ_j) of the modes e_x and e_y: e_z turns e_x into e_y.
        gyroscopic=extend(body.gyroscopic, np.array([[0.0, -1.0], [1.0, 0.0]])),
        centrifugal=extend(body.centrifugal, np.eye(2)),
        stress_stiffness=extend(body.stress_stiffness, np.zeros((2, 2))),
        centrifugal_load=np.append(body.centrifugal_load, root * places[:, :2].ravel()),
        euler_load=np.append(body.euler_load, root * turned.ravel()),
        translation=translation,
        basis=None,
    )
