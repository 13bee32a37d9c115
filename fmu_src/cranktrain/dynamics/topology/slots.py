"""Slots of the arrays of added bodies and connections; nothing is imported here."""

from __future__ import annotations

# ``AddedBodies.rows``: first mode of the model that is the body's, number of its modes, first port, number of its
# ports; first mode and first port counted among added bodies alone. Number of its frame, mean turns of that per turn
# of the crank, and 1, or −1 if it turns backwards. Mass, kg; 1 if the body moves with the block; 1 if gears,
# couplings or its frame move it with the crank. Mass times x and y of the centre of mass from the frame's origin, kg
# m; inertia about the frame's z axis, and the inertia of a body that moves with the crank, reduced to the crank, kg m².
# Bodies of one group (gears without give) have their modes in common: first mode of the group among added bodies, 1
# in the row of its last body, first port of the group and number of its ports.
MODE, MODES, PORT, PORTS, OWN_MODE, OWN_PORT, FRAME_OF, RATE, SENSE, MASS, CARRIED, TIED = range(12)
UNBALANCE_X, UNBALANCE_Y, INERTIA, REFLECTED, GROUP, ENDS_GROUP, GROUP_PORT, GROUP_PORTS, BODY = range(12, 21)
# ``AddedConnections.frames``: kind; turns per turn of the crank, negative if backwards; angle at crank angle 0 of the
# axes, or of the cylinder, rad. For rods and pistons also the pin's place at crank angle 0 across and along the
# cylinder, from the crank's axis, the rod's length, and the offset of the cylinder's axis from the crank's, m.
FRAME_KIND, RATIO, START, PIN_X, PIN_Y, LENGTH, AXIS_OFFSET, FRAME = range(8)
TURNING, ROD_FRAME, PISTON_FRAME = range(3)
# ``AddedWork.frames``: angle of the axes in the engine's, and its first two derivatives by the crank angle. Place of
# the origin from the crank's axis along the engine's axes, and its first derivative; then its first and second
# derivative along the frame's own axes.
TURNED, TURN, TURN2, PLACE_X, PLACE_Y, PLACE_X1, PLACE_Y1, OWN_X1, OWN_Y1, OWN_X2, OWN_Y2, MOVED = range(12)
# ``AddedConnections.rows``: number of components and the first of them. Frame in whose axes the law is evaluated, and
# 1, or −1 if that turns backwards; first component of the pairs that turn with these axes (−1: none). Of both ends
# the port of the rotation about z (−1: none), then the sense relative to the law's axes, then the frame. 1 if friction
# of the law acts on both ends; 1 if steps of the iteration are limited; cylinder whose gas pressure is input of the law
# (−1: none); 1 if the law is gas; motion of a tilt component per rotation of the first end about x or y, m or 1, if the
# law's moments act on a tilted end (0: none); 1 if the law is a load.
SIZE, FIRST, AXES, AXES_SENSE, PAIRS, TURN_A, TURN_B, SENSE_A, SENSE_B, FRAME_A, FRAME_B = range(11)
RUBS, CLOSES, CYLINDER, IS_GAS, TILT_LEVER, IS_LOAD, CONNECTION = 11, 12, 13, 14, 15, 16, 17
# ``AddedConnections.slides``: frames of both ends, whose origins move along the component by themselves (−1: the ends
# meet at one place), frame of its direction, and that direction across the crank's axis, x and y.
SLIDING, AGAINST, SLIDES_IN, SLIDES_X, SLIDES_Y, SLIDES = range(6)
# ``AddedConnections.leans``: a connection with an end that slides over a body, and 1, or −1 if that is the second end.
# Of the sliding end its frame, its port of displacement x, and its offset from its interface, x and y. Of the body its
# port, and the offset of its end from its interface at crank angle 0, minus the frame's origin at that angle.
LEANING, LEAN_SIGN, LEANS_IN, SLIDER_PORT, SLIDER_X, SLIDER_Y, WALL_PORT, WALL_X, WALL_Y, LEAN = range(10)
# ``AddedConnections.terms``: component, port, amplitude; the two frames whose difference in angle turns the
# coefficient, and its phase, rad. Frame whose moving origin is a lever of the term (−1: none), 0 for its x or 1 for
# its y, and the value of that at crank angle 0.
COMPONENT, TERM_PORT, AMPLITUDE, GIVEN_FRAME, OWN_FRAME, ANGLE, LEVER_FRAME, LEVER_WAY, LEVER_START, TERM = range(10)
# ``AddedConnections.interfaces``: body about whose axis a displaced force has its moment (number of an added body, or
# one of these), ports of the displacement x and y and of the rotation about z; position in its frame, x and y.
OF_CRANK, OF_BLOCK = -1, -2
OWNER, PORT_X, PORT_Y, PORT_TURN, FIXED_X, FIXED_Y, INTERFACE = range(7)
# ``AddedConnections.shown``: connection or body of an output, kind of value, and index of the value.
SHOWN_OF, SHOWN_KIND, SHOWN_AT, SHOWN = range(4)
FORCE_KIND, PLACE_KIND, VELOCITY_KIND, OUT_KIND, BODY_SPEED, BODY_TURN, BODY_PLACE = range(7)
# ``AddedBodies.fastest``: most turns per turn of the crank of any body, 1 at least; largest first and second derivative
# of the angle of a rod's frame by the crank angle.
FASTEST, SWING, SWING2, FASTEST_SIZE = range(4)
# ``AddedConnections.traits``: number of values that a connection keeps in the state; 1 if its law takes the viscosity
# of the oil, if it takes the engine's speed, and if it computes by itself how fast its film closes.
KEEPS, TOLD_OIL, TOLD_SPEED, TELLS_RATE, TRAITS = range(5)
# ``AddedConnections.hooks``: kernels that a stage calls at their addresses if bodies or connections are added.
AT_FACTOR, AT_LOAD, AT_COMPLIANCE, AT_MOVE, AT_STEPS, AT_NEWTON, AT_SOLVE, AT_STEP_SIZE, AT_FOLLOW = range(9)
AT_RECOVER, AT_TO_PORTS, AT_ANSWER, AT_FORCES, AT_OPEN_STEP, AT_OPEN_STAGE, AT_CLOSE_STAGE = range(9, 16)
AT_CLOSE_STEP, AT_RATE, HOOKS = range(16, 19)
# ``AddedWork.sizes``: size of a Newton step of added components, and of those among them that are limited; angle (rad)
# at which the frames are, and angle and speed (rad/s) at which the terms' coefficients are; largest rate (1/s) at which
# the gap of a bearing closes, over itself.
ANY, LIMITED, FRAMES_ANGLE, TERMS_ANGLE, TERMS_SPEED, CLOSING, SIZES = range(7)
# Rows of ``AddedWork.gaps``: motion of each component, its rate, force, step of an iteration, and change of the force.
D, DD, F, STEP, F_CHANGE, GAPS = range(6)
