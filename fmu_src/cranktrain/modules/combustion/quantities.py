"""Quantities of a combustion file's values, in addition to the engine's quantities, as annotations of settings."""

from typing import Annotated

from cranktrain.engine.quantities import Quantity

FuelMass = Annotated[float, Quantity("mass", 0.0, 1e5, "mg")]
HeatingValue = Annotated[float, Quantity("specific energy", 5.0, 150.0, "MJ/kg", "diesel fuel has 42.5 to 43")]
HydrogenRatio = Annotated[float, Quantity("1", 0.0, 4.0, hint="diesel fuel has 1.8 to 1.9")]
DelayFactor = Annotated[float, Quantity("time", 1e-9, 1.0, "s")]
Exponent = Annotated[float, Quantity("1", 0.0, 20.0)]
AirRatio = Annotated[
    float, Quantity("1", 0.6, 2.5, hint="lambda, air over what the fuel needs; a spark ignites no other charge")
]
Scatter = Annotated[float, Quantity("1", 0.0, 0.5, hint="standard deviation over mean; engines have 0.01 to 0.05")]
Ratio = Annotated[float, Quantity("1", 0.01, 10.0)]
Part = Annotated[float, Quantity("1", 0.0, 1.0)]
Factor = Annotated[float, Quantity("1", 0.0, 10.0)]
Valves = Annotated[int, Quantity("1", 1, 8)]
Lift = Annotated[float, Quantity("length", 0.0, 200.0, "mm")]
