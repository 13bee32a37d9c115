"""The verb ``calibrate``: values of an engine file that meet published frequencies."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from cranktrain.cli.console import Interrupted, labelled_bar, say, show_rows
from cranktrain.cli.functions import verb
from cranktrain.core.errors import InputError
from cranktrain.core.typed_file import between
from cranktrain.engine.model import Engine
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, Question

DESCRIPTION = """\
Fit values of an engine file, within bounds, so that its frequencies match targets.

TARGETS is a file that lists the frequencies to be met, with sources and tolerances; the values that may change, with
their bounds; and the values derived from these. The name of a shipped engine stands for its own targets file. Trying a
bearing, mass or inertia takes milliseconds, a changed dimension one more mesh. An interrupted search keeps the best
values so far.

deviation    of our frequency from the target; a target is met if this is within its tolerance
sensitivity  change of the frequency, in per cent, for one per cent of the value (d ln f / d ln p)
"""


@dataclass(frozen=True)
class Calibrate(Question):
    """Question of :func:`calibrate`."""

    targets: Annotated[
        words.File,
        Option("TARGETS", "path of a targets .toml file, or name of a shipped engine that has one", place=True),
    ]
    _: KW_ONLY
    out: Annotated[words.File | None, Option("FILE", "engine file to write; an existing file is not overwritten")] = (
        None
    )
    seed: Annotated[int, between(0, 2**32 - 1, ""), Option("N", "seed of the search (default 1)")] = 1
    evaluations: Annotated[
        int,
        between(1, 10_000_000, ""),
        Option("N", "limit of the search (default 20000; a search with new bodies takes half of it more)"),
    ] = 20000


@verb(Calibrate, DESCRIPTION)
def calibrate(named: str | Path | Engine, ask: Calibrate) -> VerbResult:
    """Search, and write the engine file."""
    report = searched(named, ask)
    if report["refused"]:
        raise InputError(f"{ask.out}: not written; the values found are not a valid engine: {report['refused']}")
    if report["interrupted"]:
        kept = f"the best values so far are in {report['file']}" if report["file"] else "nothing was written"
        raise Interrupted(f"interrupted; {kept}", report)
    return report


def searched(named: str | Path | Engine, ask: Calibrate) -> VerbResult:
    """Search and write, however it ends."""
    from cranktrain_lab.calibration import calibrate as study

    with labelled_bar("calibrate") as (tell, follow):
        last = 0.0

        def progress(share: float, cost: float) -> None:
            nonlocal last
            follow(share)
            if share >= last + 0.05 or share < last:
                last = share
                tell(f"sum of squared deviations over tolerances {cost:.3g}")

        report = study.calibrate(
            named, ask.targets, ask.out, seed=ask.seed, evaluations=ask.evaluations, say=tell, follow=progress
        )
    return VerbResult.of(report, "calibrate")


def show(report: VerbResult) -> None:
    """Print targets, values found and sensitivities."""
    keys = [p["key"] for p in report["parameters"]]
    rows = [
        (
            t["name"], t["shape"], f"{t['target_hz']:g}", f"{t['hz']:.1f}", f"{t['deviation_percent']:+.2f} %",
            f"{t['tolerance_percent']:g} %", "yes" if t["met"] else "no",
            ", ".join(f"{key} {t['sensitivities'][key]:+.2f}" for key in t["rests_on"][:4]),
        )
        for t in report["targets"]
    ]  # fmt: skip
    header = ("target", "shape", "Hz", "ours / Hz", "deviation", "tolerance", "met", "rests on (sensitivity)")
    show_rows(f"{report['engine']}: targets", header, rows)
    if report["extra_modes_hz"]:
        found = ", ".join(f"{hz:.1f}" for hz in report["extra_modes_hz"])
        print(f"Computed modes below the last target that match no target: {found} Hz")
    show_rows(
        "Free values",
        ("value", "found", "low", "high", "unit", ""),
        [
            (p["key"], f"{p['value']:.4g}", f"{p['low']:g}", f"{p['high']:g}", p["unit"], "at a bound" * p["at_bound"])
            for p in report["parameters"]
        ],
    )
    show_rows("Derived values (SI)", ("value", "found"), [(d["key"], f"{d['value']:.4g}") for d in report["derived"]])
    show_rows(
        "Sensitivities d ln f / d ln p",
        ("value", *(t["name"] for t in report["targets"])),
        [(key, *(f"{t['sensitivities'][key]:+.2f}" for t in report["targets"])) for key in keys],
    )
    if report["confirmed"]:
        print("The engine's own values meet all targets, so no search was made. For a search give narrower tolerances.")
    if report["file"]:
        say(f"{report['file']} written")
