"""What a cylindrical roller bearing is, and which values describe one: refused in one line before anything is computed.

Contacts and travel: :mod:`cranktrain.film.laws.roller_contacts`, which computes with these bearings.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from cranktrain.core.errors import InputError, nearest
from cranktrain.engine.checks.crankshaft import in_mm
from cranktrain.engine.parts import Crankshaft, RollerBearings

CONTACT_LAWS = {"palmgren": 7.68e-5 ** (-10.0 / 9.0), "iso16281": 35948.0}
"""k of both contacts in series, N/mm^2: Q = k l^(8/9) δ^(10/9) with l and δ in mm."""
SHORT_PROFILE, LONG_PROFILE = 0.00035, 0.0005
"""Profile parameters of ISO/TS 16281."""
LONG_ROLLER = 2.5
"""Length over diameter beyond which the middle of a profiled roller is straight."""
RATED_PRESSURE = 4.0e9
"""Pressure in the middle of the most loaded contact at the static load rating of ISO 76, Pa."""
REDUCED_MODULUS = 0.5 * 207.0e9 / (1.0 - 0.3**2)
"""E* of steel on steel, with the constants behind Palmgren's contact, Pa."""
LAWS = ("linear", *CONTACT_LAWS)
"""Laws of a roller bearing in a running engine."""
FILE_KEYS = {"length": "roller_length", "diameter": "roller_diameter", "pitch": "pitch_diameter"}
"""Keys of an engine file that are named otherwise there."""


@dataclass(frozen=True)
class RollerBearing:
    """One cylindrical roller bearing, m.

    Attributes
    ----------
    rollers : their number Z
    length : effective length of a roller
    diameter : of a roller
    pitch : diameter of the circle of the rollers' middles
    clearance : diametral radial clearance G_r; negative where preloaded
    profile : p of the logarithmic profile, 0 for straight rollers
    law : ``palmgren`` or ``iso16281``
    """

    rollers: int
    length: float
    diameter: float
    pitch: float
    clearance: float = 0.0
    profile: float = 0.0
    law: str = "palmgren"

    @property
    def contact_stiffness(self) -> float:
        """K of Q = K δ^(10/9) of a whole straight roller, N/m^(10/9)."""
        return 1.0e6 * CONTACT_LAWS[self.law] * self.length ** (8.0 / 9.0)

    @property
    def pressure_factor(self) -> float:
        """Hertz's line contact with the inner ring: pressure is this times the root of the load per length, SI."""
        curvature = 2.0 / self.diameter + 2.0 / (self.pitch - self.diameter)
        return math.sqrt(REDUCED_MODULUS * curvature / math.pi)

    @property
    def travel(self) -> float:
        """Approach of both contacts of a straight roller at the pressure of the static load rating (4000 MPa), m."""
        load = self.length * (RATED_PRESSURE / self.pressure_factor) ** 2
        return float((load / self.contact_stiffness) ** 0.9)

    @property
    def cage_ratio(self) -> float:
        """Angle of the cage over that of the journal, the outer ring at rest, rollers rolling without slip."""
        return 0.5 * (1.0 - self.diameter / self.pitch)


def iso_profile(length: float, diameter: float) -> float:
    """Profile parameter p that ISO/TS 16281 gives a roller of this length and diameter (m)."""
    return LONG_PROFILE if length > LONG_ROLLER * diameter else SHORT_PROFILE


