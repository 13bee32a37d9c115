"""What acts on a whole running engine from outside, and the rate of its momentum, written out from a state.

For rigid big ends, guided pistons and a flexible block. Moments of second order are those of bodies displaced as a
whole: crank and block, with all that acts on them and their inertia, stand where the mean of journals and of bores has
moved. The momentum of rods and pistons is written in closed form on
the path q + v t + a t²/2 and differenced; crank and block are linear in their modes. No kernel is called here. Complex
numbers stand for vectors across the axis.
"""

import entry
import numpy as np

from cranktrain.core.reduced_body import rigid_coordinates, turning_stiffness

SPAN = 2e-5  # s between the points of the difference: its own error and that of rounding are far below 1e-9
WEIGHTS = {-3: -1 / 60, -2: 9 / 60, -1: -45 / 60, 1: 45 / 60, 2: -9 / 60, 3: 1 / 60}


def cross(a, b):
    """Component along z of the product of two vectors across it."""
    return (a.conjugate() * b).imag


def motion(simulation):
    """Modal q, v, a (3, n), and the frame's θ, Ω, Ω̇."""
    return entry.motion(simulation), entry.frame(simulation)


def axes(simulation, path, frame):
    """Displacement in space of the crank's axis, at its centre of mass, and of the block's (complex, m)."""
    crank, block = simulation.body, simulation.parts.block
    count, n = len(simulation.engine.crankshaft.main_widths), crank.n_modes
    mains = [crank.index(f"main[{i + 1}]") for i in range(count)]
    bores = [block.index(f"bore[{i + 1}]") for i in range(count)]
    # The smallest weights whose sum is one and whose mean place is the centre of mass.
    places = np.array([np.ones(count), crank.positions[mains, 2]])
    weights = np.linalg.lstsq(places, [1.0, crank.centre[2]], rcond=None)[0]
    x, y = weights @ (crank.shapes[mains, :2] @ path[0, :n])
    u, v = weights @ (block.shapes[bores, :2] @ path[0, entry.modes(simulation, "block")])
    return np.exp(1j * frame[0]) * complex(x, y), complex(u, v)


def piston_modes(engine):
    """Displacement across at the pin and tilt (2, 2) of a guided piston with the rod's end in its two modes."""
    m_s, m_p, guidance = engine.rod.small_end_mass, engine.cylinders.piston_mass, engine.piston_guidance
    arm = guidance.mass_height
    matrix = np.array([[m_s + m_p, -m_p * arm], [-m_p * arm, guidance.tilt_inertia + m_p * arm**2]])
    return np.linalg.inv(np.linalg.cholesky(matrix)).T


def points(simulation, path, frame, t):
    """Rods' and pistons' mass points (mass, z, place, velocity) and the moment of momentum of their turning."""
    engine, crank = simulation.engine, simulation.body
    cylinders, rod, guidance = engine.cylinders, engine.rod, engine.piston_guidance
    q, v = path[0] + t * path[1] + 0.5 * t * t * path[2], path[1] + t * path[2]
    angle, speed = frame[0] + t * frame[1] + 0.5 * t * t * frame[2], frame[1] + t * frame[2]
    m_s, m_p, m_b = rod.small_end_mass, cylinders.piston_mass, rod.big_end_mass
    behind = rod.length * m_s / (m_s + m_b)
    delta_j = rod.inertia - (m_s + m_b) * behind * (rod.length - behind)
    arm, e, n = guidance.mass_height, cylinders.pin_offset, crank.n_modes
    modes = piston_modes(engine)
    found, turning = [], 0.0
    for k, number in enumerate(cylinders.pins):
        row = crank.index(f"pin[{number}]")
        shape, place, beside = crank.shapes[row], crank.positions[row], engine.rod_offsets[k]
        shift = shape[0] + 1j * shape[1] + beside * (shape[4] - 1j * shape[3])
        x0 = complex(*place[:2])
        u, u1, phi, phi1 = shift @ q[:n], shift @ v[:n], shape[5] @ q[:n], shape[5] @ v[:n]
        r = np.exp(1j * phi) * x0 + u - 1j * phi * x0
        r1 = 1j * phi1 * np.exp(1j * phi) * x0 + u1 - 1j * phi1 * x0
        bank = np.exp(1j * cylinders.bank_angles[k])
        spin = np.exp(1j * angle) / bank
        pin, pin1 = spin * r, spin * (r1 + 1j * speed * r)
        own = entry.modes(simulation, f"piston[{k + 1}]")
        (across, tilt), (across1, tilt1) = modes @ q[own], modes @ v[own]
        lean, lean1 = pin.real - across - e, pin1.real - across1
        high = np.sqrt(rod.length**2 - lean**2)
        up, up1 = pin.imag + high, pin1.imag - lean / high * lean1
        for mass, x, w in (
            (m_b, pin, pin1),
            (m_s, across + e + 1j * up, across1 + 1j * up1),
            (m_p, across - tilt * arm + 1j * (up + arm), across1 - tilt1 * arm + 1j * up1),
        ):
            found.append((mass, place[2] + beside, bank * x, bank * w))
        turning += delta_j * lean1 / high + guidance.tilt_inertia * tilt1
    return found, turning


