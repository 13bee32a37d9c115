"""Analyses of a measurement by channel names: rotations, orders, pressures."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from cranktrain.core.argument_checks import whole_number
from cranktrain.core.errors import InputError, shown
from cranktrain.core.units import RPM, known_factor
from cranktrain.engine.model import Engine
from cranktrain_lab.measured.aliasing import aliased, check_aliasing
from cranktrain_lab.measured.channels import Measurement
from cranktrain_lab.measured.compression import Compression
from cranktrain_lab.measured.cylinder import Cylinder
from cranktrain_lab.measured.filtered import filtered_orders
from cranktrain_lab.measured.pressure import Cycles, cycles_by_encoder, cycles_by_rotation, pegged
from cranktrain_lab.measured.rotation import Rotation, rotation
from cranktrain_lab.measured.tracking import (
    Orders,
    Points,
    channel_points,
    check_orders,
    fit_shape,
    torsion_points,
    track,
)
from cranktrain_lab.measured.wheel import Wheel


def rotations_of(measurement: Measurement, asked: Any) -> list[Rotation]:
    """Return the rotation of the first place, and of the second relative to the first's mean; raises ``InputError``.

    ``asked`` has the options of ``cranktrain measured`` as attributes: ``rotation``, ``teeth``, ``missing``, ``level``,
    ``edge``, ``learn_teeth``, ``eccentricity``, ``index``, ``dead_centre_deg``, ``firing``, ``second``,
    ``second_teeth``, ``second_missing``, ``clock_hz``, and ``speed`` of the shaft (rev/min), which checks the pulses.
    """
    channel, learn = measurement[asked.rotation], asked.learn_teeth
    wheel = None if asked.teeth is None else Wheel(asked.teeth, asked.missing or 0)
    index = measurement[asked.index] if asked.index else None
    stated = None if asked.speed is None else asked.speed * RPM
    first = rotation(
        channel, wheel, level=asked.level, edge=asked.edge, learn=learn, eccentricity=asked.eccentricity, index=index,
        dead_centre=math.radians(asked.dead_centre_deg), clock=asked.clock_hz,
    )  # fmt: skip
    if asked.missing not in (None, first.wheel.missing):
        raise InputError(f"channel '{channel.name}': its gap lacks {first.wheel.missing} teeth, not {asked.missing}")
    first = check_aliasing(first, channel, stated)
    if asked.firing:
        first = first.with_firing(measurement[asked.firing])
    if not asked.second:
        return [first]
    other = measurement[asked.second]
    if asked.second_teeth is None:
        raise InputError(
            f"the second place, channel '{other.name}', needs its teeth a revolution; give --second-teeth N"
        )
    second = rotation(
        other, Wheel(asked.second_teeth, asked.second_missing or 0), edge=asked.edge,
        learn=learn if isinstance(learn, bool | tuple) else False, eccentricity=asked.eccentricity,
        clock=asked.clock_hz,
    )  # fmt: skip
    if stated is not None:
        second = check_aliasing(second, other, stated)
    try:
        return [first, second.against(first)]
    except InputError as error:
        # If a wheel's pulses would be undersampled at the speed of the other place, this wheel is probably wrong.
        pairs = ((channel, first, second), (other, second, first))
        said = [aliased(own, one.wheel, another.speed_range[1]) for own, one, another in pairs]
        raise InputError(f"{error}{max(said, key=len)}") from None


def orders_of(
    measurement: Measurement, rotations: Sequence[Rotation], orders: Sequence[float], of: Sequence[str] = (),
    integrals: int = 0, step_rpm: float = 0.0, cycles: int | None = None, bandwidth: float = 0.0,
) -> list[Orders]:  # fmt: skip
    """Return orders of the channels ``of``, or by default of the torsion of each place and the twist between two.

    Orders are fitted over cycles, or with a ``bandwidth`` (Hz) follow from the Vold–Kalman filter.
    """
    wanted, base = np.asarray(orders, dtype=np.float64), rotations[0]
    if bandwidth:
        if integrals:
            raise InputError("the Vold-Kalman filter takes signals as they are; leave out the bandwidth to integrate")
        sources = [measurement[name] for name in of] if of else rotations
        found = [filtered_orders(source, base, wanted, bandwidth, step_rpm) for source in sources]
        if of:
            for k, own in enumerate(found):
                scale, unit = angle_unit(own.unit, 0)
                found[k] = replace(own, amplitudes=own.amplitudes * scale, errors=own.errors * scale, unit=unit)
        return found if of or len(found) < 2 else [*found, _twist(found[0], found[1])]
    if of:
        points: list[Points] = []
        for name in of:
            one = channel_points(measurement[name], base, float(wanted.max()) + 1.0, integrals)
            scale, unit = angle_unit(one.unit, integrals)
            points.append(one._replace(values=one.values * scale, unit=unit))
    else:
        points = [torsion_points(one) for one in rotations]
    for one in points:
        check_orders(wanted, one)
    if cycles is None and len(points) > 1 and not of:
        # Both places are fitted over equal cycles, so that the twist is a difference within the same motion.
        cycles = max(fit_shape(one, base, wanted).cycles for one in points)
    found = [track(one, base, wanted, step_rpm=step_rpm, cycles=cycles) for one in points]
    return found if of or len(found) < 2 else [*found, _twist(found[0], found[1])]


def angle_unit(unit: str, integrals: int) -> tuple[float, str]:
    """Return factor and unit of a channel after integration: rad for angles, m for lengths, else the channel's own."""
    kinds = {0: (("angle", "rad"), ("length", "m")), 1: (("speed", "rad"), ("velocity", "m"))}
    for dimension, result in kinds.get(integrals, ()):
        if unit and (found := known_factor(unit, dimension)):
            return found.scale, result
    return 1.0, f"{unit}{('', ' s', ' s^2')[integrals]}".strip()


