"""Slots of the numbers of a run: values set by parameters that are neither fidelity levels nor inputs.

The numbers are one float64 array, NUMBERS and then MOUNT_NUMBERS for each mount, from which
:mod:`cranktrain.dynamics.model.preparation` prepares a model. Nothing is imported here, so that kernels which read a
slot do not depend on the modules that make the numbers.
"""

# Numbers of gas, cylinders and surroundings:
# SET_GAS_LOAD, SET_CRANKCASE: fraction of the burn's pressure rise, and pressure in the crankcase, Pa.
# SET_BORE, SET_COMPRESSION: bore, m, and compression ratio.
# SET_DAMPER_TEMPERATURE, SET_OIL_TEMPERATURE: K; 0 for those of the engine's tables at the speed of the start.
# SET_GRAVITY: gravity, m/s².
SET_GAS_LOAD, SET_CRANKCASE, SET_BORE, SET_COMPRESSION, SET_DAMPER_TEMPERATURE, SET_OIL_TEMPERATURE = range(6)
SET_GRAVITY = 6
# Numbers of the time integration; step, tolerance and fraction 0, and row −1, stand for the defaults of the level:
# SET_STEP: internal step, rad.
# SET_GAS_DELAY: communication steps by which given pressures are late.
# SET_TOLERANCE, SET_ADAPTIVE: tolerance of adaptive step control, and 1 if the control is adaptive.
# SET_GAS_SOURCE, SET_RECONSTRUCTION: numbers of the gas source and of the reconstruction of inputs.
# SET_METHOD: row of the integrator in its register.
# SET_NEWTON_TOLERANCE: tolerance of Newton's method, in clearances.
# SET_FILM_CHANGE: fraction by which a film may close in a step.
SET_STEP, SET_GAS_DELAY, SET_TOLERANCE, SET_ADAPTIVE, SET_GAS_SOURCE, SET_RECONSTRUCTION, SET_METHOD = range(7, 14)
SET_NEWTON_TOLERANCE, SET_FILM_CHANGE = 14, 15
# Most Newton iterations of a communication step; 0 sets no limit.
SET_WORK_LIMIT = 16
# Defaults of the bearing level:
# LEVEL_TOLERANCE, LEVEL_FILM_CHANGE: Newton tolerance, and fraction by which a film may close in a step.
# LEVEL_METHOD, LEVEL_HELD_METHOD: row of the integrator, and row of the integrator for held inputs.
# LEVEL_STEP: internal step, rad.
LEVEL_TOLERANCE, LEVEL_FILM_CHANGE, LEVEL_METHOD, LEVEL_HELD_METHOD, LEVEL_STEP = range(17, 22)
# 1 if internal steps pass over communication points.
SET_DENSE = 22
# Lumped data of the engine, SI, see :mod:`.lumped_data`, are those from here on:
# SET_FLYWHEEL, SET_PULLEY, SET_CLUTCH: first of four values of the part, which PART_MASS to PART_OFFSET count.
# SET_DAMPER_MASS, SET_HOUSING, SET_RING: mass of the damper, inertias of its housing and ring.
# SET_BIG_END, SET_SMALL_END, SET_ROD_INERTIA, SET_PISTON: masses at the rod's ends, its inertia, mass of a piston.
# SET_LINE_STIFFNESS, SET_LINE_DAMPING, SET_DYNAMOMETER: connecting shaft, and inertia of the dynamometer.
# SET_PATH_MASS, SET_PATH_STIFFNESS, SET_PATH_DAMPING: axial path.
# SET_MAIN_CLEARANCE, SET_PIN_CLEARANCE: radial clearances of mains and big ends.
# SET_VOGEL_A, SET_VOGEL_B, SET_VOGEL_C: constants of Vogel's law of the oil.
# SET_FLUID: viscosity of a viscous damper's fluid.
# SET_SPRING, SET_SPRING_LOSS: stiffness of another damper's spring, and its loss factor or damping.
SET_FLYWHEEL, SET_PULLEY, SET_CLUTCH = 23, 27, 31
PART_MASS, PART_POLAR, PART_DIAMETRAL, PART_OFFSET = range(4)
SET_DAMPER_MASS, SET_HOUSING, SET_RING, SET_BIG_END, SET_SMALL_END, SET_ROD_INERTIA, SET_PISTON = range(35, 42)
SET_LINE_STIFFNESS, SET_LINE_DAMPING, SET_DYNAMOMETER, SET_PATH_MASS, SET_PATH_STIFFNESS = range(42, 47)
SET_PATH_DAMPING, SET_MAIN_CLEARANCE, SET_PIN_CLEARANCE, SET_VOGEL_A, SET_VOGEL_B, SET_VOGEL_C = range(47, 53)
SET_FLUID, SET_SPRING, SET_SPRING_LOSS = range(53, 56)
# SET_ENCODER: position of the encoder that the gas trace is phased to.
# SET_MOUNTS: first of MOUNT_NUMBERS values of each mount: six stiffnesses, then six dampings.
SET_ENCODER, SET_MOUNTS = 56, 57
MOUNT_NUMBERS = 12
NUMBERS = SET_MOUNTS
"""Number of all numbers except those of mounts."""
LEAST_STEP = 1.0e-5
"""Shortest step that a run may choose, rad."""
MOST_DELAY = 2.0
"""Most communication steps by which given pressures may be late."""
LEAST_TOLERANCE, MOST_TOLERANCE = 1.0e-10, 1.0
"""Bounds of the tolerance of adaptive control."""
