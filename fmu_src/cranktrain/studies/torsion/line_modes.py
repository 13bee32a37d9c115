"""Modes of the cranktrain with its drive line, named by the distribution of their energy.

Rotors of the drive line are further coordinates of the cranktrain at rest
(:func:`cranktrain.structure.crank.modal.cranktrain_matrices`). Each shaft between flywheel, rotors and dynamometer adds
its stiffness at its twist. The dynamometer turns at given speed, so it is at rest here; a line without a shaft to it
ends freely. Elements over torque have the stiffness without torque, elements over frequency that of their stated
frequency.

A mode belongs to the drive line if its shafts hold at least half of the strain energy, or its rotors half of the
kinetic energy. Such a mode is called ``drive line, n-node``: n is the number of shafts and crank sections whose ends
turn against each other, rotations of geared discs being taken over their speed. A dynamometer at rest is no node. Other
modes have the name of the crank's largest fraction of kinetic energy.

Source: W. Ker Wilson, *Practical Solution of Torsional Vibration Problems*, vol. 1 (1956).
"""

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.engine.model import Engine
from cranktrain.engine.torsional_chain import DYNAMOMETER, FLYWHEEL
from cranktrain.loads.torsional_line import DAMPING, STIFFNESS, TorsionalLine, torsional_line
from cranktrain.results.columns import NOTHING
from cranktrain.results.tables import Table
from cranktrain.structure.crank.modal import KINDS, LISTED_HZ, at_largest, cranktrain_matrices, energy_shares
from cranktrain.studies.torsion.damped_modes import DampedModes

LINE = "drive line"
THRESHOLD = 0.5
"""Fraction of a mode's strain or kinetic energy in the drive line from which the mode belongs to the drive line."""
MAIN_ORDERS = 4
"""Number of multiples of the firings per revolution for which critical speeds are given."""
FREE_HZ = 1.0e-3
"""Modes below this frequency, Hz, are rotations of crank and drive line as a whole."""
STILL = 1.0e-6
"""Fraction of a mode's largest rotation below which a position counts as not rotating."""


class LineModes(NamedTuple):
    """Undamped modes of crank and drive line in order of frequency.

    Attributes
    ----------
    hz : (k,)
    shapes : (n + r, k) of unit modal mass, in the crankshaft's modes and the rotors' rotations
    shares : (k, 4) kinetic energy of the crank by kind, and of the rotors, over the whole
    strain : (k,) fraction of the strain energy in the line's shafts
    damping_ratios : (k,) by shafts and discs of the drive line, and of a crank from a table
    names : (k,)
    rotations : (places, k) of ``places``, over the largest
    places : names of pulley, flywheel and rotors
    """

    hz: Array
    shapes: Array
    shares: Array
    strain: Array
    damping_ratios: Array
    names: tuple[str, ...]
    rotations: Array
    places: tuple[str, ...]

    @property
    def of_line(self) -> NDArray[np.bool_]:
        """True for modes (k,) of the drive line."""
        return np.array([name.startswith(LINE) for name in self.names], dtype=bool)


def with_line(stiffness: Array, mass: Array, flywheel: Array, line: TorsionalLine) -> tuple[Array, Array, Array]:
    """K, M (n + r, n + r) of a structure (n,) with the line's rotors, and the shafts' twists (s, n + r).

    ``flywheel`` (n,) is the flywheel's rotation in the structure's coordinates.
    """
    n, r = flywheel.size, line.inertia.size
    places = np.zeros((r + 2, n + r))
    places[0, :n], places[1:-1, n:] = flywheel, np.eye(r)
    twists = line.twists @ places
    whole_stiffness, whole_mass = np.zeros((n + r, n + r)), np.zeros((n + r, n + r))
    whole_stiffness[:n, :n], whole_mass[:n, :n] = stiffness, mass
    whole_mass[n:, n:] = np.diag(line.inertia)
    return whole_stiffness + twists.T @ (line.laws[:, STIFFNESS, None] * twists), whole_mass, twists


