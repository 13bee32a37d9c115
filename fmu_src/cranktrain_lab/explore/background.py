"""A job in a process of its own that goes on while a page is used; it tells its stages and the share that is done.

A job is a value that can be sent to another process: ``check()`` refuses what cannot be run, ``work(path, say,
advance)`` does it, writes to ``path`` and returns what else is to be told. What is already written stays after a stop.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Protocol

from cranktrain.core.errors import CranktrainError

STAGE, SHARE, DONE, FAILED = "stage", "share", "done", "failed"
Say = Callable[[str], None]
"""Told a stage."""
Advance = Callable[[str, float], None]
"""Told a stage and the share of all that is done."""


class Job(Protocol):
    """What is done in the background."""

    def check(self) -> None:
        """Refuse what cannot be done, before any work; ``InputError``."""

    def work(self, path: Path, say: Say, advance: Advance) -> str:
        """Do it, and write to ``path``; returns what else is to be told."""


class Background:
    """A job that goes on while a page is used."""

    def __init__(self, job: Job) -> None:
        job.check()
        self.stage, self.share, self.error = "starting", 0.0, ""
        self._folder = TemporaryDirectory(prefix="cranktrain-explore-")
        self.path = Path(self._folder.name) / "found.h5"
        self._began, self._ended = time.monotonic(), 0.0
        context = multiprocessing.get_context("spawn")
        self._pipe, far = context.Pipe(duplex=False)
        self._process = context.Process(target=_work, args=(job, self.path, far), daemon=True)
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

    @property
    def text(self) -> str:
        """How it goes, in one line."""
        return self.error or f"{self.stage}, {self.seconds:.0f} s"

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
                self.share = share
                self._end()
        return news

    def stop(self) -> None:
        """End the job; what it has written stays."""
        if self.running:
            self._process.terminate()
            self.stage = "stopped"
            self._end()

    def close(self) -> None:
        """End the job and drop its file."""
        self.stop()
        self._folder.cleanup()

    def _end(self) -> None:
        self._ended = time.monotonic()
        self._process.join(timeout=5.0)


def _work(job: Job, path: Path, pipe: Connection) -> None:
    """Do the job in this process, and send how it goes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the page ends it
    signal.signal(signal.SIGTERM, lambda *_: os._exit(0))
    try:
        more = job.work(
            path, lambda stage: pipe.send((STAGE, stage, 0.0)), lambda text, share: pipe.send((SHARE, text, share))
        )
        pipe.send((DONE, f"done; {more}" if more else "done", 1.0))
    except CranktrainError as error:
        pipe.send((FAILED, str(error), 0.0))
    except BrokenPipeError:
        pass
    except Exception as error:
        pipe.send((FAILED, f"{type(error).__name__}: {error}", 0.0))
