"""Limits for the running engine that a report checks: an engine file's ``[limits]`` and ``[bearing_limits]``."""

from dataclasses import dataclass
from typing import Annotated

from cranktrain.engine.quantities import OneOf, Quantity, Roughness

LeastFilm = Annotated[float, Quantity("length", 0.01, 1000.0, "um", "engine bearings have 0.5 to 3 um")]
FilmPressure = Annotated[float, Quantity("pressure", 0.1, 2000.0, "MPa")]
SpecificLoad = Annotated[float, Quantity("pressure", 0.1, 500.0, "MPa", "linings bear 12 to 120 MPa")]
SlidingLoad = Annotated[float, Quantity("pressure times velocity", 0.1, 1e5, "MPa m/s")]

MAIN, BIG_END = "main", "big_end"
JUDGED = ("film", "pressure", "specific_load", "pv")


@dataclass(frozen=True, kw_only=True)
class BearingLimits:
    """Limits of main bearings and big ends (SI); 0 for a limit that is not given.

    Over a cycle ``film`` bounds the least film thickness from below. From above ``pressure`` bounds the largest film
    pressure, ``specific_load`` the largest load over width times diameter, ``pv`` the mean of specific load times
    sliding speed.
    """

    main_film: LeastFilm = 0.0
    main_pressure: FilmPressure = 0.0
    main_specific_load: SpecificLoad = 0.0
    main_pv: SlidingLoad = 0.0
    big_end_film: LeastFilm = 0.0
    big_end_pressure: FilmPressure = 0.0
    big_end_specific_load: SpecificLoad = 0.0
    big_end_pv: SlidingLoad = 0.0

    def of(self, family: str, what: str) -> float:
        """Limit (SI) of a family, ``MAIN`` or ``BIG_END``, for the quantity ``what`` of ``JUDGED``; 0 if not given."""
        return float(getattr(self, f"{family}_{what}"))


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


FORMINGS = ("grain-flow", "free-form", "cast-rolled")
"""Forming processes: forged with grain flow along the throws, free-form forged, or cast with rolled fillets."""

TensileStrength = Annotated[
    float, Quantity("pressure", 300.0, 2500.0, "MPa", "forged crankshafts have 600 to 1100 MPa")
]
Treatment = Annotated[float, Quantity("1", 0.5, 3.0, hint="untreated is 1, rolled or hardened fillets 1.1 to 2")]
Forming = Annotated[str, OneOf("forming", FORMINGS)]


@dataclass(frozen=True, kw_only=True)
class CrankStrength:
    """Material data for the fatigue of the crankshaft.

    ``tensile_strength`` is the specified minimum (Pa), ``forming`` one of ``FORMINGS``, ``roughness`` the average
    roughness depth Rz of the fillets' surface (m). ``fillet_treatment`` is the gain in fatigue strength from rolling,
    hardening or nitriding the fillets, 1 if untreated; the rule ignores it.
    """

    tensile_strength: TensileStrength
    forming: Forming
    roughness: Roughness
    fillet_treatment: Treatment = 1.0
