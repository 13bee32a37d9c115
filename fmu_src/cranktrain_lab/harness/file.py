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

import math
import re
import unicodedata
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.typed_file import record
from cranktrain.core.units import RPM
from cranktrain.core.user_file import beside, read_toml, user_path
from cranktrain.core.user_file import ending as ends
from cranktrain.engine.file import check_title, load_engine
from cranktrain_lab.coupling.modules import CRANKTRAIN, OWN, RECONSTRUCTIONS
from cranktrain_lab.coupling.reconstruction import DEGREES
from cranktrain_lab.coupling.run import Bond, Steps
from cranktrain_lab.coupling.supervised import Limits
from cranktrain_lab.harness.assertion_entries import assertion, check_ratios, ending
from cranktrain_lab.harness.entries import Harness, Scenario, UnitEntry, Way, file_name
from cranktrain_lab.harness.event_entries import changes, dropouts, faults, noises
from cranktrain_lab.harness.measures import Times, variable
from cranktrain_lab.harness.recording import MISFIT, SPEED, UNIT, read_recording
from cranktrain_lab.harness.tables import ConnectionsTable, HarnessTable, PowerTable, ScenarioTable, WayTable
from cranktrain_lab.harness.unit_entries import start_values, units_of

_EVENTS = ("step", "ramp", "signal", "misfire", "noise", "dropout", "fault")
_MOST_STEPS = 10_000_000


def load_harness(path: str | Path) -> Harness:
    """Read a harness file, and check it as far as possible without its FMUs.

    Raises
    ------
    InputError
        one line with file and entry, for anything unknown, missing, of a wrong type or impossible
    """
    path = user_path(path)
    document = read_toml(path, "harness file", "give the path of a harness.toml")
    try:
        return _harness(path, document)
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None


def _harness(path: Path, document: Mapping[str, Any]) -> Harness:
    read = record(HarnessTable, document)
    title = path.stem if read.title is None else read.title
    check_title(title, "title")
    units = units_of(path, read)
    recording = None
    if read.recording is not None:
        if read.engine is None or read.connections is not None:
            raise InputError(
                "[measured] takes the place of an engine's combustion; name the engine, without [connections]"
            )
        engine = load_engine(str(beside(path, read.engine)) if ends(read.engine) == ".toml" else read.engine)
        recording = read_recording(path, read.recording, engine)
    speed = None if read.speed_rpm is None else RPM * read.speed_rpm
    if speed is None and recording is not None and SPEED in recording.values:
        speed = recording.mean(SPEED)
    known = units if recording is None else {**units, UNIT: UnitEntry(), MISFIT: UnitEntry()}
    if speed is None and read.connections is None:
        raise InputError("speed_rpm is missing; the virtual engine turns at a speed, e.g. speed_rpm = 2000")
    links, by_name = (None, False) if read.connections is None else _links(read.connections, units)
    angle = None if read.angle is None else variable(read.angle, "angle", units)
    if angle is None and CRANKTRAIN in units:
        angle = CRANKTRAIN, "crank.angle"
    bonds = _bonds(read.power, units)
    if not read.scenario:
        raise InputError("no [[scenario]]; give at least one, with a name")
    names = [table.name for table in read.scenario]
    for k, name in enumerate(names, 1):
        if not re.fullmatch(r"\w[\w .,()%+-]*", name) or len(name) > 80:
            raise InputError(f"scenario {k}: name {shown(name)}; {ScenarioTable.remedy}")
        if names.count(name) > 1:
            raise InputError(f"two scenarios are named '{name}'; rename one")
    # Refuse scenarios that would share a result file on case-insensitive file systems.
    files: dict[str, str] = {}
    for name in names:
        other = files.setdefault(unicodedata.normalize("NFKC", file_name(name)).casefold(), name)
        if other != name:
            raise InputError(f"scenarios '{other}' and '{name}' would share a result file; rename one")
    usual = Limits()
    scenarios = tuple(_scenario(table, read, known, speed, names) for table in read.scenario)
    check_ratios(scenarios, None if speed is None else 4.0 * math.pi / speed)
    return Harness(
        title=title, path=path, speed=speed, units=units, links=links, by_name=by_name, bonds=bonds,
        abscissa=None if read.abscissa is None else variable(read.abscissa, "abscissa", units), angle=angle,
        limits=Limits(read.start_limit_s or usual.start, read.step_limit_s or usual.step),
        recording=recording,
        scenarios=scenarios,
    )  # fmt: skip


