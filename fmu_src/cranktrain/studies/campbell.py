"""Campbell diagram: frequencies at rest of the turning cranktrain over its speed, modes followed through crossings.

*At rest* is the state of the bearings: stand-in springs and a closed collar, as in the list of ``cranktrain modal``.
The modes of a running crank differ (:mod:`cranktrain.studies.in_motion`), and its orders peak at those frequencies.

Modes are those of

    M q̈ + (C − Cᵀ)/2 q̇ + K q = 0

with the cycle means of the matrices of :class:`cranktrain.studies.torsion.periodic_crank.PeriodicCrank`: gyroscopic,
centrifugal and stress stiffness, mean mass of the rods, main bearings as springs, thrust closed, the drive line with
its discs; no damping but the torsional damper's, whose ring is one more coordinate
(:mod:`cranktrain.studies.torsion.damped_modes`), at small amplitude and as warm as its table says. Frequencies are
given in axes of the turning crank, like the orders of its rods. An order is in resonance where its frequency equals
that of a mode. Torsion and axial motion have the same frequencies in axes at rest; bending is split by ±Ω there.

Bodies that an engine's file adds are further coordinates, in the bands of :mod:`cranktrain.structure.in_motion.linear`,
with their connections linear as in :mod:`cranktrain.studies.torsion.added_orders`. A mode that moves mostly in bands
other than 0 is a copy of another one and is left out.

Neighbouring speeds are matched by the modal assurance criterion |x̄ᵀ y|²/((x̄ᵀ x)(ȳᵀ y)), in coordinates of unit mass,
so that each mode keeps its name where two frequencies cross. A mode is named at the first speed, as the drive line's
(:mod:`cranktrain.studies.torsion.line_modes`) or by its largest share of kinetic energy
(:mod:`cranktrain.structure.crank.modal`), counted from the lowest.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.core.types import Progress
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Damper
from cranktrain.loads.damper import STIFFNESS, damper_parameters, damper_temperature, damping_coefficient
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.loads.torsional_line import TorsionalLine, torsional_line
from cranktrain.results.orders.modes_over_speed import ModesOverSpeed
from cranktrain.structure.crank.modal import (
    KINDS,
    at_largest,
    cranktrain_matrices,
    cranktrain_modes,
    energy_shares,
    listed_to,
    named_mode,
    pulley_answers,
    torsional_frequencies,
)
from cranktrain.structure.in_motion.eigenproblem import slowest_hz
from cranktrain.structure.in_motion.linear import Equations, SmallMotions
from cranktrain.studies.torsion.added_orders import linear_model, links, not_linear
from cranktrain.studies.torsion.damped_modes import DampedModes, damped_modes, with_ring
from cranktrain.studies.torsion.line_modes import LINE, named_with_line, with_line
from cranktrain.studies.torsion.periodic_crank import PeriodicCrank

HIGHEST_ORDER = 4.0
"""Highest order that the samples for the cycle means resolve."""
ADDED = "added"
"""Kind of modes that hold most of their kinetic energy in bodies that an engine's file adds."""
_SPARE_HZ = 1.5
"""Modes up to this fraction above the wanted range are followed too, because their frequencies may decrease."""


