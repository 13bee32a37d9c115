"""Settings of a valve train as one frozen record in SI, and the run made from them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from cranktrain.core.build_mark import build_mark
from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.modules.crank_angle import ANGLES, OK, TIMES
from cranktrain.modules.module_settings import check_values, run_numbers, stated
from cranktrain.modules.valve_train import cam as cams
from cranktrain.modules.valve_train import slots as at
from cranktrain.modules.valve_train.preparation import NO_SEAT_TIME, SMALL_BASE, check_numbers, make_cam, prepare_model
from cranktrain.modules.valve_train.run_record import Model, Run, Work

if TYPE_CHECKING:  # an FMU contains the settings without the quantities of module files
    from cranktrain.engine import quantities as q
    from cranktrain.modules.valve_train import quantities as own


CHOICES = {"angle_source": ANGLES, "inputs_at": TIMES}
"""Settings that are one of several names; a run's numbers hold the index of the name."""
MEND_ANGLES = tuple(
    f"it opens before it closes, both between {span} deg after firing dead centre"
    for span in ("-720 and 0", "0 and 720")
)
MEND_RAMP = "shorten it, or open for less"
MEND_BASE = "enlarge it, open for longer or lift less"


@dataclass(frozen=True, kw_only=True)
class TrainSettings:
    """Cams, lines, seats, drive and camshaft of one engine, in SI (angles rad).

    Opening and closing angles are counted from a cylinder's firing dead centre: those of the intake are before it,
    those of the exhaust after it. ``firing_angles`` are the crank angles of these dead centres. Masses, forces and
    stiffnesses are at the valve, for all valves of one cam together. A ``damping_velocity`` is the closing velocity at
    which damping doubles a contact's force. ``roller_radius`` 0 is a flat follower; ``start_cycles`` cycles are run
    before the start.
    """

    name: str
    title: str
    firing_angles: tuple[float, ...]
    intake_opens: q.Angle = field(metadata=stated("intake.opens"))
    intake_closes: float
    intake_lift: own.Lift = field(metadata=stated("intake.lift"))
    intake_mass: q.Mass = field(metadata=stated("intake.mass"))
    exhaust_opens: float
    exhaust_closes: q.Angle = field(metadata=stated("exhaust.closes"))
    exhaust_lift: own.Lift = field(metadata=stated("exhaust.lift"))
    exhaust_mass: q.Mass = field(metadata=stated("exhaust.mass"))
    base_radius: q.Size = field(metadata=stated("cam.base_radius"))
    roller_radius: own.Radius = field(metadata=stated("cam.roller_radius"))
    cam_width: q.Length = field(metadata=stated("cam.width"))
    ramp: own.Ramp = field(metadata=stated("cam.ramp"))
    power: own.Power = field(metadata=stated("cam.power"))
    friction: q.Friction = field(metadata=stated("cam.friction"))
    modulus: q.Modulus = field(metadata=stated("cam.modulus"))
    ratio: own.Ratio = field(metadata=stated("train.ratio"))
    train_mass: q.Mass = field(metadata=stated("train.mass"))
    stiffness: q.Stiffness = field(metadata=stated("train.stiffness"))
    damping_velocity: q.Velocity = field(metadata=stated("train.damping_velocity"))
    lash: own.Lash = field(metadata=stated("train.lash"))
    spring_rate: q.Stiffness = field(metadata=stated("spring.rate"))
    spring_preload: float
    spring_mass: q.Mass = field(metadata=stated("spring.mass"))
    spring_damping: q.DampingRatio = field(metadata=stated("spring.damping"))
    seat_stiffness: q.Stiffness = field(metadata=stated("seat.stiffness"))
    seat_damping_velocity: q.Velocity = field(metadata=stated("seat.damping_velocity"))
    drive_stiffness: q.TorsionalStiffness = field(metadata=stated("drive.stiffness"))
    drive_damping_speed: own.DampingSpeed = field(metadata=stated("drive.damping_speed"))
    drive_radius: q.Size = field(metadata=stated("drive.radius"))
    backlash: own.Lash = field(metadata=stated("drive.backlash"))
    camshaft_inertia: q.Inertia = field(metadata=stated("camshaft.inertia"))
    camshaft_drag: q.TorsionalDamping = field(metadata=stated("camshaft.drag"))
    rated_speed: q.RatedSpeed = field(metadata=stated("camshaft.rated_speed"))
    tolerance: float = 1.0e-3
    start_cycles: float = 2.0
    start_speed: float = 100.0 * RPM
    angle_source: str = "auto"
    inputs_at: str = "begin"


