"""Where a run starts in rotation: the periodic motion of a rigid crank on its connecting shaft.

At constant speed the rods turn their torque T(θ) against J φ̈ + c φ̇ + k φ = T − T̄, with the mean T̄ wound up in the
shaft. Its periodic solution is exact for a rigid crank of constant inertia (rods at their cycle mean), and near enough
to the real motion to spare a run the slow decay of the drive line's own vibration.
"""

from __future__ import annotations

import math

import numpy as np

from cranktrain.dynamics.equations_of_motion import trace_pressure
from cranktrain.dynamics.model import (
    AREA,
    BANK,
    CRANKCASE,
    DELTA_J,
    GRAVITY,
    M_BIG,
    M_OSC,
    OFFSET,
    PIN,
    RIGID_ROTATION,
    ROD,
    SHAFT_C,
    SHAFT_K,
    ModelArrays,
)
from cranktrain.kernel import kernel
from cranktrain.loads.slider_crank import rod_force

SAMPLES = 720


def rigid_start(model: ModelArrays, speed: float) -> tuple[float, float, float]:
    """Mean wind-up of the shaft, and the crank's rotation against it at θ = 0 (rad) with its rate (rad/s)."""
    torque = np.zeros(SAMPLES)
    _rigid_torque(model, speed, np.zeros(16), torque)
    stiffness, damping = model.scalars[SHAFT_K], model.scalars[SHAFT_C]
    if stiffness <= 0.0:
        return 0.0, 0.0, 0.0
    mean = float(torque.mean())
    if speed <= 0.0:
        return mean / stiffness, 0.0, 0.0
    inertia = 1.0 / model.scalars[RIGID_ROTATION] ** 2
    for cylinder in model.cylinders:
        radius2 = float((model.pins[int(cylinder[PIN])] ** 2).sum())
        inertia += (cylinder[M_BIG] + 0.5 * cylinder[M_OSC]) * radius2
    spectrum = np.fft.rfft(torque - mean) / SAMPLES
    omega = 0.5 * speed * np.arange(spectrum.size)
    motion = spectrum / (stiffness - inertia * omega**2 + 1j * damping * omega)
    return mean / stiffness, 2.0 * float(motion.sum().real), 2.0 * float((1j * omega * motion).sum().real)


@kernel
def _rigid_torque(model, speed, out, torque):
    """Torque of all rods about the axis at uniform angles over a cycle, rigid crank at constant speed, N m."""
    count = torque.shape[0]
    for i in range(count):
        theta = 4.0 * math.pi * i / count
        for c in range(model.cylinders.shape[0]):
            rod = model.cylinders[c]
            k = int(rod[PIN])
            cos = math.cos(theta - rod[BANK])
            sin = math.sin(theta - rod[BANK])
            x = cos * model.pins[k, 0] - sin * model.pins[k, 1]
            y = sin * model.pins[k, 0] + cos * model.pins[k, 1]
            gas = (trace_pressure(model, c, theta, speed) - model.scalars[CRANKCASE]) * rod[AREA]
            g = model.scalars[GRAVITY]
            rod_force(
                x, y, -speed * y, speed * x, -speed * speed * x, -speed * speed * y,
                gas, rod[ROD], rod[M_BIG], rod[M_OSC], rod[DELTA_J], rod[OFFSET],
                g * math.sin(rod[BANK]), g * math.cos(rod[BANK]), out,
            )  # fmt: skip
            torque[i] += x * out[1] - y * out[0]
