"""Slots of the constants behind lumped data, see :mod:`cranktrain.dynamics.model.lumps`."""

# Slots of ``Lumps.traits`` for the crank:
# CRANK_MASS, CRANK_CENTRE: mass, kg, and first of three coordinates of the centre of mass, m.
# TWISTS, LOCKED: 1 if the crank only twists; 1 if its journals are locked on their axis.
# FITTED: 1 if the damper is fitted to the pulley.
# DAMPING_KIND, DAMPING_A, DAMPING_B: kind of the crank's damping and its two constants.
CRANK_MASS, CRANK_CENTRE, TWISTS, LOCKED, FITTED, DAMPING_KIND, DAMPING_A, DAMPING_B = 0, 1, 4, 5, 6, 7, 8, 9
# Slots of ``Lumps.traits`` for rods and pistons:
# FREE_ENDS, ROD_ALIKE: 1 if big ends are free; 1 if all rods are the engine file's one rod.
# GUIDED, FIRST_PISTON, PISTONS: 1 if pistons have a guidance; first mode and number of the guided pistons.
# TILT_INERTIA, PISTON_ARM: inertia of a tilting piston, and arm of its mass in tilting.
FREE_ENDS, ROD_ALIKE, GUIDED, FIRST_PISTON, PISTONS, TILT_INERTIA, PISTON_ARM = 10, 11, 12, 13, 14, 15, 16
# Slots of ``Lumps.traits`` for drive line, bearings and block:
# ONE_SHAFT, PATH_ROW: 1 if the drive line is one shaft; row of the axial path in ``shaft_laws`` (−1: none).
# END_SPEED: speed of the dynamometer over that of the crank.
# MAINS_FREE, ENDS_FREE: 1 if the force law of the mains, or of the big ends, allows another clearance.
# FLEXIBLE, BLOCK_MASS, BLOCK_CENTRE: 1 with a flexible block, its mass (kg) and the first of its centre (3, m).
ONE_SHAFT, PATH_ROW, END_SPEED, MAINS_FREE, ENDS_FREE, FLEXIBLE, BLOCK_MASS, BLOCK_CENTRE = range(17, 25)
# LINE_INERTIA: inertia of the drive line reduced to the crank.
# STATED_DAMPER: 1 if stiffness and damping of the damper are stated.
# GEARED: 1 if rigid gears join bodies to the crank.
# AHEAD: compliance of the springs between crank and drive line, reduced to the crank, rad/(N m).
LINE_INERTIA, STATED_DAMPER, GEARED, AHEAD, TRAITS = 27, 28, 29, 30, 31
OWN_DAMPING, MODAL, RAYLEIGH = range(3)
NOT_LUMPED = -1.0
MASS, GYROSCOPIC, CENTRIFUGAL, STRESS, MOVING, TILTING, TURN, SQUARES, VECTORS, PRODUCT, ROOMS = range(11)
CHANGING = 6
"""Matrices of ``Lumps.room``. The first ones change with the parts on flywheel and pulley: M, G, C, K_σ, and what K_σ
gets in rows of rigid modes, for translations and for tilts by rotation about z, see
:func:`cranktrain.core.reduced_body.turning_stiffness`."""
SCALE, OMEGA2, ORDER, PIVOTS, LOAD, VECTOR_ROWS = range(6)
"""Rows of ``Lumps.vectors``."""
CENTRIFUGAL_LOAD, EULER_LOAD, TRANSLATION, LOADS = 0, 1, 2, 5
"""Rows of ``Lumps.loads``; three for translation."""
OF_MASS, OF_FIRST, OF_ACROSS, OF_ALONG, MOMENTS = range(5)
"""Moments of parts at an interface: Σ m, Σ m o with axial offsets o, ∫ρ x² and ∫ρ z² about it."""
COORDINATES = 12
"""Coordinates of a mode at an interface: rigid motion about the origin (6), or elastic motion of the interface (6)."""
