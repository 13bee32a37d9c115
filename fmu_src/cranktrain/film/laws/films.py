"""Interface between force laws and the running model: each connection is called through the address of its law.

A journal is described by the displacement (x, y) of its middle and the displacement (a, b) of its end at ζ = 1 against
the middle, m, with velocities in space, in the axes of a frame. The forces on these four are (F_x, F_y, Q_x, Q_y), N,
with Q = ∫ ζ dF. A law without tilt has zero moments. For any other connection the four are components of the motion of
its first end relative to its second end (:class:`cranktrain.dynamics.topology.pieces.Piece`), and forces act on the
first end.

A law is a kernel ``law(record, action, i, place, velocity, numbers, memory, out) -> status``. Its data and memory are
in a record of its own. These actions exist for every law:

* FORCE: force and tangents of film i, and its friction torque, into ``out``;
* OBSERVE: the same, and the values for outputs.

Laws with a memory have further actions, in this order within a step: OPEN_STEP reads the memory from the state;
OPEN_STAGE passes the times of a stage; CLOSE_STAGE solves the films at the converged position of the stage; CLOSE_STEP
writes the memory to the state. RATE writes the relative rate at which a film closes to ``out[0]``, 1/s. The status is
0, or the code of a failure.

Some records hold oil data in addition to the bearings' parameters (trait VISCOUS). The action OIL sets the viscosity of
film i in these records to the one in ``numbers``. The action WARM passes the engine speed (SPEED) to laws of added
connections whose data depend on speed through a table of temperatures.

Laws with the trait TOGETHER solve films side by side. Before the first call of FORCE or CLOSE_STAGE, the action LINE_UP
passes the motion of its journal to each film. FORCE and CLOSE_STAGE then return the solution at this motion.
"""

import weakref
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.kernel import call_kernel, inlined_kernel
from cranktrain.core.reduced_body import Array

IntArray = NDArray[np.int64]

# Indices of positions, velocities and forces of a journal: of the middle, and of the end relative to the middle.
X, Y, END_X, END_Y = range(4)

# Indices of ``out``, the result of a law, which begins with forces (4):
# BY_PLACE, BY_VELOCITY: tangents by position and by velocity (4 × 4 each, row-major).
# ECCENTRICITY; FRICTION: friction torque on the journal (N m); PASSES: iterations of the solver.
# P_MAX, FLOW: largest pressure (Pa) and side flow (m³/s).
# GAP, GAP_ANGLE: least gap (m), negative for a bore that is a rigid circle, and angle of the least gap (rad).
# GAS_POWER, KINETIC: power of the gas on the law's own parts, W, and their kinetic energy, J; with the trait MASS.
# FOLLOWED: first of three forces on ports that the law follows, N; with the trait MASS.
# INNER: first of two components, among the four of a law with the trait MASS, that act on no other connection.
# BY_INNER: first slot of the tangents by position of these two by themselves.
BY_PLACE, BY_VELOCITY, ECCENTRICITY, FRICTION, PASSES = 4, 20, 36, 37, 38
P_MAX, FLOW, GAP, GAP_ANGLE, GAS_POWER, KINETIC, FOLLOWED = range(39, 46)
SIZE = FOLLOWED + 3
INNER, BY_INNER = 2, BY_PLACE + 10

# Indices of the result of a law without tilt, see :func:`widen`: forces (2), tangents by place and velocity (2 × 2).
PLANE_BY_PLACE, PLANE_BY_VELOCITY, PLANE_ECCENTRICITY = 2, 6, 10

