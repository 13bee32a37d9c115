"""Data beside the model's answers: residuals, their covariance, and derivatives by the sought parameters.

Residuals are measured minus computed: real and imaginary part of each order, or its amplitude alone; logarithms of
frequencies and damping ratios; components of shapes of unit length. Parameters are coordinates u of
:mod:`cranktrain_lab.identification.parameters`. Each set has a covariance C, so that with the Cholesky factor of C
all residuals count alike, and what is known before adds a row (u − u₀)/σ for each parameter with a prior. An order that
a toothed wheel measured has an unknown constant, which is eliminated
(:mod:`cranktrain_lab.identification.wheel_constants`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, solve_triangular

from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.types import Array
from cranktrain_lab.identification.bias import Bias, Residue, covariance, estimated_bias, first_bias
from cranktrain_lab.identification.data import Data
from cranktrain_lab.identification.model import Answers
from cranktrain_lab.identification.parameters import Sought, inner_values, outer_values
from cranktrain_lab.identification.wheel_constants import (
    WIDE,
    Constant,
    FoundConstant,
    beside_slopes,
    by_constant,
)

STEP = 1e-3
"""Step in u of the derivatives: a thousandth of a parameter."""
LOST = 1e3
"""Residual, in standard deviations, where the model has no answer."""


class Answering(Protocol):
    """What answers for sought values (p,), SI."""

    def answers(self, values: Array) -> Answers:
        """Answers beside the data."""


class Correction(NamedTuple):
    """What a higher level adds to the model's orders, linear in u: ``values`` at ``inner``, with their derivatives.

    Attributes
    ----------
    values : complex orders (n,) of each strand
    inner : (p,) u at which they are added
    slopes : derivatives (n, p) of each strand by u; none where the model's own are those of the level
    """

    values: tuple[NDArray[np.complex128], ...]
    inner: Array
    slopes: tuple[NDArray[np.complex128], ...] = ()

    def at(self, inner: Array) -> tuple[NDArray[np.complex128], ...]:
        """What is added (n,) to each strand at u (p,)."""
        if not self.slopes:
            return self.values
        move = inner - self.inner
        return tuple(own + by @ move for own, by in zip(self.values, self.slopes, strict=True))

    def first(self, count: int) -> Correction:
        """The same of the first ``count`` strands."""
        return Correction(self.values[:count], self.inner, self.slopes[:count])


class Piece(NamedTuple):
    """Residuals of one order, number or shape: set, rows (n, c) fitted and held out, and their derivatives (…, p).

    ``constant`` is that of a wheel, subtracted from the rows; None where the order has none, or still has it.
    """

    name: str
    rows: Array
    slopes: Array
    held: NDArray[np.bool_]
    constant: FoundConstant | None = None


class Comparison:
    """Data and model of an identification.

    Parameters
    ----------
    model, data, sought : what answers, what was measured, what is sought

    Attributes
    ----------
    biases : set → numbers of its covariance
    correction : what a higher level adds to the model's orders
    """

    def __init__(self, model: Answering, data: Data, sought: Sequence[Sought]) -> None:
        self.model, self.data, self.sought = model, data, tuple(sought)
        self.correction: Correction | None = None
        self.biases: dict[str, Bias] = {}
        self._factors: list[Array] = []
        self._turns: list[NDArray[np.complex128]] = []
        self._constants: list[Constant | None] = []
        self._start = inner_values(sought, [one.start for one in sought])
        self.low: Array = inner_values(sought, [one.low for one in sought])
        self.high: Array = inner_values(sought, [one.high for one in sought])
        self._prior: Array = np.array([1.0 / one.prior_inner for one in sought])

    def take(self, model: Answering, data: Data) -> None:
        """Compare another model and data, whose covariances are found anew."""
        self.model, self.data, self.correction, self.biases = model, data, None, {}

    def about(self, model: Answering, data: Data, inner: Array) -> Comparison:
        """Comparison of a model with other orders near u (p,), with bounds half as far again.

        What the orders do not determine stays at u.
        """
        other = Comparison(model, data, self.sought)
        far = 0.5 * (other.high - other.low)
        other._start, other.low, other.high = inner, other.low - far, other.high + far
        other._prior = np.sqrt(12.0) / (other.high - other.low)
        other.correction = None if self.correction is None else self.correction.first(len(data.strands))
        return other

    @property
    def start(self) -> Array:
        """Coordinates (p,) from which the search starts."""
        return self._start

    @property
    def prior(self) -> Array:
        """Information (p, p) that the file's priors give."""
        return np.diag(self._prior**2)

    @property
    def known(self) -> Array:
        """Information (p, p) that the priors and the bounds give, bounds as a uniform distribution between them."""
        return self.prior + np.diag(12.0 / (self.high - self.low) ** 2)

    def answers(self, inner: Array) -> Answers:
        """Answers with the correction of a higher level; ``InputError``, ``SolverError``."""
        found = self.model.answers(outer_values(self.sought, inner))
        if self.correction is None:
            return found
        strands = tuple(a + b for a, b in zip(found.strands, self.correction.at(inner), strict=True))
        return Answers(strands, found.scalars, found.shapes)

    def rows(self, inner: Array) -> list[Array]:
        """Residuals (n, c) of each order, held out ones too, then of the numbers (n, 1) and of the shapes (n, 1)."""
        found, rows = self.answers(inner), list[Array]()
        for one, own in zip(self.data.strands, found.strands, strict=True):
            if one.phases:
                away = one.values - own
                rows.append(np.stack((away.real, away.imag), axis=1))
            else:
                rows.append((np.abs(one.values) - np.abs(own))[:, None])
        for k, scalar in enumerate(self.data.scalars):
            rows.append(np.array([[np.log(scalar.value / found.scalars[k])]]))
        rows += [(shape.values - own)[:, None] for shape, own in zip(self.data.shapes, found.shapes, strict=True)]
        return rows

    def own(self, inner: Array) -> list[NDArray[np.complex128]]:
        """The model's amplitudes (n,) beside each order."""
        return list(self.answers(inner).strands)

    def weigh(self, biases: dict[str, Bias], own: Sequence[NDArray[np.complex128]]) -> None:
        """Take a covariance for each set, with the model's ``own`` orders (n,)."""
        self.biases, self._factors, self._turns = dict(biases), [], [_turn(one) for one in own]
        self._constants = []
        for k, one in enumerate(self.data.strands):
            keep = np.flatnonzero(~one.held)
            self._factors.append(
                np.asarray(np.linalg.cholesky(self.covariance_of(k, np.abs(own[k]))[np.ix_(keep, keep)]))
            )
            by = by_constant(one, self._turns[k])
            columns = self._white(k, by)
            self._constants.append(Constant(by, columns, np.asarray(np.linalg.pinv(columns))) if one.wheel else None)

    def covariance_of(self, k: int, sizes: Array) -> Array:
        """Covariance (n, n) of one component of the ``k``-th order, with the model's amplitudes ``sizes`` (n,)."""
        one = self.data.strands[k]
        place = sum(other.name == one.name for other in self.data.strands[:k])
        return covariance(one.speeds, sizes, one.noise, self.biases[one.name].of(place))

    def first_biases(self, own: Sequence[NDArray[np.complex128]]) -> dict[str, Bias]:
        """Covariances before anything is fitted: a tenth of the amplitudes."""
        return {name: first_bias([self._residue(k, own[k]) for k in which]) for name, which in self._sets().items()}

    def found_biases(self, pieces: Sequence[Piece], own: Sequence[NDArray[np.complex128]]) -> dict[str, Bias]:
        """Covariances by the restricted likelihood of each set."""
        found = {}
        for name, which in self._sets().items():
            columns = [self._column(k, own[k]) for k in which]
            slopes, known = beside_slopes([pieces[k].slopes for k in which], columns, self.known)
            parts = [
                self._residue(k, own[k], pieces[k]._replace(slopes=one)) for k, one in zip(which, slopes, strict=True)
            ]
            found[name] = estimated_bias(parts, known, self.biases.get(name))
        return found

    def _column(self, k: int, own: NDArray[np.complex128]) -> Array | None:
        """Derivatives (n, c, 2) of the ``k``-th order by its constant over the constant's standard deviation."""
        one = self.data.strands[k]
        return WIDE * float(np.abs(one.values).max()) * by_constant(one, _turn(own)) if one.wheel else None

    def _sets(self) -> dict[str, list[int]]:
        found: dict[str, list[int]] = {}
        for k, one in enumerate(self.data.strands):
            found.setdefault(one.name, []).append(k)
        return found

    def _residue(self, k: int, own: NDArray[np.complex128], piece: Piece | None = None) -> Residue:
        one = self.data.strands[k]
        keep = ~one.held
        rows = slopes = np.zeros((int(keep.sum()), 1, 1))
        if piece is not None:
            turn = _turn(own)[keep]
            rows, slopes = _turned(piece.rows[keep], turn), _turned(piece.slopes[keep], turn)
        return Residue(one.speeds[keep], np.abs(own)[keep], one.noise[keep], rows.reshape(rows.shape[:2]), slopes)

    def whitened(self, blocks: Sequence[Array]) -> list[Array]:
        """Blocks (n, c, …) of the fitted rows over their standard deviations, (n·c, …) each."""
        found = []
        for k, block in enumerate(blocks):
            if k < len(self.data.strands):
                white, constant = self._white(k, block), self._constants[k]
                found.append(white if constant is None else constant.left(white))
                continue
            own = self.data.deviations[k - len(self.data.strands)]
            found.append(block.reshape(-1, *block.shape[2:]) / own)
        return found

    def _white(self, k: int, block: Array) -> Array:
        """Block (n, c, …) of the ``k``-th order's fitted rows over their standard deviations, (n·c, …)."""
        keep = ~self.data.strands[k].held
        flat = _turned(block[keep], self._turns[k][keep]).reshape(int(keep.sum()), -1)
        return np.asarray(solve_triangular(self._factors[k], flat, lower=True).reshape(-1, *block.shape[2:]))

    def cleared(self, pieces: Sequence[Piece]) -> list[Piece]:
        """Pieces less the constants of wheels; derivatives are those of the model with the constants that it gives."""
        found = list(pieces)
        for k, constant in enumerate(self._constants):
            if constant is None:
                continue
            value, slopes = (constant.of(self._white(k, block)) for block in (pieces[k].rows, pieces[k].slopes))
            found[k] = pieces[k]._replace(
                rows=pieces[k].rows - np.tensordot(constant.by, value, axes=1),
                slopes=pieces[k].slopes - np.tensordot(constant.by, slopes, axes=1),
                constant=FoundConstant(value, -slopes, constant.inverse @ constant.inverse.T, constant.by),
            )
        return found

    def residuals(self, inner: Array) -> Array:
        """All residuals (m,) in standard deviations; those of priors last."""
        before = (inner - self._start) * self._prior
        try:
            rows = np.concatenate(self.whitened(self.rows(inner)))
        except (InputError, SolverError, LinAlgError, ArithmeticError):
            rows = np.full(self.count, LOST)
        rows = np.where(np.isfinite(rows), rows, LOST)
        return np.concatenate((rows, before[self._prior > 0.0]))

    @property
    def count(self) -> int:
        """Number of fitted residuals."""
        orders = sum(int((~one.held).sum()) * (2 if one.phases else 1) for one in self.data.strands)
        return orders + len(self.data.scalars) + sum(one.values.size for one in self.data.shapes)

    @property
    def constants(self) -> int:
        """Number of real unknowns that constants of wheels add."""
        return sum(2 for one in self.data.strands if one.wheel)

    def pieces(self, inner: Array) -> list[Piece]:
        """Residuals at u (p,) with their derivatives by central differences."""
        rows = self.rows(inner)
        slopes = [np.zeros((*row.shape, inner.size)) for row in rows]
        for k in range(inner.size):
            move = np.zeros(inner.size)
            move[k] = STEP
            ends = [np.clip(inner + side * move, self.low, self.high) for side in (1.0, -1.0)]
            above, below = (self.rows(end) for end in ends)
            for slope, a, b in zip(slopes, above, below, strict=True):
                slope[..., k] = (b - a) / (ends[0][k] - ends[1][k])  # of the model, not of the residual
        names = self.data.of_pieces
        held = [one.held for one in self.data.strands]
        held += [np.zeros(row.shape[0], dtype=bool) for row in rows[len(held) :]]
        return [Piece(*all_of) for all_of in zip(names, rows, slopes, held, strict=True)]


def _turn(own: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Factors (n,) that turn residuals into the phase of the model's orders (n,)."""
    size = np.abs(own)
    return np.asarray(np.where(size > 0.0, np.conj(own) / np.where(size > 0.0, size, 1.0), 1.0))


def _turned(block: Array, turn: NDArray[np.complex128]) -> Array:
    """Residuals or derivatives (n, c, …) turned by factors (n,); those of amplitudes alone, c = 1, stay."""
    if block.shape[1] == 1:
        return block
    shape = (-1, *(1 for _ in block.shape[2:]))
    re, im = turn.real.reshape(shape), turn.imag.reshape(shape)
    return np.stack((re * block[:, 0] - im * block[:, 1], im * block[:, 0] + re * block[:, 1]), axis=1)
