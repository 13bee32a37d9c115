"""What a run says of an engine whose drive line does not hold the crank along its axis."""

from __future__ import annotations

from cranktrain.cli.console import say
from cranktrain.engine.model import Engine


def note_axial_path(engine: Engine, repeats: bool) -> None:
    """Tell of a missing axial path beside cycles that do not repeat; ``repeats``: whether all of them do."""
    if engine.axial_path is not None or repeats:
        return
    say(
        f"note: nothing holds the crank of '{engine.name}' along its axis, so the thrust collar may bounce between its "
        "films and no cycle repeats; give the drive line's [axial_path] in the engine file (mass, stiffness, spline)"
    )
