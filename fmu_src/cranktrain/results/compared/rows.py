"""Differences between two results A and B: cycles by crank angle, orders over speed, and peaks.

Every difference is B less A over a scale of A. A scale is at least ``NOISE`` times the largest value of all outputs
with the same unit in A and B. An output that is only rounding noise beside others, such as the force along an axis on
which nothing acts, therefore has no large relative difference.
"""

import math
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.dynamics.outputs.register import FAMILIES, output_family
from cranktrain.results.files import output_unit
from cranktrain.results.orders.harmonics import CYCLE, last_cycle, order_amplitudes
from cranktrain.results.orders.resonances import COUNTS, NEAR, Peak, peaks
from cranktrain.results.run_up.common_speeds import at_speeds
from cranktrain.results.run_up.plot_data import BROADEST
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.results.views.time_series import HIGHEST, TimeSeries

NOISE = 1.0e-6
"""Least scale of a difference, as a fraction of the largest value of all outputs with the same unit."""
GROWS = 0.5
"""Change over a cycle, as a fraction of the range, from which an output grows from cycle to cycle."""
Row = dict[str, Any]
Pair = tuple[Peak | None, Peak | None]


def row(quantity: str, output: str, pair: tuple[float, float], difference: float, **more: Any) -> Row:
    """Row of a comparison, with the same keys for all quantities; ``pair`` are the values in A and B."""
    unit = {"peak-speed": "rev/min", "damping": "1", "speeds": "1"}.get(quantity) or output_unit(output)
    found = {"quantity": quantity, "output": output, "unit": unit, "a": pair[0], "b": pair[1]}
    blank = {"order": None, "speed_rpm": None, "rms": None, "phase_deg": None}
    return found | {"difference": difference} | blank | more


def is_compared(name: str, outputs: Container[str]) -> bool:
    """True for an output that is among ``outputs``, or by which settling is judged.

    Left out are angles, over which all others go, sums over cycles, work of the solver, and parts of other outputs.
    """
    unjudged = {f"{family.name}.{own}".lstrip(".") for family in FAMILIES.values() for own in family.unjudged}
    return name in outputs or output_family(name) not in unjudged


def cycles(run: TimeSeries, outputs: Container[str]) -> tuple[dict[str, Array], list[str]]:
    """Last cycle of each output, (1440,) from firing dead centre of cylinder 1 on, and outputs that grow over a cycle.

    An output with a sample that is not finite has a cycle of NaN. ``outputs`` are further compared outputs.
    """
    found, grow = {}, []
    for name, values in run.outputs.items():
        if np.shape(values) != np.shape(run.angle) or not is_compared(name, outputs):
            continue
        samples = np.asarray(values, dtype=float)
        if not np.isfinite(samples).all():
            found[name] = np.full(1440, math.nan)
            continue
        cycle = last_cycle(run.angle, samples, from_zero=True)
        change = abs(samples[-1] - float(np.interp(run.angle[-1] - CYCLE, run.angle, samples)))
        if change > GROWS * np.ptp(cycle) > NOISE * np.abs(cycle).max():
            grow.append(name)
        else:
            found[name] = cycle
    return found, grow


def mean_speed(run: TimeSeries) -> float:
    """Mean speed over the last cycle of a run, rad/s."""
    begin = float(np.interp(run.angle[-1] - CYCLE, run.angle, run.time))
    return float(CYCLE / (run.time[-1] - begin))


def at_one_speed(speed: float, of: Mapping[str, Array]) -> RunUp:
    """Orders of cycles (n,) as those of a run-up with one speed, rad/s; outputs that are not finite have NaN."""
    stacked = np.array(list(of.values())).T
    orders, amplitudes = order_amplitudes(np.nan_to_num(stacked), HIGHEST)
    amplitudes[:, ~np.isfinite(stacked).all(axis=0)] = math.nan
    none, named = np.zeros(1, dtype=int), zip(of, amplitudes.T, strict=True)
    outputs = {name: own[None, :] for name, own in named}
    return RunUp(np.array([speed]), orders, outputs, {}, none, none, np.zeros(1))


def noise_of(*sides: Mapping[str, Any]) -> dict[str, float]:
    """Least scale of differences, by unit, from the values of all outputs of both results."""
    found: dict[str, float] = {}
    for name, values in (one for side in sides for one in side.items()):
        unit, sizes = output_unit(name), np.abs(values)
        largest = NOISE * float(sizes[np.isfinite(sizes)].max(initial=0.0))
        found[unit] = max(found.get(unit, 0.0), largest)
    return found


def output_rows(a: Mapping[str, Array], b: Mapping[str, Array], noise: Mapping[str, float]) -> Iterator[Row]:
    """Two rows for each output: its course without mean, over the range in A, and its mean, over the largest value."""
    for name in (name for name in a if name in b):
        x, y = (np.ravel(side[name]) for side in (a, b))
        if (np.isfinite(x) != np.isfinite(y)).any():
            yield row("output", name, (float(np.ptp(x)), float(np.ptp(y))), math.nan)
        good = np.isfinite(x) & np.isfinite(y)
        if not good.any():
            continue
        x, y = x[good], y[good]
        apart, least = y - x, noise[output_unit(name)]
        mean = float(apart.mean())
        span, size = (max(float(one), least) or 1.0 for one in (np.ptp(x), np.abs(x).max()))
        rms, most = float(np.std(apart)), float(np.abs(apart - mean).max())
        sign = math.copysign(1.0, np.ptp(y) - np.ptp(x))
        yield row("output", name, (float(np.ptp(x)), float(np.ptp(y))), sign * most / span, rms=rms / span)
        yield row("mean", name, (float(x.mean()), float(y.mean())), mean / size)


