"""Bearing report in engineering units: JSON and tables of ``cranktrain bearing-loads``."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cranktrain.core.units import RPM
from cranktrain.engine.limits import BIG_END, JUDGED, MAIN, BearingLimits
from cranktrain.results.bearings.cycle import BearingCycle, BearingReport, Extreme
from cranktrain.results.columns import NOTHING
from cranktrain.results.summary import grid_errors
from cranktrain.results.tables import Table

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


LITRES_PER_MINUTE = 6.0e4
WORST = {"min_film_um": min, "max_pressure_mpa": max, "specific_load_mpa": max, "pv_mpa_m_s": max}
"""Key of each quantity whose worst value of a family is reported, and the function that gives the worst."""
_KEYS = dict(zip(JUDGED, WORST, strict=True))


def bearings_dict(report: BearingReport, attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Bearing report as JSON-able values. Keys carry units; values that a fidelity level does not compute are None.

    ``attributes`` of the run name its levels. Entry ``grid_errors`` has the possible errors by the grid of elastic
    films in the mains; it is empty for other levels.
    """
    families = {MAIN: report.mains, BIG_END: report.big_ends}
    entries = {family: [_entry(bearing) for bearing in bearings] for family, bearings in families.items()}
    power, squeeze = report.total("friction_power"), report.total("squeeze_power")
    return {
        "speed_rpm": report.speed / RPM,
        "mains": entries[MAIN],
        "big_ends": entries[BIG_END],
        "worst": {family: _worst(rows) for family, rows in entries.items()},
        "friction_power_w": {**{f: report.total("friction_power", f) for f in families}, "all": power},
        "squeeze_power_w": {**{f: report.total("squeeze_power", f) for f in families}, "all": squeeze},
        "fmep_bar": _scaled(report.fmep, 1e-5),
        "squeeze_mep_bar": None if squeeze is None else 1e-5 * report.mean_pressure(squeeze),
        "oil_flow_l_per_min": {f: _scaled(report.total("oil_flow", f), LITRES_PER_MINUTE) for f in families},
        "violations": [{"bearing": v.bearing, "limit": _KEYS[v.what], "text": str(v)} for v in violations(report)],
        "missing_limits": missing_limits(report),
        "grid_errors": grid_errors(attributes, main_films(report)),
    }


def main_films(report: BearingReport) -> list[tuple[str, float, float]]:
    """Name, least film (um) and largest pressure (Pa) of each main bearing with a film."""
    return [(one.name, 1e6 * one.film.value, one.pressure.value) for one in report.mains if one.film and one.pressure]


def _entry(bearing: BearingCycle) -> dict[str, Any]:
    found: dict[str, Any] = {"name": bearing.name, **_extreme("peak_load_kn", bearing.load, 1e-3)}
    found |= _extreme("specific_load_mpa", bearing.specific_load, 1e-6)
    found |= {
        "mean_specific_load_mpa": _scaled(bearing.mean_specific_load, 1e-6),
        "pv_mpa_m_s": _scaled(bearing.pv, 1e-6),
        "peak_pv_mpa_m_s": _scaled(bearing.peak_pv, 1e-6),
    }
    found |= _extreme("min_film_um", bearing.film, 1e6) | _extreme("max_pressure_mpa", bearing.pressure, 1e-6)
    return found | {
        "friction_power_w": bearing.friction_power,
        "squeeze_power_w": bearing.squeeze_power,
        "oil_flow_l_per_min": _scaled(bearing.oil_flow, LITRES_PER_MINUTE),
    }


def _extreme(key: str, extreme: Extreme | None, scale: float) -> dict[str, float | None]:
    """Entries for value, crank angle and angle in the shell of an extreme; ``key`` ends with the unit."""
    stem = key.rpartition("_")[0] if key != "pv_mpa_m_s" else key
    if extreme is None:
        return {key: None}
    angles = {f"{stem}_at_deg": math.degrees(extreme.angle)}
    if extreme.place is not None:
        angles[f"{stem}_place_deg"] = math.degrees(extreme.place)
    return {key: scale * extreme.value, **angles}


