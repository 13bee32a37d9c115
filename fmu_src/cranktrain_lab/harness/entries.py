"""Contents of a harness file, checked as far as possible from the file alone; times in s."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cranktrain_lab.coupling.recording_unit import Recording
from cranktrain_lab.coupling.run import Bond, Steps
from cranktrain_lab.coupling.supervised import Limits

Variable = tuple[str, str]
"""Unit and name."""

LAST, ZERO, NAN = "last", "zero", "nan"
GIVES = (LAST, ZERO, NAN)
"""Value of an input while its connection is interrupted."""
FAILS, HANGS, DIES = "fails", "hangs", "dies"
KINDS = (FAILS, HANGS, DIES, NAN)
"""Faults of a unit: it refuses a step, does not return from it, ends its process, or outputs NaN."""
FINAL, MEAN, LEAST, LARGEST = "final", "mean", "minimum", "maximum"
SWING, RMS, ORDER = "peak_to_peak", "rms", "order"
MEASURES = (FINAL, MEAN, LEAST, LARGEST, SWING, RMS, ORDER)
"""Quantities of a time series that an assertion may test."""
TO_THE_END, BY_FAILURE = "runs to the end", "fails"
ENDS = (TO_THE_END, BY_FAILURE)
"""How a scenario may end."""


@dataclass(frozen=True)
class UnitEntry:
    """One unit: the file of its FMU, or what to build; its start values, each with a unit of measurement or none."""

    fmu: Path | None = None
    build: str | None = None
    start: Mapping[str, tuple[Any, str]] = field(default_factory=dict)
    record: tuple[str, ...] = ()


@dataclass(frozen=True)
class Change:
    """An input that goes to a value between two times, linearly; at once where they are equal.

    ``value`` None is the start value; ``unit`` is that of measurement, empty for the input's own. The target's unit is
    empty where the only one with this input is meant.
    """

    target: Variable
    begin: float
    end: float
    value: float | None
    unit: str = ""


@dataclass(frozen=True)
class Noise:
    """Normally distributed noise added to an input, with a standard deviation; seeded."""

    target: Variable
    begin: float
    end: float
    size: float
    unit: str
    seed: int


@dataclass(frozen=True)
class Dropout:
    """A time in which an input's connection is interrupted, and the input's value meanwhile."""

    target: Variable
    begin: float
    end: float
    gives: str


@dataclass(frozen=True)
class Fault:
    """A unit that misbehaves from a time on; ``output`` of ``nan``: which one, all that are read where empty."""

    unit: str
    begin: float
    kind: str
    output: str = ""


@dataclass(frozen=True)
class Bounds:
    """Required value of a number: ``expected`` within a tolerance, or between two bounds.

    ``relative`` is a fraction of the expected value, ``absolute`` in the unit of the number.
    """

    expected: float | None = None
    relative: float | None = None
    absolute: float | None = None
    least: float | None = None
    most: float | None = None

    @property
    def room(self) -> float:
        """Allowed distance from ``expected``; 0 where it is not given."""
        return self.absolute if self.absolute is not None else abs((self.relative or 0.0) * (self.expected or 0.0))

    @property
    def largest(self) -> float:
        """Largest value that is allowed; infinite where there is none."""
        if self.expected is not None:
            return self.expected + self.room
        return math.inf if self.most is None else self.most


@dataclass(frozen=True)
class Assertion:
    """Required value of an output, or of the residual of a power bond.

    Attributes
    ----------
    name : for people; empty: made of the rest
    output, residual : one of them is given
    measure, order : a name of MEASURES, and the order of ``order``
    cycles, begin, end : window: the last cycles, or between two times; the whole run where nothing is given
    bounds : required value
    unit : of measurement; empty: the output's own
    ratio_to : scenario whose value this one's is divided by
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
    """How a scenario is run."""

    stop: float
    steps: Steps
    scheme: str
    reconstruction: str


@dataclass(frozen=True)
class Scenario:
    """One run with its events and assertions."""

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
    """Name of the result file of a scenario, without its ending."""
    return scenario.replace(" ", "_")


@dataclass(frozen=True)
class Harness:
    """A harness file.

    Attributes
    ----------
    title, path : for people; of the file
    speed : of the shaft at the start, rad/s; None where no unit is the cranktrain
    units : by name
    links : connections as they are written, None: those of the virtual engine
    by_name : whether inputs are connected to the one output of their name besides
    bonds : powers that are exchanged, beside the virtual engine's
    abscissa, angle : outputs over which values are reconstructed, and orders counted
    limits : of calls
    recording : measurement in place of the combustion; None without one
    scenarios : in the file's order
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
