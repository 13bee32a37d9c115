"""Live results of a torsional crank for knobs, by the linear run-up of :mod:`cranktrain_lab.variants.torsional`.

The bare crank and its damping are made once. Each result then takes some tens of milliseconds for 91 speeds and 24
orders. For engines that take longer (friction in the drive line needs iteration), fewer speeds are computed while a
knob moves, and all of them when it rests. Harmonic balance also follows when a knob rests.
"""

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.engine.model import Engine
from cranktrain.loads.damper import (
    STIFFNESS,
    damper_parameters,
    damper_temperature,
    damping_coefficient,
    required_damper,
)
from cranktrain.results.run_up.plot_data import DROWNED
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.studies.torsion.added_orders import not_linear
from cranktrain.studies.torsion.damped_modes import damped_modes
from cranktrain.studies.torsion.frequency_run_up import HARMONIC_BALANCE, HIGHEST_ORDER, frequency_run_up
from cranktrain.studies.torsion.peak_modes import OVERDAMPED
from cranktrain.studies.torsion.shaft_orders import ShaftOrders
from cranktrain_lab.explore.knobs import Chosen, chosen_engine, knobs_of
from cranktrain_lab.variants.models import SHAPING, torsional_model
from cranktrain_lab.variants.study import Levels
from cranktrain_lab.variants.torsional import HEAT, TORQUE, TORSION, TWIST, structure_of, torsional_answer

SPEEDS, FEWEST = 91, 21
MOVING = 0.06
"""Time limit of a computation while a knob moves, s. The rest of 100 ms is for drawing."""
ORDERS = tuple(0.5 * k for k in range(1, round(2.0 * HIGHEST_ORDER) + 1))
FREQUENCIES = 3
"""Largest number of torsional frequencies in the diagram."""
PLACES = 5
"""Number of speeds at which frequencies are computed, because a damper's fluid changes with its temperature."""


