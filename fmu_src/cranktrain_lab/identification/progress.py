"""Progress of an identification: the fraction of its expected work that is done.

Work is counted in runs in time, of one speed each, because they take most of it wherever there are any. A search by the
linear level and an answer by harmonic balance count as some of them. Levels that need fewer answers than expected
leave the rest of their part at once; one that needs more moves ever more slowly within its part.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from cranktrain.core.types import Progress

SEARCH, BALANCED = 10.0, 10.0
"""Work of the linear search, and of all answers by harmonic balance, in runs in time."""
Follow = Callable[[float, float], None]


class Work:
    """Parts of the work in their order, and how far they are.

    Parameters
    ----------
    say, follow : told the stage, and the completed fraction with the cost of a search
    parts : name → expected work, in runs
    """

    def __init__(self, say: Progress, follow: Follow, parts: Mapping[str, float]) -> None:
        self._say, self._follow = say, follow
        self._parts, self._whole = dict(parts), max(sum(parts.values()), 1e-9)
        self._before, self._own, self._done, self._cost, self._shown = 0.0, 0.0, 0.0, 0.0, 0.0

    def begin(self, part: str) -> None:
        """Begin a part; all before it are done."""
        names = list(self._parts)
        self._before = sum(self._parts[name] for name in names[: names.index(part)])
        self._own, self._done = self._parts[part], 0.0
        self._show(0.0)

    def say(self, stage: str) -> None:
        """Tell a stage that is no run of its own."""
        self._say(stage)

    def run(self, stage: str) -> None:
        """Tell a run that begins; those before it are done."""
        share = self._done / max(self._own, 1.0)
        # The last fifth is for runs beyond those that are expected.
        self._show(share if share < 0.8 else 1.0 - 0.2 * 0.8 / share)
        self._done += 1.0
        self._say(stage)

    def search(self, share: float, cost: float) -> None:
        """Follow a search of the cheap model: it moves the part that is a search, and tells its cost in all others."""
        self._cost = cost
        self._show(share if self._done == 0.0 else 0.0)

    def _show(self, share: float) -> None:
        """Completed fraction of the whole, which never falls."""
        self._shown = max(self._shown, min(1.0, (self._before + share * self._own) / self._whole))
        self._follow(self._shown, self._cost)
