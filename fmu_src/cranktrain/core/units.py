"""Units as engineers write them, converted to SI.

``UNITS`` is a table for fast conversion of the units that cranktrain itself writes. Every other spelling (``kN·m/rad``,
``kg cm²``, ``lbf in s^2``, ``1/min``, ``°C``, ``bar(g)``) is read by pint, which is loaded only when needed.

A plane angle is a dimension of its own here, so ``N m/rad`` differs from ``N m``, and ``rev/min`` is not a frequency.
Three spellings have a second meaning, which is used only if the first one does not have the wanted dimension: ``lb``
and ``kg`` as forces (``lb in`` as a torque, ``kg/cm2`` as a pressure), a product after a slash as divisor
(``W/m2 K``), and ``1/min`` as a speed of rotation.
"""

import math
import re
from collections.abc import Iterator
from difflib import get_close_matches
from functools import cache
from typing import Any, NamedTuple

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.unit_words import ANGLES, BASES, DOUBTFUL, FORCES, KELVINS, PARTS, SIGNS, WORDS

ZERO_CELSIUS = 273.15
RPM = math.pi / 30.0
"""One revolution per minute in rad/s."""
ATMOSPHERE = 101325.0
"""Zero of gauge pressures, Pa."""

_PRESSURES = {"Pa": 1.0, "kPa": 1e3, "bar": 1e5, "MPa": 1e6, "GPa": 1e9}
# For each dimension its units and their factors to SI, the SI unit first; frequencies stay in Hz.
UNITS: dict[str, dict[str, float]] = {
    "1": {"1": 1.0, "%": 0.01},
    "length": {"m": 1.0, "mm": 1e-3, "um": 1e-6},
    "angle": {"rad": 1.0, "deg": math.pi / 180.0},
    "velocity": {"m/s": 1.0},
    "mass": {"kg": 1.0, "g": 1e-3, "mg": 1e-6},
    "inertia": {"kg m^2": 1.0},
    "density": {"kg/m^3": 1.0},
    "pressure": _PRESSURES,
    "absolute pressure": _PRESSURES,
    "gauge pressure": _PRESSURES,
    "force": {"N": 1.0, "kN": 1e3},
    "torque": {"N m": 1.0, "kN m": 1e3},
    "stiffness": {"N/m": 1.0, "N/mm": 1e3},
    "damping": {"N s/m": 1.0},
    "torsional stiffness": {"N m/rad": 1.0},
    "torsional damping": {"N m s/rad": 1.0},
    "viscosity": {"Pa s": 1.0, "mPa s": 1e-3},
    "kinematic viscosity": {"m^2/s": 1.0, "mm^2/s": 1e-6},
    "pressure coefficient": {"1/Pa": 1.0, "1/GPa": 1e-9},
    "heat capacity": {"J/(kg K)": 1.0},
    "temperature": {"K": 1.0, "degC": 1.0},
    "temperature difference": {"K": 1.0},
    "speed": {"rad/s": 1.0, "rev/min": RPM},
    "frequency": {"Hz": 1.0},
    "rate": {"1/s": 1.0},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6},
    "area": {"m^2": 1.0, "cm^2": 1e-4, "mm^2": 1e-6},
    "second moment of area": {"m^4": 1.0, "cm^4": 1e-8, "mm^4": 1e-12},
    "heat transfer": {"W/(m^2 K)": 1.0},
    "pressure times velocity": {"Pa m/s": 1.0, "MPa m/s": 1e6},
    "heat flux": {"W/m^2": 1.0, "kW/m^2": 1e3},
    "power": {"W": 1.0, "kW": 1e3, "MW": 1e6},
    "energy": {"J": 1.0, "kJ": 1e3},
    "specific energy": {"J/kg": 1.0, "MJ/kg": 1e6},
}
OFFSETS = {"degC": ZERO_CELSIUS}
FURTHER = {
    "volume": "m^3", "acceleration": "m/s^2", "angular acceleration": "rad/s^2", "volume flow": "m^3/s",
    "mass flow": "kg/s", "angular jerk": "rad/s^3", "voltage": "V", "current": "A",
}  # fmt: skip
"""Dimensions of measured signals that do not occur in engine files, and their SI units."""

