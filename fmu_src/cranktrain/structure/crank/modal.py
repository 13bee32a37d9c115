"""Natural frequencies of the crankshaft and of the assembled cranktrain, and the kind of motion of each mode.

*Crankshaft, free*: with flywheel, pulley and all other attached parts, without rods. *Cranktrain*: at rest (Ω = 0) and
free to turn. Each pin carries the cycle mean of its rods' masses across the axis, m_b + ½ m_o at each rod's position on
the pin (the oscillating mass takes part in the pin's motion by cos² θ, half on average). Main bearings are springs
(rollers resist tilt too). The thrust bearing is closed (collar and block in series).

The kind of a mode is read from its kinetic energy. Each slice of the body around a point of the axis moves as a rigid
section: translation across and tilt count as bending, rotation about z as torsion, translation along z as axial. The
shape in a list of modes is the kind with the largest fraction.

The first and second torsional mode and the first axial one are named by :func:`named_mode`. A mode of one kind alone
would have the fraction 1 of it; bending distributes it over neighbouring modes, whose fractions add up to 1. Summed
from the lowest mode on, the fractions of a kind therefore count its modes: a mode belongs to the n-th one if the sum up
to half its own fraction is between n − 1 and n. Of these the one with the largest fraction has the name, if it has
:data:`LEAST_SHARE` or more. Otherwise no mode has it. Names are sought up to a stated frequency, which is the cut-off
of the engine's running model in reports, and the rotation on the connecting shaft has none.
"""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import LumpedInertia
from cranktrain.loads.rod_masses import mean_rod_masses, rod_masses
from cranktrain.structure.crank.reduction import attached_parts, complete_crankshaft
from cranktrain.structure.fem.reduction import CHECKED_HZ

KINDS = ("bending", "torsional", "axial")
SHARE_MEASURE = "kinetic energy of slices on the crank axis: across and tilting, turning, along"
LISTED_HZ = 1000.0
"""Modes are listed up to this frequency, Hz, and to the highest named mode above it."""
LEAST_SHARE = 0.25
"""Energy fraction of a kind that a mode has at least to be named the first or second of this kind: with less, bending
has distributed it over more than four modes, and none of them stands for it."""


def modal_report(engine: Engine, body: ReducedBody) -> dict[str, Any]:
    """Frequencies, shapes and quality of the reduction; JSON-able.

    Parameters
    ----------
    body : bare reduced crankshaft of the engine

    Returns
    -------
    ``crankshaft_free`` and ``cranktrain`` (modes with hz, shape and shares; the named first and second ones),
    ``reduction`` (full against reduced), ``published``, ``definitions``, ``seconds``
    """
    began = time.perf_counter()
    crankshaft = complete_crankshaft(engine, body)
    free_hz, free_shares = free_modes(engine, crankshaft)
    attached = time.perf_counter()
    hz, shares = cranktrain_modes(engine, crankshaft)
    highest = engine.reduction.running_cutoff_hz
    named = named_frequencies(hz, shares, highest)
    free = torsional_frequencies(free_hz, free_shares, highest)
    return {
        "crankshaft_free": {
            "modes": listed_modes(free_hz, free_shares, up_to=listed_to(free)),
            "torsional_hz": free,
        },
        "cranktrain": {"modes": listed_modes(hz, shares, up_to=listed_to(named.values())), **named},
        "sought_to_hz": highest,
        "reduction": reduction_quality(body),
        "published": {
            "crankshaft_free_torsional_hz": list(engine.published.free_torsional_hz),
            "cranktrain_hz": list(engine.published.cranktrain_hz),
            "cranktrain_shapes": list(engine.published.cranktrain_shapes),
            "measured_hz": list(engine.published.measured_hz),
            "second_torsional_hz": engine.published.second_torsional_hz,
        },
        "definitions": {
            "crankshaft_free": f"crankshaft with {_attached(engine)}, no rods",
            "cranktrain": "at rest; big end and half the oscillating mass on each pin, bearings as springs, thrust "
            "closed with collar and block in series; free to turn, without the connecting shaft",
            "shares": SHARE_MEASURE,
        },
        "seconds": {"attach": attached - began, "modal": time.perf_counter() - attached},
    }