def line_modes(engine: Engine, crankshaft: ReducedBody, ring_inertia: float = 0.0) -> LineModes:
    """Modes of the cranktrain at rest with its drive line, without the rotation of both as a whole.

    ``crankshaft`` is the complete one, ``ring_inertia`` (kg m²) that of a damper's ring that turns with the pulley.
    """
    stiffness, mass = cranktrain_matrices(engine, crankshaft)
    hub = crankshaft.shapes[crankshaft.index("pulley"), 5]
    mass = mass + ring_inertia * np.outer(hub, hub)
    line = torsional_line(engine.without_additions)
    flywheel = crankshaft.shapes[crankshaft.index(FLYWHEEL), 5]
    stiffness, mass, twists = with_line(stiffness, mass, flywheel, line)
    squares, shapes = eigh(stiffness, mass)
    kept = squares > (2.0 * math.pi * FREE_HZ) ** 2
    squares, shapes = squares[kept], shapes[:, kept]
    omega = np.sqrt(squares)
    strain = line.laws[:, STIFFNESS] @ (twists @ shapes) ** 2 / squares
    lost = (line.laws[:, DAMPING, None] + line.hysteresis[:, None] / omega) * (twists @ shapes) ** 2
    n = flywheel.size
    if crankshaft.shafts:
        spring, viscous, loss = crankshaft.shaft_laws.T[..., None]
        lost = np.vstack((lost, (viscous + loss * spring / omega) * (crankshaft.twists @ shapes[:n]) ** 2))
    rotors = line.inertia @ shapes[n:] ** 2 if line.inertia.size else np.zeros(squares.size)
    own = energy_shares(engine, crankshaft, shapes[:n], rods=True)
    shares = np.column_stack(((1.0 - rotors)[:, None] * own, rotors))
    rotations = np.vstack((hub @ shapes[:n], flywheel @ shapes[:n], shapes[n:]))
    rotations = rotations / rotations[np.abs(rotations).argmax(axis=0), np.arange(omega.size)]
    places = ("pulley", FLYWHEEL, *line.names)
    return LineModes(
        omega / (2.0 * math.pi), shapes, shares, strain, lost.sum(axis=0) / (2.0 * omega),
        mode_names(engine, crankshaft, line, shapes, strain, rotors), rotations, places,
    )  # fmt: skip


def mode_names(
    engine: Engine, crankshaft: ReducedBody, line: TorsionalLine, shapes: Array, strain: Array, rotors: Array
) -> tuple[str, ...]:  # fmt: skip
    """Names (k,) of modes (n + r, k) by the fractions of strain in shafts and of kinetic energy in rotors (k,)."""
    n = crankshaft.n_modes
    kinds = [KINDS[int(np.argmax(share))] for share in energy_shares(engine, crankshaft, shapes[:n], rods=True)]
    nodes = node_counts(crankshaft, line, shapes)
    suffixes = [f", {count}-node" if line.names else "" for count in nodes]
    of_line = (strain >= THRESHOLD) | (rotors >= THRESHOLD)
    return tuple(LINE + suffix if mine else kind for mine, suffix, kind in zip(of_line, suffixes, kinds, strict=True))


def node_counts(crankshaft: ReducedBody, line: TorsionalLine, shapes: Array) -> list[int]:
    """Number of nodes of each mode (n + r, k) between pulley and the far ends."""
    n = crankshaft.n_modes
    journals = [name for name in crankshaft.interfaces if name.startswith("main[")]
    along = [crankshaft.shapes[crankshaft.index(name), 5] @ shapes[:n] for name in ("pulley", *journals, FLYWHEEL)]
    turns = {FLYWHEEL: along[-1], DYNAMOMETER: np.zeros(shapes.shape[1])}
    turns |= {name: shapes[n + k] / line.speeds[k] for k, name in enumerate(line.names)}
    pairs = list(pairwise(along))
    names = (FLYWHEEL, *line.names, DYNAMOMETER)
    for row in line.twists[: len(line.shafts)]:
        ends = np.flatnonzero(row)
        if ends.size == 2:
            pairs.append((turns[names[ends[0]]], turns[names[ends[1]]]))
    largest = np.max(np.abs([*along, *turns.values()]), axis=0)
    count = np.zeros(shapes.shape[1], dtype=int)
    for one, two in pairs:
        count += (one * two < 0.0) & (np.minimum(np.abs(one), np.abs(two)) > STILL * largest)
    return [int(one) for one in count]


