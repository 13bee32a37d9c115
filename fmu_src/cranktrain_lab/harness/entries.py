"""Contents of a harness file, checked as far as possible without its FMUs; times in s."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cranktrain_lab.coupling.recording_unit import Recording
from cranktrain_lab.coupling.run import Bond, Steps
from cranktrain_lab.coupling.supervised import Limits

Variable = tuple[str, str]
"""Names of a unit and of its variable."""

LAST, ZERO, NAN = "last", "zero", "nan"
GIVES = (LAST, ZERO, NAN)
"""Kinds of value of an input while the input's connection is interrupted."""
FAILS, HANGS, DIES = "fails", "hangs", "dies"
KINDS = (FAILS, HANGS, DIES, NAN)
"""Faults of a unit: it refuses a step, does not return from it, ends its process, or outputs NaN."""
FINAL, MEAN, LEAST, LARGEST = "final", "mean", "minimum", "maximum"
SWING, RMS, ORDER = "peak_to_peak", "rms", "order"
MEASURES = (FINAL, MEAN, LEAST, LARGEST, SWING, RMS, ORDER)
"""Quantities of a time series that an assertion may test."""
TO_THE_END, BY_FAILURE = "runs to the end", "fails"
ENDS = (TO_THE_END, BY_FAILURE)
"""Ways in which a scenario may end."""


@dataclass(frozen=True)
class UnitEntry:
    """Unit with its FMU file or the name of what to build, and start values with optional units of measurement."""

    fmu: Path | None = None
    build: str | None = None
    start: Mapping[str, tuple[Any, str]] = field(default_factory=dict)
    record: tuple[str, ...] = ()


@dataclass(frozen=True)
class Change:
    """Linear change of an input to a new value between two times, or a jump if the times are equal.

    ``value`` None is the start value; ``unit`` is the unit of measurement, empty for the input's own. The unit in
    ``target`` is empty if only one unit has this input. ``other`` takes its place if no unit has it: spark ignition has
    an air ratio for the fuel.
    """

    target: Variable
    begin: float
    end: float
    value: float | None
    unit: str = ""
    other: Variable | None = None


@dataclass(frozen=True)
class Noise:
    """Normally distributed noise that is added to an input, with standard deviation and seed."""

    target: Variable
    begin: float
    end: float
    size: float
    unit: str
    seed: int


@dataclass(frozen=True)
class Dropout:
    """Interruption of an input's connection between two times, and kind of the input's value meanwhile."""

    target: Variable
    begin: float
    end: float
    gives: str


@dataclass(frozen=True)
class Fault:
    """Fault of a unit from a time on; ``output`` is the output that becomes NaN, or empty for all outputs."""

    unit: str
    begin: float
    kind: str
    output: str = ""


@dataclass(frozen=True)
class Bounds:
    """Requirement on a number: ``expected`` within a tolerance, or a value between two bounds.

    ``relative`` is a fraction of the expected value, ``absolute`` in the unit of the number.
    """

    expected: float | None = None
    relative: float | None = None
    absolute: float | None = None
    least: float | None = None
    most: float | None = None

    @property
    def room(self) -> float:
        """Allowed deviation from ``expected``; 0 if ``expected`` is not given."""
        return self.absolute if self.absolute is not None else abs((self.relative or 0.0) * (self.expected or 0.0))

    @property
    def largest(self) -> float:
        """Largest allowed value; infinite if unbounded."""
        if self.expected is not None:
            return self.expected + self.room
        return math.inf if self.most is None else self.most


@dataclass(frozen=True)
class Assertion:
    """Required value of an output, or of the residual of a power bond.

    Attributes
    ----------
    name : name in reports; if empty, made from the other entries
    output, residual : exactly one is given
    measure, order : a name of MEASURES, and the order for measure ``order``
    cycles, begin, end : window, as number of last cycles or as two times; by default the whole run
    bounds : required value
    unit : unit of measurement; empty for the output's own
    ratio_to : scenario by whose value the value is divided
    """

    name: str
    output: Variable | None
    residual: str
    measure: str
    order: float
    cycles: float | None
    begin: float
    end: float
    bounds: Bounds
    unit: str = ""
    ratio_to: str = ""


@dataclass(frozen=True)
class Ending:
    """Required end of a scenario; for a failure: the unit, the time (s, ± ``tolerance``) and words of the message."""

    how: str = TO_THE_END
    unit: str = ""
    at: float | None = None
    tolerance: float = 0.0
    says: str = ""


@dataclass(frozen=True)
class Way:
    """Settings of a scenario's run."""

    stop: float
    steps: Steps
    scheme: str
    reconstruction: str


@dataclass(frozen=True)
class Scenario:
    """Scenario: one run with its events and assertions."""

    name: str
    way: Way
    start: Mapping[str, Mapping[str, tuple[Any, str]]]
    changes: tuple[Change, ...]
    noises: tuple[Noise, ...]
    dropouts: tuple[Dropout, ...]
    faults: tuple[Fault, ...]
    assertions: tuple[Assertion, ...]
    ending: Ending


def file_name(scenario: str) -> str:
    """Return the name of a scenario's result file, without the file extension."""
    return scenario.replace(" ", "_")


@dataclass(frozen=True)
class Harness:
    """Contents of a harness file.

    Attributes
    ----------
    title, path : title in reports, and path of the file
    speed : speed of the shaft at the start, rad/s; None if no unit is the cranktrain
    units : units by name
    links : connections as text; None for those of the virtual engine
    by_name : True if other inputs are connected to the only output of their name
    bonds : power bonds in addition to the virtual engine's
    abscissa, angle : output over which values are reconstructed, and output over which orders are counted
    limits : limits of the wall time of calls
    recording : measurement that replaces the combustion, or None
    scenarios : scenarios in the order of the file
    """

    title: str
    path: Path
    speed: float | None
    units: Mapping[str, UnitEntry]
    links: tuple[str, ...] | None
    by_name: bool
    bonds: tuple[Bond, ...]
    abscissa: Variable | None
    angle: Variable | None
    limits: Limits
    recording: Recording | None
    scenarios: tuple[Scenario, ...]
