"""The core of the tests, which ``make test`` runs: chosen by measured processor times, not by a person.

``make test-all`` measures every function of the tests and keeps what takes long in ``tests/data/durations.json``: the
longest that each took, since the first that needs a body makes it for the others. From that this program chooses the
longest functions that are left to ``make test-all``, until the rest fits the budget; what a change needs to be noticed
stays: the cheapest test of each mutant, and those listed in ``NEEDED``. What was never measured is core. A run begins
with the files that take longest, so that no worker waits at the end for another one.

    python tests/core.py FILE ...        take the durations that pytest --durations-to wrote
    python tests/core.py                 what the core takes
"""

from __future__ import annotations

import json
import os
import sys
import tomllib
from collections import Counter
from functools import cache
from pathlib import Path

HERE = Path(__file__).parent
MEASURED = HERE / "data" / "durations.json"
MUTANTS = HERE / "data" / "mutants.toml"
BUDGET = 300.0
"""Seconds that functions of the core take in all, on one core; two workers need another minute to find the tests."""
SHORTEST = 0.3
"""Functions that take less, s, are not listed, but for their sum."""
OTHERS = "others"
NEEDED = (
    "regression/test_command_line.py::test_help_of_each_verb",
    "regression/test_command_line.py::test_what_is_asked_first_loads_no_mathematics",
    "fmu/test_slave.py",
)
"""Functions, or whole files, of the core whatever they take."""


@cache
def durations() -> dict[str, float]:
    """Seconds of the functions that take long, by file and name: ``properties/test_a.py::test_b``."""
    return dict(json.loads(MEASURED.read_text("utf-8"))) if MEASURED.is_file() else {}


def function_of(nodeid: str) -> str:
    """Name of a test's function in the table, without its parameters and the folder of all tests."""
    return nodeid.partition("[")[0].removeprefix("tests/")


def killers(known: dict[str, float]) -> set[str]:
    """The cheapest test of each mutant: a function, or a file all of whose functions are core."""
    rows = tomllib.loads(MUTANTS.read_text("utf-8"))["case"]
    return {min(map(function_of, row["tests"]), key=lambda name: cost(name, known)) for row in rows}


def cost(name: str, known: dict[str, float]) -> float:
    """Seconds of a function, or of all functions of a file."""
    if "::" in name:
        return known.get(name, 0.0)
    return sum(seconds for function, seconds in known.items() if function.startswith(f"{name}::"))


@cache
def left_out() -> frozenset[str]:
    """Functions that the core leaves to the whole."""
    known = durations()
    kept = killers(known) | {*NEEDED, OTHERS}
    total, out = sum(known.values()), set()
    for name, seconds in sorted(known.items(), key=lambda item: -item[1]):
        if total <= BUDGET:
            break
        if name not in kept and name.partition("::")[0] not in kept:
            out.add(name)
            total -= seconds
    return frozenset(out)


@cache
def seconds_of_file(path: str) -> float:
    """What the functions of a file take; ``path`` below ``tests``."""
    return cost(path, durations())


class Phase:
    """Processor time of one part of a test and of the processes that it started, s, whatever else the machine does."""

    def begin(self) -> None:
        """The part begins."""
        self.before = sum(os.times()[:4])

    def end(self) -> float:
        """What it took; the next part begins."""
        before = self.before
        self.begin()
        return self.before - before


class Recording:
    """Plugin that sums the processor time of each function and writes it at the end."""

    def __init__(self, path: str) -> None:
        self.path, self.seconds = Path(path), Counter()

    def pytest_runtest_logreport(self, report):
        self.seconds[function_of(report.nodeid)] += report.processor

    def pytest_sessionfinish(self):
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self.path.write_text(json.dumps(self.seconds), encoding="utf-8")


def main(arguments: list[str]) -> None:
    """Keep new durations, where a file of them is given, and say what the core takes."""
    if arguments:
        given: Counter[str] = Counter()
        for path in arguments:
            given.update(json.loads(Path(path).read_text("utf-8")))
        longest = {name: max(seconds, durations().get(name, 0.0)) for name, seconds in given.items() if name != OTHERS}
        listed = {name: round(seconds, 1) for name, seconds in sorted(longest.items()) if seconds > SHORTEST}
        listed[OTHERS] = round(sum(longest.values()) - sum(listed.values()), 1)
        MEASURED.write_text(json.dumps(listed, indent=0) + "\n", encoding="utf-8")
    known, out = durations(), left_out()
    core = sum(seconds for name, seconds in known.items() if name not in out)
    print(f"{len(known)} functions take {sum(known.values()):.0f} s; the core {core:.0f} s, without {len(out)} of them")


if __name__ == "__main__":
    main(sys.argv[1:])
