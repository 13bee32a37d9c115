"""The verb ``watch``: whether an engine's torsion has changed, and which defect explains it."""

from __future__ import annotations

import argparse
from typing import Any

from cranktrain.cli.console import number, of_words, show_rows
from cranktrain.studies.torsion.frequency_run_up import HARMONIC_BALANCE, LINEAR
from cranktrain_lab.cli.measured import order_range
from cranktrain_lab.watch.model import OUTPUTS

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


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    add = parser.add_argument
    add("engine", metavar="ENGINE", help="name of a shipped engine or path of a .toml file")
    add("measured", nargs="+", metavar="MEASURED", help="files of orders, one a recording; several are averaged")
    add("--healthy", nargs="+", required=True, metavar="FILE", help="recordings of the healthy engine, three or more")
    output = add("--output", default=OUTPUTS[0], metavar="NAME", help=f"watched output: {', '.join(OUTPUTS)} "
                 f"(default {OUTPUTS[0]})")  # fmt: skip
    of_words(output, OUTPUTS)
    add("--orders", type=order_range, default=[], metavar="LIST", help="orders that count (default: all)")
    add(
        "--false-alarms", type=number(1e-3, 0.5, ""), default=0.01, metavar="RATE",
        help="fraction of healthy recordings that may raise an alarm (default 0.01)",
    )  # fmt: skip
    add("--load", type=number(0.0, 2.0, ""), default=1.0, metavar="SHARE", help="of the full-load burn (default 1)")
    level = add("--level", default=HARMONIC_BALANCE, metavar="LEVEL", help=f"of the model: {', '.join(RULES)} "
                f"(default {HARMONIC_BALANCE})")  # fmt: skip
    of_words(level, RULES)
    add("--no-damper", dest="damper", action="store_false", help="the engine runs without its damper")
    add("--no-inherit", dest="inherit", action="store_false", help="crank with its structural damping alone")
    add("--seed", type=number(0, 2**32 - 1, "", int), default=1, metavar="N", help="seed of the draws (default 1)")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Watch, and print the report unless JSON is wanted."""
    from cranktrain.cli.console import labelled_bar, one_of
    from cranktrain_lab.watch.watch import Request, watch

    one_of("--output", options.output, OUTPUTS)
    one_of("--level", options.level, RULES)
    with labelled_bar("watch") as (tell, follow):
        report = watch(
            options.engine, options.measured, options.healthy,
            Request(
                options.output, options.orders, options.false_alarms, options.load, options.damper, options.level,
                options.inherit, options.seed,
            ), tell, follow,
        )  # fmt: skip
    if not options.json:
        _show(report)
    return report


def _show(report: dict[str, Any]) -> None:
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
