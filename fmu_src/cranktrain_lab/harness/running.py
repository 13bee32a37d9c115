"""Run of scenarios in sequence, each in its own process, and their joint evaluation."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from cranktrain.core.errors import CranktrainError, InputError, StoreError, nearest
from cranktrain_lab.coupling.modules import CRANKTRAIN
from cranktrain_lab.coupling.run import Coupled, keep_run
from cranktrain_lab.coupling.supervised import run_supervised
from cranktrain_lab.coupling.unit import Port
from cranktrain_lab.harness.entries import Harness, Scenario, file_name
from cranktrain_lab.harness.judgement import Outcome, Ran, judge, judge_ending
from cranktrain_lab.harness.recording import MISFIT, with_misfits
from cranktrain_lab.harness.system import check, prepared


class Judged(NamedTuple):
    """Evaluated scenario with its run, outcomes of its assertions, and result file (if any)."""

    scenario: Scenario
    ran: Ran
    outcomes: list[Outcome]
    result: Path | None

    @property
    def passed(self) -> bool:
        """True if every assertion passed."""
        return all(outcome.passed for outcome in self.outcomes)

    def as_dict(self) -> dict[str, Any]:
        """Return the evaluated scenario as a dictionary for JSON."""
        return {
            "name": self.scenario.name, "passed": self.passed, "ended": self.ran.ended, "seconds": self.ran.seconds,
            "result": None if self.result is None else str(self.result),
            "assertions": [outcome.as_dict() for outcome in self.outcomes],
        }  # fmt: skip


def chosen(harness: Harness, only: Sequence[str]) -> list[Scenario]:
    """Return named scenarios (default: all) and the scenarios they are compared with; raises ``InputError``."""
    by_name = {scenario.name: scenario for scenario in harness.scenarios}
    for name in only:
        if name not in by_name:
            raise InputError(f"--only '{name}': no scenario has this name; {nearest(name, by_name)}")
    wanted = set(only or by_name)
    wanted |= {assertion.ratio_to for name in wanted for assertion in by_name[name].assertions if assertion.ratio_to}
    return [scenario for scenario in harness.scenarios if scenario.name in wanted]


def checked_ports(harness: Harness, fmus: Mapping[str, Path]) -> dict[str, Port]:
    """Check that every scenario is possible with these FMUs, and return all outputs ``unit.variable``.

    ``fmus`` may be model descriptions only. ``InputError`` names file, scenario and entry.
    """
    ports: dict[str, Port] = {}
    for scenario in harness.scenarios:
        try:
            system = prepared(harness, scenario, fmus)
            check(system, scenario, _points(harness, scenario))
        except InputError as error:
            raise InputError(f"{harness.path.name}: {error}") from None
        ports |= {f"{key}.{name}": port for key, unit in system.units.items() for name, port in unit.outputs.items()}
        ports |= {f"{MISFIT}.{name}": ports[f"{CRANKTRAIN}.{name}"] for name in system.compared}
    return ports


def _points(harness: Harness, scenario: Scenario) -> float:
    """Return the communication points per cycle; 0 without angle and speed, infinite if unknown before the run."""
    if harness.angle is None and harness.speed is None:
        return 0.0
    if harness.speed is None or scenario.changes or scenario.way.steps.error is not None:
        return math.inf
    return 4.0 * math.pi / (harness.speed * scenario.way.steps.size)


def run_scenario(
    harness: Harness, scenario: Scenario, fmus: Mapping[str, Path], progress: Callable[[float], None] | None
) -> Ran:
    """Run a scenario and return its run, also if the run ended early."""
    began = time.perf_counter()
    make = partial(prepared, harness, scenario, fmus)
    misfits = partial(_compared, harness, scenario, fmus)
    try:
        found = misfits(run_supervised(make, scenario.way.stop, scenario.way.steps, harness.limits, progress))
    except (CranktrainError, KeyboardInterrupt) as error:
        interrupted = isinstance(error, KeyboardInterrupt)
        said = "interrupted" if interrupted else str(error)
        besides = isinstance(error, StoreError)
        return Ran(misfits(getattr(error, "found", None)), said, time.perf_counter() - began, interrupted, besides)
    return Ran(found, "", time.perf_counter() - began)


def _compared(
    harness: Harness, scenario: Scenario, fmus: Mapping[str, Path], found: Coupled | None
) -> Coupled | None:  # fmt: skip
    """Return a run with its misfits, if the harness has a measurement."""
    if found is None or harness.recording is None:
        return found
    system = prepared(harness, scenario, fmus)
    ports = {f"{key}.{name}": port for key, unit in system.units.items() for name, port in unit.outputs.items()}
    return with_misfits(found, system.compared, ports)


def keep(folder: Path, harness: Harness, scenario: Scenario, ran: Ran) -> tuple[Ran, Path | None]:
    """Write the result file of a run. Return run and path; the path is None if nothing is written."""
    if ran.found is None:
        return ran, None
    path = result_path(folder, scenario)
    way = scenario.way
    try:
        keep_run(path, ran.found, {
            "harness": harness.title, "scenario": scenario.name, "scheme": way.scheme,
            "reconstruction": way.reconstruction, "step_s": way.steps.size, "ended": ran.ended,
        })  # fmt: skip
    except StoreError as error:
        return ran._replace(ended="; ".join(filter(None, (ran.ended, str(error)))), besides=True), None
    return ran, path


def result_path(folder: Path, scenario: Scenario) -> Path:
    """Return the path of a scenario's result file."""
    return folder / f"{file_name(scenario.name)}.h5"


def judged(harness: Harness, runs: Mapping[str, tuple[Ran, Path | None]], ports: Mapping[str, Port]) -> list[Judged]:
    """Evaluate the assertions of all scenarios that ran."""
    by_name = {scenario.name: scenario for scenario in harness.scenarios}
    series = {name: ran for name, (ran, _) in runs.items()}
    found = []
    for name, (ran, path) in runs.items():
        scenario = by_name[name]
        outcomes = [judge_ending(scenario.ending, ran)]
        outcomes += [
            judge(assertion, series, name, harness, ports)
            for assertion in scenario.assertions
            if not assertion.ratio_to or assertion.ratio_to in series
        ]
        found.append(Judged(scenario, ran, outcomes, path))
    return found
