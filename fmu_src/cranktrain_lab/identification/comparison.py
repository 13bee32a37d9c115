"""Comparison of data and model: residuals, their covariance, and derivatives by the sought parameters.

Residuals are measured minus computed: real and imaginary part of each order, or its amplitude alone; logarithms of
frequencies and damping ratios; components of shapes of unit length. Parameters are coordinates u of
:mod:`cranktrain_lab.identification.parameters`. Each set has a covariance C, whose Cholesky factor gives all residuals
unit variance. Each parameter with a prior adds a row (u − u₀)/σ. An order measured with a toothed wheel has an unknown
constant, which is eliminated
(:mod:`cranktrain_lab.identification.wheel_constants`).
"""

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
from cranktrain_lab.identification.wheel_constants import WIDE, Constant, FoundConstant, beside_slopes, by_constant

STEP = 1e-3
"""Step in the search coordinate u of a parameter for derivatives, about a thousandth of the parameter."""
LOST = 1e3
"""Residual, in standard deviations, that is used where the model cannot be evaluated."""


class Answering(Protocol):
    """Model that computes the data for values (p,), SI, of the p sought parameters."""

    def answers(self, values: Array) -> Answers:
        """Return the computed counterparts of all measured data."""


class Correction(NamedTuple):
    """Correction of the model's orders by a higher level, linear in the search coordinates u of the parameters.

    Attributes
    ----------
    values : complex amplitudes (n,) to add to each strand
    inner : (p,) u of these values
    slopes : derivatives (n, p) of each strand's values by u; empty for a constant correction
    """

    values: tuple[NDArray[np.complex128], ...]
    inner: Array
    slopes: tuple[NDArray[np.complex128], ...] = ()

    def at(self, inner: Array) -> tuple[NDArray[np.complex128], ...]:
        """Return the correction (n,) of each measured order at search coordinates u (p,)."""
        if not self.slopes:
            return self.values
        move = inner - self.inner
        return tuple(own + by @ move for own, by in zip(self.values, self.slopes, strict=True))

    def first(self, count: int) -> "Correction":
        """Return the correction of the first ``count`` measured orders."""
        return Correction(self.values[:count], self.inner, self.slopes[:count])


