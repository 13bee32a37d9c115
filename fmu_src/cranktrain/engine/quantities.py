"""What the values of an engine file measure and may be: the annotations of their fields.

The reader of engine files takes units from them, :func:`check_values` bounds. Everything is a float in SI.
"""

from __future__ import annotations

import math
from dataclasses import fields
from functools import cache
from itertools import pairwise
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

from cranktrain.core.errors import InputError, nearest

ZERO_CELSIUS = 273.15

# dimension: its units and their factors to SI, the unit of SI first; frequencies stay in Hz
UNITS: dict[str, dict[str, float]] = {
    "1": {"1": 1.0, "%": 0.01},
    "length": {"m": 1.0, "mm": 1e-3, "um": 1e-6},
    "angle": {"rad": 1.0, "deg": math.pi / 180.0},
    "velocity": {"m/s": 1.0},
    "mass": {"kg": 1.0, "g": 1e-3},
    "inertia": {"kg m^2": 1.0},
    "density": {"kg/m^3": 1.0},
    "pressure": {"Pa": 1.0, "kPa": 1e3, "bar": 1e5, "MPa": 1e6, "GPa": 1e9},
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
    "speed": {"rad/s": 1.0, "rev/min": math.pi / 30.0},
    "frequency": {"Hz": 1.0},
    "rate": {"1/s": 1.0},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6},
    "area": {"m^2": 1.0, "cm^2": 1e-4},
    "heat transfer": {"W/(m^2 K)": 1.0},
    "heat flux": {"W/m^2": 1.0, "kW/m^2": 1e3},
    "energy": {"J": 1.0, "kJ": 1e3},
}
OFFSETS = {"degC": ZERO_CELSIUS}
SHOWN = {"length": "mm", "angle": "deg", "temperature": "degC"}
"""Units of messages where they are not those of SI."""


class Quantity(NamedTuple):
    """What a field measures, the interval it lies in (SI; a square bracket: the end counts), and a hint on values."""

    dimension: str = "1"
    within: str = "(0, inf)"
    hint: str = ""

    def wrong(self, value: float) -> str:
        """What is wrong with a value; empty where nothing is."""
        low, high = map(float, self.within[1:-1].split(","))
        from_low, to_high = self.within[0] == "[", self.within[-1] == "]"
        if (low < value or (from_low and value == low)) and (value < high or (to_high and value == high)):
            return ""
        own = "" if self.dimension == "1" else next(iter(UNITS[self.dimension]))
        must = [f"be {'at least' if from_low else 'above'} {low:g} {own}".rstrip()] if low > -math.inf else []
        must = ["be positive"] if self.within.startswith("(0,") else must
        must += [f"{'at most' if to_high else 'below'} {high:g} {own}".rstrip()] if high < math.inf else []
        unit = SHOWN.get(self.dimension, own)
        value = (value - OFFSETS.get(unit, 0.0)) / UNITS[self.dimension].get(unit, 1.0)
        text = f"{value:.4g} {unit}".rstrip() + f" must {' and '.join(must) or 'be finite'}"
        return f"{text}; {self.hint}" if self.hint else text


class OneOf(NamedTuple):
    """A name out of several, of what the noun says."""

    noun: str
    names: tuple[str, ...]

    def wrong(self, value: str) -> str:
        """What is wrong with a name; empty where nothing is."""
        return "" if value in self.names else f"unknown {self.noun} '{value}'; {nearest(value, self.names)}"


NONNEGATIVE, EITHER = "[0, inf)", "(-inf, inf)"
_UNIT_CHECK = "check its unit"

Number = Annotated[float, Quantity("1", NONNEGATIVE)]
Positive = Annotated[float, Quantity()]
Count = Annotated[int, Quantity("1", "[1, inf)")]
Share = Annotated[float, Quantity("1", "(0, 1]")]
HeatShare = Annotated[float, Quantity("1", "(0, 1]", "it is a part of the friction power")]
PoissonRatio = Annotated[float, Quantity("1", "(0, 0.5)")]
CompressionRatio = Annotated[float, Quantity("1", "(1, inf)")]
DampingRatio = Annotated[float, Quantity("1", "[0, 1)", "a larger ratio is overcritical")]
Friction = Annotated[float, Quantity("1", "[0, 1)", "lubricated surfaces have 0.08 to 0.15")]
AsperityFactor = Annotated[float, Quantity("1", "(0, 1)", "usual surfaces have 0.03 to 0.05")]
AsperityRatio = Annotated[float, Quantity("1", "(0, 1)", "usual surfaces have 0.0001 to 0.01")]
FlowExponent = Annotated[float, Quantity("1", "(0, 1)", "silicone oils of high viscosity have 0.2 to 0.5")]
RollerProfile = Annotated[float, Quantity("1", "[0, 0.01]", "usual: 0 (straight) or 0.00035")]
Length = Annotated[float, Quantity("length", "(0, 10)", _UNIT_CHECK)]
ReliefDepth = Annotated[float, Quantity("length", "[0, 1e-4]", "shells that have run in have 0 to 20 um")]
ReliefExponent = Annotated[float, Quantity("1", "[1, 10]", "2 is a parabola")]
Clearance = Annotated[float, Quantity("length", "[0, 10)", _UNIT_CHECK)]
Offset = Annotated[float, Quantity("length", EITHER)]
Angle = Annotated[float, Quantity("angle", EITHER)]
Duration = Annotated[float, Quantity("angle")]
Mass = Annotated[float, Quantity("mass")]
Inertia = Annotated[float, Quantity("inertia")]
AddedInertia = Annotated[float, Quantity("inertia", NONNEGATIVE)]
Density = Annotated[float, Quantity("density")]
Pressure = Annotated[float, Quantity("pressure")]
GaugePressure = Annotated[float, Quantity("pressure", NONNEGATIVE)]
Stiffness = Annotated[float, Quantity("stiffness")]
SupportStiffness = Annotated[float, Quantity("stiffness", NONNEGATIVE)]
Damping = Annotated[float, Quantity("damping", NONNEGATIVE)]
TorsionalStiffness = Annotated[float, Quantity("torsional stiffness")]
SupportTorsionalStiffness = Annotated[float, Quantity("torsional stiffness", NONNEGATIVE)]
TorsionalDamping = Annotated[float, Quantity("torsional damping", NONNEGATIVE)]
Viscosity = Annotated[float, Quantity("viscosity")]
KinematicViscosity = Annotated[float, Quantity("kinematic viscosity")]
PressureCoefficient = Annotated[float, Quantity("pressure coefficient", "[0, 1e-6)", "oils have 15 to 25 1/GPa")]
Temperature = Annotated[float, Quantity("temperature")]
TemperatureDifference = Annotated[float, Quantity("temperature difference")]
HeatCapacity = Annotated[float, Quantity("heat capacity")]
HeatTransfer = Annotated[float, Quantity("heat transfer")]
HeatFlux = Annotated[float, Quantity("heat flux")]
Speed = Annotated[float, Quantity("speed", NONNEGATIVE)]
RatedSpeed = Annotated[float, Quantity("speed")]
Velocity = Annotated[float, Quantity("velocity")]
Frequency = Annotated[float, Quantity("frequency", NONNEGATIVE)]
WorkingFrequency = Annotated[float, Quantity("frequency", hint="give the torsional frequency that the damper works at")]
Rate = Annotated[float, Quantity("rate", NONNEGATIVE)]
Time = Annotated[float, Quantity("time", NONNEGATIVE)]
Energy = Annotated[float, Quantity("energy")]
Area = Annotated[float, Quantity("area")]