_DEGREES = re.compile(
    r"°\s*(?:c\.?a\.?(?:d)?|cr\.?a|cra|kw|crank)?|(?:deg(?:rees?)?|grad)[\s_.*-]*(?:c\.?a\.?|cra|kw|crank)|cad|d?ca|kw°"
)
_GAUGE = re.compile(r"(.*?[^\s(])\s*\(?\s*(g|gauge|ga|rel|relative?|ü|a|abs|absolute?)\s*\)?", re.IGNORECASE)
_TOKEN = re.compile(r"\s*(?:([^\W\d_]+|%|‰|\")(?:\^?\(?([+-]?\d+)\)?)?|(1(?:0+(?:\.0)?)?)(?:\^([+-]?\d+))?|([*/()]))")
_EXAMPLES = "'N m/rad', 'kg cm^2', 'rev/min', 'degC'"


class UnitFactor(NamedTuple):
    """Conversion of a unit to SI: value · ``scale`` + ``zero`` is in the unit ``si``."""

    scale: float
    zero: float
    si: str


def to_si(value: Any, unit: str, dimension: str | None = None) -> Any:
    """Number or array converted to SI.

    Raises ``InputError`` for an unknown unit or one that is not of ``dimension``, a key of ``UNITS``.
    """
    scale, zero, _ = unit_factor(unit, dimension)
    return value * scale + zero


def unit_factor(unit: str, dimension: str | None = None) -> UnitFactor:
    """Scale, offset and SI unit of a unit's spelling; without ``dimension`` the unit may have any.

    Raises
    ------
    InputError
        one line: the unit is unknown or has another dimension; with the nearest valid spelling
    """
    found = _quick(unit, dimension) or _read(unit, dimension)
    if isinstance(found, str):
        raise InputError(found)
    return found


def known_factor(unit: str, dimension: str | None = None) -> UnitFactor | None:
    """Scale, offset and SI unit of a unit's spelling; None if the unit is unknown or has another dimension."""
    found = _quick(unit, dimension) or _read(unit, dimension)
    return None if isinstance(found, str) else found


def is_unit(text: str) -> bool:
    """True if a text is the spelling of a unit; ``-`` and an empty text are not."""
    return known_factor(text) is not None


def base_powers(si: str) -> dict[str, int]:
    """Powers of kg, m, s, A, K, mol, cd and rad in an SI unit."""
    items = dict(_quantity("".join(_terms(_plain(si)) or ())).unit_items())
    return {BASES[unit]: int(power) for unit, power in items.items() if unit in BASES}


def other_units(dimension: str) -> list[str]:
    """Units of the table ``UNITS`` that do not have the given dimension."""
    own = UNITS[dimension]
    return list(dict.fromkeys(unit for units in UNITS.values() for unit in units if unit not in own))


def _quick(unit: str, dimension: str | None) -> UnitFactor | None:
    """Factor of a unit in the table ``UNITS``; None if the table lacks the unit."""
    for known in UNITS.values() if dimension is None else (UNITS.get(dimension, {}),):
        if unit in known:
            return UnitFactor(known[unit], OFFSETS.get(unit, 0.0), next(iter(known)))
    return None


