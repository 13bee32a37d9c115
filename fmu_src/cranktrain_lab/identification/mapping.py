"""Space mapping: shift the parameters of a cheap model until its orders match the orders of an expensive model.

A bending crank on films has its torsional resonances up to an eighth higher or lower than a torsional crank. The
difference of their orders then cannot simply be added to the cheap model, because its peaks, and so its derivatives,
lie at other speeds. The cheap model is first shifted in u until its orders match those of the other model (space
mapping: Bandler et al., IEEE Trans. Microw. Theory Techn. 43, 1995). The remaining difference is added with its
derivatives, because damping of films and lateral motion of journals correspond to no parameter of the cheap model. The
derivatives take one run-up per parameter (approximations exact in value and slope: Alexandrov, Lewis, Optim. Eng. 2,
2001).
"""

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
from cranktrain_lab.identification.parameters import CRANK, SCALE, ZERO, inner_values, outer_values, sought_parameters
from cranktrain_lab.identification.tables import SoughtTable

ComplexArrays = Sequence[NDArray[np.complex128]]
REACH, LEAST, MOST = 5.0, 2e-3, 2e-2
"""Step in u for derivatives, in standard deviations of a parameter, and bounds of this step."""


def imitated(
    model: Answering, comparison: Comparison, inner: Array, orders: ComplexArrays, seed: int,
    start: Array | None = None, *, beside: bool = False,
) -> Array:  # fmt: skip
    """Return the u (p,) at which a model fits another model's orders (n,) at ``inner`` (p,), with the measured noise.

    The correction of the comparison is applied. Parameters that the orders do not determine stay at ``inner``. With
    ``beside`` the model's numbers and shapes at ``inner`` are fitted too, because both models give equal ones. The
    search has several starts unless ``start`` is given; ``KeyboardInterrupt`` if it is interrupted.
    """
    noises = {name: bias.noise for name, bias in comparison.biases.items()}  # empty before the first fit of a level
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
    """Torsional model with orders at shifted values of u; numbers and shapes are not shifted.

    The stiffness of the crank is shifted too, also if it is not sought. ``answer`` returns the other model's orders.
    """

    def __init__(self, model: TorsionalModel, answer: Callable[[Array], ComplexArrays]) -> None:
        self._own, self._free, self._answer = model, model, answer
        if all(one.key != CRANK for one in model.sought):
            stiffness = sought_parameters(model.engine, {CRANK: SoughtTable()}, [], 1.0)
            self._free = model.seeking((*model.sought, *stiffness))
        self.move: Array = np.zeros(len(self._free.sought))

    def answers(self, values: Array) -> Answers:
        """Return computed data for sought values (p,), SI; raises ``InputError``, ``SolverError``."""
        if not self.move.any():
            return self._own.answers(values)
        moved = self._free.answers(outer_values(self._free.sought, self._inner(values) + self.move))
        own = self._own.answers(values) if self._own.data.scalars or self._own.data.shapes else moved
        return replace(own, strands=moved.strands)

    def follow(self, comparison: Comparison, values: Array, orders: ComplexArrays, seed: int) -> Array:
        """Shift the model to match another model's orders at ``values`` (p,); return the change of the shift (p,)."""
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
        """Return derivatives (n, p) by u (p,) of the difference ``added`` between the other model's and own orders.

        Orbits after the orders get zero. ``spread`` (p,) are standard deviations of u. Derivatives are zero for a
        parameter at whose changed value the other model fails.
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
