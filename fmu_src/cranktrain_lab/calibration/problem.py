"""Calibration problem: engine as a function of free values, frequencies, targets, and deviations to minimise.

Targets without a number are matched with the lowest modes of the cranktrain, one to one, by the assignment of least
cost: squared deviations over tolerances, and the energy fraction that a mode lacks for the target's shape. An unmatched
mode below the last of these targets counts as an extra mode. Numbered torsional targets follow the definitions of
:mod:`cranktrain.structure.crank.modal`. Bending distributes the second torsion over neighbouring modes, so the search
uses their mean frequency around the target, weighted by the squared fractions of torsion.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError
from scipy.optimize import linear_sum_assignment

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.engine import values
from cranktrain.engine.model import Engine
from cranktrain.structure.crank.modal import KINDS, torsional_frequencies
from cranktrain_lab.calibration.targets import MOTION, STAND_INS, Parameter, Target, Task
from cranktrain_lab.calibration.train import Matrices, Modes, Train

NAME_MARGIN = 0.08
"""Energy fraction by which a mode's own kind must exceed every other kind. A deficit counts like a deviation."""
EXTRA_REACH = 0.05
"""Relative distance above the last target over which the weight of unmatched modes falls from 1 to 0."""
EXTRA_WEIGHT = 2.0
"""Penalty of an extra mode, in tolerances."""
BAND = 0.2
"""Half width of the frequency band for the mean second torsion, as a fraction of the target."""
LOST = 30.0
"""Deviation, in tolerances, of a mode that cannot be computed."""
MATCHED = 12
"""Number of lowest modes with which targets are matched."""


class Match(NamedTuple):
    """Computed modes matched with the targets.

    ``hz`` (t,) are frequencies, ``deviations`` (t,) those in tolerances for the search, ``places`` (t,) indices of
    modes in their list, ``extra`` frequencies of unmatched modes below the last target, ``penalties`` further residuals
    """

    hz: Array
    deviations: Array
    places: list[int]
    extra: list[float]
    penalties: Array


@dataclass(frozen=True)
class Problem:
    """Calibration problem: engine, fast matrices of its cranktrain, and task.

    ``dimensions`` are values that change the bodies, as in the bodies of ``train``. ``stand_ins`` are values of the
    block for formulas. ``held`` are values of the targets file that are no longer free.
    """

    engine: Engine
    train: Train
    task: Task
    dimensions: Mapping[str, float]
    stand_ins: Mapping[str, float]
    held: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def low(self) -> Array:
        """Lower bounds of the free values, SI."""
        return np.array([p.low for p in self.task.parameters])

    @cached_property
    def high(self) -> Array:
        """Upper bounds of the free values, SI."""
        return np.array([p.high for p in self.task.parameters])

    def given(self, free: Array) -> dict[str, float]:
        """Return all free and fixed values of the targets file by key."""
        return {**self.held, **{p.key: float(x) for p, x in zip(self.task.parameters, free, strict=True)}}

    def holding(self, held: Mapping[str, float]) -> "Problem":
        """Return the problem with some values fixed."""
        rest = tuple(p for p in self.task.parameters if p.key not in held)
        return replace(self, task=replace(self.task, parameters=rest), held=dict(held))

    def engine_of(self, free: Array) -> Engine:
        """Return the engine of free values (p,), SI, with all derived values."""
        return engine_with(self.engine, self.task, self.given(free), self.stand_ins)

    def matrices(self, free: Array) -> tuple[Engine, dict[str, Matrices]]:
        """Return the engine of free values, and matrices of the systems that have targets."""
        engine, given = self.engine_of(free), self.given(free)
        differences = {key: given[key] - start for key, start in self.dimensions.items()}
        found = {"cranktrain": self.train.cranktrain(engine, differences)}
        if any(target.of == "crankshaft" for target in self.task.targets):
            found["crankshaft"] = self.train.crankshaft(engine, differences)
        if self.task.moves:
            found[MOTION] = self.train.in_motion(engine, differences)
        return engine, found

    def modes(self, free: Array) -> dict[str, Modes]:
        """Return the modes of the systems that have targets."""
        engine, found = self.matrices(free)
        of = {
            "cranktrain": self.train.cranktrain_modes,
            "crankshaft": self.train.crankshaft_modes,
            MOTION: self.train.motion_modes,
        }
        return {name: of[name](engine, matrices) for name, matrices in found.items()}

    def residuals(self, free: Array) -> Array:
        """Return all residuals of the search, in tolerances."""
        try:
            found = match(self.task.targets, self.modes(free))
        except (LinAlgError, InputError):
            listed = sum(not target.number for target in self.task.targets)
            return np.full(len(self.task.targets) + (listed + 1 if listed else 0), LOST)
        return np.concatenate((found.deviations, found.penalties))


