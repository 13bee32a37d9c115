"""Summary of a run over its last cycle."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.engine.quantities import ZERO_CELSIUS
from cranktrain.film.laws.pressure_peak import PEAK, PEAK_ANGLE, PEAK_DROP
from cranktrain.film.laws.register import LAWS
from cranktrain.results.energy import energy_balance
from cranktrain.results.orders.harmonics import last_cycle, order_spectrum

if TYPE_CHECKING:
    from cranktrain.dynamics.cycle_run import Result


HIGHEST_ORDER = 24.0
CLOSING = 1.0e-6
"""Least film, m, below which the largest pressure of a tilted film has no meaning; chosen, two to three roughnesses."""

TURNING = ("crank", "flywheel", "pulley")
"""Parts whose speeds a summary gives; ``crank`` is the mean rotation of the crank."""
NOT_RESOLVED = 0.5
"""An elastic film is not resolved if the pressure drop from the peak to the adjacent axial lines exceeds this fraction
of the peak; chosen from errors of peak pressures, ``python -m benchmarks.worst_film``."""


def vibration(angle: Array, signal: Array, scale: float) -> dict[str, Any]:
    """Peak-to-peak value, mean and orders of a signal's last cycle, multiplied by ``scale``."""
    cycle = scale * last_cycle(angle, signal)
    orders, amplitudes = order_spectrum(cycle, HIGHEST_ORDER)
    return {
        "peak_to_peak": float(np.ptp(cycle)),
        "mean": float(cycle.mean()),
        "orders": [[float(order), float(amplitude)] for order, amplitude in zip(orders, amplitudes, strict=True)],
    }


def bearing_rows(angle: Array, outputs: Mapping[str, Array]) -> list[dict[str, Any]]:
    """Extremes of each main bearing over the last cycle: load, moment, least film, eccentricity and pressure."""
    last = angle >= angle[-1] - 4.0 * math.pi
    return [
        {
            "name": f"main[{i}]",
            "peak_load_n": _peak(outputs, f"bearing[{i}].force", last),
            **_film_extremes(outputs, f"bearing[{i}]", last),
            "max_moment_nm": _peak(outputs, f"bearing[{i}].moment", last),
        }
        for i in range(1, _count(outputs, "bearing") + 1)
    ]


def big_end_rows(angle: Array, outputs: Mapping[str, Array]) -> list[dict[str, Any]]:
    """Peak load of each big end over the last cycle, with the extremes of its film if it has one."""
    last = angle >= angle[-1] - 4.0 * math.pi
    rows = []
    for i in range(1, _count(outputs, "big_end") + 1):
        row = {"name": f"big_end[{i}]", "peak_load_n": _peak(outputs, f"big_end[{i}].force", last)}
        floats = bool(np.any(outputs[f"big_end[{i}].eccentricity"]))
        rows.append({**row, **_film_extremes(outputs, f"big_end[{i}]", last)} if floats else row)
    return rows


