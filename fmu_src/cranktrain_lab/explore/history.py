"""History of the choices of knobs, with undo and redo."""

from dataclasses import replace

from cranktrain_lab.explore.knobs import Chosen

MOST = 500


class History:
    """History of choices of the knobs; the last choice is the present one.

    A movement of a knob is one choice: :meth:`turn` changes the present choice without a new entry until :meth:`rest`
    is called.
    """

    def __init__(self) -> None:
        self._past: list[Chosen] = []
        self._future: list[Chosen] = []
        self._rested, self.now = Chosen(), Chosen()

    @property
    def can_undo(self) -> bool:
        """True if there is a choice before the present one."""
        return bool(self._past) or self.now != self._rested

    @property
    def can_redo(self) -> bool:
        """True if a choice was undone last."""
        return bool(self._future)

    def turn(self, key: str, value: float, own: float) -> None:
        """Set a knob to a value (SI). The engine's own value removes the knob from the choice."""
        others = {name: held for name, held in self.now.values.items() if name != key}
        self.now = replace(self.now, values=others if value == own else {**others, key: value})

    def fire(self, order: tuple[int, ...]) -> None:
        """Set a firing order; an empty order means the engine's own."""
        self.now = replace(self.now, firing=order)

    def replace(self, chosen: Chosen) -> None:
        """Replace the present choice."""
        self.now = chosen

    def rest(self) -> None:
        """Store the present choice as an entry of the history."""
        if self.now != self._rested:
            self._past = [*self._past, self._rested][-MOST:]
            self._rested, self._future = self.now, []

    def undo(self) -> Chosen:
        """Go back to the choice before the present one, and return it."""
        self.rest()
        if self._past:
            self._future.append(self._rested)
            self._rested = self.now = self._past.pop()
        return self.now

    def redo(self) -> Chosen:
        """Restore the choice that was undone last, and return it."""
        if self._future and self.now == self._rested:
            self._past.append(self._rested)
            self._rested = self.now = self._future.pop()
        return self.now
