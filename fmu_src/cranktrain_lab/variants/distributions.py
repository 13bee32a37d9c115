"""Distributions of varied values, defined by their quantile functions.

A point u of the unit interval becomes the value F⁻¹(u), so one design in the unit cube serves all distributions:

    uniform      low … high
    triangular   low … high, most likely at ``mode``
    normal       ``mean`` and standard ``deviation``; with ``low`` or ``high`` cut there
    lognormal    ``median``; 68 % lie between median / factor and median · factor, 1/ln(factor) being the shape
    values       one of several, all equally likely
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array

KINDS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "uniform": (("low", "high"), ()),
    "triangular": (("low", "high"), ("mode",)),
    "normal": (("deviation",), ("mean", "low", "high")),
    "lognormal": (("factor",), ("median",)),
    "values": (("values",), ()),
}
"""Names of the required and optional parameters of each distribution."""
LARGEST = 1e100
"""Largest magnitude of a distribution's parameters, so that differences and squares are finite."""
CENTRES = {"triangular": "mode", "normal": "mean", "lognormal": "median"}
"""Name of the parameter of each distribution that defaults to the engine's own value."""


@dataclass(frozen=True)
class Distribution:
    """Distribution of one varied value.

    Attributes
    ----------
    kind : one of :data:`KINDS`
    numbers : numbers in SI, by the names of :data:`KINDS`
    values : values of kind ``values``, in the given order
    """

    kind: str
    numbers: tuple[tuple[str, float], ...] = ()
    values: tuple[float, ...] = ()

    @property
    def ends(self) -> tuple[float, float]:
        """Least and largest value of the distribution; infinite if unbounded."""
        if self.kind == "values":
            return min(self.values), max(self.values)
        known = dict(self.numbers)
        least = 0.0 if self.kind == "lognormal" else -math.inf
        return known.get("low", least), known.get("high", math.inf)

    def quantile(self, share: Array) -> Array:
        """Return values at cumulative probabilities (n,) in [0, 1]."""
        share = np.asarray(share, dtype=float)
        if self.kind == "values":
            places = np.minimum((share * len(self.values)).astype(int), len(self.values) - 1)
            return np.array(self.values)[places]
        known = dict(self.numbers)
        if self.kind == "uniform":
            return np.asarray(known["low"] + share * (known["high"] - known["low"]))
        return np.asarray(_frozen(self.kind, known).ppf(share), dtype=float)

    def levels(self, count: int) -> Array:
        """Return ``count`` grid values: with both ends if the distribution is bounded, else of equal probability."""
        if self.kind == "values":
            return np.array(self.values)
        if count == 1:
            return self.quantile(np.array([0.5]))
        if self.kind == "uniform":
            return self.quantile(np.linspace(0.0, 1.0, count))
        return self.quantile((np.arange(count) + 0.5) / count)


def _frozen(kind: str, known: dict[str, float]) -> Any:
    """Return the distribution as a frozen SciPy distribution."""
    if kind == "triangular":
        width = known["high"] - known["low"]
        return stats.triang((known["mode"] - known["low"]) / width, known["low"], width)
    if kind == "normal":
        mean, deviation = known["mean"], known["deviation"]
        if "low" not in known and "high" not in known:
            return stats.norm(mean, deviation)
        cuts = [(known.get(end, far) - mean) / deviation for end, far in (("low", -math.inf), ("high", math.inf))]
        return stats.truncnorm(*cuts, loc=mean, scale=deviation)
    return stats.lognorm(math.log(known["factor"]), scale=known["median"])


def checked(kind: str, numbers: dict[str, float], values: tuple[float, ...], where: str) -> Distribution:
    """Return the distribution with these parameters (SI); the message of an ``InputError`` starts with ``where``."""
    for name, value in (*numbers.items(), *(("values", value) for value in values)):
        if not abs(value) < LARGEST:
            raise InputError(f"{where}: {name} {value:g} (SI) is no number of an engine; give one below {LARGEST:g}")
    low, high = numbers.get("low", -math.inf), numbers.get("high", math.inf)
    if not low < high:
        raise InputError(f"{where}: low {low:g} is not below high {high:g} (SI); exchange them")
    if kind == "triangular" and not low <= numbers["mode"] <= high:
        raise InputError(f"{where}: mode {numbers['mode']:g} is not within {low:g} to {high:g} (SI)")
    if kind == "normal" and not numbers["deviation"] > 0.0:
        raise InputError(f"{where}: deviation {numbers['deviation']:g} must be above 0; it is the standard deviation")
    if kind == "normal" and not (low < numbers["mean"] + 8.0 * numbers["deviation"] and
                                 high > numbers["mean"] - 8.0 * numbers["deviation"]):  # fmt: skip
        raise InputError(f"{where}: low and high are more than 8 deviations from the mean; nothing lies between them")
    if kind == "lognormal" and not (numbers["factor"] > 1.0 and numbers["median"] > 0.0):
        raise InputError(f"{where}: a lognormal value needs a median above 0 and a factor above 1, e.g. 1.1 for +-10 %")
    if kind == "values" and not values:
        raise InputError(f"{where}: no value in values; give at least one")
    return Distribution(kind, tuple(sorted(numbers.items())), values)
