"""The verb ``runup``: orders over the speed, each speed started from its neighbours, on all processors or a cluster."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Literal

from cranktrain.cli import console
from cranktrain.cli.console import Interrupted, labelled_bar, say
from cranktrain.cli.functions import verb
from cranktrain.cli.plot import draw, pictures_folder, told_deviations
from cranktrain.cli.run_options import asked_of, assembled, balances, note_axial_path, own_data
from cranktrain.core.errors import CranktrainError, InputError, SolverError
from cranktrain.core.typed_file import between
from cranktrain.engine.file import load_engine
from cranktrain.engine.firing import firing_summary, firing_text
from cranktrain.film.laws.register import bearing_law
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import POSITIVE, Option

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
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
WAYS = {"method": "method", "ramp": "ramp_rpm_per_s"}
"""Options for methods other than steady cycles in time: field of the question, and name of the option."""
SETTLE = 1.0e-4
"""Default limit of the settling error at each speed."""
EndSpeed = Annotated[float, between(-20000.0, 20000.0, "rev/min")]


@dataclass(frozen=True, kw_only=True)
class Runup(words.Settled, words.Running):
    """Question of :func:`runup`."""

    from_rpm: Annotated[EndSpeed, Option("RPM", "first speed, rev/min, at least 20", "--from")]
    to_rpm: Annotated[EndSpeed, Option("RPM", "last speed, rev/min", "--to")]
    step_rpm: Annotated[
        float,
        between(0.01, 10000.0, "rev/min"),
        Option("RPM", "distance between speeds, rev/min (default 20)", "--step"),
    ] = 20.0
    settle: words.Settle = SETTLE
    highest_order: Annotated[
        float, between(0.5, 1000.0, "per revolution"), Option("N", "orders 0.5, 1, … up to this one (default 24)")
    ] = 24.0
    outputs: Annotated[
        str,
        Option(
            "NAMES",
            "further outputs to analyse, separated by commas; bearings: all outputs that bearing-loads --run-up reads",
        ),
    ] = ""
    refine: Annotated[
        float | bool,
        between(1e-4, 0.5, "of an order's largest amplitude"),
        Option(
            "SHARE",
            "add speeds where interpolation between two speeds errs by more than this fraction of an order's largest "
            "amplitude (0.02 without a value), down to an eighth of --step",
            bare=0.02,
        ),
    ] = 0.0
    ramp_rpm_per_s: Annotated[
        float | None,
        POSITIVE,
        Option(
            "RPM_PER_S",
            "transient run-up instead of steady cycles; rise of the speed, rev/min per second",
            "--ramp",
        ),
    ] = None
    method: Annotated[
        Literal["linear", "harmonic-balance"] | None,
        Option(
            "METHOD", "in the frequency domain: linear or harmonic-balance; needs --crank torsional", was="--steady"
        ),
    ] = None
    workers: words.Workers | None = None
    scheduler: Annotated[
        str | None, Option("ADDRESS", "run on the Dask cluster of this scheduler, e.g. tcp://host:8786")
    ] = None
    anew: Annotated[bool, Option(help="run all speeds, and replace a file of another run-up")] = False
    output: Annotated[words.File | None, Option("FILE.h5", "result file (default: ENGINE_runup.h5)")] = None
    plots: Annotated[words.File | None, Option("DIR", "write the pictures of cranktrain plot there")] = None
    measured: Annotated[
        words.File | None,
        Option(
            "FILE",
            "measured orders, compared with the computed ones and drawn into the pictures; table of 'cranktrain "
            "measured' or UFF 58",
        ),
    ] = None


@verb(Runup, DESCRIPTION)
def runup(named: str | Path | Engine, ask: Runup) -> OrdersOverSpeed:
    """Run the speeds, and report the results; the result file is kept only if it is named."""
    from cranktrain.results.views.over_speed import OrdersOverSpeed

    if ask.output is not None:
        return OrdersOverSpeed.of(*_found(named, ask))
    with TemporaryDirectory(prefix="cranktrain-runup-") as folder:
        run_up, said = _found(named, replace(ask, output=str(Path(folder) / "runup.h5")))
    del said["result"]
    return OrdersOverSpeed.of(run_up, said)


def answer(engine: str, ask: Runup) -> VerbResult:
    """Run the speeds that the result file lacks, and report all speeds of the file."""
    return _found(engine, replace(ask, output=ask.output or f"{load_engine(engine).name}_runup.h5"))[1]


def _found(named: str | Path | Engine, ask: Runup) -> tuple[RunUp, VerbResult]:
    """Run-up and its report; the message after an interrupt states which speeds the file contains."""
    try:
        return _computed(named, ask)
    except Interrupted:
        raise
    except KeyboardInterrupt:
        path = Path(str(ask.output))
        if count := _kept(path):
            raise Interrupted(f"interrupted; {_keeps(path, count, ask.anew)}") from None
        raise


def _kept(path: Path) -> int:
    """Number of speeds in a file; 0 if there is no file, or none that can be read."""
    from cranktrain.results.run_up.run_up import RunUp

    try:
        return RunUp.load(path).speeds.size
    except CranktrainError:
        return 0


def _keeps(path: Path, count: int, anew: bool) -> str:
    """Message on a file with ``count`` speeds."""
    command = "the command without --anew" if anew else "the same command"
    return f"{path} keeps {count} speeds" + (f"; run {command} again to continue from there" if count else "")


def _computed(named: str | Path | Engine, ask: Runup) -> tuple[RunUp, VerbResult]:
    """Run-up, which is stored in its file, and its report."""
    from cranktrain.dynamics.simulation import check_far_end
    from cranktrain.results.orders.deviations import check_speeds_measured
    from cranktrain.results.orders.measured import read_measured_orders
    from cranktrain.results.run_up.run_up import check_run_up_target
    from cranktrain.results.strength.iacs_m68 import has_sections, shaft_stresses
    from cranktrain.studies.planning.level_error import level_error
    from cranktrain.studies.run_up.modes import in_motion
    from cranktrain.studies.run_up.plan import job_of, run_up_speeds
    from cranktrain.studies.run_up.report import critical_speeds_at_rest, report, torsional_peaks
    from cranktrain.studies.run_up.workers import runs_here

    speeds = run_up_speeds(ask.from_rpm, ask.to_rpm, ask.step_rpm)
    asked = engine, request, settings, gas = asked_of(named, ask, ask.from_rpm, ask.to_rpm)
    _check(ask)
    if ask.method is None:
        check_far_end(engine)
    path = Path(str(ask.output))
    check_run_up_target(path)
    folder = None if ask.plots is None else pictures_folder(ask.plots)
    measured = None if ask.measured is None else read_measured_orders(ask.measured)
    if measured is not None:
        check_speeds_measured(measured, ask.from_rpm / PER_RPM, ask.to_rpm / PER_RPM)
    for rpm in (ask.from_rpm, ask.to_rpm):
        replace(request, speed_rpm=rpm).tell_doubts(engine, gas)
    made = assembled(asked, ask.inherit)
    job = None
    if ask.method is None:
        job = job_of(request, made, gas, _outputs(ask.outputs, made), ask.highest_order)
        job = replace(job, balanced=balances(ask, engine))
    outcome = _outcome(ask, request, made, gas, job, speeds, path)
    found = outcome.run_up
    assert found is not None
    peaks = torsional_peaks(found, made)
    if job is not None and ask.ramp_rpm_per_s is None and peaks:
        peaks = in_motion(peaks, runs_here(job), outcome.starts)
    said = report(found, peaks, engine.published)
    said |= {
        "firing": firing_summary(engine),
        "critical_speeds": critical_speeds_at_rest(found, made, gas),
        "level_error": level_error(engine, settings, ask.from_rpm, ask.to_rpm, _unlike(ask)),
        "failed": [{"rpm": failed.speed * PER_RPM, "reason": failed.reason} for failed in outcome.failed],
        "seconds": outcome.seconds, "workers": outcome.workers, "resumed": outcome.resumed, "result": str(path),
    }  # fmt: skip
    if ask.method is not None and has_sections(engine):
        said["shaft_stress"] = shaft_stresses(engine, found)
    if measured is not None:
        said["deviations"] = told_deviations(found, measured)
    if folder is not None:
        said["plots"] = draw(folder, found, engine, measured, motion=peaks)
    note_axial_path(engine, made.settings, bool((found.repeats == 1).all()))
    return found, VerbResult.of(said, "runup", run_up=found, engine=engine)


def show(said: VerbResult) -> None:
    """Print the resonances and how the speeds were run."""
    from cranktrain.results.orders.deviations import deviation_table
    from cranktrain.results.strength.iacs_m68 import stress_table
    from cranktrain.studies.run_up.report import closing_text, critical_speeds_text, run_up_tables

    if said.get("deviations"):
        console.show(deviation_table(said["deviations"]))
    for table in (*run_up_tables(said), *([stress_table(said["shaft_stress"])] if "shaft_stress" in said else [])):
        console.show(table)
    print(firing_text(said.beside["engine"]))
    if said["critical_speeds"]:
        print(critical_speeds_text(said["critical_speeds"]))
    print(closing_text(said.beside["run_up"]))
    print(said["level_error"]["text"])
    resumed = f", {said['resumed']} of its speeds from an earlier run" if said["resumed"] else ""
    workers = "1 worker" if said["workers"] == 1 else f"{said['workers']} workers"
    print(f"{said['seconds']:.1f} s on {workers}. Result: {said['result']}{resumed}")
    print("".join(f"{picture}\n" for picture in said.get("plots", [])), end="")


def _check(ask: Runup) -> None:
    """Refuse options that exclude each other; ``InputError``."""
    if ask.method is not None and ask.ramp_rpm_per_s is not None:
        raise InputError("--method does not go with --ramp; leave one of them out")
    ways = [name for name in ("method", "ramp") if getattr(ask, WAYS[name]) is not None]
    only = [name for name in ("refine", "scheduler", "workers") if getattr(ask, name)]
    if ways and only:
        raise InputError(f"--{only[0]} goes with steady cycles in time, not with --{ways[0]}; leave one of them out")
    if ask.method is not None and ask.outputs:
        raise InputError("--method gives the pulley's torsion only; leave out --outputs")


def _unlike(ask: Runup) -> str:
    """Line for a run-up by another method than the runs whose level errors are known; else empty."""
    from cranktrain.studies.planning.level_error import NOT_MEASURED

    for name, field in WAYS.items():
        if getattr(ask, field) is not None:
            return f"{NOT_MEASURED} with --{name}; figures are for settled cycles in time (docs/tradeoff.md)."
    return own_data(ask)


def _outcome(
    ask: Runup,
    request: Request,
    made: Assembly,
    gas: Gas | None,
    job: Job | None,
    speeds: list[float],
    path: Path,
) -> Outcome:
    """Run the speeds by the method of the options; the result is in the file."""
    import numpy as np

    from cranktrain.studies.run_up.ramp import ramp
    from cranktrain.studies.run_up.run_up import Means, Outcome, check_replaced, run_up

    chosen = {key: value for key, value in request.attributes(made).items() if key != "speed"}
    attributes = {"engine": made.engine.name, **chosen, "settle": request.settle}
    if balances(ask, made.engine):
        attributes["load"] = words.BALANCED
    outcome, began = Outcome(workers=1), time.perf_counter()
    if (ask.method or ask.ramp_rpm_per_s) and not ask.anew:
        check_replaced(path)
    if job is None:
        from cranktrain.studies.torsion.frequency_run_up import frequency_run_up

        orders = [0.5 * k for k in range(1, int(2.0 * ask.highest_order + 1e-9) + 1)]
        outcome.run_up = frequency_run_up(
            made.engine, made.body, made.settings, np.array(speeds), orders, str(ask.method), gas,
            balanced=balances(ask, made.engine), failed=outcome.failed,
        )  # fmt: skip
        for failed in outcome.failed:
            say(f"cranktrain: warning: no result at {failed.speed * PER_RPM:g} rev/min: {failed.reason}")
    elif ask.ramp_rpm_per_s is None:
        means = Means(ask.workers, ask.scheduler, ask.refine, ask.anew)
        _run_into(path, ask.anew, outcome, lambda tell: run_up(job, speeds, path, means, attributes, tell, outcome))
        return outcome
    else:
        with _bar() as tell:
            outcome.run_up = ramp(job, speeds, ask.ramp_rpm_per_s / PER_RPM, attributes, tell)
    outcome.seconds = time.perf_counter() - began
    outcome.run_up.save(path)
    return outcome


def _outputs(asked: str, made: Assembly) -> list[str]:
    """Names of the requested outputs; includes those of the bearings if ``bearings`` is requested."""
    from cranktrain.results.bearings.run_up_cycles import bearing_outputs

    carries = bearing_law(made.settings.bearings).carries
    names = (bearing_outputs(made.engine, carries) if name == "bearings" else [name] for name in asked.split(","))
    return [name for group in names for name in group if name]


@contextmanager
def _bar() -> Iterator[Callable[[str, float], None]]:
    """Show a progress bar; yields a function of text and fraction done."""
    with labelled_bar("run-up") as (tell_stage, advance):

        def tell(text: str, share: float) -> None:
            advance(share)
            tell_stage(text)

        yield tell


def _run_into(path: Path, anew: bool, outcome: Outcome, work: Callable[[Callable[[str, float], None]], object]) -> None:
    """Do the work with a progress bar; if it ends early, the message states which speeds the file contains."""

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
