"""The verb ``run-in``: relief of an engine's bearing shells by wear, as a limit or over time."""

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from cranktrain.cli.console import Interrupted, labelled_bar, say, show_rows
from cranktrain.cli.functions import verb, verb_of
from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.typed_file import between
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.film.contact.wear import COEFFICIENT, END_GAP, RUN_IN_DEPTH, RUN_IN_ROUGHNESS, WearLaw
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import ANY, POSITIVE, Option, Question
from cranktrain_lab.wear import run_in as study
from cranktrain_lab.wear.history import INCREMENT, Choices
from cranktrain_lab.wear.run_in import CYCLES, PASSES

DESCRIPTION = """\
Axial profile that the shells of the main bearings wear to at the lowest speed of full load.

Straight shells are run at level reynolds. Wherever the least gap over a cycle and all mains stays below half the
roughness, the shell is worn away; this is repeated. The relief of an engine file is fitted to the worn shape, and a new
engine file is written.

relief_depth_um     depth at the edge
relief_share        width of the relief, as a share of each half width
relief_exponent     exponent of the rise
fit_error_um        RMS difference of fitted and worn shape (zeta, worn_um)
least_gap_um        least gap of each pass, negative where an edge lies in the shell

With --hours or --schedule the shells wear over time, each main by its own contact: Archard's wear of the asperities'
pressure and the sliding speed over a cycle, on maps over circumference and width, while the roughness runs in. Wear
ends where the gap reaches half the roughness of new surfaces (--end-gap): the shape goes to that of the passes above.
A schedule is a text table with the columns hours, speed_rpm and load (fraction of the full-load burn); it is repeated
until --hours. The history is kept in --history after each increment, and the same command, with the same or more hours,
goes on where it ends. Only the product of --wear-coefficient and time counts: calibrate it by a measured depth.

mains, depth_um, roughness_um, volume_mm3, contact_work_j     of each main at the end
contact_share, friction_power_w, contact_pressure_mpa, least_gap_um     of each main at the start and at the end
settled             whether wear has ended
"""


@dataclass(frozen=True, kw_only=True)
class OverTime(Question):
    """Options for wear over time."""

    heading = "wear over time"
    hours: Annotated[float | None, POSITIVE, Option("H", "hours of running")] = None
    schedule: Annotated[words.File | None, Option("FILE", "table of hours, speed_rpm, load")] = None
    history: Annotated[
        words.File | None, Option("FILE.h5", "history, which is kept and continued (default ENGINE_wear.h5)")
    ] = None
    table: Annotated[words.File | None, Option("FILE.csv", "table of the history to write")] = None
    plots: Annotated[words.File | None, Option("DIR", "folder for pictures of profiles and of the history")] = None
    wear_coefficient: Annotated[
        float | None, POSITIVE, Option("K", f"Archard's k (default {COEFFICIENT:g}, to be calibrated)")
    ] = None
    end_gap: Annotated[
        float | None,
        ANY,
        Option("X", f"gap over roughness at which wear ends; inf: never ({END_GAP:g})"),
    ] = None
    run_in_roughness: Annotated[
        float | None, POSITIVE, Option("X", f"run-in over new roughness (default {RUN_IN_ROUGHNESS:g})")
    ] = None
    run_in_depth: Annotated[
        float | None, POSITIVE, Option("X", f"wear that smooths, over the roughness ({RUN_IN_DEPTH:g})")
    ] = None
    increment: Annotated[
        float | None, POSITIVE, Option("X", f"wear of an increment over the roughness (default {INCREMENT:g})")
    ] = None
    alike: Annotated[bool | None, Option(help="all shells have the deepest profile, as one ordered set")] = None
    start: Annotated[
        Literal["straight", "engine"] | None,
        Option(help="new shells: straight (default) or with the engine file's relief"),
    ] = None


@dataclass(frozen=True, kw_only=True)
class RunIn(OverTime):
    """Question of :func:`run_in`."""

    heading = ""
    output: Annotated[
        words.File | None, Option("FILE", "engine file to write; an existing file is not overwritten", was="--out")
    ] = None
    speed_rpm: Annotated[
        float | None,
        between(1.0, 20_000.0, "rev/min"),
        Option("N", "rev/min (default: lowest at full load)", "--speed"),
    ] = None
    crank: Annotated[str, Option("LEVEL", "solid (default) or beam")] = "solid"
    passes: Annotated[int | None, between(1, 100, ""), Option("N", f"wear passes (default {PASSES})")] = None
    cycles: Annotated[
        int | None,
        between(1, 100, ""),
        Option("N", f"cycles a pass (default {CYCLES}) or an increment (default 2), of which the last is read"),
    ] = None


