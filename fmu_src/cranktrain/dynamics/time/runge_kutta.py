"""Step of the diagonally implicit Runge–Kutta methods, with tables from :mod:`cranktrain.dynamics.time.tableaux`.

Stage s reads V = v₀ + h Σ a_sj a_j and Q = q₀ + h Σ a_sj v_j + hγ V over the stages j < s; the last one ends the step.
"""

from cranktrain.core.kernel import inlined_kernel, kernel, law_kernel
from cranktrain.core.vectors import LANES, load, store
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import port_count, turning_modes
from cranktrain.dynamics.model.state import ACCELERATION, OMEGA_REFERENCE, POSITION, VELOCITY, offset
from cranktrain.dynamics.time.stage import Stage
from cranktrain.dynamics.time.status import OK
from cranktrain.dynamics.time.step import keep_motion, port_tolerance, solve_and_keep
from cranktrain.dynamics.time.table import EXPLICIT_FIRST, FIRST_STAGE, HEAD, STAGES, coefficients


@law_kernel
def runge_kutta_step(model, work, state, slot, h):
    """Advance the modal motion in ``state`` by one step h. Return a status (0: success); a failure changes no state."""
    table = model.stages
    n = model.omega2.shape[0]
    stages = int(table[HEAD, STAGES])
    c_q, c_v = coefficients(table, h)
    omega = state[OMEGA_REFERENCE]
    tolerance = port_tolerance(model, work, h)
    first = 0
    if table[HEAD, EXPLICIT_FIRST] > 0.0:
        # The first stage is the state.
        first = 1
        for block in range(3):
            for i in range(n):
                work.stage[0, block, i] = state[offset(block, n) + i]
            for k in range(port_count(model)):
                work.known[0, block, k] = work.port[at.STATE_U + block, k]
    for s in range(first, stages):
        combine_stages(model, work, state, s, h)
        o = offset(ACCELERATION, n)
        a_guess = state[o : o + n] if s == 0 else work.stage[s - 1, 2]
        stage = Stage(s, slot, c_q, c_v, omega, tolerance, a_guess)
        status = solve_and_keep(model, work, state, stage, h, c_v)
        if status != OK:
            return status
    keep_motion(model, work, state, stages - 1)
    return OK


@inlined_kernel
def combine_stages(model, work, state, s, h):
    """Fill the vectors Q and V of stage s, in modes and at the ports, from earlier stages."""
    table = model.stages
    n = model.omega2.shape[0]
    m = port_count(model)
    _, c_v = coefficients(table, h)
    big_q = work.modal[at.BIG_Q]
    big_v = work.modal[at.BIG_V]
    u_q = work.port[at.U_Q]
    u_v = work.port[at.U_V]
    for i in range(n):
        big_v[i] = state[offset(VELOCITY, n) + i]
        big_q[i] = state[offset(POSITION, n) + i]
    # Q and V at the ports follow from motion of the ports, which saves two products with the shapes.
    for k in range(m):
        u_v[k] = work.port[at.STATE_UD, k]
        u_q[k] = work.port[at.STATE_U, k]
    weights = work.scratch
    for j in range(s):
        weights[j] = h * table[FIRST_STAGE + s, j]
    add_stages(work.stage, 2, weights, s, n, big_v)
    add_stages(work.stage, 1, weights, s, n, big_q)
    add_stages(work.known, 2, weights, s, m, u_v)
    add_stages(work.known, 1, weights, s, m, u_q)
    for i in range(n):
        big_q[i] += c_v * big_v[i]
    for k in range(m):
        u_q[k] += c_v * u_v[k]


@kernel
def add_stages(found, part, weights, stages, n, out):
    """``out`` (n,) += Σ_j weights[j] ``found[j, part]`` over the earlier stages j."""
    i = 0
    while i + 3 < n:
        total = load(out, i)
        for j in range(stages):
            total += weights[j] * load(found, (j, part, i))
        store(out, i, total)
        i += LANES
    for k in range(i, n):
        for j in range(stages):
            out[k] += weights[j] * found[j, part, k]


@law_kernel
def runge_kutta_difference(model, work, h):
    """Fill ``work.modal[DIFFERENCE]``, ``work.port[U_DIFFERENCE]`` with step minus embedded solution. Return 0."""
    table = model.stages
    stages = int(table[HEAD, STAGES])
    weights = table[FIRST_STAGE + stages]
    for i in range(turning_modes(model)):
        move = 0.0
        for s in range(stages):
            move += h * weights[s] * work.stage[s, 1, i]
        work.modal[at.DIFFERENCE, i] = move
    for j in range(model.judged.shape[0]):
        k = int(model.judged[j])
        move = 0.0
        for s in range(stages):
            move += h * weights[s] * work.known[s, 1, k]
        work.port[at.U_DIFFERENCE, k] = move
    return OK