def free_modes(engine: Engine, crankshaft: ReducedBody) -> tuple[Array, Array]:
    """Elastic modes of the free complete crankshaft: (k,) Hz and (k, 3) fractions of bending, torsion, axial motion."""
    shares = energy_shares(engine, crankshaft, np.eye(crankshaft.n_modes)[:, 6:], rods=False)
    return crankshaft.frequencies_hz[6:], shares


def cranktrain_modes(engine: Engine, crankshaft: ReducedBody) -> tuple[Array, Array]:
    """Modes of the assembled cranktrain at rest, free to turn: (n − 1,) Hz and (n − 1, 3) energy fractions by kind.

    ``crankshaft`` is the complete one, with flywheel and pulley.
    """
    squares, modes = eigh(*cranktrain_matrices(engine, crankshaft))
    # Nothing holds the crank against turning: the first mode is its rigid rotation.
    squares, modes = squares[1:], modes[:, 1:]
    return np.sqrt(squares) / (2.0 * np.pi), energy_shares(engine, crankshaft, modes, rods=True)


def cranktrain_matrices(engine: Engine, crankshaft: ReducedBody, without: Collection[int] = ()) -> tuple[Array, Array]:
    """Stiffness and mass (n, n) of the assembled cranktrain at rest, in the modes of the complete ``crankshaft``.

    ``without`` are cylinders, counted from 1, whose rods are other bodies.
    """
    stiffness = np.diag(crankshaft.omega**2) + bearing_stiffness(engine, crankshaft)
    return stiffness, np.eye(crankshaft.n_modes) + rod_masses(engine, crankshaft, without)


def bearing_stiffness(engine: Engine, crankshaft: ReducedBody) -> Array:
    """Stiffness (n, n) of the mains' linear springs and of the closed thrust bearing, in a crankshaft's modes."""
    result = np.zeros((crankshaft.n_modes, crankshaft.n_modes))
    for i, springs in enumerate(main_springs(engine), 1):
        for component, value in springs.items():
            row = crankshaft.shapes[crankshaft.index(f"main[{i}]"), component]
            result += value * np.outer(row, row)
    series = 1.0 / (1.0 / engine.thrust.closed + 1.0 / engine.thrust.block_stiffness)
    row = crankshaft.shapes[crankshaft.index("thrust"), 2]
    return np.asarray(result + series * np.outer(row, row))


def main_springs(engine: Engine, on_ground: bool = True) -> list[dict[int, float]]:
    """Linear springs of each main bearing by component of its journal's motion (0, 1: N/m; 3, 4: N m/rad).

    ``on_ground``: plain bearings in series with the block's stiffness, which a flexible block includes itself.
    """
    roller = engine.main_roller
    springs: list[dict[int, float]] = [{} for _ in engine.crankshaft.main_widths]
    if roller is not None:
        for main, radial, tilt in zip(engine.roller_mains, roller.stiffness, roller.tilt_stiffness, strict=True):
            springs[main] = {0: radial, 1: radial, 3: tilt, 4: tilt}
    for main in engine.plain_numbers:
        plain = engine.plain_mains
        x, y = plain.ground_stiffness if on_ground else (plain.stiffness_x, plain.stiffness_y)
        springs[main] = {0: x, 1: y}
    return springs


def _sections(body: ReducedBody) -> tuple[NDArray[np.intp], Array, Array, Array]:
    """Rows of interfaces on the axis, and mass, polar and diametral inertia of the section at each, (k,).

    Raises ``InputError`` where a body does not bring them, or brings what no body has.
    """
    names = ("section_interface", "section_mass", "section_polar", "section_diametral")
    rows, *masses = (body.records.get(name, np.zeros(0)) for name in names)
    fit = rows.ndim == 1 and rows.size > 0 and all(one.shape == rows.shape for one in masses)
    fit = fit and bool(np.isin(rows, np.arange(len(body.interfaces))).all() and np.isfinite(masses).all())
    if not fit or np.any(masses[0] < 0.0):
        raise InputError(
            f"body '{body.name}': its records {', '.join(names)} are not those of sections, which energies of modes "
            "need; write it anew by 'cranktrain reduce ENGINE --output'"
        )
    mass, polar, diametral = masses
    return rows.astype(np.intp), mass, polar, diametral


