"""Pictures carry names and units on their axes, and show the numbers they are given."""

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pytest

from cranktrain.results import plots


@pytest.fixture
def ax():
    figure, axes = plt.subplots()
    yield axes
    plt.close(figure)


def test_a_cycle_closes_and_names_its_peak_to_peak(ax):
    values = 2.0 + np.sin(np.arange(360) * 2.0 * np.pi / 360)
    plots.plot_cycle(ax, values, "pulley torsion", "deg")
    assert ax.get_xlabel() == "crank angle over the last cycle / deg"
    assert ax.get_ylabel() == "pulley torsion / deg"
    assert "2 deg peak to peak" in ax.get_title(loc="left")
    x, y = ax.lines[-1].get_data()
    assert x[0] == 0.0 and x[-1] == 720.0 and y[0] == y[-1]


def test_order_bars_have_their_heights_and_the_strongest_their_names(ax):
    orders = 0.5 * np.arange(1, 49)
    amplitudes = np.zeros(48)
    amplitudes[[2, 5, 11]] = 1.0, 2.0, 3.0
    plots.plot_orders(ax, orders, amplitudes, "axial displacement", "µm", highest=12.0)
    assert len(ax.patches) == 24
    assert {text.get_text() for text in ax.texts} == {"1.5", "3", "6"}
    assert max(patch.get_height() for patch in ax.patches) == 3.0
    assert ax.get_ylabel() == "axial displacement, zero to peak / µm"
    assert "order" in ax.get_xlabel()


def test_a_table_shows_every_cell(ax):
    plots.plot_table(ax, ("Hz", "shape"), (("238.0", "torsional"), ("300.0", "axial")), "Cranktrain")
    cells = {key: cell.get_text().get_text() for key, cell in ax.tables[0].get_celld().items()}
    assert cells[0, 0] == "Hz" and cells[2, 1] == "axial"


def test_a_mode_shape_moves_its_points_and_spans_its_colours():
    figure = plt.figure()
    ax = figure.add_subplot(projection="3d")
    points = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.5]])
    shift = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    surface = plots.plot_mode_shape(ax, points, np.array([[0, 1, 2]]), shift, np.array([0.0, 0.5, -2.0]), "turn", 0.6)
    # the crank axis z is drawn along the horizontal axis; point 2 moved there by 0.6
    assert ax.get_xlim() == pytest.approx((0.0, 0.6), abs=0.05)
    assert (surface.norm.vmin, surface.norm.vmax) == (-2.0, 2.0)
    figure.canvas.draw()
    plt.close(figure)


def test_pressure_has_firing_dead_centre_in_the_middle(ax):
    angles = np.arange(0.0, 720.0, 1.0)
    plots.plot_pressure(ax, angles, {"fired": np.where(angles == 10.0, 12e6, 1e5)})
    x, y = ax.lines[0].get_data()
    assert x[y.argmax()] == 10.0 and y.max() == pytest.approx(12.0)
    assert np.all(np.diff(x) > 0.0)
    assert ax.get_ylabel().endswith("/ MPa") and ax.get_xlabel().endswith("/ deg")


def test_bearing_load_is_drawn_in_kilonewtons(ax):
    plots.plot_bearing_load(ax, np.array([0.0, 1500.0]), np.array([0.0, -3000.0]), "main 1")
    assert ax.lines[0].get_xdata()[1] == pytest.approx(1.5) and ax.lines[0].get_ydata()[1] == pytest.approx(-3.0)
    assert ax.get_xlabel() == "force x / kN"
