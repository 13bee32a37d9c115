"""The running model as a compiled right-hand side ẏ = f(t, y), for solvers that know nothing of its structure.

y = [q, q̇, δ, w]: modal position and velocity, lead of the frame and its rate; where the drive line holds the crank
along its axis also [s, z]: deflection z of the joint's teeth, and ṡ = z, so that methods of second order have a place.
The shaft turns at constant speed, the gas is the built-in trace. The rods' mass sits on the pins, so M(y) = I − Pᵀ A P
with P the motion of the pins where they are and A ≤ 0 the rods' ∂f/∂a; the acceleration of the pins w = P a then
follows from 2 equations per pin,

    (1 − P Pᵀ A) w = P a₀ + P Pᵀ F₀,     a = a₀ + Pᵀ (F₀ + A w).

Force laws and trace are the product's kernels; what is written anew is the assembly, without any stage or tangent.
It knows what the smaller models have: a crank on ground, rigid big ends and pistons, main bearings that do not feel
tilt, a given speed, no damper.

The equations are at an address (:func:`cranktrain.core.kernel.call_kernel`) as ``rate(*data, t, y, out)`` and their
Jacobian as ``differences(*data, t, y, out)``, with ``data`` = (model, scratch, speed, angle at t = 0).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import kernel, kernel_address, law_kernel
from cranktrain.core.lanes import four, put_four
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import joint_row, turning_ports
from cranktrain.dynamics.model.records import ModelArrays, dimensions
from cranktrain.dynamics.model.state import (
    LEAD_ANGLE,
    LEAD_SPEED,
    POSITION,
    SHAFT_ANGLE,
    TIME,
    VELOCITY,
    offset,
)
from cranktrain.dynamics.motion.crank_pin import accelerate, in_space, pin_motion, tell_twist
from cranktrain.dynamics.motion.equations import external_force
from cranktrain.dynamics.motion.film_memory import memory_offset
from cranktrain.dynamics.motion.gas import gas_force, trace_pressure
from cranktrain.dynamics.motion.law_forces import hand_forces
from cranktrain.dynamics.motion.law_motion import place_journal, tell_journal
from cranktrain.dynamics.motion.linear_algebra import add_product, dot, factor_lu, product, solve_lu
from cranktrain.dynamics.simulation import Simulation
from cranktrain.film.laws.axial_joint import DEFLECTION, LEAST_LIMIT, SLIP, WINDUP_TORQUE, axial_joint
from cranktrain.film.laws.films import (
    FORCE,
    MASS,
    WHIRL,
    WHIRL_CHANGE,
    film_call,
)
from cranktrain.film.laws.parameters import CLEARANCE
from cranktrain.film.laws.register import bearing_law
from cranktrain.loads.drive_line import RECENTRING_REVOLUTIONS
from cranktrain.loads.slider_crank import BY_ACCELERATION, rod_force
from cranktrain.loads.torsional_line import DAMPING, STIFFNESS

PLACE, PACE, FORCES = range(3)
TURNING = 5
"""The rigid mode that turns the crank."""


class Scratch(NamedTuple):
    """Memory of one evaluation; ``coupling`` is Φ Φᵀ over the pins' ports, (3p, 3p)."""

    frame: Array
    port: Array  # (3, m) rows PLACE to FORCES: u, u̇, f
    modal: Array  # (2, n)
    out: Array
    coupling: Array
    arms: Array  # (p, 2)
    levers: Array  # (p, 2)
    mass: Array  # (p, 4) ∂F/∂a
    force: Array  # (p, 2)
    matrix: Array  # (2p, 2p)
    pivots: Array
    rhs: Array
    row: Array
    increments: Array  # (size,) of the unknowns in the Jacobian's differences
    base: Array  # (size,)
    joint: Array  # (3,) constants of the axial joint; empty without one


