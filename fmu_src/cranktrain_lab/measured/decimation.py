"""Decimation (low-pass and thinning) of a channel over time, and integration of its samples."""

from __future__ import annotations

import math

import numpy as np

from cranktrain.core.types import Array
from cranktrain_lab.measured.channels import Channel


def decimated(channel: Channel, rate: float) -> tuple[float, float, Array]:
    """Return start, step and values of a channel, low-passed without delay and thinned to ``rate`` Hz or more."""
    from scipy.signal import firwin, upfirdn

    factor = max(1, math.floor(channel.rate / rate))
    if factor == 1:
        return channel.start, channel.step, channel.values()
    half = 16 * factor
    taps = firwin(2 * half + 1, 0.8 / factor, window=("kaiser", 8.0))
    block = 2**20 // factor * factor
    parts = []
    for first in range(0, channel.size, block):
        low, high = max(0, first - half), min(channel.size, first + block + half)
        values = channel.values(low, high)
        values = (
            np.where(np.isfinite(values), values, np.nanmean(values)) if not math.isfinite(values.sum()) else values
        )
        values = np.pad(values, (half - (first - low), max(0, first + block + half - high)), mode="edge")
        kept = math.ceil(min(block, channel.size - first) / factor)
        # upfirdn's output k is centred on sample k·factor − half of its input.
        parts.append(upfirdn(taps, values[: (kept - 1) * factor + 2 * half + 1], down=1)[2 * half :: factor][:kept])
    return channel.start, channel.step * factor, np.concatenate(parts)


def integrated(values: Array, step: float, times: int) -> Array:
    """Integrate values minus their mean over time, ``times`` times, with fourth order in the step."""
    for _ in range(times):
        values = values - values.mean()
        slope = np.gradient(values)
        # ∫ over a step = h (f₀ + f₁)/2 − h (f₁' − f₀')/12: exact for cubics.
        parts = step * (0.5 * (values[1:] + values[:-1]) - (slope[1:] - slope[:-1]) / 12.0)
        values = np.concatenate(([0.0], np.cumsum(parts)))
    return values
