"""Cylinder pressure as a function of the angle of the cylinder's own crank pin.

A pressure belongs to the volume of its own cylinder, which follows from the pin under its rod. Because a crank twists,
pins turn by different angles. A trace p(φ) that all cylinders read at the crank's mean angle θ would do the work
∮ p(θ) dV(φ), which is 0.2 to 1.2 % more than the indicated work ∮ p dV of the trace. With φ of the own pin it is the
indicated work for any twist. φ is the angle about the crank's axis of the point about which the rod turns (the pin, or
the centre of a big end that floats on it). If a block moves on its mounts, φ is relative to the axis of the own
cylinder, which heaves, pitches and rolls with the block. Radial motion of this point does not change the pressure,
because a trace was measured over an angle.

A trace may be phased to the pulley or the flywheel instead (``Settings.encoder``); its angle then holds for all
cylinders.

A trace phased to the frame instead of the crank would act on the drive line like a spring of −Σ mean[(p − p_c) V″],
2.9 kN m/rad for the six at 2000 rev/min. The derivative of the torque by the pin's own angle has no mean over a cycle.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.state import ACCELERATION, POSITION, PRESSURES_SET, VELOCITY, offset
from cranktrain.dynamics.motion.crank_pin import cylinder_axes, pin_place
from cranktrain.loads.articulated_rod import hung_pin
from cranktrain.loads.gas_pressure import gas_pressures, gas_slopes

SMALL_TANGENT = 0.05
"""Tangent below which the series of :func:`polar_angle` is exact to rounding."""


@inlined_kernel
def trace_angle(model, cylinder, theta):
    """Crank angle after the firing dead centre of a ``cylinder`` at the angle ``theta``, rad."""
    return theta - model.cylinders[cylinder, at.PHASE]


@inlined_kernel
def gas_force(rod, scalars, pressure):
    """Force (N) of the gas on piston and head at a pressure (Pa, absolute); ``rod`` is the cylinder's row."""
    return (pressure - scalars[at.CRANKCASE]) * rod[at.AREA] * rod[at.OWN_ROD]


@inlined_kernel
def find_pressure(model, work, frame, u, pressures, k, measured):
    """Set the pressure of a cylinder to that at its own angle, with the ports at u (m,); k is the row of its rod.

    The first half of ``pressures`` (2c,) is set, the second half has pressures given over time. The rotation of the
    rod's pin is in the ``numbers`` of the force laws. Fills ``work.gas``, the volume only if it counts or is to be
    ``measured``.
    """
    row = model.connections[k]
    c = row[at.OF_CYLINDER]
    rod = model.cylinders[c]
    numbers = model.laws.numbers
    pin = model.pins[c]
    i = row[at.FIRST]
    if row[at.PAIRS] == 0:
        x, y = pin_place(pin, u[i], u[i + 1], numbers)
    else:
        x, y = pin_place(pin, -u[i] * pin[1], u[i] * pin[0], numbers)
    found = work.gas[c]
    if measured or frame[at.BURN] < 0.0:
        liner = int(rod[at.LINER_PORT])
        rise = u[liner + at.HEAD] if liner >= 0 else 0.0
        found[at.VOLUME] = volume_over(rod, piston_height(model, frame, u, x, y, c) - rise)
    found[at.OWN_ANGLE] = own_angle(model, frame, u, x, y, c)
    given = pressures[model.cylinders.shape[0] + c]
    pressures[c], slope = cylinder_pressure(model, work, frame, c, found[at.OWN_ANGLE], found[at.VOLUME], given)
    # With a block on mounts the gas has no tangent: head and liner have none, and the pin's force must match.
    found[at.SLOPE] = slope if row[at.FOLLOWED] < 0 else 0.0


@inlined_kernel
def piston_height(model, frame, u, x, y, cylinder):
    """Height (m) of a piston's pin above the crank's axis, along its leaning liner, without the liner's own rise.

    x and y (m, axes of the frame) are the point about which the rod turns, or that of the master's rod.
    """
    rod = model.cylinders[cylinder]
    hung = rod[at.MASTER] >= 0.0
    cos, sin = cylinder_axes(model.cylinders[int(rod[at.MASTER])] if hung else rod, frame[at.COS], frame[at.SIN])
    across = cos * x - sin * y
    along = sin * x + cos * y
    if hung:
        across, along, _, _ = hung_pin(rod[at.JOINT :], across, along, 0.0, 0.0)
    side = across - rod[at.OFFSET]
    piston = int(rod[at.PISTON_PORT])
    if piston >= 0:
        side -= u[piston]
    height = along + math.sqrt(rod[at.ROD] * rod[at.ROD] - side * side)
    liner = int(rod[at.LINER_PORT])
    if liner < 0:
        return height
    upper = model.block.liners[cylinder, 0]
    lower = model.block.liners[cylinder, 1]
    slope = (u[liner] - u[liner + 1]) / (upper - lower)
    off = u[piston] - u[liner + 1] + slope * lower
    return height + slope * (off - 0.5 * slope * height)


