"""Largest pressure of an elastic film in a cycle, with a measure of how well the axial grid resolves it.

A tilted journal presses on one edge of its shell, so the pressure extends over a fraction of the width only. A film is
not resolved if a single axial line carries the pressure and the lines on both sides of it have no pressure. The measure
is the *drop*,

    1 − (p_before + p_after)/(2 p),

where p is the largest pressure of all nodes and the others are pressures of the axial neighbours in the same column (0
if ruptured or at an end of the bore). The drop is 1 for a single line, and (s/w)² for lines at a spacing s on a
parabola of half width w. It is evaluated when the pressure is the largest of the cycle.
"""

import math

import numpy as np

from cranktrain.core.kernel import RECORDS, kernel
from cranktrain.core.types import Array

PEAK, PEAK_ANGLE, PEAK_DROP, PEAK_CYCLE, PEAKS = range(5)
"""Columns of a film's entry: largest pressure of the present cycle (Pa), crank angle of this pressure (rad), drop
(see the module), number of the cycle."""
CYCLE = 4.0 * math.pi


@kernel
def keep_peak(peaks, pressure, unknowns, n_z, angle):
    """Update ``peaks`` (PEAKS,) with the largest pressure of a film in the present cycle.

    ``pressure`` is the largest of the film, Pa; ``angle`` the crank angle with whole turns, rad; ``unknowns``
    (n_phi n_z,) the node unknowns, see :mod:`cranktrain.film.elastic.balance`.
    """
    # A step that ends exactly at the end of a cycle still belongs to this cycle.
    cycle = math.floor(angle / CYCLE - 1.0e-9)
    if cycle != peaks[PEAK_CYCLE]:
        peaks[PEAK] = 0.0
        peaks[PEAK_CYCLE] = cycle
    if not pressure > peaks[PEAK]:
        return
    peaks[PEAK] = pressure
    peaks[PEAK_ANGLE] = angle - CYCLE * cycle
    peaks[PEAK_DROP] = pressure_drop(unknowns, n_z)


@kernel
def pressure_drop(unknowns, n_z):
    """Return the drop (see the module) at the node of the largest pressure; 0 for a film without pressure."""
    top = 0
    for k in range(unknowns.shape[0]):
        if unknowns[k] > unknowns[top]:
            top = k
    if not unknowns[top] > 0.0:
        return 0.0
    line = top % n_z
    before = max(unknowns[top - 1], 0.0) if line > 0 else 0.0
    after = max(unknowns[top + 1], 0.0) if line < n_z - 1 else 0.0
    return 1.0 - 0.5 * (before + after) / unknowns[top]


def pressure_peaks(entries: np.ndarray) -> Array | None:
    """Largest pressures of main bearings in the present cycle, (b, PEAKS); None without elastic films.

    ``entries`` (b, 3) are the kernels and records of the bearings' laws. Only a record of elastic films has ``peaks``.
    """
    for address in entries[:, 1].tolist():
        peaks = getattr(getattr(RECORDS.get(address), "memory", None), "peaks", None)
        if peaks is not None:
            return np.array(peaks)
    return None
