"""Export of a coupled system as SSP: FMUs, connections, units and parameter sets in one archive for other masters.

An SSP contains neither schemes nor reconstruction; each master has its own. Equal systems give identical files. Systems
with FMI 2.0 only are written as SSP 1.0. With an FMI 3.0 FMU it is SSP 2.0, whose connectors are FMI 3.0 variables:
arrays are connected as a whole, and parameters have types and dimensions.

Source: System Structure and Parameterization 2.0 (Modelica Association, 2024), sections 4 (dimensions), 5 (connectors,
connections) and 6 (parameters).
"""

import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import prod
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element, SubElement, indent, register_namespace, tostring

from cranktrain.core.errors import InputError
from cranktrain.core.user_file import ending
from cranktrain.store.whole_file import check_place, marked, whole_file
from cranktrain_lab.coupling.connections import Connection, checked
from cranktrain_lab.coupling.fmu3_unit import Fmu3Unit
from cranktrain_lab.coupling.unit import DIMENSIONS, Port, Unit

SSD = "http://ssp-standard.org/SSP1/SystemStructureDescription"
_DATE = (2020, 1, 1, 0, 0, 0)
_KIND = marked("SSP", "SystemStructure.ssd")


def write_ssp(
    path: Path, name: str, units: Mapping[str, tuple[Unit, Path]], connections: Sequence[Connection],
    values: Mapping[str, Mapping[str, Any]], outputs: Mapping[str, Sequence[str]], stop: float,
) -> Path:  # fmt: skip
    """Write the archive.

    Parameters
    ----------
    units : unit and path of its FMU, by name
    values : start values by unit and variable
    outputs : outputs of each unit that are shown in addition to the connected ones
    stop : end of the default experiment, s

    Raises
    ------
    InputError
        invalid connections, arrays that are not connected as a whole, an invalid ``path``
    """
    plain = {key: unit for key, (unit, _) in units.items()}
    checked(plain, connections)
    check_target(path)
    version = "2.0" if any(isinstance(unit, Fmu3Unit) for unit in plain.values()) else "1.0"
    root = Element(f"{{{SSD}}}SystemStructureDescription", version=version, name=name)
    _add_structure(root, units, connections, outputs)
    SubElement(root, f"{{{SSD}}}DefaultExperiment", startTime="0.0", stopTime=repr(stop))
    for prefix, space in (("ssd", SSD), ("ssc", SSC), ("ssv", SSV)):
        register_namespace(prefix, space)
    files = {"SystemStructure.ssd": _text(root)}
    for key, (unit, fmu) in units.items():
        files[f"resources/{key}.ssv"] = _text(_parameter_set(key, unit, values.get(key, {}), version))
        files[f"resources/{fmu.name}"] = fmu.read_bytes()
    with whole_file(path, _KIND) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        for file, content in files.items():
            archive.writestr(zipfile.ZipInfo(file, _DATE), content, zipfile.ZIP_DEFLATED)
    return path


def check_target(path: Path) -> None:
    """Raise ``InputError`` for a path that an SSP cannot be written to; to be called before the work."""
    if ending(path) != ".ssp":
        raise InputError(f"{path}: an SSP's name ends in .ssp; name it {path.with_suffix('.ssp')}")
    check_place(path, _KIND)


def _add_structure(
    root: Element, units: Mapping[str, tuple[Unit, Path]], connections: Sequence[Connection],
    outputs: Mapping[str, Sequence[str]],
) -> None:  # fmt: skip
    """Add the system with its components, connectors and connections, and the units that connectors name."""
    links = whole_connections({key: unit for key, (unit, _) in units.items()}, connections)
    shown: dict[str, dict[tuple[str, Variable], Port]] = {}
    for key, (unit, _) in units.items():
        inputs = [c.target[1] for c in connections if c.target[0] == key]
        sources = [c.source[1] for c in connections if c.source[0] == key]
        there: dict[tuple[str, Variable], Port] = {}
        for cause, names, ports in (
            ("input", inputs, unit.inputs), ("output", [*sources, *outputs.get(key, ())], unit.outputs),
        ):  # fmt: skip
            for one in names:
                there.setdefault((cause, variable_of(unit, one)[0]), ports[one])
        shown[key] = there
    system = SubElement(root, f"{{{SSD}}}System", name=root.attrib["name"])
    elements = SubElement(system, f"{{{SSD}}}Elements")
    for key, (_, fmu) in units.items():
        kind = "application/x-fmu-sharedlibrary"
        component = SubElement(elements, f"{{{SSD}}}Component", name=key, source=f"resources/{fmu.name}", type=kind)
        connectors = SubElement(component, f"{{{SSD}}}Connectors")
        for (cause, variable), port in shown[key].items():
            connector = SubElement(connectors, f"{{{SSD}}}Connector", name=variable.name, kind=cause)
            SubElement(connector, f"{{{SSC}}}{variable.kind}", {"unit": port.unit} if port.unit else {})
            add_dimensions(connector, variable.shape)
        bindings = SubElement(component, f"{{{SSD}}}ParameterBindings")
        SubElement(bindings, f"{{{SSD}}}ParameterBinding", source=f"resources/{key}.ssv")
    group = SubElement(system, f"{{{SSD}}}Connections")
    for link in links:
        (start, output), (end, taken) = link.source, link.target
        ends = {"startElement": start, "startConnector": output, "endElement": end, "endConnector": taken}
        SubElement(group, f"{{{SSD}}}Connection", ends)
    _units(root, [port for there in shown.values() for port in there.values()])


def _units(root: Element, ports: Sequence[Port]) -> None:
    """Add the units of measurement that connectors name, with their base units."""
    group = SubElement(root, f"{{{SSD}}}Units")
    for port in {port.unit: port for port in ports if port.unit and port.dimensions is not None}.values():
        unit = SubElement(group, f"{{{SSC}}}Unit", name=port.unit)
        powers = zip(DIMENSIONS, port.dimensions or (), strict=True)
        base = {key: str(power) for key, power in powers if power}
        if port.factor != 1.0:
            base["factor"] = repr(port.factor)
        if port.offset != 0.0:
            base["offset"] = repr(port.offset)
        SubElement(unit, f"{{{SSC}}}BaseUnit", base)


def _parameter_set(name: str, unit: Unit, values: Mapping[str, Any], version: str) -> Element:
    root = Element(f"{{{SSV}}}ParameterSet", version=version, name=name)
    group = SubElement(root, f"{{{SSV}}}Parameters")
    if isinstance(unit, Fmu3Unit):
        add_parameters(group, unit, values)
        return root
    for variable, value in values.items():
        parameter = SubElement(group, f"{{{SSV}}}Parameter", name=variable)
        kind = {bool: "Boolean", int: "Integer", str: "String"}.get(type(value), "Real")
        SubElement(parameter, f"{{{SSV}}}{kind}", value=str(value).lower() if kind == "Boolean" else str(value))
    return root


def _text(root: Element) -> bytes:
    indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, "utf-8") + b"\n"


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
