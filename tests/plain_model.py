"""The equations of motion once more, in plain NumPy from their documented form: a twin to test the model by.

Nothing here calls the kernels of rods, pins or frame. Oil films, thrust bearing and journal friction are laws with
tests of their own; their kernels are called. Angles rad, SI.
"""

import entry
import numpy as np
from scipy.interpolate import CubicSpline

from cranktrain.core.reduced_body import rigid
from cranktrain.dynamics.model.settings import Settings, resolved
from cranktrain.engine.lubricant import oil_temperature, viscosity
from cranktrain.film.laws.bearings import bearing_parameters, thrust_bearing
from cranktrain.film.laws.impedance import MapFilm, impedance_map, journal_force
from cranktrain.film.laws.parabolic import film_geometry, friction_torque
from cranktrain.film.laws.register import bearing_law
from cranktrain.loads.gas_pressure import GasTrace

RECENTRING_REVOLUTIONS = 2.0


class PlainModel:
    """Crank in the turning frame, shaft at constant speed; state [q, q̇, δ, w], δ and w the frame's lead and its rate.

    Parameters
    ----------
    engine, body, settings : as of the running model, built-in gas trace
    speed : shaft speed, rad/s
    """

    def __init__(self, engine, body, settings=None, speed=200.0):
        self.engine, self.speed = engine, speed
        self.settings = settings = resolved(settings or Settings(), engine)
        self.body = body = rigid(body) if settings.crank == "rigid" else body
        self.n = body.n_modes
        c = engine.crankshaft
        shapes = body.shapes
        mains = [body.index(f"main[{i + 1}]") for i in range(len(c.main_widths))]
        pins = [body.index(f"pin[{i + 1}]") for i in range(len(c.throw_angles))]
        self.main_xy, self.main_turn = shapes[mains, :2], shapes[mains, 5]
        self.pin_xy, self.pin_turn, self.pin_at = shapes[pins, :2], shapes[pins, 5], body.positions[pins, :2]
        self.pins = np.concatenate([self.pin_xy, self.pin_turn[:, None]], axis=1)
        self.collar_shapes = shapes[body.index("thrust"), 2:5]
        self.collar_turn = self.main_turn[engine.thrust.main - 1]
        self.flywheel = shapes[body.index("flywheel"), 5]
        self.rigid_turn = shapes[body.index("pulley"), 5, 5]
        # The file's damping is that of the modes with each rod's big end and half of what oscillates on its pin.
        d, rod = engine.damping, engine.rod
        on_pin = rod.big_end_mass + 0.5 * (rod.small_end_mass + engine.cylinders.piston_mass)
        mass = 1.0 + on_pin * np.sum(self.pin_xy**2, axis=(0, 1))
        self.damping = (
            2 * d.ratio * body.omega * np.sqrt(mass)
            if d.kind == "modal"
            else (d.alpha * mass + d.beta * body.omega**2) * (body.omega > 0)
        )
        gas = GasTrace.from_engine(engine)
        knots = np.arange(gas.motored.size + 1) * (4 * np.pi / gas.motored.size)
        self.motored, self.fired = (
            CubicSpline(knots, np.append(p, p[0]), bc_type="periodic") for p in (gas.motored, gas.fired)
        )
        self.gas = gas
        oil = settings.oil_temperature or oil_temperature(engine.oil, speed)
        self.viscosity = viscosity(engine.oil, oil)
        bearing = engine.main_bearing
        c, kappa2, factor = film_geometry(bearing.diameter, bearing.width, bearing.clearance, self.viscosity)
        contact = 0.5 * bearing.contact_pressure * bearing.width * bearing.diameter
        self.film = MapFilm(c, factor, bearing.contact_height, contact, impedance_map(kappa2))
        self.parameters = bearing_parameters(bearing, self.viscosity)
        law = bearing_law(settings.bearings)
        self.thrust = entry.Law(thrust_bearing(engine.thrust, self.viscosity, law.clearance, not law.square_collar))
        rod, cylinders = engine.rod, engine.cylinders
        self.area = 0.25 * np.pi * cylinders.bore**2
        self.m_big, self.m_osc = rod.big_end_mass, rod.small_end_mass + cylinders.piston_mass
        mass = rod.big_end_mass + rod.small_end_mass
        b = rod.length * rod.small_end_mass / mass
        self.delta_j = rod.inertia - mass * b * (rod.length - b)
        self.length, self.offset = rod.length, cylinders.pin_offset
        self.pin_of = [p - 1 for p in cylinders.pins]
        self.bank, self.phase = np.array(cylinders.bank_angles), np.array(engine.firing_angles)

    def frame(self, t, y, angle=0.0):
        """θ, Ω, Ω̇ of the frame, its lead and lead's rate, at time ``t`` after the shaft stood at ``angle``."""
        lead, rate = y[2 * self.n], y[2 * self.n + 1]
        return angle + self.speed * t + lead, self.speed + rate, self.lead_acceleration(y), lead, rate

    def lead_acceleration(self, y):
        """ẇ of the critically damped re-centring, τ₂ ẇ = φ/τ_c − w."""
        tau_c = 2 * np.pi * RECENTRING_REVOLUTIONS / self.speed
        return (self.rigid_turn * y[5] / tau_c - y[2 * self.n + 1]) / (tau_c / 4)

    def pressures(self, theta, q):
        """Absolute pressure in each cylinder, Pa, by the angle of its own pin about the axis."""
        turns = np.array([np.angle(self.pin(pin, q) / complex(*self.pin_at[pin])) for pin in self.pin_of])
        angle = (theta + turns - self.phase) % (4 * np.pi)
        share = self.settings.gas_load * max(0.0, 1 - self.gas.falloff * (self.speed / self.gas.best_speed - 1) ** 2)
        return self.motored(angle) + share * (self.fired(angle) - self.motored(angle))

    def pin(self, pin, q):
        """Place of a pin in the frame's axes, complex: R(φ) X + (u − φ e_z×X)."""
        x0, phi = complex(*self.pin_at[pin]), self.pin_turn[pin] @ q
        return np.exp(1j * phi) * x0 + complex(*(self.pin_xy[pin] @ q)) - 1j * phi * x0

    def rods(self, theta, omega, omega_dot, q, v, a, pressures):
        """Forces of rods on the pins, and the pistons' motion, at the pins' accelerations ``a`` (p, 3): x, y, rotation.

        Returns (p, 2) forces in the frame's axes, (p,) moments of the pins' rotation, (c, 3) piston position, velocity
        and acceleration along the cylinder.
        """
        force, moment = np.zeros(self.pin_at.shape), np.zeros(len(self.pin_at))
        motion = []
        gravity = self.settings.gravity
        for k, pin in enumerate(self.pin_of):
            phi, phi1, phi2 = self.pin_turn[pin] @ q, self.pin_turn[pin] @ v, a[pin, 2]
            # Complex numbers turn: position in the frame, then the frame's own turning.
            x0, r = complex(*self.pin_at[pin]), self.pin(pin, q)
            u1, u2 = complex(*(self.pin_xy[pin] @ v)), complex(*a[pin, :2])
            turned = np.exp(1j * phi) * x0
            r1 = 1j * phi1 * turned + u1 - 1j * phi1 * x0
            r2 = (1j * phi2 - phi1**2) * turned + u2 - 1j * phi2 * x0
            spin = np.exp(1j * (theta - self.bank[k]))
            position = spin * r
            velocity = spin * (r1 + 1j * omega * r)
            acceleration = spin * (r2 + 2j * omega * r1 + (1j * omega_dot - omega**2) * r)
            x, vx, ax = position.real - self.offset, velocity.real, acceleration.real
            s = np.sqrt(self.length**2 - x**2)
            g = -x / s
            a_p = g * ax + acceleration.imag - vx**2 * self.length**2 / s**3
            upward = gravity * np.exp(1j * (np.pi / 2 - self.bank[k]))
            push = self.m_osc * (a_p + upward.imag) + (pressures[k] - self.settings.crankcase_pressure) * self.area
            fx = -self.m_big * (ax + upward.real) - g * push - self.delta_j * (ax / s**2 + x * vx**2 / s**4)
            fy = -self.m_big * (acceleration.imag + upward.imag) - push
            f = (fx + 1j * fy) / spin
            force[pin] += f.real, f.imag
            moment[pin] += ((r - x0).conjugate() * f).imag
            motion.append((position.imag + s, velocity.imag + g * vx, a_p))
        return force, moment, np.array(motion)

    def journals(self, theta, omega, q, v):
        """Forces on the main journals in the frame's axes (b, 2), friction torques (b,), velocities in space (b, 2)."""
        u, u1 = self.main_xy @ q, self.main_xy @ v
        seen = u1 + omega * np.stack([-u[:, 1], u[:, 0]], axis=1)
        bearing = self.engine.main_bearing
        force, torque = np.zeros_like(u), np.zeros(len(u))
        if self.settings.bearings == "linear":
            turn = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])
            k = turn.T @ np.diag(bearing.ground_stiffness) @ turn
            c = turn.T @ np.diag([bearing.damping_x, bearing.damping_y]) @ turn
            return -u @ k - seen @ c, torque, seen
        out = np.zeros(16)
        for i in range(len(u)):
            spin = omega + self.main_turn[i] @ v
            journal_force(*u[i], *seen[i], 0.5 * spin, self.film, out)
            force[i] = out[:2]
            torque[i] = friction_torque(out[10], out, u[i], self.parameters, spin)
        return force, torque, seen

    def collar(self, theta, omega, q, v):
        """Axial force and moments of the thrust bearing, place and velocity in space of its collar, (3,) each."""
        place, rate = self.collar_shapes @ q, self.collar_shapes @ v
        seen = rate + omega * np.array([0.0, -place[2], place[1]])
        answer = self.thrust(place, seen, speed=omega, cos=np.cos(theta), sin=np.sin(theta))
        return answer.force[:3], place, seen

    def loads(self, frame, q, v):
        """Modal force of everything but the rods, (n,)."""
        theta, omega, omega_dot, lead, rate = frame
        body, drive, g = self.body, self.engine.drive_line, self.settings.gravity
        out = omega**2 * body.centrifugal_load - omega_dot * body.euler_load
        out -= g * (np.sin(theta) * body.translation[0] + np.cos(theta) * body.translation[1])
        twist, twist_rate = lead + self.flywheel @ q, rate + self.flywheel @ v
        out -= (drive.stiffness * twist + drive.damping * twist_rate) * self.flywheel
        force, torque, _ = self.journals(theta, omega, q, v)
        u = self.main_xy @ q
        arms = u[:, 0] * force[:, 1] - u[:, 1] * force[:, 0]
        out += np.einsum("ijk,ij->k", self.main_xy, force) + (torque + arms) @ self.main_turn
        # Gravity on the displaced mass, about the frame's axis.
        x, y = body.translation[:2] @ q
        out[5] += body.shapes[body.index("pulley"), 5, 5] * g * (y * np.sin(theta) - x * np.cos(theta))
        axial, place, _ = self.collar(theta, omega, q, v)
        out += axial @ self.collar_shapes + (place[1] * axial[2] - place[2] * axial[1]) * self.collar_turn
        out -= (self.damping * v) + 2 * omega * body.gyroscopic @ v
        stiffness = omega**2 * (body.stress_stiffness - body.centrifugal) + omega_dot * body.gyroscopic
        return out - body.omega**2 * q - stiffness @ q

    def acceleration(self, t, y, angle=0.0):
        """Modal acceleration (n,): the rods' force is affine in it, M(θ, q) a = loads + rods at a = 0."""
        q, v = y[: self.n], y[self.n : 2 * self.n]
        frame = self.frame(t, y, angle)
        theta, omega, omega_dot = frame[:3]
        pressures = self.pressures(theta, q)

        def rods(a):
            force, moment, _ = self.rods(theta, omega, omega_dot, q, v, a, pressures)
            return np.column_stack([force, moment])

        still = rods(np.zeros((len(self.pin_at), 3)))
        mass = np.eye(self.n)
        for move in np.eye(3):
            # A pin's forces depend on its own motion only: all pins are moved at once.
            share = rods(np.tile(move, (len(self.pin_at), 1))) - still
            mass -= np.einsum("pci,pc,pj->ij", self.pins, share, self.pins.transpose(1, 0, 2)[move.argmax()])
        return np.linalg.solve(mass, self.loads(frame, q, v) + np.einsum("pci,pc->i", self.pins, still))

    def rate(self, t, y, angle=0.0):
        """ẏ for a general integrator."""
        v = y[self.n : 2 * self.n]
        return np.concatenate([v, self.acceleration(t, y, angle), [y[2 * self.n + 1], self.lead_acceleration(y)]])