@inlined_kernel
def own_angle(model, frame, u, x, y, cylinder):
    """Crank angle (rad) of the point at x and y (m, axes of the frame) about which the rod of a cylinder turns.

    With a block on mounts the angle is relative to the axis of the cylinder, which moves across and along itself and
    leans with the liner's ports in ``u``.
    """
    rod = model.cylinders[cylinder]
    liner = int(rod[at.LINER_PORT])
    lean = 0.0
    if liner >= 0:
        upper = model.block.liners[cylinder, 0]
        lower = model.block.liners[cylinder, 1]
        lean = (u[liner] - u[liner + 1]) / (upper - lower)
        across = u[liner + 1] - lean * lower
        cos, sin = cylinder_axes(rod, frame[at.COS], frame[at.SIN])
        x -= cos * across + sin * u[liner + 2]
        y -= cos * u[liner + 2] - sin * across
    pin = model.pins[cylinder]
    return frame[at.THETA] + lean + polar_angle(pin[0] * x + pin[1] * y, pin[0] * y - pin[1] * x)


@inlined_kernel
def polar_angle(x, y):
    """Angle (rad) of a point from the x-axis, by a few terms of the series if the angle is small."""
    if abs(y) > SMALL_TANGENT * x:
        return math.atan2(y, x)
    tangent = y / x
    s = tangent * tangent
    return tangent * (1.0 - s * (1.0 / 3.0 - s * (1.0 / 5.0 - s * (1.0 / 7.0 - s * (1.0 / 9.0 - s / 11.0)))))


@inlined_kernel
def given_pressure(model, work, cylinder, angle, elapsed):
    """Pressure (Pa, absolute) that the inputs give at a cylinder's own crank angle, ``elapsed`` (s) into the step."""
    k = 1 + cylinder
    value = work.inputs[at.VALUE, k]
    exponent = work.inputs[at.EXPONENT, k]
    if exponent > 0.0:
        bend = (angle - work.inputs[at.ANGLES, 1]) * work.inputs[at.BEND, k]
        value += (angle - work.inputs[at.ANGLES, 0]) * (work.inputs[at.RATE, k] + bend)
        value /= gas_volume(model, cylinder, angle) ** exponent
    else:
        value += work.inputs[at.RATE, k] * elapsed
    return max(value, 0.0)


@inlined_kernel
def knows_volumes(work):
    """True if the partner uses deviations of the volumes, so that its pressures belong to actual volumes."""
    return work.inputs[at.ANGLES, at.DEVIATIONS] > 0.0


@inlined_kernel
def cylinder_pressure(model, work, frame, cylinder, angle, volume, at_time):
    """Pressure (Pa, absolute) of a cylinder at its own crank angle; for a trace also the derivative by angle, Pa/rad.

    ``volume`` (m³) is the actual volume above the piston, for pressures that depend on it; ``at_time`` is the pressure
    of an input given over time.
    """
    if frame[at.BURN] >= 0.0:
        if model.choices[at.ENCODER] == at.PIN:
            return trace_at(model, frame, cylinder, angle)
        pressure, _ = trace_at(model, frame, cylinder, frame[at.FIRING] + frame[at.ENCODED])
        return pressure, 0.0
    exponent = work.inputs[at.EXPONENT, 1 + cylinder]
    if exponent > 0.0:
        if knows_volumes(work):
            # Pressures belong to the crank's angle and to the actual volume.
            turned = frame[at.CRANK] - work.inputs[at.ANGLES, 1]
            rate = work.inputs[at.RATE, 1 + cylinder] + turned * work.inputs[at.BEND, 1 + cylinder]
            value = work.inputs[at.VALUE, 1 + cylinder] + (frame[at.CRANK] - work.inputs[at.ANGLES, 0]) * rate
            return max(value / volume**exponent, 0.0), 0.0
        return given_pressure(model, work, cylinder, angle, 0.0), 0.0
    if exponent < 0.0:
        at_crank = gas_volume(model, cylinder, frame[at.CRANK])
        return at_time * (gas_volume(model, cylinder, angle) / at_crank) ** exponent, 0.0
    return at_time, 0.0


