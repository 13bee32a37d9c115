"""The whole state of the running model in one float64 vector.

A header of scalars, the inputs at the last three communication points, the rates that were given with the last, then
modal position, velocity, acceleration and two blocks that integrators remember, the error of the ports' guess at each
stage of the last step, and for each elastic film its node unknowns, shapes, their rates, and the results at the end of
the step. There may be room at the end for both ends of an internal step that reaches beyond the communication point
(:mod:`cranktrain.dynamics.time.between`); the part before it is the motion at that point. A copy of the vector is all
that get, set and serialise need.
"""

from cranktrain.core.kernel import kernel

# Slots of the header, which holds scalars.
TIME, SHAFT_ANGLE, SHAFT_SPEED, SHAFT_ACCELERATION = 0, 1, 2, 3
LEAD_ANGLE, LEAD_SPEED = 4, 5
STEP_REFERENCE, OMEGA_REFERENCE = 6, 7
PRESSURES_SET = 8
SUBSTEPS, ITERATIONS, RESIDUAL, CONTRACTION, STEP_LAST = 10, 11, 12, 13, 14
ONLINE_FILMS = 15
# Slots of step control:
# HALVINGS, STEP_ERROR: halvings of the last step, and error of the last step in units of the tolerance.
# OUTPUT_MEAN, OUTPUT_VARIANCE: running mean and variance of the pulley's torsion and axial motion.
HALVINGS, STEP_ERROR = 16, 17
OUTPUT_MEAN, OUTPUT_VARIANCE = 18, 20
GAS_DONE, GAS_RATE = 22, 23
"""Work of given pressures since the start, J, and their power at the end of the last internal step, W."""
METHOD = 24
"""Mark of the integrator that wrote the state, because another integrator cannot use its blocks; 0 if unknown."""
# Slots of the samples of the inputs:
# SAMPLES: number of samples kept.
# LAST_INTERVAL: communication step that began at the newest sample, s.
# EARLIER_INTERVAL: time from the second newest sample to the newest, s.
# POINT_ANGLE: angle of the crank at the last communication point, rad.
# SAMPLE_ANGLES: first of the angles that the pressures of the samples belong to, newest first, rad.
SAMPLES, LAST_INTERVAL, EARLIER_INTERVAL, POINT_ANGLE, SAMPLE_ANGLES = 9, 25, 26, 27, 28
ANGLE_SET = 31
"""1 if a partner has given the crank angle that its pressures belong to, else 0."""
LIMITED = 32
"""1 if the last communication step reached its work limit, else 0."""
# Slots of an internal step that is under way at the communication point:
# UNDER_WAY, STEP_BEGIN, STEP_END: 1 if there is such a step; its begin and end, s.
# SUBSTEP_BEGIN: begin of the sub-step that contains the internal step, s.
# PARTS_DONE, PARTS_HALVED: parts of the sub-step done at the end of the step; least halvings of the next part.
UNDER_WAY, STEP_BEGIN, STEP_END, SUBSTEP_BEGIN, PARTS_DONE, PARTS_HALVED = range(33, 39)
EACH_POINT = 39
"""1 if the next communication step must end an internal step, as if an input had changed; that step resets it to 0."""
DEVIATIONS_SET = 40
"""1 if a partner has given the deviations of the volumes that its pressures belong to, else 0."""
# Slots of the crank's own speed in the present cycle:
# ROUND_ANGLE, ROUND_TIME: begin of the cycle as angle (rad) and as time (s).
# SPEED_LEAST, SPEED_LARGEST: least and largest speed since the begin of the cycle, rad/s.
# IRREGULARITY: (largest − least) / mean speed of the last full cycle.
ROUND_ANGLE, ROUND_TIME, SPEED_LEAST, SPEED_LARGEST, IRREGULARITY = range(41, 46)
MOST_SAMPLES = 3
HEADER = 46
MAX_INPUTS = 65
"""Size of a sample: one speed, the pressures of up to 30 cylinders and the inputs after them."""
INPUTS_NOW = HEADER
INPUTS_BEFORE = HEADER + MAX_INPUTS
INPUT_RATES = HEADER + MOST_SAMPLES * MAX_INPUTS
RATES_GIVEN = INPUT_RATES + MAX_INPUTS
"""Marks of the inputs' rates over the communication step that begins at the newest sample: 1 if a rate was given."""
MAX_STAGES = 8
# Blocks of n modal values:
# AUXILIARY: ā of generalised-α, or the position of one step before for bdf2.
# HISTORY: velocity of one step before for bdf2.
POSITION, VELOCITY, ACCELERATION, AUXILIARY, HISTORY = 0, 1, 2, 3, 4
MODAL_BLOCKS = 5
BODY = RATES_GIVEN + MAX_INPUTS


@kernel
def offset(block, n):
    """First index in the state of a block of modal values."""
    return BODY + block * n


@kernel
def defect_offset(n):
    """First index in the state of the errors of the ports' initial guesses, m values for each stage."""
    return BODY + MODAL_BLOCKS * n


@kernel
def film_offset(n, m):
    """First index in the state of the values of elastic films."""
    return BODY + MODAL_BLOCKS * n + MAX_STAGES * m


@kernel
def end_size(size):
    """Number of values stored for one end of a step, in a state whose motion takes ``size`` values."""
    return METHOD + size - BODY


def state_size(n_modes: int, n_ports: int, films: int = 0, passes: bool = False) -> int:
    """Length of the state vector; ``films`` is the number of values of elastic films and other laws with a memory.

    With ``passes`` there is room for the ends of a step that passes over communication points.
    """
    size = BODY + MODAL_BLOCKS * n_modes + MAX_STAGES * n_ports + films
    return size + 2 * int(end_size(size)) if passes else size