def check_roller_bearing(bearing: RollerBearing) -> None:
    """Refuse what is no cylindrical roller bearing.

    Raises
    ------
    InputError
        one line that starts with the quantity
    """
    b = bearing
    if b.law not in CONTACT_LAWS:
        raise InputError(f"law: '{b.law}' does not exist; {nearest(b.law, CONTACT_LAWS)}")
    if b.rollers < 3:
        raise InputError(f"rollers: {b.rollers} cannot centre a journal; give at least 3")
    for name in ("length", "diameter", "pitch"):
        value = getattr(b, name)
        if not 0.0 < value < 10.0:
            raise InputError(f"{name}: {1e3 * value:.4g} mm is not within 0 to 10 m; check its unit")
    if b.pitch <= b.diameter:
        raise InputError(
            f"pitch: {1e3 * b.pitch:.4g} mm leaves no journal inside rollers of {1e3 * b.diameter:.4g} mm; "
            "give the diameter of the circle of the rollers' middles"
        )
    chord = b.pitch * math.sin(math.pi / b.rollers)
    if chord <= b.diameter:
        most = math.floor(math.pi / math.asin(b.diameter / b.pitch))
        raise InputError(
            f"rollers: {b.rollers} of {1e3 * b.diameter:.4g} mm overlap on a pitch circle of {1e3 * b.pitch:.4g} mm; "
            f"at most {most} fit"
        )
    if not 0.0 <= b.profile <= 0.01:
        raise InputError(f"profile: {b.profile:.4g} is not within 0 to 0.01; usual: 0 (straight) or {SHORT_PROFILE:g}")
    if not abs(0.5 * b.clearance) <= b.travel:
        what = "preload" if b.clearance < 0.0 else "clearance"
        raise InputError(
            f"clearance: {what} of {1e6 * abs(b.clearance):.4g} um is larger than the rollers' travel to either side, "
            f"2 x {1e6 * b.travel:.4g} um (their approach at the static rating, 4000 MPa); give the diametral "
            f"clearance, at most {2e6 * b.travel:.3g} um"
        )


def main_roller(rollers: RollerBearings, main: int) -> RollerBearing:
    """Bearing of one main journal, numbered from 0; contacts by Palmgren where the running law is linear."""
    return RollerBearing(
        rollers=rollers.rollers[main],
        length=rollers.roller_length[main],
        diameter=rollers.roller_diameter[main],
        pitch=rollers.pitch_diameter[main],
        clearance=rollers.clearance[main],
        profile=rollers.profile[main],
        law=rollers.law if rollers.law in CONTACT_LAWS else "palmgren",
    )


def check_rollers(rollers: RollerBearings, crankshaft: Crankshaft) -> None:
    """Refuse roller bearings that do not fit their journals or themselves.

    Raises
    ------
    InputError
        one line that starts with ``main_roller.key``
    """
    r, mains = rollers, len(crankshaft.main_widths)
    if r.law not in LAWS:
        raise InputError(f"main_roller.law: '{r.law}' does not exist; {nearest(r.law, LAWS)}")
    for entry in fields(r):
        values = getattr(r, entry.name)
        if isinstance(values, tuple) and len(values) != mains:
            raise InputError(f"main_roller.{entry.name}: {len(values)} values for {mains} main journals; give one each")
    for i, (length, width) in enumerate(zip(r.roller_length, crankshaft.main_widths, strict=True)):
        if length > width:
            raise InputError(
                f"main_roller.roller_length[{i + 1}]: {in_mm(length)} is longer than main journal {i + 1} is wide, "
                f"{in_mm(width)}"
            )
        # Seats may differ somewhat from the journals' common diameter; a wrong unit or circle differs by more.
        track = r.pitch_diameter[i] - r.roller_diameter[i]
        if not 0.5 <= track / crankshaft.main_diameter <= 1.5:
            raise InputError(
                f"main_roller.pitch_diameter[{i + 1}]: the rollers' track, {in_mm(track)}, does not belong to a main "
                f"journal of {in_mm(crankshaft.main_diameter)}; give about "
                f"{in_mm(crankshaft.main_diameter + r.roller_diameter[i])}"
            )
    for i in range(mains):
        try:
            check_roller_bearing(main_roller(r, i))
        except InputError as error:
            key, text = str(error).split(": ", 1)
            raise InputError(f"main_roller.{FILE_KEYS.get(key, key)}[{i + 1}]: {text}") from None
