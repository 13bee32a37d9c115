"""Array of an output's values with name and unit, and conversion to other units."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.units import base_powers, unit_factor


class Series(np.ndarray):
    """Values of a run's output: a NumPy array with name and unit.

    Slices and copies keep the unit. Results of arithmetic are plain arrays, because their unit may be different.

    Attributes
    ----------
    unit : unit of the values, such as ``rad``; empty if it is not known
    name : name of the output
    """

    unit: str
    name: str

    def __new__(cls, values: Any, unit: str = "", name: str = "") -> "Series":
        """Make a view of an array, without a copy."""
        made = np.asarray(values).view(cls)
        made.unit, made.name = unit, name
        return made

    def __array_finalize__(self, source: Any) -> None:
        self.unit, self.name = getattr(source, "unit", ""), getattr(source, "name", "")

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, out: Any = None, **options: Any) -> Any:
        """Apply arithmetic to the plain arrays."""
        if out is not None:
            options["out"] = tuple(_plain(one) for one in out)
        found = getattr(ufunc, method)(*map(_plain, inputs), **options)
        return out[0] if out is not None and len(out) == 1 else found

    def __reduce__(self) -> Any:
        """Pickle the array with name and unit."""
        return Series, (_plain(self), self.unit, self.name)

    def __repr__(self) -> str:
        texts = np.array2string(_plain(self), threshold=8, edgeitems=3, precision=5)
        return f"{self.name or 'values'} / {self.unit or 'no unit'}: {texts}"

    def to(self, unit: str) -> "Series":
        """Convert the values to another unit, such as ``run["pulley.torsion"].to("deg")``.

        Raises ``InputError`` for a unit that is unknown or of another dimension.
        """
        if not self.unit:
            raise InputError(f"{self.name or 'values'}: no unit is known; multiply by the factor that you need")
        own, wanted = unit_factor(self.unit), unit_factor(str(unit))
        if own.si != wanted.si and base_powers(own.si) != base_powers(wanted.si):
            raise InputError(f"'{self.name or 'values'}' is in {self.unit}, and unit '{unit}' measures something else")
        return Series((_plain(self) * own.scale + (own.zero - wanted.zero)) / wanted.scale, unit, self.name)


def _plain(value: Any) -> Any:
    """Convert a series to a plain array; other values are returned unchanged."""
    if not isinstance(value, Series):
        return value
    found: NDArray[Any] = value.view(np.ndarray)
    return found