@cache
def _read(unit: str, dimension: str | None) -> UnitFactor | str:
    """Factor of a unit read by pint; an error message if the unit is unknown or has another dimension."""
    text = " ".join(_plain(unit).split())
    if dimension == "1" and text.lower() in ("", "-", "none"):
        return UnitFactor(1.0, 0.0, "1")
    degrees = KELVINS.get(text.lower()) if dimension in (None, "temperature") else None
    if dimension == "temperature difference" and KELVINS.get(text.lower(), "kelvin") != "kelvin":
        return f"unit {shown(unit)} measures temperature, not temperature difference; did you mean 'K'?"
    if degrees == "degC" and (dimension or len(text) > 1):
        return UnitFactor(1.0, ZERO_CELSIUS, "K")
    if degrees and (dimension or len(text) > 1):
        zero, one = (_registry().Quantity(degree, degrees).to("kelvin").magnitude for degree in (0, 1))
        return UnitFactor(float(one - zero), float(zero), "K")
    if (gauge := _gauge(text, dimension)) is not None:
        return gauge
    others, strange = list[str](), None
    for expression in _readings(text, dimension):
        quantity = _quantity(expression)
        if quantity is None:
            continue
        for name, own in _dimensions(dimension).items():
            if own == quantity.dimensionality:
                return _factor(quantity, name)
        powers = dict(quantity.unit_items()).items()
        base = " ".join(str(unit) if power == 1 else f"{unit}^{power}" for unit, power in powers)
        strange = strange or UnitFactor(float(quantity.magnitude), 0.0, base)
        others += [name for name, own in _dimensions(None).items() if own == quantity.dimensionality]
    valid = [known for name in UNITS if dimension in (None, name) for known in UNITS[name]]
    if strange and dimension is None:
        return strange
    if strange:
        what = f"measures {others[0]}, not {dimension}" if others else f"does not measure {dimension}"
        return f"unit {shown(unit)} {what}; {nearest(unit, valid)}"
    if KELVINS.get(text.lower()) and dimension is not None:
        return f"unit {shown(unit)} measures temperature, not {dimension}; {nearest(unit, valid)}"
    if dimension is None and not get_close_matches(unit, valid, n=1, cutoff=0.5):
        return f"unit {shown(unit)} is not known; write it as in {_EXAMPLES}"
    return f"unit {shown(unit)} is not known; {nearest(unit, valid)}"


def _plain(unit: str) -> str:
    """Spelling in ASCII; degrees of crank angle become degrees."""
    text = unit.strip().replace("H2O", "HtO")
    for written, plain in SIGNS.items():
        text = text.replace(written, plain)
    text = text.strip("[]{}").strip()
    if text.startswith("(") and text.endswith(")") and text.count("(") == 1:
        text = text[1:-1].strip()
    if text in ("''",):
        return '"'
    if text.lower() in KELVINS:
        return text
    if text.startswith("/"):
        text = f"1{text}"
    if _DEGREES.fullmatch(text.lower()):
        return "deg"
    return re.sub(r"°(?:\s*(?:CA|KW|CrA))?(?![CFK]\b)", "deg", text).replace("°C", "kelvin").replace("°", "deg")


def _gauge(text: str, dimension: str | None) -> UnitFactor | None:
    """Factor of a pressure unit marked as gauge or absolute; None for all other units."""
    if dimension not in (None, "pressure", "absolute pressure", "gauge pressure"):
        return None
    match = _GAUGE.fullmatch(text.replace("atü", "at ü"))
    if match is None or text in WORDS:
        return None
    inner = _read(match[1], "pressure")
    if isinstance(inner, str):
        return None
    gauge = match[2][0].lower() in "grü"
    if (dimension == "pressure" and gauge) or (dimension == "gauge pressure" and not gauge):
        return None
    return inner._replace(zero=ATMOSPHERE if gauge and dimension != "gauge pressure" else 0.0)


def _readings(text: str, dimension: str | None) -> Iterator[str]:
    """Possible meanings of a spelling as pint expressions, the plain meaning first."""
    terms = _terms(text)
    if terms is None:
        return
    per_minute = "".join(terms) in ("1/minute", "minute**-1")
    if per_minute and dimension in (None, "speed"):
        yield "plane_turn/minute"
    forced = [re.sub(r"^(pound|kg|g|ounce|tonne)\b", lambda found: FORCES[found[0]], term) for term in terms]
    for words in (terms, forced):
        yield "".join(words)
        if words.count("/") == 1 and "(" not in words:
            at = words.index("/")
            yield "".join((*words[:at], "/(", *words[at + 1 :], ")"))


