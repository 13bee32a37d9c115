"""The verb ``bearing-loads``: the plain bearings of an engine over a cycle, and over speed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cranktrain.cli import console
from cranktrain.cli.console import labelled_bar, say
from cranktrain.cli.functions import verb
from cranktrain.cli.run_options import asked_of, assembled, engine_of, loaded
from cranktrain.core.errors import InputError
from cranktrain.core.typed_file import between
from cranktrain.engine.articulated_rod import articulated_text
from cranktrain.engine.quantities import FASTEST_RPM, SLOWEST_RPM
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, paths, several

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.results.bearings.cycle import BearingReport

    Named = Iterator[tuple[str, Mapping[str, Any], BearingReport]]
    """Reports, each with the name that its pictures have and the attributes of the run."""

DESCRIPTION = "Bearings over a cycle at one speed or several: loads, films, friction, oil flow, held against limits."


@dataclass(frozen=True, kw_only=True)
class BearingLoads(words.Settled, words.Running):
    """Question of :func:`bearing_loads`."""

    one_needed = ("speeds_rpm", "result", "run_up")
    speeds_rpm: Annotated[
        float | Sequence[float] | None,
        between(SLOWEST_RPM, FASTEST_RPM, "rev/min"),
        Option("RPM", "speeds, rev/min; each runs until its cycles repeat", "--speed"),
    ] = None
    result: Annotated[
        words.File | Sequence[words.File] | None, Option("FILE.h5", "results of 'cranktrain simulate' instead of runs")
    ] = None
    run_up: Annotated[
        words.File | None, Option("FILE.h5", "result of 'cranktrain runup --outputs bearings': all its speeds")
    ] = None
    cycles: Annotated[
        int | None,
        between(1, 10000, "cycles"),
        Option("N", "exactly this many cycles a speed (default: until the outputs repeat)"),
    ] = None
    plots: Annotated[
        words.File | None,
        Option(
            "FOLDER",
            "folder for polar load diagrams and, with several speeds, a picture of the worst bearing over speed",
        ),
    ] = None
    big_ends: Annotated[
        words.BigEndWord | None, Option("LEVEL", f"{words.BIG_ENDS}; default impedance", words=words.big_ends)
    ] = None  # type: ignore[assignment]  # None stands for the level that the engine's rods allow


@verb(BearingLoads, DESCRIPTION)
def bearing_loads(named: str | Path | Engine, ask: BearingLoads) -> VerbResult:
    """Report bearing loads at each speed; after an interrupt the finished speeds are reported."""
    from cranktrain.results.bearings.figures import save_over_speed, save_polar_pictures
    from cranktrain.results.bearings.tables import bearings_dict

    engine = engine_of(named, ask)
    if ask.big_ends is None:
        ask = replace(ask, big_ends="impedance" if engine.rods_float else "rigid")
        if not engine.rods_float:
            say(f"big ends are rigid: rods of '{engine.name}' run or hang on others, and have no films of their own")
    folder = _folder(ask)
    if ask.run_up is not None:
        return _over_speed(engine, str(ask.run_up), folder)
    plots: list[Path] = []
    found: list[dict[str, Any]] = []
    interrupted = False
    results = paths(ask.result)
    try:
        for name, levels, report in _stored(engine, results) if results else _run(engine, ask):
            found.append(bearings_dict(report, levels))
            if folder is not None:
                plots += save_polar_pictures(folder, report, name)
            for violation in found[-1]["violations"]:
                say(f"warning: {found[-1]['speed_rpm']:.0f} rev/min, {violation['text']}")
    except KeyboardInterrupt:
        if not found:
            raise
        interrupted = True
        say(f"interrupted; {len(found)} speeds are finished")
    _tell_missing(engine, found)
    found.sort(key=lambda speed: float(speed["speed_rpm"]))
    if folder is not None and len(found) > 1:
        plots.append(save_over_speed(folder, engine.title, found, engine.bearing_limits))
    said = {"engine": engine.name, "speeds": found, "plots": list(map(str, plots)), "interrupted": interrupted}
    return VerbResult.of(said, "bearing-loads", engine=engine)


def show(found: VerbResult) -> None:
    """Print a table for each speed, or one table for all speeds of a run-up."""
    from cranktrain.results.bearings.tables import bearing_tables, speed_table, total_text
    from cranktrain.results.tables import grid_text

    speeds = found["speeds"]
    if "of_run_up" not in found.beside:
        for one in speeds:
            for table in bearing_tables(one):
                console.show(table)
            print("\n".join((*articulated_text(found.beside["engine"]), total_text(one))), flush=True)
            if errors := one["grid_errors"]:
                print(grid_text(errors))
    if len(speeds) > 1 or "of_run_up" in found.beside:
        console.show(speed_table(speeds))
    if errors := found.beside.get("of_run_up"):
        print(grid_text(errors))
    if found["plots"]:
        print("Pictures: " + ", ".join(found["plots"]))


def _over_speed(engine: Engine, path: str, folder: Path | None) -> VerbResult:
    """Report all speeds of a run-up in one table, with polar load diagrams at the speeds of the largest loads."""
    from cranktrain.results.bearings.figures import save_over_speed, save_polar_pictures, speed_name
    from cranktrain.results.bearings.run_up_cycles import run_up_bearings
    from cranktrain.results.bearings.tables import bearings_dict, main_films
    from cranktrain.results.run_up.run_up import RunUp
    from cranktrain.results.summary import grid_errors

    run_up = RunUp.load(path)
    _check_engine(engine, path, run_up.attributes.get("engine"))
    try:
        reports = list(run_up_bearings(run_up, engine))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    gaps = run_up.speeds_rpm[~run_up.with_result].tolist()
    if gaps:
        said = ", ".join(f"{rpm:.0f}" for rpm in gaps)
        if not reports:
            raise InputError(f"{path}: none of its speeds has a result ({said} rev/min)")
        say(f"no result at {said} rev/min, so no bearing loads there")
    found = [bearings_dict(report, run_up.attributes) for report in reports]
    errors = grid_errors(run_up.attributes, [film for report in reports for film in main_films(report)])
    for text in _gathered(found):
        say(f"warning: {text}")
    if unsteady := int(((run_up.repeats != 1) & (run_up.cycles > 0)).sum()):
        say(f"at {unsteady} of {len(found)} speeds no cycle repeats the one before, so loads are those of a mean cycle")
    _tell_missing(engine, found)
    plots: list[Path] = []
    if folder is not None:
        worst = max(reports, key=lambda report: max(bearing.load.value for bearing in report.bearings))
        plots = save_polar_pictures(folder, worst, speed_name(bearings_dict(worst, run_up.attributes)["speed_rpm"]))
        plots.append(save_over_speed(folder, engine.title, found, engine.bearing_limits, gaps))
    whole = {"engine": engine.name, "speeds": found, "plots": list(map(str, plots)), "interrupted": False}
    return VerbResult.of(whole, "bearing-loads", engine=engine, of_run_up=errors)


def _gathered(found: list[dict[str, Any]]) -> list[str]:
    """Violated limits, one line for each bearing and limit: number of speeds, and the text of the first one."""
    kept: dict[tuple[str, str], list[tuple[float, str]]] = {}
    for speed in found:
        for one in speed["violations"]:
            kept.setdefault((one["bearing"], one["limit"]), []).append((speed["speed_rpm"], one["text"]))
    return [
        f"{at[0][1]} at {at[0][0]:.0f} rev/min"
        + (f", the first of {len(at)} such speeds up to {at[-1][0]:.0f} rev/min" if len(at) > 1 else "")
        for at in kept.values()
    ]


def _tell_missing(engine: Engine, found: list[dict[str, Any]]) -> None:
    """Print which limits the engine file lacks."""
    missing = list(dict.fromkeys(key for speed in found for key in speed["missing_limits"]))
    if missing:
        say(f"{engine.name}: no limits for {len(missing)} quantities; add to [bearing_limits]: {', '.join(missing)}")


def _folder(ask: BearingLoads) -> Path | None:
    """Folder for pictures, None if none are wanted; ``InputError`` before any run if it cannot be written."""
    if ask.plots is None:
        return None
    from cranktrain.results.bearings.figures import OVER_SPEED, polar_names, speed_name
    from cranktrain.results.figures import check_folder

    runs = _names(paths(ask.result)) if ask.result else map(speed_name, several(ask.speeds_rpm))
    check_folder(Path(ask.plots), pictures=[*(name for run in runs for name in polar_names(run)), OVER_SPEED])
    return Path(ask.plots)


def _names(paths: list[str]) -> list[str]:
    """Names of results from their files, with a number if files in different folders have the same name."""
    stems = [Path(path).stem for path in paths]
    return [stem if stem not in stems[:k] else f"{stem}_{stems[:k].count(stem) + 1}" for k, stem in enumerate(stems)]


def _check_engine(engine: Engine, path: str, of: object) -> None:
    if of != engine.name:
        raise InputError(f"{path}: the run is of engine '{of}', not of '{engine.name}'; give its own engine")


def _stored(engine: Engine, paths: list[str]) -> Named:
    """Reports from result files; all files are read before the first report."""
    from cranktrain.results.bearings.cycle import bearing_report
    from cranktrain.results.files import StoredRun

    reports = []
    for path in paths:
        stored = StoredRun.load(Path(path))
        _check_engine(engine, path, stored.attributes.get("engine"))
        try:
            reports.append((stored.attributes, bearing_report(stored, engine)))
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
    for name, report in zip(_names(paths), reports, strict=True):
        yield name, *report


def _run(engine: Engine, ask: BearingLoads) -> Named:
    """Reports from runs of one assembly at successive speeds."""
    from cranktrain.results.bearings.cycle import bearing_report
    from cranktrain.results.bearings.figures import speed_name

    speeds = several(ask.speeds_rpm)
    asked = asked_of(engine, ask, *speeds)
    made = assembled(asked, ask.inherit)
    for speed in dict.fromkeys(speeds):
        request = replace(asked.request, speed_rpm=speed)
        with labelled_bar(f"{speed:g} rev/min") as (tell, advance):
            found = request.run(loaded(ask, made, asked.gas, request.speed), asked.gas, advance, tell)
        if not found.complete:
            raise KeyboardInterrupt
        yield speed_name(speed), found.attributes, bearing_report(found, engine)