def campbell(
    engine: Engine,
    body: ReducedBody,
    speeds: Array,
    level: str = "torsional",
    highest_hz: float | None = None,
    damper: bool = False,
    say: Progress = lambda stage: None,
) -> ModesOverSpeed:
    """Compute the natural frequencies of the turning crank over the speed.

    Raises ``InputError``: fewer than two speeds, or none that increase.

    Parameters
    ----------
    engine, body : the engine and its running body, with all parts attached
    speeds : (s,) rad/s, increasing and near enough to one another that shapes change little
    level : crank level of the body: ``torsional`` keeps its journals on their axis
    highest_hz : modes up to this frequency at the first speed; None: 1000 Hz, or the first torsional mode if higher
    damper : True to include the ring of the engine's damper; the body contains its housing
    say : receives the name of each stage
    """
    speeds = np.asarray(speeds, dtype=float)
    if speeds.size < 2 or not np.all(np.diff(speeds) > 0.0):
        raise InputError("a Campbell diagram takes two speeds or more, increasing")
    gas = GasTrace.from_engine(engine)
    mains = "held" if level == "torsional" else "linear"
    ring = engine.damper if damper else None
    line = torsional_line(engine.without_additions)
    attached = line if engine.drive_line_chain is not None else None
    links, bands = _links(engine, body, level, mains, gas)
    say(f"rods at {speeds.size} speeds")
    cranks = [PeriodicCrank(engine, body, speed, gas, 1.0, HIGHEST_ORDER, mains) for speed in speeds.tolist()]
    say(f"modes at {speeds.size} speeds")
    found = [
        _modes(crank, body, attached, ring, speed, None if links is None else links(speed))
        for crank, speed in zip(cranks, speeds.tolist(), strict=True)
    ]
    rotors = np.sqrt(line.inertia)
    n, size = body.n_modes, body.n_modes + line.inertia.size
    energy = np.abs(found[0].shapes) ** 2 / np.sum(np.abs(found[0].shapes) ** 2, axis=0)
    energy = energy[len(energy) - bands.size :]
    copies, of_added = (np.sum(energy[bands != 0.0], axis=0) >= 0.5, np.sum(energy, axis=0) >= 0.5)
    plain = found[0].shapes[:size, ~of_added].copy()
    plain[n:] /= rotors[:, None]
    whole = np.full(of_added.size, ADDED, dtype=object)
    whole[~of_added] = named_with_line(
        engine, body, line, cranks[0].mass, DampedModes(found[0].values[~of_added], plain)
    )
    of_line = np.array([name.startswith(LINE) for name in whole])
    at_rest = torsional_frequencies(*cranktrain_modes(engine, body), engine.reduction.running_cutoff_hz)[0]
    highest_hz = listed_to([at_rest]) if highest_hz is None else highest_hz
    wanted = (of_line | (found[0].hz > slowest_hz(at_rest))) & (found[0].hz <= _SPARE_HZ * highest_hz)
    place = np.flatnonzero(wanted & ~copies)
    lines = [whole[k] if of_line[k] or of_added[k] else "" for k in place]
    hz, agreement = [found[0].hz[place]], []
    shapes = found[0].shapes[:, place]
    first = shapes
    for modes in found[1:]:
        alike = assurance(shapes, modes.shapes)
        _, place = linear_sum_assignment(-alike)
        agreement.append(alike[np.arange(place.size), place])
        shapes = modes.shapes[:, place]
        hz.append(modes.hz[place])
    shown = hz[0] <= highest_hz
    moved, mass = at_largest(first[:n, shown]), cranktrain_matrices(engine, body)[1]
    shares = energy_shares(engine, body, moved, rods=True)
    own = [name for name, kept in zip(lines, shown, strict=True) if kept]
    kinds = [
        ADDED if name == ADDED else LINE if name else KINDS[int(np.argmax(share))]
        for name, share in zip(own, shares, strict=True)
    ]
    own = ["" if name == ADDED else name for name in own]
    # A mode of the line is none of the crank's, which is named among the others.
    crank = [k for k, kind in enumerate(kinds) if kind in KINDS]
    moved /= np.sqrt(np.maximum(np.einsum("ik,ij,jk->k", moved, mass, moved), np.finfo(float).tiny))
    answers = pulley_answers(engine, body, moved, (2.0 * math.pi * hz[0][shown]) ** 2)[crank]
    if (first_named := named_mode(hz[0][shown][crank], shares[crank], "torsional", answers=answers)) is not None:
        kinds[crank[first_named]] = "torsional"  # also where it bends more than it twists
    names = tuple(
        name or f"{kind} {kinds[: k + 1].count(kind)}" for k, (name, kind) in enumerate(zip(own, kinds, strict=True))
    )
    return ModesOverSpeed(speeds, np.array(hz)[:, shown], names, tuple(kinds), np.array(agreement)[:, shown])


