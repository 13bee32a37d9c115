"""The stage solver: one implicit stage of any integrator, condensed onto the ports.

Given Q and V with q = Q + c_q a, v = V + c_v a, it finds the true acceleration a that fulfils the equations of motion.
It finds q_free by S⁻¹, iterates the ports' displacements u = u_free + Φ S⁻¹ Φᵀ f(u, u̇, ü) by Newton's method, and gets
q by one product. Terms that S lacks because the frame turns at Ω ≠ Ω₀ are iterated too. The last Newton step is taken
with linearised forces, whose error the contraction estimate bounds.
"""

from typing import NamedTuple

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import (
    block_modes,
    block_port_count,
    couples_modes,
    first_piston,
    of_ports,
    port_count,
    term_row,
    turning_modes,
    turning_ports,
)
from cranktrain.dynamics.model.state import CONTRACTION
from cranktrain.dynamics.motion.bodies import add_response, load_others, move_freely, to_ports
from cranktrain.dynamics.motion.equations import external_force, port_forces
from cranktrain.dynamics.motion.gas import encoder_end
from cranktrain.dynamics.motion.linear_algebra import add_columns, add_product, dot
from cranktrain.dynamics.motion.links import follow_links, link_compliance, link_size, link_steps
from cranktrain.dynamics.motion.newton_matrix import factor_newton, solve_step
from cranktrain.dynamics.motion.relative import move_axis, reactions, relative_compliance, relative_step
from cranktrain.dynamics.motion.turned_pins import turn_pins, turned, turned_compliance, turned_step, turned_torque
from cranktrain.dynamics.time.status import DIVERGED, FILM_FAILED, OK, SINGULAR
from cranktrain.dynamics.time.work_limit import LAST_ITERATIONS, LOOSE, ROUGH, cut_short
from cranktrain.dynamics.topology import slots as top
from cranktrain.film.laws.films import FROZEN
from cranktrain.loads.torsional_line import DAMPING

MAX_ITERATIONS = 40
JOURNAL_STEP = 0.3
"""Largest change of a journal's position per iteration, as a fraction of the clearance."""
FIRST_CONTRACTION, LEAST_CONTRACTION, MOST_CONTRACTION = 0.02, 1.0e-4, 0.5
"""Initial estimate of the iteration's contraction, and its bounds. A stage that stops after one iteration assumes twice
the contraction measured in earlier stages. Without a measurement the estimate grows by FADING, so that it is measured
again."""
FADING = 1.1
STALE = 0.1
NEAR = 0.1
"""A Newton matrix is kept when the last step was shorter than NEAR and the iteration contracts better than STALE."""
ROUNDING = 1.0e-13
"""Scaled Newton step below which a step is rounding, whatever the tolerance."""
CYCLING, NOISE = 12, 1.0e-4
"""Iterations after which steps below NOISE, in clearances, count as converged. Film forces jump slightly when a node
ruptures (films solved online) or at the edges of a table's pieces, so Newton's method can oscillate between two
states."""
WANDERING, STEADY = 3, 0.75
"""After WANDERING iterations a Newton step that is not shorter than STEADY of the one before is halved, and after two
of them each step above NOISE. Where a journal turns round, the film's force has a kink at rest: tangents on one side
lead across it, and full steps go round in a circle."""
ROTATION_SCALE = 1.0e-2
STATIONARY_SCALE = 4.0e-3
"""Scales of the convergence test: a rotation of 0.01 rad or a block displacement of 4 mm counts like one clearance. The
Newton matrix omits these ports; the error this leaves in a film is about 1 % of their own."""
COUPLING_TOLERANCE = 1.0e-10
COUPLING_LENGTH = 1.0e-6
"""The factors are made for speed Ω₀. Terms that depend on Ω − Ω₀ are iterated until the accelerations change by less
than this fraction of the largest, or modal displacements (m √kg) by less than the tolerance times a length that is
small compared with clearances."""
MORE_SWEEPS = 3
"""Most sweeps of the iteration over terms that depend on Ω − Ω₀."""
UNBOUNDED = 1.0e12
"""Newton step, scaled, at which an iteration has diverged."""


