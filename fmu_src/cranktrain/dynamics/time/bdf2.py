"""Step of the two-step backward differentiation formula: 3 v₁ = 4 v₀ − v₋₁ + 2h a₁, 3 q₁ = 4 q₀ − q₋₁ + 2h v₁."""

from cranktrain.core.kernel import law_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.state import ACCELERATION, AUXILIARY, HISTORY, POSITION, STEP_LAST, VELOCITY, offset
from cranktrain.dynamics.time.status import OK
from cranktrain.dynamics.time.step import keep_motion, solve_only_stage
from cranktrain.dynamics.time.table import coefficients


@law_kernel
def bdf2_step(model, work, state, slot, h):
    """Advance the modal motion in ``state`` by one step h. Return a status (0: success).

    Position and velocity at the start of the last step are in the blocks AUXILIARY and HISTORY.
    """
    n = model.omega2.shape[0]
    q = state[offset(POSITION, n) : offset(POSITION, n) + n]
    v = state[offset(VELOCITY, n) : offset(VELOCITY, n) + n]
    a = state[offset(ACCELERATION, n) : offset(ACCELERATION, n) + n]
    q_before = state[offset(AUXILIARY, n) : offset(AUXILIARY, n) + n]
    v_before = state[offset(HISTORY, n) : offset(HISTORY, n) + n]
    if h != state[STEP_LAST]:
        # The formula needs two steps of equal length, so the last step is replaced by one of length h.
        for i in range(n):
            q_before[i] = q[i] - h * (v[i] - 0.5 * h * a[i])
            v_before[i] = v[i] - h * a[i]
    _, c_v = coefficients(model.stages, h)
    big_v = work.modal[at.BIG_V]
    for i in range(n):
        big_v[i] = (4.0 * v[i] - v_before[i]) / 3.0
        work.modal[at.BIG_Q, i] = (4.0 * q[i] - q_before[i]) / 3.0 + c_v * big_v[i]
    status = solve_only_stage(model, work, state, slot, h)
    if status != OK:
        return status
    for i in range(n):
        q_before[i] = q[i]
        v_before[i] = v[i]
    keep_motion(model, work, state, 0)
    return OK
