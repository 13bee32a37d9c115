"""Natural frequencies of the crankshaft and of the assembled cranktrain, and the kind of motion of each mode.

*Crankshaft, free*: with flywheel, pulley and all other attached parts, without rods. *Cranktrain*: at rest (Ω = 0) and
free to turn. Each pin carries the cycle mean of its rods' masses across the axis, m_b + ½ m_o at each rod's position on
the pin (the oscillating mass takes part in the pin's motion by cos² θ, half on average). Main bearings are springs
(rollers resist tilt too). The thrust bearing is closed (collar and block in series).

The kind of a mode follows from its kinetic energy. The body is divided into slices along the axis that move as rigid
sections. Translation across and tilt count as bending, rotation about z as torsion, translation along z as axial
motion. The shape in a list of modes is the kind with the largest fraction.

:func:`named_mode` finds the first and second torsional and the first axial mode. A purely torsional mode would have the
torsional fraction 1. Coupling with bending distributes this fraction over neighbouring modes, and the parts add up to
1. The cumulative sum of a kind's fractions from the lowest mode therefore counts its modes: a mode is a candidate for
the n-th if the sum up to half its own fraction lies between n − 1 and n and its fraction is at least
:data:`LEAST_SHARE`. The candidate with the largest fraction gets the name. The first torsional mode is instead the
candidate with the largest of :func:`pulley_answers`. In V engines on split pins a bending mode takes half of the
torsion; two fractions then differ by less than the error of a crank of beams, but the answers by a third or more. Names
are given up to a stated frequency (in reports the cut-off of the engine's running model), and not to the rotation on
the connecting shaft.
"""

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
from cranktrain.structure.in_motion.residues import unit_torques

KINDS = ("bending", "torsional", "axial")
SHARE_MEASURE = "kinetic energy of slices on the crank axis: across and tilting, turning, along"
LISTED_HZ = 1000.0
"""Modes are listed up to this frequency, Hz, or up to the highest named mode if that is higher."""
LEAST_SHARE = 0.25
"""Least fraction of kinetic energy in a kind of motion (such as torsion) with which a mode can be named first or second
of this kind. With less, bending has distributed the motion over more than four modes, and no single mode represents
it."""