def _terms(text: str) -> list[str] | None:
    """Words of pint and the signs between them; None if a word is unknown."""
    # The spellings N-m and N.m are products; min-1 is a power.
    text = re.sub(r"(?<=[^\W\d_])[.\-](?=[^\W\d_])", "*", text)
    text = re.sub(r"(?<=\d)[.\-](?=[^\W\d_])", "*", text)
    terms, at = list[str](), 0
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            return None
        word, power, number, exponent, sign = match.groups()
        at = match.end()
        if sign in (None, "(") and terms and terms[-1] not in ("*", "/", "("):
            terms.append("*")
        if sign is not None:
            terms.append(sign)
            continue
        if number is not None:
            terms.append(f"{number}**{exponent}" if exponent else number)
            continue
        known = _word(word)
        if known is None:
            return None
        for k, part in enumerate(known):
            own = f"**{power}" if power and k == len(known) - 1 else ""
            terms += [*(["*"] if k else []), f"{part}{own}"]
    return terms


def _word(word: str) -> list[str] | None:
    """Pint's words for one word of a unit, several for a product without a sign, such as kNm; None if unknown."""
    if word in WORDS:
        return [WORDS[word]]
    if word in DOUBTFUL:
        return None
    if (parts := _split(word)) is not None:
        return [WORDS[part] for part in parts]
    registry = _registry()
    for own in (word, word.lower()):
        try:
            registry.parse_units(own)
        except Exception:  # pint's parser raises what Python's tokenizer does, too
            continue
        return [own]
    return None


def _split(word: str) -> list[str] | None:
    """Known symbols that make up a word, the longest first; None if it cannot be split."""
    for part in PARTS:
        if word.startswith(part):
            rest = word[len(part) :]
            if not rest:
                return [part]
            if (others := _split(rest)) is not None:
                return [part, *others]
    return None


@cache
def _registry() -> Any:
    """Unit registry of pint with exact fractions and the plane angle as a dimension."""
    from fractions import Fraction

    import pint

    registry: Any = pint.UnitRegistry(non_int_type=Fraction)
    for line in ANGLES:
        registry.define(line)
    return registry


@cache
def _quantity(expression: str) -> Any:
    """One unit in base units; None if pint cannot read the unit, or its size is not finite and positive."""
    try:
        found = _registry().parse_expression(expression or "1").to_base_units()
        return found if 0.0 < float(found.magnitude) < math.inf else None
    except AttributeError:  # the expression is a plain number
        return None if re.search(r"[a-z]", expression) else _registry().Quantity(1, "")
    except Exception:  # pint, its tokenizer or arithmetic fails: not a unit
        return None


@cache
def _dimensions(dimension: str | None) -> dict[str, Any]:
    """Pint's dimensionality of one dimension, or of all dimensions."""
    names = {name: next(iter(known)) for name, known in UNITS.items()} | FURTHER
    if dimension is not None:
        names = {dimension: names[dimension]}
    return {
        name: _quantity("".join(_terms(unit) or ())).dimensionality for name, unit in names.items() if unit is not None
    }


def _factor(quantity: Any, dimension: str) -> UnitFactor:
    """Factor of a quantity to SI; the factor in the table ``UNITS`` if the table has the same unit."""
    factor = float(quantity.magnitude)
    known = UNITS.get(dimension, {FURTHER.get(dimension, ""): 1.0})
    for own in known.values():
        if math.isclose(own, factor, rel_tol=1e-14):
            factor = own
    return UnitFactor(factor, 0.0, next(iter(known)))
