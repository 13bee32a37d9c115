"""Peaks of orders over the speed and the modes they belong to: with the damper's ring, on the drive line, in motion."""

import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from cranktrain.cli.main import main
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Parts, fitted_engine
from cranktrain.engine.file import load_engine
from cranktrain.results.orders.resonances import Peak, labelled, peaks
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.structure.assembly import Assembly
from cranktrain.structure.crank.level import crank_body
from cranktrain.structure.crank.modal import cranktrain_modes
from cranktrain.studies.campbell import campbell
from cranktrain.studies.run_up.report import report, torsional_peaks
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


DATA = Path(__file__).parents[1] / "data" / "engines"
LARGE = 0.2
"""Peaks of the crank with at least this fraction of the largest of them are judged."""
pytestmark = pytest.mark.filterwarnings("ignore:.*fires at uneven intervals")


def crank_peaks(folder, capsys, engine, *options):
    """Periodic peaks of a run-up above its drive line's frequencies, the highest first, as ``--json`` has them."""
    words = ["runup", str(engine), "--workers", "1", "--output", str(folder / "r.h5"), "--json", *options]
    assert main(words) == 0
    return [peak for peak in json.loads(capsys.readouterr().out)["peaks"] if peak["hz"] > 300.0 and peak["periodic"]]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("engine", "low", "high", "step"),
    [("gas_i4", 1000, 6500, 50), ("moto_i4", 1500, 14000, 100), ("vtwin", 1000, 7500, 50), ("new", 1000, 6300, 50)],
)
def test_peaks_of_short_solid_cranks_on_films_have_their_modes(tmp_path, capsys, monkeypatch, engine, low, high, step):
    """Large peaks, at least four of them, have a mode in motion within 0.7 %; of a four from a layout too."""
    monkeypatch.chdir(tmp_path)
    if engine == "new":
        assert main(["new", "new", "--layout", "i4", "--bore-mm", "86", "--stroke-mm", "86"]) == 0
        capsys.readouterr()
    path = "new.toml" if engine == "new" else DATA / f"{engine}.toml"
    found = crank_peaks(tmp_path, capsys, path, "--from", str(low), "--to", str(high), "--step", str(step))
    large = [peak for peak in found if peak["amplitude"] >= LARGE * found[0]["amplitude"]]
    assert len(large) >= 4
    for peak in large:
        assert peak["mode_in_motion_hz"] == pytest.approx(peak["hz"], rel=0.007), peak


def test_the_peak_of_a_crank_of_beams_has_the_mode_with_less_torsion_in_its_energy(tmp_path, capsys):
    """Order 6 of a four; the mode near 600 Hz twists more and is damped twice as much."""
    options = ("--crank", "beam", "--from", "4200", "--to", "5000", "--step", "50")
    first = next(peak for peak in crank_peaks(tmp_path, capsys, DATA / "gas_i4.toml", *options) if peak["order"] == 6.0)
    assert first["mode_in_motion_hz"] == pytest.approx(first["hz"], rel=0.007)
    assert 25.0 < first["mode_in_motion_torsion_percent"] < 60.0


MODE_HZ, DAMPING = 238.0, 0.015


def run_up(rpm, forces):
    """One mode under forces of constant amplitude, one by order; static twist of 1e-4 rad each."""
    speeds = np.asarray(rpm) * math.pi / 30.0
    orders = 0.5 * np.arange(1, 49)
    share = orders * speeds[:, None] / (2.0 * math.pi * MODE_HZ)
    torsion = 1e-4 * np.array([forces.get(order, 0.0) for order in orders]) / (1.0 - share**2 + 2j * DAMPING * share)
    s = speeds.size
    ones = np.ones(s, dtype=int)
    return RunUp(speeds, orders, {"pulley.torsion": torsion}, {}, ones, ones, np.zeros(s))


def test_peaks_of_one_mode_lie_at_its_critical_speeds():
    found = peaks(run_up(np.arange(1000.0, 2601.0, 20.0), {6.0: 1.0, 9.0: 0.5, 12.0: 0.3}))
    assert [peak.order for peak in found] == [6.0, 9.0, 12.0]
    for peak, force in zip(found, (1.0, 0.5, 0.3), strict=True):
        assert peak.speed * 30.0 / math.pi == pytest.approx(60.0 * MODE_HZ / peak.order, rel=5e-4)
        assert peak.amplitude == pytest.approx(force * 1e-4 / (2.0 * DAMPING), rel=0.01)
        assert peak.damping == pytest.approx(DAMPING, rel=0.05)
        assert peak.periodic


def test_the_error_of_a_peak_falls_with_the_square_of_the_step():
    errors = []
    for step in (32.0, 16.0, 8.0):
        (found,) = peaks(run_up(np.arange(2203.0, 2551.0, step), {6.0: 1.0}))
        errors.append(abs(found.amplitude / (1e-4 / (2.0 * DAMPING)) - 1.0))
    assert errors[2] < errors[0] / 8.0


def test_labels_are_those_of_the_nearest_modes():
    found = labelled(
        peaks(run_up(np.arange(1000.0, 2601.0, 20.0), {6.0: 1.0})),
        np.array([206.0, 236.0, 267.0]), ("bending", "torsional", "bending"),
    )  # fmt: skip
    assert found[0].kind == "torsional" and found[0].mode_hz == 236.0
    assert found[0].critical_speed == pytest.approx(2360.0 * math.pi / 30.0)


def test_slopes_ends_and_ripples_are_no_peaks():
    assert peaks(run_up(np.arange(1000.0, 2001.0, 20.0), {6.0: 1.0})) == []  # rising to its end
    made = run_up(np.arange(1000.0, 2601.0, 20.0), {6.0: 1.0})
    ripple = 1.0 + 0.04 * np.cos(np.arange(made.speeds.size))[:, None]
    rippled = RunUp(**{**vars(made), "amplitudes": {"pulley.torsion": made.torsion * ripple}})
    assert len(peaks(rippled)) == 1


def test_a_measured_critical_speed_stands_beside_the_nearest_peak_of_its_order():
    made = run_up(np.arange(1000.0, 2601.0, 20.0), {6.0: 1.0, 9.0: 0.5})
    rpm = np.array([2370.0, 0.0]) * math.pi / 30.0
    published = SimpleNamespace(critical_orders=(6.0, 9.0), measured_critical_speeds=tuple(rpm.tolist()))
    found = peaks(made)
    far = replace(found[0], speed=0.6 * found[0].speed)
    six, other, nine = report(made, [found[0], far, found[1]], published)["peaks"]
    assert six["measured_rpm"] == pytest.approx(2370.0)
    assert six["off_measured_percent"] == pytest.approx(100.0 * (six["rpm"] / 2370.0 - 1.0))
    assert other["measured_rpm"] is None and nine["off_measured_percent"] is None


def test_speeds_without_a_period_are_counted():
    made = run_up(np.arange(1000.0, 2601.0, 200.0), {6.0: 1.0})
    made = RunUp(**{**vars(made), "repeats": np.array([1, 0, 1, 1, 0, 2, 1, 1, 1])})
    assert report(made, [])["speeds_without_period"] == 2
    not_run = RunUp(**{**vars(made), "cycles": np.zeros(made.speeds.size, dtype=int)})
    assert report(not_run, [])["speeds_without_period"] == 0
