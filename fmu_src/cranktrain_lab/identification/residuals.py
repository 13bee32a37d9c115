"""Residuals of an identification by order and speed, systematic residuals, and held-out speeds with bands."""

import cmath
import math
from typing import Any

import numpy as np
from scipy.stats import f as fisher
from scipy.stats import norm

from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain_lab.identification.comparison import Comparison, Piece
from cranktrain_lab.identification.confidence import LEVEL, Confidence
from cranktrain_lab.identification.data import Orbit
from cranktrain_lab.identification.estimate import Estimate

RARE = 0.01
"""Probability, for random residuals, below which an order's residuals are called systematic."""
MATTERS = 0.02
"""Fraction of an order's amplitudes above which systematic residuals are reported."""


def residual_rows(comparison: Comparison, found: Estimate, confidence: Confidence) -> list[dict[str, Any]]:
    """Return a row per order and orbit: points, residual relative to amplitude and noise, systematic or not.

    The row of an order has the constant of its wheel, the row of an orbit its ``bearing``.
    """
    rows: list[dict[str, Any]] = []
    for one, piece in zip(comparison.data.strands, found.pieces, strict=False):
        keep = ~one.held
        own, places = piece.rows[keep], one.speeds[keep]
        size = math.sqrt(float(np.mean(np.abs(one.values[keep]) ** 2)))
        left = np.sqrt(np.sum(own**2, axis=1))
        noise = np.where(np.isfinite(one.noise[keep]), one.noise[keep], comparison.biases[one.name].noise)
        runs, rms = runs_probability(own, places), math.sqrt(float(np.mean(left**2)))
        largest, rare = int(np.argmax(left)), runs < RARE
        row = {
            "set": one.name, "points": int(keep.sum()), "residual_percent": 100.0 * rms / size if size else None,
            "over_noise": rms / math.sqrt(own.shape[1] * float(np.mean(noise**2))), "runs_probability": runs,
        }  # fmt: skip
        if isinstance(one, Orbit):
            row |= {
                "bearing": f"main[{one.bearing}]", "rpm": one.speed / RPM, "centre_free": one.free,
                "residual_um": 1e6 * rms, "largest_um": 1e6 * float(left[largest]),
                "largest_at_deg": math.degrees(places[largest]),
            }  # fmt: skip
        else:
            lack = lack_of_fit(own, places)
            rare = rare or (lack is not None and lack < RARE)
            row |= {
                "output": one.output, "order": one.order, "largest_at_rpm": float(places[largest] / RPM),
                "largest_percent": 100.0 * float(left[largest]) / size if size else None,
                "lack_of_fit_probability": lack, **_constant(piece, confidence),
            }  # fmt: skip
        rows.append(row | {"systematic": bool(rare and rms > MATTERS * size)})
    return rows


def _constant(piece: Piece, confidence: Confidence) -> dict[str, float | None]:
    """Return the fitted constant of a toothed wheel in deg: amplitude, half width of the 95 % interval, and phase."""
    if (found := piece.constant) is None:
        return {"constant_deg": None, "constant_band_deg": None, "constant_phase_deg": None}
    spread = found.spread + found.slopes @ confidence.covariance @ found.slopes.T
    band = region(2, confidence.freedom) * math.sqrt(float(np.linalg.eigvalsh(spread)[-1]))
    return {
        "constant_deg": math.degrees(abs(found.number)), "constant_band_deg": math.degrees(band),
        "constant_phase_deg": math.degrees(cmath.phase(found.number)),
    }  # fmt: skip


