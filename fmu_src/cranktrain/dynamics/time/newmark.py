"""Step of the methods of Newmark's form, with an auxiliary acceleration ā; tables are in module ``tableaux``.

q₁ = q₀ + h v₀ + h² [(½−β) ā₀ + β ā₁] and v₁ = v₀ + h [(1−γ) ā₀ + γ ā₁] with (1−α_m) ā₁ + α_m ā₀ = (1−α_f) a₁ + α_f a₀.
"""

from cranktrain.core.kernel import law_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import turning_modes
from cranktrain.dynamics.model.state import ACCELERATION, AUXILIARY, POSITION, VELOCITY, offset
from cranktrain.dynamics.time.status import OK
from cranktrain.dynamics.time.step import keep_motion, solve_only_stage
from cranktrain.dynamics.time.table import ALPHA_F, ALPHA_M, BETA, GAMMA, HEAD


@law_kernel
def newmark_step(model, work, state, slot, h):
    """Advance the modal motion in ``state`` by one step h. Return a status (0: success); a failure changes no state."""
    n = model.omega2.shape[0]
    alpha_m = model.stages[HEAD, ALPHA_M]
    alpha_f = model.stages[HEAD, ALPHA_F]
    beta = model.stages[HEAD, BETA]
    gamma = model.stages[HEAD, GAMMA]
    q = state[offset(POSITION, n) : offset(POSITION, n) + n]
    v = state[offset(VELOCITY, n) : offset(VELOCITY, n) + n]
    a = state[offset(ACCELERATION, n) : offset(ACCELERATION, n) + n]
    auxiliary = state[offset(AUXILIARY, n) : offset(AUXILIARY, n) + n]
    known = work.modal[at.KNOWN]
    for i in range(n):
        known[i] = (alpha_f * a[i] - alpha_m * auxiliary[i]) / (1.0 - alpha_m)
        work.modal[at.BIG_Q, i] = q[i] + h * v[i] + h * h * ((0.5 - beta) * auxiliary[i] + beta * known[i])
        work.modal[at.BIG_V, i] = v[i] + h * ((1.0 - gamma) * auxiliary[i] + gamma * known[i])
    status = solve_only_stage(model, work, state, slot, h)
    if status != OK:
        return status
    kappa = (1.0 - alpha_f) / (1.0 - alpha_m)
    for i in range(n):
        before = auxiliary[i]
        auxiliary[i] = kappa * work.stage[0, 2, i] + known[i]
        work.modal[at.DIFFERENCE, i] = (beta - 1.0 / 6.0) * h * h * (auxiliary[i] - before)
    keep_motion(model, work, state, 0)
    return OK


@law_kernel
def newmark_difference(model, work, h):
    """Fill ``work.port[U_DIFFERENCE]`` with the difference to a step of constant acceleration. Return 0."""
    for j in range(model.judged.shape[0]):
        k = int(model.judged[j])
        move = 0.0
        for i in range(turning_modes(model)):
            move += model.bodies.shapes[k, i] * work.modal[at.DIFFERENCE, i]
        work.port[at.U_DIFFERENCE, k] = move
    return OK