def _links(table: ConnectionsTable, units: Mapping[str, UnitEntry]) -> tuple[tuple[str, ...], bool]:
    for link in table.map:
        ends = link.split("->")
        if len(ends) != 2:
            raise InputError(f"connections.map: '{link}' is not 'unit.output -> unit.input'")
        for end in ends:
            variable(end.strip(), "connections.map", units)
    return table.map, not table.map if table.by_name is None else table.by_name


def _bonds(tables: Mapping[str, PowerTable], units: Mapping[str, UnitEntry]) -> tuple[Bond, ...]:
    """Return power bonds of units, as sums of products ``a.force * b.speed``."""
    found = []
    for name, table in tables.items():
        sides = []
        for side, products in (("given", table.given), ("taken", table.taken)):
            pairs = []
            for text in products:
                factors = [variable(part.strip(), f"power.{name}.{side}", units) for part in text.split("*")]
                if len(factors) != 2:
                    raise InputError(f"power.{name}.{side}: '{text}' is not 'unit.variable * unit.variable'")
                pairs.append((factors[0], factors[1]))
            if not pairs:
                raise InputError(f"power.{name}.{side} is empty; give a list of products")
            sides.append(pairs)
        given, taken = sides
        found.append(Bond(name, given, taken))
    return tuple(found)


def _scenario(
    table: ScenarioTable, file: HarnessTable, units: Mapping[str, UnitEntry], speed: float | None, names: Sequence[str]
) -> Scenario:
    name = table.name
    where = f"scenario '{name}'"
    way = _way(table, file, speed, where)
    times = Times(speed, way.stop)
    for unit in table.start:
        if unit not in units:
            raise InputError(f"{where}: start: there is no unit '{unit}'; {nearest(unit, units)}")
    entries = {event: getattr(table, event) for event in (*_EVENTS, "ends")} | {"assert": table.assert_}
    given = {
        event: [(f"{where}: {event} {k}", entry) for k, entry in enumerate(found, 1)]
        for event, found in entries.items()
    }
    return Scenario(
        name=name,
        way=way,
        start={unit: start_values(values, f"{where}: start.{unit}") for unit, values in table.start.items()},
        changes=changes(given, units, times, where),
        noises=noises(given["noise"], units, times),
        dropouts=dropouts(given["dropout"], units, times),
        faults=faults(given["fault"], units, times, where),
        assertions=tuple(assertion(at, entry, units, times, name, names) for at, entry in given["assert"]),
        ending=ending(given["ends"], units, times, way.steps.size, where),
    )


def _way(scenario: WayTable, file: HarnessTable, speed: float | None, where: str) -> Way:
    """Return the settings of a scenario's run."""
    own = file.connections is not None
    table: dict[str, Any] = {"scheme": "gauss-seidel", "reconstruction": "linear" if own else OWN, "error": None}
    for source in (file, scenario):
        table |= {key: value for key in WayTable.__struct_fields__ if (value := getattr(source, key)) is not None}
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
    scheme, error, reconstruction = table["scheme"], table["error"], table["reconstruction"]
    valid = tuple(DEGREES) if own else RECONSTRUCTIONS
    if reconstruction not in valid:
        near = nearest(reconstruction, valid)
        raise InputError(f"{where}: reconstruction '{reconstruction}' does not exist; {near}")
    try:
        steps = Steps(size) if error is None else Steps(size, error, 1e-3 * size, 20.0 * size)
    except InputError as wrong:
        raise InputError(f"{where}: {wrong}") from None
    return Way(stop, steps, scheme, reconstruction)
