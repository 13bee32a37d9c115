"""A full model of a choice in the background: steady cycles in time at a few speeds, in a process of its own.

The process sends its stages and the share done; what it keeps is a run-up file, which is read whenever it grows. So a
stop loses no finished speed.
"""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
import time
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.engine.model import Engine
from cranktrain.results.run_up.run_up import RunUp

RPM = math.pi / 30.0
SETTLE, HIGHEST_ORDER = 1.0e-3, 24.0
STAGE, SHARE, DONE, FAILED = "stage", "share", "done", "failed"


@dataclass(frozen=True)
class FullRun:
    """What a full model runs: engine, levels, load, and speeds (rad/s)."""

    engine: Engine
    crank: str
    bearings: str
    load: float
    speeds: tuple[float, ...]

    def check(self) -> None:
        """Refuse what the engine cannot run, before any work; ``InputError``."""
        self.request().settings(self.engine)

    def request(self) -> Any:
        """Request of its first speed."""
        from cranktrain.studies.constant_speed import Request

        return Request(
            speed_rpm=self.speeds[0] / RPM, settle=SETTLE, crank=self.crank, bearings=self.bearings,
            damper=self.engine.damper is not None, load=self.load,
        )  # fmt: skip


class Background:
    """A full run that goes on while a page is used."""

    def __init__(self, run: FullRun) -> None:
        run.check()
        self.run, self.stage, self.share, self.error = run, "starting", 0.0, ""
        self._folder = TemporaryDirectory(prefix="cranktrain-explore-")
        self._path = Path(self._folder.name) / "full.h5"
        self._began, self._ended = time.monotonic(), 0.0
        context = multiprocessing.get_context("spawn")
        self._pipe, far = context.Pipe(duplex=False)
        self._process = context.Process(target=_work, args=(run, self._path, far), daemon=True)
        self._process.start()
        far.close()

    @property
    def running(self) -> bool:
        """Whether it is still at work."""
        return self._ended == 0.0

    @property
    def seconds(self) -> float:
        """Since it began, or until it ended."""
        return (self._ended or time.monotonic()) - self._began

    def look(self) -> bool:
        """Take in what the process has sent; whether there was anything."""
        news = False
        while self.running:
            try:
                if not self._pipe.poll():
                    break
                kind, text, share = self._pipe.recv()
            except (EOFError, OSError):
                kind, text, share = FAILED, "its process ended without a word; see the terminal", 0.0
            news = True
            if kind in (STAGE, SHARE):
                self.stage, self.share = text, share if kind == SHARE else self.share
            else:
                self.stage, self.error = (text, "") if kind == DONE else ("failed", text)
                self._end()
        return news

    def found(self) -> RunUp | None:
        """The speeds that are finished; None where there are none."""
        try:
            return RunUp.load(self._path) if self._path.exists() else None
        except CranktrainError:
            return None

    def stop(self) -> None:
        """End the run; finished speeds stay."""
        if self.running:
            self._process.terminate()
            self.stage = "stopped"
            self._end()

    def close(self) -> None:
        """End the run and drop its file."""
        self.stop()
        self._folder.cleanup()

    def _end(self) -> None:
        self._ended = time.monotonic()
        self._process.join(timeout=5.0)


def _work(run: FullRun, path: Path, pipe: Connection) -> None:
    """Do the run in this process, and send how it goes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the page ends it
    signal.signal(signal.SIGTERM, lambda *_: os._exit(0))
    try:
        from cranktrain.structure.assembly import assemble
        from cranktrain.studies.run_up.plan import job_of
        from cranktrain.studies.run_up.run_up import Means, run_up

        request = run.request()
        settings = replace(request.settings(run.engine), gas_load=run.load)
        made = assemble(run.engine, settings, say=lambda stage: pipe.send((STAGE, stage, 0.0)))
        job = job_of(request, made, None, [], HIGHEST_ORDER)
        attributes: dict[str, str | int | float] = {"engine": run.engine.name, "crank": run.crank}
        outcome = run_up(
            job, list(run.speeds), path, Means(workers=1), attributes,
            lambda text, share: pipe.send((SHARE, text, share)),
        )  # fmt: skip
        lost = [f"{one.speed / RPM:.0f} rev/min: {one.reason}" for one in outcome.failed]
        pipe.send((DONE, f"done; no result at {lost[0]}" if lost else "done", 1.0))
    except CranktrainError as error:
        pipe.send((FAILED, str(error), 0.0))
    except BrokenPipeError:
        pass
    except Exception as error:
        pipe.send((FAILED, f"{type(error).__name__}: {error}", 0.0))


def spread(low: float, high: float, count: int) -> tuple[float, ...]:
    """Speeds (rad/s) of a full run over a range; ``InputError`` for no count."""
    if not 1 <= count <= 500:
        raise InputError(f"speeds of the full model: {count} is not within 1 to 500")
    return tuple(np.linspace(low, high, count).tolist()) if count > 1 else (0.5 * (low + high),)
