"""Slots of the running model's arrays: names of their rows and columns.

Nothing is imported here, so that kernels which read a slot do not depend on the modules that make the arrays.
"""

from __future__ import annotations

# Columns of ``ModelArrays.cylinders``: masses (kg), angles (rad), lengths (m), piston area (m²), remainder inertia of
# the rod (kg m²), clearance volume (m³), highest position of the piston pin (m), cosine and sine of the bank's angle;
# 1, or 0 if rod and piston are added bodies and a connection is the gas; stroke of the piston (m). For an articulated
# rod the cylinder of its master rod (−1 for others), and the joint of :mod:`cranktrain.loads.articulated_rod`.
M_SMALL, BANK, PHASE, AREA, ROD, M_BIG, M_OSC, DELTA_J, OFFSET, CLEARANCE_VOLUME, STROKE_TOP = range(11)
COS_BANK, SIN_BANK, OWN_ROD, STROKE, MASTER, JOINT, PARAMETERS = 11, 12, 13, 14, 15, 16, 22
# Ports of the cylinder, −1 if there is none: displacement of the pin under its rod (x, then y) and the pin's rotation;
# displacement of a free big end (x, then y); displacement of a guided piston across the cylinder, then its rotation;
# the first of three of the liner. Then the rows of ``connections`` between pin and rod, and of a free big end. A pin of
# a crank whose journals are locked has only its rotation.
PIN_PORT, PIN_TURN, END_PORT, PISTON_PORT, LINER_PORT, PIN_ROW, END_ROW, CYLINDER = range(22, 30)
# ``ModelArrays.scalars``. ``DRIVEN`` is 1 if the shaft's speed is given, 0 if a torque loads it. ``SHAFT_K`` and
# ``SHAFT_C`` are stiffness and damping of the whole drive line at the flywheel, for slow wind-up. ``LINE_INERTIA`` is
# the inertia of its rotors and the dynamometer reduced to the crank, if all turn as one.
GRAVITY, CRANKCASE, GAS_LOAD, BEST_SPEED, FALLOFF, SHAFT_K, SHAFT_C, FILTER, RIGID_ROTATION, STEP = range(10)
# ``WINDUP_K`` is the torque of the drive line's springs on the flywheel per wind-up, ``WINDUP_LEAD`` the wind-up per
# lead of the frame.
DRIVEN, DAMPER_TEMPERATURE, LINE_INERTIA, WINDUP_K, WINDUP_LEAD, SCALARS = range(10, 16)
# ``ModelArrays.choices``: numbers of gas source and reconstruction of the inputs, Newton tolerance, fraction of its
# thickness by which a film may close in a step, tolerance of adaptive control (0: fixed steps), order of the embedded
# method and of the method itself, communication steps by which given pressures are late, the method's mark in a state;
# most Newton iterations of a communication step (0: no limit); 1 if internal steps pass over communication points;
# position of the encoder that the gas trace is phased to, :data:`PIN` to :data:`FLYWHEEL`.
GAS_SOURCE, RECONSTRUCTION, NEWTON_TOLERANCE, FILM_CHANGE, STEP_TOLERANCE, EMBEDDED_ORDER, ORDER = range(7)
GAS_DELAY, METHOD_MARK, WORK_LIMIT, DENSE, ENCODER, CHOICES = 7, 8, 9, 10, 11, 12
PIN, PULLEY, FLYWHEEL = range(3)
# ``ModelArrays.layout``, read by :mod:`cranktrain.dynamics.model.layout`: modes of the crank; ports in all; rows of
# ``connections`` of the thrust bearing, of the drive line's axial joint and of the damper (−1: none); 1 if that joint
# is a spline, which slides; 1 if rotation couples modes by gyroscopic or centrifugal terms; 1 if bodies or connections
# are added.
CRANK_MODES, PORTS, THRUST_ROW, JOINT_ROW, DAMPER_ROW, SLIDING, WHIRLS, ADDED, LAYOUT = range(9)
# Rows of ``ModelArrays.ends``: rotations of flywheel and pulley about the axis, displacements of both along it.
FLYWHEEL_ROTATION, PULLEY_ROTATION, PULLEY_AXIAL, FLYWHEEL_AXIAL = range(4)
# Columns of ``BlockArrays.mount_laws``: stiffness (N/m, N m/rad) and damping of a mount's component, its preload (N),
# and its preload per m/s² of gravity.
MOUNT_STIFFNESS, MOUNT_DAMPING, MOUNT_PRELOAD, MOUNT_WEIGHT, MOUNT_LAW = range(5)
# Columns of ``ModelArrays.connections``: number of Newton ports that a law couples, and the first of up to four; index
# of the first component of the x-y pairs that rotate with the frame's axes. Ports, −1 for none: the rotation whose rate
# is added to the frame's speed and on which friction acts; the rotation on which moments of displaced forces act, and
# the rotation of the stationary body, on which the opposite moments act; the drive line's wind-up, whose torque is
# input of the law. 1 if the rods' equations call the law, 0 if the law acts on the relative motion of its ports; 1 if
# the other body is the block.
COUPLED, FIRST, PAIRS, SPIN, TURNED, REACTS, TOLD, OF_ROD, ON_BLOCK, CONNECTION = 0, 1, 5, 6, 7, 8, 9, 10, 11, 12
NO_PORT = -1.0
# Columns of ``Work.frames``: motion of the frame at a stage; the load torque on the rotor (N m), the restraint of the
# block as a whole while the start of a run is sought, (rad/s)², the frame's angle relative to the cylinders of a block
# that rolls, rad, and the torque that the valve train takes, N m; axial force on the flywheel, N.
THETA, OMEGA, OMEGA_DOT, LEAD, LEAD_RATE, WHIRL, COS, SIN, LOAD, BLOCK_RESTRAINT, FIRING = range(11)
# Displacement of the axis by a flexible block's motion on its mounts, m: of the crank, along the frame's axes, and of
# the block, in axes at rest; 0 on rigid ground.
VALVE_TORQUE, AXIAL_FORCE, CRANK_X, CRANK_Y, BLOCK_X, BLOCK_Y = range(11, 17)
# Of the gas: fraction of the burn's rise with the built-in trace, −1 if pressures are given; rotation (rad) relative to
# the frame of the encoder on pulley or flywheel that the trace is phased to; the crank's own angle, rad, and the power
# of given pressures in the stage, W.
BURN, ENCODED, CRANK, GIVEN_POWER, FRAME_SIZE = range(17, 22)
# Rows of ``Work.port``: u, u̇, ü and forces of the ports at a stage, the stage's Q and V at the ports, u without forces,
# the step of an iteration, difference of a step from its embedded solution, u before an iteration; u, u̇, ü at the
# state; Taylor series of a guess, and the guess; relative motion d, ḋ from the last evaluation of forces or of the
# state; change of the forces in an iteration.
U, UD, UDD, FORCES, U_Q, U_V, U_FREE, U_STEP, U_DIFFERENCE, U_BEFORE = range(10)
STATE_U, STATE_UD, STATE_UDD, SERIES, GUESS, RELATIVE, RELATIVE_RATE, F_STEP, PORT_VECTORS = range(10, 19)
# Rows of ``Work.modal``: vectors of a stage, its Q and V, known part of a step of Newmark's form, and the difference of
# the step from its embedded solution.
BASE, LOADS, LEVER, Q_FREE, BIG_Q, BIG_V, KNOWN, DIFFERENCE, MODAL_VECTORS = range(9)
# Rows of ``Work.inputs``: value and rate of each input over the communication step. If ``EXPONENT`` is positive, they
# are those of a cylinder's p Vⁿ over the crank's angle, with its curvature BEND; if it is negative, those of the
# pressure at the crank's angle, which is converted to the cylinder's own angle. Then the angles of the two newest
# samples, and 1 if they have deviations of volumes; extrapolation of the earlier samples to the newest, and its rate.
VALUE, RATE, BEND, EXPONENT, ANGLES, FORESEEN, FORESEEN_RATE, INPUT_ROWS = range(8)
DEVIATIONS = 2
"""Index in row ``ANGLES`` of the mark for deviations of volumes."""
# Columns of the first row of ``Work.staged``: number of given stages, number of the method's stages, step (rad).
STAGES_GIVEN, STAGES_THERE, STAGE_STEP = range(3)
# Inputs after speed and pressures: torque on the dynamometer and of the valve train, N m; axial force on the flywheel,
# N; the crank angle that the pressures belong to, rad; from DEVIATION_INPUT on, for each cylinder, the deviation of the
# volume that its pressure belongs to, m³. Then the number of inputs that do not belong to a cylinder, and of inputs per
# cylinder.
LOAD_INPUT, VALVE_INPUT, AXIAL_INPUT, ANGLE_INPUT, DEVIATION_INPUT = 1, 2, 3, 4, 5
OTHER_INPUTS, CYLINDER_INPUTS = 5, 2
# ``Work.counters``; the last three are the work of the present communication step, 1 if it was cut short, and the
# number of communication steps cut short.
N_STEPS, N_STAGES, N_ITERATIONS, N_REJECTED, N_FACTORS, WORST_RESIDUAL, N_MISSED = range(7)
N_WORK, N_CUT, N_LIMITED, COUNTERS = 7, 8, 9, 10
# Columns of ``Work.key``: step and speed for which the factors of a slot were made.
KEY_STEP, KEY_SPEED, KEYS = range(3)
# ``Work.powers``, W, as last observed. For torques: power of the gas on pistons relative to a block at rest, and of
# friction in mains, in big ends and at liners relative to parts at rest.
GAS_POWER, MAINS_FRICTION, BIG_ENDS_FRICTION, LINERS_FRICTION = range(4)
# For the energy balance: power of the gas on pistons and heads, all losses and loads, and the energy stored in bodies
# and shafts, J.
GAS_WORK, DYNAMOMETER_POWER, VALVE_POWER, MAINS_SHEAR, MAINS_SQUEEZE, THRUST_LOSS, BIG_ENDS_SHEAR = range(4, 11)
BIG_ENDS_SQUEEZE, LINERS_LOSS, SKIRTS_LOSS, DAMPER_LOSS, CRANK_LOSS, BLOCK_LOSS = range(11, 17)
MOUNTS_LOSS, SHAFTS_LOSS, AXIAL_JOINT_LOSS, AXIAL_FORCE_WORK, STORED = range(17, 22)
# Power that added connections take from the bodies, including the energy of their springs, and the loss of added bodies
# by their own damping.
LINKS_LOSS, ADDED_LOSS, POWERS = 22, 23, 24
# Columns of ``Work.family``.
STEP_KERNEL, DIFFERENCE_KERNEL = range(2)
# Columns of ``Basis.methods``, see :mod:`cranktrain.dynamics.model.basis`: order of the embedded method (0: none),
# order that tolerances follow, largest factor by which the error of a stage enters the step, the method's mark in a
# state, and 1 if the model has elastic films whose largest pressures do not converge with the method.
EMBEDDED, METHOD_ORDER, AMPLIFICATION, MARK, LOSES_PEAKS, METHOD_COLUMNS = range(6)
# ``Basis.cylinders``: bore (m) and compression ratio that the model was made for, and 1 if a flexible block was made
# for this bore.
BORE, COMPRESSION, BORE_FITTED, CYLINDER_CONSTANTS = range(4)
# ``Basis.films``: 1 if the mains have oil films, 1 if the big ends have.
MAINS_OIL, BIG_ENDS_OIL, FILM_KINDS = range(3)
# ``Work.start.mean``, estimate of the motion to come: mean wind-up of the shaft (rad) and torque (N m), the crank's
# rotation relative to it (rad) and its rate, inertia of crank and rods (kg m², 0 if there is no estimate).
START_WINDUP, START_TORQUE, START_ROTATION, START_ROTATION_RATE, START_INERTIA, START_MEAN = range(6)
# Rows of ``Work.start.block``: load by a unit torque, the block's displacement and its rate, pivots.
START_LOAD, START_PLACE, START_RATE, START_PIVOTS, START_ROWS = range(5)
START_SAMPLES, START_HARMONICS = 720, 361
"""Number of angles per cycle at which the torque on a rigid crank is sampled, and number of its harmonics."""
ROTATION = 5
"""Rotation about the crank's axis: component of motion of an interface, and mode of the rigid crank."""
FACTOR_SLOTS = 7
"""Number of step sizes whose factors are kept at once: the whole step, its half, quarter, … ."""
AMBIENT = 101325.0
"""Pressure of the surroundings, Pa."""
