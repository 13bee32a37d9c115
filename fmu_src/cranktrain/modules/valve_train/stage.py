"""One implicit stage: accelerations that balance camshaft and valves at the stage's end, by Newton's method.

With X = x̂ + (γh)² A and V = v̂ + γh A the spring's modes are linear in A and are eliminated first, so each line has
one unknown. The lines are coupled through the camshaft only and are eliminated next, so one equation for the camshaft
remains. The cost of an iteration is one evaluation of every line.
"""

from cranktrain.core.kernel import kernel
from cranktrain.modules.valve_train import slots as at
from cranktrain.modules.valve_train.line import drive_torque, follow_cam, friction_arm, seat_force, train_force

OK, UNSOLVED = 0, 1
MOST_ITERATIONS = 12
"""Iterations after which a stage has failed and the step is shortened."""
SOLVED = 1.0e-3
"""Largest correction of the velocities at convergence, over the tolerance of a step."""


@kernel
def open_stage(model, work, gh):
    """Compute the linear part of each row's equation from its predicted position and velocity; eliminate the modes."""
    n = model.numbers
    for i in range(work.rows.shape[0]):
        row = work.rows[i]
        row[at.R_X_HAT] = row[at.R_X] + gh * row[at.R_V]
        row[at.R_V_HAT] = row[at.R_V]
        mass = model.cams[i % 2, at.MASS] + gh * gh * n[at.RATE]
        load = n[at.PRELOAD] + n[at.RATE] * row[at.R_X_HAT]
        for k in range(at.MODES):
            c, s = n[at.MODAL_DAMPING + k], n[at.MODAL_STIFFNESS + k]
            own = n[at.MODAL_MASS] + gh * (c + gh * s)
            row[at.R_B + k] = -(c * row[at.R_W + k] + s * (row[at.R_Q + k] + gh * row[at.R_W + k])) / own
            mass -= n[at.COUPLING + k] ** 2 / own
            load += n[at.COUPLING + k] * row[at.R_B + k]
        row[at.R_LINEAR] = mass
        row[at.R_CONSTANT] = load
    shaft = work.shaft
    shaft[at.S_ANGLE_HAT] = shaft[at.S_ANGLE] + gh * shaft[at.S_SPEED]
    shaft[at.S_SPEED_HAT] = shaft[at.S_SPEED]


@kernel
def close_stage(model, work, gh):
    """Compute positions and velocities at the end of the stage from its accelerations, spring modes included."""
    n = model.numbers
    for i in range(work.rows.shape[0]):
        row = work.rows[i]
        row[at.R_X] = row[at.R_X_HAT] + gh * gh * row[at.R_A]
        row[at.R_V] = row[at.R_V_HAT] + gh * row[at.R_A]
        for k in range(at.MODES):
            c, s = n[at.MODAL_DAMPING + k], n[at.MODAL_STIFFNESS + k]
            own = n[at.MODAL_MASS] + gh * (c + gh * s)
            row[at.R_B + k] -= n[at.COUPLING + k] / own * row[at.R_A]
            row[at.R_Q + k] += gh * (row[at.R_W + k] + gh * row[at.R_B + k])
            row[at.R_W + k] += gh * row[at.R_B + k]
    move_shaft(work.shaft, gh)


@kernel
def move_shaft(shaft, gh):
    """Compute angle and speed of the camshaft from its present acceleration."""
    shaft[at.S_ANGLE] = shaft[at.S_ANGLE_HAT] + gh * gh * shaft[at.S_ALPHA]
    shaft[at.S_SPEED] = shaft[at.S_SPEED_HAT] + gh * shaft[at.S_ALPHA]


@kernel
def solve_stage(model, work, gh):
    """Solve the stage prepared by ``open_stage`` with the previous accelerations as initial guess. Return a status."""
    n, shaft = model.numbers, work.shaft
    enough = SOLVED * n[at.TOLERANCE] * n[at.VELOCITY]
    for _ in range(MOST_ITERATIONS):
        move_shaft(shaft, gh)
        rest, tangent = shaft_balance(n, shaft, gh)
        # The correction of a line is −(own residual + slope Δα); both parts are stored in its row.
        for i in range(work.rows.shape[0]):
            by_line, by_shaft = line_balance(model, work.rows[i], i % 2, shaft, gh)
            rest += by_line
            tangent += by_shaft
        change = -rest / tangent
        shaft[at.S_ALPHA] += change
        largest = abs(change) * gh * n[at.DRIVE_RADIUS]
        for i in range(work.rows.shape[0]):
            row = work.rows[i]
            step = row[at.R_CORRECTION] + row[at.R_BY_SHAFT] * change
            row[at.R_A] += step
            largest = max(largest, abs(step) * gh)
        if largest <= enough:
            return OK
    return UNSOLVED


@kernel
def shaft_balance(n, shaft, gh):
    """Residual of the camshaft's equation of motion without cams, N m, and its derivative by the acceleration."""
    lead, rate = shaft[at.S_CRANK_ANGLE] - shaft[at.S_ANGLE], shaft[at.S_CRANK_SPEED] - shaft[at.S_SPEED]
    torque, by_lead, by_rate = drive_torque(n, lead, rate)
    shaft[at.S_TORQUE] = torque
    rest = n[at.INERTIA] * shaft[at.S_ALPHA] + n[at.DRAG] * shaft[at.S_SPEED] - torque
    return rest, n[at.INERTIA] + gh * (n[at.DRAG] + by_rate + gh * by_lead)


@kernel
def line_balance(model, row, kind, shaft, gh):
    """Contribution of a line, after elimination of its own correction, to the camshaft's residual and derivative.

    The row receives the correction of the line's acceleration at fixed camshaft, and its derivative by the camshaft's.
    """
    n = model.numbers
    row[at.R_X] = row[at.R_X_HAT] + gh * gh * row[at.R_A]
    row[at.R_V] = row[at.R_V_HAT] + gh * row[at.R_A]
    seat, seat_depth, seat_rate = seat_force(n, row)
    row[at.R_SEAT] = seat
    rest = row[at.R_LINEAR] * row[at.R_A] + row[at.R_CONSTANT] - seat
    slope = row[at.R_LINEAR] + gh * (seat_rate + gh * seat_depth)
    follow_cam(model.cams[kind], row, shaft[at.S_ANGLE])
    force, by_depth, by_rate, first, second = train_force(n, row, shaft[at.S_SPEED])
    row[at.R_FORCE] = force
    row[at.R_BY_SHAFT] = 0.0
    if force <= 0.0:
        row[at.R_CORRECTION] = -rest / slope
        return 0.0, 0.0
    friction, by_lift, by_speed = friction_arm(n, row[at.R_LIFT], shaft[at.S_SPEED])
    arm = first + friction
    row[at.R_ARM] = friction
    rest -= force
    by_line = gh * (by_rate + gh * by_depth)
    slope += by_line
    by_shaft = gh * (by_rate * (first + gh * second * shaft[at.S_SPEED]) + gh * by_depth * first)
    torque = force * arm
    own = by_shaft * arm + gh * force * (by_speed + gh * (second + by_lift * row[at.R_SLOPE]))
    row[at.R_CORRECTION] = -rest / slope
    row[at.R_BY_SHAFT] = by_shaft / slope
    # The line's correction is ΔA = −rest/slope + by_shaft/slope Δα; its torque decreases by by_line arm ΔA.
    return torque + by_line * arm * rest / slope, own - by_line * arm * by_shaft / slope