def assurance(ones: NDArray[Any], others: NDArray[Any]) -> Array:
    """Modal assurance criterion (k, m) of shapes (n, k) and (n, m), in coordinates of unit mass."""
    sizes = (np.sum(np.abs(shapes) ** 2, axis=0) for shapes in (ones, others))
    return np.asarray(np.abs(ones.conj().T @ others) ** 2 / np.outer(*sizes))


def _links(
    engine: Engine, body: ReducedBody, level: str, mains: str, gas: GasTrace
) -> tuple[Callable[[float], Equations] | None, Array]:
    """Equations of added bodies and their connections over the speed, and bands of their coordinates; else None."""
    if not any(engine.additions):
        return None, np.zeros(0)
    if reason := not_linear(engine):
        raise InputError(f"{reason}, which a Campbell diagram does not include; leave it out")
    settings = Settings(crank=level, bearings=mains, block="ground")
    model = linear_model(replace(engine, drive_line_chain=None), body, settings, gas)
    motions = SmallMotions(model)
    crank, added, equations = links(model, motions)
    kept = np.ix_(own := np.concatenate((crank[: body.n_modes], added)), own)
    return lambda speed: Equations(*(part[kept] for part in equations(speed))), motions.band[added]


def _joined(parts: Sequence[Array], links: Equations, crank: int) -> list[NDArray[Any]]:
    """K, C, M of a structure with added bodies, whose coordinates come last; undamped.

    The first coordinates of both are the crank's, ``crank`` in number.
    """
    size, more = len(parts[0]), len(links.mass) - crank
    at = np.append(np.arange(crank), np.arange(size, size + more))
    whole = [np.pad(part, (0, more)).astype(np.complex128) for part in parts]
    for part, link, sign in zip(whole, (links.stiffness, links.damping, links.mass), (1.0, -1.0, 1.0), strict=True):
        part[np.ix_(at, at)] += 0.5 * (link + sign * link.conj().T)
    return whole


def _modes(
    crank: PeriodicCrank, body: ReducedBody, line: TorsionalLine | None, ring: Damper | None, speed: float,
    links: Equations | None,
) -> DampedModes:  # fmt: skip
    """Modes of the turning crank at its speed, undamped except for a damper's ring, with coordinates of unit mass.

    ``line`` is a drive line of discs, whose rotors follow the crank's coordinates; then come a ring, and added bodies
    with their ``links``.
    """
    stiffness, mass = (0.5 * (part + part.T) for part in (crank.stiffness, crank.mass))
    turning = 0.5 * (crank.damping - crank.damping.T)
    hub = body.shapes[body.index("pulley"), 5]
    if line is not None:
        stiffness, mass, _ = with_line(stiffness, mass, body.shapes[body.index("flywheel"), 5], line)
        root = np.append(np.ones(hub.size), 1.0 / np.sqrt(line.inertia))
        stiffness, mass = (root[:, None] * part * root for part in (stiffness, mass))
        more = line.inertia.size
        turning, hub = np.pad(turning, (0, more)), np.pad(hub, (0, more))
    size = len(mass)
    if ring is not None:
        law = damper_parameters(ring, damper_temperature(ring, speed))
        stiffness, damping, mass = with_ring(
            stiffness, mass, hub, ring.ring_inertia, law[STIFFNESS], damping_coefficient(law)
        )
        damping[:-1, :-1] += turning
        turning = damping
    if links is not None:
        stiffness, turning, mass = _joined((stiffness, turning, mass), links, body.n_modes)
    values, shapes = damped_modes(stiffness, turning, mass)
    if ring is not None:
        shapes[size] *= math.sqrt(ring.ring_inertia)
    return DampedModes(values, shapes)
