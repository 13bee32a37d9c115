"""The verb ``harness``: scenarios of coupled FMUs, and the assertions on their results."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cranktrain.cli.console import bar, say, show_rows
from cranktrain.cli.functions import Subject, verb
from cranktrain.results.views.found import VerbResult
from cranktrain.store.whole_file import check_place, whole_file
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, Question, paths

if TYPE_CHECKING:
    from cranktrain_lab.harness.entries import Harness, Scenario
    from cranktrain_lab.harness.judgement import Ran
    from cranktrain_lab.harness.running import Judged

DESCRIPTION = """\
Run the scenarios of a harness file and check its assertions.

Any FMU may replace any module; units are connected by name or by a map. A scenario may contain steps, ramps, misfires,
noise, drop-outs and faults of units; every unit runs in a process of its own. FMUs that are not named are built first.
--json prints {"passed", "scenarios": [{"name", "passed", "ended", "seconds", "result", "assertions": [{"name",
"quantity", "expected", "found", "unit", "passed"}]}]}. Exit code 0: all assertions passed, 1: some failed, 2: the file
is invalid.
"""


FILE = Subject("file", "FILE", "path of a harness.toml")


@dataclass(frozen=True, kw_only=True)
class RunHarness(Question):
    """Question of :func:`harness`."""

    only: Annotated[str | Sequence[str], Option("NAME", "run only these, and those they are compared with")] = ()
    output: Annotated[
        words.File | None, Option("FOLDER", "folder for a result file of each scenario (default: FILE_results)")
    ] = None
    junit: Annotated[words.File | None, Option("OUT.xml", "write results as JUnit XML")] = None
    html: Annotated[words.File | None, Option("OUT.html", "write a report with plots, one file")] = None


@verb(RunHarness, DESCRIPTION, FILE)
def harness(file: str | Path, ask: RunHarness) -> VerbResult:
    """Check the file, build the FMUs, run the scenarios and judge assertions; an interrupt keeps finished scenarios."""
    from cranktrain.results.figures import check_folder
    from cranktrain.store.hdf5 import RESULT
    from cranktrain_lab.harness.file import load_harness
    from cranktrain_lab.harness.page import JUNIT, PAGE, junit, page
    from cranktrain_lab.harness.running import checked_ports, chosen, judged, result_path

    asked = load_harness(file)
    scenarios = chosen(asked, paths(ask.only))
    for path, kind in ((ask.junit, JUNIT), (ask.html, PAGE)):
        if path is not None:
            check_place(Path(path), kind)
    folder = Path(ask.output or f"{asked.path.stem}_results")
    with tempfile.TemporaryDirectory(prefix="cranktrain-harness-") as scratch:
        ports = checked_ports(asked, _descriptions(asked, Path(scratch)))
        check_folder(folder, "--output")
        for scenario in scenarios:
            check_place(result_path(folder, scenario), RESULT)
        runs, interrupted = _runs(asked, scenarios, _fmus(asked, Path(scratch)), folder)
    found = judged(asked, runs, ports)
    for place, kind, content in (
        (ask.junit, JUNIT, lambda: junit(asked.title, found)),
        (ask.html, PAGE, lambda: page(asked, found).encode()),
    ):
        if place is not None:
            with whole_file(place, kind) as temporary:
                temporary.write_bytes(content())
    passed = all(one.passed for one in found) and not interrupted
    result = {"passed": passed, "scenarios": [one.as_dict() for one in found], "interrupted": interrupted}
    if interrupted:
        say(f"interrupted; {folder} holds the results of {len(runs)} of {len(scenarios)} scenarios")
    return VerbResult.of(result, "harness", title=asked.title, judged=found)


def _descriptions(harness: Harness, folder: Path) -> dict[str, Path]:
    """Paths of given FMUs, and model descriptions of FMUs that will be built."""
    from cranktrain.fmu.build import describe_fmu

    found = {}
    for name, entry in harness.units.items():
        path = entry.fmu
        if path is None:
            assert entry.build is not None
            path = folder / f"{name}.xml"
            path.write_bytes(describe_fmu(entry.build))
        found[name] = path
    return found


def _fmus(harness: Harness, folder: Path) -> dict[str, Path]:
    """Paths of all FMUs; those without a given path are built, each once."""
    from cranktrain.fmu.build import build_fmu
    from cranktrain.modules.register import module_path

    built: dict[str, Path] = {}
    found = {}
    for name, entry in harness.units.items():
        source = entry.build
        if source is not None and source not in built:
            whole = module_path(source) is not None
            built[source] = build_fmu(source, folder, film_table=whole, block=whole, say=say)
        found[name] = entry.fmu if entry.fmu is not None else built[str(source)]
    return found


def _runs(
    harness: Harness, scenarios: Sequence[Scenario], fmus: Mapping[str, Path], folder: Path
) -> tuple[dict[str, tuple[Ran, Path | None]], bool]:
    """Runs of scenarios with their result files, and whether they were interrupted."""
    from cranktrain_lab.harness.running import keep, run_scenario

    found: dict[str, tuple[Ran, Path | None]] = {}
    for k, scenario in enumerate(scenarios, 1):
        with bar(f"{k} of {len(scenarios)}: {scenario.name}") as advance:
            ran = run_scenario(harness, scenario, fmus, advance)
        found[scenario.name] = keep(folder, harness, scenario, ran)
        if ran.interrupted:
            return found, True
    return found, False


def show(said: VerbResult) -> None:
    """Print the results."""
    from cranktrain_lab.harness.page import found_text

    found: Sequence[Judged] = said.beside["judged"]
    for one in found:
        verdict = "passed" if one.passed else "FAILED"
        rows = [
            ("passed" if outcome.passed else "FAILED", outcome.name, outcome.expected, found_text(outcome))
            for outcome in one.outcomes
        ]
        show_rows(f"{one.scenario.name}: {verdict}", ("verdict", "quantity", "expected", "found"), rows)
    print(f"{said.beside['title']}: {sum(one.passed for one in found)} of {len(found)} scenarios passed")