@inlined_kernel
def encoder_end(model):
    """Row of ``ModelArrays.ends`` with the rotation of the encoder, on the pulley or on the flywheel."""
    return at.PULLEY_ROTATION if model.choices[at.ENCODER] == at.PULLEY else at.FLYWHEEL_ROTATION


@inlined_kernel
def trace_at(model, frame, cylinder, angle):
    """Pressure (Pa, absolute) of the gas trace in a cylinder at its own crank angle, and its slope, Pa/rad."""
    motored, rise, slope, rise_slope = gas_slopes(trace_angle(model, cylinder, angle), model.gas, cylinder)
    return motored + frame[at.BURN] * rise, slope + frame[at.BURN] * rise_slope


@inlined_kernel
def trace_pressure(model, cylinder, theta, speed):
    """Cylinder pressure (Pa, absolute) of the gas trace: motored, plus the burn's rise scaled with speed."""
    motored, rise = gas_pressures(trace_angle(model, cylinder, theta), model.gas, cylinder)
    return motored + burn_share(model, speed) * rise


@inlined_kernel
def burn_share(model, speed):
    """Fraction of the burn's pressure rise at a speed, rad/s."""
    x = speed / model.scalars[at.BEST_SPEED] - 1.0
    share = model.scalars[at.GAS_LOAD] * (1.0 - model.scalars[at.FALLOFF] * x * x)
    return max(share, 0.0)


@inlined_kernel
def gas_volume(model, cylinder, theta):
    """Volume above a piston (m³) at a crank angle, with rigid parts."""
    volume, _ = rigid_volume(model, cylinder, theta)
    return volume


@inlined_kernel
def rigid_volume(model, cylinder, theta):
    """Volume above a piston (m³) at a crank angle, and its derivative (m³/rad), with rigid parts."""
    row = model.cylinders[cylinder]
    if row[at.MASTER] >= 0.0:
        height, rise = articulated_height(model, row, theta, cylinder)
        return volume_over(row, height), -row[at.AREA] * rise
    angle = trace_angle(model, cylinder, theta)
    pin = model.pins[cylinder]
    throw = math.sqrt(pin[0] * pin[0] + pin[1] * pin[1])
    along = throw * math.cos(angle)
    across = throw * math.sin(angle)
    x = across + row[at.OFFSET]
    reach = math.sqrt(row[at.ROD] * row[at.ROD] - x * x)
    return volume_over(row, along + reach), row[at.AREA] * (across + x * along / reach)


@inlined_kernel
def volume_over(row, height):
    """Volume above a piston (m³) whose pin is ``height`` (m), minus any rise of the head, above the crank's axis."""
    return row[at.CLEARANCE_VOLUME] + row[at.AREA] * (row[at.STROKE_TOP] - height)


@kernel
def articulated_height(model, row, theta, cylinder):
    """Height (m) of the piston of an articulated rod at a crank angle, and the derivative of this height (m/rad)."""
    master = model.cylinders[int(row[at.MASTER])]
    cos = math.cos(theta - master[at.BANK])
    sin = math.sin(theta - master[at.BANK])
    pin_x = cos * model.pins[cylinder, 0] - sin * model.pins[cylinder, 1]
    pin_y = sin * model.pins[cylinder, 0] + cos * model.pins[cylinder, 1]
    across, along, across_rate, along_rate = hung_pin(row[at.JOINT :], pin_x, pin_y, -pin_y, pin_x)
    side = across - row[at.OFFSET]
    reach = math.sqrt(row[at.ROD] * row[at.ROD] - side * side)
    return along + reach, along_rate - side * across_rate / reach


@inlined_kernel
def built_in(model, state):
    """True if the gas pressure is the built-in trace."""
    return model.choices[at.GAS_SOURCE] == 1.0 or (model.choices[at.GAS_SOURCE] == 0.0 and state[PRESSURES_SET] == 0.0)


@inlined_kernel
def crank_rotation(model, state):
    """Rotation (rad), rate and acceleration of the crank as a rigid body relative to its frame, at the state."""
    n = model.omega2.shape[0]
    unit = model.scalars[at.RIGID_ROTATION]
    return (
        unit * state[offset(POSITION, n) + at.ROTATION],
        unit * state[offset(VELOCITY, n) + at.ROTATION],
        unit * state[offset(ACCELERATION, n) + at.ROTATION],
    )
