"""The verb ``plan``: the lowest levels, modes, method and step that serve a scene, with the reasons; and its runs."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cranktrain.cli.console import Interrupted, bar, say, show_rows, stages
from cranktrain.cli.functions import SCENE, verb, verb_of
from cranktrain.core.errors import InputError
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, Question
from cranktrain.studies.scene import Scene, load_scene

if TYPE_CHECKING:
    from cranktrain.studies.planning.plan import Plan
    from cranktrain.studies.planning.running import SceneRun
    from cranktrain.studies.planning.scene_model import Case, SceneModel

DESCRIPTION = """\
The plan for a scene: which levels and step serve it, why, and with which error and computing time.

A plan picks the lowest levels, number of modes, bearing law, integrator and step that are accurate enough. Its errors
and times are measured by short runs of the scene's own model, and kept in the cache. The model error is the difference
from the next level up, the numerical error the difference from half the step. Both are relative, up to the scene's
highest frequency; the largest over its outputs and speeds counts. Where measured total errors ship for the engine (see
cranktrain tradeoff --total), the plan takes the cheapest levels whose total error is within the accuracy.
"""
CHECKS = """\
--verify      also run the next level up with half the step, and compare the predicted error with the difference
--all-levels  also run every level of crank and bearings that has the scene's outputs, from rigid to reynolds, and
              list each output's difference from the top level, with the computing time
"""
RUNS = f"""\
Plan a scene and run it, speed by speed; write an HDF5 result and print a summary of the wanted outputs.

