"""File ``terminalsAndIcons/terminalsAndIcons.xml`` of an FMU, which groups its variables by terminal.

Two FMUs can be connected if both have a terminal of the same name. A member has the name of its variable, so the
partner's variable is found by name.

Source: FMI 3.0.2, section 2.4.9; an FMU of FMI 2.0.4 may contain the same file (section 2.3, terminals and icons).
"""

from collections.abc import Sequence
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

from cranktrain.fmu.description import Variable
from cranktrain.fmu.terminals import TERMINALS

FOLDER = "terminalsAndIcons"
FMI = "3.0"
"""Version of FMI that defines terminalsAndIcons.xml."""
_HALF_ICON = 12.0
_HALF_WIDTH = 100.0


def terminals_and_icons(variables: Sequence[Variable]) -> Element:
    """Root element with the terminals of an FMU's variables, see ``fmi3TerminalsAndIcons.xsd``."""
    root = Element("fmiTerminalsAndIcons", fmiVersion=FMI)
    drawing = SubElement(root, "GraphicalRepresentation")
    height = 0.625 * _HALF_WIDTH  # half height of the icon, as model.png has 256 by 160 pixels
    extent = {key: repr(value) for key, value in _corners((0.0, 0.0), (_HALF_WIDTH, height)).items()}
    SubElement(drawing, "CoordinateSystem", {**extent, "suggestedScalingFactorTo_mm": "0.1"})
    SubElement(drawing, "Icon", extent)
    listed = used(variables)
    if not listed:
        return root
    terminals = SubElement(root, "Terminals")
    for name in listed:
        row = TERMINALS[name]
        terminal = SubElement(
            terminals, "Terminal", name=name, matchingRule=row.rule, terminalKind=f"_cranktrain_{name}",
            description=row.title,
        )  # fmt: skip
        for variable in variables:
            if name in variable.terminals:
                SubElement(
                    terminal, "TerminalMemberVariable",
                    variableName=variable.name, memberName=variable.name, variableKind="signal",
                )  # fmt: skip
        place = {key: repr(value) for key, value in _corners(row.place, (_HALF_ICON, _HALF_ICON)).items()}
        SubElement(
            terminal, "TerminalGraphicalRepresentation",
            {"defaultConnectionColor": " ".join(map(str, row.colour)), **place, "iconBaseName": name},
        )  # fmt: skip
    return root


def icons(variables: Sequence[Variable], model: bytes, folder: Path) -> dict[str, bytes]:
    """Pictures by their names in the archive: the FMU's own, and those of its terminals from ``folder``."""
    found = {f"{FOLDER}/{name}.png": (folder / f"{name}.png").read_bytes() for name in used(variables)}
    return {f"{FOLDER}/icon.png": model, **found}


def used(variables: Sequence[Variable]) -> list[str]:
    """Names of the terminals with any of the variables, in the register's order."""
    return [name for name in TERMINALS if any(name in variable.terminals for variable in variables)]


def _corners(middle: tuple[float, float], half: tuple[float, float]) -> dict[str, float]:
    """Coordinates of a rectangle's lower left and upper right corners."""
    (x, y), (a, b) = middle, half
    return {"x1": x - a, "y1": y - b, "x2": x + a, "y2": y + b}
