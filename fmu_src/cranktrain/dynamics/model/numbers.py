"""Slots of the numbers of a run: values set by parameters that are neither fidelity levels nor inputs.

The numbers are one float64 array, NUMBERS and then MOUNT_NUMBERS for each mount, from which
:mod:`cranktrain.dynamics.model.preparation` prepares a model. Nothing is imported here, so that kernels which read a
slot do not depend on the modules that make the numbers.
"""

from __future__ import annotations

# Fraction of the burn of the gas; pressure (Pa) in the crankcase; bore (m) and compression ratio; temperatures (K) of
# damper and oil (0: from the engine's tables at the speed of the start); gravity, m/s².
SET_GAS_LOAD, SET_CRANKCASE, SET_BORE, SET_COMPRESSION, SET_DAMPER_TEMPERATURE, SET_OIL_TEMPERATURE = range(6)
SET_GRAVITY = 6
# Step (rad); communication steps by which given pressures are late; tolerance of adaptive step control, and 1 if the
# control is adaptive; numbers of gas source and reconstruction; row of the integrator in its register; Newton tolerance
# (clearances); fraction by which a film may close in a step. Step, tolerance and fraction 0, and row −1, stand for the
# defaults of the level.
SET_STEP, SET_GAS_DELAY, SET_TOLERANCE, SET_ADAPTIVE, SET_GAS_SOURCE, SET_RECONSTRUCTION, SET_METHOD = range(7, 14)
SET_NEWTON_TOLERANCE, SET_FILM_CHANGE = 14, 15
# Most Newton iterations of a communication step; 0 sets no limit.
SET_WORK_LIMIT = 16
# Defaults of the bearing level: Newton tolerance, fraction by which its films may close in a step, row of the
# integrator and row of the integrator for held inputs, step (rad).
LEVEL_TOLERANCE, LEVEL_FILM_CHANGE, LEVEL_METHOD, LEVEL_HELD_METHOD, LEVEL_STEP = range(17, 22)
# 1 if internal steps pass over communication points.
SET_DENSE = 22
# Lumped data of the engine, SI, see :mod:`.lumped_data`. Four values each of flywheel, pulley and clutch: mass, polar
# and diametral inertia, offset. Masses and inertias of the damper's parts, of rod and piston; connecting shaft and
# dynamometer; axial path; clearances of mains and big ends; constants of Vogel's law; viscosity of the damper's fluid,
# or its spring with loss factor or damping. At the end, six stiffnesses and six dampings of each mount.
SET_FLYWHEEL, SET_PULLEY, SET_CLUTCH, LUMPED = 23, 27, 31, 23
PART_MASS, PART_POLAR, PART_DIAMETRAL, PART_OFFSET = range(4)
SET_DAMPER_MASS, SET_HOUSING, SET_RING, SET_BIG_END, SET_SMALL_END, SET_ROD_INERTIA, SET_PISTON = range(35, 42)
SET_LINE_STIFFNESS, SET_LINE_DAMPING, SET_DYNAMOMETER, SET_PATH_MASS, SET_PATH_STIFFNESS = range(42, 47)
SET_PATH_DAMPING, SET_MAIN_CLEARANCE, SET_PIN_CLEARANCE, SET_VOGEL_A, SET_VOGEL_B, SET_VOGEL_C = range(47, 53)
SET_FLUID, SET_SPRING, SET_SPRING_LOSS = range(53, 56)
# Position of the encoder that the gas trace is phased to.
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
