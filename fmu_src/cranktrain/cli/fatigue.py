"""The verb ``fatigue``: safety of the crankshaft's fillets and oil bores, and the rule IACS UR M53."""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cranktrain.cli.console import jsonable, labelled_bar, of_words, one_of, say, show_rows, stages
from cranktrain.cli.fillets import add_fillet_option, chosen_throws, fillets_of
from cranktrain.cli.run_options import (
    add_encoder_option,
    add_level_options,
    add_settle_option,
    add_source_options,
    engine_of,
    gas_of,
    option_of,
    request_of,
)
from cranktrain.store.whole_file import check_place, marked, whole_file

if TYPE_CHECKING:
    from cranktrain.studies.fatigue import FatigueReport

DESCRIPTION = """\
Safety factors of the crankshaft's fillets and oil bores over the cycle, and acceptability by rule IACS UR M53.

Each speed is run until its outputs repeat. Loads are then taken at cuts through webs and pins, and stresses from the
rule's stress factors, or with --fillets from fine sub-models of the throws named. The speed with the lowest safety
factor counts. The engine file needs a table [crank_strength]. --json prints {"fillets": [{"name", "safety_factor",
"amplitude_mpa", "mean_mpa", "converged", "speed_rpm", "by", "safety_factor_by_rule_factors"}], "rule", "speeds", …}.
With --bearings held main journals do not move, so each throw bends by itself.
"""
CRITERIA = ("haigh", "findley")
RESULT = marked("result of cranktrain fatigue", '"fillets"')


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options to those that all verbs of an engine have."""
    add = parser.add_argument
    add(
        "--speed", dest="speeds_rpm", type=float, nargs="+", metavar="RPM",
        help="speeds, rev/min (default: the engine's best_speed)",
    )  # fmt: skip
    law = add(
        "--criterion", default="haigh", metavar="NAME",
        help="haigh (default): rainflow and mean stress; findley: shear and normal stress of the critical plane",
    )  # fmt: skip
    of_words(law, CRITERIA)
    add_level_options(parser, without="--pistons")
    add_settle_option(parser)
    add_source_options(parser)
    add_encoder_option(parser)
    add_fillet_option(parser, "stresses of fillets and oil bores")
    add("--output", metavar="FILE.json", help="file for what --json prints, which cranktrain report reads")
    add("--plots", metavar="FOLDER", help="folder for pictures of safety factors and, for haigh, its diagram")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Run the speeds, judge every place, print a table unless JSON is wanted."""
    from cranktrain.results.figures import check_folder
    from cranktrain.results.strength.figures import PICTURES, save_pictures
    from cranktrain.structure.stress.stress_modes import ShapedCrank
    from cranktrain.studies.fatigue import crank_strength, fatigue
    from cranktrain.studies.stressed_run import check_stressed

    engine = engine_of(options)
    crank_strength(engine)
    one_of("--criterion", options.criterion, CRITERIA)
    speeds = options.speeds_rpm or [round(engine.best_speed * 30.0 / math.pi, 6)]
    request = request_of(options, speeds[0])
    for speed in speeds:
        replace(request, speed_rpm=speed).settings(engine, option_of)
    gas = gas_of(request, engine, speeds)
    folder = None if options.plots is None else Path(options.plots)
    if folder is not None:
        check_folder(folder, pictures=PICTURES)
    target = None if options.output is None else Path(options.output)
    if target is not None:
        check_place(target, RESULT)
    throws = chosen_throws(options, engine)
    if throws:
        check_stressed(request, request.settings(engine, option_of))
    with stages(f"{engine.name}: fatigue") as tell:
        fillets = fillets_of(engine, throws, cache(lambda: ShapedCrank.of(engine, None, tell)), tell)
    with labelled_bar(f"{engine.name}: fatigue") as (tell, advance):
        report = fatigue(engine, request, speeds, options.criterion, tell, advance, fillets, gas)
    found = report.as_dict()
    if folder is not None:
        places = [one for one, _ in report.places]
        title = f"{engine.title}, {', '.join(f'{speed:g}' for speed in speeds)} rev/min"
        haigh = report.criterion == "haigh"
        paths = save_pictures(folder, engine, report.strength, places, title, haigh)
        found["plots"] = [str(path) for path in paths]
    if target is not None:
        with whole_file(target, RESULT) as temporary:
            temporary.write_text(json.dumps(jsonable(found), indent=2, allow_nan=False), encoding="utf-8")
    if not options.json:
        _show(report, found)
    return found


def _show(report: FatigueReport, found: dict[str, Any]) -> None:
    """Print what is found for people."""
    rule = {row["name"]: row for row in found["rule"]["places"]}
    rows = [
        (
            one["name"],
            *(f"{one[key]:.4g}" for key in ("safety_factor", "amplitude_mpa", "mean_mpa", "speed_rpm")),
            one["by"] + ("" if one["converged"] else " (not converged)"),
            f"{rule[one['name']]['equivalent_mpa']:.4g}",
            f"{rule[one['name']]['acceptability']:.3g}",
        )
        for one in found["fillets"]
    ]
    header = (
        "place", "safety factor", "amplitude / MPa", "mean / MPa", "rev/min", "stress by", "rule: stress / MPa",
        "rule: Q",
    )  # fmt: skip
    show_rows(f"{report.engine.title}: fatigue by {report.criterion}", header, rows)
    least, q = (min(found["fillets"], key=lambda one: one["safety_factor"]), min(rule.values(), key=_acceptability))
    print(f"Least safety factor {least['safety_factor']:.3g} at {least['name']}, {least['speed_rpm']:g} rev/min")
    outside = found["rule"]["outside"]
    if outside:
        print(f"IACS UR M53 does not judge this crank, its factors are extrapolated: {', '.join(outside)}")
    else:
        verdict = "accepted" if found["rule"]["accepted"] else "not accepted"
        print(f"IACS UR M53: least Q {q['acceptability']:.3g} at {q['name']}, 1.15 is required: {verdict}")
    for at in found["speeds"]:
        print(
            f"{at['rpm']:g} rev/min: bending of the {at['bending']}; residual "
            f"of the force balance {at['unbalanced_relative']:.1e}. {at['settling']}"
        )
    if report.interrupted:
        say("interrupted; results are shown for the finished speeds")
    if "plots" in found:
        print("Pictures: " + ", ".join(found["plots"]))


def _acceptability(row: dict[str, Any]) -> float:
    return float(row["acceptability"])
