"""A cheap model that answers as a dear one by standing elsewhere: what it finds of the other's orders.

A crank that bends on films has its torsional resonances up to an eighth higher or lower than one that twists. There the
difference of their orders cannot be added to the cheap one, since its peaks, and so its derivatives, lie at other
speeds. It is first moved in u to where its orders are those of the other model (space mapping: Bandler et al., IEEE
Trans. Microw. Theory Techn. 43, 1995). The difference that is left is added, with its derivatives: films damp and
journals move aside, and no value of the cheap model does so. The derivatives take one run-up for each parameter
(approximations that are exact in value and slope: Alexandrov, Lewis, Optim. Eng. 2, 2001).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import CranktrainError
from cranktrain.core.types import Array
from cranktrain_lab.identification.comparison import Answering, Comparison
from cranktrain_lab.identification.data import Data
from cranktrain_lab.identification.estimate import estimate
from cranktrain_lab.identification.model import Answers, TorsionalModel
from cranktrain_lab.identification.parameters import (
    CRANK,
    SCALE,
    ZERO,
    inner_values,
    outer_values,
    sought_parameters,
)
from cranktrain_lab.identification.tables import SoughtTable

ComplexArrays = Sequence[NDArray[np.complex128]]
REACH, LEAST, MOST = 5.0, 2e-3, 2e-2
"""Step in u of the derivatives: so many standard deviations of a parameter, within these bounds."""


def imitated(
    model: Answering, comparison: Comparison, inner: Array, orders: ComplexArrays, seed: int,
    start: Array | None = None, *, beside: bool = False,
) -> Array:  # fmt: skip
    """What a model finds, (p,) u, of another's orders (n,) at u (p,), which are as uncertain as the measured ones.

    The model answers with the correction of the comparison. What the orders do not determine stays at u. With
    ``beside`` numbers and shapes are data too, those of the model at u: both models answer them alike. The search has
    several starts unless one is given; ``KeyboardInterrupt`` where it is interrupted.
    """
    noises = {name: bias.noise for name, bias in comparison.biases.items()}  # none before the first fit of a level
    strands = tuple(
        replace(one, values=values, noise=np.where(np.isnan(one.noise), noises.get(one.name, np.nan), one.noise))
        for one, values in zip(comparison.data.strands, orders, strict=False)
    )
    data = Data(strands)
    if beside and (comparison.data.scalars or comparison.data.shapes):
        own = model.answers(outer_values(comparison.sought, inner))
        numbers = zip(comparison.data.scalars, own.scalars.tolist(), strict=True)
        shapes = zip(comparison.data.shapes, own.shapes, strict=True)
        data = Data(
            strands, tuple(replace(one, value=value) for one, value in numbers),
            tuple(replace(one, values=values) for one, values in shapes),
        )  # fmt: skip
    found = estimate(comparison.about(model, data, inner), seed, start=start)
    if found.interrupted:
        raise KeyboardInterrupt
    return found.inner


class Mapped:
    """A torsional model whose orders are those at values moved in u; numbers and shapes are its own.

    The stiffness of the crank moves as well if it is not sought. ``answer`` gives the orders of the other model.
    """

    def __init__(self, model: TorsionalModel, answer: Callable[[Array], ComplexArrays]) -> None:
        self._own, self._free, self._answer = model, model, answer
        if all(one.key != CRANK for one in model.sought):
            stiffness = sought_parameters(model.engine, {CRANK: SoughtTable()}, [], 1.0)
            self._free = model.seeking((*model.sought, *stiffness))
        self.move: Array = np.zeros(len(self._free.sought))

    def answers(self, values: Array) -> Answers:
        """Answers for sought values (p,), SI; ``InputError``, ``SolverError``."""
        if not self.move.any():
            return self._own.answers(values)
        moved = self._free.answers(outer_values(self._free.sought, self._inner(values) + self.move))
        own = self._own.answers(values) if self._own.data.scalars or self._own.data.shapes else moved
        return replace(own, strands=moved.strands)

    def follow(self, comparison: Comparison, values: Array, orders: ComplexArrays, seed: int) -> Array:
        """Move to where the orders are nearest to another model's at ``values`` (p,); the change of the move (p,)."""
        free, inner = self._free, self._inner(values)
        about = Comparison(free, free.data, free.sought)
        about.biases = comparison.biases
        first = not self.move.any()
        there = imitated(free, about, inner, orders, seed, None if first else inner + self.move)
        before, self.move = self.move, there - inner
        return (self.move - before)[: values.size]

    def slopes(
        self, comparison: Comparison, inner: Array, added: ComplexArrays, spread: Array
    ) -> tuple[NDArray[np.complex128], ...]:
        """Derivatives (n, p) by u of the other model's orders less one's own, which are ``added`` at u (p,).

        Orbits behind the orders have none. ``spread`` (p,) are standard deviations of u. A parameter whose change the
        other model does not answer keeps the derivatives of this one.
        """
        count, found = len(self._own.data.strands), [np.zeros((own.size, inner.size), complex) for own in added]
        for k, one in enumerate(comparison.sought):
            if one.key.partition(".")[0] in (ZERO, SCALE):
                continue
            low, high = comparison.low[k], comparison.high[k]
            side = 1.0 if high - inner[k] >= inner[k] - low else -1.0
            point = inner.copy()
            point[k] += side * min(max(REACH * spread[k], LEAST), MOST, 0.5 * (high - low))
            values = outer_values(comparison.sought, point)
            try:
                above, own = self._answer(values), self.answers(values).strands
            except CranktrainError:
                continue
            for slopes, a, b, at in zip(found[:count], above, own, added, strict=False):
                slopes[:, k] = (a - b - at) / (point[k] - inner[k])
        return tuple(found)

    def _inner(self, values: Array) -> Array:
        own = inner_values(self._own.sought, values.tolist())
        return np.append(own, np.zeros(self.move.size - own.size))