{CHECKS}"""
COMMAND = f"""\
{DESCRIPTION}
--run         run the plan, speed by speed, write an HDF5 result and print a summary of the wanted outputs
{CHECKS}"""


@verb(Question, DESCRIPTION, SCENE)
def plan(scene: str | Path | Scene, ask: Question) -> Plan:
    """Plan of a scene: the lowest levels, method and step that meet its accuracy."""
    return made_plan(load_scene(scene))[0]


@dataclass(frozen=True, kw_only=True)
class RunScene(Question):
    """Question of :func:`run_scene`."""

    apart = (("verify", "all_levels"),)
    verify: Annotated[bool, Option(help="check the predicted error by one run at the next level")] = False
    all_levels: Annotated[bool, Option(help="run every level; report differences from the top")] = False
    with_ehd: Annotated[bool, Option(help="with --all-levels: elastic films too, minutes")] = False
    output: Annotated[words.File | None, Option("FILE.h5", "result file (default: SCENE.h5)")] = None


@verb(RunScene, RUNS, SCENE)
def run_scene(named: str | Path | Scene, ask: RunScene) -> VerbResult:
    """Run the scene and summarise it; after an interrupt the finished runs are kept."""
    from cranktrain.results.files import check_target
    from cranktrain.studies.planning.running import SceneRun

    if ask.with_ehd and not ask.all_levels:
        raise InputError('--with-ehd belongs to --all-levels; to run a scene with elastic films set bearings = "ehd"')
    scene = load_scene(named)
    output = Path(ask.output or f"{scene.name}.h5")
    check_target(output)
    if scene.stress:
        say(f"{scene.name}: no stresses are computed; the solid crank runs with all modes that 'stress' needs")
    made, model = made_plan(scene, compare=ask.verify)
    runs = SceneRun(made, model, output)
    with bar(f"{scene.name}: {made.case}") as advance:
        runs.run(made.case, advance)
    others: list[Case] = []
    if ask.verify:
        others = [made.next]
    elif ask.all_levels:
        others = [case for case in ladder_cases(runs, ask.with_ehd) if case.levels != made.case.levels]
    for case in others:
        if runs.interrupted:
            break
        with bar(f"{scene.name}: {case}") as advance:
            level = runs.run(case, advance)
        if level.status != "ok":
            say(f"{case}: {level.status}")
    if ask.all_levels:
        runs.sort()
    result = {
        "result": str(output),
        "outputs": runs.outputs(),
        "levels": runs.rows(),
        "settling": runs.settling,
        "plan": made.as_dict(),
        "interrupted": runs.interrupted,
    }
    if ask.verify:
        result["verification"] = runs.verification()
    if runs.interrupted and not result["outputs"]:
        raise KeyboardInterrupt
    if runs.interrupted:
        say(f"interrupted; {output} holds the finished runs, repeat the command for the rest")
    return VerbResult.of(result, "plan", plan=made)


@dataclass(frozen=True, kw_only=True)
class PlanOrRun(RunScene):
    """Question of the command ``plan``."""

    run: Annotated[bool, Option(help="also run the plan, and write a result")] = False


@verb(PlanOrRun, COMMAND, SCENE)
def plan_or_run(scene: str | Path | Scene, ask: PlanOrRun) -> Plan | VerbResult:
    """Make the plan, and run it if requested."""
    if ask.run:
        chosen = {one.name: getattr(ask, one.name) for one in fields(RunScene)}
        runs: VerbResult = verb_of(run_scene).function(scene, RunScene(**chosen))
        return runs
    given = next((one.name for one in fields(RunScene) if getattr(ask, one.name) != one.default), None)
    if given is not None:
        raise InputError(f"--{given.replace('_', '-')} goes with --run; add --run, or leave it out")
    return made_plan(load_scene(scene))[0]


def show(found: Plan | VerbResult) -> None:
    """Print the plan with its reasons, and the results of its runs."""
    if isinstance(found, VerbResult):
        _show_runs(found)
    else:
        show_plan(found)


def told(found: Plan | VerbResult) -> dict[str, Any]:
    """Dictionary that ``--json`` prints."""
    return found if isinstance(found, VerbResult) else found.as_dict()


def ladder_cases(runs: SceneRun, with_ehd: bool) -> list[Case]:
    """Every level that the scene's outputs allow, with all modes, at the plan's method and step; ehd at its own."""
    from cranktrain.film.laws.register import bearing_law
    from cranktrain.studies.planning.ladder import dearest, every_pair
    from cranktrain.studies.planning.scene_model import Case

    case, cutoff = runs.plan.case, runs.model.all_modes
    law = bearing_law("ehd")
    elastic = (law.integrator, min(case.step, math.radians(law.step_deg)))
    return [
        Case(*pair, cutoff, *(elastic if dearest(pair[1]) else (case.integrator, case.step)))
        for pair in every_pair(runs.scene, with_ehd)
    ]


def made_plan(scene: Scene, compare: bool = False) -> tuple[Plan, SceneModel]:
    """Plan of a scene, and the model on which it was measured; shows the stages.

    ``compare`` the plan's levels with the next higher ones, even if this takes minutes.
    """
    from cranktrain.studies.planning import planning
    from cranktrain.studies.planning.scene_model import SceneModel

    try:
        with stages(f"{scene.name}: plan") as tell:
            model = SceneModel(scene, tell)
            return planning.plan(scene, model, compare), model
    except KeyboardInterrupt:
        raise Interrupted("interrupted; finished measurements are kept, repeat the command to continue") from None


def show_plan(made: Plan) -> None:
    """Print a plan as a table, followed by its reasons."""
    scene, found = made.scene, made.as_dict()
    speeds = ", ".join(f"{rpm:.5g}" for rpm in scene.speeds_rpm)
    model = found["predicted_model_error"]
    against = "against the next level up" if found["next_level"] else "against the best model"
    rows = [
        ("engine", scene.engine.name, f"at {speeds} rev/min"),
        ("crank", found["crank"], f"{found['modes']} modes"),
        ("bearings", found["bearings"], ""),
        ("block", found["block"], ""),
        ("integrator", found["integrator"], f"{found['step_deg']:g} deg"),
        ("numerical error", f"{found['predicted_numerical_error']:.2g}", "against half the step"),
        ("settling", f"{found['predicted_settling_error']:.2g}", "error that is left when a run ends"),
        ("model error", "–" if model is None else f"{model:.2g}", against),
        *([] if made.total_error is None else [("total error", f"{made.total_error:.2g}", made.against)]),
        ("predicted error", f"{found['predicted_error']:.2g}", f"{scene.accuracy:g} is wanted"),
        (
            "real-time factor",
            f"{found['predicted_real_time_factor']:.3g}",
            "no budget" if scene.budget is None else f"budget {scene.budget:g}",
        ),
    ]
    show_rows(f"{scene.title}: plan up to {scene.frequency:g} Hz", ("", "choice", "besides"), rows)
    for reason in made.reasons:
        print(f"- {reason}")
    above = found["next_level"]
    if above is None and made.total_error is not None:
        pair = "/".join(made.next.levels)
        print(f"The next level up, {pair}, was not run; 'cranktrain plan --run --verify' runs it beside this one.")
        return
    if above is None:
        print(f"There is no level above; --run --verify takes a step of {math.degrees(made.next.step):g} deg.")
        return
    changes = ", ".join(f"{name} by {100.0 * value:.2g} %" for name, value in above["difference"].items())
    print(
        f"The next level up, {above['crank']}/{above['bearings']}, would change {changes} at a real-time factor of "
        f"{above['real_time_factor']:.3g}"
    )


def _show_runs(result: VerbResult) -> None:
    """Print the plan and the summary of a scene's runs."""
    show_plan(result.beside["plan"])
    rows = [
        (
            f"{name} / {one['unit']}",
            f"{one['speed_rpm']:.5g}",
            *(f"{one[key]:.4g}" for key in ("mean", "minimum", "maximum", "amplitude")),
            ", ".join(f"{order:g}: {size:.3g}" for order, size in sorted(one["orders"], key=lambda x: -x[1])[:3]),
        )
        for name, one in result["outputs"].items()
    ]
    header = ("output", "rev/min", "mean", "least", "largest", "amplitude", "strongest orders")
    show_rows("Outputs over the last cycle, at the speed of their largest amplitude", header, rows)
    if len(result["levels"]) > 1:
        names = list(result["levels"][-1]["difference"])
        table = [
            (
                f"{level['crank']}/{level['bearings']}",
                f"{level['step_deg']:g}",
                f"{level['seconds']:.3g}",
                *(f"{level['difference'][name]:.2g}" if name in level["difference"] else "–" for name in names),
            )
            for level in result["levels"]
        ]
        show_rows("Difference to the last level, relative", ("level", "step / deg", "seconds", *names), table)
    check = result.get("verification")
    if check is not None:
        print(
            f"Predicted error {check['predicted_error']:.2g}, verified {check['verified_error']:.2g} against "
            f"{check['crank']}/{check['bearings']} at {check['step_deg']:g} deg"
        )
    own = result["settling"]
    print(
        f"Settling: at most {own['cycles']} cycles per speed, settling error {own['settling_left']:.1e}; repeats "
        f"every {own['repeats_every_cycles']} cycles"
    )
    print(f"Result: {result['result']}")
