"""Slots of the running model's arrays: names of their rows and columns.

Nothing is imported here, so that kernels which read a slot do not depend on the modules that make the arrays.
"""

# Columns of ``ModelArrays.cylinders``, one row for each cylinder:
# M_SMALL, M_BIG: masses of the rod at its small end and at its big end (0 if the big end is free), kg.
# M_OSC: mass of the piston and the rod's small end, kg.
# DELTA_J: remainder inertia of the rod, kg m².
# BANK, COS_BANK, SIN_BANK: angle of the cylinder's bank, rad, its cosine and its sine.
# PHASE: crank angle of the cylinder's firing dead centre, rad.
# AREA, CLEARANCE_VOLUME: piston area, m², and clearance volume, m³.
# ROD, OFFSET: length of the rod, and distance of the cylinder's axis from the crank axis, m.
# STROKE_TOP, STROKE: highest position of the piston pin above the crank axis, and stroke of the piston, m.
# OWN_ROD: 1; 0 if rod and piston of the cylinder are added bodies and the gas acts by an added connection.
# MASTER: cylinder of the master rod of an articulated rod; −1 for other rods.
# JOINT: first value of the articulated rod's joint, see :mod:`cranktrain.loads.articulated_rod`.
M_SMALL, BANK, PHASE, AREA, ROD, M_BIG, M_OSC, DELTA_J, OFFSET, CLEARANCE_VOLUME, STROKE_TOP = range(11)
COS_BANK, SIN_BANK, OWN_ROD, STROKE, MASTER, JOINT, PARAMETERS = 11, 12, 13, 14, 15, 16, 22
# Columns of ``ModelArrays.cylinders`` with ports (−1: the cylinder has no such port) and rows of connections:
# PIN_PORT, PIN_TURN: displacement x of the pin under the rod (y follows), and rotation of the pin. A pin of a crank
# with journals locked on their axis has only PIN_TURN.
# END_PORT: displacement x of a free big end (y follows).
# PISTON_PORT: displacement of a guided piston across the cylinder (its rotation follows).
# LINER_PORT: first of the three ports of the liner, before that of the head.
# PIN_ROW, END_ROW: rows of ``connections`` between pin and rod, and of a free big end.
PIN_PORT, PIN_TURN, END_PORT, PISTON_PORT, LINER_PORT, PIN_ROW, END_ROW, CYLINDER = range(22, 30)
# Slots of ``ModelArrays.scalars``, part 1:
# SHAFT_K, SHAFT_C: stiffness and damping of the whole drive line at the flywheel, for slow wind-up.
# GAS_LOAD, BEST_SPEED, FALLOFF: constants of the built-in gas trace, see dynamics.motion.gas.burn_share.
# FILTER: inverse of the time constant of the speed filter, 1/s; 0 without a filter.
# RIGID_ROTATION: rotation of the crank per unit amplitude of its rigid mode of rotation.
GRAVITY, CRANKCASE, GAS_LOAD, BEST_SPEED, FALLOFF, SHAFT_K, SHAFT_C, FILTER, RIGID_ROTATION, STEP = range(10)
# Slots of ``ModelArrays.scalars``, part 2:
# DRIVEN: 1 if the shaft's speed is given, 0 if a torque loads the shaft.
# LINE_INERTIA: inertia of the drive line's rotors and the dynamometer, reduced to the crank.
# WINDUP_K: torque of the drive line's springs on the flywheel per wind-up.
# WINDUP_LEAD: wind-up of the drive line per lead of the frame.
DRIVEN, DAMPER_TEMPERATURE, LINE_INERTIA, WINDUP_K, WINDUP_LEAD, SCALARS = range(10, 16)
# Slots of ``ModelArrays.choices``:
# GAS_SOURCE, RECONSTRUCTION: numbers of the gas source and of the reconstruction of the inputs.
# NEWTON_TOLERANCE: tolerance of the Newton iteration, in clearances.
# FILM_CHANGE: fraction of its thickness by which a film may close in a step.
# STEP_TOLERANCE: tolerance of adaptive step control; 0 for fixed steps.
# EMBEDDED_ORDER, ORDER: orders of the integrator's embedded method and of the integrator itself.
# GAS_DELAY: communication steps by which given pressures are late.
# METHOD_MARK: number that identifies the integrator in a state.
# WORK_LIMIT: most Newton iterations of a communication step; 0 sets no limit.
# DENSE: 1 if internal steps pass over communication points.
# ENCODER: position of the encoder that the gas trace is phased to, :data:`PIN` to :data:`FLYWHEEL`.
GAS_SOURCE, RECONSTRUCTION, NEWTON_TOLERANCE, FILM_CHANGE, STEP_TOLERANCE, EMBEDDED_ORDER, ORDER = range(7)
GAS_DELAY, METHOD_MARK, WORK_LIMIT, DENSE, ENCODER, CHOICES = 7, 8, 9, 10, 11, 12
PIN, PULLEY, FLYWHEEL = range(3)
# Slots of ``ModelArrays.layout``, read by :mod:`cranktrain.dynamics.model.layout`:
# CRANK_MODES, PORTS: number of the crank's modes, and number of all ports.
# THRUST_ROW, JOINT_ROW, DAMPER_ROW: rows of ``connections`` of thrust bearing, axial joint and damper (−1: none).
# SLIDING: 1 if the drive line's axial joint is a spline, which slides.
# WHIRLS: 1 if rotation couples modes by gyroscopic or centrifugal terms.
# VALVE_HERE, AXIAL_HERE: 1 if the valve train's torque acts on the pulley, and the axial force on the flywheel; 0 if a
# load takes them.
# TERM_ROW: first row of ``connections`` whose components are sums of terms, which come last.
CRANK_MODES, PORTS, THRUST_ROW, JOINT_ROW, DAMPER_ROW, SLIDING, WHIRLS, TERM_ROW, VALVE_HERE, AXIAL_HERE, LAYOUT = (
    range(11)
)
# Rows of ``ModelArrays.ends``: rotations of flywheel and pulley about the axis, displacements of both along it.
FLYWHEEL_ROTATION, PULLEY_ROTATION, PULLEY_AXIAL, FLYWHEEL_AXIAL = range(4)
# Columns of ``BlockArrays.mount_laws``: stiffness (N/m, N m/rad), damping, preload (N), preload per m/s² of gravity.
MOUNT_STIFFNESS, MOUNT_DAMPING, MOUNT_PRELOAD, MOUNT_WEIGHT, MOUNT_LAW = range(5)
# Columns of ``ModelArrays.connections``; a port is −1 if the connection has none:
# COUPLED, FIRST: number of Newton ports that the force law couples, and the first of up to four such ports.
# PAIRS: index of the first component of the x-y pairs that rotate with the frame's axes.
# SPIN: port of the rotation on which friction acts, and whose rate is added to the frame's speed.
# TURNED: port of the rotation on which moments of displaced forces act.
# REACTS: port of the other body's rotation, on which the opposite moments act.
# TOLD: port of the drive line's wind-up, whose torque is input of the force law.
# SHAPE: OF_PORTS if the components are ports, or their motion relative to a bore's; OF_EYE if the law acts on the
# difference between a pin and the rod's eye around it; OF_TERMS if each component is a sum of terms over ports, see
# :mod:`cranktrain.dynamics.topology.terms`.
COUPLED, FIRST, PAIRS, SPIN, TURNED, REACTS, TOLD, SHAPE = 0, 1, 5, 6, 7, 8, 9, 10
OF_PORTS, OF_EYE, OF_TERMS = range(3)
# Further columns for components of terms:
# GAP: the first component, counted among components of terms alone.
# AXES, AXES_SENSE: frame in whose axes the force law is evaluated; 1, or −1 if that frame turns backwards.
# SENSE_A, SENSE_B, FRAME_A, FRAME_B: sense of both ends relative to the law's axes, and frames of both ends.
# RUBS: 1 if friction of the force law acts on both ends.
# OF_CYLINDER: cylinder of the rod, or whose gas pressure is input of the force law (−1: none).
# IS_LOAD: 1 if the force law is a load.
# TAKES: column of ``Work.frames`` with an input of the run that the force law takes (−1: none).
# ACCOUNT, RUB_ACCOUNT: slots of ``Work.powers`` for the power that the connection takes by motion of its ends, and by
# friction.
# INNER: first of two ports that only this connection moves, so that the stage solves for them within its evaluation.
# FOLLOWED: first of three ports that the law follows and loads, without tangents, before that of the head, on which
# the gas presses, HEAD ports after the first.
GAP, AXES, AXES_SENSE, SENSE_A, SENSE_B, FRAME_A, FRAME_B, RUBS, OF_CYLINDER, IS_LOAD, TAKES, ACCOUNT = range(11, 23)
RUB_ACCOUNT, INNER, FOLLOWED, CONNECTION = range(23, 27)
HEAD = 3
NO_PORT = -1.0
# Columns of ``Work.gas``, one row for each cylinder, at the last evaluation of a stage or of the state:
# SLOPE: derivative of the pressure by the angle of the cylinder's own pin, Pa/rad.
# VOLUME, OWN_ANGLE: volume above the piston, m³, where it is needed, and the crank angle of the own pin, rad.
# COUPLE: friction torque on the rod by the film of a floating big end, N m.
SLOPE, VOLUME, OWN_ANGLE, COUPLE, GAS = range(5)
# Columns of ``Work.told``, one row for each connection:
# SEEN: 1 if the row of ``Work.found`` is that of the state that is being observed.
# SPEEDS, RUBBING: sum and difference of the speeds of both ends about z, as its law was told them, rad/s.
SEEN, SPEEDS, RUBBING, TOLD_SPEEDS = range(4)
# Columns of ``Work.frames``, one row for each stage, part 1:
# THETA, OMEGA, OMEGA_DOT: angle, speed and acceleration of the crank's frame, rad, rad/s, rad/s².
# LEAD, LEAD_RATE: lead of the frame relative to the shaft of given speed, rad, and its rate.
# WHIRL: speed at which the frame's axes rotate, rad/s; COS and SIN: cosine and sine of the frame's angle.
# LOAD: load torque on the rotor, N m.
# BLOCK_RESTRAINT: restraint of the block as a whole while the start of a run is sought, (rad/s)².
# FIRING: angle of the frame relative to the cylinders of a block that may roll, rad.
THETA, OMEGA, OMEGA_DOT, LEAD, LEAD_RATE, WHIRL, COS, SIN, LOAD, BLOCK_RESTRAINT, FIRING = range(11)
# Columns of ``Work.frames``, part 2:
# VALVE_TORQUE, AXIAL_FORCE: torque that the valve train takes from the pulley, N m, and axial force on the flywheel, N.
# CRANK_X, CRANK_Y: displacement of the crank's axis by the block's motion on its mounts, m, in axes of the frame.
# BLOCK_X, BLOCK_Y: displacement of the block's axis by the same motion, m, in axes at rest; 0 on rigid ground.
VALVE_TORQUE, AXIAL_FORCE, CRANK_X, CRANK_Y, BLOCK_X, BLOCK_Y = range(11, 17)
# Columns of ``Work.frames``, part 3, for the gas:
# BURN: fraction of the burn's pressure rise with the built-in trace; −1 if pressures are given.
# ENCODED: rotation of the encoder on pulley or flywheel relative to the frame, rad; the gas trace is phased to it.
# CRANK: angle of the crank itself, rad.
# GIVEN_POWER: power of given pressures in the stage, W.
# VALVE_GIVEN, AXIAL_GIVEN: inputs VALVE_TORQUE and AXIAL_FORCE wherever they act.
BURN, ENCODED, CRANK, GIVEN_POWER, VALVE_GIVEN, AXIAL_GIVEN, FRAME_SIZE = range(17, 24)
# Rows of ``Work.port``, each a vector over all ports; u is the displacement of a port:
# U, UD, UDD, FORCES: u, u̇, ü and forces at a stage.
# U_Q, U_V: the stage's vectors Q and V, transformed to the ports.
# U_FREE: u without forces at the ports.
# U_STEP, U_BEFORE: step of an iteration, and u before the iteration.
# U_DIFFERENCE: difference of a step from its embedded solution.
# STATE_U, STATE_UD, STATE_UDD: u, u̇, ü at the state.
# SERIES, GUESS: Taylor series of the initial guess of a stage, and the guess.
# RELATIVE, RELATIVE_RATE: relative motion d and its rate ḋ at the last evaluation of forces or of the state.
# F_STEP: change of the forces in an iteration.
U, UD, UDD, FORCES, U_Q, U_V, U_FREE, U_STEP, U_DIFFERENCE, U_BEFORE = range(10)
STATE_U, STATE_UD, STATE_UDD, SERIES, GUESS, RELATIVE, RELATIVE_RATE, F_STEP, PORT_VECTORS = range(10, 19)
# Rows of ``Work.modal``, each a vector over all modes:
# BASE, LOADS, LEVER, Q_FREE: vectors of a stage.
# BIG_Q, BIG_V: vectors Q and V of the stage.
# KNOWN: known part of a step of Newmark's form.
# DIFFERENCE: difference of a step from its embedded solution.
BASE, LOADS, LEVER, Q_FREE, BIG_Q, BIG_V, KNOWN, DIFFERENCE, MODAL_VECTORS = range(9)
# Rows of ``Work.inputs``, each with one value for each input:
# VALUE, RATE: value and rate of the input over the communication step.
# EXPONENT: if positive, VALUE, RATE and BEND describe the cylinder's p Vⁿ over the crank's angle; if negative, they
# describe the pressure at the crank's angle, which is converted to the cylinder's own angle.
# BEND: curvature of p Vⁿ over the crank's angle.
# ANGLES: angles of the two newest samples, and 1 if the samples have deviations of volumes.
# FORESEEN, FORESEEN_RATE: extrapolation of the earlier samples to the newest one, and its rate.
VALUE, RATE, BEND, EXPONENT, ANGLES, FORESEEN, FORESEEN_RATE, INPUT_ROWS = range(8)
DEVIATIONS = 2
"""Index in row ``ANGLES`` of the mark for deviations of volumes."""
# Columns of the first row of ``Work.staged``: number of given stages, number of the method's stages, step (rad).
STAGES_GIVEN, STAGES_THERE, STAGE_STEP = range(3)
# Positions of inputs among those after speed and pressures:
# LOAD_INPUT, VALVE_INPUT: torque on the dynamometer and torque of the valve train, N m.
# AXIAL_INPUT: axial force on the flywheel, N.
# ANGLE_INPUT: crank angle that the pressures belong to, rad.
# DEVIATION_INPUT: first deviation of a cylinder's volume that its pressure belongs to, m³; one for each cylinder.
# OTHER_INPUTS, CYLINDER_INPUTS: number of inputs that belong to no cylinder, and of inputs for each cylinder.
LOAD_INPUT, VALVE_INPUT, AXIAL_INPUT, ANGLE_INPUT, DEVIATION_INPUT = 1, 2, 3, 4, 5
OTHER_INPUTS, CYLINDER_INPUTS = 5, 2
# Slots of ``Work.counters``:
# N_STEPS, N_STAGES, N_ITERATIONS, N_REJECTED: numbers of steps, stages, Newton iterations and rejected steps.
# N_FACTORS, WORST_RESIDUAL, N_MISSED: factorisations, worst residual, and steps that missed the tolerance.
# N_WORK, N_CUT: Newton iterations of the present communication step, and 1 if this step was cut short.
# N_LIMITED: number of communication steps that were cut short.
N_STEPS, N_STAGES, N_ITERATIONS, N_REJECTED, N_FACTORS, WORST_RESIDUAL, N_MISSED = range(7)
N_WORK, N_CUT, N_LIMITED, COUNTERS = 7, 8, 9, 10
# Columns of ``Work.key``: step and speed for which the factors of a slot were made.
KEY_STEP, KEY_SPEED, KEYS = range(3)
# Slots of ``Work.powers``, W, for the output torques:
# GAS_POWER: power of the gas on the pistons relative to a block at rest.
# FRICTION_POWER: friction in mains, big ends and liners relative to parts at rest.
GAS_POWER, FRICTION_POWER = range(2)
# Slots of ``Work.powers`` for the energy balance, the accounts of connections and bodies:
# GAS_WORK: power of the gas on pistons and heads, W.
# DYNAMOMETER_POWER to AXIAL_FORCE_WORK: powers of all loads and losses, W.
# LINKS_LOSS: power (W) that added connections take from the bodies, including the power stored in their springs.
# CRANK_LOSS, BLOCK_LOSS, BODIES_LOSS: power (W) that crank, block and added bodies lose by their own damping.
# STORED: energy stored in bodies and shafts, J.
GAS_WORK, DYNAMOMETER_POWER, VALVE_POWER, MAINS_SHEAR, MAINS_SQUEEZE, THRUST_LOSS, BIG_ENDS_SHEAR = range(2, 9)
BIG_ENDS_SQUEEZE, LINERS_LOSS, SKIRTS_LOSS, DAMPER_LOSS, CRANK_LOSS, BLOCK_LOSS, BODIES_LOSS = range(9, 16)
MOUNTS_LOSS, SHAFTS_LOSS, AXIAL_JOINT_LOSS, AXIAL_FORCE_WORK, LINKS_LOSS, STORED, POWERS = range(16, 23)
# Columns of ``Work.family``: addresses of the kernels for a step, and for its difference from the embedded solution.
STEP_KERNEL, DIFFERENCE_KERNEL = range(2)
# Columns of ``Basis.methods``, one row for each integrator, see :class:`cranktrain.dynamics.model.records.Basis`:
# EMBEDDED, METHOD_ORDER: order of the embedded method (0: none), and order that tolerances follow.
# AMPLIFICATION: largest factor by which the error of a stage enters the step.
# MARK: number that identifies the integrator in a state.
# LOSES_PEAKS: 1 if the model has elastic films whose largest pressures do not converge with the integrator.
EMBEDDED, METHOD_ORDER, AMPLIFICATION, MARK, LOSES_PEAKS, METHOD_COLUMNS = range(6)
# Slots of ``Basis.cylinders``:
# BORE, COMPRESSION: bore (m) and compression ratio that the model was made for.
# BORE_FITTED: 1 if a flexible block was made for this bore.
BORE, COMPRESSION, BORE_FITTED, CYLINDER_CONSTANTS = range(4)
# Slots of ``Basis.films``: 1 if the main bearings have oil films, and 1 if the big ends have oil films.
MAINS_OIL, BIG_ENDS_OIL, FILM_KINDS = range(3)
# Slots of ``Work.start.mean``, the estimate of the motion at the start:
# START_WINDUP, START_TORQUE: mean wind-up of the shaft (rad) and mean torque (N m).
# START_ROTATION, START_ROTATION_RATE: rotation of the crank relative to the mean wind-up (rad) and its rate.
# START_INERTIA: inertia of crank and rods, kg m²; 0 if there is no estimate.
START_WINDUP, START_TORQUE, START_ROTATION, START_ROTATION_RATE, START_INERTIA, START_MEAN = range(6)
# Rows of ``Work.start.block``: load by a unit torque, the block's displacement, and its rate.
START_LOAD, START_PLACE, START_RATE, START_ROWS = range(4)
START_SAMPLES, START_HARMONICS = 720, 361
"""Number of angles per cycle at which the torque on a rigid crank is sampled, and number of its harmonics."""
ROTATION = 5
"""Rotation about the crank's axis: component of motion of an interface, and mode of the rigid crank."""
FACTOR_SLOTS = 7
"""Number of step sizes whose factors are kept at once: the whole step, its half, quarter, … ."""
AMBIENT = 101325.0
"""Pressure of the surroundings, Pa."""
