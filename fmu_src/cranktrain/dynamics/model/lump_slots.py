"""Slots of the constants behind lumped data, see :mod:`cranktrain.dynamics.model.lumps`."""

from __future__ import annotations

# Slots of ``Lumps.traits``. Of the crank: mass (kg) and centre (3, m); 1 if it only twists, if its journals are locked
# on their axis, if the damper is fitted; kind and two constants of the crank's damping.
CRANK_MASS, CRANK_CENTRE, TWISTS, LOCKED, FITTED, DAMPING_KIND, DAMPING_A, DAMPING_B = 0, 1, 4, 5, 6, 7, 8, 9
# 1 if big ends are free, if all rods are the engine file's one rod, if pistons have a guidance; the first mode of
# guided pistons and their number; inertia and arm of a piston's mass in tilting.
FREE_ENDS, ROD_ALIKE, GUIDED, FIRST_PISTON, PISTONS, TILT_INERTIA, PISTON_ARM = 10, 11, 12, 13, 14, 15, 16
# 1 if the drive line is one shaft; the row of the axial path in ``shaft_laws`` or −1; speed ratio of dynamometer and
# crank; 1 if the law of the mains, and of the big ends, allows another clearance; 1 with a flexible block, the block's
# mass (kg) and centre (3, m).
ONE_SHAFT, PATH_ROW, END_SPEED, MAINS_FREE, ENDS_FREE, FLEXIBLE, BLOCK_MASS, BLOCK_CENTRE = range(17, 25)
# Inertia of the drive line reduced to the crank; 1 if the damper's stiffness and damping are stated.
LINE_INERTIA, STATED_DAMPER, TRAITS = 27, 28, 29
OWN_DAMPING, MODAL, RAYLEIGH = range(3)
NOT_LUMPED = -1.0
MASS, TURN, SQUARES, VECTORS, PRODUCT, GYROSCOPIC, CENTRIFUGAL, STRESS, ROOMS = range(9)
"""Matrices of ``Lumps.room``."""
SCALE, OMEGA2, ORDER, PIVOTS, HELP, CENTRIFUGAL_LOAD, EULER_LOAD, TRANSLATION = range(8)
VECTOR_ROWS = TRANSLATION + 3
"""Rows of ``Lumps.vectors``."""
