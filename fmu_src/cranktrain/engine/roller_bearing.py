"""Description of a cylindrical roller bearing; invalid values are refused in one line before any computation.

Contact laws and roller motion: :mod:`cranktrain.film.laws.roller_contacts`, which uses these bearings.
"""

import math
from dataclasses import dataclass, fields
from functools import partial

from cranktrain.core.errors import InputError
from cranktrain.engine import quantities as q
from cranktrain.engine.parts import Crankshaft, RollerBearings
from cranktrain.engine.quantities import check_values, mm, need

CONTACT_LAWS = dict(zip(q.ROLLER_CONTACTS, (7.68e-5 ** (-10.0 / 9.0), 35948.0), strict=True))
"""Constant k of both contacts in series, N/mm^2: Q = k l^(8/9) δ^(10/9) with l and δ in mm."""
SHORT_PROFILE, LONG_PROFILE = 0.00035, 0.0005
"""Profile parameters of ISO/TS 16281."""
LONG_ROLLER = 2.5
"""Length over diameter of a roller above which the middle of a profiled roller is straight."""
RATED_PRESSURE = 4.0e9
"""Pressure in the middle of the most loaded contact at the static load rating of ISO 76, Pa."""
REDUCED_MODULUS = 0.5 * 207.0e9 / (1.0 - 0.3**2)
"""Reduced modulus E* of steel on steel, Pa, with the material constants of Palmgren's contact law."""
FILE_KEYS = {"length": "roller_length", "diameter": "roller_diameter", "pitch": "pitch_diameter"}
"""Keys of an engine file for fields that have another name there."""


@dataclass(frozen=True)
class RollerBearing:
    """One cylindrical roller bearing, lengths in m.

    Attributes
    ----------
    rollers : number Z of rollers
    length : effective length of a roller
    diameter : diameter of a roller
    pitch : diameter of the pitch circle of the rollers
    clearance : diametral radial clearance G_r; negative if preloaded
    profile : parameter p of the logarithmic profile, 0 for straight rollers
    law : ``palmgren`` or ``iso16281``
    """

    rollers: int
    length: q.Length
    diameter: q.Length
    pitch: q.Length
    clearance: float = 0.0
    profile: q.RollerProfile = 0.0
    law: q.RollerContact = "palmgren"

    @property
    def contact_stiffness(self) -> float:
        """Stiffness K in Q = K δ^(10/9) of a whole straight roller, N/m^(10/9)."""
        return 1.0e6 * CONTACT_LAWS[self.law] * self.length ** (8.0 / 9.0)

    @property
    def pressure_factor(self) -> float:
        """Factor of Hertz's line contact with the inner ring: pressure over the square root of load per length, SI."""
        curvature = 2.0 / self.diameter + 2.0 / (self.pitch - self.diameter)
        return math.sqrt(REDUCED_MODULUS * curvature / math.pi)

    @property
    def travel(self) -> float:
        """Deflection of both contacts of a straight roller at the pressure of the static load rating (4000 MPa), m."""
        load = self.length * (RATED_PRESSURE / self.pressure_factor) ** 2
        return float((load / self.contact_stiffness) ** 0.9)

    @property
    def cage_ratio(self) -> float:
        """Rotation of the cage over rotation of the journal, for a resting outer ring and rollers without slip."""
        return 0.5 * (1.0 - self.diameter / self.pitch)


def iso_profile(length: float, diameter: float) -> float:
    """Profile parameter p of ISO/TS 16281 for a roller of this length and diameter (m)."""
    return LONG_PROFILE if length > LONG_ROLLER * diameter else SHORT_PROFILE


def check_roller_bearing(bearing: RollerBearing) -> None:
    """Refuse values that do not describe a cylindrical roller bearing.

    Raises ``InputError``, one line that starts with the quantity.
    """
    b, size, pitch = bearing, mm(bearing.diameter), mm(bearing.pitch)
    of = partial(need, "")
    check_values(b, "")
    of("rollers", b.rollers >= 3, f"{b.rollers} is too few to centre a journal; give at least 3")
    text = f"{pitch} leaves no journal inside rollers of {size}; it is the diameter of the rollers' pitch circle"
    of("pitch", b.pitch > b.diameter, text)
    most = math.floor(math.pi / math.asin(b.diameter / b.pitch))
    text = f"{b.rollers} of {size} overlap on a pitch circle of {pitch}; at most {most} fit"
    of("rollers", b.pitch * math.sin(math.pi / b.rollers) > b.diameter, text)
    text = (
        f"{'preload' if b.clearance < 0.0 else 'clearance'} of {1e6 * abs(b.clearance):.4g} um is larger than the "
        f"rollers' travel to either side, 2 x {1e6 * b.travel:.4g} um (their approach at the static rating, 4000 MPa); "
        f"give the diametral clearance, at most {2e6 * b.travel:.3g} um"
    )
    of("clearance", abs(0.5 * b.clearance) <= b.travel, text)


def main_roller(rollers: RollerBearings, main: int) -> RollerBearing:
    """Bearing of one main journal (from 0); contacts by Palmgren if the running law is linear."""
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
    """Refuse roller bearings that do not fit their journals or contradict each other.

    Raises ``InputError``, one line that starts with ``main_roller.key``.
    """
    r, mains, of = rollers, len(crankshaft.main_widths), partial(need, "main_roller")
    check_values(r, "main_roller")
    for number in r.mains:
        of("mains", 1 <= number <= mains, f"{number} is not one of the main journals 1..{mains}")
    of("mains", list(r.mains) == sorted(set(r.mains)), f"{list(r.mains)} does not rise; give each main once, in order")
    numbers = r.mains or tuple(range(1, mains + 1))
    for entry in fields(r):
        values = getattr(r, entry.name)
        if isinstance(values, tuple) and entry.name != "mains":
            whose = "mains" if r.mains else "main journals"
            text = f"{len(values)} values for {len(numbers)} {whose}; give one each"
            of(entry.name, len(values) == len(numbers), text)
    for i, (length, number) in enumerate(zip(r.roller_length, numbers, strict=True)):
        width = crankshaft.main_widths[number - 1]
        text = f"{mm(length)} is longer than main journal {number} is wide, {mm(width)}"
        of(f"roller_length[{i + 1}]", length <= width, text)
        # Bearing seats may differ somewhat from the journals' diameter; a wrong unit or diameter differs by more.
        track, journal = r.pitch_diameter[i] - r.roller_diameter[i], crankshaft.main_diameter
        text = (
            f"the rollers' track, {mm(track)}, does not belong to a main journal of {mm(journal)}; give about "
            f"{mm(journal + r.roller_diameter[i])}"
        )
        of(f"pitch_diameter[{i + 1}]", 0.5 <= track / journal <= 1.5, text)
        try:
            check_roller_bearing(main_roller(r, i))
        except InputError as error:
            key, text = str(error).split(": ", 1)
            raise InputError(f"main_roller.{FILE_KEYS.get(key, key)}[{i + 1}]: {text}") from None
