"""A run of the cranktrain with the array types of every run, only for compiling kernels."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from cranktrain.core import unit_turns as turns
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.dynamics.model.arrays import Parts
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.run_record import Run, make_run
from cranktrain.dynamics.settled.motion import motion_of
from cranktrain.dynamics.simulation import Simulation
from cranktrain.dynamics.start.mean_motion import carried
from cranktrain.dynamics.start.settling import settle
from cranktrain.dynamics.tangents import evaluate_at_state, tangents_in_rotation
from cranktrain.dynamics.time.communication import end_step_here
from cranktrain.dynamics.time.step_control import ports_at_state
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.film.contact.asperity import CONSTANTS, contact_table
from cranktrain.film.contact.gap import least_gap, relief
from cranktrain.film.contact.journal import slice_resultants
from cranktrain.film.elastic.workspace import fill_gaps
from cranktrain.film.table.interpolation import stretched
from cranktrain.loads.gas_pressure import GasTrace

ENGINE = "diesel_i6"


def typical_run() -> Run:
    """Run of an engine with a stand-in for its crankshaft; the types of a run do not depend on its contents."""
    engine = load_engine(ENGINE)
    settings = Settings(crank="rigid", bearings="linear")
    return make_run(engine, stand_in(engine), settings, GasTrace.from_engine(engine), Parts())


def typical_calls(run: Run) -> None:
    """Call, with arrays like those of ``run``, all kernels that Python calls to make and evaluate runs."""
    engine = load_engine(ENGINE)
    loaded = Settings(crank="rigid", bearings="impedance", big_ends="impedance", damper="fitted", boundary="torque")
    simulation = Simulation(engine, stand_in(engine), loaded)
    simulation.inputs[0] = 200.0
    simulation.steady_torque()
    least_gap((0.5, 0.0, 0.1, 0.0), 1.0, (0.0, 1.0, 1.0))
    relief(0.9, (1.0e-6, 0.5, 2.0))
    carried(run.model, np.zeros(run.model.block_ports.shape[1]))
    motion_of(run.state, run.model.omega2.size)
    tangents_in_rotation(run.model, 200.0, samples=1)
    turns.take_turns(*turns.no_turns())


def stage_calls(run: Run) -> Iterator[tuple[Any, tuple[Any, ...]]]:
    """Kernels that Python calls at a state of a run, each with its arguments."""
    yield ports_at_state, (run.model, run.work, run.state)
    yield evaluate_at_state, (run.model, run.work, 0.0, 0.0)
    yield end_step_here, (run.model, run.work, run.state)
    yield settle, (run.model, run.work, run.state, run.inputs, 0.0, 0.0, 0.0)


def film_calls() -> None:
    """Call the kernels that Python calls when it makes the data of solved films and of tables."""
    stretched(0.9)
    fill_gaps(np.zeros((2, 6)), 1.0, np.zeros(CONSTANTS), np.zeros((2, 2)))
    slice_resultants(0.04, 4.0e-5, 0.03, np.full(CONSTANTS, 1.0e-6), contact_table())


def stand_in(engine: Engine) -> ReducedBody:
    """Reduced body with six rigid modes of unit mass and inertia; pins are at their throw, other interfaces at 0.

    A pin must not be on the axis, because the pressure of its cylinder needs the pin's angle.
    """
    throws, mains = len(engine.crankshaft.throw_angles), len(engine.crankshaft.main_widths)
    names = (
        *(f"main[{i + 1}]" for i in range(mains)),
        *(f"pin[{i + 1}]" for i in range(throws)),
        "thrust", "flywheel", "pulley",
    )  # fmt: skip
    z = np.zeros
    positions = z((len(names), 3))
    positions[mains : mains + throws, 0] = engine.throws[0]
    return ReducedBody(
        name="stand-in",
        omega=z(6),
        interfaces=names,
        positions=positions,
        shapes=np.tile(np.eye(6), (len(names), 1, 1)),
        gyroscopic=z((6, 6)),
        centrifugal=z((6, 6)),
        stress_stiffness=z((6, 6)),
        centrifugal_load=z(6),
        euler_load=z(6),
        translation=np.eye(3, 6),
        mass=1.0,
        centre=z(3),
        inertia=np.eye(3),
    )
