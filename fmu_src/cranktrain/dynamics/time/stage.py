"""The stage solver: one implicit stage of any integrator, condensed onto the ports.

Given Q and V with q = Q + c_q a, v = V + c_v a, it finds the true acceleration a that fulfils the equations of motion:
q_free from S⁻¹, a Newton iteration on the ports' displacements u = u_free + Φ S⁻¹ Φᵀ f(u, u̇, ü), and one product back
to q. What S left out because the frame turns at Ω ≠ Ω₀ is iterated with it. The last Newton step is taken with
linearised forces, whose error the contraction estimate bounds.
"""

from __future__ import annotations

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model.slots import COS, OMEGA_DOT, PISTONS, PORTS, RODS, SHAFT_C, SIN, TURNING_MODES, WHIRL
from cranktrain.dynamics.model.state import CONTRACTION
from cranktrain.dynamics.motion.equations import external_force, port_forces
from cranktrain.dynamics.motion.linear_algebra import add_product, factor_rows, product, solve_rows
from cranktrain.dynamics.motion.relative import reactions, relative_compliance, relative_step
from cranktrain.film.laws.films import HELD

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
CYCLING, NOISE = 12, 1.0e-5
"""Iterations after which steps below NOISE count as converged: forces of films that are solved in place jump a little
as nodes rupture, and an iteration may go to and fro over a jump for ever, at any step."""
ROTATION_SCALE = 1.0e-2
STANDING_SCALE = 4.0e-3
"""Rotation (rad) and displacement of what stands (m) that count as much as a clearance: they go without tangent, and
what they miss is felt by a film at a hundredth."""
COUPLING_TOLERANCE = 1.0e-10
COUPLING_LENGTH = 1.0e-6
"""What the frame's speed away from Ω₀ couples is iterated until it changes accelerations by less than this share of
the largest, or modal displacements (m √kg) by less than the tolerance times a length small beside clearances."""

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
    t = int(model.layout[TURNING_MODES])
    turning = model.ports.shape[0]
    m = int(model.layout[PORTS])
    s = model.block_ports.shape[1]
    pistons = int(model.layout[PISTONS]) if model.layout[PISTONS] > 0.0 else m
    n_newton = model.scales.shape[0]
    journals = 2 * model.bearings.shape[0]
    ratio = c_v / c_q
    cos = frame[COS]
    sin = frame[SIN]
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
    # On rigid ground the journals' own compliance is the relative one.
    compliance = work.turning.compliance[level]
    if model.pairs.shape[0] > 0:
        compliance = work.relative
        relative_compliance(model, cos, sin, work.turning.compliance[level], work.block.compliance[level], compliance)
    # Tangents that belong to the factored matrix; the linearised forces must use the same.
    blocks = work.held
    external_force(model, frame, pressures, big_q, base)
    twist = 0.0
    for i in range(n):
        back = ratio * big_q[i] - big_v[i]
        base[i] += big_q[i] / c_q + model.damping[i] * back
        lever[i] = back
        a[i] = a_guess[i]
    for i in range(t):
        twist += model.shaft[i] * lever[i]
    twist *= model.scalars[SHAFT_C]
    for i in range(t):
        base[i] += twist * model.shaft[i]
    if s > 0:
        add_product(model.block.damping, lever[t:], s, s, base[t:])
    for k in range(m):
        u[k] = guess[k]
    d_omega = frame[WHIRL] - omega_0
    d_omega2 = frame[WHIRL] * frame[WHIRL] - omega_0 * omega_0
    coupling = 2.0 * abs(d_omega) * c_v + (abs(d_omega2) + abs(frame[OMEGA_DOT])) * c_q
    for c in range(work.guides.shape[0]):
        for j in range(3):
            work.guides[c, j] = 0.0
    iterations = 0
    previous = -1.0
    contraction = min(MOST_CONTRACTION, 2.0 * state[CONTRACTION])
    measured = False
    for sweep in range(4):
        for i in range(n):
            rhs[i] = base[i]
        # What S holds of 2Ω₀G and what it lacks, in one product.
        for i in range(t):
            lever[i] = 2.0 * omega_0 * (ratio * big_q[i] - big_v[i])
            lever[i] -= 2.0 * d_omega * (big_v[i] + c_v * a[i]) + frame[OMEGA_DOT] * (big_q[i] + c_q * a[i])
        add_product(model.gyroscopic, lever, t, t, rhs)
        if coupling > 0.0 and d_omega2 != 0.0:
            for i in range(t):
                lever[i] = -d_omega2 * (big_q[i] + c_q * a[i])
            add_product(model.spin, lever, t, t, rhs)
        product(work.turning.inverse[level], rhs, t, t, q_free)
        if s > 0:
            product(work.block.inverse[level], rhs[t:], s, s, q_free[t:])
        for i in range(t + s, n):
            q_free[i] = c_q * rhs[i]
        to_ports(model, q_free, u_free)
        if sweep > 0:
            # A small change of the load: the last Newton matrix and the linearised forces still hold.
            for k in range(m):
                step[k] = u_free[k] - u[k]
            answer(model, work, level, f, step)
            relative_step(model, cos, sin, step)
            solve_rows(jacobian, n_newton, step)
            linearise(model.connections, blocks, step, f)
            reactions(model, cos, sin, f)
            for k in range(pistons):
                u[k] = u_free[k]
            answer(model, work, level, f, u)
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
            if port_forces(model, work, frame, pressures, c_q, c_v) != 0:
                return DIVERGED
            # Residual u_free + H f − u, then (I − H J) δ = r on the Newton ports.
            for k in range(m):
                step[k] = u_free[k] - u[k]
            answer(model, work, level, f, step)
            relative_step(model, cos, sin, step)
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
            if model.layout[RODS] > 0.0:
                # A pin in its floating big end is a journal too.
                rod = int(model.layout[RODS])
                for k in range(2 * model.cylinders.shape[0]):
                    journal = max(journal, abs(step[rod + k] - step[journals + 1 + k]) / model.scales[rod + k])
            limit = JOURNAL_STEP / journal if journal > JOURNAL_STEP else 1.0
            linearise(model.connections, blocks, step, f)
            reactions(model, cos, sin, f)
            # With f + Jδ the ports follow, all of them; what no tangent foresaw shows in how far they go besides.
            # Guided pistons stay where their own solution put them.
            for k in range(pistons):
                work.port[9, k] = u[k]
                u[k] = u_free[k]
            answer(model, work, level, f, u)
            if limit == 1.0:
                rotation = 0.0
                for k in range(n_newton, turning):
                    rotation = max(rotation, abs(u[k] - work.port[9, k]) / ROTATION_SCALE)
                for k in range(turning, pistons):
                    rotation = max(rotation, abs(u[k] - work.port[9, k]) / STANDING_SCALE)
                size = max(size, rotation)
            else:
                for k in range(pistons):
                    u[k] = work.port[9, k] + limit * (u[k] - work.port[9, k])
            if previous > 0.0 and limit == 1.0:
                contraction = min(0.9, size / previous)
                if not measured:
                    state[CONTRACTION] = max(
                        LEAST_CONTRACTION, min(MOST_CONTRACTION, max(contraction, 0.7 * state[CONTRACTION]))
                    )
                measured = True
            previous = size if limit == 1.0 else -1.0
            converged = limit == 1.0 and (contraction / (1.0 - contraction) * size <= tolerance or size < ROUNDING)
            if limit == 1.0 and iterations >= CYCLING and size <= NOISE:
                converged = True
        for i in range(n):
            q[i] = q_free[i]
        add_product(work.turning.response[level], f, turning, t, q)
        if s > 0:
            add_product(work.block.response[level], f[turning:], pistons - turning, s, q[t:])
        if pistons < m:
            shape = model.block.piston_shape
            for c in range(0, m - pistons, 2):
                q[t + s + c] += c_q * (shape[0, 0] * f[pistons + c] + shape[1, 0] * f[pistons + c + 1])
                q[t + s + c + 1] += c_q * (shape[0, 1] * f[pistons + c] + shape[1, 1] * f[pistons + c + 1])
        moved = 0.0
        for i in range(n):
            new = (q[i] - big_q[i]) / c_q
            moved = max(moved, abs(new - a[i]))
            a[i] = new
            v[i] = big_v[i] + c_v * new
        largest = 1.0e-30
        for i in range(n):
            largest = max(largest, abs(a[i]))
        rest = coupling * moved
        if rest <= COUPLING_TOLERANCE * largest or c_q * rest <= COUPLING_LENGTH * tolerance:
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
def to_ports(model, q, u):
    """Motion (m,) of all ports in the modal motion q (n,)."""
    t = int(model.layout[TURNING_MODES])
    turning = model.ports.shape[0]
    product(model.ports_transposed, q, t, turning, u)
    block, s = model.block_ports.shape
    if block > 0:
        product(model.block_ports_transposed, q[t:], s, block, u[turning:])
    shape = model.block.piston_shape
    first = turning + block
    for c in range(0, int(model.layout[PORTS]) - first, 2):
        x = q[t + s + c]
        y = q[t + s + c + 1]
        u[first + c] = shape[0, 0] * x + shape[0, 1] * y
        u[first + c + 1] = shape[1, 0] * x + shape[1, 1] * y


@kernel
def answer(model, work, level, f, u):
    """Add what crank and block answer to forces f (m,) at their ports to u (m,): u += H f. Pistons stay."""
    turning = model.ports.shape[0]
    add_product(work.turning.compliance[level], f, turning, turning, u)
    block = model.block_ports.shape[0]
    if block > 0:
        add_product(work.block.compliance[level], f[turning:], block, block, u[turning:])


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
