"""Functions for an FMU's slave: the model's data, and a simulation at the levels of its parameters."""

from collections.abc import Mapping
from contextlib import AbstractContextManager
from typing import Any, NamedTuple

from cranktrain.core.announcement import announced
from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.dynamics.model.arrays import Parts
from cranktrain.dynamics.model.lumped_data import split_data
from cranktrain.dynamics.model.settings import Settings, check_levels, needed_parts, resolved
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.model import Engine
from cranktrain.fmu.flat import FlatModel, read_model
from cranktrain.fmu.geometry import with_geometry
from cranktrain.loads.gas_pressure import GasTrace

__all__ = ["announced_compilation", "read_model", "simulation"]

COMPILATION = "four minutes"
"""Compilation time of all kernels of a level, measured with an empty cache, see docs/fmu.md."""
_PARTS = {
    "block": ("block", "the reduced block"),
    "table": ("bearings", "the film table of the main bearings"),
    "bore": ("bearings", "the elastic bore of the main bearings"),
    "big_end_table": ("big_ends", "the film table of the big ends"),
    "big_end_bore": ("big_ends", "the elastic eye of the rods"),
}
"""Optional parts of a run's data: for each the setting that needs the part, and the part's name in messages."""


def simulation(model: FlatModel, chosen: Mapping[str, Any], names: Mapping[str, str]) -> Simulation:
    """Simulation of a flat model with the settings ``chosen`` (by name), see :func:`chosen_levels`."""
    made = Simulation(*chosen_levels(model, chosen, names))
    made.on_demand = True
    return made


class Chosen(NamedTuple):
    """Arguments of a simulation at chosen levels, in the order of its parameters.

    ``settings`` may be incomplete, because their defaults depend on later choices.
    """

    engine: Engine
    body: ReducedBody
    settings: Settings
    gas: GasTrace | None
    parts: Parts


def chosen_levels(model: FlatModel, chosen: Mapping[str, Any], names: Mapping[str, str]) -> Chosen:
    """Arguments of a simulation with the settings ``chosen``, values by name of the setting.

    Raises ``InputError``: contradictory levels, levels that the engine lacks or whose data the FMU was built without,
    or geometry for which the bodies were not made. ``names``: the FMU's names of settings.
    """
    data, rest = split_data(model.engine, chosen)
    engine, rest = with_geometry(model.engine, rest, names)
    given = Settings(**rest)
    settings = resolved(given, engine)
    check_levels(settings, engine)
    if settings.reconstruction == "stages":
        raise InputError(
            f"'{names.get('reconstruction', 'reconstruction')}' is 'stages', which needs a native FMU of FMI 3.0 and a "
            "host that gives inputs inside a step; choose polytropic"
        )
    bore = model.block_bore if settings.block == "flexible" else model.bore
    parts = Parts(
        model.table, bore, model.big_end_table, model.block, bodies=model.added, film_tables=model.film_tables,
        big_end_bore=model.big_end_bore, data=data,
    )  # fmt: skip
    for part in needed_parts(engine, settings):
        if getattr(parts, part) is None:
            _refuse(settings, names, *_PARTS[part])
    fitted = settings.damper == "fitted"
    cranks = model.damped if fitted else model.cranks
    if fitted and not cranks:
        _refuse(settings, names, "damper", "the crankshaft with the damper's housing")
    if settings.crank not in cranks:
        _refuse(settings, names, "crank", "its crankshaft")
    return Chosen(engine, cranks[settings.crank], given, model.gas, parts)


def announced_compilation(instance: str) -> AbstractContextManager[None]:
    """Context that announces the compilation of kernels to the user of an instance."""
    return announced(instance, COMPILATION)


def _refuse(settings: Settings, names: Mapping[str, str], setting: str, what: str) -> None:
    raise InputError(
        f"'{names.get(setting, setting)}' is '{getattr(settings, setting)}', but the FMU was built without {what}; "
        "build it with build_fmu.py --levels all, or choose another level"
    )
