"""Strength of the crankshaft's material: table ``[crank_strength]`` of an engine file."""

from dataclasses import dataclass
from typing import Annotated

from cranktrain.engine.quantities import OneOf, Quantity, Roughness

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
