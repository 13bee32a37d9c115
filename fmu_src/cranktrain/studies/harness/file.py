"""Harness files: units, connections, scenarios and assertions in TOML.

    engine = "diesel_i6"                 # units cranktrain, combustion, valvetrain, built where no FMU is named below
    speed_rpm = 2000
    cycles = 4                           # or stop_s
    step_deg = 1                         # or step_s; 1 degree where speed_rpm is given

    [units.combustion]
    fmu = "my_combustion.fmu"

    [[scenario]]
    name = "normal"

    [[scenario.assert]]
    output = "cranktrain.pulley.torsion"
    order = 3
    unit = "deg"
    expected = 0.1
    tolerance = 0.05

``docs/how-to/harness.md`` has all keys. A file is refused in one line that names the entry, before anything is built.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cranktrain.core.errors import InputError, nearest, shown, within
from cranktrain.core.user_file import read_toml
from cranktrain.coupling.master import SCHEMES
from cranktrain.coupling.modules import CRANKTRAIN, OWN, RECONSTRUCTIONS
from cranktrain.coupling.reconstruction import DEGREES
from cranktrain.coupling.run import Bond, Steps
from cranktrain.coupling.supervised import Limits
from cranktrain.engine.file import check_title
from cranktrain.studies.harness.assertion_entries import assertion, ending
from cranktrain.studies.harness.entries import Harness, Scenario, UnitEntry, Way
from cranktrain.studies.harness.event_entries import changes, dropouts, faults, noises
from cranktrain.studies.harness.places import Times, table_of, variable
from cranktrain.studies.harness.unit_entries import start_values, units_of
from cranktrain.studies.typed_table import FLAG, NUMBER, TABLE, TABLES, TEXT, TEXTS, check_types

RPM = math.pi / 30.0
_WAY = {
    **dict.fromkeys(("cycles", "stop_s", "step_deg", "step_s", "error"), NUMBER),
    **dict.fromkeys(("scheme", "reconstruction"), TEXT),
}
_FILE = _WAY | {
    **dict.fromkeys(("title", "engine", "angle", "abscissa"), TEXT),
    **dict.fromkeys(("speed_rpm", "start_limit_s", "step_limit_s"), NUMBER),
    **dict.fromkeys(("units", "connections", "power"), TABLE),
    "valvetrain": FLAG,
    "scenario": TABLES,
}
_CONNECTIONS = {"by_name": FLAG, "map": TEXTS}
_POWER = {"given": TEXTS, "taken": TEXTS}
_EVENTS = ("step", "ramp", "signal", "misfire", "noise", "dropout", "fault")
_SCENARIO = _WAY | {"name": TEXT, "start": TABLE, **dict.fromkeys((*_EVENTS, "assert", "ends"), TABLES)}
_MOST_STEPS = 10_000_000


def load_harness(path: str | Path) -> Harness:
    """Read and check a harness file as far as the file alone tells.

    Raises
    ------
    InputError
        one line with file and entry, for anything unknown, missing, of a wrong type, or that cannot be
    """
    path = Path(path)
    document = read_toml(path, "harness file", "give the path of a harness.toml")
    try:
        return _harness(path, document)
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None


def _harness(path: Path, document: Mapping[str, Any]) -> Harness:
    check_types(document, _FILE, "")
    title = document.get("title", path.stem)
    check_title(title, "title")
    own = "connections" in document
    units = units_of(path, document, own)
    speed = None
    if "speed_rpm" in document:
        within("speed_rpm:", document["speed_rpm"], 10.0, 30000.0, "rev/min")
        speed = RPM * document["speed_rpm"]
    elif not own:
        raise InputError("speed_rpm is missing; the virtual engine turns at a speed, e.g. speed_rpm = 2000")
    links, by_name = _links(document.get("connections", {}), units) if own else (None, False)
    angle = variable(document["angle"], "angle", units) if "angle" in document else None
    if angle is None and CRANKTRAIN in units:
        angle = CRANKTRAIN, "crank.angle"
    bonds = _bonds(document.get("power", {}), units)
    tables = document.get("scenario", [])
    if not tables:
        raise InputError("no [[scenario]]; give at least one, with a name")
    names = [_scenario_name(k, table) for k, table in enumerate(tables, 1)]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two scenarios are named '{name}'; rename one")
    defaults = {key: document[key] for key in _WAY if key in document}
    if own:
        defaults.setdefault("reconstruction", "linear")
    scenarios = tuple(
        _scenario(name, table, defaults, units, speed, names, own) for name, table in zip(names, tables, strict=True)
    )
    return Harness(
        title=title, path=path, speed=speed, units=units, links=links, by_name=by_name, bonds=bonds,
        abscissa=variable(document["abscissa"], "abscissa", units) if "abscissa" in document else None,
        angle=angle, limits=_limits(document), scenarios=scenarios,
    )  # fmt: skip


def _limits(document: Mapping[str, Any]) -> Limits:
    usual = Limits()
    found = {"start": document.get("start_limit_s", usual.start), "step": document.get("step_limit_s", usual.step)}
    for name, value in found.items():
        within(f"{name}_limit_s:", value, 0.01, 1e6, "s")
    return Limits(**found)


def _links(table: Mapping[str, Any], units: Mapping[str, UnitEntry]) -> tuple[tuple[str, ...], bool]:
    table_of(table, _CONNECTIONS, "connections")
    links = tuple(table.get("map", ()))
    for link in links:
        ends = link.split("->")
        if len(ends) != 2:
            raise InputError(f"connections.map: '{link}' is not 'unit.output -> unit.input'")
        for end in ends:
            variable(end.strip(), "connections.map", units)
    by_name = table.get("by_name", not links)
    return links, by_name


def _bonds(tables: Mapping[str, Any], units: Mapping[str, UnitEntry]) -> tuple[Bond, ...]:
    """Powers that units exchange: sums of products ``a.force * b.speed``."""
    found = []
    for name, table in tables.items():
        table_of(table, _POWER, f"power.{name}")
        sides = []
        for side in _POWER:
            pairs = []
            for text in table.get(side, ()):
                factors = [variable(part.strip(), f"power.{name}.{side}", units) for part in text.split("*")]
                if len(factors) != 2:
                    raise InputError(f"power.{name}.{side}: '{text}' is not 'unit.variable * unit.variable'")
                pairs.append((factors[0], factors[1]))
            if not pairs:
                raise InputError(f"power.{name}.{side} is missing; give a list of products")
            sides.append(pairs)
        found.append(Bond(name, *sides))
    return tuple(found)


def _scenario_name(number: int, table: Mapping[str, Any]) -> str:
    """Name of a scenario, which is also that of its result file."""
    name = table.get("name")
    if not isinstance(name, str) or not re.fullmatch(r"\w[\w .,()%+-]*", name) or len(name) > 80:
        said = "no name" if name is None else f"name {shown(name)}"
        raise InputError(f'scenario {number}: {said}; give one of letters, digits and blanks, name = "normal"')
    return name


def _scenario(
    name: str, table: Mapping[str, Any], defaults: Mapping[str, Any], units: Mapping[str, UnitEntry],
    speed: float | None, names: Sequence[str], own: bool,
) -> Scenario:  # fmt: skip
    where = f"scenario '{name}'"
    table_of(table, _SCENARIO, where)
    way = _way({**defaults, **{key: table[key] for key in _WAY if key in table}}, speed, own, where)
    times = Times(speed, way.stop)
    start = table.get("start", {})
    for unit in start:
        if unit not in units:
            raise InputError(f"{where}: start: there is no unit '{unit}'; {nearest(unit, units)}")
        if not isinstance(start[unit], dict):
            raise InputError(f"{where}: start.{unit} is not a table of start values; start.{unit} = {{ name = value }}")
    given = {event: [(f"{where}: {event} {k}", entry) for k, entry in enumerate(table.get(event, ()), 1)]
             for event in (*_EVENTS, "assert", "ends")}  # fmt: skip
    return Scenario(
        name=name,
        way=way,
        start={unit: start_values(values, f"{where}: start.{unit}") for unit, values in start.items()},
        changes=changes(given, units, times, where),
        noises=noises(given["noise"], units, times),
        dropouts=dropouts(given["dropout"], units, times),
        faults=faults(given["fault"], units, times, where),
        assertions=tuple(assertion(at, entry, units, times, name, names) for at, entry in given["assert"]),
        ending=ending(given["ends"], units, times, way.steps.size, where),
    )


def _way(table: Mapping[str, Any], speed: float | None, own: bool, where: str) -> Way:
    """How a scenario is run."""
    cycle = None if speed is None else 4.0 * math.pi / speed

    def one_of(low: str, high: str, factor: float | None) -> float:
        given = [key for key in (low, high) if key in table]
        if len(given) != 1:
            said = f"neither {low} nor {high}" if not given else f"both {low} and {high}"
            raise InputError(f"{where}: {said}; give one of them, here or at the top of the file")
        if given[0] == low and factor is None:
            raise InputError(f"{where}: {low} needs speed_rpm; give it, or {high}")
        value = float(table[given[0]]) * (factor or 1.0 if given[0] == low else 1.0)
        if not value > 0.0:
            raise InputError(f"{where}: {given[0]} {table[given[0]]:g} must be above zero")
        return value

    if cycle is not None and not {"step_deg", "step_s"} & table.keys():
        table = {**table, "step_deg": 1.0}
    stop = one_of("cycles", "stop_s", cycle)
    size = one_of("step_deg", "step_s", None if cycle is None else cycle / 720.0)
    if stop / size > _MOST_STEPS:
        raise InputError(
            f"{where}: {stop / size:.3g} communication steps are more than {_MOST_STEPS:g}; take longer ones"
        )
    scheme, error = table.get("scheme", "gauss-seidel"), table.get("error")
    reconstruction = table.get("reconstruction", OWN)
    valid = tuple(DEGREES) if own else RECONSTRUCTIONS
    for key, value, words in (("scheme", scheme, SCHEMES), ("reconstruction", reconstruction, valid)):
        if value not in words:
            raise InputError(f"{where}: {key} '{value}' does not exist; {nearest(value, words)}")
    try:
        steps = Steps(size) if error is None else Steps(size, error, 1e-3 * size, 20.0 * size)
    except InputError as wrong:
        raise InputError(f"{where}: {wrong}") from None
    return Way(stop, steps, scheme, reconstruction)
