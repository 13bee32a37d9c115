"""Refusal of interrupted runs where a periodic cycle is needed."""

from __future__ import annotations

from cranktrain.dynamics.cycle_run import Result


def whole(result: Result) -> Result:
    """Return a complete run; raise ``KeyboardInterrupt`` if the run was interrupted.

    An interrupted run returns its samples up to then, for callers that keep them. Its last cycle is not periodic.
    """
    if not result.complete:
        raise KeyboardInterrupt
    return result
