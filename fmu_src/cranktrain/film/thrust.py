"""Axial (thrust) bearing: a film on each side of the collar within the axial clearance, and contact below roughness.

Each side carries ``pads`` taper-land pads of length B (at the mean radius) and radial width L. With the least film h
and the taper depth δ the wedge of an infinitely wide linear slider carries, per pad,

    W = 6 η U L B²/δ² [ln(1 + δ/h) − 2δ/(2h + δ)] · L²/(L² + B²)

(the last factor corrects for side leakage), and squeeze adds 5/6 η V B³L³ / (h³ (B² + L²)), Galerkin's method with
parabolas in both directions (1 % low on a square). A side that is pulled apart ruptures gradually, the force F of the
full film becoming ½[F − F_a + √((F + F_a)² + F_a²)] with F_a ambient pressure on its pads. Below ``contact_height`` the
collar touches: a linear spring, the bearing's stiffness in series with the block's, and a damper.

Level ``linear`` is the closed bearing: the same spring and damper without clearance.
Source: Hamrock, Schmid & Jacobson, Fundamentals of Fluid Film Lubrication (2004), fixed-incline slider.
"""

from __future__ import annotations

import math

import numpy as np

from cranktrain.engine import ThrustBearing
from cranktrain.kernel import kernel

LINEAR = 0
FILM = 1
AMBIENT = 101325.0
FILM_FLOOR = 0.2
"""The film is frozen below this fraction of the contact height, where contact carries."""


def closed_stiffness(thrust: ThrustBearing) -> float:
    """Stiffness of the closed bearing, N/m: its contact in series with the block's share."""
    return 1.0 / (1.0 / thrust.contact_stiffness + 1.0 / thrust.block_stiffness)


def thrust_parameters(thrust: ThrustBearing, viscosity: float, linear: bool) -> np.ndarray:
    """Pack one thrust bearing for the kernels: law, half clearance, contact, stiffness, damping and film factors."""
    radius = 0.25 * (thrust.inner_diameter + thrust.outer_diameter)
    width = 0.5 * (thrust.outer_diameter - thrust.inner_diameter)
    pad = 2.0 * math.pi * radius * thrust.pad_fraction / thrust.pads
    leakage = width * width / (width * width + pad * pad)
    wedge = thrust.pads * 6.0 * viscosity * radius * width * pad**2 / thrust.taper**2 * leakage
    squeeze = thrust.pads * 5.0 / 6.0 * viscosity * (pad * width) ** 3 / (pad**2 + width**2)
    law = LINEAR if linear else FILM
    suction = AMBIENT * thrust.pads * pad * width
    half = 0.5 * thrust.clearance
    stiffness = closed_stiffness(thrust)
    return np.array(
        [law, half, thrust.contact_height, stiffness, thrust.damping, wedge, squeeze, thrust.taper, suction]
    )


@kernel
def side_force(gap, closing, speed, contact_height, stiffness, damping, wedge, squeeze, taper, suction):
    """Force that opens one side (N, never below −suction), and its derivatives by gap and by closing velocity."""
    floor = FILM_FLOOR * contact_height
    h = gap if gap > floor else floor
    a = taper / h
    w = wedge * speed
    force = w * (math.log(1.0 + a) - 2.0 * a / (2.0 + a)) + squeeze * closing / (h * h * h)
    by_gap = 0.0
    if gap > floor:
        slope = 1.0 / (1.0 + a) - 4.0 / ((2.0 + a) * (2.0 + a))
        by_gap = -w * slope * a / h - 3.0 * squeeze * closing / (h * h * h * h)
    by_closing = squeeze / (h * h * h)
    depth = contact_height - gap
    if depth > 0.0:
        # The damper grows in over the roughness height, so the force has no jump on touching.
        share = depth / contact_height if depth < contact_height else 1.0
        force += stiffness * depth + damping * share * closing
        by_gap -= stiffness
        if share < 1.0:
            by_gap -= damping * closing / contact_height
        by_closing += damping * share
    # Pulled apart, a side ruptures gradually and never pulls harder than ambient pressure on its pads.
    total = force + suction
    root = math.sqrt(total * total + suction * suction)
    # Both are ½(total + root); far in suction the first form would cancel.
    left = 0.5 * (total + root) if total > 0.0 else 0.5 * suction * suction / (root - total)
    return left - suction, left / root * by_gap, left / root * by_closing


@kernel
def thrust_force(z, vz, speed, parameters):
    """Axial force on the collar at z (m, from the middle of the clearance), with ∂F/∂z and ∂F/∂ż."""
    half = parameters[1]
    stiffness = parameters[3]
    damping = parameters[4]
    if parameters[0] == LINEAR:
        return -stiffness * z - damping * vz, -stiffness, -damping
    f1, k1, c1 = side_force(
        half - z, vz, speed, parameters[2], stiffness, damping, parameters[5], parameters[6], parameters[7],
        parameters[8],
    )
    f2, k2, c2 = side_force(
        half + z, -vz, speed, parameters[2], stiffness, damping, parameters[5], parameters[6], parameters[7],
        parameters[8],
    )
    return f2 - f1, k1 + k2, -c1 - c2