class Piece(NamedTuple):
    """Residuals of one order, number or shape at n points with c components, and derivatives by p parameters.

    ``constant`` is the constant of a wheel that was subtracted from the rows; None if nothing was subtracted.
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
    model, data, sought : model, measured data, and sought parameters

    Attributes
    ----------
    start, low, high : coordinates u (p,) of the p parameters at which the search starts, and their bounds
    biases : set → covariance parameters
    correction : correction of the model's orders by a higher level
    """

    def __init__(self, model: Answering, data: Data, sought: Sequence[Sought]) -> None:
        self.model, self.data, self.sought = model, data, tuple(sought)
        self.correction: Correction | None = None
        self.biases: dict[str, Bias] = {}
        self._factors: list[Array] = []
        self._turns: list[NDArray[np.complex128]] = []
        self._constants: list[Constant | None] = []
        self.start: Array = inner_values(sought, [one.start for one in sought])
        self.low: Array = inner_values(sought, [one.low for one in sought])
        self.high: Array = inner_values(sought, [one.high for one in sought])
        self._prior: Array = np.array([1.0 / one.prior_inner for one in sought])

    def take(self, model: Answering, data: Data) -> None:
        """Replace model and data. The covariances of their residuals are estimated anew."""
        self.model, self.data, self.correction, self.biases = model, data, None, {}

    def about(self, model: Answering, data: Data, inner: Array) -> "Comparison":
        """Return a comparison of a model with other orders near coordinates u (p,), with bounds half their range wider.

        Parameters that the orders do not determine stay at u.
        """
        other = Comparison(model, data, self.sought)
        far = 0.5 * (other.high - other.low)
        other.start, other.low, other.high = inner, other.low - far, other.high + far
        other._prior = np.sqrt(12.0) / (other.high - other.low)
        other.correction = None if self.correction is None else self.correction.first(len(data.strands))
        return other

    @property
    def prior(self) -> Array:
        """Information matrix (p, p) of the p parameters from the priors of the measured file."""
        return np.diag(self._prior**2)

    @property
    def known(self) -> Array:
        """Information matrix (p, p) of the p parameters from priors and bounds (as uniform distributions)."""
        return self.prior + np.diag(12.0 / (self.high - self.low) ** 2)

    def answers(self, inner: Array) -> Answers:
        """Return the model's data with the correction of a higher level; raises ``InputError``, ``SolverError``."""
        found = self.model.answers(outer_values(self.sought, inner))
        if self.correction is None:
            return found
        strands = tuple(a + b for a, b in zip(found.strands, self.correction.at(inner), strict=True))
        return Answers(strands, found.scalars, found.shapes)

    def rows(self, inner: Array) -> list[Array]:
        """Return residuals (points, components) of each order with held-out points, then of numbers and mode shapes."""
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
        """Return the model's complex amplitudes (n,) of each measured order at the order's n speeds."""
        return list(self.answers(inner).strands)

    def weigh(self, biases: dict[str, Bias], own: Sequence[NDArray[np.complex128]]) -> None:
        """Set the residuals' covariance of each data set from its parameters and from the model's ``own`` orders."""
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
        """Return the covariance (n, n) of one component of the ``k``-th order; ``sizes`` (n,) are model amplitudes."""
        one = self.data.strands[k]
        place = sum(other.name == one.name for other in self.data.strands[:k])
        return covariance(one.speeds, sizes, one.noise, self.biases[one.name].of(place))

    def first_biases(self, own: Sequence[NDArray[np.complex128]]) -> dict[str, Bias]:
        """Return covariance parameters before the first fit, with a bias of a tenth of the amplitudes."""
        return {name: first_bias([self._residue(k, own[k]) for k in which]) for name, which in self._sets().items()}

    def found_biases(self, pieces: Sequence[Piece], own: Sequence[NDArray[np.complex128]]) -> dict[str, Bias]:
        """Estimate covariance parameters of each set by the restricted likelihood."""
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
        """Return derivatives (n, c, 2) of the ``k``-th order by its wheel constant in standard deviations, or None."""
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
        """Return the fitted rows of blocks (points, components, …), flattened, whitened and without wheel constants."""
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
        """Return the fitted rows of a block (points, components, …) of the ``k``-th order, flattened and whitened."""
        keep = ~self.data.strands[k].held
        flat = _turned(block[keep], self._turns[k][keep]).reshape(int(keep.sum()), -1)
        return np.asarray(solve_triangular(self._factors[k], flat, lower=True).reshape(-1, *block.shape[2:]))

    def cleared(self, pieces: Sequence[Piece]) -> list[Piece]:
        """Return residuals minus the constants of toothed wheels; derivatives include the constants' change with u."""
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
        """Return all residuals (m,) in standard deviations, with residuals of the priors last."""
        before = (inner - self.start) * self._prior
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
        """Number of real unknowns in the constants of wheels."""
        return sum(2 for one in self.data.strands if one.wheel)

    def pieces(self, inner: Array) -> list[Piece]:
        """Return residuals at search coordinates u (p,), with derivatives by central differences."""
        rows = self.rows(inner)
        slopes = [np.zeros((*row.shape, inner.size)) for row in rows]
        for k in range(inner.size):
            move = np.zeros(inner.size)
            move[k] = STEP
            ends = [np.clip(inner + side * move, self.low, self.high) for side in (1.0, -1.0)]
            above, below = (self.rows(end) for end in ends)
            for slope, a, b in zip(slopes, above, below, strict=True):
                slope[..., k] = (b - a) / (ends[0][k] - ends[1][k])  # derivative of the model, not of the residual
        names = self.data.of_pieces
        held = [one.held for one in self.data.strands]
        held += [np.zeros(row.shape[0], dtype=bool) for row in rows[len(held) :]]
        return [Piece(*all_of) for all_of in zip(names, rows, slopes, held, strict=True)]


def _turn(own: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return complex factors (n,) that rotate residuals at n speeds into the phase of the model's order."""
    size = np.abs(own)
    return np.asarray(np.where(size > 0.0, np.conj(own) / np.where(size > 0.0, size, 1.0), 1.0))


def _turned(block: Array, turn: NDArray[np.complex128]) -> Array:
    """Return residuals or derivatives at n speeds rotated by factors (n,); amplitudes without phase are unchanged."""
    if block.shape[1] == 1:
        return block
    shape = (-1, *(1 for _ in block.shape[2:]))
    re, im = turn.real.reshape(shape), turn.imag.reshape(shape)
    return np.stack((re * block[:, 0] - im * block[:, 1], im * block[:, 0] + re * block[:, 1]), axis=1)
