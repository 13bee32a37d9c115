"""Contents of a report: frequencies and torsion are computed here, all other results read from files of other verbs."""

import math
import shlex
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.units import RPM
from cranktrain.engine.file import engine_path, engine_provenance, load_engine
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import FASTEST_RPM, SLOWEST_RPM
from cranktrain.loads.gas_pressure import Gas, GasTrace, mean_effective_pressure
from cranktrain.results.orders.measured import Measured, read_measured_orders
from cranktrain.results.orders.resonances import Peak
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.store.sound_files import json_of
from cranktrain.structure.assembly import assemble
from cranktrain.studies.constant_speed import Request
from cranktrain.studies.modal import modal
from cranktrain.studies.run_up.report import torsional_peaks
from cranktrain.studies.torsion.added_orders import not_linear
from cranktrain.studies.torsion.frequency_run_up import HARMONIC_BALANCE, HIGHEST_ORDER, LINEAR, frequency_run_up

ORDERS = tuple(np.arange(0.5, HIGHEST_ORDER + 0.25, 0.5).tolist())
BEYOND = 7.0 / 6.0
"""Ratio of the last speed of the torsional run-up to the engine's highest speed."""
STEPS, QUICK_STEPS = 200, 100
"""Approximate number of speed steps of the torsional run-up, and of a quick one."""


@dataclass(frozen=True)
class Asked:
    """Request of a report, as the user stated it.

    Attributes
    ----------
    name : of a shipped engine, or path of an engine file
    run_up : file of ``cranktrain runup`` of the same engine; None: ``ENGINE_runup.h5`` in a folder. The run-up with the
        damper is ``ENGINE_runup_damped.h5`` in a folder
    folders : searched in this order for pictures and results of other verbs
    quick : True for fewer speeds, a linear torsional crank without the damping inherited from the level above, and
        frequencies on ground only
    measured : file of measured orders (:mod:`cranktrain.results.orders.measured`)
    speeds_rpm : first and last speed, rev/min; None: the engine's range, extended by a sixth
    load : fraction of the full-load burn
    running : options of the verbs that run the engine: its drive line, its pressures, its load
    again : further options of the report
    orders : orders in the charts; empty: the strongest ones
    log, peak_to_peak : first state of charts of amplitudes: logarithmic scale (None: if resonances are small compared
        with the largest amplitude), peak to peak
    makes : True if the commands of missing sections are run
    """

    name: str
    run_up: str | Path | None = None
    folders: Sequence[Path] = ()
    quick: bool = False
    measured: str | Path | None = None
    speeds_rpm: tuple[float, float] | None = None
    load: float = 1.0
    running: tuple[str, ...] = ()
    again: tuple[str, ...] = ()
    makes: bool = False
    orders: tuple[float, ...] = ()
    log: bool | None = None
    peak_to_peak: bool = False

    @property
    def command(self) -> str:
        """Shell command that makes this report."""
        return shlex.join(["cranktrain", "report", self.name, *self.running, *self.again])


@dataclass(frozen=True)
class Torsion:
    """A run-up with its peaks of torsion, labelled with the modes nearest to them."""

    run_up: RunUp
    peaks: list[Peak]


@dataclass(frozen=True)
class Findings:
    """Contents of a report; None for contents that do not exist yet.

    Attributes
    ----------
    asked : what the user asked for
    engine : the engine
    origins : every value of its file: key, value, unit, origin, note
    modes : output of ``cranktrain modal --json``
    torsion : run-up of the torsional crank in the frequency domain, without damper
    damped : the same with the engine's damper; None without a damper
    run_up : run-up of any level, from the user or a folder; None if there is none
    damped_run_up : likewise, with the engine's damper
    fatigue : result of ``cranktrain fatigue --output`` in a folder; None if there is none
    measured : measured orders from the user; may be empty
    pictures : files by name, from the folders that the user gave
    links : titles and places of pages about the methods, as seen from the report
    seconds : wall time by stage
    gas : measured pressures in place of the built-in trace
    date : when the report was begun
    digest : SHA-256 of the engine file, as it was read
    running : True while sections are still being made
    """

    asked: Asked
    engine: Engine
    origins: Sequence[tuple[str, Any, str, str, str]]
    modes: dict[str, Any] | None = None
    torsion: Torsion | None = None
    damped: Torsion | None = None
    run_up: RunUp | None = None
    damped_run_up: RunUp | None = None
    pictures: dict[str, Path] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    measured: Measured = field(default_factory=dict)
    fatigue: dict[str, Any] | None = None
    links: dict[str, str] = field(default_factory=dict)
    gas: Gas | None = None
    date: str = ""
    digest: str = ""
    running: bool = False

    @property
    def speeds(self) -> tuple[float, float]:
        """Lowest and highest speed for the limits, rad/s: as requested, or the engine's."""
        if self.asked.speeds_rpm is None:
            return self.engine.speeds
        return self.asked.speeds_rpm[0] * RPM, self.asked.speeds_rpm[1] * RPM

    def trace(self, speed: float) -> GasTrace:
        """Pressures of the report's load at a speed, rad/s."""
        return at_load(self.engine, self.gas, speed, self.asked.load)


