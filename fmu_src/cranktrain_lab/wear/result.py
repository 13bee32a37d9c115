"""Complete computation of running in over time: from engine and schedule to results, files and a new engine file."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.units import RPM
from cranktrain.core.user_file import user_path
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import FASTEST_RPM, SLOWEST_RPM
from cranktrain.film.contact.gap import relief
from cranktrain.store.engine_text import Written, engine_text, new_path, rewritten, write_new
from cranktrain.store.hdf5 import WEAR
from cranktrain.store.whole_file import check_place
from cranktrain_lab.wear.history import Choices, Running, wear_history
from cranktrain_lab.wear.records import WearHistory
from cranktrain_lab.wear.run_in import fitted_profile
from cranktrain_lab.wear.schedule import HOUR, Block, read_schedule


def run_in_over_time(
    engine: str | Path | Engine,
    hours: float | None = None,
    schedule: str | Path | Sequence[Block] | None = None,
    *,
    speed_rpm: float | None = None,
    choices: Choices | None = None,
    output: str | Path | None = None,
    out: str | Path | None = None,
    say: Callable[[str], None] = lambda text: None,
    follow: Callable[[float], None] = lambda share: None,
) -> tuple[WearHistory, dict[str, Any]]:
    """Compute wear of an engine's main bearings over time. Return the history, and its figures for JSON.

    Raises ``InputError`` without hours and schedule, with both schedule and speed, for an engine without plain mains, a
    file of another history, or an ``out`` that exists.

    Parameters
    ----------
    engine : path, or the name of a shipped engine
    hours : end of the history; the schedule is repeated up to this time (None: once)
    schedule : file of :func:`cranktrain_lab.wear.schedule.read_schedule`, or its blocks
    speed_rpm : speed without a schedule; by default the lowest speed with oil temperatures
    output : HDF5 file of the history; an existing one is continued
    out : engine file to write, with the relief fitted to the deepest profile of all shells, and their mean roughness
    say, follow : called with each increment, and with the completed fraction of the time
    """
    base = load_engine(engine)
    new = new_path(Path(out)) if out is not None else None
    blocks = _blocks(base, hours, schedule, speed_rpm)
    path = None if output is None else user_path(output)
    if path is not None:
        check_place(path, WEAR)
    running = Running(base, choices or Choices(), say)
    history = wear_history(running, blocks, hours, path, say, follow)
    found = figures(history, base)
    if new is not None:
        _write_engine(new, engine_text(engine).text, base, history, found)
    return history, found | {"output": None if path is None else str(path), "file": None if new is None else str(new)}


def _blocks(
    engine: Engine, hours: float | None, schedule: str | Path | Sequence[Block] | None, speed_rpm: float | None
) -> Sequence[Block]:
    """Return the blocks of the schedule; raises ``InputError`` if the schedule is missing or ambiguous."""
    if hours is not None and not 0.0 < hours < math.inf:
        raise InputError(f"run-in: {hours:g} hours take no time; give a number above zero")
    if schedule is not None:
        if speed_rpm is not None:
            raise InputError("run-in: a schedule has its own speeds; leave out --speed or --schedule")
        return read_schedule(user_path(schedule)) if isinstance(schedule, str | Path) else tuple(schedule)
    if hours is None:
        raise InputError("run-in: wear over time needs hours or a schedule")
    speed = engine.oil.temperature_speeds[0] if speed_rpm is None else speed_rpm * RPM
    if not SLOWEST_RPM <= speed / RPM * (1.0 + 1e-9) <= FASTEST_RPM:
        raise InputError(f"run-in: speed {speed / RPM:g} is not within {SLOWEST_RPM:g} to {FASTEST_RPM:g} rev/min")
    return (Block(hours * HOUR, speed),)


def envelope(history: WearHistory, row: int = -1) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Return m increasing |ζ| across a shell, and the deepest relief (m) of all shells and both ends at each |ζ|."""
    deepest = history.profile[row].max(axis=0)
    deepest = np.maximum(deepest, deepest[::-1])
    half = history.zeta >= 0.0
    zeta, first = np.unique(history.zeta[half], return_index=True)
    return zeta, deepest[half][first]


def figures(history: WearHistory, engine: Engine) -> dict[str, Any]:
    """Return results of a history for JSON, in engineering units; lists are by main bearing."""
    zeta, deepest = envelope(history)
    even = np.linspace(0.0, 1.0, 101)
    shape = np.interp(even, zeta, deepest)
    depth, share, exponent = fitted_profile(even, shape)
    fitted = np.array([relief(place, (depth, share, exponent)) for place in even])
    return {
        "engine": engine.name, "hours": float(history.hours[-1]), "settled": history.settled,
        "increments": int(history.time.size - 1),
        "relief_depth_um": 1e6 * depth, "relief_share": share, "relief_exponent": exponent,
        "fit_error_um": 1e6 * float(np.sqrt(np.mean((fitted - shape) ** 2))),
        "zeta": even.tolist(), "worn_um": (1e6 * shape).tolist(),
        "mains": history.bearings.astype(int).tolist(),
        "depth_um": (1e6 * history.deepest[-1]).tolist(), "roughness_um": (1e6 * history.sigma[-1]).tolist(),
        "volume_mm3": (1e9 * history.volume[-1]).tolist(), "contact_work_j": history.contact_work[-1].tolist(),
        "contact_share": [history.contact_share[k].tolist() for k in (0, -1)],
        "friction_power_w": [history.friction_power[k].tolist() for k in (0, -1)],
        "contact_pressure_mpa": [(1e-6 * history.largest_pressure[k]).tolist() for k in (0, -1)],
        "least_gap_um": [(1e6 * history.least_gap[k]).tolist() for k in (0, -1)],
    }  # fmt: skip


def _write_engine(new: Path, old: str, base: Engine, history: WearHistory, found: dict[str, Any]) -> None:
    """Write the engine file of the run-in engine."""
    bearing = base.plain_mains
    sigma = float(history.sigma[-1].mean())
    values = {
        "relief_depth": 1e-6 * found["relief_depth_um"], "relief_share": found["relief_share"],
        "relief_exponent": found["relief_exponent"], "roughness": sigma,
        "asperity_ratio": bearing.asperity_ratio * (sigma / bearing.roughness) ** 2,
    }  # fmt: skip
    note = f"run-in: {found['hours']:.4g} h of wear; see cranktrain run-in"
    changes = {f"main_bearing.{key}": Written(value, "derived", note) for key, value in values.items()}
    write_new(new, rewritten(old, base, changes))
