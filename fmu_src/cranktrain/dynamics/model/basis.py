"""Constants of an engine that the preparation of a model reads together with temperatures and parameters."""

import numpy as np

from cranktrain.dynamics.model.records import Basis
from cranktrain.dynamics.model.settings import Settings, keeps_peaks
from cranktrain.dynamics.time.integrators import INTEGRATORS, method_arrays
from cranktrain.engine.lubricant import oil_constants
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import bearing_law
from cranktrain.loads.built_in_trace import SAMPLES, TRACE_ROWS
from cranktrain.loads.damper import DAMPER_CONSTANTS, damper_constants, required_damper
from cranktrain.loads.gas_pressure import GasTrace, trace_constants


def basis(engine: Engine, settings: Settings, gas: GasTrace) -> Basis:
    """Gather the constants of an engine; ``settings`` are resolved."""
    fitted = settings.damper == "fitted"
    damper = required_damper(engine) if fitted else None
    mains = bearing_law(settings.bearings).carries and not engine.rollers_only
    cylinders = engine.cylinders
    methods, tables = method_arrays(settings.integrator)
    lost = [not keeps_peaks(name, settings, engine) for name in INTEGRATORS]
    return Basis(
        oil_constants(engine.oil),
        np.array(engine.oil.temperature_speeds, dtype=float),
        np.array(engine.oil.temperatures, dtype=float),
        np.array([mains, engine.big_end_bearing is not None], dtype=float),
        np.zeros(DAMPER_CONSTANTS) if damper is None else damper_constants(damper),
        np.zeros(1) if damper is None else np.array(damper.temperature_speeds, dtype=float),
        np.zeros(1) if damper is None else np.array(damper.temperatures, dtype=float),
        np.array([cylinders.bore, cylinders.compression_ratio, settings.block == "flexible"], dtype=float),
        trace_constants(engine, gas.built_in),
        np.zeros((TRACE_ROWS, SAMPLES)),
        np.column_stack([methods, lost]),
        tables,
    )
