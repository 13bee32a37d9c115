"""Modes that peaks belong to: with the damper's ring, and of the crank as a whole on its drive line."""

import math
from dataclasses import replace

import numpy as np
import pytest

from cranktrain.dynamics.model.arrays import Parts
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import fitted_engine
from cranktrain.engine.file import load_engine
from cranktrain.results.orders.resonances import Peak
from cranktrain.structure.assembly import Assembly
from cranktrain.structure.crank.level import crank_body
from cranktrain.structure.crank.modal import cranktrain_modes
from cranktrain.studies.campbell import campbell
from cranktrain.studies.run_up.report import torsional_peaks
from cranktrain.studies.torsion.frequency_run_up import HARMONIC_BALANCE, frequency_run_up
from cranktrain.studies.torsion.line_modes import line_modes
from cranktrain.studies.torsion.peak_modes import modes_at_peak

RPM = math.pi / 30.0
ORDERS = 0.5 * np.arange(1, 49)
SETTINGS = Settings(crank="torsional", damper="fitted")
SMALL = Peak(6.0, 2000.0 * RPM, 1e-9, 0.1, True)


def fitted(name, **changes):
    """Engine, the same with its damper's housing, and the torsional crank of the latter by a formula."""
    engine = load_engine(name)
    engine = replace(engine, reduction=replace(engine.reduction, torsional_source="ker-wilson"))
    engine = replace(engine, damper=replace(engine.damper, **changes))
    housed = fitted_engine(engine, SETTINGS)
    return engine, housed, crank_body(housed, "torsional")


@pytest.mark.parametrize(("name", "orders"), [("diesel_i6", (5.5, 6.5, 7.5, 8.5)), ("diesel_v8", (6.5, 7.0, 7.5, 9.0))])
def test_peaks_with_a_damper_lie_where_the_mode_with_its_ring_does(name, orders):
    """Of a fluid that thins; where an order's force hardly changes there, to the square of its damping (0.12)."""
    engine, housed, body = fitted(name)
    speeds = np.arange(1000.0, 2700.0, 20.0) * RPM
    run = frequency_run_up(engine, body, SETTINGS, speeds, ORDERS, HARMONIC_BALANCE)
    found = torsional_peaks(run, Assembly(engine, SETTINGS, body, Parts()))
    of_orders = [peak for peak in found if peak.order in orders and peak.hz > 100.0]
    assert {peak.order for peak in of_orders} == set(orders)
    alone = cranktrain_modes(housed, body)[0][0]  # the housing without its ring
    for peak in of_orders:
        assert peak.kind == "torsional"
        assert peak.hz == pytest.approx(peak.mode_hz, rel=0.015)
        assert peak.hz < 0.95 * alone


@pytest.mark.parametrize("viscosity", [1e-6, 1e9])
def test_a_ring_without_fluid_and_one_that_is_stuck_are_the_limits(viscosity):
    """Campbell's modes are on their connecting shaft too, which moves f² by at most that of the crank on it alone.

    Mean tangents of the slider-cranks may lower it by a little more than the shaft raises it.
    """
    _, housed, body = fitted("diesel_i6", law="newtonian", viscosity=viscosity)
    free = cranktrain_modes(housed, body)[0][0]
    [hz] = modes_at_peak(housed, body, SMALL)[:1]
    assert hz == pytest.approx(free, rel=1e-6) if viscosity < 1.0 else 0.6 * free < hz < 0.95 * free
    over_speed = campbell(housed, body, np.array([1000.0, 2000.0]) * RPM, damper=True)
    raised = over_speed.hz[:, over_speed.names.index("torsional 1")] ** 2 - hz**2
    assert np.all(np.abs(raised) < line_modes(housed, body).hz[0] ** 2)


def test_a_fluid_that_thins_lets_go_of_its_ring_as_the_peak_grows():
    _, housed, body = fitted("diesel_v8")
    hz = [modes_at_peak(housed, body, replace(SMALL, amplitude=size))[0] for size in (1e-6, 1e-3, 1e-2, 1e-1)]
    assert np.all(np.diff(hz) > 0.0)
    assert hz[-1] < cranktrain_modes(housed, body)[0][0]


def test_the_crank_on_a_soft_shaft_is_one_mass_on_a_spring():
    engine, housed, body = fitted("diesel_i6")
    line = replace(engine.drive_line, stiffness=1e-4 * engine.drive_line.stiffness)
    soft = replace(housed, drive_line=line)
    hz, alone = (line_modes(soft, body, ring).hz[0] for ring in (engine.damper.ring_inertia, 0.0))
    inertia = line.stiffness / (2.0 * math.pi * np.array([hz, alone])) ** 2
    assert inertia[0] - inertia[1] == pytest.approx(engine.damper.ring_inertia, rel=1e-3)