class Stage(NamedTuple):
    """Input of one stage apart from Q and V. Row ``number`` of each workspace array belongs to this stage."""

    number: int
    slot: int  # slot of the factor cache with the factors of c_q, c_v and Ω₀
    c_q: float
    c_v: float
    omega: float  # Ω₀, rad/s
    tolerance: float  # tolerance of the estimated error of the ports, in clearances, 0.1 mm and 0.01 rad
    a_guess: Array  # (n,) initial guess of a, used if the frame's speed differs from Ω₀


@kernel
def solve_stage(model, work, state, stage):
    """Solve one stage of an integrator. Return a status (0: success).

    Q and V are in ``work.modal[BIG_Q]`` and ``[BIG_V]``, at the ports in ``work.port[U_Q]`` and ``[U_V]``, the first
    guess of u in ``work.port[GUESS]``. Fills ``work.stage[number]`` with q, v, a and leaves the ports' u, u̇, ü and
    forces in ``work.port``. ``state`` remembers how well the iteration contracts.
    """
    predict(model, work, stage)
    set_free(model, work, stage)
    status = iterate(model, work, state, stage)
    if status != OK:
        return status
    settled = recover(model, work, stage)
    for _ in range(MORE_SWEEPS):
        if settled:
            break
        set_free(model, work, stage)
        follow_load(model, work, stage)
        settled = recover(model, work, stage)
    port_rates(model, work, stage)
    work.counters[at.N_STAGES] += 1.0
    return OK


@kernel
def predict(model, work, stage):
    """Prepare a stage: its load apart from forces at ports, and the initial guess, used by all iterations and sweeps.

    Fills ``work.modal[BASE]``, ``work.relative`` where the block is flexible, and the guess of a and of u.
    """
    n = model.omega2.shape[0]
    t = turning_modes(model)
    s = block_modes(model)
    frame = work.frames[stage.number]
    ratio = stage.c_v / stage.c_q
    big_q = work.modal[at.BIG_Q]
    big_v = work.modal[at.BIG_V]
    base = work.modal[at.BASE]
    back = work.modal[at.LEVER]
    a = work.stage[stage.number, 2]
    if not of_ports(model):
        compliance = work.linear.compliance[stage.slot]
        relative_compliance(
            model, frame[at.COS], frame[at.SIN], compliance, compliance[turning_ports(model) :], work.relative
        )
        link_compliance(model, work, frame, stage.slot, work.relative)
    move_axis(model, frame, work.port[at.U_Q])
    external_force(model, frame, big_q, base)
    load_others(model, work, frame, big_q, base)
    for i in range(n):
        back[i] = ratio * big_q[i] - big_v[i]
        base[i] += big_q[i] / stage.c_q + model.damping[i] * back[i]
        a[i] = stage.a_guess[i]
    for k in range(model.shafts.shape[0]):
        twist = model.shaft_laws[k, DAMPING] * dot(model.shafts[k], back, t)
        for i in range(t):
            base[i] += twist * model.shafts[k, i]
    if s > 0:
        add_product(model.block.damping, back[t:], s, s, base[t:])
    for k in range(port_count(model)):
        work.port[at.U, k] = work.port[at.GUESS, k]


@kernel
def set_free(model, work, stage):
    """Motion without forces at the ports for the present a, into ``work.modal[Q_FREE]`` and ``work.port[U_FREE]``."""
    move_freely(model, work, stage)
    first = turning_modes(model) + block_modes(model)
    for i in range(first, turning_modes(model) + model.block.preload.shape[0]):
        work.modal[at.Q_FREE, i] = stage.c_q * work.modal[at.BASE, i]
    to_ports(model, work.modal[at.Q_FREE], work.port[at.U_FREE])


