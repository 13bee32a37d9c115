"""What a valve train is made of: one frozen record in SI, and the arrays that kernels take.

A spring is a uniform bar between the head and the retainer, u(s) = s x + Σ q_n sin nπs: its modes' frequencies with the
valve at rest are n/2 √(k/m), their masses m/2, and m (−1)ⁿ⁺¹/(nπ) couples them to the valve.

Source: J. P. Den Hartog, Mechanical Vibrations, 4th ed. (1956), section 4.4 (bars); of springs in valve trains: H. A.
Rothbart (ed.), Cam Design Handbook (2004), chapter 12.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.build_mark import build_mark
from cranktrain.core.errors import InputError, nearest
from cranktrain.modules.crank_angle import ANGLES, TIMES
from cranktrain.modules.valve_train.cam import cam_lift, cam_radius, cam_row
from cranktrain.modules.valve_train.slots import CAM, HALF, MODES, NUMBERS, RAMP, ROW, SHAFT

Array = NDArray[np.float64]
SAMPLES = 2001
"""Angles of a cam at which its curvature is looked at."""


@dataclass(frozen=True, kw_only=True)
class TrainSettings:
    """Cams, lines, seats, drive and camshaft of one engine, in SI (angles rad).

    Opening and closing angles count from a cylinder's firing dead centre, the intake's before, the exhaust's behind it;
    ``firing_angles`` are the crank's angles at those dead centres. Masses, forces and stiffnesses are those of the
    valves that one cam drives, together and at the valve; a ``damping_velocity`` is the closing velocity at which
    damping doubles a contact's force. ``roller_radius`` 0 is a flat follower, ``start_cycles`` cycles are run before
    the start.
    """

    name: str
    title: str
    firing_angles: tuple[float, ...]
    intake_opens: float
    intake_closes: float
    intake_lift: float
    intake_mass: float
    exhaust_opens: float
    exhaust_closes: float
    exhaust_lift: float
    exhaust_mass: float
    base_radius: float
    roller_radius: float
    cam_width: float
    ramp: float
    power: float
    friction: float
    modulus: float
    ratio: float
    train_mass: float
    stiffness: float
    damping_velocity: float
    lash: float
    spring_rate: float
    spring_preload: float
    spring_mass: float
    spring_damping: float
    seat_stiffness: float
    seat_damping_velocity: float
    drive_stiffness: float
    drive_damping_speed: float
    drive_radius: float
    backlash: float
    camshaft_inertia: float
    camshaft_drag: float
    rated_speed: float
    tolerance: float = 1.0e-3
    start_cycles: float = 2.0
    start_speed: float = 100.0 * math.pi / 30.0
    angle_source: str = "auto"
    inputs_at: str = "begin"


class Model(NamedTuple):
    """Constants of a run: numbers by their slots, a cam of each kind, the lines' noses at the camshaft, choices."""

    numbers: Array
    cams: Array
    noses: Array
    choices: NDArray[np.int64]
    mark: NDArray[np.void]


class Work(NamedTuple):
    """Workspace of the kernels: a row for each line, and the camshaft."""

    rows: Array
    shaft: Array
    mark: NDArray[np.void]


def build_model(settings: TrainSettings) -> Model:
    """Arrays of a run; ``InputError`` for values that do not go together."""
    check_settings(settings)
    s = settings
    given = asdict(s)
    ends = {kind: (given[f"{kind}_opens"], given[f"{kind}_closes"]) for kind in ("intake", "exhaust")}
    cams = np.array([cam_of(s, kind) for kind in ends])
    assert cams.shape == (2, len(CAM))
    slopes = [abs(cam_lift(cam, psi)[1]) for cam in cams for psi in np.linspace(-cam[HALF], 0.0, SAMPLES)]
    given |= {
        "half_gap": 0.5 * s.backlash / s.drive_radius,
        "velocity": 0.5 * s.rated_speed * s.ratio * max(slopes),
        "contact_modulus": s.modulus,
        "modal_mass": 0.5 * s.spring_mass,
        "damping": 1.0 / s.damping_velocity,
        "seat_damping": 1.0 / s.seat_damping_velocity,
        "drive_damping": 1.0 / s.drive_damping_speed,
    }
    for k in range(MODES):
        n = k + 1
        stiffness = 0.5 * s.spring_rate * (n * math.pi) ** 2
        given[f"coupling_{n}"] = s.spring_mass * (-1.0) ** (n + 1) / (n * math.pi)
        given[f"modal_stiffness_{n}"] = stiffness
        given[f"modal_damping_{n}"] = 2.0 * s.spring_damping * math.sqrt(stiffness * 0.5 * s.spring_mass)
    middles = [0.5 * sum(pair) for pair in ends.values()]
    noses = np.array([0.5 * (firing + middle) for firing in s.firing_angles for middle in middles])
    choices = np.array([ANGLES.index(s.angle_source), TIMES.index(s.inputs_at)])
    return Model(np.array([float(given[name]) for name in NUMBERS]), cams, noses, choices, build_mark())


