"""Signals of wheels on a shaft whose rotation is known: speed, torsion, teeth, gaps, noise and jitter as of a real
chain.
"""

import math

import numpy as np

from cranktrain_lab.measured.channels import Channel, of_array

RPM = math.pi / 30.0


def motion(rate, seconds, rpm, torsion, until=math.inf):
    """Times (n,) s, mean rotation and rotation, rad; torsion: order → (amplitude deg, phase rad), up to a time.

    ``rpm``: speed at the beginning and at the end, joined by a straight line.
    """
    t = np.arange(round(rate * seconds)) / rate
    phi = RPM * (rpm[0] * t + 0.5 * (rpm[1] - rpm[0]) / seconds * t * t)
    theta = phi.copy()
    for order, (amplitude, phase) in torsion.items():
        theta += (t <= until) * math.radians(amplitude) * np.cos(order * phi + phase)
    return t, phi, theta


def pitch_errors(teeth, percent, seed=0):
    """Errors (teeth,) rad of a wheel, their standard deviation in per cent of a pitch; the first tooth is right."""
    errors = np.random.default_rng(seed).normal(0.0, 0.01 * percent * math.tau / teeth, teeth)
    errors[0] = 0.0
    return errors


def tooth_phase(theta, teeth, errors=None):
    """Number of teeth that have passed, (n,), a smooth function of the angle that is whole at each tooth's place."""
    from scipy.interpolate import CubicSpline

    if errors is None:
        return theta * (teeth / math.tau)
    edges = np.append(np.arange(teeth) * math.tau / teeth + errors, math.tau + errors[0])
    off = np.append(np.arange(teeth), teeth) - edges * teeth / math.tau
    off[-1] = off[0]
    return theta * (teeth / math.tau) + CubicSpline(edges, off, bc_type="periodic")(np.mod(theta, math.tau))


def sine_signal(theta, teeth, missing=0, errors=None, noise=0.0, seed=1):
    """Voltage (n,) of an inductive pick-up, of amplitude 1: rises through 0 at each tooth's place; noise is its
    deviation.
    """
    s = tooth_phase(theta, teeth, errors)
    y = np.sin(math.tau * s)
    if missing:
        y = np.where(np.floor(s + 0.5) % teeth >= teeth - missing, -0.9, y)
    return y + np.random.default_rng(seed).normal(0.0, noise, y.size) if noise else y


def channel(values, rate, name="tacho", unit="V", start=0.0):
    """Channel of samples in memory."""
    return Channel(name, unit, values.size, "bench", of_array(values), start, 1.0 / rate)


def crossing_times(t, theta, teeth, missing=0):
    """Times of all teeth, by the inverse of the rotation."""
    s = theta * (teeth / math.tau)
    numbers = np.arange(math.ceil(s[0]), math.floor(s[-1]) + 1)
    return np.interp(numbers[numbers % teeth < teeth - missing], s, t)