def make_run(settings: TrainSettings) -> Run:
    """Make a prepared run with all inputs 0; the state is not started yet.

    Raises ``InputError`` for contradictory values.
    """
    model, lines = build_model(settings), len(at.KINDS) * len(settings.firing_angles)
    work = make_work(lines)
    outputs = np.zeros(at.N_OUTPUTS + lines * at.N_LINE_OUTPUTS)
    return Run(model, work, np.zeros(work.trial.size), np.zeros(len(at.INPUTS)), outputs, numbers_of(settings))


def build_model(settings: TrainSettings) -> Model:
    """Constants of a run, see :func:`make_run`."""
    check_settings(settings)
    lines = len(at.KINDS) * len(settings.firing_angles)
    choices = np.zeros(len(at.CHOICES), dtype=np.int64)
    model = Model(np.zeros(len(at.NUMBERS)), _cams(), np.zeros(lines), choices, build_mark())
    prepare_model(numbers_of(settings), model, _cams())
    return model


def make_work(lines: int) -> Work:
    """Workspace of one run."""
    trial = np.zeros(at.N_HEAD + lines * at.N_LINE)
    return Work(np.zeros((lines, len(at.ROW))), np.zeros(len(at.SHAFT)), _cams(), trial, build_mark())


def _cams() -> Array:
    return np.zeros((len(at.KINDS), len(at.CAM)))


def numbers_of(settings: TrainSettings) -> Array:
    """Numbers of a run in the order of ``slots.RUN_NUMBERS``, followed by the firing angles."""
    return run_numbers(settings, at.RUN_NUMBERS, CHOICES)


def cam_of(settings: TrainSettings, kind: str) -> Array:
    """Numbers of the ``intake`` or ``exhaust`` cam, in the slots of ``CAM``."""
    cam = np.zeros(len(at.CAM))
    make_cam(numbers_of(settings), at.KINDS.index(kind), cam)
    return cam


def smallest_radius(settings: TrainSettings, kind: str) -> float:
    """Smallest convex radius of curvature of a cam, m; 0 or less if the follower would undercut it."""
    return float(cams.smallest_radius(cam_of(settings, kind), settings.base_radius, settings.roller_radius))


def check_settings(settings: TrainSettings) -> None:
    """Raise ``InputError`` for contradictory values; the message names the value and what it must be."""
    check_values(settings, CHOICES)
    status = check_numbers(numbers_of(settings), _cams())
    if status != OK:
        raise InputError(_refusal(settings, status))


def _refusal(settings: TrainSettings, status: int) -> str:
    """Error message for a status of :mod:`.preparation`, with values of the ``settings``."""
    s, k, degrees = settings, status % 10, 180.0 / math.pi
    kind = at.KINDS[k]
    if status == NO_SEAT_TIME + k:
        return f"ramp {degrees * s.ramp:g} deg of the cam leaves the {kind} valve no time on its seat; {MEND_RAMP}"
    if status == SMALL_BASE + k:
        return (
            f"base_radius {1e3 * s.base_radius:g} mm is too small for the {kind} cam, whose flank would have a "
            f"radius of {1e3 * smallest_radius(s, kind):.2f} mm; {MEND_BASE}"
        )
    opens, closes = (degrees * getattr(s, f"{kind}_{end}") for end in ("opens", "closes"))
    return f"{kind}_opens {opens:g} deg, closes {closes:g} deg; {MEND_ANGLES[k]}"
