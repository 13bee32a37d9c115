"""Signals of test benches with known answers: wheels with gaps, inductive pick-ups, edges noted by a counter.

A wheel turns by the angle of :func:`motion`, so speeds and orders are known before anything is measured.
"""

import numpy as np

from cranktrain_lab.measured.channels import Channel, of_array

RATE = 25e3
ORDERS = {0.5: (0.03, 10), 2: (0.30, 40), 4: (0.10, -70)}
"""Order: amplitude and phase, deg."""


def motion(t, start, end, orders):
    """Angle (rad) at times t (s) of a wheel from ``start`` to ``end`` rev/min, with cos(order angle + phase)."""
    rate = (end - start) * 2 * np.pi / 60 / (t[-1] + t[1])
    angle = start * 2 * np.pi / 60 * t + 0.5 * rate * t**2
    return angle + sum(np.radians(a) * np.cos(o * angle + np.radians(p)) for o, (a, p) in orders.items())


def times(seconds, rate=RATE):
    """Times (n,) s of samples."""
    return np.arange(round(rate * seconds)) / rate


def sine_teeth(angle, teeth, missing=()):
    """A whole sine a tooth, nothing in a gap."""
    place = angle / (2 * np.pi) * teeth
    there = np.ones(teeth)
    there[list(missing)] = 0
    return np.sin(2 * np.pi * (place % 1)) * there[np.floor(place).astype(int) % teeth]


def inductive(angle, teeth, missing, noise=0.02):
    """An inductive pick-up: the flux of a tooth is a bell, the voltage its derivative; flat zero in a gap."""
    place = angle / (2 * np.pi) * teeth
    whole = np.floor(place).astype(int)
    out = np.zeros(len(angle))
    for j in (-1, 0, 1, 2):
        d = (place - whole - j - 0.5) / 0.24
        out += np.where((whole + j) % teeth != missing, -2 * d * np.exp(-(d**2)), 0)
    out *= np.gradient(angle, 1 / RATE)
    return 5 * out / np.abs(out).max() + noise * np.random.default_rng(1).standard_normal(len(angle))


def edges(teeth, seconds, start, end, orders):
    """Times (k,) s of the teeth's edges."""
    t = np.linspace(0, seconds, 100_001 * seconds)
    angle = motion(t, start, end, orders)
    return np.interp(np.arange(1, int(angle[-1] / (2 * np.pi) * teeth)) * 2 * np.pi / teeth, angle, t)


def channel(values, name="crank", unit="V"):
    """Channel of samples in memory."""
    return Channel(name, unit, values.size, "bench", of_array(values), 0.0, 1.0 / RATE)
