"""Harmonic balance of an engine in a separate process, so that knobs remain responsive."""

import multiprocessing
import signal
from concurrent.futures import Future, ProcessPoolExecutor
from typing import Any

from cranktrain.core.errors import CranktrainError
from cranktrain.engine.model import Engine
from cranktrain.results.run_up.run_up import RunUp
from cranktrain_lab.explore.knobs import Chosen
from cranktrain_lab.explore.live import LiveTorsion

_model: list[Any] = []


class Balance:
    """Computes harmonic balance, one choice of the knobs at a time. Of later choices only the last is computed."""

    def __init__(self, live: LiveTorsion) -> None:
        ends = float(live.speeds[0]), float(live.speeds[-1])
        self._pool = ProcessPoolExecutor(
            1, multiprocessing.get_context("spawn"), initializer=_start, initargs=(live.whole, *ends)
        )
        self._running: Future[RunUp | str] | None = None
        self._asked: Chosen | None = None
        self._wanted: Chosen | None = None

    @property
    def busy(self) -> bool:
        """True if a result is pending."""
        return self._running is not None or self._wanted is not None

    def ask(self, chosen: Chosen) -> None:
        """Request harmonic balance for a choice of the knobs."""
        self._wanted = chosen
        self._go_on()

    def forget(self) -> None:
        """Discard pending requests and their results."""
        self._wanted = None

    def found(self) -> tuple[Chosen, RunUp | str] | None:
        """Return a result (or an error as one line) that is new since the last call, else None."""
        done, result = self._running, None
        if done is not None and done.done():
            assert self._asked is not None
            error = done.exception()
            result = self._asked, done.result() if error is None else f"harmonic balance ended: {error}"
            self._running = None
        self._go_on()
        return result

    def close(self) -> None:
        """Stop the process."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _go_on(self) -> None:
        if self._running is None and self._wanted is not None:
            self._asked, self._wanted = self._wanted, None
            self._running = self._pool.submit(_balanced, self._asked)


def _start(engine: Engine, low: float, high: float) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the page ends this process
    _model.append(LiveTorsion(engine, low, high))


def _balanced(chosen: Chosen) -> RunUp | str:
    try:
        found: RunUp = _model[0].balanced(chosen)
    except CranktrainError as error:
        return str(error)
    return found