def cam_of(settings: TrainSettings, kind: str) -> Array:
    """Numbers of a cam, ``intake`` or ``exhaust``: ramps take up lash and what the preload strains.

    A valve that opens slowly thus begins to lift at the ramp's end, and reaches its lift at the nose.
    """
    s, given = settings, asdict(settings)
    held = s.lash + s.spring_preload / s.stiffness
    lift = given[f"{kind}_lift"]
    top = held + lift * (1.0 + s.spring_rate / s.stiffness)
    half = 0.25 * (given[f"{kind}_closes"] - given[f"{kind}_opens"])
    mass = given[f"{kind}_mass"] + s.train_mass + s.spring_mass / 3.0
    return cam_row(mass, half, s.ramp, held / s.ratio, top / s.ratio, s.power)


def make_work(lines: int) -> Work:
    """Workspace of one run."""
    return Work(np.zeros((lines, len(ROW))), np.zeros(len(SHAFT)), build_mark())


def smallest_radius(settings: TrainSettings, kind: str) -> float:
    """Smallest convex radius of curvature of a cam, m; 0 or less where the follower would undercut it."""
    s, cam = settings, cam_of(settings, kind)
    found = math.inf
    for psi in np.linspace(-cam[HALF] - cam[RAMP], 0.0, SAMPLES):
        lift, slope, curve = cam_lift(cam, psi)
        radius = cam_radius(s.base_radius, s.roller_radius, lift, slope, curve)
        # Under a roller a hollow flank has a radius below −roller_radius.
        if not (s.roller_radius > 0.0 and radius < -s.roller_radius):
            found = min(found, radius)
    return found


def check_settings(settings: TrainSettings) -> None:
    """Refuse values that no valve train has together; ``InputError`` names the one and what it must be."""
    s = settings
    for name, names in (("angle_source", ANGLES), ("inputs_at", TIMES)):
        if getattr(s, name) not in names:
            raise InputError(f"{name} '{getattr(s, name)}' is not known; {nearest(str(getattr(s, name)), names)}")
    for entry in fields(s):
        value = getattr(s, entry.name)
        if isinstance(value, float) and not math.isfinite(value):
            raise InputError(f"{entry.name} is {value}; it must be a finite number")
    degrees = 180.0 / math.pi
    for kind, low, high in (("intake", -4.0 * math.pi, 0.0), ("exhaust", 0.0, 4.0 * math.pi)):
        opens, closes = getattr(s, f"{kind}_opens"), getattr(s, f"{kind}_closes")
        if not low <= opens < closes <= high:
            raise InputError(
                f"{kind}_opens {degrees * opens:g} deg, closes {degrees * closes:g} deg; it opens before it closes, "
                f"both between {degrees * low:g} and {degrees * high:g} deg after firing dead centre"
            )
        if closes - opens + 4.0 * s.ramp >= 4.0 * math.pi:
            raise InputError(f"ramp {degrees * s.ramp:g} deg of the cam leaves the {kind} valve no time on its seat")
        radius = smallest_radius(s, kind)
        if not radius > 0.0:
            raise InputError(
                f"base_radius {1e3 * s.base_radius:g} mm is too small for the {kind} cam, whose flank would have a "
                f"radius of {1e3 * radius:.2f} mm; enlarge it, open for longer or lift less"
            )
