"""A crank web as a beam along its throw, between the main axis and the pin axis.

Main journal and pin load the web over their circles with the stresses of beam theory (uniform under a force, linear
under a moment), not at points. Where the circles overlap, stress passes directly from one to the other. These tractions
give the forces and moments of each section η = const of the web, and their energy the flexibility of the pin's end
relative to the main's (Castigliano). A section has the width (hull or counterweight) and thickness of the web. On the
journals' sides the material within 45° below their edges is added, because stress spreads at this angle into a step
(rule for the stiffness of stepped rotors). The torsion constant is Saint-Venant's A⁴/(40 I_p), the shear factor
Cowper's for a rectangle.

The model uses only dimensions of the web; no constant was fitted to a finite-element crank.

References: J. Vance, F. Zeidan and B. Murphy, *Machinery Vibration and Rotordynamics* (2010), and API RP 684, for the
45° rule; S. Timoshenko and J. Goodier, *Theory of Elasticity* (1970), section 109, for A⁴/(40 I_p).
"""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.types import Array
from cranktrain.engine.parts import Crankshaft, Material
from cranktrain.structure.crank.sections import web_width
from cranktrain.structure.crank.shape import Outline, stations, web_outline

_POINTS = 2000
THIN = 1.0e-6
"""Thickness used for a web of zero thickness, over the pin's diameter, because no member may be rigid."""


class WebSections(NamedTuple):
    """Sections of a web at η (p,): area, second moments about ξ (out of plane) and z (in plane), torsion; m² and m⁴."""

    eta: Array
    area: Array
    out_of_plane: Array
    in_plane: Array
    torsion: Array


class Arm(NamedTuple):
    """Dimensions of a web as a member: outline, thickness, diameter and width of the journals at its two ends, m."""

    outline: Outline
    thickness: float
    low_diameter: float
    low_width: float
    high_diameter: float
    high_width: float
    flying: bool = False


def web_arm(c: Crankshaft, number: int) -> Arm:
    """Dimensions of a web (numbered from 1) of a crankshaft as a member."""
    web, outline = stations(c).joins[number - 1], web_outline(c, number)
    if web.main:
        main = c.main_diameter, c.main_widths[web.main - 1]
        return Arm(outline, c.web_thickness, *main, c.pin_diameter, c.pin_width)
    return Arm(outline, c.flying_web_thickness, c.pin_diameter, c.pin_width, c.pin_diameter, c.pin_width, True)


def web_flexibility(arm: Arm, material: Material) -> Array:
    """Flexibility (6, 6) of a web's far end, in axes ξ, η (from the first axis to the second) and z.

    The web is clamped at its first axis.
    """
    at, apart = web_sections(arm), arm.outline.apart
    e = material.youngs_modulus
    g = e / (2.0 * (1.0 + material.poisson_ratio))
    shear = rectangle_shear_factor(material.poisson_ratio) * at.area
    loads = np.eye(6)
    reaction = -loads.copy()
    # A force F at (0, R, 0) has the moment (R F_z, 0, −R F_ξ) about the main axis.
    reaction[3] -= apart * loads[2]
    reaction[5] += apart * loads[0]
    inner = _resultants(at.eta, apart, 0.5 * arm.high_diameter) @ loads
    inner += _resultants(at.eta, 0.0, 0.5 * arm.low_diameter) @ reaction
    stiffness = (g * shear, e * at.area, g * shear, e * at.out_of_plane, g * at.torsion, e * at.in_plane)
    softness = 1.0 / np.stack(stiffness, axis=1)
    step = at.eta[1] - at.eta[0]
    result = step * np.einsum("pai,pa,paj->ij", inner, softness, inner)
    direct = _overlap_flexibility(arm, material)
    if direct is not None:
        result = direct if arm.thickness == 0.0 else np.linalg.inv(np.linalg.inv(result) + np.linalg.inv(direct))
    return np.asarray(0.5 * (result + result.T))


def _overlap_flexibility(arm: Arm, material: Material) -> Array | None:
    """Flexibility (6, 6) of the overlap of two pins at a flying web, in parallel with the web; None without overlap.

    Stress spreads from the overlap (a lens-shaped section) into either pin at 45°, as at every step of a diameter.
    """
    d, r, apart = arm.high_diameter, 0.5 * arm.high_diameter, arm.outline.apart
    if not arm.flying or apart >= d:
        return None
    # Strips of the lens, parallel to its chord, at distances eta from its middle.
    half = r - 0.5 * apart
    eta = half * (2.0 * (np.arange(_POINTS) + 0.5) / _POINTS - 1.0)
    chord, step = 2.0 * np.sqrt(r**2 - (np.abs(eta) + 0.5 * apart) ** 2), 2.0 * half / _POINTS
    area = step * chord.sum()
    about_xi, about_eta = step * (chord * eta**2).sum(), step * (chord**3).sum() / 12.0
    # Stress spreads from the overlap in cones. Their compliance is reduced by that of the pins within the cones.
    small = math.sqrt(4.0 * area / math.pi)
    cone = 0.5 * (d - small) * (np.arange(_POINTS) + 0.5) / _POINTS
    width = (small + 2.0 * cone) / small
    more = {p: (d - small) * float(np.mean(width**-p - (d / small) ** -p)) for p in (2.0, 4.0)}
    pulled, bent = (arm.thickness + THIN * d + more[p] for p in (2.0, 4.0))
    e = material.youngs_modulus
    g = e / (2.0 * (1.0 + material.poisson_ratio))
    shear = rectangle_shear_factor(material.poisson_ratio) * area
    torsion = area**4 / (40.0 * (about_xi + about_eta))
    stiffness = np.array([g * shear, g * shear, e * area, e * about_xi, e * about_eta, g * torsion])
    lens = np.diag(np.repeat([pulled, bent], 3) / stiffness)
    # A rigid arm carries the motion from the middle of the overlap to the far axis.
    turn = np.eye(6)
    turn[0, 5], turn[2, 3] = -0.5 * apart, 0.5 * apart
    return turn @ lens @ turn.T


