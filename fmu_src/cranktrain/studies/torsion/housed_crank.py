"""The cranktrain with its damper's housing, and identification of its torsional modes.

The housing shifts the torsional modes of the cranktrain, past bending modes at times, and mixes them with these. Its
first and second torsional mode are therefore those that hold the largest share of torsion below and above the geometric
mean of the first and second torsional frequency without damper, up to where the third one begins, see
:mod:`cranktrain.structure.crank.modal`. Where no mode up to the cut-off has the second name, there is the first one
only, sought up to the cut-off. Energy of a ring that moves with it counts for a mode, but not as torsion of
the crank: a ring that swings on its spring is no mode of the crank.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.loads.damper import with_damper_housing
from cranktrain.structure.crank.modal import (
    KINDS,
    at_largest,
    cranktrain_matrices,
    energy_shares,
    first_torsional,
    pulley_answers,
    second_reach,
    torsional_frequencies,
)
from cranktrain.structure.crank.reduction import complete_crankshaft

# Frequency (Hz) below which a mode is the rigid rotation, or the creep of the ring after the hub.
SLOWEST_HZ = 1.0


class HousedCrank(NamedTuple):
    """Cranktrain at rest with the damper's housing on its pulley and without the ring (SI).

    Attributes
    ----------
    engine, crankshaft : with the housing
    stiffness, mass : (n, n) of the cranktrain, in the crankshaft's modes
    omega, shapes : (n,) rad/s and (n, n) its undamped modes, of unit modal mass; the first turns it as a whole
    hub : (n,) rotation of the pulley per modal coordinate of the crankshaft
    border_hz : frequency that divides first from second torsional modes, Hz
    torsional : index of the first torsional mode, and of the second where there is one
    """

    engine: Engine
    crankshaft: ReducedBody
    stiffness: Array
    mass: Array
    omega: Array
    shapes: Array
    hub: Array
    border_hz: float
    torsional: tuple[int, ...]

    def most_torsional(
        self, hz: Array, shapes: NDArray[Any], low: float, high: float, ring_energy: Array | float = 0.0
    ) -> int:
        """Index of the mode with the largest fraction of torsion between two frequencies, Hz.

        ``hz`` is (k,), ``shapes`` (n, k) real or complex; ``ring_energy`` (k,) is what a mode's xᴴ M x holds besides.
        """
        real = energy_shares(self.engine, self.crankshaft, at_largest(shapes), rods=True)
        crank = np.sum(shapes.conj() * (self.mass @ shapes), axis=0).real
        torsion = real[:, KINDS.index("torsional")] * crank / (crank + ring_energy)
        return int(np.argmax(np.where((hz > low) & (hz <= high), torsion, -1.0)))


def housed_crank(engine: Engine, body: ReducedBody) -> HousedCrank:
    """Cranktrain of an engine with its damper's housing; ``body`` is the bare reduced crankshaft.

    Raises ``InputError``: an engine without damper, or whose crank has no torsional mode.
    """
    housed = with_damper_housing(engine)
    crankshaft, plain = complete_crankshaft(housed, body), complete_crankshaft(engine, body)
    stiffness, mass = cranktrain_matrices(housed, crankshaft)
    squares, shapes = eigh(stiffness, mass)
    omega = np.sqrt(np.maximum(squares, 0.0))
    omega[0] = 0.0
    plain_squares, plain_shapes = eigh(*cranktrain_matrices(engine, plain))
    hz = np.sqrt(plain_squares[1:]) / (2.0 * math.pi)
    shares = energy_shares(engine, plain, plain_shapes[:, 1:], rods=True)
    cutoff = engine.reduction.running_cutoff_hz
    answers = pulley_answers(engine, plain, plain_shapes[:, 1:], plain_squares[1:])
    first = first_torsional(hz, shares, cutoff, answers)
    second = torsional_frequencies(hz, shares, answers, cutoff)[1]
    border = cutoff if second is None else math.sqrt(first * second)
    hub = crankshaft.shapes[crankshaft.index("pulley"), 5]
    crank = HousedCrank(housed, crankshaft, stiffness, mass, omega, shapes, hub, border, ())
    own = omega / (2.0 * math.pi)
    reach = second_reach(own[1:], energy_shares(housed, crankshaft, shapes[:, 1:], rods=True))
    spans = [(SLOWEST_HZ, border), (border, max(reach, second or 0.0))][: 1 if second is None else 2]
    return crank._replace(torsional=tuple(crank.most_torsional(own, shapes, *span) for span in spans))
