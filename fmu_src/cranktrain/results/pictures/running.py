"""Moving surface of the running crankshaft, coloured by its stress."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import StoreError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.results.pictures.moving_surface import MovingSurface
from cranktrain.results.pictures.skin import Skin
from cranktrain.results.strength.stress import CrankStress
from cranktrain.structure.crank.reduction import crank_surface

FRAME_DEG = 10
"""Crank angle between frames, deg."""
SECONDS = 6.0
"""Duration of the cycle on the screen, s."""
USUAL_STRESS = 0.999
"""Fraction of a cycle's stress values that the colour scale covers; stresses at a few nodes exceed its end."""
RIGID = 6
"""Number of rigid modes of the bare crankshaft, which come first."""


@dataclass(frozen=True, eq=False)
class RunningSkin:
    """Outer surface of a crankshaft at f crank angles: its motion, and indices of the stress samples.

    Attributes
    ----------
    skin : surface with its shapes in the crank's elastic modes
    samples : (f,) indices of the stress samples
    coordinates : (f, m) coordinates of the shapes
    """

    skin: Skin
    samples: NDArray[np.intp]
    coordinates: Array


def running_skin(
    engine: Engine, running: ReducedBody, stress: CrankStress, degrees: int, mesh_file: str | Path | None = None
) -> RunningSkin:
    """Surface of the crankshaft over a cycle in steps of ``degrees``.

    The rigid motion in the bearings' clearances and relative to the driven end is left out, because enlarged like the
    deformation it would leave the picture. The deformation is composed of the first stored modes.

    Raises ``StoreError`` if the stored surface does not belong to the stresses.

    Parameters
    ----------
    running : crankshaft of the running model
    stress : its stresses over a cycle
    """
    points, triangles, pictured = crank_surface(engine, mesh_file)
    if not np.array_equal(points, stress.surface.points):
        raise StoreError("stored stresses belong to another mesh; 'cranktrain reduce' with --anew makes both anew")
    basis = np.eye(running.n_modes) if running.basis is None else running.basis
    samples = np.array([stress.nearest(math.radians(angle)) for angle in range(0, 720, degrees)])
    return RunningSkin(
        Skin.of(points, triangles, pictured[RIGID:]),
        samples,
        stress.cycle.position[samples] @ basis[RIGID : len(pictured)].T,
    )


def running_picture(
    engine: Engine, running: ReducedBody, stress: CrankStress, title: str, mesh_file: str | Path | None = None
) -> MovingSurface:
    """Moving surface of the crankshaft over a cycle with enlarged deformation, coloured by von Mises stress.

    Parameters, errors and omitted motions are those of :func:`running_skin`.
    """
    moving = running_skin(engine, running, stress, FRAME_DEG, mesh_file)
    skin, samples = moving.skin, moving.samples
    values = 1e-6 * np.concatenate([stress.von_mises(part) for part in np.split(samples, len(samples) // 8)])
    angles = range(0, 720, FRAME_DEG)
    return MovingSurface(
        title=title,
        points=skin.points,
        triangles=skin.triangles,
        shapes=skin.modes,
        coordinates=moving.coordinates,
        turn=stress.angle[samples],
        values=values[:, skin.origin].astype(np.float32),
        quantity="von Mises stress / MPa",
        limits=(0.0, float(np.quantile(values, USUAL_STRESS))),
        captions=tuple(f"crank angle {a}°, greatest {v.max():.0f} MPa" for a, v in zip(angles, values, strict=True)),
        scale="deformation enlarged {:g} times",
        seconds=SECONDS,
    )