def engine_with(engine: Engine, task: Task, given: Mapping[str, float], stand_ins: Mapping[str, float]) -> Engine:
    """Return the engine with given and derived values; derived values that lack ``stand_ins`` are unchanged."""
    for key, number in given.items():
        if "." in key:
            engine = values.with_value(engine, key, number)
    names = {key: number for key, number in given.items() if "." not in key} | dict(stand_ins)
    for key, entry in task.derived.items():
        if all(name in names for name in STAND_INS if name in entry.formula):
            number = values.formula_value(entry.formula, engine, names, f"derived.{key}")
            # A value that differs only by rounding must not cause a new finite-element computation.
            if not values.holds(engine, key, number):
                engine = values.with_value(engine, key, number)
    return engine


def match(targets: tuple[Target, ...], modes: Mapping[str, Modes]) -> Match:
    """Match modes with targets."""
    hz, deviations, places = np.zeros(len(targets)), np.zeros(len(targets)), [0] * len(targets)
    listed = [k for k, target in enumerate(targets) if not target.number]
    penalties, extra = np.zeros(0), list[float]()
    if listed:
        train = modes["cranktrain"]
        count = min(max(MATCHED, len(listed)), len(train.hz))
        own = train.shares[:count, : len(KINDS)]
        own = own / own.sum(axis=1, keepdims=True)
        wanted = [targets[k] for k in listed]
        off = np.array([[(train.hz[i] / t.hz - 1.0) / t.tolerance for i in range(count)] for t in wanted])
        # By how much each mode fails to be of the target's kind, in margins.
        kinds = [KINDS.index(t.shape) for t in wanted]
        others = np.array([np.delete(own, kind, axis=1).max(axis=1) for kind in kinds])
        lack = np.maximum(0.0, others - own[:, kinds].T + NAME_MARGIN) / NAME_MARGIN
        rows, columns = linear_sum_assignment(off**2 + lack**2)
        for row, column in zip(rows, columns, strict=True):
            hz[listed[row]], deviations[listed[row]] = train.hz[column], off[row, column]
            places[listed[row]] = int(column)
        last = max(t.hz for t in wanted)
        left = [float(train.hz[i]) for i in range(count) if i not in columns]
        extra = [f for f in left if f < last]
        fade = [min(1.0, max(0.0, 1.0 - (f / last - 1.0) / EXTRA_REACH)) for f in left]
        penalties = np.append(lack[rows, columns], EXTRA_WEIGHT * np.sqrt(np.sum(np.square(fade))))
    for k, target in enumerate(targets):
        if target.number:
            found = modes[target.of]
            if target.of == MOTION:
                hz[k] = found.hz[0]
                deviations[k] = (hz[k] / target.hz - 1.0) / target.tolerance
                continue
            named = torsional_frequencies(found.hz, found.shares)[target.number - 1]
            if named is None:
                raise InputError(f"targets: no mode of the {target.of} is torsional mode {target.number}; leave it out")
            hz[k] = named
            places[k] = int(np.argmin(np.abs(found.hz - hz[k])))
            seen = hz[k]
            if target.number == 2:
                torsion = found.shares[:, KINDS.index("torsional")]
                weight = torsion**2 * (np.abs(found.hz / target.hz - 1.0) < BAND)
                seen = weight @ found.hz / weight.sum() if weight.sum() > 1e-6 else target.hz * (1.0 + BAND)
            deviations[k] = (seen / target.hz - 1.0) / target.tolerance
    return Match(hz, deviations, places, extra, penalties)


def sensitivities(problem: Problem, free: Array, modes: Mapping[str, Modes], places: list[int]) -> Array:
    """Return ∂ ln f / ∂ ln p (t, p) of targets: xᵀ (∂K/∂p − ω² ∂M/∂p) x p / (2 ω²), with modes x, xᵀ M x = 1.

    Derivatives of the matrices are central differences with a step of 1e-4 of the range between bounds.
    """
    targets = problem.task.targets
    result = np.zeros((len(targets), free.size))
    for j, step in enumerate(1e-4 * (problem.high - problem.low)):
        move = np.zeros(free.size)
        move[j] = step
        above, below = (problem.matrices(free + side * move)[1] for side in (1.0, -1.0))
        for k, target in enumerate(targets):
            if target.of == MOTION:
                pair = [problem.train.motion_modes(problem.engine, side[MOTION]).hz[0] for side in (above, below)]
                result[k, j] = math.log(pair[0] / pair[1]) / (2.0 * step) * free[j]
                continue
            x, hz = modes[target.of].modes[:, places[k]], modes[target.of].hz[places[k]]
            stiffness, mass = (a - b for a, b in zip(above[target.of][:2], below[target.of][:2], strict=True))
            omega2 = (2.0 * np.pi * hz) ** 2
            result[k, j] = x @ (stiffness - omega2 * mass) @ x / (2.0 * step) * free[j] / (2.0 * omega2)
    return result


def at_bounds(parameters: tuple[Parameter, ...], free: Array) -> list[str]:
    """Return keys of the values within a hundredth of a bound."""
    return [
        p.key for p, x in zip(parameters, free, strict=True) if min(x - p.low, p.high - x) < 0.01 * (p.high - p.low)
    ]
