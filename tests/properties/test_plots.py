"""Pictures carry names and units on their axes, and show the numbers they are given."""

import dataclasses
import math
from types import SimpleNamespace

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.results import figures, plots


@pytest.fixture
def ax():
    figure, axes = plt.subplots()
    yield axes
    plt.close(figure)


def test_pressure_has_firing_dead_centre_in_the_middle_and_loads_are_in_kilonewtons(ax):
    angles = np.arange(0.0, 720.0, 1.0)
    plots.plot_pressure(ax, angles, {"fired": np.where(angles == 10.0, 12e6, 1e5)})
    x, y = ax.lines[0].get_data()
    assert x[y.argmax()] == 10.0 and y.max() == pytest.approx(12.0)
    assert np.all(np.diff(x) > 0.0)
    assert ax.get_ylabel().endswith("/ MPa") and ax.get_xlabel().endswith("/ deg")
    plots.plot_bearing_load(ax, np.array([0.0, 1500.0]), np.array([0.0, -3000.0]), "main 1")
    assert ax.lines[-3].get_xydata()[1] == pytest.approx([1.5, -3.0]) and ax.get_xlabel() == "force x / kN"


def test_an_orbit_lies_in_its_clearance_circle_with_equal_axes(ax):
    turn = np.arange(360) * 2.0 * np.pi / 360
    x, y = 0.5 * np.cos(turn), 0.8 * np.sin(turn)
    marks = {"start": 0, "1": 90, "2": 180, "3": 270}
    line = plots.plot_orbit(ax, x, y, "main 2", marks, ("1", "2"))
    assert ax.get_aspect() == 1.0 and "0.800" in ax.get_title()
    assert np.hypot(*ax.lines[0].get_data()) == pytest.approx(1.0, rel=1e-12)
    pieces = np.array(line.get_segments())
    assert pieces[:, 0] == pytest.approx(np.column_stack([x, y])) and np.array_equal(pieces[-1, 1], pieces[0, 0])
    assert np.asarray(line.get_array()) == pytest.approx(2.0 * np.arange(360)) and line.get_clim() == (0.0, 720.0)
    # the colour at the end of the cycle is that of its start
    assert line.cmap(0.0) == pytest.approx(line.cmap(1.0), abs=0.02)
    points = [tuple(np.ravel(mark.get_data())) for mark in ax.lines if len(mark.get_xdata()) == 1]
    assert np.sort(points, axis=0) == pytest.approx(np.sort([(x[k], y[k]) for k in marks.values()], axis=0), abs=1e-12)
    assert {text.get_text() for text in ax.texts} == {"1", "2"}


def test_least_films_name_their_least_value(ax):
    angle = np.arange(2.0, 720.0, 4.0)
    films = {"main 1": 1e-6 * (8.0 + np.cos(np.radians(angle))), "main 2": np.where(angle == 122.0, 2.5e-6, 9e-6)}
    plots.plot_least_films(ax, angle, films, [0.0, 240.0, 480.0], 1e-6)
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels == ["main 1: 7.00 µm", "main 2: 2.50 µm", "asperities touch"]
    assert [text.get_text() for text in ax.texts] == ["1", "2", "3"]
    least = [np.ravel(mark.get_data()) for mark in ax.lines if mark.get_marker() == "v"]
    assert least[1] == pytest.approx([122.0, 2.5])
    assert ax.get_xlim() == (0.0, 720.0) and ax.get_ylabel() == "least film / µm"


@pytest.fixture
def run():
    """A run whose second cycle ends 2° behind the full one; big ends float."""
    engine = load_engine("diesel_i6")
    angle = np.linspace(0.0, 8.0 * np.pi, 577) - math.radians(2.0)
    outputs = {"pulley.torsion": 0.01 * np.sin(3.0 * angle)}
    outputs |= {f"bearing[{i}].force.{axis}": np.cos(angle) for i in range(1, 8) for axis in "xy"}
    for family, count, clearance in (("bearing", 7, 4e-5), ("big_end", 6, 3e-5)):
        for i in range(1, count + 1):
            x, y = 0.6 * clearance * np.sin(angle + i), 0.3 * clearance * np.cos(angle / 2)
            eps = np.hypot(x, y) / clearance
            outputs |= {f"{family}[{i}].position.x": x, f"{family}[{i}].position.y": y}
            outputs |= {f"{family}[{i}].eccentricity": eps, f"{family}[{i}].film_thickness_min": clearance * (1 - eps)}
    return engine, SimpleNamespace(angle=angle, outputs=outputs)


