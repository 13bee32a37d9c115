"""The whole state of the running model in one float64 vector.

A header of scalars, the inputs at the last three communication points, the rates that were given with the last, then
modal position, velocity, acceleration and two blocks that integrators remember, what the guess of the ports missed at
each stage of the last step, and the elastic films: of each its node unknowns, shapes, their rates, and the results at
the end of the step. Behind them there may be room for the two ends of an internal step that reaches beyond the
communication point (:mod:`cranktrain.dynamics.time.between`); what comes before it is the motion at that point. A copy
of the vector is all that get, set and serialise need.
"""

from __future__ import annotations

from cranktrain.core.kernel import kernel

# Header.
TIME, SHAFT_ANGLE, SHAFT_SPEED, SHAFT_ACCELERATION = 0, 1, 2, 3
LEAD_ANGLE, LEAD_SPEED = 4, 5
STEP_REFERENCE, OMEGA_REFERENCE = 6, 7
PRESSURES_SET = 8
SUBSTEPS, ITERATIONS, RESIDUAL, CONTRACTION, STEP_LAST = 10, 11, 12, 13, 14
ONLINE_FILMS = 15
# Step control: halvings of the last step, error of the last step in tolerances, and the running mean and variance of
# the pulley's torsion and axial motion, to which their errors are relative.
HALVINGS, STEP_ERROR = 16, 17
OUTPUT_MEAN, OUTPUT_VARIANCE = 18, 20
GAS_DONE, GAS_RATE = 22, 23
"""Work of given pressures since the start, J, and their power at the end of the last internal step, W."""
METHOD = 24
"""Mark of the integrator, whose blocks mean nothing to another; 0 where none is given."""
# Samples of the inputs: how many are kept; the communication step that began at the newest of them, s, and the time
# between it and the one before; the crank's angle at the last communication point, and those that the samples'
# pressures belong to, newest first, rad.
SAMPLES, LAST_INTERVAL, EARLIER_INTERVAL, POINT_ANGLE, SAMPLE_ANGLES = 9, 25, 26, 27, 28
ANGLE_SET = 31
"""Whether a partner has said which angle its pressures belong to."""
LIMITED = 32
"""1 where the last communication step took more work than it may, else 0."""
# The internal step that is under way at the communication point: 1 if there is one; its begin and its end, s; begin of
# the sub-step that it is a part of, s; how many of the sub-step's parts are done with it; least halvings of the next
# part.
UNDER_WAY, STEP_BEGIN, STEP_END, SUBSTEP_BEGIN, PARTS_DONE, PARTS_HALVED = range(33, 39)
EACH_POINT = 39
"""1 where the next communication step shall be stepped to its end, as if an input had changed at its begin; then 0."""
DEVIATIONS_SET = 40
"""Whether a partner has said which deviation of a volume its pressures belong to."""
# The crank's own speed over the cycle under way: the cycle's begin, angle (rad) and time (s), and the least and largest
# speed since then, rad/s; of the last full cycle (largest − least) / mean.
ROUND_ANGLE, ROUND_TIME, SPEED_LEAST, SPEED_LARGEST, IRREGULARITY = range(41, 46)
MOST_SAMPLES = 3
HEADER = 46
MAX_INPUTS = 65
"""Room for one speed, the pressures of up to 30 cylinders and what comes behind them in each sample."""
INPUTS_NOW = HEADER
INPUTS_BEFORE = HEADER + MAX_INPUTS
INPUT_RATES = HEADER + MOST_SAMPLES * MAX_INPUTS
RATES_GIVEN = INPUT_RATES + MAX_INPUTS
"""Rates of the inputs over the communication step that begins at the newest sample, and 1 where one was given."""
MAX_STAGES = 8
# Blocks of n modal values: what generalised-α calls ā, or bdf2's position a step before; bdf2's velocity then.
POSITION, VELOCITY, ACCELERATION, AUXILIARY, HISTORY = 0, 1, 2, 3, 4
MODAL_BLOCKS = 5
BODY = RATES_GIVEN + MAX_INPUTS


@kernel
def offset(block, n):
    """First index of a modal block."""
    return BODY + block * n


@kernel
def defect_offset(n):
    """First index of what the ports' guesses missed, m values a stage."""
    return BODY + MODAL_BLOCKS * n


@kernel
def film_offset(n, m):
    """First index of the elastic films."""
    return BODY + MODAL_BLOCKS * n + MAX_STAGES * m


@kernel
def end_size(size):
    """Numbers that are kept of an end of a step, of a state whose motion takes ``size`` numbers in all."""
    return METHOD + size - BODY


def state_size(n_modes: int, n_ports: int, films: int = 0, passes: bool = False) -> int:
    """Length of the state vector; ``films`` values belong to elastic films and other laws with a memory.

    With ``passes`` there is room for the ends of a step that passes over communication points.
    """
    size = BODY + MODAL_BLOCKS * n_modes + MAX_STAGES * n_ports + films
    return size + 2 * int(end_size(size)) if passes else size
