"""Progress of an identification, as the completed fraction of its expected work.

Work is counted in runs in time at one speed, because these take most of the time if there are any. A search by the
linear level and the evaluations by harmonic balance count as some runs. If a level needs fewer evaluations than
expected, progress jumps to the end of its part; if it needs more, progress slows down within its part.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from cranktrain.core.types import Progress

SEARCH, BALANCED = 10.0, 10.0
"""Work of the linear search, and of all evaluations by harmonic balance, in units of one run in time."""
Follow = Callable[[float, float], None]


class Work:
    """Ordered parts of an identification's work, with the completed fraction.

    Parameters
    ----------
    say, follow : called with the stage, and with the completed fraction and the cost of a search
    parts : name → expected work, in runs
    """

    def __init__(self, say: Progress, follow: Follow, parts: Mapping[str, float]) -> None:
        self._say, self._follow = say, follow
        self._parts, self._whole = dict(parts), max(sum(parts.values()), 1e-9)
        self._before, self._own, self._done, self._cost, self._shown = 0.0, 0.0, 0.0, 0.0, 0.0

    def begin(self, part: str) -> None:
        """Begin a part of the work; all earlier parts count as done."""
        names = list(self._parts)
        self._before = sum(self._parts[name] for name in names[: names.index(part)])
        self._own, self._done = self._parts[part], 0.0
        self._show(0.0)

    def say(self, stage: str) -> None:
        """Report a stage of the work that is not a run in time."""
        self._say(stage)

    def run(self, stage: str) -> None:
        """Report the begin of a run; earlier runs count as done."""
        share = self._done / max(self._own, 1.0)
        # The last fifth of a part is reserved for more runs than expected.
        self._show(share if share < 0.8 else 1.0 - 0.2 * 0.8 / share)
        self._done += 1.0
        self._say(stage)

    def search(self, share: float, cost: float) -> None:
        """Report the cost of a search of the cheap model, and its progress if the present part is this search."""
        self._cost = cost
        self._show(share if self._done == 0.0 else 0.0)

    def _show(self, share: float) -> None:
        """Report the completed fraction of the whole work. The reported fraction never decreases."""
        self._shown = max(self._shown, min(1.0, (self._before + share * self._own) / self._whole))
        self._follow(self._shown, self._cost)