def test_orbits_of_mains_and_big_ends_begin_at_crank_angle_0(run):
    engine, data = run
    figure = figures.orbit_figure(data, engine, "six at 2000 rev/min")
    circles = [ax for ax in figure.axes if ax.get_title()]
    assert [ax.get_title().split("   ")[0] for ax in circles] == [
        *(f"main {i}" for i in range(1, 8)),
        *(f"big end {i}" for i in range(1, 7)),
    ]
    ring = next(mark for mark in circles[0].lines if mark.get_markersize() == 8.0)
    clearance = engine.main_bearing.clearance
    expected = [0.6 * 4e-5 / clearance * math.sin(1.0), 0.3 * 4e-5 / clearance]
    # half a degree between samples
    assert np.ravel(ring.get_data()) == pytest.approx(expected, abs=0.005)
    # a main is marked by the cylinders beside it, a big end by its own
    assert [[text.get_text() for text in circles[k].texts] for k in (0, 1, 6, 7)] == [["1"], ["1", "2"], ["6"], ["1"]]


def test_rigid_big_ends_have_no_orbit_and_no_film(run, tmp_path):
    engine, data = run
    for i in range(1, 7):
        data.outputs[f"big_end[{i}].eccentricity"][:] = 0.0
    assert sum(bool(ax.get_title()) for ax in figures.orbit_figure(data, engine, "").axes) == 7
    assert len(figures.film_figure(data, engine, "").axes) == 1
    written = figures.save_run_pictures(tmp_path, data, engine, "title", True)
    pictures = ["pulley_torsion.png", "main_loads.png", "orbits.png", "least_films.png"]
    assert [path.name for path in written] == pictures
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(pictures)
    assert all(path.read_bytes()[:4] == b"\x89PNG" for path in written)


def test_torsion_is_drawn_in_degrees_and_loads_are_resultants(run):
    """Sizes of one cycle: peak to peak of the curve is that of the output, the top of a load that of both forces."""
    engine, data = run
    cycle = 0.01 * np.sin(np.linspace(0.0, 12.0 * np.pi, 720, endpoint=False))  # order 3
    figure = figures.motion_figure(cycle, "pulley.torsion", "rad", "six, 2000 rev/min")
    above, below = figure.axes
    assert np.ptp(above.lines[1].get_ydata()) == pytest.approx(np.degrees(0.02), rel=1e-4)
    x, y = above.lines[-1].get_data()
    assert (x[0], x[-1]) == (0.0, 720.0) and y[0] == y[-1] and "1.15 deg peak to peak" in above.get_title(loc="left")
    assert above.get_ylabel() == "pulley.torsion / deg" and below.get_ylabel() == "pulley.torsion, zero to peak / deg"
    assert len(below.texts) == 3 and "3" in {text.get_text() for text in below.texts}
    heights = {round(bar.get_x() + 0.5 * bar.get_width(), 3): bar.get_height() for bar in below.patches}
    assert heights[3.0] == pytest.approx(np.degrees(0.01)) == pytest.approx(sum(heights.values()))
    assert figure.get_suptitle() == "six, 2000 rev/min"
    for i in range(1, 8):
        data.outputs[f"bearing[{i}].force.x"] = np.full(data.angle.size, 3000.0 * i)
        data.outputs[f"bearing[{i}].force.y"] = np.full(data.angle.size, -4000.0 * i)
    lines = figures.load_figure(data, engine, "six").axes[0].lines
    assert [line.get_ydata().max() for line in lines[:7]] == pytest.approx([5.0 * i for i in range(1, 8)])


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("keep me")
    with pytest.raises(InputError, match=r"notes\.txt: cannot be written to; name another folder"):
        figures.check_folder(tmp_path / "notes.txt")
    figures.check_folder(tmp_path / "new" / "pictures")
    assert (tmp_path / "new" / "pictures").is_dir()


@pytest.mark.parametrize("mains", [2, 3, 7])
def test_no_text_leaves_the_picture_of_orbits(run, mains):
    """Pictures are as wide as their circles; notes and titles take as many lines as they need."""
    engine, data = run
    for i in range(1, 7):
        data.outputs[f"big_end[{i}].eccentricity"][:] = 0.0
    widths = engine.crankshaft.main_widths[:mains]
    few = dataclasses.replace(engine, crankshaft=dataclasses.replace(engine.crankshaft, main_widths=widths))
    figure = figures.orbit_figure(data, few, "a single of a long name at 6500 rev/min, all films solved online")
    assert outside(figure) == []


def outside(figure):
    """Texts of a figure, as drawn, that reach over its edges."""
    FigureCanvasAgg(figure).draw()
    texts = [*figure.texts, *(ax.title for ax in figure.axes)]
    box = figure.bbox
    found = [(text.get_text(), text.get_window_extent()) for text in texts]
    return [text for text, e in found if e.x0 < box.x0 or e.x1 > box.x1 or e.y0 < box.y0 or e.y1 > box.y1]
