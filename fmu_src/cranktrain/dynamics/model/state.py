"""The whole state of the running model in one float64 vector.

A header of scalars, the inputs at the last two communication points, then modal position, velocity, acceleration and
two blocks that integrators remember, what the guess of the ports missed at each stage of the last step, and the elastic
films: of each its node unknowns, shapes, their rates, and the results at the end of the step. A copy of it is all that
get, set and serialise need.
"""

from __future__ import annotations

from cranktrain.core.kernel import kernel

# Header.
TIME, SHAFT_ANGLE, SHAFT_SPEED, SHAFT_ACCELERATION = 0, 1, 2, 3
LEAD_ANGLE, LEAD_SPEED = 4, 5
STEP_REFERENCE, OMEGA_REFERENCE = 6, 7
PRESSURES_SET, LAST_INTERVAL = 8, 9
SUBSTEPS, ITERATIONS, RESIDUAL, CONTRACTION, STEP_LAST = 10, 11, 12, 13, 14
ONLINE_FILMS = 15
# Step control: halvings of the last step, error of the last step in tolerances, and the running mean and variance of
# the pulley's torsion and axial motion, to which their errors are relative.
HALVINGS, STEP_ERROR = 16, 17
OUTPUT_MEAN, OUTPUT_VARIANCE = 18, 20
METHOD = 22
"""Mark of the integrator, whose blocks mean nothing to another; 0 where none is given."""
HEADER = 24
MAX_INPUTS = 32
"""Room for one speed and the pressures of up to 31 cylinders, at two communication points."""
INPUTS_BEFORE = HEADER
INPUTS_NOW = HEADER + MAX_INPUTS
MAX_STAGES = 8
# Blocks of n modal values: what generalised-α calls ā, or bdf2's position a step before; bdf2's velocity then.
POSITION, VELOCITY, ACCELERATION, AUXILIARY, HISTORY = 0, 1, 2, 3, 4
MODAL_BLOCKS = 5
BODY = HEADER + 2 * MAX_INPUTS


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


def state_size(n_modes: int, n_ports: int, films: int = 0) -> int:
    """Length of the state vector; ``films`` values belong to elastic films."""
    return BODY + MODAL_BLOCKS * n_modes + MAX_STAGES * n_ports + films