class FirstOrder:
    """Right-hand side, Jacobian by compiled differences, and start values of a simulation that was just initialised.

    Attributes
    ----------
    data : what the kernels take before time, unknowns and result
    rate_address, jacobian_address : of the kernels
    evaluations : calls from Python so far, those inside a Jacobian not counted

    Raises
    ------
    InputError
        for a model with more than these equations know
    """

    def __init__(self, simulation: Simulation) -> None:
        refuse_other_models(simulation)
        model: ModelArrays = simulation.model
        d = dimensions(model)
        n, m, p = d.modes, d.ports, d.cylinders
        state = simulation.state
        speed = float(simulation.inputs[0])
        first, turns = (model.cylinders[:, slot].astype(int) for slot in (at.PIN_PORT, at.PIN_TURN))
        pins = np.concatenate((model.ports[np.add.outer(first, (0, 1)).ravel()], model.ports[turns]))
        z = np.zeros
        path = simulation.engine.axial_path if d.joint >= 0 else None
        size = 2 * n + (2 if path is None else 4)
        scratch = Scratch(
            z(at.FRAME_SIZE), z((3, m)), z((2, n)), z(64), np.ascontiguousarray(pins @ pins.T), z((p, 2)), z((p, 2)),
            z((p, 4)), z((p, 2)), z((2 * p, 2 * p)), z(2 * p), z(2 * p), z(3 * p), z(size), z(size),
            z(0) if path is None else axial_joint(path).constants,
        )  # fmt: skip
        scratch.frame[at.AXIAL_FORCE] = simulation.inputs[p + at.AXIAL_INPUT]
        self.modes = n
        self.clearances = np.ascontiguousarray(model.bearings[:, CLEARANCE])
        self.data = (model, scratch, speed, float(state[SHAFT_ANGLE] - speed * state[TIME]))
        y = self.start(state)
        self.rate_address = kernel_address(rate, *self.data, 0.0, y, np.empty_like(y))
        self.jacobian_address = kernel_address(differences, *self.data, 0.0, y, np.empty((y.size, y.size)))
        self.evaluations = 0

    @property
    def increments(self) -> Array:
        """Increments (size,) of the unknowns in the Jacobian's differences; set in place."""
        return self.data[1].increments

    def start(self, state: Array) -> Array:
        """Unknowns (size,) of a state of the simulation."""
        model, scratch, n = self.data[0], self.data[1], self.modes
        q, v = offset(POSITION, n), offset(VELOCITY, n)
        joint = [0.0, state[memory_offset(model, dimensions(model).joint) + DEFLECTION]] if scratch.joint.size else []
        return np.concatenate([state[q : q + n], state[v : v + n], state[[LEAD_ANGLE, LEAD_SPEED]], joint])

    def __call__(self, t: float, y: Array) -> Array:
        """Derivative of the unknowns."""
        self.evaluations += 1
        out = np.empty_like(y)
        rate(*self.data, t, y, out)
        return out

    def jacobian(self, t: float, y: Array) -> Array:
        """∂f/∂y by forward differences whose increments follow the unknowns' magnitudes in ``increments``."""
        out = np.empty((y.size, y.size))
        differences(*self.data, t, y, out)
        return out.T

    def quantities(self, y: Array) -> Array:
        """Pulley torsion, its axial motion and each main's least film, (2 + b, samples), of unknowns (size, samples).

        The film of a main is 0 where the journal's middle lies beyond its clearance circle.
        """
        model, q = self.data[0], y[: self.modes]
        b = self.clearances.size
        across = (model.ports[: 2 * b] @ q).reshape(b, 2, -1)
        films = np.maximum(self.clearances[:, None] - np.hypot(across[:, 0], across[:, 1]), 0.0)
        return np.concatenate((model.ends[at.PULLEY_ROTATION : at.PULLEY_AXIAL + 1] @ q, films))