def findings(
    asked: Asked,
    engine: Engine | None = None,
    gas: Gas | None = None,
    say: Callable[[str], None] = lambda stage: None,
) -> Findings:
    """Compute and read the contents of a report; arguments and errors as of :func:`steps`."""
    *_, found = steps(asked, engine, gas, say)
    return found


def steps(
    asked: Asked,
    engine: Engine | None = None,
    gas: Gas | None = None,
    say: Callable[[str], None] = lambda stage: None,
) -> Iterator[Findings]:
    """Successive contents of a report: from files, then with frequencies, with torsion, and with the damper.

    Raises ``InputError`` for an engine, file or folder that cannot be used, ``StoreError`` for a damaged run-up.

    Parameters
    ----------
    asked : request of the report
    engine : the engine of that name with another drive line; None: from its file
    gas : measured pressures in place of the built-in trace
    say : receives the name of each stage
    """
    engine = engine or load_engine(asked.name)
    if gas is not None:
        count = QUICK_STEPS if asked.quick else STEPS
        gas.tell_ends([rpm * RPM for rpm in speed_range(engine, count, asked.speeds_rpm)[:2]], asked.load)
    measured = {} if asked.measured is None else read_measured_orders(asked.measured)
    found = Findings(
        asked, engine, engine_provenance(asked.name), measured=measured, gas=gas, running=True,
        digest=sha256(engine_path(asked.name).read_bytes()).hexdigest(),
        date=datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %z"), **files_of_verbs(engine, asked),
    )  # fmt: skip
    yield found
    start = time.perf_counter()
    block = "ground" if asked.quick or engine.block is None else "flexible"
    scaled = gas if asked.load == 1.0 else at_load(engine, gas, engine.best_speed, asked.load)
    modes = modal(engine, block=block, gas=scaled, say=say)
    if "in_motion" in modes:
        modes["in_motion"]["state"]["load"] = asked.load
    found = replace(found, modes=modes, seconds={"frequencies": time.perf_counter() - start})
    yield found
    for damper in (False, True) if engine.damper is not None else (False,):
        start = time.perf_counter()
        what = f"torsional run-up with{'' if damper else 'out'} damper"
        say(what)
        made = _torsion(engine.without_additions if not_linear(engine) else engine, damper, asked, say, gas)
        found = replace(found, seconds=found.seconds | {what: time.perf_counter() - start})
        found = replace(found, damped=made) if damper else replace(found, torsion=made)
        yield found


def files_of_verbs(engine: Engine, asked: Asked) -> dict[str, Any]:
    """Fields of :class:`Findings` from files of other verbs: run-ups, fatigue, pictures."""
    found = _files(asked.folders, "*.h5")
    paths = {
        "run_up": asked.run_up or found.get(f"{engine.name}_runup.h5"),
        "damped_run_up": found.get(f"{engine.name}_runup_damped.h5"),
    }
    run_ups = {key: None if path is None else _own(engine, path) for key, path in paths.items()}
    fatigue = _files(asked.folders, "*.json").get(f"{engine.name}_fatigue.json")
    return {
        **run_ups,
        "pictures": _files(asked.folders, "*.png"),
        "fatigue": None if fatigue is None else _fatigue(fatigue),
    }


def speed_range(
    engine: Engine, steps: int, speeds_rpm: tuple[float, float] | None = None
) -> tuple[float, float, float]:
    """First speed, last speed and round step, rev/min, of a run-up in about ``steps`` steps.

    The range is ``speeds_rpm``, or the engine's range extended by a sixth.
    """
    low, high = speeds_rpm or (engine.speeds[0] / RPM, BEYOND * engine.speeds[1] / RPM)
    wanted = (high - low) / steps
    decade = 10.0 ** math.floor(math.log10(wanted))
    step = min((k * decade for k in (1.0, 2.0, 5.0, 10.0)), key=lambda size: abs(math.log(size / wanted)))
    first = max(math.ceil(round(low / step, 9)) * step, SLOWEST_RPM)
    return first, max(math.floor(round(high / step, 9)) * step, first + step), step


