"""Where a run starts: rotation of a rigid crank on its connecting shaft, and the engine leaning on its mounts.

At constant speed the rods turn their torque T(θ) against J φ̈ + c φ̇ + k φ = T − T̄, with the mean T̄ wound up in the
shaft. Its periodic solution is exact for a rigid crank of constant inertia (rods at their cycle mean), and near enough
to the real motion to spare a run the slow decay of the drive line's own vibration. The block feels −T: it leans on its
mounts under the mean and rocks under the rest, as a rigid body; crank and pistons move with it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.kernel import kernel
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.arrays import ModelArrays
from cranktrain.dynamics.model.slots import (
    AREA,
    BANK,
    BORE_ROTATIONS,
    CRANK_MODES,
    CRANKCASE,
    DELTA_J,
    GRAVITY,
    LINERS,
    M_BIG,
    M_OSC,
    OFFSET,
    RIGID_ROTATION,
    ROD,
    RODS,
    SHAFT_C,
    SHAFT_K,
    TURNING_MODES,
)
from cranktrain.dynamics.motion.gas import trace_pressure
from cranktrain.loads.slider_crank import rod_force

SAMPLES = 720
ORDERS = 60
"""Harmonics of half an order whose rocking the start takes in."""


class Start(NamedTuple):
    """Mean wind-up of the shaft (rad) and torque (N m), the crank's rotation against it (rad) and its rate (rad/s).

    ``inertia`` (kg m²) is that of crank and rods; 0 where nothing is known of the cycle to come. The torque's
    alternating part is 2 Re Σ ``spectrum`` exp(iωt) over the angular frequencies ``omega`` (k,).
    """

    windup: float = 0.0
    torque: float = 0.0
    rotation: float = 0.0
    rate: float = 0.0
    inertia: float = 0.0
    spectrum: NDArray[np.complex128] = np.zeros(0, dtype=np.complex128)
    omega: Array = np.zeros(0)


def rigid_start(model: ModelArrays, speed: float) -> Start:
    """Start of a rigid crank at θ = 0, on its way through the cycle at ``speed``, rad/s."""
    torque = np.zeros(SAMPLES)
    _rigid_torque(model, speed, np.zeros(16), torque)
    stiffness, damping = model.scalars[SHAFT_K], model.scalars[SHAFT_C]
    mean = float(torque.mean())
    if stiffness <= 0.0:
        return Start(torque=mean)
    if speed <= 0.0:
        return Start(mean / stiffness, mean)
    inertia = 1.0 / model.scalars[RIGID_ROTATION] ** 2
    for cylinder, pin in zip(model.cylinders, model.pins, strict=True):
        inertia += (cylinder[M_BIG] + 0.5 * cylinder[M_OSC]) * float((pin**2).sum())
    spectrum = np.fft.rfft(torque - mean) / SAMPLES
    omega = np.asarray(0.5 * speed * np.arange(spectrum.size), dtype=np.float64)
    motion = spectrum / (stiffness - inertia * omega**2 + 1j * damping * omega)
    rotation, rate = 2.0 * float(motion.sum().real), 2.0 * float((1j * omega * motion).sum().real)
    return Start(mean / stiffness, mean, rotation, rate, inertia, spectrum[1:], omega[1:])


def leaning(model: ModelArrays, start: Start) -> tuple[Array, Array]:
    """Modal displacement and velocity (n,) of an engine that leans and rocks on its mounts, crank at θ = 0."""
    if model.layout[BORE_ROTATIONS] == 0.0:
        return np.zeros(model.omega2.size), np.zeros(model.omega2.size)
    turning, shapes = int(model.layout[TURNING_MODES]), model.block_ports
    modes, b = shapes.shape[1], model.bearings.shape[0]
    rotations = int(model.layout[BORE_ROTATIONS]) - model.ports.shape[0]
    load = -shapes[rotations : rotations + b].mean(axis=0)
    supported = np.diag(model.omega2[turning : turning + modes]) + model.block.stiffness
    place = np.linalg.solve(supported, start.torque * load)
    rate = np.zeros(modes)
    stiffness, damping = model.block.stiffness[:6, :6], model.block.damping[:6, :6]
    for torque, omega in zip(start.spectrum[:ORDERS], start.omega[:ORDERS], strict=True):
        motion = np.linalg.solve(stiffness + 1j * omega * damping - omega**2 * np.eye(6), 2.0 * torque * load[:6])
        place[:6] += motion.real
        rate[:6] += (1j * omega * motion).real
    return carried(model, place), carried(model, rate)


def carried(model: ModelArrays, block: Array) -> Array:
    """Motion of all modes (n,) that go along with the block's (n_b,)."""
    q = np.zeros(model.omega2.size)
    turning, first = int(model.layout[TURNING_MODES]), model.ports.shape[0]
    modes, shapes = model.block_ports.shape[1], model.block_ports
    b = model.bearings.shape[0]
    q[turning : turning + modes] = block
    # The crank goes along as a rigid body that does not turn, the rest with what carries it.
    joined = np.concatenate((model.pairs, model.pairs + 1.0, model.axial)).astype(int)
    place = shapes[joined[:, 1] - first] @ block
    q[:5] = np.linalg.lstsq(model.ports[joined[:, 0], :5], place, rcond=None)[0]
    crank, count = int(model.layout[CRANK_MODES]), len(model.cylinders)
    if model.layout[RODS] > 0.0:
        pin, rod = 2 * b + 1, int(model.layout[RODS])
        at_pins = model.ports[pin : pin + 2 * count, :5] @ q[:5]
        q[crank : crank + 2 * count] = at_pins / np.diag(model.ports[rod : rod + 2 * count, crank:])
    for c in range(count):
        liner = int(model.layout[LINERS]) - first + 3 * c
        across = 0.5 * (shapes[liner] + shapes[liner + 1]) @ block
        own = turning + modes + 2 * c
        q[own : own + 2] = np.linalg.solve(model.block.piston_shape, [across, 0.0])
    return q


@kernel
def _rigid_torque(model, speed, out, torque):
    """Torque of all rods about the axis at uniform angles over a cycle, rigid crank at constant speed, N m."""
    count = torque.shape[0]
    for i in range(count):
        theta = 4.0 * math.pi * i / count
        for c in range(model.cylinders.shape[0]):
            rod = model.cylinders[c]
            cos = math.cos(theta - rod[BANK])
            sin = math.sin(theta - rod[BANK])
            x = cos * model.pins[c, 0] - sin * model.pins[c, 1]
            y = sin * model.pins[c, 0] + cos * model.pins[c, 1]
            gas = (trace_pressure(model, c, theta, speed) - model.scalars[CRANKCASE]) * rod[AREA]
            g = model.scalars[GRAVITY]
            rod_force(
                x, y, -speed * y, speed * x, -speed * speed * x, -speed * speed * y,
                gas, rod[ROD], rod[M_BIG], rod[M_OSC], rod[DELTA_J], rod[OFFSET],
                g * math.sin(rod[BANK]), g * math.cos(rod[BANK]), out,
            )  # fmt: skip
            torque[i] += x * out[1] - y * out[0]
