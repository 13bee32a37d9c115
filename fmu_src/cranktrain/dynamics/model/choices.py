"""Numbers of a run from its settings, in the slots of :mod:`cranktrain.dynamics.model.numbers`."""

from collections.abc import Mapping

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import numbers as to
from cranktrain.dynamics.model.lumped_data import lumped_numbers
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
    "gas_load": to.SET_GAS_LOAD,
    "crankcase_pressure": to.SET_CRANKCASE,
    "damper_temperature": to.SET_DAMPER_TEMPERATURE,
    "oil_temperature": to.SET_OIL_TEMPERATURE,
    "gravity": to.SET_GRAVITY,
    "step": to.SET_STEP,
    "gas_delay": to.SET_GAS_DELAY,
    "tolerance": to.SET_TOLERANCE,
    "newton_tolerance": to.SET_NEWTON_TOLERANCE,
    "film_change": to.SET_FILM_CHANGE,
    "work_limit": to.SET_WORK_LIMIT,
}
"""Slots of those settings of a run that are numbers."""
GEOMETRY_SLOTS = {"bore": to.SET_BORE, "compression_ratio": to.SET_COMPRESSION}
"""Slots of the engine's dimensions that a run may change."""


def option_slots() -> dict[str, tuple[int, dict[str, float]]]:
    """Slot of each setting that is a word, and the numbers that stand for its words."""
    methods = {"auto": -1.0} | {name: float(row) for row, name in enumerate(INTEGRATORS)}
    return {
        "control": (to.SET_ADAPTIVE, {"fixed": 0.0, "adaptive": 1.0}),
        "dense_output": (to.SET_DENSE, {word: float(number) for word, number in DENSE_OUTPUTS.items()}),
        "encoder": (to.SET_ENCODER, {word: float(number) for number, word in enumerate(ENCODERS)}),
        "gas_source": (to.SET_GAS_SOURCE, {word: float(number) for word, number in GAS_SOURCES.items()}),
        "reconstruction": (to.SET_RECONSTRUCTION, {word: float(number) for word, number in RECONSTRUCTIONS.items()}),
        "integrator": (to.SET_METHOD, methods),
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
    law, rows = ruling_law(resolved(settings, engine).bearings, settings.big_ends, engine), list(INTEGRATORS)
    held = FOR_HELD_INPUTS.get(law.integrator, law.integrator)
    numbers[[to.LEVEL_METHOD, to.LEVEL_HELD_METHOD]] = rows.index(law.integrator), rows.index(held)
    numbers[[to.LEVEL_TOLERANCE, to.LEVEL_STEP]] = law.tolerance, usual_step(law, engine)
    numbers[to.LEVEL_FILM_CHANGE] = usual_film_change(law, engine)
    return numbers
