"""Sequence of the speeds of a run-up; each is next to a finished speed, whose motion is its initial guess."""

import bisect
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from typing import NamedTuple

from cranktrain.core.errors import SolverError
from cranktrain.store.side_by_side import LOOK_EVERY
from cranktrain.studies.run_up.steady import CycleStart, SteadySpeed
from cranktrain.studies.run_up.workers import Workers

NEIGHBOURS = 2
"""Number of neighbouring speeds whose motions give the initial guess of a speed."""


class Failed(NamedTuple):
    """A speed (rad/s) without result, and the reason."""

    speed: float
    reason: str


def steady_speeds(
    workers: Workers, speeds: Sequence[float], starts: list[CycleStart]
) -> Iterator[SteadySpeed | Failed]:
    """Iterate over speeds (rad/s) as soon as they are finished; their motions are added to ``starts``.

    Raises ``SolverError`` if workers are lost.
    """
    missing = sorted(speeds)
    running: dict[Future[SteadySpeed], float] = {}

    def refill() -> None:
        while missing and len(running) < workers.count:
            speed = next_speed(missing, [start.speed for start in starts], list(running.values()))
            missing.remove(speed)
            near = sorted(starts, key=lambda start: abs(start.speed - speed))[:NEIGHBOURS]
            running[workers.submit(speed, near)] = speed

    refill()
    while running:
        done, _ = wait(running, timeout=LOOK_EVERY, return_when=FIRST_COMPLETED)
        if not done:
            workers.check()
        found: list[SteadySpeed | Failed] = []
        for future in done:
            speed = running.pop(future)
            try:
                result = future.result()
            except SolverError as error:
                found.append(Failed(speed, str(error)))
                continue
            starts.append(result.start)
            found.append(result)
        if workers.apart:
            refill()  # new work is handed out before the caller writes the result
        yield from found
        refill()


def next_speed(missing: Sequence[float], finished: Sequence[float], running: Sequence[float]) -> float:
    """Next speed to run, of the missing ones (rising): next to a finished speed, or else farthest from all others.

    A speed whose neighbour is still running waits for it as long as another speed has a finished neighbour.
    """
    known, busy = sorted(finished), sorted(running)
    taken = sorted([*known, *busy])
    if not taken:
        return missing[0]
    everything = sorted([*missing, *taken])

    def beside(speed: float) -> bool:
        at = bisect.bisect_left(everything, speed)
        neighbours = everything[max(at - 1, 0) : at] + everything[at + 1 : at + 2]
        return any(other in known for other in neighbours)

    ready = [speed for speed in missing if beside(speed)]
    if ready:
        # The speed farthest from running speeds is taken, so that two workers rarely need neighbouring speeds.
        return max(ready, key=lambda speed: min((abs(speed - other) for other in busy), default=0.0))
    return max(missing, key=lambda speed: min(abs(speed - other) for other in taken))
