"""TOML tables of a harness file, with keys, kinds and ranges of values. Times are given in s or in cycles."""

from typing import Annotated, Any, Literal

from msgspec import Meta, field

from cranktrain.core.typed_file import Table, between, measure, quantities
from cranktrain_lab.coupling.schemes import SCHEMES
from cranktrain_lab.harness.entries import BY_FAILURE, ENDS, GIVES, KINDS, LAST, MEASURES

StartValue = Annotated[
    Any,
    Meta(
        extra_json_schema={
            "anyOf": [
                {"type": ["number", "string", "boolean"]},
                {
                    "type": "object",
                    "properties": {"value": {"type": "number"}, "unit": {"type": "string"}},
                    "required": ["value", "unit"],
                    "additionalProperties": False,
                },
            ]
        }
    ),
]


_Seconds = Annotated[float, measure("s", "time")]
_Share = Annotated[float, measure("1", "1")]
LARGEST = 1e30
"""Largest magnitude of a number in an entry, so that sums and squares of derived values are finite."""
_Own = Annotated[
    float,
    Meta(ge=-LARGEST, le=LARGEST, extra={"what": "in its unit"}, extra_json_schema=quantities().extra_json_schema),
]
"""Number of a TOML table, in the unit of measurement that the table states."""


class At(Table, kw_only=True):
    """Base class of TOML tables for an event at one time."""

    at_s: _Seconds | None = None
    at_cycles: float | None = None


class Span(Table, kw_only=True):
    """Base class of TOML tables for an event from one time to another."""

    from_s: _Seconds | None = None
    from_cycles: float | None = None
    to_s: _Seconds | None = None
    to_cycles: float | None = None


class Measured(Table, kw_only=True):
    """TOML table of a start value with its unit of measurement."""

    measured = ("value",)
    value: _Own
    unit: str

    remedy = "a table holds value and unit, { value = 20, unit = 'degC' }"


class Step(At, kw_only=True):
    """TOML table of an input that jumps to a value."""

    measured = ("value",)
    input: str
    value: _Own
    unit: str = ""


class Ramp(Span, kw_only=True):
    """TOML table of an input that goes linearly from its present value to another."""

    measured = ("value",)
    input: str
    value: _Own
    unit: str = ""


class Signal(Table, kw_only=True):
    """TOML table of an input that goes linearly from point to point; two points of one time are a jump."""

    measured = ("values",)
    input: str
    values: list[_Own]
    times_s: list[_Seconds] | None = None
    times_cycles: list[float] | None = None
    unit: str = ""


class Misfire(Span, kw_only=True):
    """TOML table of a cylinder without fuel, from a time on or between two times."""

    cylinder: int


class NoiseTable(Span, kw_only=True):
    """TOML table of noise on an input, with its standard deviation."""

    measured, differences = ("rms",), ("rms",)
    input: str
    rms: _Own
    unit: str = ""
    seed: int = 0


class DropoutTable(Span, kw_only=True):
    """TOML table of an interruption of an input's connection."""

    input: str
    gives: Literal[GIVES] = LAST  # type: ignore[valid-type]


class FaultTable(At, kw_only=True):
    """TOML table of a unit's fault from a time on."""

    of: str
    kind: Literal[KINDS]  # type: ignore[valid-type]
    output: str = ""


class AssertTable(Span, kw_only=True):
    """TOML table of the required value of an output or of a power bond's residual."""

    measured, differences = ("expected", "absolute", "least", "most"), ("absolute",)
    name: str = ""
    output: str | None = None
    residual: str = ""
    what: Literal[MEASURES] | None = None  # type: ignore[valid-type]
    order: float | None = None
    over_cycles: float | None = None
    unit: str = ""
    ratio_to: str = ""
    expected: _Own | None = None
    tolerance: _Share | None = None
    absolute: _Own | None = None
    least: _Own | None = None
    most: _Own | None = None


class EndsTable(At, kw_only=True):
    """TOML table of the required end of a scenario."""

    how: Literal[ENDS] = BY_FAILURE  # type: ignore[valid-type]
    of: str = ""
    says: str | None = None
    within_s: _Seconds | None = None


class UnitTable(Table, kw_only=True):
    """TOML table of a unit, with its FMU file or what to build, start values, and outputs to record."""

    fmu: str | None = None
    build: str | None = None
    start: dict[str, StartValue] = field(default_factory=dict)
    record: tuple[str, ...] = ()


class ConnectionsTable(Table, kw_only=True):
    """TOML table of connections ``unit.output -> unit.input``, and whether equal names are connected too."""

    by_name: bool | None = None
    map: tuple[str, ...] = ()


class RecordingTable(Table, kw_only=True):
    """TOML table of a measurement to compare with the model, see :mod:`cranktrain_lab.harness.recording`.

    ``channels`` names channels of the file by the model's names; ``zero_deg`` is the file's crank angle at which the
    first cylinder fires.
    """

    file: str
    channels: dict[str, str] = field(default_factory=dict)
    zero_deg: Annotated[float, between(-720.0, 720.0, "deg", "angle")] = 0.0

    remedy = '[measured] has file, and channels = { "pulley.torsion" = "NAME" } where names differ'


class PowerTable(Table, kw_only=True):
    """TOML table of a power that units exchange, as sums of products ``unit.force * unit.speed``."""

    given: list[str]
    taken: list[str]

    remedy = "give a list of products"


class WayTable(Table, kw_only=True):
    """Settings of runs; at the top of the file they apply to all scenarios, in a scenario to this one only."""

    cycles: float | None = None
    stop_s: _Seconds | None = None
    step_deg: Annotated[float, measure("deg", "angle")] | None = None
    step_s: _Seconds | None = None
    error: float | None = None
    scheme: Literal[tuple(SCHEMES)] | None = None  # type: ignore[valid-type]
    reconstruction: str | None = None


class ScenarioTable(WayTable, kw_only=True, rename={"assert_": "assert"}):
    """TOML table of a scenario: one run with its events and assertions."""

    name: str
    start: dict[str, dict[str, StartValue]] = field(default_factory=dict)
    step: tuple[Step, ...] = ()
    ramp: tuple[Ramp, ...] = ()
    signal: tuple[Signal, ...] = ()
    misfire: tuple[Misfire, ...] = ()
    noise: tuple[NoiseTable, ...] = ()
    dropout: tuple[DropoutTable, ...] = ()
    fault: tuple[FaultTable, ...] = ()
    assert_: tuple[AssertTable, ...] = ()
    ends: tuple[EndsTable, ...] = ()

    remedy = 'give one of letters, digits and blanks, name = "normal"'


class HarnessTable(WayTable, kw_only=True, rename={"recording": "measured"}):
    """Whole harness file, with units, connections, scenarios and assertions."""

    scenario: list[ScenarioTable]
    title: str | None = None
    engine: str | None = None
    speed_rpm: Annotated[float, between(10.0, 30000.0, "rev/min", "speed")] | None = None
    start_limit_s: Annotated[float, between(0.01, 1e6, "s", "time")] | None = None
    step_limit_s: Annotated[float, between(0.01, 1e6, "s", "time")] | None = None
    angle: str | None = None
    abscissa: str | None = None
    valvetrain: bool | None = None
    units: dict[str, UnitTable] = field(default_factory=dict)
    connections: ConnectionsTable | None = None
    power: dict[str, PowerTable] = field(default_factory=dict)
    recording: RecordingTable | None = None

    remedy = "give at least one [[scenario]], with a name"