def line_report(engine: Engine, crankshaft: ReducedBody) -> dict[str, Any]:
    """Torsional modes of crank and drive line up to 1000 Hz, with critical speeds of the main orders; JSON-able."""
    modes = line_modes(engine, crankshaft)
    orders = [k * engine.n_cylinders * 2.0 * math.pi / engine.cylinders.cycle for k in range(1, MAIN_ORDERS + 1)]
    listed = []
    for k, (hz, name) in enumerate(zip(modes.hz.tolist(), modes.names, strict=True)):
        if hz > LISTED_HZ or not (name.startswith(LINE) or name == "torsional"):
            continue
        listed.append({
            "hz": hz,
            "shape": name,
            "shares": dict(zip((*KINDS, LINE), modes.shares[k].tolist(), strict=True)),
            "strain_in_line": float(modes.strain[k]),
            "damping_ratio": float(modes.damping_ratios[k]),
            "rotations": dict(zip(modes.places, modes.rotations[:, k].tolist(), strict=True)),
            "critical_rpm": {f"{order:g}": 60.0 * hz / order for order in orders},
        })  # fmt: skip
    line = torsional_line(engine)
    end = "free" if line.free else "held at the dynamometer's given speed"
    return {
        "modes": listed,
        "far_end": "free" if line.free else "held",
        "definition": f"cranktrain at rest with its drive line, whose far end is {end}; a mode is the drive line's if "
        "its shafts hold half of the strain energy or its discs half of the kinetic energy; damping by shafts and "
        "discs of the line and of a crank from a table alone",
    }


def line_table(report: Mapping[str, Any]) -> Table:
    """Table of torsional modes of crank and drive line, with critical speeds."""
    rows = tuple(
        (
            f"{mode['hz']:.2f}", mode["shape"], f"{100.0 * mode['shares'][LINE]:.0f}",
            f"{100.0 * mode['strain_in_line']:.0f}", f"{100.0 * mode['damping_ratio']:.2g}",
            ", ".join(f"{place} {turn:.3f}" for place, turn in mode["rotations"].items()),
            ", ".join(f"{order}: {rpm:.0f}" for order, rpm in mode["critical_rpm"].items()) or NOTHING,
        )
        for mode in report["modes"]
    )  # fmt: skip
    header = (
        "Hz", "shape", "energy in discs / %", "strain in line / %", "damping / %", "rotations",
        "critical rev/min by order",
    )  # fmt: skip
    return Table(f"Crank and drive line at rest, far end {report['far_end']}", header, rows)


def named_with_line(
    engine: Engine, crankshaft: ReducedBody, line: TorsionalLine, crank_mass: Array, modes: DampedModes
) -> tuple[str, ...]:  # fmt: skip
    """Names of modes (n + r, k) that may be complex; ``crank_mass`` (n, n) is that of the first coordinates."""
    shapes, omega = modes.shapes, np.abs(modes.values)
    *_, twists = with_line(crank_mass, crank_mass, crankshaft.shapes[crankshaft.index(FLYWHEEL), 5], line)
    n = crank_mass.shape[0]
    crank = np.sum(shapes[:n].conj() * (crank_mass @ shapes[:n]), axis=0).real
    rotors = line.inertia @ np.abs(shapes[n:]) ** 2 if line.inertia.size else np.zeros(omega.size)
    whole = crank + rotors
    strain = line.laws[:, STIFFNESS] @ np.abs(twists @ shapes) ** 2 / (omega**2 * whole)
    return mode_names(engine, crankshaft, line, at_largest(shapes), strain, rotors / whole)