def refuse_other_models(simulation: Simulation) -> None:
    """Raise ``InputError`` where the simulation holds more than these equations know."""
    chosen = simulation.settings
    if simulation.engine.drive_line_chain is not None:
        raise InputError("first-order equations know one shaft to the dynamometer only, no discs; leave them out")
    if any(simulation.engine.additions):
        raise InputError("first-order equations know no added bodies or connections; leave them out")
    for value, known in (
        (chosen.block, "ground"), (chosen.big_ends, "rigid"), (chosen.pistons, "rigid"), (chosen.damper, "none"),
        (chosen.boundary, "speed"),
    ):  # fmt: skip
        if value != known:
            raise InputError(f"first-order equations know '{known}' only, not '{value}'; use the stage solver")
    law = bearing_law(chosen.bearings)
    if law.tilt or not law.carries:
        raise InputError(
            f"first-order equations know bearings without tilt only, not '{chosen.bearings}'; use linear or impedance"
        )


@law_kernel
def rate(model, s, speed, angle0, t, y, out):
    """Fill ``out`` (size,) with ẏ; 0."""
    n = model.omega2.shape[0]
    m = turning_ports(model)
    q = y[:n]
    v = y[n : 2 * n]
    a = out[n : 2 * n]
    _place_frame(model, s.frame, speed, angle0 + speed * t, y)
    out[2 * n] = s.frame[at.LEAD_RATE]
    out[2 * n + 1] = s.frame[at.OMEGA_DOT]
    for i in range(n):
        out[i] = v[i]
    _body_acceleration(model, s, q, v, a)
    product(model.bodies.transposed, q, n, m, s.port[PLACE])
    product(model.bodies.transposed, v, n, m, s.port[PACE])
    _bearing_forces(model, s)
    if s.joint.shape[0] > 0:
        out[2 * n + 2] = y[2 * n + 3]
        out[2 * n + 3] = _joint_force(model, s, y[2 * n + 3])
    _rod_forces(model, s)
    for k in range(m):
        force = s.port[FORCES, k]
        if force != 0.0:
            for i in range(n):
                a[i] += force * model.bodies.shapes[k, i]
    _add_rod_masses(model, s, a)
    return 0


@kernel
def _place_frame(model, frame, speed, angle, y):
    """The frame's angle, speed and acceleration at the unknowns ``y`` into ``frame``; ``angle`` of the even speed."""
    n = model.omega2.shape[0]
    inverse = speed / (2.0 * math.pi * RECENTRING_REVOLUTIONS)
    frame[at.LEAD] = y[2 * n]
    frame[at.LEAD_RATE] = y[2 * n + 1]
    frame[at.THETA] = angle + frame[at.LEAD]
    frame[at.OMEGA] = speed + frame[at.LEAD_RATE]
    frame[at.OMEGA_DOT] = (
        4.0 * inverse * (inverse * model.scalars[at.RIGID_ROTATION] * y[TURNING] - frame[at.LEAD_RATE])
    )
    frame[at.WHIRL] = frame[at.OMEGA]
    frame[at.COS] = math.cos(frame[at.THETA])
    frame[at.SIN] = math.sin(frame[at.THETA])


@kernel
def _body_acceleration(model, s, q, v, a):
    """Modal acceleration (n,) without bearings and rods into ``a``."""
    n = q.shape[0]
    frame = s.frame
    omega = frame[at.OMEGA]
    external_force(model, frame, q, a)
    for k in range(model.shafts.shape[0]):
        law = model.shaft_laws[k]
        torque = law[STIFFNESS] * dot(model.shafts[k], q, n) + law[DAMPING] * dot(model.shafts[k], v, n)
        for i in range(n):
            a[i] -= torque * model.shafts[k, i]
    for i in range(n):
        a[i] -= model.omega2[i] * q[i] + model.damping[i] * v[i]
        s.modal[0, i] = -2.0 * omega * v[i] - frame[at.OMEGA_DOT] * q[i]
        s.modal[1, i] = -omega * omega * q[i]
    add_product(model.bodies.gyroscopic, s.modal[0], n, n, a)
    add_product(model.bodies.spin, s.modal[1], n, n, a)


