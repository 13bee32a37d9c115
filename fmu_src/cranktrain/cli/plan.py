"""The verb ``plan``: the lowest levels, modes, method and step that serve a scene, with the reasons."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cranktrain.cli.console import Interrupted, show_rows, stages
from cranktrain.cli.functions import SCENE, verb
from cranktrain.studies.requests.fields import Question
from cranktrain.studies.scene import Scene, load_scene

if TYPE_CHECKING:
    from cranktrain.studies.planning.plan import Plan
    from cranktrain.studies.planning.scene_model import SceneModel

DESCRIPTION = """\
The plan for a scene: which levels and step serve it, why, and with which error and computing time.

A plan picks the lowest levels, number of modes, bearing law, integrator and step that are accurate enough. Its errors
and times are measured by short runs of the scene's own model, and kept in the cache. The model error is the difference
from the next level up, the numerical error the difference from half the step. Both are relative, up to the scene's
highest frequency; the largest over its outputs and speeds counts. Where measured total errors ship for the engine (see
cranktrain tradeoff --total), the plan takes the cheapest levels whose total error is within the accuracy.
"""


@verb(Question, DESCRIPTION, SCENE)
def plan(scene: str | Path | Scene, ask: Question) -> Plan:
    """Make the plan."""
    return made_plan(load_scene(scene))[0]


def show(made: Plan) -> None:
    """Print the plan as a table, its reasons below."""
    show_plan(made)


def told(made: Plan) -> dict[str, Any]:
    """The plan as ``--json`` prints it."""
    return made.as_dict()


def made_plan(scene: Scene, compare: bool = False) -> tuple[Plan, SceneModel]:
    """Plan of a scene with its stages shown, and the model that it was measured on.

    ``compare`` it with the next levels even where that takes minutes.
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
    """Print a plan as a table, its reasons below."""
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
        print(f"The next level up, {pair}, was not run; 'cranktrain run --verify' runs it beside this one.")
        return
    if above is None:
        print(f"There is no level above; --verify runs this level with a step of {math.degrees(made.next.step):g} deg.")
        return
    changes = ", ".join(f"{name} by {100.0 * value:.2g} %" for name, value in above["difference"].items())
    print(
        f"The next level up, {above['crank']}/{above['bearings']}, would change {changes} at a real-time factor of "
        f"{above['real_time_factor']:.3g}"
    )
