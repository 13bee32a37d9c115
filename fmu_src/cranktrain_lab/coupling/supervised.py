"""Coupled runs in a separate process, so a unit that hangs or dies ends its own run only.

The process writes each communication point to a file that is mapped into its memory, and writes the current call and
unit to shared memory. The supervising process ends it if a call takes too long, or detects that it died, and keeps the
file. Death is detected by the exit code and not by a closed pipe, because a process started by a unit keeps pipes open.
FMU instances and their extracted files are removed with the process and its folder.
"""

import ctypes
import mmap
import os
import signal
import tempfile
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection as Pipe
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.errors import CranktrainError, InputError, StoreError
from cranktrain.core.reduced_body import Array
from cranktrain.core.unit_turns import CLOSING, INITIALIZATION, INPUTS, NOTE_SLOTS, NOTHING, OUTPUTS, STATE, STEPPING
from cranktrain.store.side_by_side import leave_to_parent, process_context
from cranktrain_lab.coupling.master import Master
from cranktrain_lab.coupling.run import Bond, Coupled, Record, Steps, System, run
from cranktrain_lab.coupling.turns import Direct
from cranktrain_lab.coupling.unit import Around, EndingError, Unit, UnitError

LOOK = 0.1
"""Interval of checks of the process, s."""
MAKING = 600.0
"""Time limit for the process to start, import modules and create its units, s."""
SHORT = 0.01
"""Interval of checks of a process that is ending, s."""
GRACE = 5.0
"""Time limit for a process to end by itself, s."""
ROWS = mmap.ALLOCATIONGRANULARITY // 8
"""Number of points for which space is reserved at once. Their size is a multiple of the page size for any width."""
WORDS = ("after a call", "initialization", "its inputs", "its outputs", "step", "its state", "its end")
"""Names of unit calls in messages, by the code of the call."""


class Notes(ctypes.Structure):
    """Entries of the shared record of a unit's current call.

    ``unit`` is the index in the master's order, ``call`` the index in :data:`WORDS`. ``count`` increases at the begin
    and end of each call. ``points`` counts the communication points in the file, ``time`` (s) is the last one,
    ``seconds`` the run's wall time. ``stop`` asks the process to end. The first NOTE_SLOTS entries are the kernel's.
    """

    _fields_ = (
        ("unit", ctypes.c_int64), ("call", ctypes.c_int64), ("count", ctypes.c_int64), ("stop", ctypes.c_int64),
        ("sweeps", ctypes.c_int64), ("refused", ctypes.c_int64), ("points", ctypes.c_int64), ("time", ctypes.c_double),
        ("seconds", ctypes.c_double),
    )  # fmt: skip


CALLS = {
    "initialize": INITIALIZATION, "write": INPUTS, "read": OUTPUTS, "step": STEPPING, "keep": STATE,
    "restore": STATE, "close": CLOSING,
}  # fmt: skip
"""Codes of the methods whose calls are recorded."""


class Watched(Around):
    """Wrapper of a unit that records its calls; ``step`` raises ``KeyboardInterrupt`` if the process is to stop."""

    def __init__(self, unit: Unit, place: int, notes: Notes) -> None:
        super().__init__(unit)
        self._place, self._notes = place, notes

    def direct(self) -> Direct | None:
        """Return the unit's description for compiled code, which then records the calls."""
        offer = getattr(self._unit, "direct", None)
        found: Direct | None = None if offer is None else offer()
        if found is None:
            return None
        return found._replace(notes=np.frombuffer(memoryview(self._notes), np.int64, NOTE_SLOTS), place=self._place)

    def listen(self, *calls: Callable[[float], None]) -> None:
        """Register functions that the unit calls inside a step, and record the step again after each call."""
        super().listen(*(partial(self._reported, call) for call in calls))

    def _reported(self, call: Callable[[float], None], time: float) -> None:
        call(time)
        self._notes.unit, self._notes.call = self._place, CALLS["step"]
        self._notes.count += 1

    def _on(self, call: str, *arguments: Any) -> Any:
        """Call a method of the unit and record it as the unit's current call."""
        notes = self._notes
        if call == "step" and notes.stop:
            raise KeyboardInterrupt
        if call not in CALLS:
            return super()._on(call, *arguments)
        notes.unit, notes.call = self._place, CALLS[call]
        notes.count += 1
        found = super()._on(call, *arguments)
        notes.call = NOTHING
        notes.count += 1
        return found


