"""FMI 3.0 variables in an SSP: connections of whole arrays, and parameters with types and dimensions of SSP 2.0.

Source: System Structure and Parameterization 2.0 (Modelica Association, 2024), sections 4 (dimensions), 5 (connectors,
connections) and 6 (parameters).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import prod
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element, SubElement

from cranktrain.core.errors import InputError
from cranktrain_lab.coupling.connections import Connection
from cranktrain_lab.coupling.fmu3_unit import Fmu3Unit
from cranktrain_lab.coupling.unit import Unit

SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
_TEXTS = ("String", "Enumeration")
"""Types whose arrays are written with one XML element per value."""


class Variable(NamedTuple):
    """Variable with its name in the FMU, type in SSP, and shape (empty for a scalar)."""

    name: str
    kind: str
    shape: tuple[int, ...]


def variable_of(unit: Unit, name: str) -> tuple[Variable, int]:
    """Return the variable that contains ``name`` of a unit, and the index of its element, from 0 on."""
    if not isinstance(unit, Fmu3Unit):
        return Variable(name, "Real", ()), 0
    place = unit.places[name]
    return Variable(place.variable, place.kind, place.shape), place.number


def whole_connections(units: Mapping[str, Unit], connections: Sequence[Connection]) -> list[Connection]:
    """Replace the connections of array elements by connections of whole variables, in order.

    ``InputError`` if arrays are not connected as a whole, element by element to arrays of the same shape. SSP 2.0 does
    not state whether element numbers begin with 0 or 1, so single elements cannot be connected.
    """
    groups: dict[tuple[tuple[str, str], tuple[str, str]], list[tuple[int, int]]] = {}
    found: list[Connection] = []
    for link in connections:
        (source, i), (target, k) = (variable_of(units[unit], name) for unit, name in (link.source, link.target))
        ends = (link.source[0], source.name), (link.target[0], target.name)
        if ends not in groups:
            found.append(replace(link, source=ends[0], target=ends[1]))
        groups.setdefault(ends, []).append((i, k))
        if source.shape != target.shape:
            raise _refused(link)
    for link in connections:
        (source, _), (target, _) = (variable_of(units[unit], name) for unit, name in (link.source, link.target))
        pairs = groups[(link.source[0], source.name), (link.target[0], target.name)]
        if sorted(pairs) != [(k, k) for k in range(prod(source.shape))]:
            raise _refused(link)
    return found


def _refused(link: Connection) -> InputError:
    return InputError(
        f"{link.text}: an SSP connects arrays of FMI 3.0 whole, element by element to arrays of the same size; connect "
        "all elements in order, or take FMUs of FMI 2.0 alone"
    )


def add_dimensions(element: Element, shape: Sequence[int]) -> None:
    """Add the dimensions of a connector or parameter."""
    for size in shape:
        SubElement(element, f"{{{SSC}}}Dimension", size=str(size))


def add_parameters(group: Element, unit: Fmu3Unit, values: Mapping[str, Any]) -> None:
    """Add a unit's parameters to a parameter set; elements of arrays that are not in ``values`` have start values."""
    done: set[str] = set()
    for name in values:
        variable, _ = variable_of(unit, name)
        if variable.name in done:
            continue
        done.add(variable.name)
        starts = unit.start_values(name, values)
        texts = [str(value).lower() if isinstance(value, bool) else str(value) for value in starts]
        parameter = SubElement(group, f"{{{SSV}}}Parameter", name=variable.name)
        typed = SubElement(parameter, f"{{{SSV}}}{variable.kind}")
        if variable.shape and variable.kind in _TEXTS:
            for text in texts:
                SubElement(typed, f"{{{SSV}}}Value", value=text)
        else:
            typed.set("value", " ".join(texts))
        add_dimensions(parameter, variable.shape)
