"""Slots of the arrays of bodies and of connections by terms; nothing is imported here."""

# Rows of ``Bodies.rows``: the crank with all that turns with it, the block, then all other bodies.
OF_CRANK, OF_BLOCK, OTHERS = range(3)
# Columns of ``Bodies.rows``:
# MODE, MODES, PORT, PORTS: first mode and first port of the body in the model, and numbers of its modes and ports.
# OWN_MODE: first row of the body in the tables of modes; in those of ports it is PORT.
# FRAME_OF, SENSE: number of the body's frame; 1, or −1 if the frame turns backwards.
# CARRIED, TIED: 1 if the body moves with the block; 1 if gears, couplings or its frame move it with the crank, but 0 if
# its motion is part of the crank's modes.
# GROUP, ENDS_GROUP: first row of the body's group in the tables of modes, and 1 in the row of the group's last body.
# Bodies of one group are coupled by gears without give and have their modes in common. Ports of bodies in the crank's
# group are ports of the crank.
# GROUP_PORT, GROUP_PORTS: first port of the group and number of its ports.
# SWINGS: 1 if the body's frame does not turn uniformly with the crank.
# WHIRLS: 1 if rotation couples modes of the body, by gyroscopic or centrifugal terms.
MODE, MODES, PORT, PORTS, OWN_MODE, FRAME_OF, SENSE, CARRIED, TIED = range(9)
GROUP, ENDS_GROUP, GROUP_PORT, GROUP_PORTS, SWINGS, WHIRLS, BODY = range(9, 16)
# Columns of ``Bodies.constants``:
# RATE: mean turns of the body's frame per turn of the crank.
# MASS: mass of the body, kg.
# UNBALANCE_X, UNBALANCE_Y: mass times x and y of the centre of mass, measured from the frame's origin, kg m.
# INERTIA: inertia of the body about the frame's z axis, kg m².
# REFLECTED: inertia of a body that moves with the crank, reduced to the crank, kg m².
RATE, MASS, UNBALANCE_X, UNBALANCE_Y, INERTIA, REFLECTED, CONSTANTS = range(7)
# Columns of ``Links.frames``, one row for each frame:
# FRAME_KIND: TURNING, ROD_FRAME or PISTON_FRAME.
# RATIO: turns of the frame per turn of the crank, negative if backwards.
# START: angle of the axes, or of the cylinder, at crank angle 0, rad.
# PIN_X, PIN_Y: for rods and pistons, position of the pin across and along the cylinder at crank angle 0, m.
# LENGTH, AXIS_OFFSET: length of the rod, and distance of the cylinder's axis from the crank's axis, m.
FRAME_KIND, RATIO, START, PIN_X, PIN_Y, LENGTH, AXIS_OFFSET, FRAME = range(8)
TURNING, ROD_FRAME, PISTON_FRAME = range(3)
# Columns of ``LinkWork.frames``, one row for each frame at a crank angle:
# TURNED, TURN, TURN2: angle of the frame's axes in the engine's axes, and its first two derivatives by crank angle.
# PLACE_X, PLACE_Y: position of the frame's origin from the crank's axis, in the engine's axes.
# PLACE_X1, PLACE_Y1: derivative of this position by crank angle, in the engine's axes.
# OWN_X1, OWN_Y1, OWN_X2, OWN_Y2: first and second derivative of the position, in the frame's own axes.
TURNED, TURN, TURN2, PLACE_X, PLACE_Y, PLACE_X1, PLACE_Y1, OWN_X1, OWN_Y1, OWN_X2, OWN_Y2, MOVED = range(12)
# Columns of ``Links.slides``, one row for each component:
# SLIDING, AGAINST: frames of both ends, whose origins move along the component (−1: the ends meet at one point).
# SLIDES_IN, SLIDES_X, SLIDES_Y: frame of the component's direction, and this direction's x and y.
SLIDING, AGAINST, SLIDES_IN, SLIDES_X, SLIDES_Y, SLIDES = range(6)
# Columns of ``Links.leans``, one row for each connection with an end that slides over a body:
# LEANING, LEAN_SIGN: row of the connection; 1, or −1 if its second end is the sliding one.
# LEANS_IN, SLIDER_PORT: frame of the sliding end, and port of its displacement x.
# SLIDER_X, SLIDER_Y: offset of the sliding end from its interface.
# WALL_PORT: port of the body over which the end slides.
# WALL_X, WALL_Y: offset of the body's end from its interface at crank angle 0, minus the frame's origin there.
LEANING, LEAN_SIGN, LEANS_IN, SLIDER_PORT, SLIDER_X, SLIDER_Y, WALL_PORT, WALL_X, WALL_Y, LEAN = range(10)
# Columns of ``Links.terms``, one row for each term:
# COMPONENT, TERM_PORT, AMPLITUDE: component to which the term adds, its port, and its amplitude.
# GIVEN_FRAME, OWN_FRAME, ANGLE: frames whose difference in angle turns the coefficient, and its phase, rad.
# LEVER_FRAME: frame whose moving origin is a lever of the term (−1: none).
# LEVER_WAY, LEVER_START: 0 for x or 1 for y of this origin, and its value at crank angle 0.
COMPONENT, TERM_PORT, AMPLITUDE, GIVEN_FRAME, OWN_FRAME, ANGLE, LEVER_FRAME, LEVER_WAY, LEVER_START, TERM = range(10)
# Columns of ``Links.interfaces``, one row for each held interface:
# OWNER: row of the body about whose axis a displaced force has its moment.
# PORT_X, PORT_Y, PORT_TURN: ports of the interface's displacement x and y and of its rotation about z.
# FIXED_X, FIXED_Y: position of the interface in the frame of its body.
OWNER, PORT_X, PORT_Y, PORT_TURN, FIXED_X, FIXED_Y, INTERFACE = range(7)
# Columns of ``Links.shown``: row of an output's connection, or its body; kind of value, and its index.
SHOWN_OF, SHOWN_KIND, SHOWN_AT, SHOWN = range(4)
FORCE_KIND, PLACE_KIND, VELOCITY_KIND, OUT_KIND, BODY_SPEED, BODY_TURN, BODY_PLACE = range(7)
# Slots of ``AddedBodies.fastest``:
# FASTEST: most turns of any body per turn of the crank, at least 1.
# SWING, SWING2: largest first and second derivative of the angle of a rod's frame by the crank angle.
FASTEST, SWING, SWING2, FASTEST_SIZE = range(4)
# Slots of ``LinkWork.sizes``:
# FRAMES_ANGLE: crank angle (rad) at which the frames were computed.
# TERMS_ANGLE, TERMS_SPEED: angle (rad) and speed (rad/s) at which the terms' coefficients were computed.
FRAMES_ANGLE, TERMS_ANGLE, TERMS_SPEED, SIZES = range(4)
# Rows of ``LinkWork.gaps``, each with one value for each component:
# D, DD, F: motion, rate of motion, and force of the component.
# STEP, F_CHANGE: step of the component in an iteration, and change of its force.
D, DD, F, STEP, F_CHANGE, GAPS = range(6)
