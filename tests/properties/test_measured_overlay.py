"""Measured orders over a run-up: bands and points of every kind of file, and the table of deviations."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.core.units import RPM
from cranktrain.engine.file import load_engine
from cranktrain.results.orders.deviations import check_measured, deviation_table, deviations, of_another_engine
from cranktrain.results.orders.measured import band_of, read_measured_orders
from cranktrain.results.orders.measured_points import motion_of, points_at
from cranktrain.results.orders.modes_over_speed import ModesOverSpeed
from cranktrain.results.run_up import figures, peak_figures
from cranktrain.results.run_up import plot_data as shown
from cranktrain.results.run_up.run_up import FLYWHEEL, TORSION, RunUp
from cranktrain.studies.report.chart import bar_chart, line_chart
from cranktrain_lab.measured.order_table import write_orders
from cranktrain_lab.measured.tracking import Orders

SPEEDS = np.arange(1000.0, 3001.0, 20.0)
SIX = load_engine("diesel_i6")


def response(speeds_rpm, order, critical_rpm, height):
    """Amplitudes (s,) rad of a mode with 2 % damping that an order excites with a constant torque."""
    ratio = speeds_rpm / critical_rpm
    return height * 0.04 / (1.0 - ratio**2 + 0.04j * ratio)


@pytest.fixture
def run_up():
    orders = np.array([3.0, 6.0])
    torsion = np.stack((response(SPEEDS, 3.0, 4760.0, 0.02), response(SPEEDS, 6.0, 2380.0, 0.01)), axis=1)
    ones, outputs = np.ones(SPEEDS.size, dtype=int), {TORSION: torsion, FLYWHEEL: 0.1 * torsion}
    return RunUp(SPEEDS * RPM, orders, outputs, {}, ones, ones, np.zeros(SPEEDS.size))


def measured_file(tmp_path, critical=2380.0, factor=1.0, turn=0.0, outputs=()):
    """Table of order 6 with its peak elsewhere, another height, and other phases."""
    speeds = np.arange(1800.0, 2900.0, 15.0)
    values = factor * response(speeds, 6.0, critical, 0.01) * np.exp(1j * turn)
    shape = (speeds.size, 1)
    found = Orders(speeds * RPM, np.array([6.0]), values.reshape(shape), np.full(shape, 1e-4), np.ones(shape),
                   np.ones(speeds.size, dtype=int), 4, "pulley", "rad")  # fmt: skip
    return write_orders(tmp_path / "orders.csv", [found] * max(1, len(outputs)), outputs)


def test_equal_orders_deviate_by_nothing_and_speed_amplitude_and_phase_are_told_apart(run_up, tmp_path):
    """Measured 2 % higher in speed, a quarter higher, 30 deg ahead: computed is 2 % and 20 % lower, 30 deg behind."""
    (row,) = deviations(run_up, read_measured_orders(measured_file(tmp_path)))
    assert abs(row["speed_percent"]) < 0.1 and abs(row["amplitude_percent"]) < 1.0
    assert row["rms_percent"] < 1.0 and abs(row["phase_deg"]) < 1.0
    assert row["measured_peak_rpm"] == pytest.approx(2380.0, rel=2e-3)

    (row,) = deviations(run_up, read_measured_orders(measured_file(tmp_path, 1.02 * 2380.0, 1.25)))
    assert row["speed_percent"] == pytest.approx(100.0 / 1.02 - 100.0, abs=0.15)
    assert row["amplitude_percent"] == pytest.approx(-20.0, abs=1.0)
    (row,) = deviations(run_up, read_measured_orders(measured_file(tmp_path, turn=math.radians(30.0))))
    assert row["phase_deg"] == pytest.approx(-30.0, abs=1.0)
    assert deviation_table([row]).rows[0][:2] == ("torsion", "6")


def test_measured_orders_name_their_output(run_up, tmp_path):
    found = read_measured_orders(measured_file(tmp_path, outputs=(TORSION, FLYWHEEL, "twist")))
    assert set(found) == {TORSION, FLYWHEEL, "twist"}
    rows = deviations(run_up, found)
    assert [row["output"] for row in rows] == [TORSION, FLYWHEEL, "twist"]
    assert rows[1]["amplitude_percent"] == pytest.approx(-90.0, abs=1.0)
    path = tmp_path / "wrong.csv"
    path.write_text("speed_rpm,order,amplitude,unit,output\n2000,6,0.1,deg,pully.torsion\n")
    with pytest.raises(InputError, match=r"wrong.csv, line 2: output 'pully.torsion' .*did you mean 'pulley.torsion'"):
        read_measured_orders(path)


def test_data_of_another_engine_are_told(run_up, tmp_path):
    rows = deviations(run_up, read_measured_orders(measured_file(tmp_path, critical=1850.0)))
    assert "of another engine" in of_another_engine(rows) and "+29 %" in of_another_engine(rows)
    assert not of_another_engine(deviations(run_up, read_measured_orders(measured_file(tmp_path))))
    slow = replace(run_up, speeds=run_up.speeds / 10.0)
    with pytest.raises(InputError, match=r"from 1800 to 2895 rev/min, the run-up from 100 to 300 .* no speed in"):
        check_measured(slow, read_measured_orders(measured_file(tmp_path)))


def test_every_picture_has_the_measured_orders_with_their_bands(run_up, tmp_path):
    """Orders, waterfall, colour maps, Campbell diagram, cycles and orders at peaks; the deviations stand below."""
    measured, quantity = read_measured_orders(measured_file(tmp_path)), shown.TORSIONAL
    half = band_of(measured, TORSION, 6.0)
    np.testing.assert_allclose(half, 1.96e-4, rtol=1e-2)
    hz = np.full((SPEEDS.size, 1), 238.0)
    modes = ModesOverSpeed(SPEEDS * RPM, hz, ("torsional 1",), ("torsional",), np.ones((SPEEDS.size - 1, 1)))
    beside, bare = shown.Beside(SIX, modes, measured), shown.Beside(SIX, modes)

    def bars(figure):
        """Heights of the bars of all measured points, where a figure has them."""
        parts = [part.get_segments() for ax in figure.axes for part in ax.collections if hasattr(part, "get_segments")]
        return [[segment[1, 1] - segment[0, 1] for segment in part] for part in parts if len(part) == half.size]

    (heights,) = bars(figures.order_figure(run_up, quantity, beside, "six"))
    np.testing.assert_allclose(np.median(heights), 2.0 * np.degrees(1.96e-4), rtol=1e-2)
    waterfall, without = (figures.waterfall_figure(run_up, quantity, one, "six", 400.0) for one in (beside, bare))
    assert len(bars(waterfall)) == 1 and not bars(without)
    maps = figures.map_figure(run_up, quantity, beside, "six", 400.0).axes
    assert sum(len(part.get_offsets()) == half.size for ax in maps for part in ax.collections) == 2
    campbell = figures.campbell_figure(run_up, beside, "six")
    middle, lower, upper = (a.get_sizes() for a in campbell.axes[0].collections if not len(a.get_facecolor()))
    assert np.all(lower < middle) and np.all(middle < upper)
    for figure in (waterfall, campbell):
        said = " ".join(text.get_text() for text in figure.texts).replace("\n", " ")
        assert "Computed against measured peaks: order 6: " in said
    history = peak_figures.history_figure(run_up, quantity, "six", beside)
    assert "measured" in [line.get_label() for ax in history.axes for line in ax.lines]
    harmonic = peak_figures.harmonic_figure(run_up, quantity, beside, "six")
    assert any(len(a.get_segments()) == 1 for ax in harmonic.axes for a in ax.collections)


def test_the_measured_cycle_is_the_sum_of_its_orders(tmp_path):
    path = tmp_path / "two.csv"
    path.write_text(
        "speed_rpm,order,amplitude,unit,phase_deg,band\n2000,3,0.2,deg,30,0.03\n2000,6,0.1,deg,-90,0.04\n2000,9,1,deg,,\n"
    )
    points = points_at(read_measured_orders(path), TORSION, 2001.0 * RPM, 2.0 * RPM)
    assert [point.order for point in points] == [3.0, 6.0, 9.0]
    angle = np.linspace(0.0, 4.0 * math.pi, 100)
    motion, band = motion_of(points, angle)
    true = 0.2 * np.cos(3.0 * angle + math.radians(30.0)) + 0.1 * np.cos(6.0 * angle - math.radians(90.0))
    np.testing.assert_allclose(np.degrees(motion), true, atol=1e-6)
    assert np.degrees(band) == pytest.approx(0.05, rel=1e-6)  # 3, 4, 5
    assert not points_at(read_measured_orders(path), TORSION, 2010.0 * RPM, 2.0 * RPM)


def test_charts_of_the_report_draw_bands():
    x = np.array([1.0, 2.0, 3.0])
    points = {"order 6": (np.array([1.5, 2.5, 9.0]), np.array([0.5, 0.6, 0.7]), np.array([0.1, 0.0, 0.1]))}
    text = line_chart("Orders", x, {"order 6": np.array([0.4, 0.6, 0.5])}, ("x", "y"), points=points)
    assert text.count("measured</title>") == 2  # the third lies beyond the axis
    assert text.count('stroke-width="1.2"/>') == 1  # the second has no band
    given = {"a": (np.array([1.0, np.nan, 9.0]), np.array([0.5, 0.1, 0.1]))}
    bars = bar_chart("Orders", x, {"a": x}, ("x", "y"), given)
    assert bars.count("measured</title>") == 2 and bars.count('stroke-width="1.2"/>') == 2


def test_runup_compares_with_measured_orders_and_refuses_other_speeds_at_once(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = measured_file(tmp_path)
    command = ["runup", "diesel_i6", "--step", "40", "--method", "linear", "--crank", "torsional", "--bearings", "held",
               "--measured", str(path)]  # fmt: skip
    assert main([*command, "--from", "600", "--to", "900"]) == 2
    assert "no speed in common" in capsys.readouterr().err and not (tmp_path / "diesel_i6_runup.h5").exists()
    assert main([*command, "--from", "1800", "--to", "2800", "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["deviations"]
    assert row["order"] == 6.0 and abs(row["speed_percent"]) < 3.0


def test_noise_is_no_measured_peak(run_up, tmp_path):
    """An order that is constant within its band has no peak to compare."""
    rng = np.random.default_rng(0)
    speeds = np.arange(1200.0, 2800.0, 20.0)
    path = tmp_path / "flat.csv"
    sizes = 0.1 + rng.normal(0.0, 0.005, speeds.size)
    lines = [f"{rpm},6,{size},deg,0.0,0.01" for rpm, size in zip(speeds, sizes, strict=True)]
    path.write_text("speed_rpm,order,amplitude,unit,phase_deg,band\n" + "\n".join(lines))
    (row,) = deviations(run_up, read_measured_orders(path))
    assert row["measured_peak_rpm"] is None and row["speed_percent"] is None and row["rms_percent"] > 50.0