class PointsFile:
    """Writer of points of ``width`` numbers into a file that can be read even if this process has died.

    The file is mapped into memory, so writing a point needs no system call. Disk space is reserved before mapping, so a
    full disk raises ``OSError`` instead of a memory fault later.
    """

    def __init__(self, path: Path, width: int) -> None:
        self._file = path.open("w+b")
        self._width, self._count, self._size = width, 0, 0
        self._rows = np.empty((0, width))

    def take(self, row: Array) -> int:
        """Write a point and return the number of points written."""
        place = self._count % ROWS
        if place == 0:
            size = ROWS * self._width * 8
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(self._file.fileno(), self._size, size)
            else:
                self._file.truncate(self._size + size)
            room = mmap.mmap(self._file.fileno(), size, offset=self._size)
            self._size += size
            self._rows = np.frombuffer(room).reshape(ROWS, self._width)
        self._rows[place] = row
        self._count += 1
        return self._count


def read_points(path: Path, width: int, count: int) -> Array:
    """Return the first ``count`` points (k, width), or fewer if the file holds fewer."""
    held = path.stat().st_size // (8 * width)
    values = np.fromfile(path, dtype=np.float64, count=min(max(0, count), held) * width)
    return values[: len(values) // width * width].reshape(-1, width)


@dataclass(frozen=True)
class Limits:
    """Limits of the wall time of one call of a unit, s: ``start`` of the initialization, ``step`` of other calls."""

    start: float = 3600.0
    step: float = 600.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0.0:
                raise InputError(f"limit of a call, {name}: {value:g} s must be above zero")


class _Header(NamedTuple):
    """Description of a run that its process sends before the run begins."""

    units: list[str]
    outputs: tuple[str, ...]
    measures: tuple[str, ...]
    bonds: list[str]


def run_supervised(
    make: Callable[[], System], stop: float, steps: Steps, limits: Limits | None = None,
    progress: Callable[[float], None] | None = None,
) -> Coupled:  # fmt: skip
    """Run the system that ``make`` returns to ``stop`` (s) in a separate process; ``make`` must be picklable.

    Raises
    ------
    CranktrainError
        a unit fails, dies or hangs, or (``StoreError``) the temporary folder is full; attribute ``found`` of the
        error, or of an interrupt, is the run so far, if it began
    """
    with ExitStack() as held:
        try:
            folder = tempfile.TemporaryDirectory(prefix="cranktrain-run-", ignore_cleanup_errors=True)
            watcher = _Watcher(make, stop, steps, limits or Limits(), Path(held.enter_context(folder)))
        except OSError as error:
            raise StoreError(_no_room(error)) from None
        try:
            return watcher.follow(progress)
        except (CranktrainError, KeyboardInterrupt) as error:
            watcher.end()
            early = "" if isinstance(error, EndingError) else str(error) or "interrupted"
            if (found := watcher.found(early)) is not None:
                error.found = found  # type: ignore[union-attr]
            raise
        finally:
            watcher.end()


def _no_room(error: OSError) -> str:
    """Return the message for a run that fails because the system lacks space or processes."""
    try:
        place = tempfile.gettempdir()
    except OSError:
        place = "any"
    reason = error.strerror or error
    return (
        f"temporary folder {place}: the run cannot go on ({reason}); free some space, or set TMPDIR to another folder"
    )


class _Watcher:
    """Supervisor of a run's process."""

    def __init__(self, make: Callable[[], System], stop: float, steps: Steps, limits: Limits, folder: Path) -> None:
        context = process_context()
        self._limits, self._stop = limits, stop
        self._notes = context.RawValue(Notes)
        self._points = folder / "points"
        self._ear, told = context.Pipe(duplex=False)
        task = make, stop, steps, self._points, self._notes, told, os.getpid()
        self._process = context.Process(target=_work, args=task, daemon=True)
        self._process.start()
        told.close()
        self._header: _Header | None = None
        self._grace = GRACE

    def follow(self, progress: Callable[[float], None] | None) -> Coupled:
        """Wait for the run and return it; raises the error that ended it."""
        heard = self._hear(progress)
        if isinstance(heard, _Header):
            self._header = heard
            heard = self._hear(progress)
        if isinstance(heard, BaseException):
            raise heard
        found = self.found("")
        if found is None:
            raise UnitError(f"{self._place()}: the record of the run is gone; a unit removed it, correct the unit")
        self._closed()
        return found

    def _hear(self, progress: Callable[[float], None] | None) -> Any:
        """Return the next message of the run's process; raises ``UnitError`` if the process dies or hangs before."""
        count, since = -1, time.monotonic()
        while not wait([self._ear, self._process.sentinel], timeout=LOOK) and self._process.exitcode is None:
            now = time.monotonic()
            if self._notes.count != count:
                count, since = self._notes.count, now
                if progress is not None and self._header is not None:
                    progress(min(1.0, self._notes.time / self._stop))
            limit = self._limits.start if self._notes.call == INITIALIZATION else self._limits.step
            limit = MAKING if self._header is None else limit
            if now - since > limit:
                self._grace = 0.0
                raise UnitError(
                    f"{self._place()}: did not return within {limit:g} s, its process was ended; correct the unit or "
                    "raise the limit"
                )
        with suppress(Exception):  # the pipe is closed, or a unit wrote something into it
            if self._ear.poll():
                return self._ear.recv()
        self._wait(GRACE)
        self._grace = 0.0
        raise UnitError(f"{self._place()}: {self._died()}; this unit is the cause; correct it")

    def _wait(self, seconds: float) -> None:
        """Wait until the process has ended, at most ``seconds``."""
        until = time.monotonic() + seconds
        while self._process.exitcode is None and time.monotonic() < until:
            wait([self._process.sentinel], timeout=SHORT)
            time.sleep(SHORT)

    def _place(self) -> str:
        """Unit, call and time that the process reported last."""
        notes = self._notes
        if self._header is None:
            return "the units, being made"
        # A faulty unit may have overwritten the notes in shared memory.
        unit = dict(enumerate(self._header.units)).get(notes.unit, "a unit")
        return f"{unit}, {dict(enumerate(WORDS)).get(notes.call, 'a call')} at {notes.time:.6g} s"

    def _died(self) -> str:
        """Describe how the process ended."""
        code = self._process.exitcode
        if code is None:
            return "cut the connection to its process"
        if code < 0:
            names = {number.value: number.name for number in signal.Signals}
            return f"died with {names.get(-code, f'signal {-code}')}"
        return f"ended its process with code {code}"

    def found(self, ended: str) -> Coupled | None:
        """Return the recorded part of the run from its points file; None if the run did not begin."""
        header, notes = self._header, self._notes
        if header is None or not self._points.is_file():
            return None
        b = len(header.bonds)
        width = 1 + b + len(header.outputs)
        rows = read_points(self._points, width, notes.points)
        if not len(rows):
            return None
        residuals = {name: rows[1:, 1 + k] for k, name in enumerate(header.bonds)}
        return Coupled(
            header.outputs, header.measures, rows[:, 0], rows[:, 1 + b :], residuals,
            len(rows) - 1, notes.refused, notes.sweeps, notes.seconds, ended,
        )  # fmt: skip

    def _closed(self) -> None:
        """Wait until the units are closed; ``EndingError`` if closing fails, ``UnitError`` if the failure is fatal."""
        self._wait(GRACE)
        heard: Any = None
        with suppress(Exception):  # the pipe is closed
            if self._ear.poll():
                heard = self._ear.recv()
        if isinstance(heard, UnitError):
            raise type(heard)(f"{heard}; the run itself is complete, correct the unit")
        if self._process.exitcode != 0:
            how = "did not return" if self._process.exitcode is None else self._died()
            raise EndingError(f"{self._place()}: {how}; the run itself is complete, correct the unit")

    def end(self) -> None:
        """Ask the process to end; kill it after the grace time."""
        self._notes.stop = 1
        self._wait(self._grace)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()


def _work(
    make: Callable[[], System], stop: float, steps: Steps, points: Path, notes: Notes, told: Pipe, parent: int
) -> None:
    """Main function of the process: run, write and report, then close the units and exit without clean-up."""
    leave_to_parent(parent)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    os.dup2(2, 1)  # units may print, but standard output belongs to the parent
    tempfile.tempdir = str(points.parent)
    master: Master | None = None
    try:
        system = make()
        units = [Watched(unit, k, notes) for k, unit in enumerate(system.units.values())]
        master = Master(units, system.connections, system.exchange, system.outputs)
        measures = tuple(master.ports[name].unit for name in master.names)
        told.send(_Header(list(system.units), master.names, measures, [bond.name for bond in system.bonds]))
        master.initialize()
        _run_into(points, master, stop, steps, system.bonds, notes)
        told.send(None)
    except (CranktrainError, KeyboardInterrupt) as error:
        told.send(type(error)(*error.args))
    except OSError as error:
        told.send(StoreError(_no_room(error)))
    except MemoryError as error:
        told.send(StoreError(f"the memory is not enough ({error or 'none is left'}); take smaller units"))
    except BaseException:
        told.send(RuntimeError(traceback.format_exc()))
    finally:
        if master is not None:
            try:
                master.close()
            except UnitError as error:  # after a failed run nobody reads this message
                told.send(type(error)(*error.args))
    os._exit(0)


def _run_into(points: Path, master: Master, stop: float, steps: Steps, bonds: Sequence[Bond], notes: Notes) -> None:
    """Run the master and write each communication point to the file at once."""
    began, file = time.perf_counter(), PointsFile(points, 1 + len(bonds) + len(master.names))

    def tell(record: Record) -> None:
        notes.points = file.take(record.newest)
        notes.time, notes.sweeps, notes.refused = master.time, master.sweeps, record.refused
        notes.seconds = time.perf_counter() - began

    run(master, stop, steps, bonds, told=tell)
