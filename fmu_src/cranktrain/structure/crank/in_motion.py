"""First torsional frequency of a cranktrain in motion without a run, with its bearings replaced by constraints.

At torsional frequencies oil films prevent motion of the journals across the axis, because the dynamic stiffness of
their damping is far above that of the crank (:mod:`cranktrain.studies.in_motion`). Journals tilt freely, and the collar
floats. Rollers have little damping and act by their stand-in springs, which follow from a run. On the shipped engines
the mode of a run lies within 0.5 %. If several modes combine torsion and bending, the first torsional one has the
largest response of the pulley to the cylinders' torques, as in :mod:`cranktrain.structure.in_motion.residues`.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import eigh, null_space

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.engine.model import Engine
from cranktrain.structure.crank.modal import energy_shares, main_springs, named_mode, pulley_answers, rod_masses


def torsional_in_motion(engine: Engine, crankshaft: ReducedBody) -> float:
    """First torsional frequency (Hz) of the complete ``crankshaft`` with rods on ground, its axis held in plain mains.

    Raises ``InputError`` for a crank without a torsional mode.
    """
    stiffness = np.diag(crankshaft.omega**2)
    motions = locked_motions(engine, crankshaft) if engine.plain_numbers else np.eye(crankshaft.n_modes)
    springs = main_springs(engine)
    for i in engine.roller_mains:
        for component, value in springs[i].items():
            row = crankshaft.shapes[crankshaft.index(f"main[{i + 1}]"), component]
            stiffness += value * np.outer(row, row)
    mass = np.eye(crankshaft.n_modes) + rod_masses(engine, crankshaft)
    squares, shapes = eigh(motions.T @ stiffness @ motions, motions.T @ mass @ motions)
    # The first two modes are the crank's rigid rotation and its axial displacement.
    squares, shapes = squares[2:], motions @ shapes[:, 2:]
    shares = energy_shares(engine, crankshaft, shapes, rods=True)
    answers = pulley_answers(engine, crankshaft, shapes, squares)
    hz = np.sqrt(squares) / (2.0 * math.pi)
    first = named_mode(hz, shares, "torsional", answers=answers)
    if first is None:
        raise InputError("crankshaft has no torsional mode; set reduction.torsional_source to solid")
    return float(hz[first])


def locked_motions(engine: Engine, crankshaft: ReducedBody) -> Array:
    """Orthonormal motions (n, k) in which the journals of plain mains do not move across the axis."""
    mains = [crankshaft.index(f"main[{i + 1}]") for i in engine.plain_numbers]
    return np.asarray(null_space(crankshaft.shapes[mains, :2].reshape(-1, crankshaft.n_modes)))
