"""Distance of two runs in an output family, and the parts of a total error.

Of each member m (an output, or the axes of one vector) the RMS of the difference over the RMS of the reference's
alternating part, and of these the largest,

    |y − z| = max_m  ( Σ_axes mean (y − z)² / Σ_axes var y_ref )^½ .

Of families whose means are a matter of the run's past the alternating parts alone are compared. Cycles are taken as
Fourier series over 720° at the reference's samples, whatever their own are, so that with the one scale in all of them
this is a norm: distances add up along any way of runs.
"""

from __future__ import annotations

import math

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.engine.model import Engine
from cranktrain.studies.total_error.families import Cycle, Family
from cranktrain.studies.total_error.point import Split


def split(family: Family, engine: Engine, last: Cycle, after: Cycle, fine: Cycle, reference: Cycle) -> Split | None:
    """Total error of a run and its parts; None where a model lacks the outputs.

    Parameters
    ----------
    last, after : the run's last cycle and the one that would follow
    fine : last cycle of the same model with a fine step
    reference : that of the best model, likewise
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
    """A periodic cycle of samples at the ends of even intervals, (n,), at so many of them, by its Fourier series."""
    n = values.size
    if n == count:
        return values
    lines = np.fft.rfft(np.roll(values, 1)) / n  # the end of a cycle is its start
    kept = np.zeros(count // 2 + 1, dtype=complex)
    most = min(n, count) // 2
    kept[: most + 1] = lines[: most + 1]
    if min(n, count) % 2 == 0 and n != count:
        kept[most] *= 0.5 if n < count else 2.0  # Nyquist's line is two in the finer series
    return np.roll(np.fft.irfft(kept * count, count), -1)
