"""Input of a report: results that take seconds are computed here, others are read from files of other verbs."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.engine.file import engine_provenance, load_engine
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import SLOWEST_RPM
from cranktrain.loads.gas_pressure import Gas
from cranktrain.results.orders.measured import Measured, read_measured_orders
from cranktrain.results.orders.resonances import Peak
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.structure.assembly import assemble
from cranktrain.studies.constant_speed import Request
from cranktrain.studies.modal import modal
from cranktrain.studies.run_up.report import torsional_peaks
from cranktrain.studies.torsion.frequency_run_up import HARMONIC_BALANCE, HIGHEST_ORDER, LINEAR, frequency_run_up

RPM = math.pi / 30.0
ORDERS = tuple(np.arange(0.5, HIGHEST_ORDER + 0.25, 0.5).tolist())
BEYOND = 7.0 / 6.0
"""Last speed of the torsional run-up over the engine's highest."""
STEPS, QUICK_STEPS = 200, 100
"""Number of steps of the torsional run-up, about, and of a quick one."""


@dataclass(frozen=True)
class Torsion:
    """A run-up with its peaks of torsion, labelled with the modes nearest to them."""

    run_up: RunUp
    peaks: list[Peak]


@dataclass(frozen=True)
class Findings:
    """Contents of a report.

    Attributes
    ----------
    engine : the engine
    origins : every value of its file: key, value, unit, origin, note
    modes : what ``cranktrain modal --json`` prints
    torsion : run-up of the torsional crank in the frequency domain, without damper
    damped : the same with the engine's damper, None where it has none
    run_up : a run-up of any level that the user gave or a folder holds, None where there is none
    damped_run_up : likewise, with the engine's damper
    measured : measured orders that the user gave; empty where there are none
    name : of the engine as the user gave it, or the path of its file; empty: the engine's own
    pictures : files by name, from the folders that the user gave
    seconds : wall time by stage
    """

    engine: Engine
    origins: Sequence[tuple[str, Any, str, str, str]]
    modes: dict[str, Any]
    torsion: Torsion
    damped: Torsion | None
    run_up: RunUp | None
    damped_run_up: RunUp | None
    pictures: dict[str, Path]
    seconds: dict[str, float]
    measured: Measured = field(default_factory=dict)
    name: str = ""


def findings(
    name: str,
    run_up: str | Path | None = None,
    folders: Sequence[Path] = (),
    quick: bool = False,
    say: Callable[[str], None] = lambda stage: None,
    measured: str | Path | None = None,
    engine: Engine | None = None,
    gas: Gas | None = None,
) -> Findings:
    """Compute and read the contents of a report.

    Raises ``InputError`` for an engine, file or folder that cannot be used, ``StoreError`` for a damaged run-up.

    Parameters
    ----------
    name : of a shipped engine, or path of an engine file
    run_up : file of ``cranktrain runup`` of the same engine; None: ``ENGINE_runup.h5`` of a folder. That with the
        damper is ``ENGINE_runup_damped.h5`` of a folder
    folders : in which pictures and run-ups of other verbs are looked for; the first that has one gives it
    quick : fewer speeds, linear, without the damping that the torsional crank has from the level above, and frequencies
        on ground alone
    say : told each stage
    measured : file of measured orders (:mod:`cranktrain.results.orders.measured`)
    engine : the engine of that name with another drive line; None: as its file has it
    gas : measured pressures in place of the built-in trace
    """
    engine = engine or load_engine(name)
    if gas is not None:
        gas.tell_ends([rpm * RPM for rpm in speed_range(engine, QUICK_STEPS if quick else STEPS)[:2]], 1.0)
    orders = {} if measured is None else read_measured_orders(measured)
    read = files_of_verbs(engine, run_up, folders)
    seconds = {}
    start = time.perf_counter()
    modes = modal(engine, block="ground" if quick or engine.block is None else "flexible", gas=gas, say=say)
    seconds["frequencies"] = time.perf_counter() - start
    start = time.perf_counter()
    say("torsion over the speed range")
    torsion = _torsion(engine, False, quick, say, gas)
    damped = None if engine.damper is None else _torsion(engine, True, quick, say, gas)
    seconds["torsional run-ups"] = time.perf_counter() - start
    origins = engine_provenance(name)
    return Findings(engine, origins, modes, torsion, damped, seconds=seconds, measured=orders, name=name, **read)


def files_of_verbs(engine: Engine, run_up: str | Path | None, folders: Sequence[Path]) -> dict[str, Any]:
    """The fields of :class:`Findings` that other verbs' files give: ``run_up``, ``damped_run_up``, ``pictures``."""
    found = _files(folders, "*.h5")
    paths = {
        "run_up": run_up or found.get(f"{engine.name}_runup.h5"),
        "damped_run_up": found.get(f"{engine.name}_runup_damped.h5"),
    }
    run_ups = {key: None if path is None else _own(engine, path) for key, path in paths.items()}
    return {**run_ups, "pictures": _files(folders, "*.png")}


def speed_range(engine: Engine, steps: int) -> tuple[float, float, float]:
    """First and last speed and round step, rev/min, of a run-up through the engine's speeds, in about ``steps``."""
    low, high = (speed / RPM for speed in engine.speeds)
    wanted = (BEYOND * high - low) / steps
    decade = 10.0 ** math.floor(math.log10(wanted))
    step = min((k * decade for k in (1.0, 2.0, 5.0, 10.0)), key=lambda size: abs(math.log(size / wanted)))
    first = max(math.ceil(round(low / step, 9)) * step, SLOWEST_RPM)
    return first, max(math.floor(round(BEYOND * high / step, 9)) * step, first + step), step


def _torsion(engine: Engine, damper: bool, quick: bool, say: Callable[[str], None], gas: Gas | None) -> Torsion:
    """Run-up of the torsional crank, its journals locked on their axis."""
    first, last, step = speed_range(engine, QUICK_STEPS if quick else STEPS)
    request = Request(speed_rpm=first, crank="torsional", bearings="held", damper=damper)
    made = assemble(engine, request.settings(engine), say=say, inherit=not quick)
    speeds = np.arange(first, last + 0.5 * step, step) * RPM
    rule = LINEAR if quick else HARMONIC_BALANCE
    found = frequency_run_up(made.engine, made.body, made.settings, speeds, ORDERS, rule, gas)
    return Torsion(found, torsional_peaks(found, made))


def _own(engine: Engine, path: str | Path) -> RunUp:
    """Run-up from a file; refuses one of another engine."""
    found = RunUp.load(path)
    of = found.attributes.get("engine", engine.name)
    if of != engine.name:
        raise InputError(f"{path}: is of engine '{of}', not of '{engine.name}'; name a run-up of the report's engine")
    if found.speeds.size < 2:
        raise InputError(f"{path}: has {found.speeds.size} finished speeds, too few; continue 'cranktrain runup'")
    return found


def _files(folders: Sequence[Path], pattern: str) -> dict[str, Path]:
    """Files by name; ``InputError`` for a folder that does not exist."""
    found: dict[str, Path] = {}
    for folder in folders:
        if not folder.is_dir():
            raise InputError(f"--pictures {folder}: is not a folder; name one that holds pictures")
        for path in sorted(folder.glob(pattern)):
            found.setdefault(path.name, path)
    return found