NEWTONIAN, SHEAR_THINNING, COMPLEX_MODULUS = DAMPER_LAWS = ("newtonian", "shear-thinning", "complex-modulus")
TORSIONAL_SOURCES = ("solid", "solid-on-bearings", "ker-wilson", "carter")
ROLLER_CONTACTS = ("palmgren", "iso16281")

Groove = Annotated[str, OneOf("groove", ("none", "circumferential"))]
OilLaw = Annotated[str, OneOf("law", ("vogel", "walther"))]
Compressibility = Annotated[str, OneOf("law", ("none", "dowson-higginson"))]
PressureLaw = Annotated[str, OneOf("law", ("none", "barus", "roelands"))]
RollerContact = Annotated[str, OneOf("law", ROLLER_CONTACTS)]
RollerLaw = Annotated[str, OneOf("law", ("linear", *ROLLER_CONTACTS))]
DamperKind = Annotated[str, OneOf("kind", ("viscous", "rubber"))]
DamperLaw = Annotated[str, OneOf("law", DAMPER_LAWS)]
DampingKind = Annotated[str, OneOf("kind", ("modal", "rayleigh"))]
TorsionalSource = Annotated[str, OneOf("source", TORSIONAL_SOURCES)]


@cache
def kinds(part: type) -> dict[str, tuple[type, bool, Any]]:
    """Fields of a dataclass: type of a value, whether there are many, and what it measures (None where unsaid)."""
    found = {}
    for name, hint in get_type_hints(part, include_extras=True).items():
        many = get_origin(hint) is tuple
        kind = get_args(hint)[0] if many else hint
        plain, rule = get_args(kind)[:2] if get_origin(kind) is Annotated else (kind, None)
        found[name] = (plain, many, rule)
    return found


def check_values(part: Any, table: str) -> None:
    """Refuse a value outside its field's bounds; defaults pass: a 0 there may say that nothing was given.

    Raises ``InputError``: one line that starts with ``table.key``.
    """
    for entry in fields(part):
        _, many, rule = kinds(part.__class__)[entry.name]
        value = getattr(part, entry.name)
        if rule is None or value == entry.default:
            continue
        for i, one in enumerate(value if many else (value,), start=1):
            if wrong := rule.wrong(one):
                need(table, f"{entry.name}[{i}]" if many else entry.name, False, wrong)


def need(table: str, key: str, holds: bool, text: str) -> None:
    """Refuse with one line that starts with ``table.key`` (``key`` of no table), unless ``holds``; ``InputError``."""
    if not holds:
        raise InputError(f"{table}.{key}: {text}".lstrip("."))


def need_equal_lengths(part: Any, table: str, *keys: str) -> None:
    """Refuse lists of a part (all where no ``keys`` are named) that are not as long as the first; ``InputError``."""
    lists = {key: len(value) for key, value in vars(part).items() if key in keys or (not keys and type(value) is tuple)}
    first, count = next(iter(lists.items()))
    for key, length in lists.items():
        need(table, key, length == count, f"{length} values for {count} in {first}; give one for each")


def need_table(table: str, part: Any) -> None:
    """Refuse ``temperatures`` of a part that are not one for each of its increasing ``temperature_speeds``."""
    speeds, count = part.temperature_speeds, len(part.temperatures)
    text = f"{count} temperatures for {len(speeds)} speeds; give one for each"
    need(table, "temperatures", count == len(speeds) > 0, text)
    need(table, "temperature_speeds", all(a < b for a, b in pairwise(speeds)), "must increase")


def mm(length: float) -> str:
    """A length (m) as a message says it."""
    return f"{1e3 * length:.4g} mm"