def modal_report(engine: Engine, body: ReducedBody) -> dict[str, Any]:
    """Report on natural frequencies, shapes of modes and quality of the reduction; JSON-able.

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
    free_hz, free_shares, free_answers = free_modes(engine, crankshaft)
    attached = time.perf_counter()
    hz, shares, answers = cranktrain_modes(engine, crankshaft)
    highest = engine.reduction.running_cutoff_hz
    named = named_frequencies(hz, shares, answers, highest)
    free = torsional_frequencies(free_hz, free_shares, free_answers, highest)
    parts = ["flywheel", "pulley"]
    parts += ["clutch"] if engine.clutch is not None else []
    parts += ["balance weights"] if engine.balance_weights is not None else []
    parts += ["outer rings of the rollers"] if engine.main_roller is not None else []
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
            "crankshaft_free": f"crankshaft with {', '.join(parts[:-1])} and {parts[-1]}, no rods",
            "cranktrain": "at rest; big end and half the oscillating mass on each pin, bearings as springs, thrust "
            "closed with collar and block in series; free to turn, without the connecting shaft",
            "shares": SHARE_MEASURE,
        },
        "seconds": {"attach": attached - began, "modal": time.perf_counter() - attached},
    }


def free_modes(engine: Engine, crankshaft: ReducedBody) -> tuple[Array, Array, Array]:
    """Elastic modes of the free complete crankshaft.

    The result is (k,) Hz, (k, 3) fractions of bending, torsion and axial motion, and (k,) answers of the pulley.
    """
    modes = np.eye(crankshaft.n_modes)[:, 6:]
    shares = energy_shares(engine, crankshaft, modes, rods=False)
    return crankshaft.frequencies_hz[6:], shares, pulley_answers(engine, crankshaft, modes, crankshaft.omega[6:] ** 2)


def cranktrain_modes(engine: Engine, crankshaft: ReducedBody) -> tuple[Array, Array, Array]:
    """Modes of the assembled cranktrain at rest, free to rotate: Hz (k,), energy fractions (k, 3), pulley answers (k,).

    ``crankshaft`` is the complete crankshaft, with flywheel and pulley.
    """
    squares, modes = eigh(*cranktrain_matrices(engine, crankshaft))
    # No spring acts on the crank's rotation, so the first mode is the crank's rigid rotation. It is left out, as are
    # free motions of bodies on rigid gears, which are modes of such a crankshaft after its rigid ones.
    first = 1 + np.count_nonzero(crankshaft.omega[6:] == 0.0)
    squares, modes = squares[first:], modes[:, first:]
    shares = energy_shares(engine, crankshaft, modes, rods=True)
    return np.sqrt(squares) / (2.0 * np.pi), shares, pulley_answers(engine, crankshaft, modes, squares)


def pulley_answers(engine: Engine, crankshaft: ReducedBody, modes: Array, squares: Array) -> Array:
    """Rotation (k,) of the pulley at each mode's own frequency under a unit gas torque of each cylinder.

    The result is the root of the sum of squares over the cylinders, up to a common factor. At equal damping ratios the
    response at resonance is proportional to 1/ω². Modes (n, k) have unit modal mass; ``squares`` (k,) are ω².
    """
    pulley = np.abs(crankshaft.shapes[crankshaft.index("pulley"), 5] @ modes)
    driven = np.linalg.norm(unit_torques(engine, crankshaft).T @ modes, axis=0)
    return np.asarray(pulley * driven / np.maximum(squares, np.finfo(float).tiny))


def cranktrain_matrices(
    engine: Engine, crankshaft: ReducedBody, without: Collection[int] = (), block: ReducedBody | None = None
) -> tuple[Array, Array]:
    """Stiffness and mass (n, n) of the assembled cranktrain at rest, in the modes of the complete ``crankshaft``.

    ``without`` are numbers of cylinders, from 1, whose rods are separate bodies and not included. Modes of a complete
    ``block`` on the engine's mounts follow those of the crankshaft.
    """
    omega = crankshaft.omega if block is None else np.concatenate((crankshaft.omega, block.omega))
    mass, n = np.eye(omega.size), crankshaft.n_modes
    mass[:n, :n] += rod_masses(engine, crankshaft, without)
    return np.diag(omega**2) + bearing_stiffness(engine, crankshaft, block), mass


def bearing_stiffness(engine: Engine, crankshaft: ReducedBody, block: ReducedBody | None = None) -> Array:
    """Stiffness (n, n) of the mains' linear springs and of the closed thrust bearing, in a crankshaft's modes.

    With a ``block``, whose modes follow, they end on its bores, and its mounts are included.
    """
    held = [
        (value, component, f"main[{i}]", f"bore[{i}]")
        for i, springs in enumerate(main_springs(engine, block is None), 1)
        for component, value in springs.items()
    ]
    thrust = engine.thrust
    series = thrust.closed if block is not None else 1.0 / (1.0 / thrust.closed + 1.0 / thrust.block_stiffness)
    held.append((series, 2, "thrust", "thrust"))
    n = crankshaft.n_modes
    journals = np.array([crankshaft.shapes[crankshaft.index(journal), k] for _, k, journal, _ in held])
    result = np.zeros((n, n))
    for (value, *_), row in zip(held, journals, strict=True):
        result += value * np.outer(row, row)
    if block is None:
        return result
    assert engine.mounts is not None
    bores = np.array([block.shapes[block.index(bore), k] for _, k, _, bore in held])
    pulled = np.array([[value] for value, *_ in held]) * bores
    mounts = np.concatenate([block.shapes[block.index(f"mount[{k + 1}]")] for k in range(len(engine.mounts.stiffness))])
    own = bores.T @ pulled + mounts.T @ (np.ravel(engine.mounts.stiffness)[:, None] * mounts)
    across = journals.T @ pulled
    return np.block([[result, -across], [-across.T, own]])


def main_springs(engine: Engine, on_ground: bool = True) -> list[dict[int, float]]:
    """Linear springs of each main bearing, by component of the journal's motion (0, 1: N/m; 3, 4: N m/rad).

    With ``on_ground`` plain bearings are in series with the block's stiffness; a flexible block models this itself.
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
    """Rows of the k interfaces on the axis, and mass, polar and diametral inertia (k,) of the slice at each.

    Raises ``InputError`` if the body's records of sections are missing or invalid.
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

    Attached parts count as further rigid sections. With ``rods`` the mean rod masses are included; they move like the
    axis halfway between the neighbouring mains.
    """
    on_axis, *masses = _sections(crankshaft)
    motion = crankshaft.shapes @ modes
    energy = _section_energy(motion[on_axis], *masses)
    parts = attached_parts(engine)
    if (weights := engine.balance_weights) is not None:
        # A counterweight counts as a slice on the axis, with its polar inertia about the axis.
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
    # A crank at rest beside moving bodies has no energy, and no kind of motion.
    return np.asarray(energy / np.maximum(energy.sum(axis=1, keepdims=True), np.finfo(float).tiny))


