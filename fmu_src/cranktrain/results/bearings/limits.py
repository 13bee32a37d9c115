"""Comparison of a run's bearings with the limits of the engine file."""

from dataclasses import dataclass

from cranktrain.engine.bearing_limits import BIG_END, JUDGED, MAIN, BearingLimits
from cranktrain.results.bearings.cycle import BearingCycle, BearingReport

FAMILIES = {MAIN: "main bearings", BIG_END: "big ends"}
SAID = {
    "film": ("least film", 1e6, "um"),
    "pressure": ("film pressure", 1e-6, "MPa"),
    "specific_load": ("specific load", 1e-6, "MPa"),
    "pv": ("mean p v", 1e-6, "MPa m/s"),
}
"""Name, factor from SI and unit, in messages, of each quantity in ``JUDGED``."""


@dataclass(frozen=True)
class Violation:
    """A violated limit of a bearing: quantity (one of ``JUDGED``), value found and permissible value, SI."""

    bearing: str
    what: str
    value: float
    limit: float

    def __str__(self) -> str:
        name, scale, unit = SAID[self.what]
        side = "below" if self.what == "film" else "above"
        return f"{self.bearing}: {name} {scale * self.value:.3g} {unit} is {side} the limit of {scale * self.limit:.3g}"


def judged(bearing: BearingCycle, what: str) -> float | None:
    """Value of a bearing, SI, that is compared with a limit; None if the bearing's level does not compute it."""
    found = getattr(bearing, what)
    return found if found is None or isinstance(found, float) else float(found.value)


def violations(report: BearingReport) -> list[Violation]:
    """All violations of the engine file's limits by the bearings of a report."""
    limits = report.engine.bearing_limits or BearingLimits()
    found = []
    for bearing in report.bearings:
        for what in JUDGED:
            value, limit = judged(bearing, what), limits.of(bearing.family, what)
            if value is not None and limit and (value < limit if what == "film" else value > limit):
                found.append(Violation(bearing.name, what, value, limit))
    return found


def missing_limits(report: BearingReport) -> list[str]:
    """Keys of ``[bearing_limits]`` that this run has values for but the engine file does not give."""
    limits = report.engine.bearing_limits or BearingLimits()
    keys = {
        f"{bearing.family}_{what}"
        for bearing in report.bearings
        for what in JUDGED
        if judged(bearing, what) is not None and not limits.of(bearing.family, what)
    }
    return [f"{family}_{what}" for family in FAMILIES for what in JUDGED if f"{family}_{what}" in keys]
