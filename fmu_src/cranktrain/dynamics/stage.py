"""The stage solver: one implicit stage of any integrator, condensed onto the ports.

Given Q and V with q = Q + c_q a, v = V + c_v a, it finds the true acceleration a that fulfils the equations of motion:
q_free from S⁻¹, a Newton iteration on the ports' displacements u = u_free + Φ S⁻¹ Φᵀ f(u, u̇, ü), and one product back
to q. What S left out because the frame turns at Ω ≠ Ω₀ is iterated with it. The last Newton step is taken with
linearised forces, whose error the contraction estimate bounds.
"""

from __future__ import annotations

from cranktrain.dynamics.equations_of_motion import OMEGA, OMEGA_DOT, external_force, port_forces
from cranktrain.dynamics.linear_algebra import add_product, factor_rows, product, solve_rows
from cranktrain.dynamics.state import CONTRACTION
from cranktrain.film.tilted import HELD
from cranktrain.kernel import kernel

MAX_ITERATIONS = 40
JOURNAL_STEP = 0.3
"""Largest change of a journal's position per iteration, as a share of the clearance."""
FIRST_CONTRACTION, LEAST_CONTRACTION, MOST_CONTRACTION = 0.02, 1.0e-4, 0.5
"""Contraction of the iteration before any was measured, and its bounds. A stage that stops after one iteration trusts
twice the contraction that earlier stages measured; unmeasured, the trust fades, so that it is measured again."""
FADING = 1.1
STALE = 0.1
NEAR = 0.1
"""A Newton matrix is kept when the last step was shorter than NEAR and the iteration contracts better than STALE."""
ROUNDING = 1.0e-13
"""Steps below this are rounding, whatever the tolerance."""
ROTATION_SCALE = 1.0e-2
COUPLING_TOLERANCE = 1.0e-7

OK, DIVERGED, SINGULAR = 0, 1, 2


