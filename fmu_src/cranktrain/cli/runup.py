"""The verb ``runup``: orders over the speed, each speed started from its neighbours, on all processors or a cluster."""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from cranktrain.cli.console import Interrupted, labelled_bar, number, of_words, positive, say, show
from cranktrain.cli.plot_runup import draw, pictures_folder, told_deviations
from cranktrain.cli.run_options import (
    BALANCED,
    add_run_options,
    add_settle_option,
    asked_of,
    assembled,
    balances,
    note_axial_path,
    own_data,
)
from cranktrain.core.errors import CranktrainError, InputError, SolverError
from cranktrain.engine.firing import firing_summary, firing_text
from cranktrain.film.laws.register import bearing_law

if TYPE_CHECKING:
    from cranktrain.loads.gas_pressure import Gas
    from cranktrain.results.run_up.run_up import RunUp
    from cranktrain.results.views.over_speed import OrdersOverSpeed
    from cranktrain.structure.assembly import Assembly
    from cranktrain.studies.constant_speed import Request
    from cranktrain.studies.run_up.run_up import Outcome
    from cranktrain.studies.run_up.steady import Job

DESCRIPTION = """\
Orders of torsion and axial motion over speed, from steady cycles; resonances, each with the mode it belongs to.

The result file holds every finished speed; repeating the command runs only the missing ones.
"""
PER_RPM = 30.0 / math.pi
"""rev/min of 1 rad/s."""
WAYS = {"steady": "steady", "ramp": "ramp_rpm_per_s"}
"""Options that choose another way than steady cycles in time, and what the parser calls them."""
SETTLE = 1.0e-4
"""What may be left of settling at a speed, unless another is asked for."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options to those that all verbs of an engine have."""
    from cranktrain.studies.torsion.frequency_run_up import RULES

    add = parser.add_argument
    rpm = number(-20000.0, 20000.0, "rev/min")
    add("--from", dest="from_rpm", type=rpm, required=True, metavar="RPM", help="first speed, rev/min, at least 20")
    add("--to", dest="to_rpm", type=rpm, required=True, metavar="RPM", help="last speed, rev/min")
    add("--step", dest="step_rpm", type=number(0.01, 10000.0, "rev/min"), default=20.0, metavar="RPM",
        help="distance between speeds, rev/min (default 20)")  # fmt: skip
    add_settle_option(parser, SETTLE)
    add("--highest-order", type=number(0.5, 1000.0, "per revolution"), default=24.0, metavar="N",
        help="orders 0.5, 1, … up to this one (default 24)")  # fmt: skip
    add("--outputs", default="", metavar="NAMES",
        help="further outputs to analyse, separated by commas; bearings: all outputs that bearing-loads --run-up "
        "reads")  # fmt: skip
    add("--refine", nargs="?", type=number(1e-4, 0.5, "of an order's largest amplitude"), const=0.02, default=0.0,
        metavar="SHARE", help="add speeds where interpolation between two speeds errs by more than this fraction of an "
        "order's largest amplitude (0.02 without a value), down to an eighth of --step")  # fmt: skip
    add("--ramp", dest="ramp_rpm_per_s", type=positive, metavar="RPM_PER_S",
        help="transient run-up instead of steady cycles; rise of the speed, rev/min per second")  # fmt: skip
    rule = add("--steady", metavar="RULE", help="in the frequency domain: linear or harmonic-balance; needs --crank "
        "torsional")  # fmt: skip
    of_words(rule, RULES)
    add_run_options(parser)
    add("--workers", type=number(1, 1024, "", int), metavar="N", help="processes (default: one a processor)")
    add("--scheduler", metavar="ADDRESS", help="run on the Dask cluster of this scheduler, e.g. tcp://host:8786")
    add("--anew", action="store_true", help="run all speeds, and replace a file of another run-up")
    add("--output", metavar="FILE.h5", help="result file (default: ENGINE_runup.h5)")
    add("--plots", metavar="DIR", help="write the pictures of cranktrain plot-runup there")
    add("--measured", metavar="FILE", help="measured orders, compared with the computed ones and drawn into the "
        "pictures; table of 'cranktrain measured' or UFF 58")  # fmt: skip


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Run the speeds that the file does not hold, and say what all of them show."""
    return _found(options)[1]


def answer(options: argparse.Namespace) -> OrdersOverSpeed:
    """The run-up itself with its report, for the library; its file stays only where one is named."""
    from cranktrain.results.views.over_speed import OrdersOverSpeed

    if options.output is not None:
        return OrdersOverSpeed.of(*_found(options))
    with TemporaryDirectory(prefix="cranktrain-runup-") as folder:
        options.output = str(Path(folder) / "runup.h5")
        run_up, said = _found(options)
    del said["result"]
    return OrdersOverSpeed.of(run_up, said)


def _found(options: argparse.Namespace) -> tuple[RunUp, dict[str, Any]]:
    """The run-up, which is in its file, and what it shows; an interrupt says what its file keeps."""
    try:
        return _computed(options)
    except Interrupted:
        raise
    except KeyboardInterrupt:
        path = Path(options.output or f"{Path(str(options.engine)).stem}_runup.h5")
        if count := _kept(path):
            raise Interrupted(f"interrupted; {_keeps(path, count, options.anew)}") from None
        raise


def _kept(path: Path) -> int:
    """Speeds that a file keeps; 0 where there is none, or none that can be read."""
    from cranktrain.results.run_up.run_up import RunUp

    try:
        return RunUp.load(path).speeds.size
    except CranktrainError:
        return 0


def _keeps(path: Path, count: int, anew: bool) -> str:
    """What to say of a file of so many speeds."""
    command = "the command without --anew" if anew else "the same command"
    return f"{path} keeps {count} speeds" + (f"; run {command} again to continue from there" if count else "")


def _computed(options: argparse.Namespace) -> tuple[RunUp, dict[str, Any]]:
    """The run-up, which is in its file, and what it shows."""
    from cranktrain.dynamics.simulation import check_far_end
    from cranktrain.results.orders.deviations import check_speeds_measured
    from cranktrain.results.orders.measured import read_measured_orders
    from cranktrain.results.run_up.run_up import check_run_up_target
    from cranktrain.results.strength.iacs_m68 import has_sections, shaft_stresses, stress_table
    from cranktrain.studies.planning.level_error import level_error
    from cranktrain.studies.run_up.modes_in_motion import in_motion
    from cranktrain.studies.run_up.plan import job_of, run_up_speeds
    from cranktrain.studies.run_up.report import (
        closing_text,
        critical_speeds_at_rest,
        critical_speeds_text,
        report,
        run_up_tables,
        torsional_peaks,
    )
    from cranktrain.studies.run_up.workers import runs_here

    speeds = run_up_speeds(options.from_rpm, options.to_rpm, options.step_rpm)
    asked = engine, request, settings, gas = asked_of(options, options.from_rpm, options.to_rpm)
    _check(options)
    if options.steady is None:
        check_far_end(engine)
    path = Path(options.output or f"{engine.name}_runup.h5")
    check_run_up_target(path)
    folder = None if options.plots is None else pictures_folder(options.plots)
    measured = None if options.measured is None else read_measured_orders(options.measured)
    if measured is not None:
        check_speeds_measured(measured, options.from_rpm / PER_RPM, options.to_rpm / PER_RPM)
    for rpm in (options.from_rpm, options.to_rpm):
        replace(request, speed_rpm=rpm).tell_doubts(engine, gas)
    made = assembled(asked, options.inherit)
    job = None
    if options.steady is None:
        job = job_of(request, made, gas, _outputs(options.outputs, made), options.highest_order)
        job = replace(job, balanced=balances(options, engine))
    outcome = _outcome(options, request, made, gas, job, speeds, path)
    found = outcome.run_up
    assert found is not None
    peaks = torsional_peaks(found, made)
    if job is not None and options.ramp_rpm_per_s is None and peaks:
        peaks = in_motion(peaks, runs_here(job), outcome.starts)
    said = report(found, peaks, engine.published)
    said |= {
        "firing": firing_summary(engine),
        "critical_speeds": critical_speeds_at_rest(found, made, gas),
        "level_error": level_error(engine, settings, options.from_rpm, options.to_rpm, _unlike(options)),
        "failed": [{"rpm": failed.speed * PER_RPM, "reason": failed.reason} for failed in outcome.failed],
        "seconds": outcome.seconds, "workers": outcome.workers, "resumed": outcome.resumed, "result": str(path),
    }  # fmt: skip
    if options.steady is not None and has_sections(engine):
        said["shaft_stress"] = shaft_stresses(engine, found)
    if measured is not None:
        said["deviations"] = told_deviations(found, measured, options.json)
    if folder is not None:
        said["plots"] = draw(folder, found, engine, measured, motion=peaks)
    note_axial_path(engine, bool((found.repeats == 1).all()))
    if not options.json:
        for table in (*run_up_tables(said), *([stress_table(said["shaft_stress"])] if "shaft_stress" in said else [])):
            show(table)
        print(firing_text(engine))
        if said["critical_speeds"]:
            print(critical_speeds_text(said["critical_speeds"]))
        print(closing_text(found))
        print(said["level_error"]["text"])
        resumed = f", {outcome.resumed} of its speeds from an earlier run" if outcome.resumed else ""
        workers = "1 worker" if outcome.workers == 1 else f"{outcome.workers} workers"
        print(f"{outcome.seconds:.1f} s on {workers}. Result: {path}{resumed}")
        print("".join(f"{picture}\n" for picture in said.get("plots", [])), end="")
    return found, said


def _check(options: argparse.Namespace) -> None:
    """Refuse what does not go together."""
    if options.steady is not None and options.ramp_rpm_per_s is not None:
        raise InputError("--steady does not go with --ramp; leave one of them out")
    ways = [name for name in ("steady", "ramp") if getattr(options, WAYS[name]) is not None]
    only = [name for name in ("refine", "scheduler", "workers") if getattr(options, name)]
    if ways and only:
        raise InputError(f"--{only[0]} goes with steady cycles in time, not with --{ways[0]}; leave one of them out")
    if options.steady is not None and options.outputs:
        raise InputError("--steady gives the pulley's torsion only; leave out --outputs")


def _unlike(options: argparse.Namespace) -> str:
    """One line where the run-up is of another kind than the measured runs, whose level errors are known."""
    from cranktrain.studies.planning.level_error import NOT_MEASURED

    for name, field in WAYS.items():
        if getattr(options, field) is not None:
            return f"{NOT_MEASURED} with --{name}; figures are for settled cycles in time (docs/tradeoff.md)."
    return own_data(options)


def _outcome(
    options: argparse.Namespace,
    request: Request,
    made: Assembly,
    gas: Gas | None,
    job: Job | None,
    speeds: list[float],
    path: Path,
) -> Outcome:
    """The run-up, in the way that the options choose; its result is in the file."""
    import numpy as np

    from cranktrain.studies.run_up.ramp import ramp
    from cranktrain.studies.run_up.run_up import Means, Outcome, check_replaced, run_up

    chosen = {key: value for key, value in request.attributes(made).items() if key != "speed"}
    attributes = {"engine": made.engine.name, **chosen, "settle": request.settle}
    if balances(options, made.engine):
        attributes["load"] = BALANCED
    outcome, began = Outcome(workers=1), time.perf_counter()
    if (options.steady or options.ramp_rpm_per_s) and not options.anew:
        check_replaced(path)
    if job is None:
        from cranktrain.studies.torsion.frequency_run_up import frequency_run_up

        orders = [0.5 * k for k in range(1, int(2.0 * options.highest_order + 1e-9) + 1)]
        outcome.run_up = frequency_run_up(
            made.engine, made.body, made.settings, np.array(speeds), orders, options.steady, gas,
            balanced=balances(options, made.engine), failed=outcome.failed,
        )  # fmt: skip
        for failed in outcome.failed:
            say(f"cranktrain: warning: no result at {failed.speed * PER_RPM:g} rev/min: {failed.reason}")
    elif options.ramp_rpm_per_s is None:
        means = Means(options.workers, options.scheduler, options.refine, options.anew)
        _run_into(path, options.anew, outcome, lambda tell: run_up(job, speeds, path, means, attributes, tell, outcome))
        return outcome
    else:
        with _bar() as tell:
            outcome.run_up = ramp(job, speeds, options.ramp_rpm_per_s / PER_RPM, attributes, tell)
    outcome.seconds = time.perf_counter() - began
    outcome.run_up.save(path)
    return outcome


def _outputs(asked: str, made: Assembly) -> list[str]:
    """Names of the outputs that are asked for; those of the bearings where ``bearings`` is."""
    from cranktrain.results.bearings.run_up_cycles import bearing_outputs

    carries = bearing_law(made.settings.bearings).carries
    names = (bearing_outputs(made.engine, carries) if name == "bearings" else [name] for name in asked.split(","))
    return [name for group in names for name in group if name]


@contextmanager
def _bar() -> Iterator[Callable[[str, float], None]]:
    """Show a bar: a function of text and share."""
    with labelled_bar("run-up") as (tell_stage, advance):

        def tell(text: str, share: float) -> None:
            advance(share)
            tell_stage(text)

        yield tell


def _run_into(path: Path, anew: bool, outcome: Outcome, work: Callable[[Callable[[str, float], None]], object]) -> None:
    """Do the work under a bar; whatever ends it early, say what the file keeps."""

    def kept() -> str:
        count = _kept(path) if outcome.run_up is None else outcome.run_up.speeds.size
        return _keeps(path, count, anew)

    try:
        with _bar() as tell:
            work(tell)
    except KeyboardInterrupt:
        raise Interrupted(f"interrupted; {kept()}") from None
    except SolverError as error:
        raise SolverError(f"{error}; {kept()}") from None
    for failed in outcome.failed:
        say(f"cranktrain: warning: no result at {failed.speed * PER_RPM:g} rev/min: {failed.reason}")
