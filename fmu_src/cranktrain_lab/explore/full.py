"""Full model of a choice of the knobs: steady cycles in time at a few speeds, in a separate process.

Results are written to a run-up file, which is read whenever it grows, so a stop loses no finished speed.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.core.units import RPM
from cranktrain.engine.model import Engine
from cranktrain.results.run_up.run_up import RunUp
from cranktrain_lab.explore.background import Advance, Say

SETTLE, HIGHEST_ORDER = 1.0e-3, 24.0


@dataclass(frozen=True)
class FullRun:
    """Job of a full model: engine, levels, load, and speeds (rad/s)."""

    engine: Engine
    crank: str
    bearings: str
    load: float
    speeds: tuple[float, ...]
    big_ends: str = "rigid"

    def check(self) -> None:
        """Raise ``InputError`` for settings that the engine cannot run, before any work."""
        self.request().settings(self.engine)

    def request(self) -> Any:
        """Return the request of the first speed."""
        from cranktrain.studies.constant_speed import Request

        levels: dict[str, Any] = {"crank": self.crank, "bearings": self.bearings, "big_ends": self.big_ends}
        fitted = self.engine.damper is not None
        return Request(speed_rpm=self.speeds[0] / RPM, settle=SETTLE, damper=fitted, load=self.load, **levels)

    def work(self, path: Path, say: Say, advance: Advance) -> str:
        """Run all speeds into a run-up file. Return a remark on the first speed without a result, if any."""
        from cranktrain.structure.assembly import assemble
        from cranktrain.studies.run_up.plan import job_of
        from cranktrain.studies.run_up.run_up import Means, run_up

        request = self.request()
        settings = replace(request.settings(self.engine), gas_load=self.load)
        made = assemble(self.engine, settings, say=say)
        job = job_of(request, made, None, [], HIGHEST_ORDER)
        attributes: dict[str, str | int | float] = {"engine": self.engine.name, "crank": self.crank}
        outcome = run_up(job, list(self.speeds), path, Means(workers=1), attributes, advance)
        lost = [f"{one.speed / RPM:.0f} rev/min: {one.reason}" for one in outcome.failed]
        return f"no result at {lost[0]}" if lost else ""


def finished_speeds(path: Path) -> RunUp | None:
    """Return the finished speeds of a full run, or None."""
    try:
        return RunUp.load(path) if path.exists() else None
    except CranktrainError:
        return None


def spread(low: float, high: float, count: int) -> tuple[float, ...]:
    """Return the speeds (rad/s) of a full run over a range; raises ``InputError`` for an invalid count."""
    if not 1 <= count <= 500:
        raise InputError(f"speeds of the full model: {count} is not within 1 to 500")
    return tuple(np.linspace(low, high, count).tolist()) if count > 1 else (0.5 * (low + high),)