@inlined_kernel
def iterate(model, work, state, stage):
    """Solve for u and forces of the ports by Newton's method, into ``work.port``. Return a status (0: success)."""
    contraction = min(MOST_CONTRACTION, 2.0 * state[CONTRACTION])
    measured = False
    previous = -1.0
    last = 0.0
    turns = 0
    iterations = 0
    converged = False
    follows = model.choices[at.ENCODER] != at.PIN and work.frames[stage.number, at.BURN] >= 0.0
    while not converged:
        if iterations == MAX_ITERATIONS:
            work.counters[at.WORST_RESIDUAL] = previous
            return DIVERGED
        if follows and iterations > 0:
            follow_encoder(model, work, stage)
        keep_matrix = 0.0 <= previous <= NEAR and contraction <= STALE
        iterations += 1
        work.counters[at.N_WORK] += 1.0
        status = newton_step(model, work, stage, keep_matrix)
        if status != OK:
            return status
        size, limit = step_size(model, work, work.port[at.U_STEP])
        if not size < UNBOUNDED:
            return DIVERGED
        near = limit == 1.0
        if iterations > WANDERING and near and size > STEADY * last > 0.0:
            turns += 1
        if size > NOISE and turns > 0 and (turns > 1 or size > STEADY * last):
            limit *= 0.5
        last = size if near else 0.0
        size = max(size, take_step(model, work, stage, limit))
        if previous > 0.0 and limit == 1.0:
            contraction = min(0.9, size / previous)
            if not measured:
                state[CONTRACTION] = max(
                    LEAST_CONTRACTION, min(MOST_CONTRACTION, max(contraction, 0.7 * state[CONTRACTION]))
                )
            measured = True
        previous = size if limit == 1.0 else -1.0
        error = contraction / (1.0 - contraction) * size
        converged = limit == 1.0 and (
            error <= stage.tolerance or size < ROUNDING or (iterations >= CYCLING and size <= NOISE)
        )
        if not converged and cut_short(model, work):
            converged = near and error <= LOOSE and size <= ROUGH
            if not converged and iterations >= LAST_ITERATIONS:
                if not near:
                    return DIVERGED
                converged = True
    if not measured:
        state[CONTRACTION] = min(MOST_CONTRACTION, FADING * state[CONTRACTION])
    work.counters[at.N_ITERATIONS] += iterations
    work.counters[at.WORST_RESIDUAL] = max(work.counters[at.WORST_RESIDUAL], contraction * previous)
    return OK


@inlined_kernel
def follow_encoder(model, work, stage):
    """Write the rotation at the encoder in a stage to ``work.frames``, from the forces found so far."""
    q = work.modal[at.LEVER]
    for i in range(q.shape[0]):
        q[i] = work.modal[at.Q_FREE, i]
    add_response(model, work.linear.response[stage.slot], top.MODE, work.port[at.FORCES], q)
    work.frames[stage.number, at.ENCODED] = dot(model.ends[encoder_end(model)], q, turning_modes(model))


@inlined_kernel
def newton_step(model, work, stage, keep_matrix):
    """Evaluate the forces at u and the Newton step of relative motion, ``work.port[U_STEP]``. Return a status (0: OK).

    The residual is r = u_free + H f − u, and (I − H J) δ = r on the Newton ports. ``keep_matrix`` reuses the matrix.
    """
    frame = work.frames[stage.number]
    f = work.port[at.FORCES]
    step = work.port[at.U_STEP]
    port_rates(model, work, stage)
    model.laws.numbers[FROZEN] = 1.0 if keep_matrix else 0.0
    status = port_forces(model, work, frame, work.pressures[stage.number], stage.c_q, stage.c_v)
    model.laws.numbers[FROZEN] = 0.0
    if status != OK:
        return FILM_FAILED
    for k in range(port_count(model)):
        step[k] = work.port[at.U_FREE, k] - work.port[at.U, k]
    add_response(model, work.linear.compliance[stage.slot], top.GROUP_PORT, f, step)
    link_steps(model, work, step)
    if not keep_matrix:
        turn_pins(model, work)
    felt_step(model, work, frame, step)
    if not keep_matrix:
        # The linearised forces must use the tangents that belong to the factored matrix.
        for k in range(work.blocks.shape[0]):
            for j in range(work.blocks.shape[1]):
                work.factored[k, j] = work.blocks[k, j]
        # On rigid ground the compliance of the relative motion is that of the journals.
        compliance = work.linear.compliance[stage.slot]
        if not of_ports(model):
            compliance = work.relative
        if turned(work):
            turning = work.linear.compliance[stage.slot]
            turned_compliance(model, work, turning, compliance, model.scales.shape[0], work.turned_compliance)
            compliance = work.turned_compliance
        if factor_newton(model, compliance, work.factored, work.jacobian) != 0:
            return SINGULAR
    solve_step(model, work)
    return OK


