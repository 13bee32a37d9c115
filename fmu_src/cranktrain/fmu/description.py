"""Interface of the FMU: variables, model description and documentation from interface.toml and units.toml.

``interface.toml`` is the only list of variables. A name such as ``bearing[1..main_bearings].force.x`` stands for one
variable per bearing; adjacent variables of one family expand together, bearing by bearing. Value references number the
reals first, then integers, then strings, each as inputs, outputs, parameters, so a slave keeps each type in one list.

Source: FMI 2.0.4, sections 2.2 (model description schema) and 4.3 (co-simulation).
"""

import html
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from itertools import groupby
from pathlib import Path
from types import MappingProxyType
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from cranktrain.core.errors import InputError, nearest
from cranktrain.dynamics.time.integrators import INTEGRATORS
from cranktrain.engine.levels import BLOCKS, CRANKS, DAMPERS, PISTONS
from cranktrain.film.laws.register import BIG_END, LAWS, MAINS, bearing_levels
from cranktrain.fmu.model_version import model_version
from cranktrain.fmu.running_code import RUNNING
from cranktrain.fmu.terminals import TERMINALS


def _titles(rows: Iterable[Any]) -> dict[str, str]:
    return {row.name: row.title for row in rows}


def _bearings(*kinds: str) -> dict[str, str]:
    return _titles(LAWS[name] for name in bearing_levels(*kinds))


REGISTERS: dict[str, Callable[[], dict[str, str]]] = {
    "cranks": lambda: _titles(CRANKS.values()),
    "bearings": lambda: _bearings(*MAINS),
    "big_ends": lambda: _bearings(BIG_END),
    "blocks": lambda: _titles(BLOCKS.values()),
    "pistons": lambda: _titles(PISTONS.values()),
    "dampers": lambda: _titles(DAMPERS.values()),
    "integrators": lambda: _titles(INTEGRATORS.values()),
}
"""Registers named in interface.toml: for each a function that returns names and titles of the register's rows."""

TYPES = ("Real", "String")
_NAMED = re.compile(r"\[[^\]]*[^\d,\]]")
_FAMILY = re.compile(r"\[1\.\.(\w+)\]")
_BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


@dataclass(frozen=True)
class Variable:
    """One variable of the FMU, or a family of variables before :func:`expand`.

    ``start``, ``min``, ``max`` and ``nominal`` are in ``unit``. ``choices`` are the valid values of a string.
    ``setting`` is the field of the simulation's settings that a parameter sets. ``start_of`` is the value of the
    model's data that gives the start value. ``terminals`` are the terminals of :mod:`cranktrain.fmu.terminals` that
    contain it; ``only`` is the kind of model that has it, if not all. In interface.toml an entry may name a
    ``register``, whose rows follow its choices.
    """

    name: str
    causality: str
    description: str
    type: str = "Real"
    unit: str | None = None
    display_unit: str | None = None
    start: float | int | str | None = None
    min: float | None = None
    max: float | None = None
    nominal: float | None = None
    choices: tuple[str, ...] = ()
    setting: str | None = None
    start_of: str | None = None
    terminals: tuple[str, ...] = ()
    only: str = ""
    reference: int = -1

    @property
    def variability(self) -> str:
        """FMI variability of the variable: inputs and outputs are continuous, parameters are fixed."""
        return "fixed" if self.causality == "parameter" else "continuous"

    @property
    def initial(self) -> dict[str, str]:
        """XML attribute ``initial`` of parameters and outputs, the same in FMI 2.0 and 3.0; inputs have none."""
        known = {"parameter": "exact", "output": "calculated"}
        return {"initial": known[self.causality]} if self.causality in known else {}

    @property
    def of_type(self) -> dict[str, str]:
        """XML attributes of the type, the same in FMI 2.0 and 3.0: units, bounds and nominal value."""
        named = {"unit": self.unit, "displayUnit": self.display_unit, "min": self.min, "max": self.max}
        return {name: _text(value) for name, value in (named | {"nominal": self.nominal}).items() if value is not None}


@dataclass(frozen=True)
class Clock:
    """A family of output clocks that an FMU of FMI 3.0 may have, one for each cylinder.

    Attributes
    ----------
    name : name of the family
    angle : name of an output that is an angle, rad
    at : family of parameters, rad: a clock ticks when the angle equals its parameter plus a whole number of periods
    period : name of a value of the model's data, rad
    description : text for the model description
    """

    name: str
    angle: str
    at: str
    period: str
    description: str


