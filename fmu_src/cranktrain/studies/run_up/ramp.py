"""Speed ramp: the speed rises at a constant rate during the run, and orders are tracked.

It starts from the steady cycle at a speed below the first, so that fits have room on both sides. Oil and damper keep
the temperature of this start. Measured pressures over speed follow the speed in steps of 1 %.
"""

import math
from collections.abc import Callable

import numpy as np
from scipy.ndimage import uniform_filter1d

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.core.units import RPM
from cranktrain.dynamics.simulation import SLOWEST
from cranktrain.engine.quantities import SLOWEST_RPM
from cranktrain.results.orders.harmonics import CYCLE
from cranktrain.results.orders.tracking import CYCLES, tracked_orders
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.studies.run_up.steady import Job, SteadyRuns

ROOM = CYCLES
"""Number of cycles before the first and after the last speed, for half of a fit and the decay of the start."""
LONGEST = 90.0
"""Largest phase step (deg) of the highest order between samples. A spline through four samples per wave has an error of
1 %."""
FOLLOWED = 1.01
"""Ratio of speeds over which a speed-dependent pressure trace is held constant on a ramp."""
STRETCH = 1.05
"""Ratio of speeds over which the time step is held constant, because each new step needs new factors."""


def ramp(
    job: Job,
    speeds: list[float],
    rate: float,
    attributes: dict[str, str | int | float],
    tell: Callable[[str, float], None] = lambda text, share: None,
) -> RunUp:
    """Orders at speeds (rad/s, rising) of a crank that speeds up by ``rate`` (rad/s²).

    Raises ``InputError``: a range that begins too low or is run through too fast; ``SolverError``.
    """
    room = ROOM * CYCLE
    below = speeds[0] ** 2 - 2.0 * rate * room
    if not rate > 0.0 or below < SLOWEST**2:
        raise InputError(
            f"--ramp {rate / RPM:g} rev/min per second takes {ROOM} cycles before --from "
            f"{speeds[0] / RPM:g} rev/min, from {SLOWEST_RPM:g} rev/min or more; "
            "begin higher, or take a slower ramp"
        )
    step = math.degrees(job.made.settings.step)
    if job.highest_order * step > LONGEST:
        raise InputError(
            f"--highest-order {job.highest_order:g}: on a ramp steps of {step:g} deg resolve orders to "
            f"{LONGEST / step:g}; take --step-deg {LONGEST / job.highest_order:.3g} or less"
        )
    runs = SteadyRuns(job)
    first, last = math.sqrt(below), math.sqrt(speeds[-1] ** 2 + 2.0 * rate * room)
    tell(f"steady cycle at {first / RPM:.0f} rev/min", 0.0)
    runs.at(first)
    time, rows = _run_through(runs, job, first, last, rate, tell)
    angle = rows[:, 0]
    even = np.polynomial.Polynomial.fit(time, angle, 2)(time)
    cycle = max(1, int(CYCLE / float(np.mean(np.diff(angle)))))
    angle = np.asarray(even + uniform_filter1d(angle - even, cycle, mode="nearest"))
    filtered = job.made.engine.drive_line.speed_filter_time
    reached = (np.array(speeds) - first) / rate + 2.0 * filtered
    at = np.interp(reached, time, angle)
    orders, amplitudes = tracked_orders(angle, rows[:, 1:], at, job.highest_order)
    around = [slice(*np.searchsorted(angle, (middle - 0.5 * CYCLE, middle + 0.5 * CYCLE))) for middle in at]
    none = np.zeros(len(speeds), dtype=int)
    return RunUp(
        speeds=np.array(speeds),
        orders=orders,
        amplitudes={name: amplitudes[:, :, k] for k, name in enumerate(job.outputs)},
        extremes={
            name: np.array([(of.min(), of.mean(), of.max()) for of in (rows[part, k + 1] for part in around)])
            for k, name in enumerate(job.outputs)
        },
        cycles=none,
        repeats=none,
        left=np.zeros(len(speeds)),
        attributes=attributes | {"ramp": rate},
    )


def _run_through(
    runs: SteadyRuns, job: Job, first: float, last: float, rate: float, tell: Callable[[str, float], None]
) -> tuple[Array, Array]:
    """Run a speed ramp. Return times (k,), s, and crank angle and requested outputs at each, (k, 1 + outputs)."""
    simulation = runs.simulation
    columns = [simulation.output_names.index(name) for name in ("crank.angle", *job.outputs)]
    times, rows = [0.0], [simulation.outputs[columns]]
    time, speed, step, until = 0.0, first, 0.0, 0.0
    simulation.inputs[0] = followed = first
    while speed < last:
        if speed >= FOLLOWED * followed and job.gas is not None:
            followed = simulation.inputs[0] = speed
            simulation.follow_gas()
        if speed >= until:
            until = STRETCH * speed
            step = simulation.settings.step / until
            tell(f"{speed / RPM:.0f} rev/min", (speed - first) / (last - first))
        simulation.inputs[0] = speed
        time += step
        simulation.step(time)
        times.append(time)
        rows.append(simulation.outputs[columns])
        speed = first + rate * time
    return np.array(times), np.array(rows)
