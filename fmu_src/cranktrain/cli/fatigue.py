"""The verb ``fatigue``: safety of the crankshaft's fillets and oil bores, and the rule IACS UR M53."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cranktrain.cli.console import labelled_bar, say, show_rows, stages
from cranktrain.cli.fillets import chosen_throws, fillet_help, fillets_of
from cranktrain.cli.functions import verb
from cranktrain.cli.run_options import engine_of, gas_of, option_of, request_of
from cranktrain.results.page_head import jsonable
from cranktrain.results.views.found import VerbResult
from cranktrain.store.whole_file import check_place, marked, whole_file
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, several

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.studies.fatigue import FatigueReport

DESCRIPTION = """\
Safety factors of the crankshaft's fillets and oil bores over the cycle, and acceptability by rule IACS UR M53.

Each speed is run until its outputs repeat. Loads are then taken at cuts through webs and pins, and stresses from the
rule's stress factors, or with --fillets from fine sub-models of the throws named. The speed with the lowest safety
factor counts. The engine file needs a table [crank_strength]. --json prints {"fillets": [{"name", "safety_factor",
"amplitude_mpa", "mean_mpa", "converged", "speed_rpm", "by", "safety_factor_by_rule_factors"}], "rule", "speeds", …}.
With --bearings held main journals do not move, so each throw bends by itself.
"""
RESULT = marked("result of cranktrain fatigue", '"fillets"')


@dataclass(frozen=True, kw_only=True)
class Fatigue(
    words.CrankLevel, words.Levels, words.Load, words.Settled, words.Pressures, words.Encoder, words.Meshes
):  # fmt: skip
    """Question of :func:`fatigue`."""

    speeds_rpm: Annotated[
        float | Sequence[float] | None, Option("RPM", "speeds, rev/min (default: the engine's best_speed)", "--speed")
    ] = None
    criterion: Annotated[
        Literal["haigh", "findley"],
        Option(
            "NAME", "haigh (default): rainflow and mean stress; findley: shear and normal stress of the critical plane"
        ),
    ] = "haigh"
    fillets: Annotated[str | None, Option("THROWS", fillet_help("stresses of fillets and oil bores"))] = None
    output: Annotated[
        words.File | None, Option("FILE.json", "file for what --json prints, which cranktrain report reads")
    ] = None
    plots: Annotated[
        words.File | None, Option("FOLDER", "folder for pictures of safety factors and, for haigh, its diagram")
    ] = None


@verb(Fatigue, DESCRIPTION)
def fatigue(named: "str | Path | Engine", ask: Fatigue) -> VerbResult:
    """Run the engine at each speed, and judge every fillet and oil bore."""
    from cranktrain.results.figures import check_folder
    from cranktrain.results.strength.figures import PICTURES, save_pictures
    from cranktrain.structure.stress.stress_modes import ShapedCrank
    from cranktrain.studies import fatigue as study
    from cranktrain.studies.stressed_run import check_stressed

    engine = engine_of(named, ask)
    study.crank_strength(engine)
    speeds = list(several(ask.speeds_rpm)) or [round(engine.best_speed * 30.0 / math.pi, 6)]
    request = request_of(ask, speeds[0])
    for speed in speeds:
        replace(request, speed_rpm=speed).settings(engine, option_of)
    gas = gas_of(request, engine, speeds)
    folder = None if ask.plots is None else Path(ask.plots)
    if folder is not None:
        check_folder(folder, pictures=PICTURES)
    target = None if ask.output is None else Path(ask.output)
    if target is not None:
        check_place(target, RESULT)
    throws = chosen_throws(ask.fillets, ask.mesh, engine)
    if throws:
        check_stressed(request, request.settings(engine, option_of))
    with stages(f"{engine.name}: fatigue") as tell:
        fillets = fillets_of(engine, throws, cache(lambda: ShapedCrank.of(engine, None, tell)), tell)
    with labelled_bar(f"{engine.name}: fatigue") as (tell, advance):
        report = study.fatigue(engine, request, speeds, ask.criterion, tell, advance, fillets, gas)
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
    return VerbResult.of(found, "fatigue", report=report)


def show(found: VerbResult) -> None:
    """Print the safety factors, and the result of the rule."""
    report: FatigueReport = found.beside["report"]
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
    least = min(found["fillets"], key=lambda one: one["safety_factor"])
    q = min(rule.values(), key=lambda one: float(one["acceptability"]))
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
