"""Slots of the numbers that a run is given: all that its parameters set and that is neither a level nor an input.

One float64 array, NUMBERS and then MOUNT_NUMBERS for each mount, from which
:mod:`cranktrain.dynamics.model.preparation` prepares a model. Nothing is imported here, so that kernels which read a
slot rest on nothing that makes the numbers.
"""

from __future__ import annotations

# Share of the gas' burn; pressure (Pa) in the crankcase; bore (m) and compression ratio; temperatures (K) of damper and
# oil, 0: from the engine's tables at the speed of the start; gravity, m/s².
SET_GAS_LOAD, SET_CRANKCASE, SET_BORE, SET_COMPRESSION, SET_DAMPER_TEMPERATURE, SET_OIL_TEMPERATURE = range(6)
SET_GRAVITY = 6
# Step (rad); communication steps by which given pressures are late; tolerance of adaptive control, and 1 where it is
# adaptive; numbers of gas source and reconstruction; row of the integrator in its register; Newton tolerance
# (clearances) and share by which a film may close over a step. The level's usual ones: step, Newton tolerance and share
# 0, row −1.
SET_STEP, SET_GAS_DELAY, SET_TOLERANCE, SET_ADAPTIVE, SET_GAS_SOURCE, SET_RECONSTRUCTION, SET_METHOD = range(7, 14)
SET_NEWTON_TOLERANCE, SET_FILM_CHANGE = 14, 15
# Newton iterations that a communication step may take, 0: any number.
SET_WORK_LIMIT = 16
# What the bearing level brings: Newton tolerance and share of its films, rows of its usual integrator and of the one
# for inputs that are held, step (rad).
LEVEL_TOLERANCE, LEVEL_FILM_CHANGE, LEVEL_METHOD, LEVEL_HELD_METHOD, LEVEL_STEP = range(17, 22)
# 1 where internal steps pass over communication points.
SET_DENSE = 22
# Lumped data of the engine, SI, by :mod:`cranktrain.engine.tunable`. Of flywheel, pulley and clutch four each: mass,
# polar and diametral inertia, offset. Masses and inertias of the damper's parts, of rod and piston; connecting shaft
# and dynamometer; axial path; clearances of mains and big ends; constants of Vogel's law; the damper's fluid or spring,
# with its loss factor or damping. Then of each mount six stiffnesses and six dampings.
SET_FLYWHEEL, SET_PULLEY, SET_CLUTCH, LUMPED = 23, 27, 31, 23
PART_MASS, PART_POLAR, PART_DIAMETRAL, PART_OFFSET = range(4)
SET_DAMPER_MASS, SET_HOUSING, SET_RING, SET_BIG_END, SET_SMALL_END, SET_ROD_INERTIA, SET_PISTON = range(35, 42)
SET_LINE_STIFFNESS, SET_LINE_DAMPING, SET_DYNAMOMETER, SET_PATH_MASS, SET_PATH_STIFFNESS = range(42, 47)
SET_PATH_DAMPING, SET_MAIN_CLEARANCE, SET_PIN_CLEARANCE, SET_VOGEL_A, SET_VOGEL_B, SET_VOGEL_C = range(47, 53)
SET_FLUID, SET_SPRING, SET_SPRING_LOSS = range(53, 56)
# Where the encoder sits that the gas trace is phased to.
SET_ENCODER, SET_MOUNTS = 56, 57
MOUNT_NUMBERS = 12
NUMBERS = SET_MOUNTS
"""How many there are beside those of mounts."""
LEAST_STEP = 1.0e-5
"""Shortest step that may be asked for, rad."""
MOST_DELAY = 2.0
"""Communication steps by which given pressures may be late."""
LEAST_TOLERANCE, MOST_TOLERANCE = 1.0e-10, 1.0
"""Bounds of the tolerance of adaptive control."""
