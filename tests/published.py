"""Modes of an engine beside the reference's list, matched one to one by shape and frequency."""

import numpy as np
from scipy.optimize import linear_sum_assignment

from cranktrain.structure.crank.modal import KINDS


def beside_published(published, modes):
    """Pairs (published, ours) in Hz, and what is left of ours up to the last published frequency.

    ``modes`` as a report lists them; only those that have the target's shape as the crank's largest share can be its
    partner, however much the block moves along.
    """
    hz = np.array([m["hz"] for m in modes])
    shapes = [max(KINDS, key=m["shares"].get) for m in modes]
    cost = [
        [abs(np.log(own / target)) if kind == shape else 10.0 for own, kind in zip(hz, shapes, strict=True)]
        for target, shape in zip(published.cranktrain_hz, published.cranktrain_shapes, strict=True)
    ]
    rows, columns = linear_sum_assignment(cost)
    assert all(cost[r][c] < 10.0 for r, c in zip(rows, columns, strict=True)), shapes
    last = 1.02 * max(published.cranktrain_hz)
    left = [float(f) for i, f in enumerate(hz) if i not in columns and f < last]
    return [(published.cranktrain_hz[r], float(hz[c])) for r, c in zip(rows, columns, strict=True)], left
