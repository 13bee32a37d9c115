"""Slots of an integrator's table: one float64 array (rows, WIDTH) that its kernels read.

Row ``HEAD`` holds the values that all families share: the family's number in the register, the number of stages, c_q/h²
and c_v/h of the implicit stages, whether the first stage is explicit; then the constants of Newmark's form. A row for
each stage follows, a_ij (strictly lower part used) with c_i in the last column. A method with an embedded one has a
last row with the differences of the weights, b − b̂.
"""

from cranktrain.core.kernel import kernel

HEAD, FIRST_STAGE = 0, 1
FAMILY, STAGES, C_Q, C_V, EXPLICIT_FIRST, ALPHA_M, ALPHA_F, BETA, GAMMA, WIDTH = range(10)
NODE = WIDTH - 1
"""Column of c_i, the time of a stage as a fraction of the step."""


@kernel
def coefficients(table, h):
    """c_q and c_v of the method's implicit stages for step h: q = Q + c_q a, v = V + c_v a."""
    return table[HEAD, C_Q] * h * h, table[HEAD, C_V] * h