@dataclass(frozen=True)
class Interface:
    """Contents of interface.toml and units.toml.

    ``speed`` is the name of the input with the engine's speed. ``reference`` are inputs of the reference run, linear
    from the start to the end of the default experiment; an input without values stays at its start value. ``clock``
    describes the output clocks that an FMU of FMI 3.0 has on request.
    """

    prefix: str
    description: str
    start_time: float
    stop_time: float
    step_size: float
    variables: tuple[Variable, ...]
    units: dict[str, Any]
    speed: str
    reference: Mapping[str, Sequence[float]]
    clock: Clock | None = None

    def of(self, kind: str) -> "Interface":
        """Interface of a kind of model, without the variables of other kinds."""
        return replace(self, variables=tuple(v for v in self.variables if v.only in ("", kind)))

    @property
    def experiment(self) -> Element:
        """XML entry of the default experiment, the same in FMI 2.0 and 3.0."""
        times = {"startTime": self.start_time, "stopTime": self.stop_time, "stepSize": self.step_size}
        return Element("DefaultExperiment", {name: repr(time) for name, time in times.items()})


def read_interface(folder: str | Path, units_folder: str | Path | None = None) -> Interface:
    """Read interface.toml of a folder, and units.toml of the same or another one.

    Raises ``InputError``: a missing file or a malformed variable; one line with the file, the variable and the remedy.
    """
    listed = _toml(Path(folder) / "interface.toml")
    units = _toml(Path(units_folder or folder) / "units.toml")
    keys = [*(entry.name for entry in fields(Variable) if entry.name != "reference"), "register", "closed"]
    variables = []
    for entry in listed["variable"]:
        where = f"interface.toml: variable '{entry.get('name', '?')}'"
        for key in entry:
            if key not in keys:
                raise InputError(f"{where}: unknown key '{key}'; {nearest(key, keys)}")
        try:
            lists = {key: tuple(entry.get(key, ())) for key in ("choices", "terminals")}
            variable = Variable(**_from_register({**entry, **lists}, where))
        except TypeError as error:
            raise InputError(f"{where}: {error}") from None
        _check(variable, units, where)
        variables.append(variable)
    used = {variable.unit for variable in variables}
    units = {name: unit for name, unit in units.items() if name in used}
    clock = Clock(**listed["clock"]) if "clock" in listed else None
    about = listed["model"] | {"reference": listed["reference"], "clock": clock}
    return Interface(**about, variables=tuple(variables), units=units)


def read_units(folder: str | Path) -> dict[str, Any]:
    """All units in a folder's units.toml, by name."""
    return _toml(Path(folder) / "units.toml")


def _from_register(entry: dict[str, Any], where: str) -> dict[str, Any]:
    """Entry of a variable whose choices and description are completed by the names and titles of a register.

    If the entry is not ``closed``, its value may be other than these names, so it gets no choices.
    """
    name, closed = entry.pop("register", None), entry.pop("closed", True)
    if name is None:
        return entry
    if name not in REGISTERS:
        raise InputError(f"{where}: register '{name}' does not exist; {nearest(name, REGISTERS)}")
    rows = REGISTERS[name]()
    if closed:
        entry["choices"] += tuple(rows)
    entry["description"] += "".join(f"; {row}: {title}" for row, title in rows.items())
    return entry


def _toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{path}: {error}") from None


def _check(variable: Variable, units: Mapping[str, Any], where: str) -> None:
    if variable.causality not in ("input", "output", "parameter"):
        raise InputError(f"{where}: causality '{variable.causality}'; valid: input, output, parameter")
    if variable.type not in TYPES:
        raise InputError(f"{where}: type '{variable.type}'; {nearest(variable.type, TYPES)}")
    if variable.type == "Real":
        unit = str(variable.unit)
        if unit not in units:
            raise InputError(f"{where}: unit '{unit}' is not in units.toml; {nearest(unit, units)}")
        shown = units[unit].get("display", {})
        if variable.display_unit is not None and variable.display_unit not in shown:
            raise InputError(f"{where}: no display unit '{variable.display_unit}' of {unit} in units.toml")
    if (variable.start is None and variable.start_of is None) != (variable.causality == "output"):
        raise InputError(f"{where}: inputs and parameters have a start value, outputs have none")
    if (variable.setting is None) != (variable.causality != "parameter"):
        raise InputError(f"{where}: a parameter, and only a parameter, names the setting it fills")
    for terminal in variable.terminals:
        if terminal not in TERMINALS:
            raise InputError(f"{where}: terminal '{terminal}' does not exist; {nearest(terminal, TERMINALS)}")


