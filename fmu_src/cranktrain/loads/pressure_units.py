"""Units of measured pressures, stated by an option or a header."""

import re
from typing import NamedTuple

from cranktrain.core.column_names import kind_of
from cranktrain.core.errors import InputError, shown
from cranktrain.core.units import ATMOSPHERE, known_factor

_PSI, _AT = 6894.757293168, 98066.5
UNITS = {
    "Pa": 1.0, "hPa": 1e2, "mbar": 1e2, "kPa": 1e3, "psi": _PSI, "at": _AT, "kgf/cm2": _AT, "bar": 1e5,
    "atm": ATMOSPHERE, "MPa": 1e6, "N/mm2": 1e6,
}  # fmt: skip
"""Factor to Pa of each unit; a suffix g (psig, barg, kPag) means above one standard atmosphere, a means absolute."""
FOREIGN = {"v", "mv", "pc"}
"""Units of charge amplifiers, which are not units of pressure."""
_ANGLES = {"deg", "degree", "degrees", "degca", "ca", "cad", "°", "°ca", "grad"}
_GAUGE, _ABSOLUTE = {"g", "gauge", "rel", "relative"}, {"a", "abs", "absolute"}
_ENDINGS = {ending: gauge for gauge, endings in ((True, _GAUGE), (False, _ABSOLUTE)) for ending in endings}


class PressureUnit(NamedTuple):
    """Pressure unit: name, factor to Pa, pressure (Pa) at its zero, and how it was found."""

    name: str
    scale: float
    zero: float
    how: str


def known_units() -> str:
    """Return the list of units for messages."""
    return f"{', '.join(UNITS)}; with g for gauge: psig, barg, kPag"


def named_unit(text: str) -> PressureUnit:
    """Return the unit named by an option; ``InputError`` if it is unknown."""
    found = _UNITS.get(_plain(text)) or _spelt(text)
    if found is None:
        raise InputError(f"unknown pressure unit {shown(text)}; known: {known_units()}")
    return found


def header_unit(cells: list[str], name: str) -> PressureUnit | None:
    """Return the unit stated by the cells of a header, whose last cell is the pressure's; None without a unit.

    A unit is stated in brackets, as last word, or as a whole cell. Raises ``InputError`` for an unknown unit.
    """
    cell = _plain(cells[-1])
    written = [text.strip() for text in re.findall(r"[\[({]([^\])}]*)[\])}]", cells[-1])] or [cells[-1].strip()]
    bracketed = [text.strip() for text in re.findall(r"[\[({]([^\])}]*)[\])}]", cell)]
    words = [word for word in re.split(r"[\s_,;:/\[\](){}]+", cell) if word]
    stated = [_UNITS[word] for word in words if word in _UNITS]
    if "at" in words[:-1] and "at" not in bracketed:  # the word "at" in a text, not technical atmospheres
        stated = [unit for unit in stated if unit.name != "at"]
    if stated:
        unit, gauge = stated[-1], [_ENDINGS[word] for word in words if word in _ENDINGS]
        return _with_zero(unit.name, gauge[-1]) if gauge and unit.zero == 0.0 else unit
    if (found := _spelt(written[-1])) is not None:
        return found
    alone = bool(words) and len(cells) > 1 and cells[0].strip().lower() in _ANGLES
    named = kind_of(cells[-1], ("pressure",)) == "pressure" or (len(words) == 1 and words[0] == "pc")
    foreign = [word for word in words if word in FOREIGN] if len(words) > 1 else []
    unknown = bracketed or foreign or (words if alone and not named else [])
    unknown = [word for word in unknown if word not in _ENDINGS and word not in ("", "p", "pressure")]
    if unknown:
        said = shown(unknown[-1])
        raise InputError(f"{name}: the header's pressure unit {said} is not known; known: {known_units()}")
    return None


def unit_in_text(text: str) -> PressureUnit | None:
    """Return the unit that is the last word of a line or of a bracket at its end; None without a unit."""
    words = [word for word in re.split(r"[\s,;:\[\](){}]+", _plain(text)) if word]
    return _UNITS.get(words[-1]) if words and words[-1] != "at" else None


def _plain(text: str) -> str:
    """Return the text in lower case, with units of force over area as one word."""
    text = re.sub(r"\^2|²", "2", text.strip().lower())
    text = re.sub(r"(kgf|kp|kg)\s*/\s*cm2", "kgfcm2", text)
    return re.sub(r"lbf?\s*/\s*in2", "psi", re.sub(r"n\s*/\s*mm2", "nmm2", text))


def _spelt(text: str) -> PressureUnit | None:
    """Return a unit outside the table, in any spelling of :mod:`cranktrain.core.units`."""
    found = known_factor(text, "absolute pressure")
    if found is None:
        return None
    gauge = " plus one atmosphere (1.01325 bar)" if found.zero else ""
    return PressureUnit(text.strip(), found.scale, found.zero, f"{text.strip()}{gauge}")


def _with_zero(name: str, gauge: bool) -> PressureUnit:
    if not gauge:
        return PressureUnit(name, UNITS[name], 0.0, name)
    return PressureUnit(f"{name} gauge", UNITS[name], ATMOSPHERE, f"{name} gauge plus one atmosphere (1.01325 bar)")


_UNITS = {
    unit.lower().replace("/", "") + ending: _with_zero(unit, ending == "g")
    for unit in UNITS
    for ending in ("", "a", "g")
}
"""Units by their words in lower case."""