def speed_bounds(engine: Engine, low: float | None, high: float | None) -> tuple[float, float] | None:
    """Range from ``--from`` and ``--to``, rev/min; None without both; ``InputError`` for an empty range."""
    if low is None and high is None:
        return None
    low = engine.speeds[0] / RPM if low is None else low
    high = BEYOND * engine.speeds[1] / RPM if high is None else high
    if not SLOWEST_RPM <= low < high <= FASTEST_RPM:
        raise InputError(
            f"--from {low:g} --to {high:g}: is no range within {SLOWEST_RPM:g} to {FASTEST_RPM:g} rev/min; give the "
            "lower speed first, e.g. --from 800 --to 2400"
        )
    return low, high


def at_load(engine: Engine, gas: Gas | None, speed: float, load: float) -> GasTrace:
    """Gas trace at a speed (rad/s) with the burn scaled by the load, and its mean effective pressure."""
    given: Gas = GasTrace.from_engine(engine) if gas is None else gas
    full = given.at(speed, load)
    return full if load == 1.0 else _scaled(engine, full, load)


def _scaled(engine: Engine, full: GasTrace, load: float) -> GasTrace:
    fired = full.motored + load * (full.fired - full.motored)
    return replace(
        full, fired=fired, imep=mean_effective_pressure(engine, fired), source=f"{full.source}, at load {load:g}",
        own=tuple(_scaled(engine, one, load) for one in full.own),
    )  # fmt: skip


def _torsion(engine: Engine, damper: bool, asked: Asked, say: Callable[[str], None], gas: Gas | None) -> Torsion:
    """Run-up of the torsional crank with its journals locked on their axis."""
    first, last, step = speed_range(engine, QUICK_STEPS if asked.quick else STEPS, asked.speeds_rpm)
    request = Request(speed_rpm=first, crank="torsional", bearings="held", damper=damper, load=asked.load)
    made = assemble(engine, request.settings(engine), say=say, inherit=not asked.quick)
    speeds = np.arange(first, last + 0.5 * step, step) * RPM
    of = made.engine, made.body, made.settings, speeds, ORDERS
    try:
        found = frequency_run_up(*of, LINEAR if asked.quick else HARMONIC_BALANCE, gas)
    except SolverError as error:  # a speed that does not settle, as with rods of great inertia
        if asked.quick:
            raise
        say(f"{error}; so all speeds by the linear rule")
        found = frequency_run_up(*of, LINEAR, gas)
    return Torsion(found, torsional_peaks(found, made))


def _own(engine: Engine, path: str | Path) -> RunUp:
    """Run-up from a file; ``InputError`` if it is of another engine."""
    found = RunUp.load(path)
    of = found.attributes.get("engine", engine.name)
    if of != engine.name:
        raise InputError(f"{path}: is of engine '{of}', not of '{engine.name}'; name a run-up of the report's engine")
    if found.speeds.size < 2:
        raise InputError(f"{path}: has {found.speeds.size} finished speeds, too few; continue 'cranktrain runup'")
    return found


def _fatigue(path: Path) -> dict[str, Any]:
    """Result of ``cranktrain fatigue --output`` from a file; ``InputError`` for any other file."""
    try:
        found = json_of(path.read_text(encoding="utf-8"))
        [(one["safety_factor"], one["name"], one["speed_rpm"]) for one in found["fillets"]]
        [(one["acceptability"], one["name"], one["speed_rpm"]) for one in found["rule"]["places"]]
        any(one["safety_factor"] is not None for one in found["fillets"]) or found["none is judged"]
        found["rule"]["required"], found["rule"]["outside"]
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        raise InputError(
            f"{path}: is no result of 'cranktrain fatigue --output'; delete it and run that again"
        ) from None
    return dict(found)


def _files(folders: Sequence[Path], pattern: str) -> dict[str, Path]:
    """Paths of files in folders by name; ``InputError`` for a folder that does not exist."""
    found: dict[str, Path] = {}
    for folder in folders:
        if not folder.is_dir():
            raise InputError(f"--results {folder}: is not a folder; name one that holds pictures")
        for path in sorted(folder.glob(pattern)):
            found.setdefault(path.name, path)
    return found
