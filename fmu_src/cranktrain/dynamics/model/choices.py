"""Numbers of a run from its settings, in the slots of :mod:`cranktrain.dynamics.model.numbers`."""

from collections.abc import Mapping

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.lumped_data import lumped_numbers
from cranktrain.dynamics.model.numbers import (
    LEVEL_FILM_CHANGE,
    LEVEL_HELD_METHOD,
    LEVEL_METHOD,
    LEVEL_STEP,
    LEVEL_TOLERANCE,
    SET_ADAPTIVE,
    SET_BORE,
    SET_COMPRESSION,
    SET_CRANKCASE,
    SET_DAMPER_TEMPERATURE,
    SET_DENSE,
    SET_ENCODER,
    SET_FILM_CHANGE,
    SET_GAS_DELAY,
    SET_GAS_LOAD,
    SET_GAS_SOURCE,
    SET_GRAVITY,
    SET_METHOD,
    SET_NEWTON_TOLERANCE,
    SET_OIL_TEMPERATURE,
    SET_RECONSTRUCTION,
    SET_STEP,
    SET_TOLERANCE,
    SET_WORK_LIMIT,
)
from cranktrain.dynamics.model.settings import (
    DENSE_OUTPUTS,
    FOR_HELD_INPUTS,
    GAS_SOURCES,
    RECONSTRUCTIONS,
    Settings,
    resolved,
    ruling_law,
    usual_film_change,
    usual_step,
)
from cranktrain.dynamics.time.integrators import INTEGRATORS
from cranktrain.engine.levels import ENCODERS
from cranktrain.engine.model import Engine

NUMBER_SLOTS = {
    "gas_load": SET_GAS_LOAD,
    "crankcase_pressure": SET_CRANKCASE,
    "damper_temperature": SET_DAMPER_TEMPERATURE,
    "oil_temperature": SET_OIL_TEMPERATURE,
    "gravity": SET_GRAVITY,
    "step": SET_STEP,
    "gas_delay": SET_GAS_DELAY,
    "tolerance": SET_TOLERANCE,
    "newton_tolerance": SET_NEWTON_TOLERANCE,
    "film_change": SET_FILM_CHANGE,
    "work_limit": SET_WORK_LIMIT,
}
"""Slots of those settings of a run that are numbers."""
GEOMETRY_SLOTS = {"bore": SET_BORE, "compression_ratio": SET_COMPRESSION}
"""Slots of the engine's dimensions that a run may change."""


def option_slots() -> dict[str, tuple[int, dict[str, float]]]:
    """Slot of each setting that is a word, and the numbers that stand for its words."""
    methods = {"auto": -1.0} | {name: float(row) for row, name in enumerate(INTEGRATORS)}
    return {
        "control": (SET_ADAPTIVE, {"fixed": 0.0, "adaptive": 1.0}),
        "dense_output": (SET_DENSE, {word: float(number) for word, number in DENSE_OUTPUTS.items()}),
        "encoder": (SET_ENCODER, {word: float(number) for number, word in enumerate(ENCODERS)}),
        "gas_source": (SET_GAS_SOURCE, {word: float(number) for word, number in GAS_SOURCES.items()}),
        "reconstruction": (SET_RECONSTRUCTION, {word: float(number) for word, number in RECONSTRUCTIONS.items()}),
        "integrator": (SET_METHOD, methods),
    }


def level_numbers(settings: Settings, engine: Engine) -> dict[int, float]:
    """Default numbers that follow from the bearing levels of ``settings``, by slot."""
    law, rows = ruling_law(resolved(settings, engine).bearings, settings.big_ends, engine), list(INTEGRATORS)
    return {
        LEVEL_TOLERANCE: law.tolerance,
        LEVEL_FILM_CHANGE: usual_film_change(law, engine),
        LEVEL_METHOD: float(rows.index(law.integrator)),
        LEVEL_HELD_METHOD: float(rows.index(FOR_HELD_INPUTS.get(law.integrator, law.integrator))),
        LEVEL_STEP: usual_step(law, engine),
    }


def run_numbers(settings: Settings, engine: Engine, data: Mapping[str, float] | None = None) -> Array:
    """Numbers of a run from its ``settings``, resolved or not; each word in the settings must exist.

    ``data`` are lumped values that replace the engine's, see :mod:`cranktrain.dynamics.model.lumped_data`.
    """
    numbers = lumped_numbers(engine, data)
    for name, slot in NUMBER_SLOTS.items():
        numbers[slot] = getattr(settings, name) or 0.0
    for name, slot in GEOMETRY_SLOTS.items():
        numbers[slot] = getattr(engine.cylinders, name)
    for name, (slot, words) in option_slots().items():
        # The name of an integrator may be followed by its parameter.
        numbers[slot] = words[getattr(settings, name).partition(":")[0]]
    for slot, number in level_numbers(settings, engine).items():
        numbers[slot] = number
    return numbers
