"""Quantities and ranges of an engine file's values, as annotations of their fields.

The reader of engine files takes units from them (:mod:`cranktrain.core.units`), :func:`check_values` takes bounds. All
values are floats in SI.
"""

import math
from dataclasses import fields
from functools import cache
from itertools import pairwise
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.units import OFFSETS as OFFSETS
from cranktrain.core.units import UNITS as UNITS
from cranktrain.core.units import ZERO_CELSIUS as ZERO_CELSIUS

SLOWEST_RPM, FASTEST_RPM = 20.0, 20000.0
"""Range of speeds for runs over cycles, rev/min: slow marine to small racing engines. The FMU takes any from 0."""

ROUNDING = 1e-9
"""Relative tolerance at the ends of a quantity's range, for values converted to SI."""


class Quantity(NamedTuple):
    """Quantity of a field, its range with both ends included in the unit of messages, and a hint for messages.

    Ranges are wide, from table-top models to marine engines; a value outside is a mistake.
    """

    dimension: str
    low: float
    high: float
    unit: str = ""
    hint: str = "check its unit"

    def wrong(self, value: float) -> str:
        """Message for a value (SI) outside the range; empty if it is inside."""
        unit = self.unit or next(iter(UNITS[self.dimension]))
        scale, shift = UNITS[self.dimension][unit], OFFSETS.get(unit, 0.0)
        low, high = (end * scale + shift for end in (self.low, self.high))
        if low - ROUNDING * abs(low) <= value <= high + ROUNDING * abs(high):
            return ""
        said = f"{(value - shift) / scale:.4g}" if abs(value) < math.inf else shown(value)
        own = "" if unit == "1" else f" {unit}"
        text = f"{said}{own} is not within {self.low:g} to {self.high:g}{own}"
        return f"{text}; {self.hint}" if self.hint and not (unit == "1" and self.hint == "check its unit") else text


class OneOf(NamedTuple):
    """Annotation of a text field with the valid ``names``; ``noun`` is the word for such a name in messages."""

    noun: str
    names: tuple[str, ...]

    def wrong(self, value: str) -> str:
        """Message for an unknown name; empty if it is known."""
        return "" if value in self.names else f"unknown {self.noun} '{value}'; {nearest(value, self.names)}"


# Annotated[type, Quantity(dimension, lowest, highest, unit of the range, hint)]
Share = Annotated[float, Quantity("1", 1e-3, 1.0)]
HeatShare = Annotated[float, Quantity("1", 1e-3, 1.0, hint="it is a part of the friction power")]
PoissonRatio = Annotated[float, Quantity("1", 0.0, 0.49)]
CompressionRatio = Annotated[float, Quantity("1", 1.5, 60.0, hint="piston engines have 8 to 24")]
DampingRatio = Annotated[float, Quantity("1", 0.0, 0.99, hint="a larger ratio is overcritical")]
Friction = Annotated[float, Quantity("1", 0.0, 0.99, hint="lubricated surfaces have 0.08 to 0.15")]
LossFactor = Annotated[float, Quantity("1", 1e-3, 1.0, hint="rubbers have 0.1 to 0.5")]
MountLoss = Annotated[float, Quantity("1", 0.0, 20.0, hint="rubber has 0.05 to 0.3, hydraulic mounts up to 3")]
Polytropic = Annotated[float, Quantity("1", 1.0, 1.7, hint="air has 1.4 without cooling, 1.0 at one temperature")]
WiebeFactor = Annotated[float, Quantity("1", 0.1, 50.0, hint="6.908 burns 99.9 %")]
WiebeExponent = Annotated[float, Quantity("1", 0.0, 20.0)]
Falloff = Annotated[float, Quantity("1", 0.0, 10.0)]
Order = Annotated[float, Quantity("1", 0.0, 1000.0)]
AsperityFactor = Annotated[float, Quantity("1", 1e-4, 0.99, hint="usual surfaces have 0.03 to 0.05")]
AsperityRatio = Annotated[float, Quantity("1", 1e-6, 0.99, hint="usual surfaces have 0.0001 to 0.01")]
FlowExponent = Annotated[float, Quantity("1", 0.01, 0.99, hint="silicone oils of high viscosity have 0.2 to 0.5")]
RollerProfile = Annotated[float, Quantity("1", 0.0, 0.01, hint="usual: 0 (straight) or 0.00035")]
ReliefExponent = Annotated[float, Quantity("1", 1.0, 10.0, hint="2 is a parabola")]
RODS_ON_PIN = ("side-by-side", "fork-and-blade", "articulated")
RodsOnPin = Annotated[str, OneOf("arrangement of rods", RODS_ON_PIN)]
Pins = Annotated[int, Quantity("1", 1, 20)]
MountNumber = Annotated[int, Quantity("1", 1, 100)]
Pads = Annotated[int, Quantity("1", 1, 100)]
Rollers = Annotated[int, Quantity("1", 1, 500)]
Modes = Annotated[int, Quantity("1", 1, 2000)]

