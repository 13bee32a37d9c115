"""Indices of the valve train's numbers, inputs and states in their arrays.

A state vector is a head, followed by ``LINE`` quantities for each line. A line is a cam with all parts that it drives.
Cylinder i has the lines 2 i (intake) and 2 i + 1 (exhaust).
"""

from cranktrain.modules.crank_angle import HEAD as CRANK_HEAD

GIVEN = (
    "ratio", "stiffness", "lash", "spring_rate", "spring_preload", "seat_stiffness", "friction", "base_radius",
    "roller_radius", "cam_width", "modulus", "drive_stiffness", "drive_radius", "camshaft_inertia", "camshaft_drag",
    "tolerance",
)  # fmt: skip
"""Fields of the settings that kernels read during steps."""
N_GIVEN = len(GIVEN)
NUMBERS = (
    *GIVEN, "damping", "seat_damping", "drive_damping", "half_gap", "velocity", "coupling_1", "coupling_2",
    "modal_mass", "modal_stiffness_1", "modal_stiffness_2", "modal_damping_1", "modal_damping_2",
)  # fmt: skip
"""Names of a model's numbers: given and derived values."""
(
    RATIO, STIFFNESS, LASH, RATE, PRELOAD, SEAT, FRICTION, BASE_RADIUS,
    ROLLER_RADIUS, CAM_WIDTH, CONTACT_MODULUS, DRIVE, DRIVE_RADIUS, INERTIA, DRAG,
    TOLERANCE, DAMPING, SEAT_DAMPING, DRIVE_DAMPING, HALF_GAP, VELOCITY, COUPLING, COUPLING_2,
    MODAL_MASS, MODAL_STIFFNESS, MODAL_STIFFNESS_2, MODAL_DAMPING, MODAL_DAMPING_2,
) = range(len(NUMBERS))  # fmt: skip
MODES = 2
"""Number of surge modes of a spring; the numbers of all modes are adjacent."""

CAM = ("mass", "half", "ramp", "ramp_speed", "step_power", "lift", "c_1", "c_2", "c_3", "c_4")
"""Numbers of a cam: mass of the driven parts at the valve, and shape of the cam; see :mod:`.cam`."""
MASS, HALF, RAMP, RAMP_SPEED, STEP_POWER, LIFT, C_1, C_2, C_3, C_4 = range(len(CAM))
INTAKE, EXHAUST = range(2)
KINDS = ("intake", "exhaust")

OF_KIND = ("opens", "closes", "lift", "mass")
"""Numbers of each kind of valves among a run's numbers; see :mod:`.settings`."""
OPENS, CLOSES, HIGHEST, OWN_MASS = range(len(OF_KIND))
RUN_NUMBERS = (
    *GIVEN, *(f"{kind}_{name}" for kind in KINDS for name in OF_KIND), "ramp", "power", "train_mass",
    "damping_velocity", "spring_mass", "spring_damping", "seat_damping_velocity", "drive_damping_speed", "backlash",
    "rated_speed", "start_cycles", "start_speed", "angle_source", "inputs_at",
)  # fmt: skip
"""Names of a run's numbers: given values, then values for preparation and start only; firing angles follow."""
FIRST_KIND, N_OF_KIND = N_GIVEN, len(OF_KIND)
(
    CAM_RAMP, POWER, TRAIN_MASS, DAMPING_VELOCITY, SPRING_MASS, SPRING_DAMPING, SEAT_VELOCITY, DRIVE_SPEED, BACKLASH,
    RATED_SPEED, START_CYCLES, START_SPEED, ANGLE_SOURCE, INPUTS_AT,
) = range(FIRST_KIND + len(KINDS) * N_OF_KIND, len(RUN_NUMBERS))  # fmt: skip
FIRING = len(RUN_NUMBERS)

CHOICES = ("given_angle", "ends")
"""Choices of a model: indices in ``ANGLES`` and ``TIMES`` of :mod:`cranktrain.modules.crank_angle`."""
GIVEN_ANGLE, ENDS = range(len(CHOICES))

INPUTS = ("crank.speed", "crank.angle")

