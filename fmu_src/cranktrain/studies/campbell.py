"""Campbell diagram: frequencies at rest of the turning cranktrain over its speed, modes followed through crossings.

*At rest* is the state of the bearings: stand-in springs and a closed collar, as in the list of ``cranktrain modal``.
The modes of a running crank differ (:mod:`cranktrain.studies.in_motion`), and its orders peak at those frequencies.

Modes are those of

    M q̈ + C q̇ + K q = 0

of :mod:`cranktrain.dynamics.linear` with the mean tangents of a uniform rotation: gyroscopic, centrifugal
and stress stiffness, mean mass of the rods, main bearings as springs, thrust closed, the drive line with its discs; no
damping but the torsional damper's, at small amplitude and as warm as its table says. Frequencies are
given in axes of the turning crank, like the orders of its rods. An order is in resonance where its frequency equals
that of a mode. Torsion and axial motion have the same frequencies in axes at rest; bending is split by ±Ω there.

Bodies that an engine's file adds are further coordinates, in the bands of :mod:`cranktrain.dynamics.linear`,
with their connections linear as in :mod:`cranktrain.studies.torsion.added_orders`. A mode that moves mostly in bands
other than 0 is a copy of another one and is left out.

Neighbouring speeds are matched by the modal assurance criterion |x̄ᵀ y|²/((x̄ᵀ x)(ȳᵀ y)), in coordinates of unit mass,
so that each mode keeps its name where two frequencies cross. A mode is named at the first speed, as the drive line's
(:mod:`cranktrain.studies.torsion.line_modes`) or by its largest share of kinetic energy
(:mod:`cranktrain.structure.crank.modal`), counted from the lowest.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.core.types import Progress
from cranktrain.dynamics.linear import SmallMotions, mean_places
from cranktrain.dynamics.model import slots
from cranktrain.dynamics.model.records import ModelArrays, dimensions
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.tangents import tangents_in_rotation
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Damper
from cranktrain.loads.damper import STIFFNESS, damper_parameters, damper_temperature, damping_coefficient
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.loads.torsional_line import DAMPING, torsional_line
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
from cranktrain.studies.torsion.added_orders import linear_model, not_linear
from cranktrain.studies.torsion.damped_modes import DampedModes, damped_modes
from cranktrain.studies.torsion.line_modes import LINE, named_with_line

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
    line, n = torsional_line(engine.without_additions), body.n_modes
    model = _model(engine, body, level, damper)
    motions = SmallMotions(model)
    say(f"modes at {speeds.size} speeds")
    found, crank_mass = [], np.zeros((n, n))
    for speed in speeds.tolist():
        stiffness, damping, mass = _matrices(model, motions, engine.damper if damper else None, speed)
        found.append(damped_modes(stiffness, damping, mass))
        crank_mass = mass[:n, :n].real if not crank_mass.any() else crank_mass
    energy = np.abs(found[0].shapes) ** 2 / np.sum(np.abs(found[0].shapes) ** 2, axis=0)
    added = motions.mode >= model.ports.shape[1]
    copies, of_added = (np.sum(energy[kept], axis=0) >= 0.5 for kept in (added & (motions.band != 0.0), added))
    rotors = np.arange(line.inertia.size) + n + damper
    plain = found[0].shapes[np.append(np.arange(n), rotors)][:, ~of_added]
    plain[n:] /= np.sqrt(line.inertia)[:, None]
    whole = np.full(of_added.size, ADDED, dtype=object)
    whole[~of_added] = named_with_line(engine, body, line, crank_mass, DampedModes(found[0].values[~of_added], plain))
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


def _model(engine: Engine, body: ReducedBody, level: str, damper: bool) -> ModelArrays:
    """Undamped model on linear bearings and rigid ground; ``InputError`` for added bodies that have no linear form."""
    if reason := not_linear(engine):
        raise InputError(f"{reason}, which a Campbell diagram does not include; leave it out")
    settings = Settings(
        crank=level, bearings="held" if level == "torsional" else "linear", block="ground",
        damper="fitted" if damper else "none",
    )  # fmt: skip
    model = linear_model(replace(engine, axial_path=None), body, settings, GasTrace.from_engine(engine))
    shafts = model.shaft_laws.copy()
    shafts[:, DAMPING] = 0.0
    return model._replace(damping=np.zeros_like(model.damping), shaft_laws=shafts)


def _matrices(
    model: ModelArrays, motions: SmallMotions, ring: Damper | None, speed: float
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """K, C, M of small motions at a speed, undamped except for the ``ring`` of a damper."""
    damper, rods = dimensions(model).damper, set(model.cylinders[:, slots.END_ROW].astype(int).tolist())
    laws = tangents_in_rotation(model, speed, rods).mean()
    others = set(range(len(model.connections))) - rods - {damper}
    springs = tangents_in_rotation(model, 0.0, others, places=mean_places(model, others)).mean()
    laws = laws._replace(place=laws.place + springs.place, acceleration=laws.acceleration + springs.acceleration)
    if ring is not None:
        law = damper_parameters(ring, damper_temperature(ring, speed))
        laws.place[damper, 0, 0], laws.velocity[damper, 0, 0] = -law[STIFFNESS], -damping_coefficient(law)
    mass, damping, stiffness = motions.equations(speed, laws)
    return stiffness, damping, mass