Size = Annotated[float, Quantity("length", 1.0, 5000.0, "mm")]
Length = Annotated[float, Quantity("length", 0.01, 10000.0, "mm")]
AddedLength = Annotated[float, Quantity("length", 0.0, 10000.0, "mm")]
ShaftStrength = Annotated[float, Quantity("pressure", 0.0, 3000.0, "MPa", "it is the tensile strength")]
Web = Annotated[float, Quantity("length", 0.0, 5000.0, "mm")]
Clearance = Annotated[float, Quantity("length", 0.0, 10.0, "mm")]
Gap = Annotated[float, Quantity("length", 1e-3, 100.0, "mm")]
RadialClearance = Annotated[
    float, Quantity("length", 0.5, 10000.0, "um", "it is the radial clearance, often given in um")
]
Roughness = Annotated[float, Quantity("length", 1e-3, 1000.0, "um")]
Taper = Annotated[float, Quantity("length", 0.01, 5000.0, "um")]
ReliefDepth = Annotated[float, Quantity("length", 0.0, 100.0, "um", "shells that have run in have 0 to 20 um")]
Offset = Annotated[float, Quantity("length", -10000.0, 10000.0, "mm")]
Angle = Annotated[float, Quantity("angle", -720.0, 720.0, "deg")]
Arc = Annotated[float, Quantity("angle", 0.0, 360.0, "deg")]
Cycle = Annotated[float, Quantity("angle", 360.0, 720.0, "deg", "four-strokes have 720 deg, two-strokes 360 deg")]
Period = Annotated[float, Quantity("angle", 1.0, 14400.0, "deg", "four-strokes have 720 deg, two-strokes 360 deg")]
Duration = Annotated[float, Quantity("angle", 0.1, 400.0, "deg")]

Mass = Annotated[float, Quantity("mass", 1e-6, 1e5)]
Inertia = Annotated[float, Quantity("inertia", 1e-9, 1e6)]
ProductOfInertia = Annotated[float, Quantity("inertia", -1e6, 1e6)]
AddedMass = Annotated[float, Quantity("mass", 1e-6, 1e6)]
AddedInertia = Annotated[float, Quantity("inertia", 0.0, 1e6)]
Density = Annotated[float, Quantity("density", 100.0, 25000.0, hint="cast iron has 7200, steel 7850")]
OilDensity = Annotated[float, Quantity("density", 300.0, 3000.0, hint="mineral oil has 850")]

Modulus = Annotated[float, Quantity("pressure", 1e-3, 1e4, "GPa", "steel has 210")]
ContactPressure = Annotated[float, Quantity("pressure", 0.1, 1e5, "MPa")]
ContactShear = Annotated[float, Quantity("pressure", 0.0, 1e4, "MPa")]
Stress = Annotated[float, Quantity("pressure", 1.0, 1e9)]
GasPressure = Annotated[float, Quantity("absolute pressure", 0.01, 50.0, "bar", "it is absolute; check its unit")]
CompressedGas = Annotated[float, Quantity("absolute pressure", 0.01, 5000.0, "bar", "it is absolute; check its unit")]
TracePressure = Annotated[float, Quantity("absolute pressure", 0.0, 1000.0, "bar", "it is absolute; check its unit")]
GaugePressure = Annotated[float, Quantity("gauge pressure", 0.0, 1000.0, "bar")]

