"""Confidence of a calibration's free values, with the tolerances of its targets as standard deviations.

With the sensitivities J = ∂ ln f/∂ ln p of the report, tolerances τ and bounds as a uniform prior,

    A = Jᵀ diag(1/τ²) J,     S = (A + diag(12/ln²(high/low)))⁻¹.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from cranktrain_lab.identification.confidence import told_apart


def with_confidence(report: Mapping[str, Any]) -> dict[str, Any]:
    """Return a calibration's report with ``deviation_percent`` of its parameters, and ``told_apart`` in words.

    Parameters that may be zero or negative have no relative deviation.
    """
    parameters = [p for p in report["parameters"] if p["low"] * p["high"] > 0.0 and p["value"]]
    keys = [p["key"] for p in parameters]
    if not keys:
        return {**report, "told_apart": []}
    rows = [
        [target["sensitivities"][key] / (0.01 * target["tolerance_percent"]) for key in keys]
        for target in report["targets"]
    ]
    slopes = np.array(rows)
    information = slopes.T @ slopes
    bounds = np.diag([12.0 / math.log(p["high"] / p["low"]) ** 2 for p in parameters])
    spread = np.sqrt(np.diag(np.linalg.inv(information + bounds)))
    known = dict(zip(keys, (100.0 * spread).tolist(), strict=True))
    own = [{**p, "deviation_percent": known.get(p["key"])} for p in report["parameters"]]
    return {**report, "parameters": own, "told_apart": told_apart(information, bounds, keys)}
