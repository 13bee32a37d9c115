"""Distance of two runs in an output family, and the parts of a total error.

For each member m (an output, or the axes of one vector) the RMS of the difference is divided by the RMS of the
reference's alternating part. The distance is the largest of these ratios,

    |y − z| = max_m  ( Σ_axes mean (y − z)² / Σ_axes var y_ref )^½ .

In families whose means depend on the history of a run, only alternating parts are compared. Cycles are resampled by
Fourier series over 720° at the reference's samples. All distances have the same scale, so they obey the triangle
inequality.
"""

from __future__ import annotations

import math

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.engine.model import Engine
from cranktrain.studies.total_error.families import Cycle, Family
from cranktrain.studies.total_error.point import Split


def split(family: Family, engine: Engine, last: Cycle, after: Cycle, fine: Cycle, reference: Cycle) -> Split | None:
    """Return the total error of a run in a family, and its parts; None if one of the models lacks the family's outputs.

    Parameters
    ----------
    last, after : the run's last cycle and the one that would follow
    fine : last cycle of the same model with a fine step
    reference : last cycle of the best model with a fine step
    """
    found = [
        distance(family, engine, one, other, reference)
        for one, other in ((last, reference), (fine, reference), (last, fine), (after, last))
    ]
    total, model, numerical, settling = found
    if total is None or model is None or numerical is None or settling is None:
        return None
    return Split(total, model, numerical, settling)


def distance(family: Family, engine: Engine, one: Cycle, other: Cycle, reference: Cycle) -> float | None:
    """Return the distance of two cycles in a family, relative to the reference's alternating part, or None.

    A member that is constant in the reference is ignored.
    """
    largest = None
    for names in family.members(engine):
        if any(name not in cycle for cycle in (one, other, reference) for name in names):
            return None
        square, scale = 0.0, 0.0
        for name in names:
            count = reference[name].size
            difference = resampled(one[name], count) - resampled(other[name], count)
            square += float(np.var(difference) if family.alternating else np.mean(difference**2))
            scale += float(np.var(reference[name]))
        if scale > 0.0:
            largest = max(largest or 0.0, math.sqrt(square / scale))
    return largest


def resampled(values: Array, count: int) -> Array:
    """Resample a periodic cycle, given at the ends of n equal intervals, at ``count`` intervals by Fourier series."""
    n = values.size
    if n == count:
        return values
    lines = np.fft.rfft(np.roll(values, 1)) / n  # the last sample, at the end of the cycle, is also its start
    kept = np.zeros(count // 2 + 1, dtype=complex)
    most = min(n, count) // 2
    kept[: most + 1] = lines[: most + 1]
    if min(n, count) % 2 == 0 and n != count:
        kept[most] *= 0.5 if n < count else 2.0  # the Nyquist line splits into two in the finer series
    return np.roll(np.fft.irfft(kept * count, count), -1)
