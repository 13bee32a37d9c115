"""Quantities of a valve-train file's values, in addition to the engine's quantities, as annotations of settings."""

from typing import Annotated

from cranktrain.engine.quantities import Quantity

Lift = Annotated[float, Quantity("length", 0.1, 200.0, "mm")]
Radius = Annotated[float, Quantity("length", 0.0, 1000.0, "mm")]
Lash = Annotated[float, Quantity("length", 0.0, 10.0, "mm")]
Ramp = Annotated[float, Quantity("angle", 1.0, 90.0, "deg", "it is an angle of the cam")]
Power = Annotated[float, Quantity("1", 5.0, 60.0, hint="usual cams have 6 to 12")]
Ratio = Annotated[float, Quantity("1", 0.1, 10.0, hint="rockers have 1 to 2")]
DampingSpeed = Annotated[float, Quantity("speed", 1e-4, 1e4, "rad/s")]
