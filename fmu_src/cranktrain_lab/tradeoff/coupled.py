"""Run of a case coupled with the combustion by the co-simulation master, in this process without FMUs."""

from __future__ import annotations

import math
import time

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.model import Engine
from cranktrain.modules.combustion.file import load
from cranktrain.modules.combustion.simulation import CombustionSimulation
from cranktrain.modules.register import module_files, module_of_engine
from cranktrain_lab.coupling.master import Master
from cranktrain_lab.coupling.modules import COMBUSTION, CRANKTRAIN, OWN
from cranktrain_lab.coupling.simulation_unit import SimulationUnit
from cranktrain_lab.coupling.virtual_engine import gas_connections, gas_exchange, volume_connections
from cranktrain_lab.tradeoff.case import Case


def has_combustion(engine: Engine) -> bool:
    """True if a combustion is shipped for an engine."""
    try:
        return bool(module_of_engine(COMBUSTION, engine.name))
    except InputError:
        return False


def coupled_rows(simulation: Simulation, case: Case, rows: Array) -> float:
    """Fill ``rows`` (k, outputs) by a coupled run of a simulation at its start. Return processor seconds."""
    assert case.scheme is not None and case.exchange is not None and case.coupled_deg is not None
    settings = load(module_files()[module_of_engine(COMBUSTION, case.engine.name)])
    gas = CombustionSimulation(settings)
    gas.inputs[0] = case.speed
    units = [SimulationUnit(COMBUSTION, gas), SimulationUnit(CRANKTRAIN, simulation, begin=lambda: None)]
    cylinders, own = case.engine.n_cylinders, case.exchange == OWN
    connections = gas_connections(cylinders, own) + volume_connections(cylinders)
    master = Master(units, connections, gas_exchange(case.scheme, case.exchange))
    master.initialize()
    inner = round(case.kept_deg / case.coupled_deg)
    h = math.radians(case.coupled_deg) / case.speed
    begin = time.process_time()
    for k in range(len(rows)):
        for j in range(inner):
            master.step((k * inner + j + 1) * h)
        rows[k] = simulation.outputs
    return time.process_time() - begin
