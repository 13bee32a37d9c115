"""Frequencies of the bending crank in its block on mounts, for measured files with [targets] or mount frequencies.

Orders and decays are computed with a torsional crank. Targets are modes of the cranktrain at rest, matched by their
shapes, as in a calibration (:mod:`cranktrain_lab.calibration.targets`). Frequencies of the engine as a whole on its
mounts are the lowest six of the cranktrain in its block, numbered from the lowest. Their computation takes some
milliseconds (:mod:`cranktrain_lab.calibration.train`), so every evaluation of an identification contains them, whatever
the level of the other sets.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, eigh

from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.types import Array, Progress
from cranktrain.engine.levels import BLOCKS
from cranktrain.engine.model import Engine
from cranktrain.structure.block.reduction import reduced_block
from cranktrain.structure.crank.reduction import reduced_crankshaft
from cranktrain_lab.calibration.problem import match
from cranktrain_lab.calibration.targets import MOTION, Target, target_of
from cranktrain_lab.calibration.train import Modes, Train
from cranktrain_lab.identification.data import MOUNTS, Scalar
from cranktrain_lab.identification.tables import MeasuredTable

RIGID_MODES = 6


def targets_of(read: MeasuredTable) -> tuple[Target, ...]:
    """Return [targets] of a measured file with other data; ``InputError`` for targets that need a calibration."""
    if read.derived:
        raise InputError("derived: applies only to files with [targets] alone; leave it out, or the measured sets")
    found = tuple(target_of(name, entry) for name, entry in read.targets.items())
    for one in found:
        if one.of == MOTION:
            raise InputError(
                f"targets.{one.name}: a frequency in motion is calibrated alone; give the critical speed as "
                "[[frequencies]] with order and rpm, or make a file of [targets] alone"
            )
    return found


class Bending:
    """Model of the bending crank, which keeps the bodies without attached parts.

    Parameters
    ----------
    engine : engine before the search
    read : measured file, with the level of the block
    scalars : all measured numbers
    say : called with each stage of making the bodies

    Raises
    ------
    InputError
        the engine lacks a block or mounts that the file requires
    """

    def __init__(self, engine: Engine, read: MeasuredTable, scalars: Sequence[Scalar], say: Progress) -> None:
        self.targets, self._mounts = targets_of(read), [one for one in scalars if one.kind == MOUNTS]
        if read.block not in BLOCKS:
            raise InputError(f"block: level '{read.block}' does not exist; the levels are {', '.join(BLOCKS)}")
        flexible = bool(self._mounts) or read.block != next(iter(BLOCKS))
        if flexible and (engine.block is None or engine.mounts is None):
            raise InputError(
                f"engine '{engine.name}' has no [block] with [mounts], of which the file gives frequencies; add the "
                "tables to the engine file"
            )
        plain = engine.without_additions
        block = reduced_block(plain, progress=say) if flexible else None
        self._train = Train(plain, reduced_crankshaft(plain, progress=say), block, {})
        self._last: tuple[Any, Array] | None = None

    def frequencies(self, engine: Engine) -> Array:
        """Return frequencies (Hz) of t targets and then of m mount modes, (t + m,); raises ``SolverError``."""
        # The damper's ring and torsional damping change none of these frequencies.
        key = replace(engine, damper=None, damping=replace(engine.damping, torsional_ratios=()))
        if self._last is None or self._last[0] != key:
            try:
                self._last = key, self._found(engine.without_additions)
            except (LinAlgError, InputError) as error:
                raise SolverError(f"the cranktrain that bends has no such modes: {error}") from None
        return self._last[1]

    def _found(self, engine: Engine) -> Array:
        train = self._train
        whole = train.cranktrain(engine, {})
        found = np.zeros(0)
        if self.targets:
            modes: dict[str, Modes] = {"cranktrain": train.cranktrain_modes(engine, whole)}
            if any(one.of == "crankshaft" for one in self.targets):
                modes["crankshaft"] = train.crankshaft_modes(engine, train.crankshaft(engine, {}))
            found = match(self.targets, modes).hz
        if not self._mounts:
            return found
        squares = eigh(*whole[:2], eigvals_only=True, subset_by_index=[1, RIGID_MODES])  # mode 0: the crank rotates
        hz = np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)
        return np.concatenate((found, hz[[one.number - 1 for one in self._mounts]]))