def _scaled(value: float | None, scale: float) -> float | None:
    return None if value is None else scale * value


def _worst(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    found = {}
    for key, of in WORST.items():
        values = [row[key] for row in rows if row[key] is not None]
        found[key] = of(values) if values else None
    return found


_LOADS = {
    "peak_load_kn": "load / kN", "peak_load_at_deg": "at / deg", "peak_load_place_deg": "place / deg",
    "specific_load_mpa": "p / MPa", "mean_specific_load_mpa": "mean p / MPa", "pv_mpa_m_s": "mean p v / MPa m/s",
    "peak_pv_mpa_m_s": "largest p v",
}  # fmt: skip
_FILMS = {
    "min_film_um": "film / um", "min_film_at_deg": "at / deg", "min_film_place_deg": "place / deg",
    "max_pressure_mpa": "pressure / MPa", "max_pressure_at_deg": "at / deg", "friction_power_w": "friction / W",
    "squeeze_power_w": "squeeze / W", "oil_flow_l_per_min": "oil / l/min",
}  # fmt: skip
_SPEEDS = {
    "min_film_um": "film / um",
    "max_pressure_mpa": "pressure / MPa",
    "specific_load_mpa": "p / MPa",
    "pv_mpa_m_s": "p v / MPa m/s",
}


def bearing_tables(found: Mapping[str, Any]) -> list[Table]:
    """Tables of loads and of films at one speed, from :func:`bearings_dict`; no table of films without films."""
    rows = [*found["mains"], *found["big_ends"]]
    tables = [_table(f"Loads at {found['speed_rpm']:.0f} rev/min: largest, where, mean", _LOADS, rows)]
    films = [row for row in rows if row["min_film_um"] is not None]
    if films:
        title = f"Films at {found['speed_rpm']:.0f} rev/min: least, largest pressure, mean power and flow"
        tables.append(_table(title, _FILMS, films))
    return tables


def _table(title: str, columns: Mapping[str, str], rows: Sequence[Mapping[str, Any]]) -> Table:
    texts = tuple((str(row["name"]), *(_text(row.get(key), key) for key in columns)) for row in rows)
    return Table(title, ("", *columns.values()), texts)


def _text(value: float | None, key: str) -> str:
    if value is None:
        return NOTHING
    return f"{value:.0f}" if key.endswith("deg") else f"{value:.3g}" if abs(value) < 1e3 else f"{value:.0f}"


def speed_table(speeds: Sequence[Mapping[str, Any]]) -> Table:
    """Table of friction and of each bearing family's worst values over speed, from one report per speed."""
    families = {"main": "mains", "big_end": "big ends"}
    header = [f"{name}: {words}" for name in families.values() for words in _SPEEDS.values()]
    rows = []
    for found in speeds:
        texts = [_text(found["worst"][family][key], key) for family in families for key in _SPEEDS]
        friction = (found["friction_power_w"]["all"], found["fmep_bar"])
        rows.append((f"{found['speed_rpm']:.0f}", *texts, *(_text(value, "") for value in friction)))
    return Table("Worst bearing over speed", ("rev/min", *header, "friction / W", "fmep / bar"), tuple(rows))


def total_text(found: Mapping[str, Any]) -> str:
    """One line on friction and oil flow of all bearings at one speed; empty without films."""
    power, flow = found["friction_power_w"], found["oil_flow_l_per_min"]
    if power["all"] is None:
        return ""
    parts = ", ".join(
        f"{words} {power[family]:.4g} W and {flow[family]:.3g} l/min"
        for family, words in FAMILIES.items()
        if power[family] is not None
    )
    squeeze, mean = found["squeeze_power_w"]["all"], found["squeeze_mep_bar"]
    return f"Friction and oil: {parts}; fmep {found['fmep_bar']:.3g} bar; squeeze {squeeze:.4g} W, {mean:.3g} bar"
