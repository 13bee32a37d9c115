"""Limits of a new engine: the tables ``[limits]`` and ``[bearing_limits]``.

Twist. A crank in its first torsional mode without a node but at the flywheel twists like a quarter of a sine over its
length L, φ(z) = Φ sin(π z / 2L). As a plain shaft of the pin's diameter d it has its largest shear stress at the node,

    τ = G (d/2) π Φ / (2 L),   so   Φ = 4 L τ / (π G d)

with an alternating nominal stress τ of 50 MPa, which leaves bending its part in the fillets' strength (fatigue by
IACS UR M53 is the verb ``fatigue``).
"""

import math

from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.studies.design.document import Block, chosen, derived
from cranktrain.studies.design.sizes import Sizes

SHEAR_STRESS = 50e6
"""Alternating nominal shear stress of the pins, Pa; chosen."""
PISTON_SPEEDS = {"petrol": 25.0, "diesel": 15.0}
"""Largest mean piston speed by fuel, m/s, of sports engines and of high-speed diesels."""
PEAK_MARGIN = 1.15
"""Permissible peak pressure over the peak pressure at full load; chosen."""
_OCVIRK = (
    "about the sum of its predominant peaks (F. W. Ocvirk, G. B. DuBois, ASME 1957): above it surfaces do not touch"
)
_NEALE = "7500 psi: tin-aluminium and lead bronze (M. J. Neale, The Tribology Handbook, 2nd edition, A11)"


def limits(s: Sizes, engine: Engine) -> Block:
    """Table of limits of twist, piston speed and peak pressure."""
    crank, steel = engine.crankshaft, engine.material
    length = crank.main_positions[-1] - crank.main_positions[0]
    shear = 0.5 * steel.youngs_modulus / (1.0 + steel.poisson_ratio)
    twist = 4.0 * length * SHEAR_STRESS / (math.pi * shear * crank.pin_diameter)
    peak = GasTrace.from_engine(engine).peak
    fastest = max(PISTON_SPEEDS[s.fuel_name], PEAK_MARGIN * s.rated * s.stroke / math.pi if s.speed_given else 0.0)
    return Block("limits", "What a report judges by, over the engine's speeds.", (
        derived("twist", float(f"{math.degrees(twist):.2g}"), "deg", "half of peak to peak, pulley against flywheel: "
                "4 L tau / (pi G d), a quarter sine over the mains' length L, shear tau of 50 MPa, pins of d"),
        chosen("piston_speed", fastest, "m/s", "mean; sports petrol engines reach 25 m/s, high-speed diesels 15 m/s"
               if fastest == PISTON_SPEEDS[s.fuel_name] else "mean; 1.15 of that at the rated speed that was given"),
        derived("peak_pressure", 1e-5 * PEAK_MARGIN * peak, "bar", f"{PEAK_MARGIN:g} of the full load's"),
    ))  # fmt: skip


def bearing_limits() -> Block:
    """Table ``[bearing_limits]`` for mains and big ends, without a limit of p·v, which depends on cooling."""
    return Block("bearing_limits", "Of the shells, over a cycle.", tuple(
        entry
        for of in ("main", "big_end")
        for entry in (
            derived(f"{of}_film", 1.2, "um", f"three times the roughness of 0.4 um, {_OCVIRK}"),
            chosen(f"{of}_pressure", 200.0, "MPa", "two thirds of the lining's hardness of 300 MPa; levels with rigid "
                   "bores show more than an elastic one"),
            chosen(f"{of}_specific_load", 52.0, "MPa", _NEALE),
        )
    ))  # fmt: skip