def rectangle_shear_factor(poisson_ratio: float) -> float:
    """Shear factor κ of a rectangle, G. Cowper, J. Appl. Mech. 33 (1966) 335."""
    return 10.0 * (1.0 + poisson_ratio) / (12.0 + 11.0 * poisson_ratio)


def web_sections(arm: Arm) -> WebSections:
    """Sections of a web, including the material of its journals within 45° below their edges."""
    apart = arm.outline.apart
    low, high = -0.5 * arm.low_diameter, apart + 0.5 * arm.high_diameter
    step = (high - low) / _POINTS
    eta: Array = low + step * (np.arange(_POINTS, dtype=np.float64) + 0.5)
    t = arm.thickness
    width = web_width(arm.outline, eta)
    main, main_height = _stiffening(eta, 0.5 * arm.low_diameter, 0.5 * arm.low_width)
    pin, pin_height = _stiffening(eta - apart, 0.5 * arm.high_diameter, 0.5 * arm.high_width)
    parts = (
        (width, np.full_like(eta, t), np.zeros_like(eta)),
        (main, main_height, -0.5 * (t + main_height)),
        (pin, pin_height, 0.5 * (t + pin_height)),
    )
    area = np.sum([b * h for b, h, _ in parts], axis=0)
    centre = np.sum([b * h * z for b, h, z in parts], axis=0) / area
    out_of_plane = np.sum([b * h * (h**2 / 12.0 + (z - centre) ** 2) for b, h, z in parts], axis=0)
    in_plane = np.sum([h * b**3 / 12.0 for b, h, _ in parts], axis=0)
    return WebSections(eta, area, out_of_plane, in_plane, area**4 / (40.0 * (out_of_plane + in_plane)))


def _stiffening(eta: Array, radius: float, longest: float) -> tuple[Array, Array]:
    """Width and height, m, of the part of a journal that stiffens the web: the part within 45° below its edge."""
    chord = 2.0 * np.sqrt(np.maximum(radius**2 - eta**2, 0.0))
    return chord, np.minimum(np.maximum(radius - np.abs(eta), 0.0), longest)


def _resultants(eta: Array, centre: float, radius: float) -> Array:
    """Forces and moments (p, 6, 6) in sections at ``eta`` per unit load on a circle, by its traction below a section.

    Rows: shear along ξ, normal force, shear along z, moments about ξ, η, z through the section's middle; columns: load
    F_ξ, F_η, F_z, M_ξ, M_η, M_z on the circle about its centre.
    """
    y = np.clip(eta - centre, -radius, radius)
    area, inertia = math.pi * radius**2, 0.25 * math.pi * radius**4
    root, arc = np.sqrt(np.maximum(radius**2 - y**2, 0.0)), np.arcsin(y / radius)
    # Moments of the circle's segment below y: integrals of its chord times 1, y and y², and of the chord³ over 12.
    part = y * root + radius**2 * (arc + 0.5 * math.pi)
    first = -2.0 / 3.0 * root**3
    second = 0.25 * (y * (2.0 * y**2 - radius**2) * root + radius**4 * (arc + 0.5 * math.pi))
    across = (y * root**3 + 1.5 * radius**2 * part) / 6.0
    arm = eta - centre  # height of the cut above the circle's centre, also for cuts beyond the circle
    result = np.zeros((eta.size, 6, 6))
    result[:, 0, 0] = result[:, 1, 1] = result[:, 2, 2] = part / area
    # σ_z = F_z/A + M_ξ y/I − M_η ξ/I
    result[:, 2, 3] = first / inertia
    result[:, 3, 2] = (first - arm * part) / area
    result[:, 3, 3] = (second - arm * first) / inertia
    result[:, 4, 4] = across / inertia
    # τ_ξ = F_ξ/A − M_z y/J,  τ_η = F_η/A + M_z ξ/J
    polar = 2.0 * inertia
    result[:, 0, 5] = -first / polar
    result[:, 5, 0] = -(first - arm * part) / area
    result[:, 5, 5] = (across + second - arm * first) / polar
    return result
