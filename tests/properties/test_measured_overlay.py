"""Measured orders over a run-up: bands and points of every kind of file, and the table of deviations."""

import math
from dataclasses import replace

import numpy as np
import pytest

from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.measured.order_table import write_orders
from cranktrain.measured.tracking import Orders
from cranktrain.results.orders.deviations import check_measured, deviation_table, deviations, of_another_engine
from cranktrain.results.orders.measured import band_of, read_measured_orders
from cranktrain.results.run_up import figures, shown
from cranktrain.results.run_up.run_up import FLYWHEEL, TORSION, RunUp

RPM = math.pi / 30.0
SPEEDS = np.arange(1000.0, 3001.0, 20.0)
SIX = load_engine("diesel_i6")


def response(speeds_rpm, order, critical_rpm, height):
    """Amplitudes (s,) rad of a mode with 2 % damping that an order excites with a constant torque."""
    ratio = speeds_rpm / critical_rpm
    return height * 0.04 / (1.0 - ratio**2 + 0.04j * ratio)


@pytest.fixture
def run_up():
    orders = np.array([3.0, 6.0])
    torsion = np.stack(
        [response(SPEEDS, n, rpm, h) for n, rpm, h in ((3.0, 4760.0, 0.02), (6.0, 2380.0, 0.01))], axis=1
    )
    ones = np.ones(SPEEDS.size, dtype=int)
    return RunUp(
        SPEEDS * RPM, orders, {TORSION: torsion, FLYWHEEL: 0.1 * torsion}, {}, ones, ones, np.zeros(SPEEDS.size)
    )


def measured_file(tmp_path, critical=2380.0, factor=1.0, turn=0.0, outputs=()):
    """Table of order 6 with its peak elsewhere, another height, and other phases."""
    speeds = np.arange(1800.0, 2900.0, 15.0)
    values = factor * response(speeds, 6.0, critical, 0.01) * np.exp(1j * turn)
    shape = (speeds.size, 1)
    found = Orders(speeds * RPM, np.array([6.0]), values.reshape(shape), np.full(shape, 1e-4), np.ones(shape),
                   np.ones(speeds.size, dtype=int), 4, "pulley", "rad")  # fmt: skip
    return write_orders(tmp_path / "orders.csv", [found] * max(1, len(outputs)), outputs)


def test_equal_orders_deviate_by_nothing(run_up, tmp_path):
    (row,) = deviations(run_up, read_measured_orders(measured_file(tmp_path)))
    assert abs(row["speed_percent"]) < 0.1 and abs(row["amplitude_percent"]) < 1.0
    assert row["rms_percent"] < 1.0 and abs(row["phase_deg"]) < 1.0
    assert row["measured_peak_rpm"] == pytest.approx(2380.0, rel=2e-3)


def test_speed_amplitude_and_phase_are_told_apart(run_up, tmp_path):
    """Measured 2 % higher in speed, a quarter higher, 30 deg ahead: computed is 2 % and 20 % lower, 30 deg behind."""
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


def test_bands_are_drawn_through_the_points(run_up, tmp_path):
    measured = read_measured_orders(measured_file(tmp_path))
    half = band_of(measured, TORSION, 6.0)
    np.testing.assert_allclose(half, 1.96e-4, rtol=1e-2)
    ax = figures.order_figure(run_up, shown.TORSIONAL, shown.Beside(SIX, None, measured), "six").axes[0]
    (lines,) = [part for part in ax.collections if len(part.get_segments()) == half.size]
    heights = [segment[1, 1] - segment[0, 1] for segment in lines.get_segments()]
    np.testing.assert_allclose(np.median(heights), 2.0 * np.degrees(1.96e-4), rtol=1e-2)


def test_data_of_another_engine_are_told(run_up, tmp_path):
    rows = deviations(run_up, read_measured_orders(measured_file(tmp_path, critical=1850.0)))
    assert "of another engine" in of_another_engine(rows) and "+29 %" in of_another_engine(rows)
    assert not of_another_engine(deviations(run_up, read_measured_orders(measured_file(tmp_path))))
    slow = replace(run_up, speeds=run_up.speeds / 10.0)
    with pytest.raises(
        InputError, match=r"from 1800 to 2895 rev/min, the run-up from 100 to 300 .* no speed in common"
    ):
        check_measured(slow, read_measured_orders(measured_file(tmp_path)))