@inlined_kernel
def felt_step(model, work, frame, step):
    """Convert a change of all ports (m,) to the relative motion of connections, in place on the Newton ports."""
    relative_step(model, frame[at.COS], frame[at.SIN], step)
    if turned(work):
        turned_step(model, work, step)


@inlined_kernel
def step_size(model, work, step):
    """Size of a Newton step in units of the ports' scales, and the fraction of this step that journals allow."""
    size = 0.0
    journal = 0.0
    for k in range(model.scales.shape[0]):
        size = max(size, abs(step[k]) / model.scales[k])
    for k in range(model.limited.shape[0]):
        port = int(model.limited[k, 0])
        change = step[port]
        if model.limited[k, 1] >= 0.0:
            change -= step[int(model.limited[k, 1])]
        if abs(change) > JOURNAL_STEP * model.scales[port]:
            journal = max(journal, abs(change) / model.scales[port])
    moved, limited = link_size(model, work)
    size = max(size, moved)
    journal = max(journal, limited)
    return size, JOURNAL_STEP / journal if journal > JOURNAL_STEP else 1.0


@inlined_kernel
def take_step(model, work, stage, limit):
    """Move ports by the fraction ``limit`` of a Newton step. Return the largest change of ports without tangents.

    All ports move with the forces f + Jδ. The returned change is scaled, and measures the effect of tangents that the
    Newton matrix omits. Guided pistons keep the motion of their own solution.
    """
    turning = turning_ports(model)
    pistons = first_piston(model)
    u = work.port[at.U]
    before = work.port[at.U_BEFORE]
    for k in range(pistons):
        before[k] = u[k]
    if block_port_count(model) == 0 and of_ports(model) and not turned(work):
        follow_step(model, work, stage)
    else:
        follow_forces(model, work, stage)
    besides = 0.0
    if limit == 1.0:
        for k in range(model.scales.shape[0], turning):
            besides = max(besides, abs(u[k] - before[k]) / ROTATION_SCALE)
        for k in range(turning, pistons):
            besides = max(besides, abs(u[k] - before[k]) / STATIONARY_SCALE)
    else:
        for k in range(pistons):
            u[k] = before[k] + limit * (u[k] - before[k])
    return besides


@inlined_kernel
def follow_load(model, work, stage):
    """Update the ports for a small change of the load, with the last Newton matrix and linearised forces."""
    frame = work.frames[stage.number]
    step = work.port[at.U_STEP]
    for k in range(port_count(model)):
        step[k] = work.port[at.U_FREE, k] - work.port[at.U, k]
    add_response(model, work.linear.compliance[stage.slot], top.GROUP_PORT, work.port[at.FORCES], step)
    link_steps(model, work, step)
    felt_step(model, work, frame, step)
    solve_step(model, work)
    follow_forces(model, work, stage)


@kernel
def follow_forces(model, work, stage):
    """Update forces f += J δ by a Newton step δ, then u = u_free + H f of all ports except guided pistons."""
    frame = work.frames[stage.number]
    f = work.port[at.FORCES]
    if turned(work):
        change = work.port[at.F_STEP]
        for k in range(change.shape[0]):
            change[k] = 0.0
        linearise(model.connections, work.factored, term_row(model), work.port[at.U_STEP], change)
        turned_torque(model, work, change)
        for k in range(change.shape[0]):
            f[k] += change[k]
    else:
        linearise(model.connections, work.factored, term_row(model), work.port[at.U_STEP], f)
    reactions(model, frame[at.COS], frame[at.SIN], f)
    follow_links(model, work, f)
    for k in range(first_piston(model)):
        work.port[at.U, k] = work.port[at.U_FREE, k]
    add_response(model, work.linear.compliance[stage.slot], top.GROUP_PORT, f, work.port[at.U])


