"""Slots of the numbers that a run is given: all that its parameters set and that is neither a level nor an input.

One float64 array (NUMBERS,) from which :mod:`cranktrain.dynamics.model.preparation` prepares a model. Nothing is
imported here, so that kernels which read a slot rest on nothing that makes the numbers.
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
SET_DENSE, NUMBERS = 22, 23
LEAST_STEP = 1.0e-5
"""Shortest step that may be asked for, rad."""
MOST_DELAY = 2.0
"""Communication steps by which given pressures may be late."""
LEAST_TOLERANCE, MOST_TOLERANCE = 1.0e-10, 1.0
"""Bounds of the tolerance of adaptive control."""
