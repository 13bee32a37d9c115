"""Slots of the running model's arrays: what each row or column of them holds.

Nothing is imported here, so that kernels which read a slot rest on nothing that makes the arrays.
"""

from __future__ import annotations

# Columns of ``ModelArrays.cylinders``: masses (kg), angles (rad), lengths (m), piston area (m²), remainder inertia of
# the rod (kg m²), clearance volume (m³), highest position of the piston pin (m), cosine and sine of the bank's angle;
# 1, or 0 where rod and piston are added bodies and a connection is the gas; stroke of the piston (m). Of an articulated
# rod the cylinder of its master rod, −1 of others, and the joint of :mod:`cranktrain.loads.articulated_rod`.
M_SMALL, BANK, PHASE, AREA, ROD, M_BIG, M_OSC, DELTA_J, OFFSET, CLEARANCE_VOLUME, STROKE_TOP = range(11)
COS_BANK, SIN_BANK, OWN_ROD, STROKE, MASTER, JOINT, PARAMETERS = 11, 12, 13, 14, 15, 16, 22
# Ports of the cylinder, −1 where there is none: displacement of the pin under its rod (x, then y) and the pin's
# rotation; displacement of a free big end (x, then y); of a guided piston its displacement across the cylinder, then
# its rotation; the first of three of its liner. Then the rows of ``connections`` between pin and rod, and of a free
# big end. A pin of a crank whose journals are locked has its rotation alone.
PIN_PORT, PIN_TURN, END_PORT, PISTON_PORT, LINER_PORT, PIN_ROW, END_ROW, CYLINDER = range(22, 30)
# ``ModelArrays.scalars``; ``DRIVEN`` is 1 where the shaft's speed is given, 0 where a torque loads it; ``SHAFT_K`` and
# ``SHAFT_C`` are those of the whole drive line at the flywheel, as it winds up slowly; ``LINE_INERTIA`` is that of its
# rotors and the dynamometer as the crank feels it when all turn as one.
GRAVITY, CRANKCASE, GAS_LOAD, BEST_SPEED, FALLOFF, SHAFT_K, SHAFT_C, FILTER, RIGID_ROTATION, STEP = range(10)
# ``WINDUP_K`` is the torque of the drive line's springs on the flywheel by its wind-up, ``WINDUP_LEAD`` the wind-up by
# the frame's lead.
DRIVEN, DAMPER_TEMPERATURE, LINE_INERTIA, WINDUP_K, WINDUP_LEAD, SCALARS = range(10, 16)
# ``ModelArrays.choices``: numbers of gas source and reconstruction of the inputs, Newton tolerance, share of itself by
# which a film may close over a step, tolerance of adaptive control (0: fixed steps), order of the embedded method and
# of the method itself, communication steps by which given pressures are late, the method's mark in a state; Newton
# iterations that a communication step may take (0: any number); 1 where internal steps pass over communication points;
# where the encoder sits that the gas trace is phased to, :data:`PIN` to :data:`FLYWHEEL`.
GAS_SOURCE, RECONSTRUCTION, NEWTON_TOLERANCE, FILM_CHANGE, STEP_TOLERANCE, EMBEDDED_ORDER, ORDER = range(7)
GAS_DELAY, METHOD_MARK, WORK_LIMIT, DENSE, ENCODER, CHOICES = 7, 8, 9, 10, 11, 12
PIN, PULLEY, FLYWHEEL = range(3)
# ``ModelArrays.layout``, read by :mod:`cranktrain.dynamics.model.layout`: modes of the crank; ports in all; rows of
# ``connections`` of the thrust bearing, of the drive line's axial joint and of the damper (−1: none); 1 where that
# joint is a spline, which slides; 1 where turning couples modes, by gyroscopic or centrifugal terms; 1 where bodies or
# connections are added.
CRANK_MODES, PORTS, THRUST_ROW, JOINT_ROW, DAMPER_ROW, SLIDING, WHIRLS, ADDED, LAYOUT = range(9)
# Rows of ``ModelArrays.ends``: rotations of flywheel and pulley about the axis, displacements of both along it.
FLYWHEEL_ROTATION, PULLEY_ROTATION, PULLEY_AXIAL, FLYWHEEL_AXIAL = range(4)
# Columns of ``BlockArrays.mount_laws``: stiffness (N/m, N m/rad) and damping of a mount's component, its preload (N),
# and that by m/s² of gravity.
MOUNT_STIFFNESS, MOUNT_DAMPING, MOUNT_PRELOAD, MOUNT_WEIGHT, MOUNT_LAW = range(5)
# Columns of ``ModelArrays.connections``: number of Newton ports that a law couples, and the first of up to four; the
# first component of the pairs that turn with the frame's axes. Ports, −1 for none: the rotation whose rate is added to
# the frame's speed and that friction turns; the rotation that takes the moments of displaced forces, and that of the
# stationary body, which takes the opposite; the drive line's wind-up, whose torque the law is told. 1 where the rods'
# equations call the law, 0 where it acts on the relative motion of its ports; 1 where the other body is the block.
COUPLED, FIRST, PAIRS, SPIN, TURNED, REACTS, TOLD, OF_ROD, ON_BLOCK, CONNECTION = 0, 1, 5, 6, 7, 8, 9, 10, 11, 12
NO_PORT = -1.0
# What a stage knows of the frame's motion, ``Work.frames``; the load torque on the rotor (N m), the restraint of the
# block as a whole, (rad/s)², while a run's start is sought, the frame's angle against cylinders that lean, rad, and the
# torque that the valve train takes, N m; axial force on the flywheel, N.
THETA, OMEGA, OMEGA_DOT, LEAD, LEAD_RATE, WHIRL, COS, SIN, LOAD, BLOCK_RESTRAINT, FIRING = range(11)
# Where a flexible block's motion on its mounts has put the axis, m: of the crank, along the frame's axes, and of the
# block, in axes at rest; 0 on rigid ground.
VALVE_TORQUE, AXIAL_FORCE, CRANK_X, CRANK_Y, BLOCK_X, BLOCK_Y = range(11, 17)
# Of the gas: fraction of the burn's rise where it is the built-in trace, −1 where pressures are given; rotation (rad)
# against the frame of the place of the encoder that the trace is phased to, unless it is the pins; the crank's own
# angle, rad, and the power that given pressures have in the stage, W.
BURN, ENCODED, CRANK, GIVEN_POWER, FRAME_SIZE = range(17, 22)
# Rows of ``Work.port``: the ports' u, u̇, ü and forces at a stage, the stage's Q and V at the ports, u without forces,
# the step of an iteration, what a step differs from its embedded solution, u before an iteration; u, u̇, ü at the state;
# the series behind a guess, the guess; the relative motion d, ḋ that the last evaluation of forces or the state gave;
# what an iteration changes of the forces.
U, UD, UDD, FORCES, U_Q, U_V, U_FREE, U_STEP, U_DIFFERENCE, U_BEFORE = range(10)
STATE_U, STATE_UD, STATE_UDD, SERIES, GUESS, RELATIVE, RELATIVE_RATE, F_STEP, PORT_VECTORS = range(10, 19)
# Rows of ``Work.modal``: vectors of a stage, its Q and V, what a step of Newmark's form knows beforehand, and the
# step's difference from its embedded solution.
BASE, LOADS, LEVER, Q_FREE, BIG_Q, BIG_V, KNOWN, DIFFERENCE, MODAL_VECTORS = range(9)
# Rows of ``Work.inputs``: value and rate of each input over the communication step; where ``EXPONENT`` is not 0, those
# of a cylinder's p Vⁿ by the crank's angle, with what it bends, or, where it is negative, those of the pressure at the
# crank's angle, which is moved to the cylinder's own; the angles of the two newest samples, and 1 where they
# have deviations of volumes; what the samples before foresaw for the newest, and its rate.
VALUE, RATE, BEND, EXPONENT, ANGLES, FORESEEN, FORESEEN_RATE, INPUT_ROWS = range(8)
DEVIATIONS = 2
"""Place of that mark among ``ANGLES``."""
# Columns of the first row of ``Work.staged``: how many stages are given, how many there are, the internal step, rad.
STAGES_GIVEN, STAGES_THERE, STAGE_STEP = range(3)
# Inputs behind speed and pressures: torque on the dynamometer and of the valve train, N m; axial force on the
# flywheel, N; the crank angle that the pressures belong to, rad; from DEVIATION_INPUT on, of each cylinder, the
# deviation of the volume that its pressure belongs to, m³. How many inputs there are beside those of each cylinder, and
# of each.
LOAD_INPUT, VALVE_INPUT, AXIAL_INPUT, ANGLE_INPUT, DEVIATION_INPUT = 1, 2, 3, 4, 5
OTHER_INPUTS, CYLINDER_INPUTS = 5, 2
# ``Work.counters``; of the present communication step its work, and 1 where that was cut short; how many steps were.
N_STEPS, N_STAGES, N_ITERATIONS, N_REJECTED, N_FACTORS, WORST_RESIDUAL, N_MISSED = range(7)
N_WORK, N_CUT, N_LIMITED, COUNTERS = 7, 8, 9, 10
# Columns of ``Work.key``: step and speed that factors were made for.
KEY_STEP, KEY_SPEED, KEYS = range(3)
# ``Work.powers``, W, as last observed. Of the gas on pistons that move against a block at rest, and of friction in
# mains, in big ends and at liners against parts at rest: what torques are made of.
GAS_POWER, MAINS_FRICTION, BIG_ENDS_FRICTION, LINERS_FRICTION = range(4)
# The energy balance: what the gas does to pistons and heads, all that takes power from it, and the energy that bodies
# and shafts hold, J.
GAS_WORK, DYNAMOMETER_POWER, VALVE_POWER, MAINS_SHEAR, MAINS_SQUEEZE, THRUST_LOSS, BIG_ENDS_SHEAR = range(4, 11)
BIG_ENDS_SQUEEZE, LINERS_LOSS, SKIRTS_LOSS, DAMPER_LOSS, CRANK_LOSS, BLOCK_LOSS = range(11, 17)
MOUNTS_LOSS, SHAFTS_LOSS, AXIAL_JOINT_LOSS, AXIAL_FORCE_WORK, STORED = range(17, 22)
# What added connections take from the bodies, their springs' energy included, and added bodies by their own damping.
LINKS_LOSS, ADDED_LOSS, POWERS = 22, 23, 24
# Columns of ``Work.family``.
STEP_KERNEL, DIFFERENCE_KERNEL = range(2)
# Columns of ``Basis.methods``, see :mod:`cranktrain.dynamics.model.basis`: order of the embedded
# method (0: none), order that tolerances follow, how much larger
# than a stage's own error its share in the step may be, the mark that states bear, and 1 where the model has elastic
# films whose largest pressures do not converge with the method.
EMBEDDED, METHOD_ORDER, AMPLIFICATION, MARK, LOSES_PEAKS, METHOD_COLUMNS = range(6)
# ``Basis.cylinders``: bore (m) and compression ratio that the model was made for, and 1 where a flexible block was made
# round the bore.
BORE, COMPRESSION, BORE_FITTED, CYLINDER_CONSTANTS = range(4)
# ``Basis.films``: 1 where mains, and where big ends, have oil.
MAINS_OIL, BIG_ENDS_OIL, FILM_KINDS = range(3)
# ``Work.start.mean``, what is known of the motion to come: mean wind-up of the shaft (rad) and torque (N m), the
# crank's rotation against it (rad) and its rate, inertia of crank and rods (kg m², 0: nothing is known).
START_WINDUP, START_TORQUE, START_ROTATION, START_ROTATION_RATE, START_INERTIA, START_MEAN = range(6)
# Rows of ``Work.start.block``: load by a unit torque, the block's place and its rate, pivots.
START_LOAD, START_PLACE, START_RATE, START_PIVOTS, START_ROWS = range(5)
START_SAMPLES, START_HARMONICS = 720, 361
"""Angles of a cycle at which the torque on a rigid crank is taken, and its harmonics."""
ROTATION = 5
"""Rotation about the crank's axis: component of motion of an interface, and mode of the rigid crank."""
FACTOR_SLOTS = 7
"""Step sizes whose factors are kept at once: the whole step, its half, quarter, … ."""
AMBIENT = 101325.0
"""Pressure of the surroundings, Pa."""
