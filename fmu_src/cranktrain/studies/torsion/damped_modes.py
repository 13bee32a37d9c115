"""Modes of the cranktrain with its torsional damper: damped frequencies and damping ratios.

The cranktrain is that of :mod:`cranktrain.structure.crank.modal`, its pulley with the damper's housing; the ring is one
more coordinate, coupled to the pulley's rotation by the damper's stiffness and damping at small amplitude, linearised
at the first torsional mode's own frequency (found by iteration). Modes are the eigenvalues λ of

    M ẍ + C ẋ + K x = 0,   frequency |Im λ|/2π,   damping ratio −Re λ/|λ|

with the damper's C alone: neither structure nor bearings damp here. Which mode is the first torsional one says
:mod:`cranktrain.studies.torsion.housed_crank`. Its limits are given as well, the ring free and the ring locked to the
pulley.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig, eigh

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Array
from cranktrain.dynamics.linear import Equations
from cranktrain.engine.model import Engine
from cranktrain.loads.damper import (
    STIFFNESS,
    damper_parameters,
    damper_temperature,
    damping_coefficient,
    required_damper,
)
from cranktrain.results.columns import NOTHING
from cranktrain.results.tables import Table
from cranktrain.structure.crank.modal import KINDS, at_largest, energy_shares, listed_to
from cranktrain.studies.torsion.housed_crank import SLOWEST_HZ, housed_crank

# Relative tolerance of the frequency of linearisation, and largest number of iterations.
_SETTLED, _ROUNDS = 1e-9, 50


class DampedModes(NamedTuple):
    """Oscillations of a damped structure: eigenvalues (k,) 1/s by rising frequency, and their shapes (n, k)."""

    values: NDArray[np.complex128]
    shapes: NDArray[np.complex128]

    @property
    def hz(self) -> Array:
        """Damped frequencies, (k,) Hz."""
        return np.asarray(self.values.imag / (2.0 * math.pi))

    @property
    def damping_ratios(self) -> Array:
        """Damping ratios of the modes, (k,)."""
        return np.asarray(-self.values.real / np.abs(self.values))


def damped_modes(stiffness: Array, damping: Array, mass: Array) -> DampedModes:
    """Oscillatory modes above 1 Hz of M ẍ + C ẋ + K x = 0 with K, C, M (n, n)."""
    values, vectors = eig(Equations(mass, damping, stiffness).first_order)
    swinging = np.flatnonzero(values.imag > 2.0 * math.pi * SLOWEST_HZ)
    swinging = swinging[np.argsort(values[swinging].imag)]
    return DampedModes(values[swinging], vectors[: len(mass), swinging])


def with_ring(
    stiffness: Array, mass: Array, hub: Array, ring_inertia: float, spring: float, damper: float
) -> tuple[Array, Array, Array]:
    """K, C, M (n + 1, n + 1) of a structure whose rotation ``hub`` (n,) carries a ring, the last coordinate.

    ``stiffness`` and ``mass`` are (n, n), ``ring_inertia`` kg m², ``spring`` N m/rad, ``damper`` N m s/rad.
    """
    n = mass.shape[0]
    twist = np.append(hub, -1.0)
    whole_stiffness, whole_mass = np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1))
    whole_stiffness[:n, :n], whole_mass[:n, :n] = stiffness, mass
    whole_mass[n, n] = ring_inertia
    return whole_stiffness + spring * np.outer(twist, twist), damper * np.outer(twist, twist), whole_mass


def damper_report(engine: Engine, body: ReducedBody) -> dict[str, Any]:
    """Modes of the cranktrain with its damper; JSON-able. ``body`` is the bare reduced crankshaft.

    The damper is as warm as at the highest speed of its table. Raises ``InputError``: no damper, or one hotter or
    colder than its law is valid.
    """
    damper, crank = required_damper(engine), housed_crank(engine, body)
    stiffness, mass, hub = crank.stiffness, crank.mass, crank.hub
    free = float(crank.omega[crank.torsional[0]]) / (2.0 * math.pi)
    temperature = damper_temperature(damper, damper.temperature_speeds[-1])

    def first_torsional(hz: Array, shapes: NDArray[Any], ring: NDArray[Any]) -> int:
        energy = damper.ring_inertia * np.abs(ring) ** 2
        return crank.most_torsional(hz, shapes, SLOWEST_HZ, crank.border_hz, energy)

    squares, shapes = eigh(stiffness, mass + damper.ring_inertia * np.outer(hub, hub))
    locked_hz = np.sqrt(np.maximum(squares, 0.0)) / (2.0 * math.pi)
    locked = float(locked_hz[first_torsional(locked_hz, shapes, hub @ shapes)])
    frequency = free
    for _ in range(_ROUNDS):
        parameters = damper_parameters(damper, temperature, frequency)
        spring, viscous = float(parameters[STIFFNESS]), damping_coefficient(parameters)
        modes = damped_modes(*with_ring(stiffness, mass, hub, damper.ring_inertia, spring, viscous))
        at = first_torsional(modes.hz, modes.shapes[:-1], modes.shapes[-1])
        before, frequency = frequency, float(modes.hz[at])
        if abs(frequency - before) <= _SETTLED * frequency:
            break
    listed = modes.hz <= listed_to([frequency])
    kinds = energy_shares(crank.engine, crank.crankshaft, at_largest(modes.shapes[:-1, listed]), rods=True)
    return {
        "kind": damper.kind,
        "law": damper.law if damper.kind == "viscous" else damper.kind,
        "temperature_c": temperature - 273.15,
        "linearised_at_hz": frequency,
        "stiffness_nm_per_rad": spring,
        "damping_nms_per_rad": viscous,
        "ring_inertia_kgm2": damper.ring_inertia,
        "first_torsional": {
            "hz": frequency,
            "damping_ratio": float(modes.damping_ratios[at]),
            "ring_free_hz": free,
            "ring_locked_hz": locked,
        },
        "modes": [
            {
                "hz": float(hz),
                "damping_ratio": float(ratio),
                "shape": KINDS[int(np.argmax(kind))],
                "shares": dict(zip(KINDS, (float(share) for share in kind), strict=True)),
            }
            for hz, ratio, kind in zip(modes.hz[listed], modes.damping_ratios[listed], kinds, strict=True)
        ],
        "definition": "cranktrain with the damper's housing on the pulley and its ring as one more coordinate; the "
        "damper alone damps; small amplitude, linearised at the first torsional frequency",
    }


def damper_table(report: Mapping[str, Any]) -> Table:
    """Table of the modes in a damper's report."""
    rows = [
        (f"{mode['hz']:.1f}", mode["shape"], f"{100.0 * mode['damping_ratio']:.2f}", NOTHING, NOTHING)
        for mode in report["modes"]
    ]
    first = report["first_torsional"]
    at = min(range(len(rows)), key=lambda k: abs(report["modes"][k]["hz"] - first["hz"]))
    rows[at] = (*rows[at][:3], f"{first['ring_free_hz']:.1f}", f"{first['ring_locked_hz']:.1f}")
    title = f"Cranktrain with its damper ({report['law']}) at {report['temperature_c']:.0f} degC, small amplitude"
    return Table(title, ("Hz", "shape", "damping / %", "ring free / Hz", "ring locked / Hz"), tuple(rows))
