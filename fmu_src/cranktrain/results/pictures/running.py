"""The running crankshaft as a moving surface in the colours of its stress."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from cranktrain.core.errors import StoreError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.engine.model import Engine
from cranktrain.results.pictures.moving_surface import MovingSurface
from cranktrain.results.pictures.skin import Skin
from cranktrain.results.strength.stress import CrankStress
from cranktrain.structure.crank.reduction import crank_surface

FRAME_DEG = 10
"""Crank angle from frame to frame."""
SECONDS = 6.0
"""Time in which the cycle is shown."""
RIGID = 6
"""Motions of the bare crankshaft as a rigid body, its first modes."""


def running_picture(
    engine: Engine, running: ReducedBody, stress: CrankStress, title: str, mesh_file: str | Path | None = None
) -> MovingSurface:
    """The crankshaft over a cycle, its deformation enlarged, in the colours of the von Mises stress.

    Its motion as a rigid body, within the bearings' clearances and against the driven end, is left out, because with
    the enlargement of the deformation it would leave the picture. The deformation is composed of the first stored
    modes.

    Raises ``StoreError`` where the stored surface is not the stresses'.

    Parameters
    ----------
    running : the crankshaft of the running model
    stress : of a cycle of it
    """
    points, triangles, pictured = crank_surface(engine, mesh_file)
    if not np.array_equal(points, stress.surface.points):
        raise StoreError("stored stresses belong to another mesh; 'cranktrain reduce' with --rebuild makes both anew")
    skin = Skin.of(points, triangles, pictured[RIGID:])
    basis = np.eye(running.n_modes) if running.basis is None else running.basis
    angles = np.arange(0, 720, FRAME_DEG)
    samples = np.array([stress.nearest(math.radians(angle)) for angle in angles])
    values = 1e-6 * np.concatenate([stress.von_mises(part) for part in np.split(samples, len(samples) // 8)])
    return MovingSurface(
        title=title,
        points=skin.points,
        triangles=skin.triangles,
        shapes=skin.modes,
        coordinates=stress.cycle.position[samples] @ basis[RIGID : len(pictured)].T,
        turn=stress.angle[samples],
        values=values[:, skin.origin].astype(np.float32),
        quantity="von Mises stress / MPa",
        limits=(0.0, float(np.quantile(values, 0.999))),
        captions=tuple(f"crank angle {a}°, greatest {v.max():.0f} MPa" for a, v in zip(angles, values, strict=True)),
        scale="deformation enlarged {:g} times",
        seconds=SECONDS,
    )
