"""Nonlinear elements of a torsional line: stiffness over torque, twist or frequency, and friction.

Over torque. Points (T, k) of the tangent stiffness k = dT/dψ are joined by straight lines, and k is constant beyond the
last of them. Two points of one torque are a step, so the stages of a progressive spring are points too. A table without
torques below 0 holds for both directions. The twist follows by integration,

    ψ(T) = ∫₀ᵀ dT'/k(T'),    between two points Δψ = ΔT ln(k₂/k₁)/(k₂ − k₁)

Small oscillations about a mean torque T have the stiffness k(T).

Over frequency. Stiffness k and damping c are joined by straight lines over the frequency and are constant beyond the
ends: κ(ω) = k(ω) + iω c(ω). In time the element has the k and c of one stated frequency.

Friction is the torque T_f against the rate of twist above the slip speed, T_f ψ̇/√(ψ̇² + ω_s²).

Sources: makers' data of elastic couplings and of leaf-spring dampers state these tables (e.g. dynamic stiffness over
torque in DIN 740-2, Antriebstechnik; nachgiebige Wellenkupplungen, 1986).
"""

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.engine import quantities as q
from cranktrain.engine.parts import Needed

PARTS = 8
"""Number of straight pieces of the torque curve over twist for each sloping piece of stiffness over torque."""


@dataclass(frozen=True)
class Shaft:
    """One row of shafts (SI); a rigid gear mesh if it has no stiffness.

    ``torques`` or ``frequencies`` are the points of ``stiffnesses`` (and ``dampings``) of a nonlinear element, see
    :mod:`cranktrain.engine.line_elements`. ``stiffness`` and ``damping`` are then the values without torque, or at
    ``frequency``, Hz. ``section`` is the design feature of :mod:`cranktrain.results.strength.iacs_m68`.
    """

    between: tuple[str, str]
    stiffness: q.TorsionalStiffness = 0.0
    damping: q.TorsionalDamping = 0.0
    loss_factor: q.Hysteresis = 0.0
    ratio: q.GearRatio = 1.0
    torques: tuple[q.Torque, ...] = ()
    frequencies: tuple[q.Frequency, ...] = ()
    stiffnesses: tuple[q.TorsionalStiffness, ...] = ()
    dampings: tuple[q.TorsionalDamping, ...] = ()
    frequency: q.WorkingFrequency = 0.0
    friction: q.FrictionTorque = 0.0
    slip_speed: q.SlipSpeed = 0.1
    diameter: q.Length = 0.0
    bore: q.AddedLength = 0.0
    strength: q.ShaftStrength = 0.0
    section: q.ShaftSection = "straight"

    @property
    def bends_the_line(self) -> bool:
        """True if the shaft's torque is not linear in twist and twist rate."""
        return bool(self.torques) or self.friction > 0.0


def needed_of_shaft(given: Mapping[str, Any]) -> Needed:
    """Keys of a file that a shaft needs, including those that its other keys make necessary."""
    if "frequencies" in given:
        why = "runs in time and lists of modes take stiffness and damping at one 'frequency', Hz, so give"
        return Needed(("between", "stiffness", "frequency"), why)
    if "twists" in given:
        return Needed(("between", "torques"), "a curve of torque over twist needs")
    if "torques" in given:
        return Needed(("between", "stiffness"), "a table over torque needs")
    return Needed(("between",))