HEAD = (
    *CRANK_HEAD, "crank_speed", "cam_angle", "cam_speed", "cam_acceleration", "step", "steps", "rejected", "work",
    "friction", "damped", "first_energy", "torque", "friction_power", "apart_now", "apart", "cycle_work", "torque_mean",
)  # fmt: skip
(
    CRANK_SPEED, CAM_ANGLE, CAM_SPEED, CAM_ACCELERATION, STEP, STEPS, REJECTED, WORK, FRICTION_WORK,
    DAMPED, FIRST_ENERGY, TORQUE, FRICTION_POWER, APART_NOW, APART, CYCLE_WORK, TORQUE_MEAN,
) = range(len(CRANK_HEAD), len(HEAD))  # fmt: skip
"""State of camshaft, steps, energies since the start, torque and friction power of the last communication step,
values of the cycle."""
N_HEAD = len(HEAD)

LINE = (
    "x", "v", "q_1", "q_2", "w_1", "w_2", "acceleration", "impact_now", "impact", "loss_now", "loss", "bounce_now",
    "bounce", "landed",
)  # fmt: skip
"""State of each line: lift (m), velocity, spring modes and their velocities, and values stored over the cycle."""
(
    X, V, Q, Q_2, W, W_2, ACCELERATION, IMPACT_NOW, IMPACT, LOSS_NOW, LOSS, BOUNCE_NOW,
    BOUNCE, LANDED,
) = range(len(LINE))  # fmt: skip
N_LINE = len(LINE)

OUTPUTS = (
    "valvetrain.torque", "valvetrain.torque_step", "valvetrain.torque_mean", "camshaft.lag", "camshaft.speed",
    "drive.torque", "drive.force", "drive.apart", "friction.power", "contact.loss", "balance.energy", "solver.steps",
    "solver.rejected",
)  # fmt: skip
LINE_OUTPUTS = (
    "lift", "cam_force", "cam_pressure", "spring_force", "seat_force", "seating_velocity", "contact_loss", "bounce",
)  # fmt: skip
"""Outputs of each line, intake first: ``cylinder[i].intake_lift``; the last three refer to the last cycle."""
N_OUTPUTS, N_LINE_OUTPUTS = len(OUTPUTS), len(LINE_OUTPUTS)
(
    OUT_TORQUE, OUT_TORQUE_STEP, OUT_TORQUE_MEAN, OUT_LAG, OUT_SPEED, OUT_DRIVE_TORQUE, OUT_DRIVE_FORCE,
    OUT_APART, OUT_FRICTION, OUT_LOSS, OUT_BALANCE, OUT_STEPS, OUT_REJECTED,
) = range(N_OUTPUTS)  # fmt: skip
(
    OUT_LIFT, OUT_CAM_FORCE, OUT_PRESSURE, OUT_SPRING, OUT_SEAT, OUT_VELOCITY, OUT_LINE_LOSS, OUT_BOUNCE,
) = range(N_LINE_OUTPUTS)  # fmt: skip

ROW = (
    "x0", "v0", "q0_1", "q0_2", "w0_1", "w0_2",
    "x", "v", "q_1", "q_2", "w_1", "w_2",
    "x_hat", "v_hat", "linear", "constant", "a", "a_1", "b_1", "b_2",
    "force", "seat_force", "arm", "lift", "slope", "curve", "correction", "by_shaft", "nose",
)  # fmt: skip
"""Workspace of a line in a step: start values, present stage, known parts of the stage, accelerations, forces."""
(
    R_X0, R_V0, R_Q0, R_Q0_2, R_W0, R_W0_2,
    R_X, R_V, R_Q, R_Q_2, R_W, R_W_2,
    R_X_HAT, R_V_HAT, R_LINEAR, R_CONSTANT, R_A, R_A1, R_B, R_B_2,
    R_FORCE, R_SEAT, R_ARM, R_LIFT, R_SLOPE, R_CURVE, R_CORRECTION, R_BY_SHAFT, R_NOSE,
) = range(len(ROW))  # fmt: skip

SHAFT = (
    "angle0", "speed0", "angle", "speed", "alpha", "alpha_1", "angle_hat", "speed_hat", "torque", "crank_angle",
    "crank_speed", "impulse", "friction", "damped",
)  # fmt: skip
"""Workspace of the camshaft in a step; angle and speed of the crank are halved, as at the drive's camshaft end."""
(
    S_ANGLE0, S_SPEED0, S_ANGLE, S_SPEED, S_ALPHA, S_ALPHA1, S_ANGLE_HAT, S_SPEED_HAT, S_TORQUE, S_CRANK_ANGLE,
    S_CRANK_SPEED, S_IMPULSE, S_FRICTION_WORK, S_DAMPED_WORK,
) = range(len(SHAFT))  # fmt: skip
