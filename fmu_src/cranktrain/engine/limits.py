"""Limits for the running engine that a report checks: table ``[limits]`` of an engine file."""

from dataclasses import dataclass
from typing import Annotated

from cranktrain.engine.quantities import Quantity

VibrationLimit = Annotated[float, Quantity("angle", 1e-3, 20.0, "deg", "engines have 0.1 to 1 deg")]
PistonSpeedLimit = Annotated[float, Quantity("velocity", 0.1, 50.0, hint="engines have 5 to 25 m/s")]
PressureLimit = Annotated[float, Quantity("absolute pressure", 1.0, 1000.0, "bar", "it is absolute; check its unit")]


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits over the engine's speeds (SI); 0 for a limit that is not given.

    ``pulley_torsion`` and ``twist`` are half of the largest peak-to-peak value over a cycle, all orders together: of
    the pulley's torsional vibration, and of the rotation of the pulley relative to the flywheel. ``piston_speed`` is
    the mean piston speed, ``peak_pressure`` the largest pressure of any cylinder.
    """

    pulley_torsion: VibrationLimit = 0.0
    twist: VibrationLimit = 0.0
    piston_speed: PistonSpeedLimit = 0.0
    peak_pressure: PressureLimit = 0.0