@kernel
def _bearing_forces(model, s):
    """Forces of main and thrust bearings at their ports into ``s.port``."""
    u = s.port[PLACE]
    ud = s.port[PACE]
    f = s.port[FORCES]
    laws = model.laws
    for k in range(f.shape[0]):
        f[k] = 0.0
    for k in range(model.connections.shape[0]):
        if laws.traits[k, MASS] == 0.0 and k != joint_row(model):
            place_journal(model, k, u, ud, s.frame[at.WHIRL])
            tell_journal(model, s.frame, k, u, ud)
            film_call(laws, FORCE, k, laws.out, laws.out)
            hand_forces(model.connections[k], s.frame, laws.out, u, f)


@kernel
def _joint_force(model, s, z):
    """Force of the axial joint at deflection ``z`` into ``s.port``; ż."""
    k = joint_row(model)
    place_journal(model, k, s.port[PLACE], s.port[PACE], 0.0)
    tell_journal(model, s.frame, k, s.port[PLACE], s.port[PACE])
    place = model.laws.place[k]
    slip_rate = model.laws.velocity[k, SLIP]
    rate = slip_rate
    if s.joint[2] < 0.0:
        z = place[SLIP]
    else:
        limit = s.joint[2] * abs(place[WINDUP_TORQUE]) + LEAST_LIMIT
        rate -= s.joint[0] * abs(slip_rate) * z / limit
    s.port[FORCES, model.connections[k, at.FIRST]] = -s.joint[0] * z - s.joint[1] * rate
    return rate


@kernel
def _rod_forces(model, s):
    """Rods' forces at rest against the pins into ``s.port``, and by the pins' acceleration into ``s.mass``."""
    theta = s.frame[at.THETA]
    f = s.port[FORCES]
    r = s.out
    numbers = model.laws.numbers
    numbers[WHIRL], numbers[WHIRL_CHANGE] = s.frame[at.OMEGA], s.frame[at.OMEGA_DOT]
    for k in range(model.cylinders.shape[0]):
        rod = model.cylinders[k]
        # With ü = 0: the force without the pin's relative acceleration.
        first = int(rod[at.PIN_PORT])
        phi = s.port[PLACE, int(rod[at.PIN_TURN])]
        tell_twist(phi, s.port[PACE, int(rod[at.PIN_TURN])], 0.0, numbers)
        place, velocity = model.laws.place[int(rod[at.PIN_ROW])], model.laws.velocity[int(rod[at.PIN_ROW])]
        vx, vy = s.port[PACE, first], s.port[PACE, first + 1]
        in_space(s.port[PLACE, first], s.port[PLACE, first + 1], vx, vy, numbers[WHIRL], place, velocity)
        accelerate(vx, vy, 0.0, 0.0, place, numbers)
        x, y, vx, vy, ax, ay, more_x, more_y = pin_motion(model.pins[k], place, velocity, numbers)
        # A force acts at the lever of the whole displacement; turning alone carries the pin along.
        lever_x, lever_y = x - model.pins[k, 0], y - model.pins[k, 1]
        s.levers[k, 0] = lever_x
        s.levers[k, 1] = lever_y
        s.arms[k, 0] = more_x - phi * model.pins[k, 1]
        s.arms[k, 1] = more_y + phi * model.pins[k, 0]
        cos = math.cos(theta - rod[at.BANK])
        sin = math.sin(theta - rod[at.BANK])
        turn = math.atan2(model.pins[k, 0] * y - model.pins[k, 1] * x, model.pins[k, 0] * x + model.pins[k, 1] * y)
        pressure = trace_pressure(model, k, theta + turn, s.frame[at.OMEGA] - s.frame[at.LEAD_RATE])
        gas = gas_force(rod, model.scalars, pressure)
        g = model.scalars[at.GRAVITY]
        rod_force(
            cos * x - sin * y, sin * x + cos * y, cos * vx - sin * vy, sin * vx + cos * vy, cos * ax - sin * ay,
            sin * ax + cos * ay, gas, rod[at.ROD], rod[at.M_BIG], rod[at.M_OSC], rod[at.DELTA_J], rod[at.OFFSET],
            g * math.sin(rod[at.BANK]), g * math.cos(rod[at.BANK]), r,
        )  # fmt: skip
        force_x = cos * r[0] + sin * r[1]
        force_y = cos * r[1] - sin * r[0]
        f[first] = force_x
        f[first + 1] = force_y
        f[int(rod[at.PIN_TURN])] = lever_x * force_y - lever_y * force_x
        xx, xy, yx, yy = four(r, BY_ACCELERATION)
        mass_xx = cos * cos * xx + cos * sin * (xy + yx) + sin * sin * yy
        mass_xy = cos * cos * xy + cos * sin * (yy - xx) - sin * sin * yx
        mass_yx = cos * cos * yx + cos * sin * (yy - xx) - sin * sin * xy
        put_four(s.mass[k], 0, (mass_xx, mass_xy, mass_yx, cos * cos * yy - cos * sin * (xy + yx) + sin * sin * xx))


