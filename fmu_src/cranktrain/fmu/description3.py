"""Model description of an FMU of FMI 3.0, with an output clock for each cylinder that ticks at its firing dead centre.

Source: FMI 3.0.2, sections 2.4 (model description schema), 4.4 (co-simulation) and 2.2.9 (clocks are scalars, and
output clocks are triggered).
"""

import math
from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement

from cranktrain.core.errors import InputError
from cranktrain.fmu.arrays import Group
from cranktrain.fmu.description import Product, Variable, member_names, naming, unit_definitions
from cranktrain.fmu.model_version import model_version

LOG_CATEGORIES = {
    "logEvents": "What the model does",
    "logStatusWarning": "What a user should look at",
    "logStatusDiscard": "Steps without a solution",
    "logStatusError": "Calls that were refused",
    "logStatusFatal": "Nothing: no error of this FMU is fatal",
    "logAll": "All of these",
}
CAPABILITIES = {
    "needsExecutionTool": "false",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true",
    "providesDirectionalDerivatives": "true",
    "providesAdjointDerivatives": "true",
    "canHandleVariableCommunicationStepSize": "true",
    "maxOutputDerivativeOrder": "1",
    "providesIntermediateUpdate": "true",
    "canReturnEarlyAfterIntermediateUpdate": "true",
}
WITH_CLOCKS = {"mightReturnEarlyFromDoStep": "true", "hasEventMode": "true"}
TYPES = {"Real": "Float64", "String": "String", "Enumeration": "Enumeration"}


def description3(product: Product, groups: Sequence[Group], token: str) -> Element:
    """Root element of the model description of FMI 3.0.

    Parameters
    ----------
    product : product that gives the name of the library; its clocks follow the time
    groups : variables with their value references, see :func:`cranktrain.fmu.arrays.grouped`
    token : instantiation token
    """
    model, interface = product.model, product.interface
    members = [member for group in groups for member in group.members]
    clocks = clock_entries(product, len(members) + 1)
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": "3.0", "modelName": model, "instantiationToken": token,
            "description": interface.description, "author": "Cranktrain contributors", "version": model_version(),
            "license": "BSD-3-Clause", "generationTool": "cranktrain", "variableNamingConvention": naming(members),
        },
    )  # fmt: skip
    SubElement(root, "CoSimulation", {"modelIdentifier": model, **CAPABILITIES} | (WITH_CLOCKS if clocks else {}))
    root.append(unit_definitions(interface.units))
    enumerations = [group for group in groups if group.variable.type == "Enumeration"]
    if enumerations:
        types = SubElement(root, "TypeDefinitions")
        for group in enumerations:
            kind = SubElement(types, "EnumerationType", {"name": type_name(group.name)})
            for value, choice in enumerate(group.variable.choices, 1):
                SubElement(kind, "Item", {"name": choice, "value": str(value)})
    categories = SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        SubElement(categories, "Category", {"name": name, "description": text})
    root.append(interface.experiment)
    listed = SubElement(root, "ModelVariables")
    about_time = {"description": "Time of the simulation"} | ({"unit": "s"} if "s" in interface.units else {})
    SubElement(
        listed, "Float64",
        {"name": "time", "valueReference": str(len(members)), "causality": "independent", "variability": "continuous"}
        | about_time,
    )  # fmt: skip
    structure = SubElement(root, "ModelStructure")
    outputs = [str(group.variable.reference) for group in groups if group.variable.causality == "output"]
    for group in groups:
        listed.append(_variable(group))
    listed.extend(clocks)
    outputs += [clock.attrib["valueReference"] for clock in clocks]
    # Outputs belong to the end of a step, so they depend on no input; initially they depend on all variables.
    for reference in outputs:
        SubElement(structure, "Output", {"valueReference": reference, "dependencies": ""})
    for reference in outputs:
        SubElement(structure, "InitialUnknown", {"valueReference": reference})
    return root


def type_name(name: str) -> str:
    """Name of an enumeration's type, different from all variables: ``CrankLevel`` for ``crank.level``."""
    return "".join(word[:1].upper() + word[1:] for part in name.split(".") for word in part.split("_"))


def _variable(group: Group) -> Element:
    """XML entry of a variable."""
    variable = group.variable
    about = {
        "name": variable.name,
        "valueReference": str(variable.reference),
        "description": variable.description,
        "causality": variable.causality,
        "variability": variable.variability,
    }
    if variable.causality in ("input", "output"):
        about["intermediateUpdate"] = "true"
    if variable.type == "Enumeration":
        about["declaredType"] = type_name(variable.name)
    about |= variable.initial | variable.of_type
    starts = [_start(group, member.start) for member in group.members if member.start is not None]
    if starts and variable.type != "String":
        about["start"] = starts[0] if len(set(starts)) == 1 and not group.is_array else " ".join(starts)
    entry = Element(TYPES[variable.type], about)
    if group.is_array:
        SubElement(entry, "Dimension", {"start": str(len(group.members))})
    for text in starts if variable.type == "String" else ():
        SubElement(entry, "Start", {"value": text})
    return entry


def _start(group: Group, start: float | str | None) -> str:
    """Text of a start value: the number of a choice, or a number in full precision."""
    if group.variable.type == "Enumeration":
        return str(group.variable.choices.index(str(start)) + 1)
    return start if isinstance(start, str) else repr(start)


def clock_table(product: Product, variables: Sequence[Variable]) -> str:
    """Entry ``clocks`` of native.bin: three whole numbers as text, read by ``fmi3_events.c``.

    They are the value references of the angle and of the array of dead centres, and the revolutions between two ticks
    of a clock. ``variables`` are those of the FMU. ``InputError`` if the FMU lacks a variable that clocks need.
    """
    clock = product.interface.clock
    assert clock is not None
    places = {variable.name: variable.reference for variable in variables}
    marks = member_names(clock.at, product.counts)
    lacking = [name for name in (clock.angle, *marks) if name not in places]
    if lacking:
        raise InputError(f"clocks need '{lacking[0]}', which this FMU does not have; build it without clocks")
    turns = round(product.starts[clock.period] / (2.0 * math.pi))
    return f"{places[clock.angle]} {places[marks[0]]} {turns}"


def clock_entries(product: Product, first: int) -> list[Element]:
    """Entries of the clocks in the model description, with value references from ``first`` on."""
    clock = product.interface.clock
    if clock is None:
        return []
    ticks = {"causality": "output", "variability": "discrete", "intervalVariability": "triggered"}
    return [
        Element("Clock", {"name": name, "valueReference": str(k), "description": clock.description, **ticks})
        for k, name in enumerate(member_names(clock.name, product.counts), first)
    ]
