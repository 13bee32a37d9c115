"""Runs that an interrupt cut short are no results where the cycle that repeats is wanted."""

from __future__ import annotations

from cranktrain.dynamics.cycle_run import Result


def whole(result: Result) -> Result:
    """A run that was not cut short; ``KeyboardInterrupt`` for another one.

    A run that is interrupted returns what it has, for callers that keep it. Its last cycle is not the one that repeats.
    """
    if not result.complete:
        raise KeyboardInterrupt
    return result
