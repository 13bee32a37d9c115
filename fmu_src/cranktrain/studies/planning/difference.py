"""Relative difference of two runs of a scene, for each output, up to the scene's highest frequency.

The last cycles of both runs are Fourier series over 720°. The relative difference of an output is the RMS of their
difference over all harmonics up to the frequency, divided by the RMS of the reference's harmonics without the mean. If
the runs do not resolve the frequency, it is the RMS over the samples.
"""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.cycle_run import Result
from cranktrain.dynamics.outputs.register import output_family

CYCLE = 4.0 * math.pi
STEPS_PER_PERIOD = 4
"""Number of steps per period of the highest frequency, twice Nyquist's limit."""


@dataclass(frozen=True)
class LastCycle:
    """Wanted outputs over the last 720°, (outputs, samples) without end point, and cost of the run.

    ``seconds`` is wall time, ``real_time_factor`` wall seconds per simulated second; ``settling`` (outputs,) is the
    settling error of each output's family, NaN if there is only one cycle.
    """

    values: Array
    seconds: float
    real_time_factor: float
    settling: Array


def last_cycle(run: Result, outputs: Sequence[str]) -> LastCycle:
    """Wanted outputs over the last cycle of a run, with the run's cost."""
    n = run.per_cycle
    values = np.array([run.outputs[name][-n - 1 : -1] for name in outputs])
    left = run.settling.left
    unknown = 0.0 if left else math.nan
    settling = np.array([left.get(output_family(name), unknown) for name in outputs])
    return LastCycle(values, run.seconds, run.real_time_factor, settling)


def relative_differences(run: LastCycle, reference: LastCycle, speed: float, frequency: float) -> Array:
    """Relative difference of each output, (outputs,); 0 where both are the same constant.

    Parameters
    ----------
    speed : rad/s
    frequency : highest that counts, Hz
    """
    n, m = run.values.shape[1], reference.values.shape[1]
    common = math.gcd(n, m)
    one = run.values[:, :: n // common]
    other = reference.values[:, :: m // common]
    highest = min(int(frequency * CYCLE / speed + 1e-9), common // 2)
    difference = _rms(one - other, highest, mean=True)
    alternating = _rms(other, highest, mean=False)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(difference == 0.0, 0.0, difference / alternating)


def longest_step(speed: float, frequency: float) -> float:
    """Longest step (rad) that resolves the frequency, Hz, at a speed, rad/s."""
    return speed / (STEPS_PER_PERIOD * frequency)


def by_family(outputs: Sequence[str], values: Iterable[float]) -> dict[str, float]:
    """Largest value of each family of outputs: ``bearing.force.x`` for several ``bearing[i].force.x``."""
    members: dict[str, list[tuple[str, float]]] = {}
    for name, value in zip(outputs, values, strict=True):
        members.setdefault(re.sub(r"\[\d+\]", "", name), []).append((name, float(value)))
    return {
        family if len(found) > 1 else found[0][0]: max(value for _, value in found) for family, found in members.items()
    }


def _rms(values: Array, highest: int, mean: bool) -> Array:
    """RMS of each row's harmonics up to ``highest``, with the mean or without."""
    n = values.shape[1]
    lines = np.abs(np.fft.rfft(values, axis=1)[:, : highest + 1] / n) ** 2
    weights = np.full(lines.shape[1], 2.0)
    weights[0] = 1.0 if mean else 0.0
    if n % 2 == 0 and highest == n // 2:
        weights[-1] = 1.0
    return np.asarray(np.sqrt(lines @ weights))