def online_films(angle: Array, outputs: Mapping[str, Array], bin_deg: float = 10.0) -> dict[str, Any]:
    """Number of films in the last cycle that lay outside the film table and were solved online, by crank angle.

    Each Newton iteration of each main bearing evaluates one film. ``by_crank_angle`` lists [begin of the bin, deg;
    fraction of its films] for bins with films solved online; ``bin_deg`` is the width of a bin.
    """
    last = np.flatnonzero(angle > angle[-1] - 4.0 * math.pi + 1e-9)
    solved = outputs["solver.online_films"][last]
    asked = outputs["solver.iterations"][last] * _count(outputs, "bearing")
    # A sample counts the films of the step that led to it, so the step's middle angle is used.
    middle = 0.5 * (angle[last] + angle[last - 1])
    bins = (np.degrees(middle) % 720.0 // bin_deg).astype(int)
    by_bin = [(float(k * bin_deg), solved[bins == k].sum(), asked[bins == k].sum()) for k in np.unique(bins)]
    return {
        "share": float(solved.sum() / max(asked.sum(), 1.0)),
        "solved": int(solved.sum()),
        "films": int(asked.sum()),
        "bin_deg": bin_deg,
        "by_crank_angle": [[first, float(n / max(of, 1.0))] for first, n, of in by_bin if n > 0],
    }


def closing_edges(bearings: Sequence[Mapping[str, Any]]) -> list[str]:
    """Names of the plain main bearings (rows of :func:`bearing_rows`) whose least film is below CLOSING."""
    return [row["name"] for row in bearings if 1e-6 * row["min_film_um"] < CLOSING]


def films_not_resolved(peaks: Array) -> list[dict[str, Any]]:
    """Elastic films whose grid does not resolve the pressure in axial direction at its peak of the last cycle.

    ``peaks`` (b, PEAKS) are those of a run. A film is not resolved if the mean pressure of the lines adjacent to the
    peak is lower than the peak by more than the fraction NOT_RESOLVED.
    """
    return [
        {
            "name": f"main[{i + 1}]",
            "crank_angle_deg": math.degrees(row[PEAK_ANGLE]),
            "max_pressure_pa": float(row[PEAK]),
            "pressure_drop": float(row[PEAK_DROP]),
        }
        for i, row in enumerate(peaks)
        if row[PEAK_DROP] > NOT_RESOLVED
    ]


def grid_errors(attributes: Mapping[str, Any], films: Sequence[tuple[str, float, float]]) -> dict[str, Any]:
    """Worst main bearings of a cycle with elastic films and the possible errors of their grid; empty for other levels.

    ``attributes`` of the run name its levels. ``films`` are name, least film (um) and largest pressure (Pa) of each
    main with a film. The errors are those of :attr:`cranktrain.film.laws.register.Law.film_errors`.
    """
    level, block = str(attributes.get("bearings", "")), str(attributes.get("block", ""))
    errors = LAWS[level].film_errors.get(block) if level in LAWS else None
    if errors is None or not films:
        return {}
    thinnest, hardest = min(films, key=lambda film: film[1]), max(films, key=lambda film: film[2])
    return {
        "level": level,
        "block": block,
        "least_film": {"name": thinnest[0], "um": thinnest[1], "error": errors[0]},
        "largest_pressure": {"name": hardest[0], "pa": hardest[2], "error": errors[1]},
    }


def _count(outputs: Mapping[str, Array], family: str) -> int:
    """Number of bearings of a family in a run."""
    return sum(name.startswith(f"{family}[") and name.endswith("].eccentricity") for name in outputs)


def _peak(outputs: Mapping[str, Array], vector: str, last: NDArray[np.bool_]) -> float:
    """Largest magnitude of a vector output across the axis."""
    return float(np.hypot(outputs[f"{vector}.x"][last], outputs[f"{vector}.y"][last]).max())


def _film_extremes(outputs: Mapping[str, Array], name: str, last: NDArray[np.bool_]) -> dict[str, float]:
    """Least film, largest eccentricity and pressure of a bearing."""
    return {
        "min_film_um": float(1e6 * outputs[f"{name}.film_thickness_min"][last].min()),
        "max_eccentricity": float(outputs[f"{name}.eccentricity"][last].max()),
        "max_pressure_pa": float(outputs[f"{name}.pressure_max"][last].max()),
    }


def engine_summary(angle: Array, outputs: Mapping[str, Array]) -> dict[str, Any]:
    """Speeds, shaft, damper, pistons, mounts and cover over the last cycle; parts that a level lacks are 0 or empty.

    Forces and moments of a mount, and displacements of the engine, are [mean, least, largest] along x, y, z.
    """
    last = angle >= angle[-1] - 4.0 * math.pi

    def spread(name: str, scale: float = 1.0) -> list[float]:
        values = scale * outputs[name][last]
        return [float(values.mean()), float(values.min()), float(values.max())]

    def vector(name: str, scale: float = 1.0) -> list[list[float]]:
        return [spread(f"{name}.{axis}", scale) for axis in "xyz"]

    pistons = [
        {
            "lateral_um": spread(f"piston[{i}].lateral", 1e6),
            "tilt_mrad": spread(f"piston[{i}].tilt", 1e3),
            "side_force_n": spread(f"piston[{i}].side_force"),
            "friction_n": spread(f"piston[{i}].friction"),
        }
        for i in range(1, sum(name.endswith("].side_force") for name in outputs) + 1)
    ]
    mounts = [
        {"force_n": vector(f"mount[{i}].force"), "moment_nm": vector(f"mount[{i}].moment")}
        for i in range(1, sum(name.startswith("mount[") and name.endswith("].force.x") for name in outputs) + 1)
    ]
    torque = outputs["damper.torque"][last]
    return {
        "speeds": {part: _speed(outputs[f"{part}.speed"][last]) for part in TURNING if f"{part}.speed" in outputs},
        "shaft_torque_nm": vibration(angle, outputs["shaft.torque"], 1.0),
        "damper": {
            "torque_nm": float(np.abs(torque).max()),
            "power_w": float(outputs["damper.heat"][last].mean()),
            "temperature_c": float(outputs["damper.temperature"][-1] - ZERO_CELSIUS) if torque.any() else None,
        },
        "pistons": pistons,
        "mounts": mounts,
        "engine": {
            "position_um": vector("engine.position", 1e6),
            "rotation_mrad": vector("engine.rotation", 1e3),
        },
        "cover": {"acceleration_m_per_s2": vibration(angle, outputs["cover.acceleration"], 1.0)},
    }


def _speed(speed: Array) -> dict[str, float]:
    """Mean, least and largest of a cycle's speeds (rad/s) in rev/min, and irregularity (largest − least) / mean."""
    mean, least, largest = (
        float(value) for value in (speed[min(1, speed.size - 1) :].mean(), speed.min(), speed.max())
    )
    return {
        "mean_rpm": mean / RPM,
        "least_rpm": least / RPM,
        "largest_rpm": largest / RPM,
        "irregularity": (largest - least) / mean if mean > 0.0 else 0.0,
    }


def run_summary(run: "Result", result_path: str) -> dict[str, Any]:
    """Summary of a run, the object that ``cranktrain simulate --json`` prints.

    Keys carry their unit. ``real_time_factor`` is wall time per simulated time, ``seconds`` the wall time. A crank
    whose journals are locked on their axis has no entries for axial motion and bearings. ``energy`` is the balance of
    :mod:`cranktrain.results.energy`, None if the speed is not prescribed.
    """
    pulley = {"torsion_deg": vibration(run.angle, run.outputs["pulley.torsion"], 180.0 / math.pi)}
    if "pulley.axial" in run.outputs:
        pulley["axial_um"] = vibration(run.angle, run.outputs["pulley.axial"], 1e6)
    bearings = bearing_rows(run.angle, run.outputs)
    return {
        "real_time_factor": float(run.real_time_factor),
        "seconds": float(run.seconds),
        **{key: int(run.counters[key]) for key in ("steps", "newton_iterations", "rejected_steps")},
        "settling": run.settling.as_dict(),
        "pulley": pulley,
        "bearings": [
            row | {"film_temperature_c": float(temperature - ZERO_CELSIUS)}
            for row, temperature in zip(bearings, run.film_temperatures[: len(bearings)], strict=True)
        ],
        "big_ends": big_end_rows(run.angle, run.outputs),
        **engine_summary(run.angle, run.outputs),
        "energy": energy_balance(run.powers, run.step) if run.powers is not None else None,
        "result": result_path,
    }
