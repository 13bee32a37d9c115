"""Constants of an engine that the preparation of a model reads together with temperatures and parameters."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.settings import Settings, keeps_peaks
from cranktrain.dynamics.time.integrators import (
    INTEGRATORS,
    integrator,
    integrator_table,
    largest_coefficient,
    method_mark,
)
from cranktrain.dynamics.time.table import WIDTH
from cranktrain.engine.lubricant import oil_constants
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import bearing_law
from cranktrain.loads.built_in_trace import SAMPLES, TRACE_ROWS
from cranktrain.loads.damper import DAMPER_CONSTANTS, damper_constants, required_damper
from cranktrain.loads.gas_pressure import GasTrace, trace_constants


class Basis(NamedTuple):
    """Constants of one engine at its fidelity levels (SI)."""

    oil: Array  # (OIL_CONSTANTS,) see engine.lubricant
    oil_speeds: Array  # (k,) engine speeds, rad/s
    oil_temperatures: Array  # (k,) oil temperatures at the speeds ``oil_speeds``, K
    films: Array  # (FILM_KINDS,) marks of bearings with oil films, see dynamics.model.slots
    damper: Array  # (DAMPER_CONSTANTS,) see loads.damper
    damper_speeds: Array  # (k,) engine speeds, rad/s
    damper_temperatures: Array  # (k,) damper temperatures at these speeds, K
    cylinders: Array  # (CYLINDER_CONSTANTS,) bore and compression ratio, see dynamics.model.slots
    trace: Array  # (TRACE_CONSTANTS,) of the built-in gas trace, see loads.built_in_trace
    trace_rows: Array  # (TRACE_ROWS, SAMPLES) scratch
    methods: Array  # (methods, METHOD_COLUMNS) all integrators of the register
    tables: Array  # (methods, rows, WIDTH) coefficients of the integrators, padded with zeros


def basis(engine: Engine, settings: Settings, gas: GasTrace) -> Basis:
    """Gather the constants of an engine; ``settings`` are resolved."""
    fitted = settings.damper == "fitted"
    damper = required_damper(engine) if fitted else None
    mains = bearing_law(settings.bearings).carries and not engine.rollers_only
    cylinders = engine.cylinders
    methods, tables = _methods(settings.integrator, tuple(INTEGRATORS))
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
        tables.copy(),
    )


@cache
def _methods(given: str, names: tuple[str, ...]) -> tuple[Array, Array]:
    """Arrays ``methods`` (without the last column) and ``tables`` of :class:`Basis` for all integrators.

    The integrator ``given`` may state its parameter behind its name.
    """
    chosen = integrator(given).name
    full = [given if name == chosen else name for name in names]
    coefficients = [integrator_table(name) for name in full]
    tables = np.zeros((len(full), max(map(len, coefficients)), WIDTH))
    methods = np.zeros((len(full), at.LOSES_PEAKS))
    for row, table, own, name in zip(methods, tables, coefficients, full, strict=True):
        table[: len(own)] = own
        row[at.EMBEDDED], row[at.METHOD_ORDER] = integrator(name).embedded, max(2, integrator(name).order)
        row[at.AMPLIFICATION], row[at.MARK] = largest_coefficient(own), method_mark(own)
    return methods, tables
