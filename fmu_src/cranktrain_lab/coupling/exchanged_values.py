"""Values of FMU variables that one FMI call sets or reads: scalars and, in FMI 3.0, whole arrays."""

import ctypes
from collections.abc import Iterator, Mapping, Sequence
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.reduced_body import Array


class Place(NamedTuple):
    """Location of a scalar, or of one element of an array.

    Attributes
    ----------
    reference, kind, variable, shape : value reference, type, name and shape of the variable; the shape of a scalar is
        empty
    number : index of the element, from 0 on
    """

    reference: int
    kind: str = "Real"
    variable: str = ""
    shape: tuple[int, ...] = ()
    number: int = 0

    @property
    def of_array(self) -> bool:
        """True if the variable is an array."""
        return bool(self.shape)

    @property
    def size(self) -> int:
        """Number of elements of the variable."""
        return prod(self.shape)


class ExchangedValues:
    """Buffer with the values of several variables, and the linked elements in it.

    Attributes
    ----------
    references, sizes : value reference (uint32) and number of elements of each variable
    values : values of all elements (m,)
    places : indices of the linked elements (k,) in ``values``
    names : names of the linked elements
    """

    def __init__(self, names: Sequence[str], linked: Sequence[Place], starts: Mapping[int, Sequence[float]]) -> None:
        """Make the buffer for the linked elements; ``starts`` are start values by reference, 0 where none is given."""
        sizes = {place.reference: place.size for place in linked}
        ends = np.cumsum([0, *sizes.values()], dtype=np.int64)
        firsts = dict(zip(sizes, ends.tolist(), strict=False))
        self.names = tuple(names)
        self.references: NDArray[np.uint32] = np.array(list(sizes), dtype=np.uint32)
        self.sizes = list(sizes.values())
        self.values: Array = np.zeros(ends[-1])
        for reference, first in firsts.items():
            given = starts.get(reference, ())
            self.values[first : first + len(given)] = given
        self.places = np.array([firsts[place.reference] + place.number for place in linked], dtype=np.int64)
        in_order = np.array_equal(self.places, np.arange(self.values.size))
        self._linked: Any = slice(None) if in_order else self.places

    @property
    def linked(self) -> Array:
        """Values of the linked elements (k,)."""
        found: Array = self.values[self._linked]
        return found

    @linked.setter
    def linked(self, values: Array) -> None:
        self.values[self._linked] = values

    def arguments(self, sized: bool) -> tuple[Any, ...]:
        """C arguments of a call for all variables; ``sized`` adds the number of values, as FMI 3.0 requires."""
        return _arguments(self.references, self.values, sized)

    def one_by_one(self, sized: bool) -> Iterator[tuple[str, tuple[Any, ...]]]:
        """Yield for each variable a text ``name = value, …`` and the C arguments of a call for this variable alone."""
        first = 0
        for k, size in enumerate(self.sizes):
            own = range(first, first + size)
            pairs = zip(self.names, self.places.tolist(), strict=True)
            text = ", ".join(f"{name} = {self.values[place]:g}" for name, place in pairs if place in own)
            yield text, _arguments(self.references[k : k + 1], self.values[first : first + size], sized)
            first += size


def _arguments(references: NDArray[np.uint32], values: Array, sized: bool) -> tuple[Any, ...]:
    of_references = references.ctypes.data_as(ctypes.POINTER(ctypes.c_uint32))
    of_values = values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
    size = (ctypes.c_size_t(values.size),) if sized else ()
    return of_references, ctypes.c_size_t(references.size), of_values, *size