def slider_cranks(simulation, path, frame, t):
    """Momentum of all rods and pistons, and its moment about the origin (3,) each, ``t`` after the state."""
    found, turning = points(simulation, path, frame, t)
    momentum, about = np.zeros(3), np.array([0.0, 0.0, turning])
    for mass, z, x, w in found:
        p = mass * w
        momentum += [p.real, p.imag, 0.0]
        about += [-z * p.imag, z * p.real, cross(x, p)]
    return momentum, about


def imbalance(simulation):
    """Rate of momentum and of its moment about the origin less what mounts, weight and shaft do, (2, 3) N and N m."""
    engine, crank, block = simulation.engine, simulation.body, simulation.parts.block
    path, frame = motion(simulation)
    theta, omega, omega_dot = frame
    out = dict(zip(simulation.output_names, simulation.outputs, strict=True))
    force, moment = np.zeros(3), np.zeros(3)
    for i in range(len(engine.mounts.x)):
        place = block.positions[block.index(f"mount[{i + 1}]")]
        f, m = (np.array([out[f"mount[{i + 1}].{kind}.{axis}"] for axis in "xyz"]) for kind in ("force", "moment"))
        force += f
        moment += m + np.cross(place, f)
    of_crank, of_block = axes(simulation, path, frame)
    moment[2] += cross(of_block, complex(*force[:2])) - out["shaft.torque"]

    n, g = crank.n_modes, simulation.settings.gravity
    q, v, a = path[:, :n]
    turn = np.array([[np.cos(theta), -np.sin(theta), 0.0], [np.sin(theta), np.cos(theta), 0.0], [0.0, 0.0, 1.0]])
    # Crank: what the equations of motion take for its inertia, by its motions as a whole.
    inertia = a + 2 * omega * crank.gyroscopic @ v + omega_dot * (crank.gyroscopic @ q + crank.euler_load)
    inertia -= omega**2 * crank.centrifugal_load
    # Momentum knows nothing of stress: its rate is that of the places, with all that turns them.
    to_whole = np.linalg.inv(rigid_coordinates(crank)).T
    forces = to_whole @ (inertia - omega**2 * crank.centrifugal @ q)[:6]
    moments = to_whole @ (inertia + omega**2 * turning_stiffness(crank) @ q)[:6]
    rates = [turn @ forces[:3], turn @ moments[3:]]
    rates[1][2] += cross(of_crank, complex(*rates[0][:2]))
    displaced = turn @ (crank.mass * crank.centre + crank.translation @ q)
    force[1] -= crank.mass * g
    moment += [crank.mass * crank.centre[2] * g, 0.0, -displaced[0] * g]

    mass = np.zeros((6, 6))
    x, y, z = block.centre
    arm = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    mass[:3, :3], mass[:3, 3:], mass[3:, :3], mass[3:, 3:] = np.eye(3), -arm, arm, block.inertia / block.mass
    still = block.mass * mass @ rigid_coordinates(block) @ path[2, entry.modes(simulation, "block")][:6]
    rates[0], rates[1] = rates[0] + still[:3], rates[1] + still[3:]
    rates[1][2] += cross(of_block, complex(*still[:2]))
    force[1] -= block.mass * g
    moment += [block.mass * z * g, 0.0, -block.mass * (x + of_block.real) * g]

    for step, weight in WEIGHTS.items():
        momentum, about = slider_cranks(simulation, path, frame, step * SPAN)
        rates[0], rates[1] = rates[0] + weight / SPAN * momentum, rates[1] + weight / SPAN * about
    for m, z, x, _ in points(simulation, path, frame, 0.0)[0]:
        force[1] -= m * g
        moment += [m * z * g, 0.0, -m * x.real * g]
    return np.array([rates[0] - force, rates[1] - moment])


