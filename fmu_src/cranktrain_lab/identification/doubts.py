"""Warnings on unlikely identified values, each in one sentence: a value at its bound, or an impossible load."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from cranktrain_lab.identification.parameters import LOAD

MOST_LOAD = 1.4
"""Ratio of identified load to full load of the engine file above which the amplitudes are doubted."""
PEAK_TO_PEAK = (
    "amplitudes are zero to peak: peak-to-peak ones are twice as large, r.m.s. values 0.71 times; or combustion.heat "
    "is too small"
)


def doubtful_values(rows: Sequence[Mapping[str, Any]], amplitudes: bool) -> Iterator[str]:
    """Yield warnings on rows of parameters; ``amplitudes``: True if orders are among the data."""
    for row in rows:
        value, unit = row["value"], "" if row["unit"] == "1" else f" {row['unit']}"
        hint = ""
        if row["key"] == LOAD and amplitudes and value > MOST_LOAD:
            hint = f"; {PEAK_TO_PEAK}"
        if row["at_bound"]:
            low, high = row["bounds"]
            side, other = ("lower", "less") if abs(value - low) < abs(value - high) else ("upper", "more")
            yield (
                f"{row['key']} lies at its {side} bound, {value:.4g}{unit}: the data want {other}, and the other "
                f"values make up for it; widen the bound{hint or ', or seek what else differs'}"
            )
        elif hint:
            yield f"{row['key']} is {value:.3g} times the full load of the engine file{hint}"