PAIR = 2
"""Size of a memory that holds one quantity and its time rate, and may be interpolated within a step."""
FORCE, OBSERVE, OPEN_STEP, OPEN_STAGE, CLOSE_STAGE, CLOSE_STEP, RATE, OIL, WARM, LINE_UP = range(10)
# Columns of ``numbers``, the arguments that a law's connections share:
# SPEED, RUBBING: sum and difference of the speeds of journal and bore (rad/s).
# COS, SIN: cosine and sine of the frame's angle, relative to the bore if TURN is not 0.
# ELAPSED, STEP: time from the step's start to the stage (s), length of the step (s).
# GAIN, STAGE: g (s) of the stage's rule δ̇ = (δ − Δ)/g, and number of the stage.
# FROZEN: 1 if the law may keep its last tangents, or leave them out.
# ANGLE: angle of the frame, whole revolutions included (rad).
# VISCOSITY, TOLERANCE: for OIL, viscosity at ambient pressure (Pa s), and Newton tolerance of the ports (clearances).
# PRESSURE: gas pressure less crankcase pressure (Pa), for laws of a cylinder.
# INPUT: input of the run, N m or N, for loads that take one.
# TURN: speed (rad/s) of the bore's axes if the bore rotates (big end with a memory), else 0.
SPEED, COS, SIN, ELAPSED, STEP, GAIN, STAGE, FROZEN, RUBBING, ANGLE, VISCOSITY, TOLERANCE, PRESSURE, TURN, INPUT = (
    range(15)
)
# Further columns, for laws with the trait MASS:
# ACCELERATION: first of three accelerations in space, of the first two components and of the first inner one, m/s².
# TWIST, TWIST_RATE, TWIST_CHANGE: rotation of the first end in its frame (rad), and its derivatives by time.
# TWIST_COS, TWIST_SIN: cosine and sine of this rotation.
# WHIRL, WHIRL_CHANGE: speed (rad/s) and acceleration (rad/s²) of the law's axes in space.
# RATIO, INERTANCE: ∂u̇/∂u = c_v/c_q (1/s) and ∂ü/∂u = 1/c_q (1/s²) of the stage's rule; 0 outside a stage.
# GRAVITY: acceleration due to gravity, m/s².
# SLOPE: derivative of the gas pressure by the angle of the first end about the crank's axis, Pa/rad.
# COUPLE: friction torque on the law's own rod by the film on its first end, N m.
# WALL: first of three displacements (m) of the ports that the law follows, of their three rates (m/s), and of the
# displacement x and y (m) of the axis of their body.
ACCELERATION, TWIST, TWIST_RATE, TWIST_CHANGE, WHIRL, WHIRL_CHANGE, RATIO, INERTANCE, GRAVITY = 15, *range(18, 26)
SLOPE, COUPLE, TWIST_COS, TWIST_SIN, WALL, NUMBERS = 26, 27, 28, 29, 30, 38

# Traits of a law:
# MEMORY: number of values that one film keeps in the state.
# CLOSES, CONTACT: 1 if the least gap limits the step, 1 if the force has a kink at the contact height.
# VISCOUS, TOGETHER: 1 if the law takes the action OIL, 1 if it solves films together.
# WARMS, TELLS_RATE: 1 if the law takes the action WARM, 1 if it takes the action RATE.
# MASS: 1 if the law has masses of its own. It is told accelerations, and its tangent by position is that of a stage,
# with the parts by velocity and by acceleration, in axes that turn.
MEMORY, CLOSES, CONTACT, VISCOUS, TOGETHER, WARMS, TELLS_RATE, MASS, TRAITS = range(9)


class Films(NamedTuple):
    """Force laws of b connections, called by address; main bearings come first."""

    entry: IntArray  # (b, 3) addresses of the law and of its record, row in the record; 0 without a law
    traits: Array  # (b, TRAITS) traits of each connection's law, see MEMORY
    remembered: IntArray  # (b + 1,) offset of each connection's memory; the last entry is the total size
    place: Array  # (b, 4) positions of the next call, see X
    velocity: Array  # (b, 4) velocities of the next call, see X
    numbers: Array  # (NUMBERS,) shared arguments of the next call, see SPEED
    out: Array  # (SIZE,) result of the last call, see BY_PLACE
    solved: Array  # (1,) number of film evaluations outside the film table so far


def no_films(bearings: int) -> Films:
    """Make ``bearings`` connections without a law."""
    z = np.zeros
    entry, remembered = z((bearings, 3), dtype=np.int64), z(bearings + 1, dtype=np.int64)
    places, velocities = z((bearings, 4)), z((bearings, 4))
    return Films(entry, z((bearings, TRAITS)), remembered, places, velocities, z(NUMBERS), z(SIZE), z(1))


def join_films(count: int, parts: Sequence[tuple[Films, Sequence[int]]]) -> Films:
    """Join parts into ``count`` connections. Each part fills its own rows, and lives as long as the result.

    Film evaluations outside the film table are counted in the counter of the first part.
    """
    films = no_films(count)
    for part, rows in parts:
        films.entry[list(rows)], films.traits[list(rows)] = part.entry, part.traits
    films.remembered[1:] = np.cumsum(films.traits[:, MEMORY])
    weakref.finalize(films.entry, len, parts)  # keeps the parts alive as long as the result
    return films._replace(solved=parts[0][0].solved)


@inlined_kernel
def film_call(films, action, i, memory, out):
    """Call the law of film i with its ``place``, ``velocity`` and ``numbers``. Return 0, or the code of a failure."""
    row = films.entry[i]
    arguments = (row[1], action, row[2], films.place[i], films.velocity[i], films.numbers, memory, out)
    return call_kernel(row[0], arguments)


@inlined_kernel
def widen(plane, out):
    """Expand the result of a law without tilt to ``out[0:36]``, with zero moments, and copy the eccentricity."""
    for k in range(ECCENTRICITY):
        out[k] = 0.0
    for r in range(2):
        out[r] = plane[r]
        for s in range(2):
            out[BY_PLACE + 4 * r + s] = plane[PLANE_BY_PLACE + 2 * r + s]
            out[BY_VELOCITY + 4 * r + s] = plane[PLANE_BY_VELOCITY + 2 * r + s]
    out[ECCENTRICITY] = plane[PLANE_ECCENTRICITY]
