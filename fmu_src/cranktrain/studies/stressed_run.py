"""A run at constant speed until its cycles repeat, and the stresses of its crankshaft over a cycle."""

from collections.abc import Callable

from cranktrain.core.errors import InputError
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation, fitted_engine
from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import Gas
from cranktrain.results.strength.recorded_cycle import recorded_cycle
from cranktrain.results.strength.stress import CrankStress
from cranktrain.structure.assembly import Assembly, assemble
from cranktrain.structure.crank.reduction import reduced_crankshaft
from cranktrain.structure.stress.stress_modes import ShapedCrank, check_has_elements, stress_modes
from cranktrain.studies.constant_speed import Request


def check_stressed(request: Request, settings: Settings) -> None:
    """Refuse, before any work, a run whose crankshaft has no stresses; ``InputError``."""
    if settings.crank != "solid":
        raise InputError(f"crank level '{settings.crank}' has no stresses; use solid")
    check_has_elements(request.mesh)


def stressed_run(
    engine: Engine,
    request: Request,
    settings: Settings,
    say: Callable[[str], None],
    shaped: Callable[[], ShapedCrank] | None = None,
    gas: Gas | None = None,
) -> tuple[Assembly, CrankStress]:
    """Run until the cycles repeat. Return the assembly of the run, and the crank's stresses over the last cycle.

    Raises ``InputError`` for a crank that has no stresses, ``SolverError`` if a step fails.

    Parameters
    ----------
    settings : complete settings of the request
    shaped : function that makes the crankshaft with its shapes, if needed
    gas : measured pressures of the request, if they have been read already
    """
    check_stressed(request, settings)
    gas = request.gas(engine) if gas is None else gas
    request.tell_doubts(engine, gas)
    surface = stress_modes(engine, request.mesh, say, shaped)
    made = assemble(engine, settings, say=say, crank_mesh=request.mesh, block_mesh=request.block_mesh)
    simulation = Simulation(engine, made.body, made.settings, gas, made.parts)
    simulation.inputs[0] = request.speed
    say("cycles until they repeat")
    cycle = recorded_cycle(simulation, fitted_engine(engine, made.settings), request.settle)
    say("stresses over the cycle")
    return made, CrankStress.of(reduced_crankshaft(engine, request.mesh), surface, cycle)
