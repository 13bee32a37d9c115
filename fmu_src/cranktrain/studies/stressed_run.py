"""A run at constant speed until its cycles repeat, and the stresses of its crankshaft over a cycle."""

from __future__ import annotations

from collections.abc import Callable

from cranktrain.assembly import Assembly, assemble
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation, fitted_engine
from cranktrain.engine.model import Engine
from cranktrain.results.strength.crank_cycle import settled_cycle
from cranktrain.results.strength.stress import CrankStress
from cranktrain.structure.crank.reduction import reduced_crankshaft
from cranktrain.structure.stress.stress_modes import ShapedCrank, stress_modes
from cranktrain.studies.constant_speed import Request


def stressed_run(
    engine: Engine, request: Request, settings: Settings, say: Callable[[str], None], shaped: ShapedCrank | None = None
) -> tuple[Assembly, CrankStress]:
    """What ran, and its stresses.

    Raises ``InputError`` for a crank that has no stresses, ``SolverError`` where a step fails.

    Parameters
    ----------
    settings : of the request, as the engine has them
    shaped : the crankshaft with its shapes where at hand
    """
    surface = stress_modes(engine, request.mesh, say, shaped)
    made = assemble(engine, settings, say=say, crank_mesh=request.mesh, block_mesh=request.block_mesh)
    simulation = Simulation(engine, made.body, made.settings, parts=made.parts)
    cycle = settled_cycle(simulation, request.speed, request.settle, say)
    bare = reduced_crankshaft(engine, request.mesh)
    return made, CrankStress.of(fitted_engine(engine, made.settings), bare, made.body, surface, cycle)
