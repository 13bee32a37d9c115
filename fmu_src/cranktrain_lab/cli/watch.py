"""The verb ``watch``: whether an engine's torsion has changed, and which defect explains it."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Literal

from cranktrain.cli.console import labelled_bar, show_rows
from cranktrain.cli.functions import verb
from cranktrain.core.typed_file import between
from cranktrain.engine.model import Engine
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, Question, paths
from cranktrain.studies.torsion.frequency_run_up import HARMONIC_BALANCE, LINEAR
from cranktrain_lab.cli.measured import order_range
from cranktrain_lab.watch.recordings import OUTPUTS

RULES = (LINEAR, HARMONIC_BALANCE)
DESCRIPTION = """\
Find misfires, worn dampers and cracked springs from measured orders of the pulley's torsion alone.

MEASURED are recordings of the engine as it is now, --healthy those of the engine as it was when all was well: a file of
orders each, as 'cranktrain measured --output' writes them. What the healthy recordings differ by among themselves gives
the noise; what all of them differ by from the model is left out.

statistic   generalised likelihood ratio of a defect: how much better it explains the change than nothing
severity    0 healthy; misfire 1: no burn at all; others: fraction of the stiffness or viscosity that is lost
probability of this cause, if one of those listed is the cause
smallest    severity that is found in 9 of 10 recordings
taken for   causes that this one is mistaken for at least once in 20
"""


@dataclass(frozen=True)
class Watch(Question):
    """Question of :func:`watch`."""

    measured: Annotated[
        words.File | Sequence[words.File],
        Option("MEASURED", "files of orders, one a recording; several are averaged", place=True),
    ]
    _: KW_ONLY
    healthy: Annotated[
        words.File | Sequence[words.File], Option("FILE", "recordings of the healthy engine, three or more")
    ]
    output: Annotated[
        Literal["pulley.torsion", "flywheel.torsion", "twist"],
        Option("NAME", f"watched output: {', '.join(OUTPUTS)} (default {OUTPUTS[0]})", words=OUTPUTS),
    ] = "pulley.torsion"
    orders: Annotated[words.OrdersOf, Option("LIST", "orders that count (default: all)", convert=order_range)] = ()
    false_alarms: Annotated[
        float,
        between(1e-3, 0.5, ""),
        Option("RATE", "fraction of healthy recordings that may raise an alarm (default 0.01)"),
    ] = 0.01
    load: Annotated[float, between(0.0, 2.0, ""), Option("SHARE", "of the full-load burn (default 1)")] = 1.0
    method: Annotated[
        Literal["linear", "harmonic-balance"],
        Option("METHOD", f"of the model: {', '.join(RULES)} (default {HARMONIC_BALANCE})", words=RULES, was="--level"),
    ] = "harmonic-balance"
    damper: Annotated[bool, Option(help="with the engine's torsional damper on the pulley", was="--no-damper")] = False
    inherit: Annotated[bool, Option(help="crank with its structural damping alone")] = True
    seed: Annotated[int, between(0, 2**32 - 1, ""), Option("N", "seed of the draws (default 1)")] = 1


@verb(Watch, DESCRIPTION)
def watch(named: str | Path | Engine, ask: Watch) -> VerbResult:
    """Compare recordings with those of the healthy engine, and rank the defects that explain the change."""
    from cranktrain_lab.watch import watch as study

    chosen = study.Request(
        ask.output, words.orders_of(ask.orders), ask.false_alarms, ask.load, ask.damper, ask.method, ask.inherit,
        ask.seed,
    )  # fmt: skip
    with labelled_bar("watch") as (tell, follow):
        report = study.watch(named, paths(ask.measured), paths(ask.healthy), chosen, tell, follow)
    return VerbResult.of(report, "watch")


def show(report: VerbResult) -> None:
    """Print the possible causes, the most likely first."""
    rows = [
        (
            row["defect"], f"{row['statistic']:.3g}", f"{row['severity']:.2f}", f"{100.0 * row['probability']:.0f} %",
            "none" if row["smallest"] is None else f"{row['smallest']:.2g}",
            ", ".join(one["defect"] for one in row["taken_for"]) or "-",
        )
        for row in report["defects"]
    ]  # fmt: skip
    speeds = ", ".join(f"{one:.0f}" for one in report["speeds_rpm"])
    show_rows(
        f"{report['engine']} at {speeds} rev/min, {len(report['orders'])} orders, {report['healthy']} healthy",
        ("cause", "statistic", "severity", "probability", "smallest", "taken for"), rows,
    )  # fmt: skip
    for line in report["said"]:
        print(line)