def _twist(first: Orders, second: Orders) -> Orders:
    """Return orders of the first place minus the second, at their common speeds."""
    speeds, one, two = np.intersect1d(np.round(first.speeds, 6), np.round(second.speeds, 6), return_indices=True)
    if not speeds.size:
        nearest = np.array([np.argmin(np.abs(second.speeds - speed)) for speed in first.speeds])
        one, two = np.arange(first.speeds.size), nearest
    return Orders(
        first.speeds[one], first.orders, first.amplitudes[one] - second.amplitudes[two],
        np.hypot(first.errors[one], second.errors[two]), np.minimum(first.coherence[one], second.coherence[two]),
        np.minimum(first.fits[one], second.fits[two]), first.cycles, f"twist {first.name} - {second.name}", first.unit,
    )  # fmt: skip


def pressures_of(
    measurement: Measurement, turning: Rotation | None, engine: Engine, asked: Any
) -> list[tuple[Cycles, Compression | None, Cylinder]]:
    """Return zero-corrected cycles, compression fit and cylinder of each pressure channel; raises ``InputError``.

    ``asked`` has the options of ``cranktrain measured`` as attributes: ``pressure``, ``cylinders``, ``unit``,
    ``samples_per_cycle``, ``first_deg``, ``speed``, ``pegging``, ``exponent``, ``intake_bar``, ``intake_deg_c``,
    ``low_pass_deg``, ``correct_dead_centre``.
    """
    numbers = cylinder_numbers(asked, engine)
    result = []
    for name, number in zip(asked.pressure, numbers, strict=True):
        channel, cylinder = measurement[name], Cylinder.of(engine, number)
        firing = engine.firing_angles[number - 1]
        if asked.samples_per_cycle:
            speed = asked.speed * RPM if asked.speed else (float(np.mean(turning.speed_range)) if turning else math.nan)
            if not math.isfinite(speed):
                raise InputError("--samples-per-cycle needs the speed; give --speed RPM or --rotation CHANNEL")
            first = asked.first_deg - math.degrees(firing)
            cycles = cycles_by_encoder(
                channel, asked.samples_per_cycle, first, speed, cycle=cylinder.cycle, unit=asked.unit
            )
        elif turning is not None:
            cycles = cycles_by_rotation(channel, turning, firing=firing, cycle=cylinder.cycle, unit=asked.unit)
        else:
            raise InputError(
                f"channel '{name}': its crank angle is not known; give --rotation CHANNEL --teeth N, or "
                f"--samples-per-cycle N"
            )
        if asked.low_pass_deg:
            cycles = cycles.low_passed(math.radians(asked.low_pass_deg))
        warm = engine.burn.intake_temperature if engine.combustion is not None else 310.0
        wall = getattr(engine.combustion, "wall_temperature", 430.0)
        cycles, fit = pegged(
            cycles, cylinder, method=asked.pegging, exponent=asked.exponent,
            intake_pressure=None if asked.intake_bar is None else 1e5 * asked.intake_bar,
            intake_temperature=warm if asked.intake_deg_c is None else asked.intake_deg_c + 273.15,
            wall_temperature=wall, correct_shift=asked.correct_dead_centre,
        )  # fmt: skip
        result.append((cycles, fit, cylinder))
    return result


def cylinder_numbers(asked: Any, engine: Engine) -> list[int]:
    """Return the cylinder number of each pressure channel; raises ``InputError`` if the options do not match."""
    if not asked.cylinders:
        if len(asked.pressure) > engine.n_cylinders:
            raise InputError(f"{len(asked.pressure)} pressures for the {engine.n_cylinders} cylinders of {engine.name}")
        return list(range(1, len(asked.pressure) + 1))
    if len(asked.cylinders) != len(asked.pressure):
        raise InputError(f"{len(asked.cylinders)} cylinders for {len(asked.pressure)} pressures; give one for each")
    numbers = [whole_number(text) for text in asked.cylinders]
    whole = [number for number in numbers if number is not None]
    if len(whole) < len(numbers):
        raise InputError(f"--cylinders {shown(','.join(asked.cylinders))} are no whole numbers; give e.g. 1,2")
    return whole
