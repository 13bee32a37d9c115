"""Choices of the knobs with undo and redo."""

from __future__ import annotations

from dataclasses import replace

from cranktrain_lab.explore.knobs import Chosen

MOST = 500


class History:
    """Choices in the order in which they were made; the last one counts.

    A knob on its way from one place to another is one choice: :meth:`turn` moves on without a new entry until
    :meth:`rest` is told that the knob rests.
    """

    def __init__(self) -> None:
        self._past: list[Chosen] = []
        self._future: list[Chosen] = []
        self._rested, self.now = Chosen(), Chosen()

    @property
    def can_undo(self) -> bool:
        """Whether there is a choice before the present one."""
        return bool(self._past) or self.now != self._rested

    @property
    def can_redo(self) -> bool:
        """Whether a choice was undone last."""
        return bool(self._future)

    def turn(self, key: str, value: float, own: float) -> None:
        """A knob at a value (SI); its engine's own value is no choice."""
        others = {name: held for name, held in self.now.values.items() if name != key}
        self.now = replace(self.now, values=others if value == own else {**others, key: value})

    def fire(self, order: tuple[int, ...]) -> None:
        """A firing order; none: the engine's own."""
        self.now = replace(self.now, firing=order)

    def replace(self, chosen: Chosen) -> None:
        """Another choice as a whole."""
        self.now = chosen

    def rest(self) -> None:
        """Keep the present choice as an entry."""
        if self.now != self._rested:
            self._past = [*self._past, self._rested][-MOST:]
            self._rested, self._future = self.now, []

    def undo(self) -> Chosen:
        """The choice before the present one."""
        self.rest()
        if self._past:
            self._future.append(self._rested)
            self._rested = self.now = self._past.pop()
        return self.now

    def redo(self) -> Chosen:
        """The choice that was undone last."""
        if self._future and self.now == self._rested:
            self._past.append(self._rested)
            self._rested = self.now = self._future.pop()
        return self.now
