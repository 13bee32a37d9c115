"""The verb ``run``: a scene by its plan, checked by the next level, or at every level of the ladder."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cranktrain.cli.console import bar, say, show_rows
from cranktrain.cli.plan import made_plan, show_plan
from cranktrain.core.errors import InputError
from cranktrain.studies.scene import load_scene

if TYPE_CHECKING:
    from cranktrain.studies.planning.running import SceneRun
    from cranktrain.studies.planning.scene_model import Case

DESCRIPTION = """\
Plan a scene and run it, speed by speed; write an HDF5 result and print a summary of the wanted outputs.

--verify      also run the next level up with half the step, and compare the predicted error with the difference
--all-levels  also run every level of crank and bearings that has the scene's outputs, from rigid to reynolds, and
              list each output's difference from the top level, with the computing time
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    parser.add_argument("scene", metavar="SCENE", help="path of a scene.toml")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--verify", action="store_true", help="check the predicted error by one run at the next level")
    which.add_argument("--all-levels", action="store_true", help="run every level; report differences from the top")
    parser.add_argument("--with-ehd", action="store_true", help="with --all-levels: elastic films too, minutes")
    parser.add_argument("--output", metavar="FILE.h5", help="result file (default: SCENE.h5)")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Run the scene and summarise it; an interrupt keeps what is complete."""
    from cranktrain.results.files import check_target
    from cranktrain.studies.planning.running import SceneRun

    if options.with_ehd and not options.all_levels:
        raise InputError('--with-ehd belongs to --all-levels; to run a scene with elastic films set bearings = "ehd"')
    scene = load_scene(options.scene)
    output = Path(options.output or f"{scene.name}.h5")
    check_target(output)
    if scene.stress:
        say(f"{scene.name}: 'run' computes no stresses; the solid crank runs with all modes that 'stress' needs")
    made, model = made_plan(scene, compare=options.verify)
    if not options.json:
        show_plan(made)
    runs = SceneRun(made, model, output)
    with bar(f"{scene.name}: {made.case}") as advance:
        runs.run(made.case, advance)
    others: list[Case] = []
    if options.verify:
        others = [made.next]
    elif options.all_levels:
        others = [case for case in ladder_cases(runs, options.with_ehd) if case.levels != made.case.levels]
    for case in others:
        if runs.interrupted:
            break
        with bar(f"{scene.name}: {case}") as advance:
            level = runs.run(case, advance)
        if level.status != "ok":
            say(f"{case}: {level.status}")
    if options.all_levels:
        runs.sort()
    result = {
        "result": str(output),
        "outputs": runs.outputs(),
        "levels": runs.rows(),
        "settling": runs.settling,
        "plan": made.as_dict(),
        "interrupted": runs.interrupted,
    }
    if options.verify:
        result["verification"] = runs.verification()
    if runs.interrupted and not result["outputs"]:
        raise KeyboardInterrupt
    if runs.interrupted:
        say(f"interrupted; {output} holds the finished runs, repeat the command for the rest")
    if not options.json:
        _show(runs, result)
    return result


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


def _show(runs: SceneRun, result: dict[str, Any]) -> None:
    """Print the summary of a scene's runs."""
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
    own = runs.settling
    print(
        f"Settling: at most {own['cycles']} cycles per speed, settling error {own['settling_left']:.1e}; repeats "
        f"every {own['repeats_every_cycles']} cycles"
    )
    print(f"Result: {runs.path}")
