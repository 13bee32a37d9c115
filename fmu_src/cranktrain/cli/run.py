"""The verb ``run``: a scene by its plan, checked by the next level, or at every level of the ladder."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cranktrain.cli.console import bar, say, show_rows
from cranktrain.cli.functions import SCENE, verb
from cranktrain.cli.plan import made_plan, show_plan
from cranktrain.core.errors import InputError
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, Question
from cranktrain.studies.scene import Scene, load_scene

if TYPE_CHECKING:
    from cranktrain.studies.planning.running import SceneRun
    from cranktrain.studies.planning.scene_model import Case

DESCRIPTION = """\
Plan a scene and run it, speed by speed; write an HDF5 result and print a summary of the wanted outputs.

--verify      also run the next level up with half the step, and compare the predicted error with the difference
--all-levels  also run every level of crank and bearings that has the scene's outputs, from rigid to reynolds, and
              list each output's difference from the top level, with the computing time
"""


@dataclass(frozen=True, kw_only=True)
class RunScene(Question):
    """Question of :func:`run_scene`."""

    apart = (("verify", "all_levels"),)
    verify: Annotated[bool, Option(help="check the predicted error by one run at the next level")] = False
    all_levels: Annotated[bool, Option(help="run every level; report differences from the top")] = False
    with_ehd: Annotated[bool, Option(help="with --all-levels: elastic films too, minutes")] = False
    output: Annotated[words.File | None, Option("FILE.h5", "result file (default: SCENE.h5)")] = None


@verb(RunScene, DESCRIPTION, SCENE)
def run_scene(named: str | Path | Scene, ask: RunScene) -> VerbResult:
    """Run the scene and summarise it; an interrupt keeps what is complete."""
    from cranktrain.results.files import check_target
    from cranktrain.studies.planning.running import SceneRun

    if ask.with_ehd and not ask.all_levels:
        raise InputError('--with-ehd belongs to --all-levels; to run a scene with elastic films set bearings = "ehd"')
    scene = load_scene(named)
    output = Path(ask.output or f"{scene.name}.h5")
    check_target(output)
    if scene.stress:
        say(f"{scene.name}: 'run' computes no stresses; the solid crank runs with all modes that 'stress' needs")
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
    return VerbResult.of(result, "run", plan=made)


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


def show(result: VerbResult) -> None:
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