@verb(RunIn, DESCRIPTION)
def run_in(named: str | Path | Engine, ask: RunIn) -> VerbResult:
    """Compute the wear of the shells, and write the engine file with their relief."""
    if ask.hours is not None or ask.schedule is not None:
        return _over_time(named, ask)
    given = [one.name for one in fields(OverTime) if getattr(ask, one.name) is not None]
    if given:
        raise InputError(
            f"--{given[0].replace('_', '-')} applies only to wear over time; give --hours or --schedule as well"
        )
    with labelled_bar("run-in") as (tell, follow):
        found = study.run_in(
            named, ask.output, speed_rpm=ask.speed_rpm, crank=ask.crank,
            passes=ask.passes or PASSES, cycles=ask.cycles or CYCLES, say=tell, follow=follow,
        )  # fmt: skip
    return VerbResult.of(found, "run-in", written=[found["file"]] if found["file"] else [])


def answer(engine: str, ask: RunIn) -> VerbResult:
    """Run :func:`run_in`; a history over time is written to a file even if none is named."""
    if (ask.hours is not None or ask.schedule is not None) and ask.history is None:
        ask = replace(ask, history=f"{load_engine(engine).name}_wear.h5")
    found: VerbResult = verb_of(run_in).function(engine, ask)
    return found


def show(found: VerbResult) -> None:
    """Print the relief, or the main values of a history, and the written files."""
    if "hours" in found:
        _show(found)
    else:
        print(
            f"{found['engine']}, {found['speed_rpm']:g} rev/min: relief {found['relief_depth_um']:.2f} um over "
            f"{found['relief_share']:.2f} of each half width, exponent {found['relief_exponent']:.2f} "
            f"(fitted within {found['fit_error_um']:.2f} um)"
        )
        print("Least gap by pass: " + ", ".join(f"{gap:.2f}" for gap in found["least_gap_um"]) + " um")
    for name in found.beside["written"]:
        say(f"{name} written")


def _over_time(named: str | Path | Engine, ask: RunIn) -> VerbResult:
    """Wear over time."""
    from cranktrain.results.figures import check_folder
    from cranktrain.store.whole_file import check_place
    from cranktrain_lab.wear.records import TABLE
    from cranktrain_lab.wear.result import PICTURES, run_in_over_time, save_wear_pictures

    if ask.passes is not None:
        raise InputError("--passes does not go with --hours or --schedule; leave it out")
    law = {"coefficient": ask.wear_coefficient, "end_gap": ask.end_gap,
           "run_in_roughness": ask.run_in_roughness, "run_in_depth": ask.run_in_depth}  # fmt: skip
    chosen: dict[str, Any] = {"increment": ask.increment, "alike": ask.alike, "cycles": ask.cycles}
    choices = Choices(
        law=WearLaw(**{name: value for name, value in law.items() if value is not None}),
        crank=ask.crank, straight=ask.start != "engine",
        **{name: value for name, value in chosen.items() if value is not None},
    )  # fmt: skip
    if ask.table:
        check_place(ask.table, TABLE)
    if ask.plots:
        check_folder(Path(ask.plots), "--plots", PICTURES)
    kept = f"{ask.history} keeps the increments that were finished; run the same command again to go on from there"
    if ask.history is None:
        kept = "nothing was kept"
    try:
        with labelled_bar("run-in") as (tell, follow):
            worn, found = run_in_over_time(
                named, ask.hours, ask.schedule, speed_rpm=ask.speed_rpm, choices=choices,
                output=ask.history, out=ask.output, say=tell, follow=follow,
            )  # fmt: skip
    except KeyboardInterrupt:
        raise Interrupted(f"interrupted; {kept}") from None
    except SolverError as error:
        raise SolverError(f"{error}; {kept}") from None
    written = [str(ask.history)] if ask.history is not None else []
    if ask.table:
        written.append(str(worn.write_table(ask.table)))
    if ask.plots:
        title = f"{found['engine']}, {found['hours']:.4g} h"
        written += map(str, save_wear_pictures(Path(ask.plots), worn, title))
    return VerbResult.of(found, "run-in", written=[*written, *([found["file"]] if found["file"] else [])])


def _show(found: dict[str, Any]) -> None:
    """Print the main values of a history."""
    columns = (
        "main",
        "depth / um",
        "roughness / um",
        "volume / mm3",
        "load in contact / %",
        "friction / W",
        "least gap / um",
    )
    rows = []
    for k, main in enumerate(found["mains"]):
        pairs = [
            [found[name][side][k] for side in (0, 1)] for name in ("contact_share", "friction_power_w", "least_gap_um")
        ]
        (share, share_end), (friction, friction_end), (gap, gap_end) = pairs
        rows.append((
            f"{main}", *(f"{found[name][k]:.3g}" for name in ("depth_um", "roughness_um", "volume_mm3")),
            f"{100 * share:.2g} -> {100 * share_end:.2g}", f"{friction:.4g} -> {friction_end:.4g}",
            f"{gap:.3f} -> {gap_end:.3f}",
        ))  # fmt: skip
    ended = "wear has ended" if found["settled"] else "still wearing"
    show_rows(f"{found['engine']}: {found['hours']:.4g} h, {found['increments']} increments, {ended}", columns, rows)
    print(
        f"Deepest profile of all shells: relief {found['relief_depth_um']:.2f} um over {found['relief_share']:.2f} of "
        f"each half width, exponent {found['relief_exponent']:.2f} (fitted within {found['fit_error_um']:.2f} um)"
    )
