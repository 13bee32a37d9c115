"""Conversion of FMI 3.0 model descriptions to scalars: one variable per array element, types named as in FMI 2.0."""

import copy
from collections.abc import Mapping
from itertools import product
from math import prod
from typing import Any

from fmpy.model_description import ModelDescription, ModelVariable

from cranktrain.core.errors import InputError
from cranktrain_lab.coupling.exchanged_values import Place

MOST_ELEMENTS = 1_000_000
"""Limit of the number of array elements in a model description."""
OWN = "cranktrain"
"""Generation tool whose element names have the index after the first part (``cylinder[1].pressure``)."""
_INTEGERS = {f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)}


def flattened(description: ModelDescription) -> ModelDescription:
    """Return the description with scalars only; raises ``InputError`` for arrays that are too large."""
    flat = copy.copy(description)
    total = sum(prod(v.shape or ()) for v in description.modelVariables)
    if total > MOST_ELEMENTS:
        raise InputError(f"its arrays have {total} elements, more than {MOST_ELEMENTS}")
    own = (description.generationTool or "") == OWN
    by_name = {v.name: _elements(v, own) for v in description.modelVariables}
    flat.modelVariables = [one for elements in by_name.values() for one in elements]
    flat.outputs = []
    for unknown in description.outputs:
        for element in by_name[unknown.variable.name]:
            one = copy.copy(unknown)
            one.variable = element
            if unknown.dependencies is not None:
                one.dependencies = [e for v in unknown.dependencies for e in by_name[v.name]]
            flat.outputs.append(one)
    return flat


def places_of(description: ModelDescription) -> Mapping[str, Place]:
    """Return the location of each element of a flattened description, by name."""
    return {variable.name: variable.place for variable in description.modelVariables}


def _elements(variable: ModelVariable, own: bool) -> list[ModelVariable]:
    """Return the elements of a variable, each with its ``place``; a scalar has one."""
    shape = tuple(variable.shape or ())
    size = prod(shape)
    starts = _starts(variable, size)
    found = []
    for number, index in enumerate(product(*(range(1, n + 1) for n in shape))):
        one = _Element(variable, Place(variable.valueReference, variable.type, variable.name, shape, number))
        one.name = element_name(variable.name, index, own)
        one.type = "Real" if variable.type == "Float64" else "Integer" if variable.type in _INTEGERS else variable.type
        one.start = starts[number] if starts else None
        one.shape = ()
        found.append(one)
    return found


def element_name(array: str, index: tuple[int, ...], own: bool) -> str:
    """Return the name of an element: ``array[1,2]``, in own FMUs ``cylinder[1].pressure``, for a scalar ``array``."""
    if not index:
        return array
    number = f"[{','.join(map(str, index))}]"
    head, dot, tail = array.partition(".")
    return f"{head}{number}{dot}{tail}" if own and dot else array + number


def _starts(variable: ModelVariable, size: int) -> list[Any]:
    """Return the start values of a variable's elements; empty if the description has none."""
    start = variable.start
    if start is None:
        return []
    texts = [start] if variable.type in ("String", "Binary") or size == 1 else str(start).split()
    return texts * size if len(texts) == 1 else texts if len(texts) == size else []


def whole_numbers(kind: str) -> tuple[int, int]:
    """Least and largest number of an integer type: ``Int8`` to ``UInt64``, and ``Enumeration`` of 64 bits."""
    bits = int(kind.lstrip("UInt") or 64) if kind in _INTEGERS else 64
    return (0, (1 << bits) - 1) if kind.startswith("U") else (-(1 << bits - 1), (1 << bits - 1) - 1)


class _Element(ModelVariable):
    """Copy of a variable with its location, ``place``."""

    def __init__(self, variable: ModelVariable, place: Place) -> None:
        for name in (field.name for field in ModelVariable.__attrs_attrs__):
            setattr(self, name, getattr(variable, name))
        self.place = place