def order_rows(a: RunUp, b: RunUp, noise: Mapping[str, float]) -> Iterator[Row]:
    """Row for each order of each output, with the largest difference over the speeds, which are those of both.

    Amplitude and phase count, |b − a|, over the largest amplitude of the order in A; the sign is that of |b| − |a|.
    Orders below ``COUNTS`` times the output's largest order are left out.
    """
    orders = [order for order in a.orders.tolist() if np.isclose(b.orders, order).any()]
    for name in (name for name in a.amplitudes if name in b.amplitudes):
        sizes = [np.abs(one.amplitudes[name]) for one in (a, b)]
        top = max(float(one[np.isfinite(one)].max(initial=0.0)) for one in sizes)
        least = max(COUNTS * top, noise[output_unit(name)])
        for order in orders:
            x, y = a.order(order, name), b.order(order, name)
            good = np.isfinite(x) & np.isfinite(y)
            x, y = x[good], y[good]
            if not good.any() or max(np.abs(x).max(), np.abs(y).max()) <= least:
                continue
            apart, scale = np.abs(y - x), max(float(np.abs(x).max()), least)
            k = int(np.argmax(apart))
            more, phase = np.abs(y[k]) - np.abs(x[k]), np.degrees(np.angle(y[k] * np.conj(x[k])))
            yield row(
                "order", name, (float(np.abs(x[k])), float(np.abs(y[k]))), math.copysign(apart[k] / scale, more),
                order=order, speed_rpm=float(a.speeds[good][k] / RPM), phase_deg=float(phase),
                rms=float(np.sqrt(np.mean(apart**2))) / scale,
            )  # fmt: skip


def peak_rows(a: RunUp, b: RunUp, noise: Mapping[str, float]) -> Iterator[Row]:
    """Rows with speed, height and damping of each resonance, in pairs of one order and the nearest frequency.

    A peak that has no partner within ``NEAR`` is compared with the height of the other curve at its speed.
    """
    for name in (name for name in a.amplitudes if name in b.amplitudes):
        own, others = ([peak for peak in peaks(one, name) if not peak.damping > BROADEST] for one in (a, b))
        least = noise[output_unit(name)]
        for x, y in _paired(own, others):
            known = x or y
            assert known is not None
            order, speed = known.order, known.speed
            at = {"order": order, "speed_rpm": speed / RPM}
            if x is not None and y is not None:
                heights = x.amplitude, y.amplitude
            else:
                left, right = (at_speeds(one, np.array([speed])).order(order, name)[0] for one in (a, b))
                heights = float(np.abs(left)), float(np.abs(right))
            if max(heights) <= least:
                continue
            yield row("peak-height", name, heights, (heights[1] - heights[0]) / max(heights[0], least), **at)
            if x is None or y is None:
                continue
            yield row("peak-speed", name, (x.speed / RPM, y.speed / RPM), y.speed / x.speed - 1.0, **at)
            if math.isfinite(x.damping) and math.isfinite(y.damping):
                yield row("damping", name, (x.damping, y.damping), y.damping / x.damping - 1.0, **at)


def _paired(own: Iterable[Peak], others: Iterable[Peak]) -> list[Pair]:
    """Pairs of peaks of equal orders, the nearest first; None for the partner of a peak that has none."""
    left, right = list(own), list(others)
    apart = sorted(
        (abs(math.log(y.speed / x.speed)), i, j)
        for i, x in enumerate(left) for j, y in enumerate(right) if x.order == y.order
    )  # fmt: skip
    pairs: dict[int, int] = {}
    for distance, i, j in apart:
        if distance <= NEAR and i not in pairs and j not in pairs.values():
            pairs[i] = j
    found: list[Pair] = [(x, right[pairs[i]] if i in pairs else None) for i, x in enumerate(left)]
    return found + [(None, y) for j, y in enumerate(right) if j not in pairs.values()]


def measured_rows(deviations: Sequence[Mapping[str, Any]]) -> Iterator[Row]:
    """Rows of deviations of computed orders (B) from measured ones (A), without orders below ``COUNTS``."""
    for one in deviations:
        if one["measured_rms"] < COUNTS * max(
            own["measured_rms"] for own in deviations if own["output"] == one["output"]
        ):
            continue
        at = {"order": one["order"]}
        if one["rms_percent"] is not None:
            rms = 0.01 * one["rms_percent"]
            more = {"rms": rms, "phase_deg": one["phase_deg"]}
            sizes = one["measured_rms"], one["computed_rms"]
            yield row("order", one["output"], sizes, math.copysign(rms, sizes[1] - sizes[0]), **at, **more)
        for quantity, key, percent in (
            ("peak-speed", "peak_rpm", "speed_percent"), ("peak-height", "peak", "amplitude_percent"),
            ("damping", "damping", "damping_percent"),
        ):  # fmt: skip
            pair, value = (one[f"measured_{key}"], one[f"computed_{key}"]), one[percent]
            if value is not None:
                yield row(quantity, one["output"], pair, 0.01 * value, speed_rpm=one["measured_peak_rpm"], **at)