@inlined_kernel
def follow_step(model, work, stage):
    """Update forces f and displacements u by a Newton step δ on rigid ground, where the Newton ports move by δ.

    This follows from (I − H J) δ = u_free + H f − u. ``work.port[U_STEP]`` holds δ, and then u_free + H f − u of the
    other rotating ports.
    """
    newton = model.scales.shape[0]
    turning = turning_ports(model)
    f = work.port[at.FORCES]
    u = work.port[at.U]
    step = work.port[at.U_STEP]
    change = work.port[at.F_STEP]
    for k in range(newton):
        change[k] = 0.0
    linearise(model.connections, work.factored, term_row(model), step, change)
    for k in range(newton):
        f[k] += change[k]
        u[k] += step[k]
    add_columns(work.linear.compliance[stage.slot], change, newton, newton, turning, step)
    for k in range(newton, turning):
        u[k] += step[k]


@kernel
def recover(model, work, stage):
    """Write the modal motion of all bodies in the stage to ``work.stage[number]``, from the forces at their ports.

    Returns True if the terms by the difference of the frame's speed from Ω₀ have converged.
    """
    n = model.omega2.shape[0]
    t = turning_modes(model)
    s = block_modes(model)
    pistons = first_piston(model)
    frame = work.frames[stage.number]
    c_q = stage.c_q
    f = work.port[at.FORCES]
    q = work.stage[stage.number, 0]
    v = work.stage[stage.number, 1]
    a = work.stage[stage.number, 2]
    for i in range(n):
        q[i] = work.modal[at.Q_FREE, i]
    add_response(model, work.linear.response[stage.slot], top.MODE, f, q)
    shape = model.block.piston_shape
    for c in range(0, port_count(model) - pistons, 2):
        q[t + s + c] += c_q * (shape[0, 0] * f[pistons + c] + shape[1, 0] * f[pistons + c + 1])
        q[t + s + c + 1] += c_q * (shape[0, 1] * f[pistons + c] + shape[1, 1] * f[pistons + c + 1])
    if not couples_modes(model):
        for i in range(n):
            a[i] = (q[i] - work.modal[at.BIG_Q, i]) / c_q
            v[i] = work.modal[at.BIG_V, i] + stage.c_v * a[i]
        return True
    moved = 0.0
    largest = 1.0e-30
    for i in range(n):
        new = (q[i] - work.modal[at.BIG_Q, i]) / c_q
        moved = max(moved, abs(new - a[i]))
        largest = max(largest, abs(new))
        a[i] = new
        v[i] = work.modal[at.BIG_V, i] + stage.c_v * new
    d_omega = abs(frame[at.WHIRL] - stage.omega)
    d_omega2 = abs(frame[at.WHIRL] * frame[at.WHIRL] - stage.omega * stage.omega)
    rest = (2.0 * d_omega * stage.c_v + (d_omega2 + abs(frame[at.OMEGA_DOT])) * c_q) * moved
    fastest = model.bodies.fastest
    rest *= fastest[top.FASTEST] * fastest[top.FASTEST]
    swing = fastest[top.SWING] * frame[at.WHIRL]
    swing2 = fastest[top.SWING2] * frame[at.WHIRL] * frame[at.WHIRL]
    rest += (2.0 * abs(swing) * stage.c_v + (swing * swing + abs(swing2)) * c_q) * moved
    return rest <= COUPLING_TOLERANCE * largest or c_q * rest <= COUPLING_LENGTH * stage.tolerance


@inlined_kernel
def port_rates(model, work, stage):
    """Set velocity u̇ and acceleration ü of the ports from displacement u, by the rule of the stage."""
    u = work.port[at.U]
    u_q = work.port[at.U_Q]
    u_v = work.port[at.U_V]
    ud = work.port[at.UD]
    udd = work.port[at.UDD]
    for k in range(port_count(model)):
        acceleration = (u[k] - u_q[k]) / stage.c_q
        udd[k] = acceleration
        ud[k] = u_v[k] + stage.c_v * acceleration


@kernel
def linearise(connections, blocks, count, step, f):
    """Add J δ to the forces f of the Newton ports, with the tangents J of ``count`` connections and a step δ."""
    for k in range(count):
        size = connections[k, 0]
        for a in range(size):
            change = 0.0
            for b in range(size):
                change += blocks[k, 4 * a + b] * step[connections[k, 1 + b]]
            f[connections[k, 1 + a]] += change