@dataclass(frozen=True)
class Curves:
    """Torsion over speed, as half of peak-to-peak values and amplitudes of orders.

    Attributes
    ----------
    speeds : (s,) rad/s
    orders : (o, s) amplitude of the pulley's torsion of each of :data:`ORDERS`, rad
    twist : (s,) pulley against flywheel, rad
    heat, torque : (s,) heat (W) and torque (N m) of the damper; empty without one
    heat_limit : heat that the damper's surface dissipates, W; 0 if the file has no limit
    hz_speeds, hz : (p,) speeds, rad/s, and (p, m) torsional frequencies with the damper's ring, Hz
    seconds : wall time of the computation
    """

    speeds: Array
    orders: Array
    twist: Array
    heat: Array
    torque: Array
    heat_limit: float
    hz_speeds: Array
    hz: Array
    seconds: float

    def order(self, order: float) -> Array:
        """Return the amplitudes (s,) of an order, rad."""
        return np.asarray(self.orders[ORDERS.index(order)])

    def largest_orders(self, count: int) -> list[float]:
        """Return ``count`` sorted orders: half have the largest resonances, the other half the largest amplitudes.

        Uneven rotation makes low orders large at low speeds, so amplitudes alone would not show resonances.
        """
        peaks = self._resonances()
        resonant = [k for k in np.argsort(-peaks, kind="stable").tolist() if peaks[k] > 0.0][: count - count // 2]
        by_size = np.argsort(-np.nan_to_num(self.orders).max(axis=1), kind="stable").tolist()
        return sorted(ORDERS[k] for k in [*resonant, *(k for k in by_size if k not in resonant)][:count])

    @property
    def drowned(self) -> bool:
        """True if the highest resonance is invisible on a linear scale of the largest amplitude."""
        return 0.0 < float(self._resonances().max()) < DROWNED * float(np.nan_to_num(self.orders).max())

    def _resonances(self) -> Array:
        """Return the highest peak of each order inside the speed range, rad, (o,) for o orders; 0 without a peak."""
        sizes = np.nan_to_num(self.orders)
        inside = sizes[:, 1:-1]
        peak = (inside >= sizes[:, :-2]) & (inside > sizes[:, 2:])
        return np.asarray(np.where(peak, inside, 0.0).max(axis=1, initial=0.0))


class LiveTorsion:
    """Live model of an engine for choices of its knobs.

    Parameters
    ----------
    engine : engine of the file
    low, high : ends of the speed range, rad/s; None for those of the engine
    say : called with each stage of making the crank

    Attributes
    ----------
    engine : modelled engine, without added bodies and connections that have no linear form (see ``notes``)
    knobs : knobs of the engine
    notes : parts that the live results leave out, one line each

    Raises
    ------
    InputError
        invalid speeds, an engine without a linear run-up
    """

    def __init__(
        self,
        engine: Engine,
        low: float | None = None,
        high: float | None = None,
        say: Callable[[str], None] = lambda stage: None,
    ) -> None:
        first, last = (engine.speeds[k] if end is None else end for k, end in enumerate((low, high)))
        self.notes: list[str] = []
        self.whole = engine
        added = engine.additions
        if reason := not_linear(engine):
            self.notes.append(
                f"The live answers leave out {len(added.body)} added bodies and {len(added.connection)} added "
                f"connections: {reason}. The full model includes them."
            )
            engine = engine.without_additions
        self.engine, self.knobs = engine, knobs_of(engine)
        self.speeds: Array = np.linspace(first, last, SPEEDS)
        varied = {one.key: (one.low, one.high, one.own) for one in self.knobs if one.key.partition(".")[0] in SHAPING}
        asked = (TWIST, *(f"{TORSION}.order[{order:g}]" for order in ORDERS))
        self._outputs = asked if engine.damper is None else (*asked, HEAT, TORQUE)
        levels = Levels(damper=engine.damper is not None)
        self._model = torsional_model(engine, varied, self.speeds[[0, -1]].tolist(), levels, say=say)
        self._count = SPEEDS
        self.answer(Chosen())  # the first result includes loading, so only later results show the computing time

    def engine_of(self, chosen: Chosen) -> Engine:
        """Return the checked engine of a choice, without additions; raises ``InputError``."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return chosen_engine(self.engine, self.knobs, chosen)

    def answer(self, chosen: Chosen, moving: bool = False) -> Curves:
        """Return curves of a choice; ``moving``: at fewer speeds if all take too long. Raises errors of the package."""
        began = time.perf_counter()
        speeds = self.speeds if not moving else np.linspace(self.speeds[0], self.speeds[-1], self._count)
        made = self._model.assembly_of(self.engine_of(chosen), chosen.load)
        structure = structure_of(made)
        found = torsional_answer(made, speeds, self._outputs, structure)
        hz = torsional_frequencies(structure, made.engine, *self.speeds[[0, -1]].tolist())
        seconds = time.perf_counter() - began
        # At least half of the time is proportional to the number of speeds.
        self._count = int(np.clip(speeds.size * MOVING / max(seconds, 1e-6), FEWEST, SPEEDS))
        orders = np.stack([found[name] for name in self._outputs[1 : 1 + len(ORDERS)]])
        none, limit = np.zeros(0), 0.0
        if made.engine.damper is not None:
            damper = required_damper(made.engine)
            limit = damper.power_limit * damper.cooling_area
        return Curves(speeds, orders, found[TWIST], found.get(HEAT, none), found.get(TORQUE, none), limit, *hz, seconds)

    def balanced(self, chosen: Chosen) -> RunUp:
        """Compute harmonic balance of a choice at every second speed; raises errors of the package."""
        made = self._model.assembly_of(self.engine_of(chosen), chosen.load)
        return frequency_run_up(
            made.engine, made.body, made.settings, self.speeds[::2], ORDERS, HARMONIC_BALANCE, failed=[]
        )


def checked_speeds(engine: Engine, from_rpm: float | None, to_rpm: float | None) -> tuple[float, float]:
    """Return the ends of the speed range, rad/s; raises ``InputError`` for an invalid range."""
    low, high = (engine.speeds[k] if given is None else given * RPM for k, given in enumerate((from_rpm, to_rpm)))
    if not low < high:
        raise InputError(f"--from {low / RPM:g} is not below --to {high / RPM:g} rev/min; exchange or widen them")
    return float(low), float(high)


def torsional_frequencies(structure: ShaftOrders, engine: Engine, low: float, high: float) -> tuple[Array, Array]:
    """Return speeds (s,) rad/s from ``low`` to ``high``, and frequencies (s, m) Hz, NaN for missing modes.

    The model has mean rods and no damping except the damper. The damper's ring is an additional coordinate with the
    damper's stiffness and damping at small amplitude and at its temperature for the speed. Modes with half of the
    critical damping or more are left out, because they are not resonances.
    """
    speeds = np.linspace(low, high, PLACES)
    if not structure.ring or engine.damper is None:
        own = structure.frequencies_hz()[:FREQUENCIES]
        return speeds, np.broadcast_to(own, (PLACES, own.size))
    stiffness, _, mass = structure.matrices(True)
    twist = structure.ends_rows()[0]
    twist = np.pad(twist, (0, len(mass) - twist.size))  # bodies that the engine's file adds do not twist the damper
    link = np.outer(twist, twist)
    found = np.full((PLACES, FREQUENCIES), np.nan)
    for row, speed in zip(found, speeds.tolist(), strict=True):
        law = damper_parameters(engine.damper, damper_temperature(engine.damper, speed))
        modes = damped_modes(stiffness + law[STIFFNESS] * link, damping_coefficient(law) * link, mass)
        hz = modes.hz[modes.damping_ratios < OVERDAMPED][:FREQUENCIES]
        row[: hz.size] = hz
    return speeds, found[:, ~np.isnan(found).all(axis=0)]