def number_rows(comparison: Comparison, found: Estimate) -> list[dict[str, Any]]:
    """Return a row per measured number and shape: measured, computed, and residual in standard deviations."""
    rows: list[dict[str, Any]] = []
    first = len(comparison.data.strands)
    for one, piece in zip(comparison.data.scalars, found.pieces[first:], strict=False):
        away = float(piece.rows[0, 0])
        rows.append(
            {"set": one.name, "kind": one.kind, "number": one.number, "measured": one.value,
             "computed": one.value * math.exp(-away), "over_deviation": away / one.deviation}
        )  # fmt: skip
    for shape, piece in zip(comparison.data.shapes, found.pieces[first + len(comparison.data.scalars) :], strict=True):
        own = shape.values - piece.rows[:, 0]
        rows.append(
            {"set": shape.name, "kind": "mac", "number": shape.number, "measured": 1.0,
             "computed": float((own @ shape.values) ** 2 / (own @ own)),
             "over_deviation": float(np.sqrt(np.mean(piece.rows**2))) / shape.deviation}
        )  # fmt: skip
    return rows


def runs_probability(rows: Array, speeds: Array) -> float:
    """Return the probability that independent residuals (n, c) have as few sign changes along the speed (runs test).

    Wald and Wolfowitz, Ann. Math. Statist. 11 (1940) 147; all components together.
    """
    signs = rows[np.argsort(speeds, kind="stable")] > 0.0
    runs = mean = variance = 0.0
    for column in signs.T:
        up, n = int(column.sum()), column.size
        down = n - up
        if not up or not down:
            if n > 5:
                runs, mean, variance = runs + 1.0, mean + 0.5 * n + 1.0, variance + 0.25 * (n - 1.0)
            continue
        runs += 1.0 + float(np.count_nonzero(column[1:] != column[:-1]))
        mean += 1.0 + 2.0 * up * down / n
        variance += 2.0 * up * down * (2.0 * up * down - n) / (n**2 * (n - 1.0))
    return float(norm.cdf((runs - mean) / math.sqrt(variance))) if variance > 0.0 else 1.0


def lack_of_fit(rows: Array, speeds: Array) -> float | None:
    """Return the probability of residuals as large as these (n, c) for a correct model, by scatter at repeated speeds.

    None if no speed was repeated.
    """
    different = np.unique(speeds)
    c = rows.shape[1]
    pure, between = 0.0, 0.0
    for one in different:
        own = rows[speeds == one]
        pure += float(np.sum((own - own.mean(axis=0)) ** 2))
        between += own.shape[0] * float(np.sum(own.mean(axis=0) ** 2))
    free = c * (speeds.size - different.size)
    if free < 2 or pure <= 0.0:
        return None
    return float(fisher.sf((between / (c * different.size)) / (pure / free), c * different.size, free))


def region(parts: int, freedom: float) -> float:
    """Return the half width, in standard deviations, of the 95 % region of a point with one or two components.

    A complex order has two components, and both lie within their own 95 % intervals for only 90 % of the points.
    """
    return math.sqrt(parts * float(fisher.ppf(LEVEL, parts, freedom)))


def held_out(comparison: Comparison, found: Estimate, confidence: Confidence) -> list[dict[str, Any]]:
    """Return a row per held-out point: measured, predicted, half width of the 95 % band, inside or not.

    The half width is the largest of the 95 % region of the complex amplitude.
    """
    rows: list[dict[str, Any]] = []
    sizes = [np.abs(own) for own in comparison.own(found.inner)]
    for j, (one, piece, size) in enumerate(zip(comparison.data.strands, found.pieces, sizes, strict=False)):
        own = np.diag(comparison.covariance_of(j, size))
        for k in np.flatnonzero(piece.held).tolist():
            slopes = piece.slopes[k]
            spread = slopes @ confidence.covariance @ slopes.T + own[k] * np.eye(slopes.shape[0])
            if piece.constant is not None:
                spread += piece.constant.by[k] @ piece.constant.spread @ piece.constant.by[k].T
            reach = region(slopes.shape[0], confidence.freedom)
            left = piece.rows[k]
            rows.append(
                {
                    "set": one.name, "order": one.order, "rpm": float(one.speeds[k] / RPM),
                    "measured": float(abs(one.values[k])), "predicted": float(size[k]),
                    "band": reach * math.sqrt(float(np.linalg.eigvalsh(spread)[-1])),
                    "inside": bool(left @ np.linalg.solve(spread, left) <= reach**2),
                }
            )  # fmt: skip
    return rows
