"""The verb ``identify``: parameters of an engine from measured data, with their intervals."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from cranktrain.cli.console import Interrupted, labelled_bar, say, show_rows
from cranktrain.cli.functions import verb
from cranktrain.core.errors import InputError
from cranktrain.core.typed_file import between
from cranktrain.core.user_file import ending
from cranktrain.engine.levels import CRANKS
from cranktrain.engine.model import Engine
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, Question
from cranktrain_lab.cli import targets
from cranktrain_lab.identification.tables import LEVELS, NEXT, NONE

DESCRIPTION = """\
Find parameters of an engine from measured data: damping, damper, inertias, shafts, load, with 95 % intervals.

MEASURED is a file that lists measured orders, torques, orbits of journals, frequencies, decays and shapes, and the
parameters sought, with bounds and what is known of them before.

A file of [targets] alone lists published frequencies to be met, with tolerances, the values that may change, within
bounds, and those derived from these; the name of a shipped engine stands for its own targets file. Trying a bearing,
mass or inertia takes milliseconds, a changed dimension one more mesh. Of each frequency are given its deviation from
the target, and the sensitivity d ln f / d ln p: its change, in per cent, for one per cent of a value.

linear            linear run-up of the torsional crank, all speeds and orders at once
harmonic-balance  the same with the rods' exact torques and the damper's law (default)
time              runs in time of a crank of any level (--crank), each speed to its steady cycle; orbits of journals
                  take --crank beam or solid, which run in oil films

The cheap level is fitted; a dear one corrects it in a few answers. An interrupted search keeps the best values so far.

Levels above the fitted one answer once, for what they would move; the next crank that bends among them, whose films
damp as a damper does (--above).