def expand(
    variables: Sequence[Variable], counts: Mapping[str, int], starts: Mapping[str, Any] = MappingProxyType({})
) -> tuple[Variable, ...]:
    """Variables of one engine with their value references.

    Parameters
    ----------
    variables : entries of interface.toml
    counts : size of each family, e.g. ``{"cylinders": 6, "main_bearings": 7}``
    starts : values of the model's data for start values; for a family one number for all, or one for each
    """

    def member(variable: Variable, i: int) -> Variable:
        if variable.start_of is not None:
            if variable.start_of not in starts:
                raise InputError(
                    f"interface.toml: variable '{variable.name}': no value '{variable.start_of}' to start from; "
                    f"{nearest(variable.start_of, starts)}"
                )
            start = starts[variable.start_of]
            start = start[i - 1] if isinstance(start, tuple | list) else start
            variable = replace(variable, start=start, start_of=None)
        setting = variable.setting and _FAMILY.sub(f"[{i}]", variable.setting)
        return replace(variable, name=_FAMILY.sub(f"[{i}]", variable.name), setting=setting)

    def family(variable: Variable) -> str:
        match = _FAMILY.search(variable.name)
        return variable.name[: match.end()] if match else ""

    listed: list[Variable] = []
    for head, group in groupby(variables, family):
        members = tuple(group)
        if not head:
            listed += [member(variable, 1) for variable in members]
            continue
        counted = head.split("..")[-1][:-1]
        if counted not in counts:
            raise InputError(f"interface.toml: family '{head}': '{counted}' is unknown; {nearest(counted, counts)}")
        for i in range(1, counts[counted] + 1):
            listed += [member(variable, i) for variable in members]
    causes = ("input", "output", "parameter")
    ranked = sorted(listed, key=lambda v: (TYPES.index(v.type), causes.index(v.causality)))
    references = {v.name: i for i, v in enumerate(ranked)}
    if len(references) != len(listed):
        raise InputError("interface.toml: a name is listed twice; names must be unique")
    return tuple(replace(v, reference=references[v.name]) for v in listed)


def member_names(family: str, counts: Mapping[str, int]) -> tuple[str, ...]:
    """Names of the members of a family such as ``cylinder[1..cylinders].pressure``."""
    found = _FAMILY.search(family)
    assert found is not None, family
    return tuple(_FAMILY.sub(f"[{i}]", family) for i in range(1, counts[found[1]] + 1))


def naming(variables: Sequence[Variable]) -> str:
    """FMI naming convention of the variables: flat if the engine file adds connections, which names index."""
    return "flat" if any(_NAMED.search(variable.name) for variable in variables) else "structured"


def plain(variable: Variable) -> dict[str, Any]:
    """Description of a variable for a slave, as JSON-compatible values."""
    keep = ("name", "causality", "type", "start", "min", "max", "choices", "setting", "reference", "description")
    return {key: value for key, value in asdict(variable).items() if key in keep}