def named_mode(
    hz: Array, shares: Array, kind: str, number: int = 1, highest: float = math.inf, answers: Array | None = None
) -> int | None:
    """Index of the first (``number`` 1), second, … mode of a kind; None if no mode has this name.

    Parameters
    ----------
    hz, shares : (k,) rising frequencies and (k, kinds) energy fractions, whose first columns are those of :data:`KINDS`
    highest : highest frequency of the mode, Hz
    answers : (k,) response of each mode; the candidate with the largest is chosen. None: by energy fraction
    """
    own = shares[:, KINDS.index(kind)]
    count = np.cumsum(own) - 0.5 * own
    among = np.flatnonzero((count > number - 1) & (count <= number) & (hz <= highest) & (own >= LEAST_SHARE))
    return int(among[np.argmax((own if answers is None else answers)[among])]) if among.size else None


def torsional_frequencies(
    hz: Array, shares: Array, answers: Array | None = None, highest: float = math.inf
) -> list[float | None]:
    """First and second torsional frequency, Hz; None if no mode up to ``highest`` has this name.

    The ``answers`` choose only the first one, because the second one moves the pulley little.
    """
    found = (named_mode(hz, shares, "torsional", n, highest, answers if n == 1 else None) for n in (1, 2))
    return [None if k is None else float(hz[k]) for k in found]


def first_torsional(hz: Array, shares: Array, highest: float = math.inf, answers: Array | None = None) -> float:
    """First torsional frequency, Hz; ``InputError`` if no mode up to ``highest`` has this name.

    Arguments are those of :func:`named_mode`.
    """
    first = named_mode(hz, shares, "torsional", 1, highest, answers)
    if first is None:
        raise InputError(
            f"no mode up to {min(highest, float(hz[-1])):.0f} Hz is a torsional one, with {100.0 * LEAST_SHARE:g} % of "
            "its kinetic energy in torsion; check crankshaft and inertias, or raise reduction.running_cutoff_hz"
        )
    return float(hz[first])


def named_frequencies(hz: Array, shares: Array, answers: Array | None, highest: float) -> dict[str, float | None]:
    """Frequencies, Hz, of first and second torsional and first axial mode, by name; None for one above ``highest``."""
    axial = named_mode(hz, shares, "axial", 1, highest)
    first, second = torsional_frequencies(hz, shares, answers, highest)
    return {
        "first_torsional_hz": first,
        "second_torsional_hz": second,
        "first_axial_hz": None if axial is None else float(hz[axial]),
    }


def listed_to(named: Iterable[float | None]) -> float:
    """Frequency, Hz, up to which modes are listed: :data:`LISTED_HZ` or the highest of ``named``, if that is higher."""
    return max([LISTED_HZ, *(value for value in named if value is not None)])


def second_reach(hz: Array, shares: Array) -> float:
    """Frequency, Hz, of the last candidate for the second torsional mode; ``hz`` (k,), ``shares`` (k, kinds)."""
    torsion = shares[:, KINDS.index("torsional")]
    within = np.cumsum(torsion) - 0.5 * torsion <= 2.0
    return float(hz[np.flatnonzero(within)[-1]])


def _section_energy(motion: Array, mass: Array, polar: Array, diametral: Array) -> Array:
    """Twice the kinetic energy over ω² of k modes by kind of motion, (k, 3); ``motion`` of s slices is (s, 6, k)."""
    squares = motion**2
    bending = mass @ (squares[:, 0] + squares[:, 1]) + diametral @ (squares[:, 3] + squares[:, 4])
    return np.stack((bending, polar @ squares[:, 5], mass @ squares[:, 2]), axis=1)


def listed_modes(
    hz: Array, shares: Array, kinds: tuple[str, ...] = KINDS, above: float = 1.0, up_to: float = LISTED_HZ
) -> list[dict[str, Any]]:
    """Rows of a report for modes between ``above`` and ``up_to`` Hz: frequency, shape, and shares (k, kinds)."""
    return [
        {"hz": float(f), "shape": kinds[int(np.argmax(share))], "shares": dict(zip(kinds, share.tolist(), strict=True))}
        for f, share in zip(hz, shares, strict=True)
        if above < f <= up_to
    ]


def reduction_quality(body: ReducedBody) -> dict[str, Any]:
    """Quality of a body's reduction for a report; JSON-able."""
    from cranktrain.structure.fem.reduction import CHECKED_HZ

    other = "lumped_hz" if "lumped_hz" in body.records else "consistent_hz"
    full = body.records.get("full_hz", np.zeros(0))
    beside = [body.records[name] for name in (other, "tied_hz") if name in body.records]
    whole = full.ndim == 1 and other in body.records and all(one.shape == full.shape for one in beside)
    if not (whole and {"dofs_full", "max_relative_error", "static_error", "rigid_hz"} <= body.quality.keys()):
        return {"modes": body.n_modes, **body.quality}  # a superelement was reduced by another program
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
    """Real shapes (n, k) of complex modes: motion at the instant when each mode has its largest amplitude."""
    turned = shapes * np.exp(-0.5j * np.angle((shapes**2).sum(axis=0)))
    return np.ascontiguousarray(turned.real)