Stiffness = Annotated[float, Quantity("stiffness", 1e-3, 1e13)]
SupportStiffness = Annotated[float, Quantity("stiffness", 0.0, 1e13)]
Damping = Annotated[float, Quantity("damping", 0.0, 1e9)]
TorsionalStiffness = Annotated[float, Quantity("torsional stiffness", 1e-6, 1e12)]
GearRatio = Annotated[float, Quantity("1", -1000.0, 1000.0)]
Hysteresis = Annotated[float, Quantity("1", 0.0, 1.0, hint="steel shafts have 0.001 to 0.04, rubber couplings to 0.5")]
PressureAngle = Annotated[float, Quantity("angle", 5.0, 45.0, "deg", "usual gears have 20 deg")]
HelixAngle = Annotated[float, Quantity("angle", -60.0, 60.0, "deg", "usual gears have 0 to 30 deg")]
ShaftNumber = Annotated[int, Quantity("1", 1, 1000)]
CylinderNumber = Annotated[int, Quantity("1", 0, 1000)]
Teeth = Annotated[int, Quantity("1", 0, 5000)]
Variation = Annotated[float, Quantity("1", 0.0, 0.9, hint="spur gears have 0.1 to 0.3")]
Twist = Annotated[float, Quantity("angle", -7200.0, 7200.0, "deg")]
FrictionTorque = Annotated[float, Quantity("torque", 0.0, 1e8)]
SlipSpeed = Annotated[float, Quantity("speed", 1e-6, 1e4)]
SupportTorsionalStiffness = Annotated[float, Quantity("torsional stiffness", 0.0, 1e12)]
TorsionalDamping = Annotated[float, Quantity("torsional damping", 0.0, 1e8)]

VogelViscosity = Annotated[float, Quantity("viscosity", 1e-6, 1e3, "mPa s")]
FluidViscosity = Annotated[float, Quantity("viscosity", 1e-4, 1e5)]
KinematicViscosity = Annotated[float, Quantity("kinematic viscosity", 0.5, 1e6, "mm^2/s")]
PressureCoefficient = Annotated[float, Quantity("pressure coefficient", 0.0, 1e3, "1/GPa", "oils have 15 to 25 1/GPa")]
Temperature = Annotated[float, Quantity("temperature", -100.0, 1000.0, "degC")]
OilTemperature = Annotated[float, Quantity("temperature", -80.0, 300.0, "degC")]
VogelTemperature = Annotated[float, Quantity("temperature", 1.0, 400.0)]
TemperatureDifference = Annotated[float, Quantity("temperature difference", 0.1, 1e5)]
HeatCapacity = Annotated[float, Quantity("heat capacity", 100.0, 1e4)]
HeatTransfer = Annotated[float, Quantity("heat transfer", 0.1, 1e5)]
HeatFlux = Annotated[float, Quantity("heat flux", 1e-3, 1e5, "kW/m^2")]

Speed = Annotated[float, Quantity("speed", 0.0, 30000.0, "rev/min")]
RatedSpeed = Annotated[float, Quantity("speed", 10.0, 30000.0, "rev/min")]
Velocity = Annotated[float, Quantity("velocity", 1e-6, 100.0)]
Frequency = Annotated[float, Quantity("frequency", 0.0, 1e5)]
WorkingFrequency = Annotated[
    float, Quantity("frequency", 0.1, 1e5, hint="give the torsional frequency that the damper works at")
]
Rate = Annotated[float, Quantity("rate", 0.0, 1e6)]
Time = Annotated[float, Quantity("time", 0.0, 100.0)]
Power = Annotated[float, Quantity("power", 0.0, 200.0, "MW")]
LoadExponent = Annotated[float, Quantity("1", 0.0, 5.0, hint="propellers have 2 to 3")]
LoadSpeed = Annotated[float, Quantity("speed", 1.0, 30000.0, "rev/min")]
Energy = Annotated[float, Quantity("energy", 1e-4, 1e4, "kJ")]
SectionArea = Annotated[float, Quantity("area", 1e-2, 1e8, "mm^2")]
SecondMoment = Annotated[float, Quantity("second moment of area", 1e-4, 1e15, "mm^4")]
Area = Annotated[float, Quantity("area", 1e-4, 100.0)]

Force = Annotated[float, Quantity("force", -1e5, 1e5, "kN")]
Tension = Annotated[float, Quantity("force", 1e-3, 1e3, "kN")]
Torque = Annotated[float, Quantity("torque", -1e8, 1e8)]
OwnValue = Annotated[float, Quantity("1", -1e100, 1e100, hint="in SI units")]
AxialForce = Annotated[float, Quantity("force", -1e3, 1e3, "kN", "positive away from the pulley")]

NEWTONIAN, SHEAR_THINNING, COMPLEX_MODULUS = DAMPER_LAWS = ("newtonian", "shear-thinning", "complex-modulus")
TORSIONAL_SOURCES = ("solid", "solid-on-bearings", "solid-in-motion", "ker-wilson", "carter")
AXIAL_JOINTS = ("spline", "bolted")
SHAFT_SECTIONS = (
    "straight", "shrink-fit", "keyway-tapered", "keyway-cylindrical", "radial-hole", "slot", "thrust", "propeller",
    "stern-tube",
)  # fmt: skip
LOADS = ("propeller", "power", "torque")
NO_GRADE = "none"
OIL_GRADES = ("0W-20", "0W-30", "5W-30", "10W-30", "0W-40", "5W-40", "10W-40", "15W-40")
ROLLER_CONTACTS = ("palmgren", "iso16281")