def layer_energy(guidance, stiffness, gap):
    """Energy (J) of a layer of springs: of what exceeds the clearance, whose edge is a parabola."""
    free = guidance.clearance
    over, width = abs(gap) - free, 0.1 * free
    if free > 0.0 and over <= width:
        return stiffness * max(over + width, 0.0) ** 3 / (12 * width)
    return stiffness * (0.5 * over**2 + width**2 / 6)


def energy_on_ground(simulation):
    """Kinetic and elastic energy (J) of a rigid crank on linear bearings, guided pistons and rods, without weight."""
    engine, crank = simulation.engine, simulation.body
    path, frame = motion(simulation)
    omega, guidance = frame[1], engine.piston_guidance
    q, v = path[0, : crank.n_modes], path[1, : crank.n_modes]
    total = 0.5 * v @ v + omega * (v @ crank.euler_load + v @ crank.gyroscopic @ q)
    spun = crank.inertia[2, 2] + 2 * q @ crank.centrifugal_load
    total += 0.5 * omega**2 * (spun + q @ (crank.centrifugal - crank.stress_stiffness) @ q)
    main = engine.main_bearing
    for i in range(len(engine.crankshaft.main_widths)):
        x, y = crank.shapes[crank.index(f"main[{i + 1}]"), :2] @ q
        # The springs stand still; isotropic ones need no turning.
        total += 0.5 * main.stiffness_x * (x * x + y * y)
    found, _ = points(simulation, path, frame, 0.0)
    total += sum(0.5 * mass * abs(w) ** 2 for mass, _, _, w in found)
    out = dict(zip(simulation.output_names, simulation.outputs, strict=True))
    rod, cylinders = engine.rod, engine.cylinders
    behind = rod.length * rod.small_end_mass / (rod.small_end_mass + rod.big_end_mass)
    delta_j = rod.inertia - (rod.small_end_mass + rod.big_end_mass) * behind * (rod.length - behind)
    tilting = piston_modes(engine)
    for k in range(engine.n_cylinders):
        (_, pin, pin1), (_, small, small1) = ((m, x, w) for m, _, x, w in found[3 * k : 3 * k + 2])
        along = (pin - small) / rod.length
        total += 0.5 * delta_j * (cross(along, pin1 - small1) / rod.length) ** 2
        own = entry.modes(simulation, f"piston[{k + 1}]")
        total += 0.5 * guidance.tilt_inertia * (tilting[1] @ path[1, own]) ** 2
        lateral, tilt = out[f"piston[{k + 1}].lateral"], out[f"piston[{k + 1}].tilt"]
        for stiffness, height in (
            (guidance.upper_stiffness, guidance.upper_height),
            (guidance.lower_stiffness, guidance.lower_height),
        ):
            total += layer_energy(guidance, stiffness, lateral - tilt * height)
    assert not any(cylinders.bank_angles)
    return float(total)