@kernel
def _add_rod_masses(model, s, a):
    """Add to the modal acceleration ``a`` = a₀ + Pᵀ F₀ what the rods' mass makes of it: (1 − P Pᵀ A) w = P a."""
    n = a.shape[0]
    p = model.pins.shape[0]
    for k in range(p):
        pin, turn = int(model.cylinders[k, at.PIN_PORT]), int(model.cylinders[k, at.PIN_TURN])
        for axis in range(2):
            i = 2 * k + axis
            arm = -s.arms[k, 1] if axis == 0 else s.arms[k, 0]
            value = 0.0
            for j in range(n):
                value += (model.bodies.shapes[pin + axis, j] + arm * model.bodies.shapes[turn, j]) * a[j]
            s.rhs[i] = value
            for j in range(3 * p):
                s.row[j] = s.coupling[i, j] + arm * s.coupling[2 * p + k, j]
            for j in range(p):
                h0 = s.row[2 * j] - s.levers[j, 1] * s.row[2 * p + j]
                h1 = s.row[2 * j + 1] + s.levers[j, 0] * s.row[2 * p + j]
                xx, xy, yx, yy = four(s.mass[j], 0)
                s.matrix[i, 2 * j] = -h0 * xx - h1 * yx
                s.matrix[i, 2 * j + 1] = -h0 * xy - h1 * yy
            s.matrix[i, i] += 1.0
    factor_lu(s.matrix, 2 * p, s.pivots)
    solve_lu(s.matrix, 2 * p, s.pivots, s.rhs)
    for k in range(p):
        xx, xy, yx, yy = four(s.mass[k], 0)
        fx = xx * s.rhs[2 * k] + xy * s.rhs[2 * k + 1]
        fy = yx * s.rhs[2 * k] + yy * s.rhs[2 * k + 1]
        moment = s.levers[k, 0] * fy - s.levers[k, 1] * fx
        pin, turn = int(model.cylinders[k, at.PIN_PORT]), int(model.cylinders[k, at.PIN_TURN])
        for i in range(n):
            shapes = model.bodies.shapes
            a[i] += fx * shapes[pin, i] + fy * shapes[pin + 1, i] + moment * shapes[turn, i]


@law_kernel
def differences(model, s, speed, angle0, t, y, out):
    """Transposed Jacobian by forward differences: row j is ∂f/∂y_j; 0. ``y`` is left as it was."""
    size = y.shape[0]
    base = s.base
    rate(model, s, speed, angle0, t, y, base)
    for j in range(size):
        kept = y[j]
        y[j] = kept + s.increments[j]
        h = y[j] - kept
        rate(model, s, speed, angle0, t, y, out[j])
        y[j] = kept
        for i in range(size):
            out[j, i] = (out[j, i] - base[i]) / h
    return 0
