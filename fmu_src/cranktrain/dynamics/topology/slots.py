"""Slots of the arrays of added bodies and connections; nothing is imported here."""

from __future__ import annotations

# Columns of ``AddedBodies.rows``, one row for each added body:
# MODE, MODES, PORT, PORTS: first mode and first port of the body in the model, and numbers of its modes and ports.
# OWN_MODE, OWN_PORT: first mode and first port of the body, counted among added bodies alone.
# FRAME_OF, RATE: number of the body's frame, and mean turns of this frame per turn of the crank.
# SENSE: 1, or −1 if the frame turns backwards.
# MASS, CARRIED: mass of the body, kg, and 1 if the body moves with the block.
# TIED: 1 if gears, couplings or its frame move the body with the crank.
# UNBALANCE_X, UNBALANCE_Y: mass times x and y of the centre of mass from the frame's origin, kg m.
# INERTIA: inertia of the body about the frame's z axis, kg m².
# REFLECTED: inertia of a body that moves with the crank, reduced to the crank, kg m².
# GROUP, ENDS_GROUP: first mode of the body's group among added bodies, and 1 in the row of the group's last body.
# Bodies of one group are coupled by gears without give and have their modes in common.
# GROUP_PORT, GROUP_PORTS: first port of the group and number of its ports.
MODE, MODES, PORT, PORTS, OWN_MODE, OWN_PORT, FRAME_OF, RATE, SENSE, MASS, CARRIED, TIED = range(12)
UNBALANCE_X, UNBALANCE_Y, INERTIA, REFLECTED, GROUP, ENDS_GROUP, GROUP_PORT, GROUP_PORTS, BODY = range(12, 21)
# Columns of ``AddedConnections.frames``, one row for each frame:
# FRAME_KIND: TURNING, ROD_FRAME or PISTON_FRAME.
# RATIO: turns of the frame per turn of the crank, negative if backwards.
# START: angle of the axes, or of the cylinder, at crank angle 0, rad.
# PIN_X, PIN_Y: for rods and pistons, position of the pin across and along the cylinder at crank angle 0, m.
# LENGTH, AXIS_OFFSET: length of the rod, and distance of the cylinder's axis from the crank's axis, m.
FRAME_KIND, RATIO, START, PIN_X, PIN_Y, LENGTH, AXIS_OFFSET, FRAME = range(8)
TURNING, ROD_FRAME, PISTON_FRAME = range(3)
# Columns of ``AddedWork.frames``, one row for each frame at a crank angle:
# TURNED, TURN, TURN2: angle of the frame's axes in the engine's axes, and its first two derivatives by crank angle.
# PLACE_X, PLACE_Y: position of the frame's origin from the crank's axis, in the engine's axes.
# PLACE_X1, PLACE_Y1: derivative of this position by crank angle, in the engine's axes.
# OWN_X1, OWN_Y1, OWN_X2, OWN_Y2: first and second derivative of the position, in the frame's own axes.
TURNED, TURN, TURN2, PLACE_X, PLACE_Y, PLACE_X1, PLACE_Y1, OWN_X1, OWN_Y1, OWN_X2, OWN_Y2, MOVED = range(12)
# Columns of ``AddedConnections.rows``, one row for each piece of a connection:
# SIZE, FIRST: number of its components of motion, and the first of them.
# AXES, AXES_SENSE: frame in whose axes the force law is evaluated; 1, or −1 if that frame turns backwards.
# PAIRS: first component of the x-y pairs that turn with these axes (−1: none).
# TURN_A, TURN_B: ports of the rotation of both ends about z (−1: none).
# SENSE_A, SENSE_B, FRAME_A, FRAME_B: sense of both ends relative to the law's axes, and frames of both ends.
# RUBS: 1 if friction of the force law acts on both ends.
# CLOSES: 1 if steps of the Newton iteration are limited for this connection.
# CYLINDER, IS_GAS: cylinder whose gas pressure is input of the force law (−1: none); 1 if the law is gas.
# TILT_LEVER: motion (m or 1) of a tilt component per rotation of the first end about x or y, if the moments of the
# law act on a tilted end; else 0.
# IS_LOAD: 1 if the force law is a load.
SIZE, FIRST, AXES, AXES_SENSE, PAIRS, TURN_A, TURN_B, SENSE_A, SENSE_B, FRAME_A, FRAME_B = range(11)
RUBS, CLOSES, CYLINDER, IS_GAS, TILT_LEVER, IS_LOAD, CONNECTION = 11, 12, 13, 14, 15, 16, 17
# Columns of ``AddedConnections.slides``, one row for each component:
# SLIDING, AGAINST: frames of both ends, whose origins move along the component (−1: the ends meet at one point).
# SLIDES_IN, SLIDES_X, SLIDES_Y: frame of the component's direction, and this direction's x and y.
SLIDING, AGAINST, SLIDES_IN, SLIDES_X, SLIDES_Y, SLIDES = range(6)
# Columns of ``AddedConnections.leans``, one row for each connection with an end that slides over a body:
# LEANING, LEAN_SIGN: number of the connection; 1, or −1 if its second end is the sliding one.
# LEANS_IN, SLIDER_PORT: frame of the sliding end, and port of its displacement x.
# SLIDER_X, SLIDER_Y: offset of the sliding end from its interface.
# WALL_PORT: port of the body over which the end slides.
# WALL_X, WALL_Y: offset of the body's end from its interface at crank angle 0, minus the frame's origin there.
LEANING, LEAN_SIGN, LEANS_IN, SLIDER_PORT, SLIDER_X, SLIDER_Y, WALL_PORT, WALL_X, WALL_Y, LEAN = range(10)
# Columns of ``AddedConnections.terms``, one row for each term:
# COMPONENT, TERM_PORT, AMPLITUDE: component to which the term adds, its port, and its amplitude.
# GIVEN_FRAME, OWN_FRAME, ANGLE: frames whose difference in angle turns the coefficient, and its phase, rad.
# LEVER_FRAME: frame whose moving origin is a lever of the term (−1: none).
# LEVER_WAY, LEVER_START: 0 for x or 1 for y of this origin, and its value at crank angle 0.
COMPONENT, TERM_PORT, AMPLITUDE, GIVEN_FRAME, OWN_FRAME, ANGLE, LEVER_FRAME, LEVER_WAY, LEVER_START, TERM = range(10)
# Columns of ``AddedConnections.interfaces``, one row for each held interface:
# OWNER: body about whose axis a displaced force has its moment; number of an added body, OF_CRANK or OF_BLOCK.
# PORT_X, PORT_Y, PORT_TURN: ports of the interface's displacement x and y and of its rotation about z.
# FIXED_X, FIXED_Y: position of the interface in the frame of its body.
OF_CRANK, OF_BLOCK = -1, -2
OWNER, PORT_X, PORT_Y, PORT_TURN, FIXED_X, FIXED_Y, INTERFACE = range(7)
# Columns of ``AddedConnections.shown``: connection or body of an output, kind of value, and index of the value.
SHOWN_OF, SHOWN_KIND, SHOWN_AT, SHOWN = range(4)
FORCE_KIND, PLACE_KIND, VELOCITY_KIND, OUT_KIND, BODY_SPEED, BODY_TURN, BODY_PLACE = range(7)
# Slots of ``AddedBodies.fastest``:
# FASTEST: most turns of any body per turn of the crank, at least 1.
# SWING, SWING2: largest first and second derivative of the angle of a rod's frame by the crank angle.
FASTEST, SWING, SWING2, FASTEST_SIZE = range(4)
# Columns of ``AddedConnections.traits``, one row for each piece of a connection:
# KEEPS: number of values that the connection keeps in the state.
# TOLD_OIL, TOLD_SPEED: 1 if its force law takes the viscosity of the oil; 1 if the law takes the engine's speed.
# TELLS_RATE: 1 if the force law computes by itself how fast its film closes.
KEEPS, TOLD_OIL, TOLD_SPEED, TELLS_RATE, TRAITS = range(5)
# Slots of ``AddedConnections.hooks``: addresses of kernels that a stage calls if bodies or connections are added.
AT_FACTOR, AT_LOAD, AT_COMPLIANCE, AT_MOVE, AT_STEPS, AT_NEWTON, AT_SOLVE, AT_STEP_SIZE, AT_FOLLOW = range(9)
AT_RECOVER, AT_TO_PORTS, AT_ANSWER, AT_FORCES, AT_OPEN_STEP, AT_OPEN_STAGE, AT_CLOSE_STAGE = range(9, 16)
AT_CLOSE_STEP, AT_RATE, HOOKS = range(16, 19)
# Slots of ``AddedWork.sizes``:
# ANY, LIMITED: size of the Newton step of all added components, and of the limited ones.
# FRAMES_ANGLE: crank angle (rad) at which the frames were computed.
# TERMS_ANGLE, TERMS_SPEED: angle (rad) and speed (rad/s) at which the terms' coefficients were computed.
# CLOSING: largest rate at which the gap of an added bearing closes, over the gap, 1/s.
ANY, LIMITED, FRAMES_ANGLE, TERMS_ANGLE, TERMS_SPEED, CLOSING, SIZES = range(7)
# Rows of ``AddedWork.gaps``, each with one value for each component:
# D, DD, F: motion, rate of motion, and force of the component.
# STEP, F_CHANGE: step of the component in an iteration, and change of its force.
D, DD, F, STEP, F_CHANGE, GAPS = range(6)
