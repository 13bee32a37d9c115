"""Extrapolation of exchanged values over the next step: polynomials in time, or in crank angle.

Degree 0 holds the newest value, 1 draws a line, 2 a parabola through the newest points. Over the crank angle the same
is done with the angle at the communication points as the abscissa. A unit that holds its inputs over a step gets the
polynomial's mean over the step; the error is then of the order of the step to the power of the degree plus one.

Extrapolation of a value that jumped overshoots: inputs stay within the bounds that they declare.
"""

import numpy as np

from cranktrain.core.reduced_body import Array

DEGREES = {"hold": 0, "linear": 1, "quadratic": 2}
"""Polynomial degree of each reconstruction, by name."""
POINTS = max(DEGREES.values()) + 1
"""Largest number of communication points that are stored."""


def weights_at(place: float, nodes: list[float]) -> list[float]:
    """Return Lagrange weights of the values at ``nodes`` for the polynomial's value at an abscissa."""
    found = []
    for i, node in enumerate(nodes):
        weight = 1.0
        for j, other in enumerate(nodes):
            if j != i:
                weight *= (place - other) / (node - other)
        found.append(weight)
    return found


def weights_of_mean(first: float, last: float, nodes: list[float]) -> list[float]:
    """Return weights of the values at up to three ``nodes`` for the polynomial's mean between two abscissae."""
    if len(nodes) == 1:
        return [1.0]
    # Simpson's rule is exact for parabolas.
    ends = (weights_at(first, nodes), weights_at(0.5 * (first + last), nodes), weights_at(last, nodes))
    return [(a + 4.0 * m + b) / 6.0 for a, m, b in zip(*ends, strict=True)]


class Samples:
    """Values (n,) at the last communication points, newest first, each with its abscissa."""

    def __init__(self, count: int) -> None:
        self.values = np.zeros((POINTS, count))
        self.places: list[float] = []

    def add(self, place: float, values: Array) -> None:
        """Add the values of a communication point."""
        self.values[1:] = self.values[:-1]
        self.values[0] = values
        self.stand(place)

    def stand(self, place: float) -> None:
        """Add the abscissa of the newest values. If it equals the last abscissa, earlier points are discarded."""
        if self.places and place == self.places[0]:
            self.places = []
        self.places = [place, *self.places[: POINTS - 1]]

    def at(self, place: float, degree: int) -> Array:
        """Return the n values of the polynomial at an abscissa, of a lower degree if there are too few points."""
        nodes = self.places[: degree + 1]
        return self._sum(weights_at(place, nodes))

    def mean(self, first: float, last: float, degree: int) -> Array:
        """Return the mean (n,) of the values' polynomial between two abscissae, possibly as a view of stored values."""
        if degree == 0:
            return self.values[0]
        nodes = self.places[: degree + 1]
        return self._sum(weights_of_mean(first, last, nodes))

    def weights_to(self, last: float, degree: int) -> list[float]:
        """Return weights for the mean from the newest point to ``last``: of the value at ``last``, then of points."""
        return [1.0] if degree == 0 else weights_of_mean(self.places[0], last, [last, *self.places[:degree]])

    def mean_to(self, last: float, new: Array, part: slice, degree: int) -> Array:
        """Return the mean of values ``part`` from the newest point to ``last``, with value ``new`` at ``last``."""
        if degree == 0:
            return new
        first, *others = self.weights_to(last, degree)
        found = first * new
        for k, weight in enumerate(others):
            found += weight * self.values[k, part]
        return np.asarray(found)

    def _sum(self, weights: list[float]) -> Array:
        """Return the weighted sum (n,) of the values of the newest points."""
        found = weights[0] * self.values[0]
        for k in range(1, len(weights)):
            found += weights[k] * self.values[k]
        return np.asarray(found)
