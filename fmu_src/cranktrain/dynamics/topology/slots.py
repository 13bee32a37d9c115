"""Slots of the arrays of added bodies and connections; nothing is imported here."""

from __future__ import annotations

# ``AddedBodies.rows``: first mode among all, number of modes, first port among all, number of ports; the same firsts
# among the added ones alone; the frame's turns per turn of the crank, its angle at crank angle 0 (rad), 1 or −1 where
# it turns backwards; mass, kg; 1 where it goes along with the block; 1 where gears or couplings make it turn as the
# crank does; its mass times x and y of its centre of mass from the frame's axis, kg m; its inertia about that axis,
# kg m². Bodies that relations join have their modes in common: the first of them among the added ones' rows, and 1 in
# the last one's row; first port of all of them, and how many they have.
MODE, MODES, PORT, PORTS, OWN_MODE, OWN_PORT, RATE, PHASE, SENSE, MASS, CARRIED, TIED = range(12)
UNBALANCE_X, UNBALANCE_Y, INERTIA, GROUP, ENDS_GROUP, GROUP_PORT, GROUP_PORTS, BODY = range(12, 20)
# ``AddedConnections.rows``: number of components, the first of them; turns per turn of the crank of the axes in which
# the law is evaluated, and their angle at crank angle 0; first component of the pairs that turn with these axes (−1:
# none); rotation about z of both ends (port, −1: none), their senses against the axes', and the ends' own turns per
# turn of the crank about the axes' z; 1 where the law has friction that turns both ends; 1 where a step of the
# iteration is limited.
SIZE, FIRST, AXES_RATE, AXES_PHASE, PAIRS, TURN_A, TURN_B, SENSE_A, SENSE_B, RATE_A, RATE_B = range(11)
RUBS, CLOSES, CONNECTION = 11, 12, 13
# ``AddedConnections.terms``: component, port, amplitude, factor of the crank angle, phase (rad).
COMPONENT, TERM_PORT, AMPLITUDE, FACTOR, ANGLE, TERM = range(6)
# ``AddedConnections.interfaces``: whose axis a displaced force is taken about (number of an added body, or one of
# these), ports of the displacement across, x and y, and of the rotation about z.
OF_CRANK, OF_BLOCK = -1, -2
OWNER, PORT_X, PORT_Y, PORT_TURN, INTERFACE = range(5)
# ``AddedConnections.shown``: an output's connection or body, kind, and place in what it shows.
SHOWN_OF, SHOWN_KIND, SHOWN_AT, SHOWN = range(4)
FORCE_KIND, PLACE_KIND, VELOCITY_KIND, OUT_KIND, BODY_SPEED, BODY_TURN, BODY_PLACE = range(7)
# ``AddedConnections.hooks``: kernels that a stage calls at their addresses where anything is added.
AT_FACTOR, AT_LOAD, AT_COMPLIANCE, AT_MOVE, AT_STEPS, AT_NEWTON, AT_SOLVE, AT_STEP_SIZE, AT_FOLLOW = range(9)
AT_RECOVER, AT_TO_PORTS, AT_ANSWER, AT_FORCES, HOOKS = range(9, 14)
# ``AddedWork.sizes``: size of a Newton step of added components, and of those among them that are limited; angle (rad)
# and speed (rad/s) at which the terms' coefficients are.
ANY, LIMITED, TERMS_ANGLE, TERMS_SPEED, SIZES = range(5)
# Rows of ``AddedWork.gaps``: motion of each component, its rate, force, step of an iteration, what that changes of the
# force.
D, DD, F, STEP, F_CHANGE, GAPS = range(6)
