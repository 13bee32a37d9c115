"""Orders that excite the first torsional mode, and the critical speeds at which they meet it.

At rest the mode has the shape φ of unit modal mass (:mod:`cranktrain.structure.crank.modal`). The rods transmit gas and
inertia forces to the pins of the uniformly rotating crank. In the rotating frame the complex amplitude of order n of
these forces is f_n, with the phases of the firing angles. At resonance the amplitude of the mode is proportional to

    e_n = |φᵀ f_n|,

the phase sum of the torque's harmonic over the cylinders, each weighted by the mode's rotation at its pin. An order is
listed if its critical speed lies within the listed range and e_n is at least :data:`COUNTS` times the largest e_n of
this range. With even firing intervals the multiples of the firings per revolution, at which the torques of all
cylinders are in phase, are always listed. Forces are those of full load at the speed of the largest heat, where gas
dominates orders above 3.

Sources: E. J. Nestorides, *A Handbook on Torsional Vibration* (1958), phase diagrams and vector sums; W. Ker Wilson,
*Practical Solution of Torsional Vibration Problems*, vol. 2 (1963).
"""

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import eigh

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.dynamics.model import slots
from cranktrain.dynamics.model.arrays import build_model
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.tangents import tangents_in_rotation
from cranktrain.engine.firing import is_even
from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import Gas, GasTrace
from cranktrain.structure.crank.modal import cranktrain_matrices, energy_shares, named_mode, pulley_answers
from cranktrain.structure.in_motion.residues import order_forces

HIGHEST_ORDER = 12.0
"""Highest listed order; higher ones are listed only if no order up to this one has a critical speed in the range."""
COUNTS = 0.05
"""Fraction of the largest excitation from which an order is listed."""
REACH = 1.25
"""Critical speeds are listed up to this multiple of the highest speed, because orders grow below their resonance."""


class Excitation(NamedTuple):
    """Order, its critical speed (rad/s), and its excitation over the largest one in the listed range."""

    order: float
    speed: float
    share: float


def exciting_orders(engine: Engine, crankshaft: ReducedBody, gas: Gas | None = None) -> list[Excitation]:
    """Orders with enough excitation or a published critical speed, lowest first; empty without a first torsional mode.

    ``crankshaft`` has all parts attached, complete or as a running body; ``gas`` are measured pressures that replace
    those of the engine.
    """
    squares, shapes = eigh(*cranktrain_matrices(engine, crankshaft))
    hz, shapes = np.sqrt(np.maximum(squares[1:], 0.0)) / (2.0 * math.pi), shapes[:, 1:]
    shares = energy_shares(engine, crankshaft, shapes, rods=True)
    answers = pulley_answers(engine, crankshaft, shapes, squares[1:])
    first = named_mode(hz, shares, "torsional", 1, engine.reduction.running_cutoff_hz, answers)
    if first is None:
        return []
    orders, sizes = excitations(engine, crankshaft, shapes[:, first], gas)
    speeds = 2.0 * math.pi * hz[first] / orders
    low, high = engine.speeds
    within = (speeds >= low) & (speeds <= REACH * high)
    if np.any(within & (orders <= HIGHEST_ORDER)):  # a slow engine or a stiff crank has only higher orders
        within &= orders <= HIGHEST_ORDER
    largest = float((sizes[within] if within.any() else sizes).max()) or 1.0
    firings = engine.firings if is_even(engine.firing_intervals) else math.inf
    counting = within & ((sizes >= COUNTS * largest) | (orders % firings == 0.0))
    counting |= np.isin(orders, engine.published.critical_orders)
    return [
        Excitation(*values)
        for values in zip(orders[counting].tolist(), speeds[counting].tolist(), (sizes[counting] / largest).tolist(),
                          strict=True)
    ]  # fmt: skip


def excitations(engine: Engine, crankshaft: ReducedBody, shape: Array, gas: Gas | None = None) -> tuple[Array, Array]:
    """Orders 0.5, 1, … (o,) and the excitation |φᵀ f_n| (o,) of a mode φ (n,) of unit modal mass."""
    speed = engine.best_speed
    trace = (gas or GasTrace.from_engine(engine)).at(speed, 1.0)
    plain = replace(engine.without_additions, drive_line_chain=None, axial_path=None)
    settings = Settings(crank="rigid", bearings="linear", block="ground")
    model = build_model(plain, crankshaft, settings, speed, trace)
    forces = tangents_in_rotation(model, speed, model.cylinders[:, slots.END_ROW].astype(int)).forces
    sizes = np.abs(order_forces(forces).T @ (model.ports @ shape))
    return np.asarray(0.5 * np.arange(1, sizes.size + 1)), np.asarray(sizes)


def critical_speeds(engine: Engine, crankshaft: ReducedBody, gas: Gas | None = None) -> list[dict[str, Any]]:
    """Exciting orders as rows of a report: ``order``, critical speed ``rpm`` in rev/min, ``excitation``."""
    return [
        {"order": one.order, "rpm": one.speed / RPM, "excitation": one.share}
        for one in exciting_orders(engine, crankshaft, gas)
    ]