@dataclass(frozen=True, kw_only=True)
class Product:
    """Description of an FMU to be built: a module of the virtual engine with its data.

    Attributes
    ----------
    model : name of the model, and of its file without the ending
    title : title of the documentation
    interface : variables of the FMU
    counts : sizes of the variable families, see :func:`expand`
    pages : folder of ``documentation/index.html``, ``frame.html`` and ``model.png``
    running : Python module from which the slave takes ``read_model``, ``simulation`` and ``announced_compilation``
    data : input of ``read_model``
    starts : values of the data that are start values of variables
    fixed : settings that no variable changes
    """

    model: str
    title: str
    interface: Interface
    counts: Mapping[str, int]
    pages: Path
    running: str = RUNNING
    data: bytes = b""
    starts: Mapping[str, Any] = field(default_factory=dict)
    fixed: Mapping[str, Any] = field(default_factory=dict)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Variables of the FMU, families expanded to single variables, with their value references."""
        return expand(self.interface.variables, self.counts, self.starts)


def description2(
    product: Product,
    guid: str,
    tool: str,
    capabilities: Mapping[str, str],
    categories: Mapping[str, str],
) -> Element:
    """Root element of the model description of FMI 2.0.

    Outputs are computed in doStep and depend on an input only from the next step on, so their list of dependencies is
    empty. In initialization mode they depend on everything, FMI's default.

    Parameters
    ----------
    tool : name of the generating tool
    capabilities : attributes of the element CoSimulation
    categories : log categories, each with its description
    """
    interface, variables = product.interface, product.variables
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": "2.0", "modelName": product.model, "guid": guid, "generationTool": tool,
            "variableNamingConvention": naming(variables), "author": "Cranktrain contributors",
            "license": "BSD-3-Clause", "version": model_version(), "description": interface.description,
        },
    )  # fmt: skip
    SubElement(root, "CoSimulation", dict(capabilities))
    root.append(unit_definitions(interface.units))
    listed = SubElement(root, "LogCategories")
    for name, text in categories.items():
        SubElement(listed, "Category", {"name": name, "description": text})
    root.append(interface.experiment)
    listed = SubElement(root, "ModelVariables")
    for v in variables:
        about = {"name": v.name, "valueReference": str(v.reference), "causality": v.causality}
        about |= {"variability": v.variability} | v.initial | {"description": v.description}
        start = {} if v.start is None else {"start": _text(v.start)}
        SubElement(SubElement(listed, "ScalarVariable", about), v.type, v.of_type | start)
    structure = SubElement(root, "ModelStructure")
    outputs = [str(i + 1) for i, v in enumerate(variables) if v.causality == "output"]
    known, initial = SubElement(structure, "Outputs"), SubElement(structure, "InitialUnknowns")
    for index in outputs:
        SubElement(known, "Unknown", {"index": index, "dependencies": ""})
        SubElement(initial, "Unknown", {"index": index})
    return root


def _text(value: float | str) -> str:
    """Text of a value in XML, numbers in full precision."""
    return value if isinstance(value, str) else repr(value)


def unit_definitions(units: Mapping[str, Any]) -> Element:
    """XML definitions of units, the same for FMI 2.0 and 3.0."""
    definitions = Element("UnitDefinitions")
    for name, unit in units.items():
        element = SubElement(definitions, "Unit", {"name": name})
        base = {key: str(unit[key]) for key in _BASE_UNITS if key in unit}
        if "factor" in unit:
            base["factor"] = repr(unit["factor"])
        SubElement(element, "BaseUnit", base)
        for shown, conversion in unit.get("display", {}).items():
            attributes = {key: repr(float(conversion[key])) for key in ("factor", "offset") if key in conversion}
            SubElement(element, "DisplayUnit", {"name": shown, **attributes})
    return definitions


def variable_table(interface: Interface, counts: Mapping[str, int], arrays: bool = False) -> str:
    """HTML table of the variables for the FMU's documentation, one row per family, which may be an array."""
    rows = ["<tr><th>name</th><th>kind</th><th>unit</th><th>start</th><th>meaning</th></tr>"]
    for variable in interface.variables:
        family = _FAMILY.search(variable.name)
        members = f"[1..{counts[family[1]]}]" if family else ""
        name = _FAMILY.sub("", variable.name) + members if arrays else _FAMILY.sub(members, variable.name)
        unit = variable.unit or ""
        if variable.display_unit:
            unit += f" (shown in {variable.display_unit})"
        start = variable.start if variable.start is not None else "the engine's" if variable.start_of else ""
        start = f"{start:.6g}" if isinstance(start, float) else start
        meaning = variable.description
        if variable.choices and ":" not in meaning:
            meaning += " (" + ", ".join(variable.choices) + ")"
        cells = map(html.escape, (name, variable.causality, unit, str(start), meaning))
        rows.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    if arrays and interface.clock is not None:
        clock = interface.clock
        name = _FAMILY.sub(lambda found: f"[1..{counts[found[1]]}]", clock.name)
        rows.append(
            f"<tr><td>{name}</td><td>clock</td><td></td><td></td><td>{html.escape(clock.description)}</td></tr>"
        )
    return "<table>\n" + "\n".join(rows) + "\n</table>"
