"""Background jobs in a separate process while a page is used, with reports of stage and completed fraction.

A job is picklable. ``check()`` raises errors for a job that cannot run. ``work(path, say, advance)`` does the work,
writes to ``path`` and returns a remark. Results that are already written remain after a stop.
"""

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
"""Function to call with the name of the present stage of a job."""
Advance = Callable[[str, float], None]
"""Function to call with the stage of a job and the completed fraction of the whole job."""


class Job(Protocol):
    """Work that a page runs in the background."""

    def check(self) -> None:
        """Raise ``InputError`` for a job that cannot run, before any work."""

    def work(self, path: Path, say: Say, advance: Advance) -> str:
        """Do the work and write results to ``path``. Return a remark for the user, possibly empty."""


class Background:
    """Job that runs in the background of a page."""

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
        """True while the job is running."""
        return self._ended == 0.0

    @property
    def seconds(self) -> float:
        """Wall time of the job so far, s."""
        return (self._ended or time.monotonic()) - self._began

    @property
    def text(self) -> str:
        """State of the job, in one line."""
        return self.error or f"{self.stage}, {self.seconds:.0f} s"

    def look(self) -> bool:
        """Receive messages of the process; True if there were any."""
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
        """Stop the job and keep the file of its results."""
        if self.running:
            self._process.terminate()
            self.stage = "stopped"
            self._end()

    def close(self) -> None:
        """Stop the job and delete the file of its results."""
        self.stop()
        self._folder.cleanup()

    def _end(self) -> None:
        self._ended = time.monotonic()
        self._process.join(timeout=5.0)


def _work(job: Job, path: Path, pipe: Connection) -> None:
    """Run the job in this process, and send its progress."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the page ends this process
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
