"""Interface of a scene's FMU: the variables that its levels provide and the scene lists.

All inputs are included. Outputs are those of the scene, angle and speed of the crank, the frame's speed, and outputs of
the solver. Levels are not parameters, because the FMU contains the data of one level of each kind. Start values of the
other parameters are those of the plan.
"""

import re
from dataclasses import asdict, replace
from typing import Any

from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import bearing_law
from cranktrain.fmu.description import Interface, expand
from cranktrain.fmu.geometry import start_values
from cranktrain.studies.planning.plan import Plan
from cranktrain.studies.planning.scene_model import SceneModel

LEVELS = ("crank", "bearings", "big_ends", "block", "pistons", "damper")
"""Settings that are fixed in a scene's FMU."""
ALWAYS = ("crank.angle", "crank.speed", "frame.speed")


def carried_engine(plan: Plan) -> Engine:
    """Engine without the parts that the plan's levels do not use."""
    scene = plan.scene
    engine = scene.engine
    if scene.block != "flexible":
        engine = replace(engine, block=None, mounts=None)
    return engine if scene.damper == "fitted" else replace(engine, damper=None)


def fixed_settings(plan: Plan, model: SceneModel) -> dict[str, Any]:
    """Settings that are fixed in the FMU, so that no variable changes them."""
    settings = asdict(model.settings(plan.case))
    return {name: settings[name] for name in LEVELS}


def scene_interface(interface: Interface, plan: Plan, model: SceneModel, counts: dict[str, int]) -> Interface:
    """Interface of a plan's FMU, with its variables one by one.

    Parameters
    ----------
    interface : full interface of the engine
    counts : sizes of the families for the engine, see :func:`cranktrain.fmu.description.expand`
    """
    scene, settings = plan.scene, asdict(model.settings(plan.case))
    films = bearing_law(plan.case.bearings).film
    oiled = films or bearing_law(scene.big_ends).film
    variables = []
    for variable in expand(interface.variables, counts, start_values(scene.engine)):
        wanted = variable.name in ALWAYS or variable.name in plan.scene.outputs
        if variable.name.startswith("solver."):
            wanted = variable.name != "solver.online_films" or plan.case.bearings == "table"
        if variable.causality == "output" and not wanted:
            continue
        if variable.setting in LEVELS:
            continue
        if variable.setting == "oil_temperature" and not oiled:
            continue
        if variable.setting == "film_temperature" and not films:
            continue
        if variable.setting == "damper_temperature" and scene.damper != "fitted":
            continue
        if variable.setting in ("integrator", "step", "gas_load", "film_temperature"):
            variable = replace(variable, start=settings[variable.setting])
        if variable.name == "speed":
            variable = replace(variable, start=scene.speeds[0])
        variables.append(variable)
    return replace(interface, description=f"{interface.description}; scene: {scene.title}", variables=tuple(variables))


def scene_suffix(plan: Plan) -> str:
    """Suffix of the model's name: the words of the scene's name, capitalised."""
    return "".join(part.capitalize() for part in re.split(r"[^A-Za-z0-9]+", plan.scene.name))