def energy_shares(engine: Engine, crankshaft: ReducedBody, modes: Array, rods: bool) -> Array:
    """Fractions (k, 3) of bending, torsional and axial motion in the kinetic energy of modes (n, k).

    Attached parts count as rigid sections of their own; with ``rods`` the mean rod masses move with their pins, which
    the axis carries halfway between the neighbouring mains.
    """
    on_axis, *masses = _sections(crankshaft)
    motion = crankshaft.shapes @ modes
    energy = _section_energy(motion[on_axis], *masses)
    parts = attached_parts(engine)
    if (weights := engine.balance_weights) is not None:
        # On the axis, a weight is a section with its polar inertia about it.
        for main, mass, r, z in zip(weights.mains, weights.masses, weights.radii, weights.offsets, strict=True):
            parts.append((f"main[{main}]", LumpedInertia(mass, mass * r**2, 0.5 * mass * r**2, z)))
    for name, part in parts:
        at = motion[crankshaft.index(name)].copy()
        at[0] += part.offset * at[4]
        at[1] -= part.offset * at[3]
        energy += _section_energy(
            at[None], np.array([part.mass]), np.array([part.polar_inertia]), np.array([part.diametral_inertia])
        )
    if rods:
        for i, rod_mass in zip(engine.cylinders.pins, mean_rod_masses(engine), strict=True):
            main = engine.crankshaft.main_before[i - 1]
            axis = 0.5 * (motion[crankshaft.index(f"main[{main}]")] + motion[crankshaft.index(f"main[{main + 1}]")])
            energy[:, 0] += rod_mass * (axis[0] ** 2 + axis[1] ** 2)
            energy[:, 1] += rod_mass * (engine.crankshaft.throws[i - 1] * axis[5]) ** 2
    return np.asarray(energy / energy.sum(axis=1, keepdims=True))


def named_mode(
    hz: Array, shares: Array, kind: str, number: int = 1, highest: float = math.inf, answers: Array | None = None
) -> int | None:
    """Index of the mode named the first (``number`` 1), second, … of a kind; None where no mode has the name.

    Parameters
    ----------
    hz, shares : (k,) rising frequencies and (k, kinds) energy fractions, as the kinds of this module come first
    highest : frequency, Hz, up to which it is sought
    answers : (k,) response of each mode, by which one of several is chosen; by the energy fraction where it is None
    """
    own = shares[:, KINDS.index(kind)]
    count = np.cumsum(own) - 0.5 * own
    among = np.flatnonzero((count > number - 1) & (count <= number) & (hz <= highest) & (own >= LEAST_SHARE))
    return int(among[np.argmax((own if answers is None else answers)[among])]) if among.size else None


def torsional_frequencies(hz: Array, shares: Array, highest: float = math.inf) -> list[float | None]:
    """First and second torsional frequency, Hz, None where no mode up to ``highest`` has the name."""
    found = (named_mode(hz, shares, "torsional", number, highest) for number in (1, 2))
    return [None if k is None else float(hz[k]) for k in found]


def first_torsional(hz: Array, shares: Array, highest: float = math.inf, answers: Array | None = None) -> float:
    """First torsional frequency, Hz; ``InputError`` where no mode up to ``highest`` has the name.

    Arguments are those of :func:`named_mode`.
    """
    first = named_mode(hz, shares, "torsional", 1, highest, answers)
    if first is None:
        raise InputError(
            f"no mode up to {min(highest, float(hz[-1])):.0f} Hz is a torsional one, with {100.0 * LEAST_SHARE:g} % of "
            "its kinetic energy in torsion; check crankshaft and inertias, or raise reduction.running_cutoff_hz"
        )
    return float(hz[first])


