"""Natural frequencies over speed of the crank whose run-up is in a file."""

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import fitted_engine
from cranktrain.engine.levels import crank_level
from cranktrain.engine.model import Engine
from cranktrain.results.orders.modes_over_speed import ModesOverSpeed
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.structure.assembly import running_crank
from cranktrain.studies.campbell import campbell

SPEEDS = 21


def run_up_modes(engine: Engine, run_up: RunUp) -> ModesOverSpeed | None:
    """Modes over the speeds of a run-up; None for a rigid crank, or for a single speed.

    Raises ``InputError``: an engine whose crank is not that of the run-up.
    """
    level = str(run_up.attributes.get("crank", "solid"))
    if run_up.speeds.size < 2 or not crank_level(level).elastic:
        return None
    damper = str(run_up.attributes.get("damper", "none"))
    fitted = fitted_engine(engine, Settings(crank=level, damper=damper))
    for inherit in (True, False):
        body = running_crank(fitted, level, inherit=inherit)
        if body.digest == run_up.attributes.get("body_digest", body.digest):
            speeds = np.linspace(run_up.speeds[0], run_up.speeds[-1], SPEEDS)
            return campbell(fitted, body, speeds, level, damper=damper != "none")
    raise InputError(
        f"the crank of engine '{engine.name}' is not the one that the run-up has (its engine file has changed, or it "
        "has a mesh of its own)"
    )
