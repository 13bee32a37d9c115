"""Mode shapes of the crankshaft as moving surfaces."""

import math
from pathlib import Path

import numpy as np
from scipy.linalg import eigh

from cranktrain.core.argument_checks import whole_number
from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.results.pictures.moving_surface import SHOWN_MOTION, MovingSurface
from cranktrain.results.pictures.skin import Skin
from cranktrain.structure.crank.modal import (
    KINDS,
    cranktrain_matrices,
    cranktrain_modes,
    first_torsional,
    free_modes,
    listed_to,
    named_frequencies,
)
from cranktrain.structure.crank.reduction import complete_crankshaft, crank_surface

FRAMES = 24
"""Number of frames of one oscillation."""


def mode_picture(
    engine: Engine, bare: ReducedBody, mode: str = "torsional", free: bool = False, mesh_file: str | Path | None = None
) -> MovingSurface:
    """Moving surface of one oscillation in a mode, coloured by amplitude (largest 1).

    Raises ``InputError`` for a mode that does not exist, ``StoreError`` if the stored crankshaft is missing.

    Parameters
    ----------
    bare : bare crankshaft of the engine
    mode : number among the elastic modes, from 1 as ``modal`` lists them, or ``bending``, ``torsional``, ``axial`` for
        the first mode of this kind
    free : use the free crankshaft in place of the cranktrain at rest
    """
    complete = complete_crankshaft(engine, bare)
    if free:
        hz, shares, answers = free_modes(engine, complete)
        vectors = np.eye(complete.n_modes)[:, 6:]
    else:
        hz, shares, answers = cranktrain_modes(engine, complete)
        vectors = eigh(*cranktrain_matrices(engine, complete))[1][:, 1:]  # without mode 0, the rigid rotation
    number = chosen_mode(mode, hz, shares, answers, engine.reduction.running_cutoff_hz)
    skin = Skin.of(*crank_surface(engine, mesh_file))
    basis = np.eye(bare.n_modes) if complete.basis is None else complete.basis
    weights = (basis @ vectors[:, number])[: len(skin.modes)]
    displacement = np.tensordot(weights, skin.modes, axes=1)
    size = np.linalg.norm(displacement, axis=1)
    drawn = SHOWN_MOTION * float(np.ptp(skin.points, axis=0).max()) / size.max()
    cosine = np.cos(np.arange(FRAMES) * (2.0 * np.pi / FRAMES))
    kind = KINDS[int(np.argmax(shares[number]))]
    what = "free crankshaft" if free else "cranktrain at rest"
    share = ", ".join(f"{name} {100.0 * part:.0f} %" for name, part in zip(KINDS, shares[number], strict=True))
    return MovingSurface(
        title=f"{engine.title}: mode {number + 1} of the {what}, {kind}, {hz[number]:.1f} Hz",
        points=skin.points,
        triangles=skin.triangles,
        shapes=(drawn * displacement).astype(np.float32)[None],
        coordinates=cosine[:, None],
        turn=np.zeros(FRAMES),
        values=np.tile((size / size.max()).astype(np.float32), (FRAMES, 1)),
        quantity="amplitude, largest = 1",
        limits=(0.0, 1.0),
        scale="largest displacement drawn as 3 % of the length, times {:g}",
        captions=(f"kinetic energy: {share}",) * FRAMES,
    )


def chosen_mode(mode: str, hz: Array, shares: Array, answers: Array | None = None, sought_to: float = math.inf) -> int:
    """Index of the mode with a number or kind, among modes (k,) Hz with shares (k, 3); ``InputError``.

    The first torsional mode is searched up to ``sought_to`` Hz, by the pulley's ``answers`` (k,) if given.
    """
    highest = listed_to(named_frequencies(hz, shares, answers, sought_to).values())
    listed = int(np.count_nonzero(hz <= highest))
    if (number := whole_number(mode)) is not None:
        if not 1 <= number <= listed:
            raise InputError(f"--mode {mode} is not within 1 to {listed}, the elastic modes up to {highest:g} Hz")
        return number - 1
    if mode not in KINDS:
        raise InputError(f"--mode '{mode}' is neither a number nor a kind of mode; {nearest(mode, KINDS)}")
    if mode == "torsional":
        return int(np.argmin(np.abs(hz - first_torsional(hz, shares, sought_to, answers))))
    own = np.flatnonzero(np.argmax(shares[:listed], axis=1) == KINDS.index(mode))
    if not own.size:
        raise InputError(f"--mode {mode}: no mode up to {highest:g} Hz is mostly {mode}; name one by its number")
    return int(own[0])
