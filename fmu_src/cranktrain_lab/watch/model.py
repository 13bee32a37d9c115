"""Orders of torsion by a torsional crank, for the cases of :mod:`cranktrain_lab.watch.defects`."""

from typing import NamedTuple

import numpy as np

from cranktrain.core.types import Array, ComplexArray, Progress
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import fitted_engine
from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.results.run_up.run_up import FLYWHEEL, TORSION
from cranktrain.structure.assembly import assemble
from cranktrain.studies.torsion.frequency_run_up import HARMONIC_BALANCE, frequency_run_up
from cranktrain_lab.watch.defects import Case

TWIST = "twist"
OUTPUTS = (TORSION, FLYWHEEL, TWIST)
"""Outputs that may be watched."""


class Place(NamedTuple):
    """Operating points of a watch: output of torsion, s speeds (rad/s) and o orders."""

    output: str
    speeds: Array
    orders: Array


class TorsionalAnswers:
    """Model of a torsional crank for the healthy engine and its defects.

    Parameters
    ----------
    engine : healthy engine; added bodies and connections are left out
    load : fraction of the full-load burn
    damper : True if the damper is fitted
    rule : ``linear`` or ``harmonic-balance``
    inherit : True if the crank takes the damping of the level above

    Raises
    ------
    InputError
        an engine without a torsional crank
    """

    def __init__(
        self, engine: Engine, load: float, damper: bool, rule: str = HARMONIC_BALANCE, inherit: bool = True,
        say: Progress = lambda stage: None,
    ) -> None:  # fmt: skip
        self.engine, self.damper, self._rule = engine.without_additions, damper, rule
        settings = Settings(crank="torsional", damper="fitted" if damper else "none", gas_load=load)
        self._made = assemble(self.engine, settings, say=say, inherit=inherit)
        self.healthy = Case(self.engine, GasTrace.from_engine(self.engine))

    def orders(self, case: Case, place: Place) -> ComplexArray:
        """Return complex orders (s, o), rad, with order n as Re[a exp(i n θ)]; ``InputError``, ``SolverError``."""
        made, speeds = self._made, np.unique(place.speeds)
        engine = fitted_engine(case.engine, made.settings)
        found = frequency_run_up(engine, made.body, made.settings, speeds, list(place.orders), self._rule, case.gas)
        values = found.amplitudes[FLYWHEEL if place.output == FLYWHEEL else TORSION]
        if place.output == TWIST:
            values = values - found.amplitudes[FLYWHEEL]
        turned = values * np.exp(1j * case.zero * np.asarray(place.orders))
        return np.asarray(turned[np.searchsorted(speeds, place.speeds)])