ShaftSection = Annotated[str, OneOf("section", SHAFT_SECTIONS)]
LoadLaw = Annotated[str, OneOf("kind", LOADS)]
AxialJoint = Annotated[str, OneOf("joint", AXIAL_JOINTS)]
BeamAxis = Annotated[str, OneOf("axis", ("z", "y"))]
FrameMotion = Annotated[str, OneOf("motion", ("turning", "rod", "piston"))]
FILM_LEVELS = ("linear", "impedance", "table", "reynolds", "ehd", "ehd:fine")
FilmLevel = Annotated[str, OneOf("level", FILM_LEVELS)]
SmallEnd = Annotated[str, OneOf("level", ("spring", *FILM_LEVELS))]
LoadInput = Annotated[str, OneOf("input", ("none", "valvetrain.torque", "flywheel.axial_force"))]
FilmBore = Annotated[str, OneOf("bore", ("elastic", "rigid"))]
Groove = Annotated[str, OneOf("groove", ("none", "circumferential"))]
OilGrade = Annotated[str, OneOf("grade", (NO_GRADE, *OIL_GRADES))]
OilLaw = Annotated[str, OneOf("law", ("vogel", "walther"))]
Compressibility = Annotated[str, OneOf("law", ("none", "dowson-higginson"))]
PressureLaw = Annotated[str, OneOf("law", ("none", "barus", "roelands"))]
RollerContact = Annotated[str, OneOf("law", ROLLER_CONTACTS)]
RollerLaw = Annotated[str, OneOf("law", ("linear", *ROLLER_CONTACTS))]
Collar = Annotated[str, OneOf("collar", ("square", "tilting"))]
DamperKind = Annotated[str, OneOf("kind", ("viscous", "rubber", "linear"))]
RingDamperKind = Annotated[str, OneOf("kind", ("viscous", "rubber"))]
DamperLaw = Annotated[str, OneOf("law", DAMPER_LAWS)]
DampingKind = Annotated[str, OneOf("kind", ("modal", "rayleigh"))]
TorsionalSource = Annotated[str, OneOf("source", TORSIONAL_SOURCES)]


@cache
def kinds(part: type) -> dict[str, tuple[type, bool, Any]]:
    """Fields of a dataclass: type of the value, True for a list, and quantity (None for a value without quantity)."""
    found = {}
    for name, hint in get_type_hints(part, include_extras=True).items():
        many = get_origin(hint) is tuple
        kind = get_args(hint)[0] if many else hint
        plain, rule = get_args(kind)[:2] if get_origin(kind) is Annotated else (kind, None)
        found[name] = (plain, many, rule)
    return found


def check_values(part: Any, table: str) -> None:
    """Raise ``InputError`` for a value outside its field's bounds; a default passes, since 0 may mean "not given".

    The message is one line that starts with ``table.key``.
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
    """Raise ``InputError`` unless ``holds``; its message starts with ``table.key``, or ``key`` without a table."""
    if not holds:
        raise InputError(f"{table}.{key}: {text}".lstrip("."))


def need_equal_lengths(part: Any, table: str, *keys: str) -> None:
    """Raise ``InputError`` if lists of a part (all, or those under ``keys``) differ in length from the first list."""
    lists = {key: len(value) for key, value in vars(part).items() if key in keys or (not keys and type(value) is tuple)}
    first, count = next(iter(lists.items()))
    for key, length in lists.items():
        need(table, key, length == count, f"{length} values for {count} in {first}; give one for each")


def need_table(table: str, part: Any) -> None:
    """Raise ``InputError`` unless a part has one temperature for each of its increasing ``temperature_speeds``."""
    speeds, count = part.temperature_speeds, len(part.temperatures)
    text = f"{count} temperatures for {len(speeds)} speeds; give one for each"
    need(table, "temperatures", count == len(speeds) > 0, text)
    need(table, "temperature_speeds", all(a < b for a, b in pairwise(speeds)), "must increase")


def mm(length: float) -> str:
    """Length (m) as text in mm, for a message."""
    return f"{1e3 * length:.4g} mm"
