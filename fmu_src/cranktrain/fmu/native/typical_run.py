"""A run of the cranktrain whose arrays have the types of every other: what kernels are compiled for, no more."""

from __future__ import annotations

import numpy as np

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.dynamics.model.arrays import Parts
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.run_record import Run, make_run
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import GasTrace

ENGINE = "diesel_i6"


def typical_run() -> Run:
    """Run of an engine with a body in place of its crankshaft: types do not follow from what is in it."""
    engine = load_engine(ENGINE)
    settings = Settings(crank="rigid", bearings="linear")
    return make_run(engine, stand_in(engine), settings, GasTrace.from_engine(engine), Parts())


def stand_in(engine: Engine) -> ReducedBody:
    """Six rigid modes of unit mass and inertia, all interfaces of a crankshaft at the origin."""
    throws, mains = len(engine.crankshaft.throw_angles), len(engine.crankshaft.main_widths)
    names = (
        *(f"main[{i + 1}]" for i in range(mains)),
        *(f"pin[{i + 1}]" for i in range(throws)),
        "thrust", "flywheel", "pulley",
    )  # fmt: skip
    z = np.zeros
    return ReducedBody(
        name="stand-in",
        omega=z(6),
        interfaces=names,
        positions=z((len(names), 3)),
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
