"""What a number in an engine file measures: the annotations of its fields.

The reader of engine files takes its checks from them; everything is a float in SI.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple


class Quantity(NamedTuple):
    """What a field measures: its dimension, and whether it must be positive, may be zero, or has either sign."""

    dimension: str
    sign: str = "positive"


Number = Annotated[float, Quantity("1", "zero")]
Length = Annotated[float, Quantity("length")]
Clearance = Annotated[float, Quantity("length", "zero")]
Offset = Annotated[float, Quantity("length", "either")]
Angle = Annotated[float, Quantity("angle", "either")]
Mass = Annotated[float, Quantity("mass")]
Inertia = Annotated[float, Quantity("inertia")]
Density = Annotated[float, Quantity("density")]
Pressure = Annotated[float, Quantity("pressure")]
GaugePressure = Annotated[float, Quantity("pressure", "zero")]
Stiffness = Annotated[float, Quantity("stiffness")]
Damping = Annotated[float, Quantity("damping", "zero")]
TorsionalStiffness = Annotated[float, Quantity("torsional stiffness")]
TorsionalDamping = Annotated[float, Quantity("torsional damping", "zero")]
SupportStiffness = Annotated[float, Quantity("stiffness", "zero")]
SupportTorsionalStiffness = Annotated[float, Quantity("torsional stiffness", "zero")]
Viscosity = Annotated[float, Quantity("viscosity")]
Temperature = Annotated[float, Quantity("temperature")]
TemperatureDifference = Annotated[float, Quantity("temperature difference")]
Speed = Annotated[float, Quantity("speed", "zero")]
Frequency = Annotated[float, Quantity("frequency", "zero")]
Rate = Annotated[float, Quantity("rate", "zero")]
Time = Annotated[float, Quantity("time", "zero")]
Energy = Annotated[float, Quantity("energy")]
KinematicViscosity = Annotated[float, Quantity("kinematic viscosity")]
PressureCoefficient = Annotated[float, Quantity("pressure coefficient", "zero")]
HeatCapacity = Annotated[float, Quantity("heat capacity")]
Share = Annotated[float, Quantity("1")]
Velocity = Annotated[float, Quantity("velocity")]
AddedInertia = Annotated[float, Quantity("inertia", "zero")]
Area = Annotated[float, Quantity("area")]
HeatTransfer = Annotated[float, Quantity("heat transfer")]
HeatFlux = Annotated[float, Quantity("heat flux")]