def element_values(where: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """Fields of a shaft from the keys of a table row, where ``stiffness`` and ``damping`` may be lists.

    Raises
    ------
    InputError
        lists that do not fit together; the message starts with ``where``
    """
    values = {key: value for key, value in given.items() if key not in ("torques", "twists", "frequencies")}
    stiffness, damping = (given.get(key, ()) for key in ("stiffness", "damping"))
    tables = [key for key in ("torques", "twists", "frequencies") if given.get(key)]
    if "frequencies" in tables:
        if len(tables) > 1:
            raise InputError(f"{where}: has both {tables[0]} and frequencies; leave one of them out")
        return values | _over_frequency(where, given)
    if isinstance(damping, tuple):
        if damping:
            raise InputError(f"{where}: damping is a list without frequencies; give frequencies, or one number")
        values.pop("damping", None)
    if "twists" in tables:
        values |= _from_curve(where, given)
    elif "torques" in tables:
        values |= _over_torque(where, given["torques"], stiffness)
    elif isinstance(stiffness, tuple) and stiffness:
        text = (
            f"{where}: {len(stiffness)} stiffnesses without the torques at which they hold; the first, "
            f"{stiffness[0]:g} N m/rad, counts at every torque; give 'torques', or 'frequencies'"
        )
        warnings.warn(text, stacklevel=4)
        values["stiffness"] = stiffness[0]
    return values


def tangent_stiffness(shaft: Shaft, torque: Array | float) -> Array:
    """Tangent stiffness (N m/rad) for small oscillations about a mean ``torque`` (N m, an array of any shape)."""
    if not shaft.torques:
        return np.full(np.shape(torque), shaft.stiffness)
    at = np.abs(torque) if shaft.torques[0] >= 0.0 else np.asarray(torque)
    return np.asarray(np.interp(at, shaft.torques, shaft.stiffnesses))


def complex_stiffness(shaft: Shaft, omega: Array, torque: Array | float = 0.0) -> np.ndarray[Any, Any]:
    """Complex stiffness k (1 + iη) + iω c (N m/rad) at ``omega`` (rad/s) about a mean torque; both broadcast."""
    if shaft.frequencies:
        hz = omega / (2.0 * math.pi)
        stiffness, damping = (np.interp(hz, shaft.frequencies, of) for of in (shaft.stiffnesses, shaft.dampings))
    else:
        stiffness, damping = tangent_stiffness(shaft, torque), np.asarray(shaft.damping)
    lost = np.where(omega > 0.0, shaft.loss_factor, 0.0)
    return np.asarray(stiffness * (1.0 + 1j * lost) + 1j * omega * damping)


def torque_curve(shaft: Shaft) -> tuple[Array, Array]:
    """Twists (n,) rad and torques (n,) N m of a shaft with stiffness over torque; linear beyond its ends."""
    torques, stiffnesses = np.array(shaft.torques), np.array(shaft.stiffnesses)
    if torques[0] >= 0.0:
        torques, stiffnesses = np.append(-torques[::-1], torques), np.append(stiffnesses[::-1], stiffnesses)
    reach = 0.5 * max(float(np.ptp(torques)), 1.0)
    torques = np.concatenate(([min(torques[0], 0.0) - reach], torques, [max(torques[-1], 0.0) + reach]))
    stiffnesses = np.concatenate((stiffnesses[:1], stiffnesses, stiffnesses[-1:]))
    places, twists = [float(torques[0])], [0.0]
    for (t1, k1), (t2, k2) in pairwise(zip(torques.tolist(), stiffnesses.tolist(), strict=True)):
        if t2 == t1:
            continue
        count = 1 if k1 == k2 else PARTS
        ends = np.linspace(k1, k2, count + 1)
        for a, b in pairwise(ends.tolist()):
            step = (t2 - t1) / count
            twists.append(twists[-1] + (step / a if a == b else step * math.log(b / a) / (b - a)))
            places.append(places[-1] + step)
    return np.array(twists) - np.interp(0.0, places, twists), np.array(places)


def _over_torque(where: str, torques: tuple[float, ...], stiffness: Any) -> dict[str, Any]:
    stages = stiffness if isinstance(stiffness, tuple) else (stiffness,)
    if len(stages) == len(torques) + 1:
        torques, stages = (tuple(np.repeat(torques, 2).tolist()), (stages[0], *np.repeat(stages[1:-1], 2), stages[-1]))
    if len(stages) != len(torques):
        raise InputError(
            f"{where}: {len(torques)} torques for {len(stages)} stiffnesses; give one torque for each stiffness, or "
            "one less: those at which the next stiffness begins"
        )
    _increasing(where, "torques", torques, strictly=False)
    return _points(where, torques, stages)


def _from_curve(where: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """Fields of a shaft given by a curve of torque over twist, converted to stages of constant stiffness."""
    twists, torques = given["twists"], given.get("torques", ())
    if "stiffness" in given:
        raise InputError(f"{where}: stiffness follows from twists and torques; leave it out")
    if len(twists) != len(torques) or len(twists) < 2:
        raise InputError(f"{where}: {len(torques)} torques for {len(twists)} twists; give as many of each, 2 at least")
    for key, values in (("twists", twists), ("torques", torques)):
        _increasing(where, key, values)
    if min(twists) > 0.0 or abs(np.interp(0.0, twists, torques)) > 1e-9 * max(map(abs, torques)):
        raise InputError(f"{where}: the curve of torque over twist misses the point 0, 0; start it there")
    slopes = np.diff(torques) / np.diff(twists)
    return _points(where, tuple(np.repeat(torques, 2)[1:-1].tolist()), tuple(np.repeat(slopes, 2).tolist()))


def _points(where: str, torques: tuple[float, ...], stiffnesses: tuple[float, ...]) -> dict[str, Any]:
    if min(stiffnesses) <= 0.0:
        raise InputError(f"{where}: stiffness {min(stiffnesses):g} N m/rad; every stage needs one above 0")
    own = tuple(map(float, stiffnesses))
    return {"torques": torques, "stiffnesses": own, "stiffness": float(np.interp(0.0, torques, own))}


def _over_frequency(where: str, given: Mapping[str, Any]) -> dict[str, Any]:
    frequencies, columns = given["frequencies"], {}
    _increasing(where, "frequencies", frequencies)
    for key in ("stiffness", "damping"):
        value = given.get(key, 0.0)
        columns[key] = value if isinstance(value, tuple) else (value,) * len(frequencies)
        if len(columns[key]) != len(frequencies):
            raise InputError(f"{where}: {len(columns[key])} values of {key} for {len(frequencies)} frequencies")
    if min(columns["stiffness"]) <= 0.0:
        raise InputError(f"{where}: stiffness must be above 0 at every frequency")
    nominal = {key: float(np.interp(given["frequency"], frequencies, column)) for key, column in columns.items()}
    return {"frequencies": frequencies, "stiffnesses": columns["stiffness"], "dampings": columns["damping"], **nominal}


def _increasing(where: str, key: str, values: tuple[float, ...], strictly: bool = True) -> None:
    steps = np.diff(values)
    if np.any(steps < 0.0) or (strictly and np.any(steps == 0.0)):
        raise InputError(f"{where}: {key} must increase")