def named_frequencies(hz: Array, shares: Array, highest: float) -> dict[str, float | None]:
    """Frequencies, Hz, of the modes with a name, None where no mode up to ``highest`` has it."""
    axial = named_mode(hz, shares, "axial", 1, highest)
    first, second = torsional_frequencies(hz, shares, highest)
    return {
        "first_torsional_hz": first,
        "second_torsional_hz": second,
        "first_axial_hz": None if axial is None else float(hz[axial]),
    }


def listed_to(named: Iterable[float | None]) -> float:
    """Frequency, Hz, to which modes are listed: :data:`LISTED_HZ`, or the highest named mode."""
    return max([LISTED_HZ, *(value for value in named if value is not None)])


def second_reach(hz: Array, shares: Array) -> float:
    """Frequency, Hz, up to which modes belong to the first two torsional ones; ``hz`` (k,), ``shares`` (k, kinds)."""
    torsion = shares[:, KINDS.index("torsional")]
    within = np.cumsum(torsion) - 0.5 * torsion <= 2.0
    return float(hz[np.flatnonzero(within)[-1]])


def _section_energy(motion: Array, mass: Array, polar: Array, diametral: Array) -> Array:
    """Twice the kinetic energy per ω² by kind, (k, 3), of sections that move by ``motion`` (s, 6, k)."""
    squares = motion**2
    bending = mass @ (squares[:, 0] + squares[:, 1]) + diametral @ (squares[:, 3] + squares[:, 4])
    return np.stack((bending, polar @ squares[:, 5], mass @ squares[:, 2]), axis=1)


def _attached(engine: Engine) -> str:
    """Parts attached to the complete crankshaft, in words."""
    names = ["flywheel", "pulley"]
    names += ["clutch"] if engine.clutch is not None else []
    names += ["balance weights"] if engine.balance_weights is not None else []
    names += ["outer rings of the rollers"] if engine.main_roller is not None else []
    return ", ".join(names[:-1]) + " and " + names[-1]


def listed_modes(
    hz: Array, shares: Array, kinds: tuple[str, ...] = KINDS, above: float = 1.0, up_to: float = LISTED_HZ
) -> list[dict[str, Any]]:
    """Modes of a report, ``above`` and ``up_to`` so many Hz, each with frequency, shape, and shares (k, kinds)."""
    return [
        {"hz": float(f), "shape": kinds[int(np.argmax(share))], "shares": dict(zip(kinds, share.tolist(), strict=True))}
        for f, share in zip(hz, shares, strict=True)
        if above < f <= up_to
    ]


def reduction_quality(body: ReducedBody) -> dict[str, Any]:
    """Entries of a report on a body's reduction; JSON-able."""
    other = "lumped_hz" if "lumped_hz" in body.records else "consistent_hz"
    full = body.records.get("full_hz", np.zeros(0))
    beside = [body.records[name] for name in (other, "tied_hz") if name in body.records]
    whole = full.ndim == 1 and other in body.records and all(one.shape == full.shape for one in beside)
    if not (whole and {"dofs_full", "max_relative_error", "static_error", "rigid_hz"} <= body.quality.keys()):
        return {"modes": body.n_modes, **body.quality}  # a superelement, reduced elsewhere
    reduced = body.frequencies_hz[6 : 6 + full.size]
    shown = full < CHECKED_HZ
    quality = {
        "dofs_full": int(body.quality["dofs_full"]),
        "modes": body.n_modes,
        "full_hz": full[shown].tolist(),
        "reduced_hz": reduced[shown].tolist(),
        "max_relative_error": body.quality["max_relative_error"],
        "static_stiffness_error": body.quality["static_error"],
        "rigid_body_hz_before_replacement": body.quality["rigid_hz"],
        other: body.records[other][shown].tolist(),
    }
    if "tied_hz" in body.records:
        quality["tied_surfaces_hz"] = body.records["tied_hz"][shown].tolist()
    return quality


def at_largest(shapes: NDArray[Any]) -> Array:
    """Motion (n, k) of modes at the instant of their largest real part: a damped mode has no one shape."""
    turned = shapes * np.exp(-0.5j * np.angle((shapes**2).sum(axis=0)))
    return np.ascontiguousarray(turned.real)
