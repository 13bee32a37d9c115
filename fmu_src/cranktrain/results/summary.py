"""What a run says in a few numbers, over its last cycle."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from cranktrain.results.orders import last_cycle, order_spectrum

Array = NDArray[np.float64]

HIGHEST_ORDER = 24.0


class Run(Protocol):
    """A finished simulation as far as a summary needs it (SI)."""

    @property
    def time(self) -> Array:
        """Time, (n,) s."""

    @property
    def angle(self) -> Array:
        """Crank angle, (n,) rad."""

    @property
    def outputs(self) -> Mapping[str, Array]:
        """Output name → (n,) values in SI."""

    @property
    def counters(self) -> Mapping[str, int]:
        """Steps, newton_iterations, rejected_steps."""

    @property
    def seconds(self) -> float:
        """Wall time of the steps, s."""

    @property
    def real_time_factor(self) -> float:
        """Wall seconds per simulated second."""


def vibration(angle: Array, signal: Array, scale: float) -> dict[str, Any]:
    """Peak-to-peak, mean and orders of a signal's last cycle, its values multiplied by ``scale``."""
    cycle = scale * last_cycle(angle, signal)
    orders, amplitudes = order_spectrum(cycle, HIGHEST_ORDER)
    return {
        "peak_to_peak": float(np.ptp(cycle)),
        "mean": float(cycle.mean()),
        "orders": [[float(order), float(amplitude)] for order, amplitude in zip(orders, amplitudes, strict=True)],
    }


def bearing_rows(angle: Array, outputs: Mapping[str, Array]) -> list[dict[str, Any]]:
    """Peak load, thinnest film and largest eccentricity of each main bearing over the last cycle."""
    last = angle >= angle[-1] - 4.0 * math.pi
    rows = []
    for i in range(1, sum(name.endswith("].eccentricity") for name in outputs) + 1):
        name = f"bearing[{i}]"
        load = np.hypot(outputs[f"{name}.force.x"][last], outputs[f"{name}.force.y"][last])
        rows.append(
            {
                "name": f"main[{i}]",
                "peak_load_n": float(load.max()),
                "min_film_um": float(1e6 * outputs[f"{name}.film_thickness_min"][last].min()),
                "max_eccentricity": float(outputs[f"{name}.eccentricity"][last].max()),
            }
        )
    return rows


def run_summary(run: Run, result_path: str) -> dict[str, Any]:
    """Summary of a run: the object that ``cranktrain simulate --json`` prints.

    Keys carry their unit; ``real_time_factor`` is wall seconds per simulated second, ``seconds`` wall seconds.
    """
    return {
        "real_time_factor": float(run.real_time_factor),
        "seconds": float(run.seconds),
        **{key: int(run.counters[key]) for key in ("steps", "newton_iterations", "rejected_steps")},
        "pulley": {
            "torsion_deg": vibration(run.angle, run.outputs["pulley.torsion"], 180.0 / math.pi),
            "axial_um": vibration(run.angle, run.outputs["pulley.axial"], 1e6),
        },
        "bearings": bearing_rows(run.angle, run.outputs),
        "result": result_path,
    }
