"""FMU of a cranktrain: an engine with its reduced bodies, and all variables of the interface or some of them.

Start values of its parameters, levels included, can be chosen when it is built.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from cranktrain.core.errors import InputError, nearest
from cranktrain.dynamics.model.lumped_data import lumped_values
from cranktrain.dynamics.model.settings import Settings, check_levels, resolved
from cranktrain.dynamics.topology.tables import topology_outputs
from cranktrain.engine.model import Engine
from cranktrain.fmu import archive
from cranktrain.fmu.archive import DESCRIPTION, fmu_path, need_sources, write_fmu
from cranktrain.fmu.description import Interface, Product, Variable, read_interface, read_units
from cranktrain.fmu.flat import FlatModel, to_bytes
from cranktrain.fmu.geometry import start_values
from cranktrain.fmu.native.archive import write_native_fmu
from cranktrain.fmu.native.engine_model import LEVELS, engine_model
from cranktrain.results.files import output_unit


def build(
    model: FlatModel,
    folder: str | Path,
    say: Callable[[str], None] = lambda text: None,
    interface: Interface | None = None,
    fixed: Mapping[str, Any] = MappingProxyType({}),
    suffix: str = "",
    platforms: Sequence[str] = (),
    fmi: str = "2.0",
) -> Path:
    """Write the FMU of a model into ``folder``; returns its path, and reports its size through ``say``.

    With ``platforms`` it is a native FMU for these, of version ``fmi``, otherwise the Python FMU. ``interface``
    defaults to the full one. ``fixed`` are settings that no variable changes; ``suffix`` ends the model's name. The
    file is written completely or not at all. ``InputError`` if interface or code cannot be put into an FMU.
    """
    full = interface or engine_interface(model.engine)
    if platforms:
        made = product(model.engine, full, b"", fixed, suffix)
        return write_native_fmu(made, engine_model(model, made, say), folder, platforms, say, fmi)
    return write_fmu(product(model.engine, full, to_bytes(model), fixed, suffix), folder, say)


def product(
    engine: Engine,
    interface: Interface,
    data: bytes = b"",
    fixed: Mapping[str, Any] = MappingProxyType({}),
    suffix: str = "",
) -> Product:
    """Description of an engine's FMU, see :func:`build`; ``InputError`` if the engine has laws written in Python."""
    for table in engine.additions.connection:
        if table.own is not None:
            raise InputError(
                f"connection '{table.name}': an FMU cannot carry the own law '{table.own.function}', a function of "
                "this Python process; run the engine from Python, or take a law such as spring or coupling"
            )
    return Product(
        model=model_name(engine, interface, suffix),
        title=engine.title,
        interface=interface,
        counts=family_counts(engine),
        pages=DESCRIPTION,
        data=data,
        starts=start_values(engine),
        fixed=fixed,
    )


def full_interface() -> Interface:
    """Interface with all variables; ``InputError`` if the sources of the FMU are not next to the package."""
    need_sources()
    return read_interface(DESCRIPTION)


def engine_interface(engine: Engine, clocks: bool = False) -> Interface:
    """Full interface with an engine's lumped data, and outputs of the bodies and connections that its file adds.

    It has clocks only if ``clocks`` is true.
    """
    interface = full_interface()
    interface = interface if clocks else replace(interface, clock=None)
    data = tuple(
        Variable(
            one.name, "parameter", one.row.title, unit=one.row.unit, display_unit=one.row.display_unit,
            start=one.value, min=one.low, max=one.high, setting=one.name,
        )
        for one in lumped_values(engine)
    )  # fmt: skip
    more = tuple(
        Variable(
            name, "output", f"{name.rpartition('.')[0]}: {name.rpartition('.')[2]}", unit=_fmi_unit(output_unit(name))
        )
        for name in topology_outputs(engine)
    )
    used = {variable.unit for variable in (*interface.variables, *data, *more)}
    units = {name: unit for name, unit in read_units(DESCRIPTION).items() if name in used}
    return replace(interface, variables=interface.variables + data + more, units=units)


def _fmi_unit(unit: str) -> str:
    """Unit in the notation of units.toml: N.m for N m, m3/s for m^3/s."""
    return unit.replace(" ", ".").replace("^", "") or "1"


def model_description(engine: Engine) -> bytes:
    """Model description of an engine's FMU; its GUID is that of an FMU without data, since no bodies are made."""
    return archive.model_description(product(engine, engine_interface(engine)))


def model_name(engine: Engine, interface: Interface, suffix: str = "") -> str:
    """Name of an FMU's model, which is its file name without the ending."""
    return interface.prefix + camel(engine.name) + suffix


def camel(name: str) -> str:
    """Words of a name, capitalised and joined."""
    return "".join(part.capitalize() for part in name.split("_"))


def check_target(folder: Path, engine: Engine) -> None:
    """Raise ``InputError``, before any work, if the FMU of an engine must not be written into a folder."""
    fmu_path(product(engine, engine_interface(engine)), folder)


def family_counts(engine: Engine) -> dict[str, int]:
    """Size of each family of interface.toml for an engine."""
    mounts = len(engine.mounts.x) if engine.mounts is not None else 0
    return {"cylinders": engine.n_cylinders, "main_bearings": len(engine.crankshaft.main_widths), "mounts": mounts}


def with_starts(interface: Interface, starts: Mapping[str, Any]) -> Interface:
    """Interface with other start values of parameters, by name.

    Raises ``InputError``: a name that is not a parameter, or a value that the parameter cannot have.
    """
    parameters = {v.name: v for v in interface.variables if v.causality == "parameter" and v.start_of is None}
    for name in starts:
        if name not in parameters:
            raise InputError(
                f"start: the FMU has no parameter '{name}' to start elsewhere; {nearest(name, parameters)}"
            )
    changed = {name: replace(parameters[name], start=_value(parameters[name], value)) for name, value in starts.items()}
    return replace(interface, variables=tuple(changed.get(v.name, v) for v in interface.variables))


def start_settings(interface: Interface, engine: Engine, starts: Mapping[str, Any]) -> Settings:
    """Complete settings at which an engine's FMU starts; ``InputError`` if the levels contradict each other."""
    variables = with_starts(interface, starts).variables
    chosen: dict[str, Any] = {str(v.setting): v.start for v in variables if v.setting in LEVELS}
    settings = resolved(Settings(**chosen), engine)
    check_levels(settings, engine)
    return settings


def _value(variable: Variable, value: Any) -> Any:
    """Start value converted to a parameter's type; ``InputError`` if the parameter cannot have it."""
    if variable.type == "String":
        if variable.choices and value not in variable.choices:
            raise InputError(f"start: '{variable.name}' is '{value}'; {nearest(str(value), variable.choices)}")
        return str(value)
    low = -math.inf if variable.min is None else variable.min
    high = math.inf if variable.max is None else variable.max
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not (math.isfinite(number) and low <= number <= high):
        unit = "" if variable.unit in (None, "1") else f" {variable.unit}"
        raise InputError(
            f"start: '{variable.name}' is {value}; it must be a number between {low:g} and {high:g}{unit}, without unit"
        )
    return number