@kernel
def solve_stage(
    model, work, level, big_q, big_v, c_q, c_v, omega_0, frame, pressures, guess, a_guess, tolerance, state, q, v, a
):  # fmt: skip
    """Solve one stage; fills q, v, a (n,) and leaves the ports' u, u̇, ü, f in ``work.port[0:4]``. Returns a status.

    ``level`` chooses the factors that belong to c_q and c_v. ``work.port[4:6]`` hold Q and V at the ports.
    ``guess`` (m,) is the first guess of u, ``a_guess`` (n,) of a (used where the frame's speed differs from Ω₀).
    ``tolerance`` bounds the estimated error of the ports in units of clearance, 0.1 mm and 0.01 rad. ``state``
    remembers how well the iteration contracts.
    """
    n = model.omega2.shape[0]
    m = model.ports.shape[0]
    n_newton = model.scales.shape[0]
    journals = 2 * model.bearings.shape[0]
    ratio = c_v / c_q
    u = work.port[0]
    ud = work.port[1]
    udd = work.port[2]
    f = work.port[3]
    u_q = work.port[4]
    u_v = work.port[5]
    u_free = work.port[6]
    step = work.port[7]
    base = work.modal[2]
    rhs = work.modal[3]
    lever = work.modal[4]
    q_free = work.modal[5]
    jacobian = work.jacobian
    inverse = work.inverse[level]
    compliance = work.compliance[level]
    # Tangents that belong to the factored matrix; the linearised forces must use the same.
    blocks = work.held
    external_force(model, frame, big_q, base)
    for i in range(n):
        base[i] += big_q[i] / c_q
        lever[i] = ratio * big_q[i] - big_v[i]
        a[i] = a_guess[i]
    add_product(work.damping[level], lever, n, n, base)
    for k in range(m):
        u[k] = guess[k]
    d_omega = frame[OMEGA] - omega_0
    d_omega2 = frame[OMEGA] * frame[OMEGA] - omega_0 * omega_0
    coupling = 2.0 * abs(d_omega) * c_v + (abs(d_omega2) + abs(frame[OMEGA_DOT])) * c_q
    iterations = 0
    previous = -1.0
    contraction = min(MOST_CONTRACTION, 2.0 * state[CONTRACTION])
    measured = False
    for sweep in range(4):
        for i in range(n):
            rhs[i] = base[i]
        if coupling > 0.0:
            for i in range(n):
                lever[i] = -2.0 * d_omega * (big_v[i] + c_v * a[i]) - frame[OMEGA_DOT] * (big_q[i] + c_q * a[i])
            add_product(model.gyroscopic, lever, n, n, rhs)
            if d_omega2 != 0.0:
                for i in range(n):
                    lever[i] = -d_omega2 * (big_q[i] + c_q * a[i])
                add_product(model.spin, lever, n, n, rhs)
        product(inverse, rhs, n, n, q_free)
        product(model.ports_transposed, q_free, n, m, u_free)
        if sweep > 0:
            # A small change of the load: the last Newton matrix and the linearised forces still hold.
            for k in range(m):
                step[k] = u_free[k] - u[k]
            add_product(compliance, f, m, m, step)
            solve_rows(jacobian, n_newton, step)
            linearise(model.connections, blocks, step, f)
            for k in range(m):
                u[k] = u_free[k]
            add_product(compliance, f, m, m, u)
        converged = sweep > 0
        while not converged:
            if iterations == MAX_ITERATIONS:
                work.counters[5] = previous
                return DIVERGED
            iterations += 1
            for k in range(m):
                udd[k] = (u[k] - u_q[k]) / c_q
                ud[k] = u_v[k] + c_v * udd[k]
            hold = previous >= 0.0 and previous <= NEAR and contraction <= STALE
            model.films.numbers[HELD] = 1.0 if hold else 0.0
            port_forces(model, frame, pressures, u, ud, udd, c_q, c_v, f, work)
            # Residual u_free + H f − u, then (I − H J) δ = r on the Newton ports.
            for k in range(m):
                step[k] = u_free[k] - u[k]
            add_product(compliance, f, m, m, step)
            if not hold:
                for k in range(blocks.shape[0]):
                    for j in range(16):
                        blocks[k, j] = work.blocks[k, j]
                fill_jacobian(compliance, model.connections, blocks, n_newton, jacobian)
                if factor_rows(jacobian, n_newton) != 0:
                    return SINGULAR
            solve_rows(jacobian, n_newton, step)
            size = 0.0
            journal = 0.0
            for k in range(n_newton):
                change = abs(step[k]) / model.scales[k]
                size = max(size, change)
                if k < journals:
                    journal = max(journal, change)
            if not size < 1.0e12:
                return DIVERGED
            limit = 1.0
            if journal > JOURNAL_STEP:
                limit = JOURNAL_STEP / journal
                for k in range(n_newton):
                    step[k] *= limit
            linearise(model.connections, blocks, step, f)
            # With f + Jδ the ports follow, rotations included.
            rotation = 0.0
            if limit == 1.0:
                for k in range(m):
                    work.port[9, k] = u[k]
                    u[k] = u_free[k]
                add_product(compliance, f, m, m, u)
                for k in range(n_newton, m):
                    rotation = max(rotation, abs(u[k] - work.port[9, k]) / ROTATION_SCALE)
            else:
                for k in range(n_newton):
                    u[k] += step[k]
            size = max(size, rotation)
            if previous > 0.0 and limit == 1.0:
                contraction = min(0.9, size / previous)
                if not measured:
                    state[CONTRACTION] = max(
                        LEAST_CONTRACTION, min(MOST_CONTRACTION, max(contraction, 0.7 * state[CONTRACTION]))
                    )
                measured = True
            previous = size if limit == 1.0 else -1.0
            converged = limit == 1.0 and (contraction / (1.0 - contraction) * size <= tolerance or size < ROUNDING)
        for i in range(n):
            q[i] = q_free[i]
        add_product(work.response[level], f, m, n, q)
        moved = 0.0
        for i in range(n):
            new = (q[i] - big_q[i]) / c_q
            moved = max(moved, abs(new - a[i]))
            a[i] = new
            v[i] = big_v[i] + c_v * new
        largest = 1.0e-30
        for i in range(n):
            largest = max(largest, abs(a[i]))
        if coupling * moved <= COUPLING_TOLERANCE * largest:
            break
    if not measured:
        state[CONTRACTION] = min(MOST_CONTRACTION, FADING * state[CONTRACTION])
    for k in range(m):
        udd[k] = (u[k] - u_q[k]) / c_q
        ud[k] = u_v[k] + c_v * udd[k]
    work.counters[1] += 1.0
    work.counters[2] += iterations
    work.counters[5] = max(work.counters[5], contraction * previous)
    return OK


@kernel
def fill_jacobian(compliance, connections, blocks, n, jacobian):
    """Fill (I − H J)ᵀ on the n Newton ports; J is the sum of the connections' blocks.

    ``compliance`` is symmetric only without gyroscopic terms; it is kept transposed: [k, i] = H_ik.
    """
    for i in range(n):
        row = jacobian[i]
        for j in range(n):
            row[j] = 0.0
        row[i] = 1.0
    for k in range(connections.shape[0]):
        size = int(connections[k, 0])
        for a in range(size):
            row = jacobian[int(connections[k, 1 + a])]
            for b in range(size):
                share = blocks[k, 4 * b + a]
                if share != 0.0:
                    column = compliance[int(connections[k, 1 + b])]
                    for i in range(n):
                        row[i] -= share * column[i]


@kernel
def linearise(connections, blocks, step, f):
    """f += J δ on the Newton ports."""
    for k in range(connections.shape[0]):
        size = int(connections[k, 0])
        for a in range(size):
            change = 0.0
            for b in range(size):
                change += blocks[k, 4 * a + b] * step[int(connections[k, 1 + b])]
            f[int(connections[k, 1 + a])] += change