95 % from, to     interval by the profile: noise, bias of the model over the speed, what levels above would move
Narrower          of a wide interval: the signal that would narrow it most, and to what
over noise        residual of an order over the noise; systematic ones have runs of one sign over the speed
"""


@dataclass(frozen=True)
class Identify(Question):
    """Question of :func:`identify`."""

    measured: Annotated[
        words.File,
        Option(
            "MEASURED",
            "path of a .toml file of measured data and sought parameters, or of targets; or name of a shipped engine "
            "that has targets",
            place=True,
        ),
    ]
    _: KW_ONLY
    output: Annotated[
        words.File | None, Option("FILE", "engine file to write; an existing file is not overwritten", was="--out")
    ] = None
    method: Annotated[
        Literal["linear", "harmonic-balance", "time"],
        Option("METHOD", f"last level: {', '.join(LEVELS)} (default {LEVELS[1]})", words=LEVELS, was="--level"),
    ] = "harmonic-balance"
    crank: Annotated[
        words.CrankWord, Option("LEVEL", "crank of runs in time (default torsional)", words=CRANKS.keys)
    ] = "torsional"
    above: Annotated[
        Literal["next", "none", "rigid", "torsional", "beam", "solid"],
        Option(
            "LEVEL",
            "crank above the fitted one, whose run in time says once what it would move: beam, solid, next that bends "
            "(default), or none",
            words=(NEXT, NONE, *CRANKS),
        ),
    ] = "next"
    settle: Annotated[
        float, between(1e-8, 0.5, ""), Option("SHARE", "largest settling error of runs in time (default 0.001)")
    ] = 1e-3
    bootstrap: Annotated[int, between(0, 100_000, ""), Option("N", "draws (default 400)")] = 400
    profile: Annotated[bool, Option(help="intervals by the covariance alone, which is faster")] = True
    seed: Annotated[int, between(0, 2**32 - 1, ""), Option("N", "seed of starts and draws (default 1)")] = 1
    evaluations: Annotated[
        int,
        between(1, 10_000_000, ""),
        Option(
            "N",
            "of targets alone: limit of the search (default 20000; a search with new bodies takes half of it more)",
        ),
    ] = 20000


@verb(Identify, DESCRIPTION)
def identify(named: str | Path | Engine, ask: Identify) -> VerbResult:
    """Identify the parameters, and write the engine file with them."""
    from cranktrain_lab.calibration.targets import targets_path
    from cranktrain_lab.identification import identify as study
    from cranktrain_lab.identification.confidence import with_confidence
    from cranktrain_lab.identification.ladder import Ask

    place: str | Path = ask.measured if ending(ask.measured) else targets_path(ask.measured)
    read, _ = study.read_measured_file(place)
    beside = dict[str, Any]()
    if read.targets and not read.has_sets:
        calibration = targets.calibrated(named, place, ask.output, ask.seed, ask.evaluations)
        report = with_confidence(calibration)
        beside["calibrated"] = calibration
    else:
        with labelled_bar("identify") as (tell, follow):
            report = study.identify(
                named, place, ask.output,
                request=study.Request(
                    Ask(ask.method, ask.crank, ask.settle, ask.seed, ask.above), ask.bootstrap, ask.profile
                ),
                say=tell, follow=lambda share, cost: follow(share),
            )  # fmt: skip
    found = VerbResult.of(report, "identify", **beside)
    if report["refused"]:
        raise InputError(f"{ask.output}: not written; the values found are not a valid engine: {report['refused']}")
    if report["interrupted"]:
        kept = f"the best values so far are in {report['file']}" if report["file"] else "nothing was written"
        raise Interrupted(f"interrupted; {kept}", found)
    return found


def show(report: VerbResult) -> None:
    """Print the parameters found with their intervals, or those of a calibration."""
    if "calibrated" not in report.beside:
        _show(report)
        return
    targets.show(report.beside["calibrated"])
    rows = [
        (p["key"], f"{p['value']:.4g}", p["unit"],
         "" if p["deviation_percent"] is None else f"{p['deviation_percent']:.2g} %")
        for p in report["parameters"]
    ]  # fmt: skip
    show_rows("What the targets say, tolerances as deviations", ("parameter", "found", "unit", "deviation"), rows)
    for line in report["told_apart"]:
        print(f"Not told apart: {line}")


def _show(report: dict[str, Any]) -> None:
    rows = [
        (
            p["key"], f"{p['value']:.4g}", f"{p['low']:.4g}", f"{p['high']:.4g}", p["unit"],
            "" if p["deviation_percent"] is None else f"{p['deviation_percent']:.2g} %",
            f"{p['bounds'][0]:.4g} to {p['bounds'][1]:.4g}", "at a bound" * p["at_bound"],
        )
        for p in report["parameters"]
    ]  # fmt: skip
    header = ("parameter", "found", "95 % from", "to", "unit", "deviation", "bounds", "")
    show_rows(f"{report['engine']}: identified from {report['measured']}", header, rows)
    if report["interrupted"]:
        print("The search was interrupted: intervals are those of a fit that ended here, and say little.")
    for line in report["told_apart"]:
        print(f"Not told apart: {line}")
    for line in report["doubts"]:
        print(f"Doubtful: {line}")
    for row in report["advice"]:
        print(f"Narrower: {row['text']}")
    keys = [p["key"] for p in report["parameters"]]
    show_rows(
        "Levels", ("level", "answers", *keys, ""),
        [
            (s["level"], str(s["answers"]), *(f"{s['values'][key]:.4g}" for key in keys), note)
            for rows, note in ((report["levels"], ""), (report["above"], "not fitted: would move there"))
            for s in rows
        ],
    )  # fmt: skip
    if report["orders"]:
        show_rows(
            "Residuals by order",
            (
                "set", "order", "speeds", "of amplitude", "over noise", "largest", "at rev/min", "systematic",
                "wheel / deg",
            ),
            [
                (
                    r["set"], f"{r['order']:g}", str(r["points"]), f"{r['residual_percent']:.2g} %",
                    f"{r['over_noise']:.2g}", f"{r['largest_percent']:.2g} %", f"{r['largest_at_rpm']:.0f}",
                    "yes" if r["systematic"] else "no",
                    "–" if r["constant_deg"] is None else f"{r['constant_deg']:.2g} ± {r['constant_band_deg']:.1g}",
                )
                for r in report["orders"]
            ],
        )  # fmt: skip
    if report["orbits"]:
        show_rows(
            "Residuals of orbits",
            ("set", "bearing", "rev/min", "points", "of orbit", "over noise", "largest", "at deg", "systematic"),
            [
                (
                    r["set"], r["bearing"], f"{r['rpm']:.0f}", str(r["points"]), f"{r['residual_percent']:.2g} %",
                    f"{r['over_noise']:.2g}", f"{r['largest_um']:.2g} um", f"{r['largest_at_deg']:.0f}",
                    "yes" if r["systematic"] else "no",
                )
                for r in report["orbits"]
            ],
        )  # fmt: skip
    if report["numbers"]:
        show_rows(
            "Frequencies, decays and shapes", ("set", "kind", "measured", "computed", "over deviation"),
            [(r["set"], r["kind"], f"{r['measured']:.5g}", f"{r['computed']:.5g}", f"{r['over_deviation']:+.2f}")
             for r in report["numbers"]],
        )  # fmt: skip
    if report["held_out"]:
        inside = sum(row["inside"] for row in report["held_out"])
        print(f"Held-out points within their 95 % bands: {inside} of {len(report['held_out'])}")
    if report["systematic"]:
        print(f"Systematic residuals: {', '.join(report['systematic'])}")
    if report["file"]:
        say(f"{report['file']} written")
