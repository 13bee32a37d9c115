"""Pictures of a run-up show its data: lines, names of peaks, places of labels; measured orders as they are written."""

import json
import math
import warnings
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest

from cranktrain.cli.main import main
from cranktrain.engine.file import load_engine
from cranktrain.results.bearings.run_up_cycles import bearing_outputs
from cranktrain.results.orders.deviations import deviations
from cranktrain.results.orders.measured import read_measured_orders
from cranktrain.results.orders.modes_over_speed import ModesOverSpeed
from cranktrain.results.orders.resonances import peaks
from cranktrain.results.run_up import figures, peak_figures
from cranktrain.results.run_up import plot_data as shown
from cranktrain.results.run_up.plots import spread
from cranktrain.results.run_up.run_up import AXIAL, FLYWHEEL, TORSION, RunUp, with_twist
from cranktrain.results.views.over_speed import OrdersOverSpeed
from cranktrain.structure.crank.level import crank_body
from cranktrain.studies.campbell import campbell

RPM = math.pi / 30.0
SIX = load_engine("diesel_i6")
MODE_HZ = 238.0
PARTS = ("axial.engine", "axial.bearing", "axial.crank")


def resonance(speeds, order, height, damping=0.01):
    """Order over speed of one mode."""
    r = order * speeds / (2.0 * math.pi * MODE_HZ)
    return 2.0 * damping * height / (1.0 - r**2 + 2j * damping * r)


@pytest.fixture(scope="module")
def run_up():
    """Orders 6 and 9 in resonance with one mode, axial motion of order 3 and its parts."""
    speeds, orders = np.linspace(1400.0, 2600.0, 121) * RPM, 0.5 * np.arange(1, 25)
    torsion = np.zeros((speeds.size, orders.size), dtype=complex)
    for order, height in ((6.0, 0.02), (9.0, 0.005)):
        torsion[:, round(2.0 * order) - 1] = resonance(speeds, order, height)
    parts = {name: np.zeros_like(torsion) for name in PARTS}
    for k, part in enumerate(parts.values()):
        part[:, 5] = (k + 1) * 1e-5j
    axial = {AXIAL: sum(parts.values())}
    cycles = np.ones(speeds.size, dtype=int)
    attributes = {"engine": "diesel_i6", "crank": "torsional", "damper": "none"}
    extremes = {TORSION: np.zeros((speeds.size, 3))}
    return RunUp(speeds, orders, {TORSION: torsion} | axial | parts, extremes, cycles, cycles, 0.0 * speeds, attributes)


@pytest.fixture(scope="module")
def modes(run_up):
    """One torsional mode whose frequency does not change."""
    speeds = run_up.speeds[[0, -1]]
    return ModesOverSpeed(speeds, np.full((2, 1), MODE_HZ), ("torsional 1",), ("torsional",), np.ones((1, 1)))


def texts(figure):
    return [text.get_text() for ax in figure.axes for text in ax.texts]


@pytest.fixture(scope="module")
def motion(run_up):
    """The peaks with a torsional mode in motion."""
    return [replace(peak, motion_hz=238.6) for peak in peaks(run_up)]


def of_orders(run_up, **beside):
    return figures.order_figure(run_up, shown.TORSIONAL, shown.Beside(**beside), "six")


def lines_of(figure):
    return {line.get_label(): line for line in figure.axes[0].lines}


def test_peaks_are_named_by_order_speed_and_mode_in_motion(run_up, modes, motion):
    """Without a mode in motion by their own frequency; modes at rest are named in Campbell's diagram alone."""
    figure = of_orders(run_up, engine=SIX, modes=modes, motion=motion)
    assert any(text.startswith("6: 2380 rev/min\nin motion 239 Hz") for text in texts(figure))
    assert any(text.startswith("9: 158") and "in motion" in text for text in texts(figure))
    line = lines_of(figure)["6"]
    np.testing.assert_allclose(line.get_ydata(), np.degrees(np.abs(run_up.order(6.0))))
    np.testing.assert_allclose(line.get_xdata(), run_up.speeds_rpm)
    published = [line.get_xdata()[0] for line in figure.axes[0].lines if line.get_marker() == "^"]
    assert sorted(published) == pytest.approx([1587.0, 1904.0, 2197.0, 2380.0], abs=1.0)
    at_rest = texts(of_orders(run_up, modes=modes))
    assert "6: 2380 rev/min\n238 Hz" in at_rest and not any("torsional" in text for text in at_rest)
    figure = figures.campbell_figure(run_up, shown.Beside(SIX, modes, motion=motion), "six")
    assert "at rest on stand-in springs" in figure.get_suptitle()
    assert any(text.startswith("torsional 1 at rest") for text in texts(figure))
    assert set(lines_of(figure)["torsional in motion"].get_ydata()) == {238.6}


def test_peaks_without_a_period_are_named_as_those_of_a_mean_cycle(run_up):
    repeats = np.where(run_up.speeds_rpm > 2300.0, 0, 1)
    figure = of_orders(replace(run_up, repeats=repeats))
    assert "6: 2380 rev/min\n238 Hz, mean cycle" in texts(figure)
    assert ["mean cycle" in text for text in texts(figure) if text.startswith("9:")] == [False]
    shaded = [patch for patch in figure.axes[0].patches if patch.get_width() < 50.0]
    assert len(shaded) == np.count_nonzero(repeats == 0) and "Shaded" in figure.texts[-1].get_text()


def test_measured_orders_lie_over_the_computed_ones(run_up, tmp_path):
    """Of a speed that is measured twice both points, and the mean as the bar beside the computed orders."""
    place, _ = peak_figures.peak_speeds(run_up, shown.TORSIONAL)[0]
    rpm, path = float(run_up.speeds_rpm[place]), tmp_path / "measured.csv"
    rows = f"{rpm!r}, 6, 1.5, deg\n{rpm!r}, 6, 0.5, deg\n1900, 6, 0.1, deg\n1800, 3, 55, µm\n"
    path.write_text(f"speed_rpm, order, amplitude, unit\n{rows}")
    measured = read_measured_orders(path)
    assert measured[AXIAL][3.0][1] == pytest.approx([55e-6])
    [dots] = [
        line for line in of_orders(run_up, engine=SIX, measured=measured).axes[0].lines if line.get_marker() == "o"
    ]
    np.testing.assert_allclose(sorted(np.transpose(dots.get_data()).tolist()), [(rpm, 0.5), (rpm, 1.5), (1900.0, 0.1)])
    ax = figures.harmonic_figure(run_up, shown.TORSIONAL, shown.Beside(SIX, None, measured), "six").axes[0]
    assert any("measured" in text.get_text() for text in ax.get_legend().texts)
    assert np.nanmax([bar.get_height() for bar in ax.containers[-1]]) == pytest.approx(1.0)


def test_axial_motion_is_shown_over_the_angle_by_harmonics_and_in_parts(run_up):
    line = figures.history_figure(run_up, shown.ALONG, "six").axes[0].lines[0]
    expected = 60.0 * (1j * np.exp(3j * np.radians(line.get_xdata()))).real
    np.testing.assert_allclose(line.get_ydata(), expected, atol=1e-9)
    ax = figures.harmonic_figure(run_up, shown.ALONG, shown.Beside(), "six").axes[0]
    assert [text.get_text() for text in ax.get_legend().texts] == ["pulley", "crank", "bearing", "engine"]
    heights = [max(bar.get_height() for bar in container) for container in ax.containers]
    assert heights == pytest.approx([60.0, 30.0, 20.0, 10.0])
    axes = figures.parts_figure(run_up, shown.ALONG, shown.Beside(), "six").axes
    tops = [max(float(np.max(line.get_ydata())) for line in ax.lines) for ax in axes]
    assert tops == pytest.approx([30.0, 20.0, 10.0])


def test_orders_that_are_asked_for_stand_alone_peak_to_peak_and_on_a_logarithmic_scale(run_up):
    beside = shown.Beside(orders=(6.0, 99.0), log=True)
    [ax] = figures.order_figure(run_up, shown.TORSIONAL.peak_to_peak, beside, "six").axes
    assert [line.get_label() for line in ax.lines] == ["6"] and ax.get_yscale() == "log"
    np.testing.assert_allclose(ax.lines[0].get_ydata(), 2.0 * np.degrees(np.abs(run_up.order(6.0))))
    assert ax.get_ylabel() == "torsion of the pulley, peak to peak / deg"


@pytest.fixture(scope="module")
def uneven(run_up):
    """The same resonances under order 2 of a light crank that turns unevenly as a whole, Ω⁻²."""
    torsion = run_up.torsion.copy()
    torsion[:, 3] += 40.0 * (run_up.speeds[0] / run_up.speeds) ** 2 * np.abs(torsion).max()
    return replace(run_up, amplitudes={TORSION: torsion})


def test_the_scale_is_logarithmic_where_resonances_drown_and_as_it_is_asked_for(run_up, uneven):
    """The resonance is a fortieth of the largest amplitude: 6 points of a linear axis, half of one of three decades."""
    for data, log, scale in ((run_up, None, "linear"), (uneven, None, "log"), (uneven, False, "linear")):
        assert of_orders(data, log=log).axes[0].get_yscale() == scale
    assert of_orders(uneven, orders=(6.0, 9.0)).axes[0].get_yscale() == "linear"
    norm = figures.map_figure(uneven, shown.TORSIONAL, shown.Beside(), "six", 300.0).axes[0].collections[0].norm
    assert norm.vmax / norm.vmin == pytest.approx(1000.0)


@pytest.mark.parametrize("log", [False, True])
def test_a_waterfall_lies_at_frequency_and_speed(uneven, log):
    """As high as the amplitude over the largest, of seven steps, on a logarithmic scale of three steps and decades."""
    figure = figures.waterfall_figure(uneven, shown.TORSIONAL, shown.Beside(log=log), "six", 300.0)
    sizes, step = np.abs(uneven.torsion), np.diff(uneven.speeds_rpm)[0] * 3
    line = figure.axes[0].lines[0]  # of the highest speed that is drawn
    [at] = np.flatnonzero(np.isclose(line.get_xdata(), 2.0 * uneven.speeds_rpm[-1] / 60.0))
    share = sizes[-1, 3] / sizes[::3].max()
    height = 3.0 + math.log10(share) if log else 7.0 * share
    assert (line.get_ydata()[at] - uneven.speeds_rpm[-1]) / step == pytest.approx(height, rel=1e-6)
    assert np.all(line.get_ydata() >= uneven.speeds_rpm[-1] - 1e-9)


def test_twist_is_drawn_with_the_range_of_all_its_orders(run_up):
    """A flywheel that follows the pulley but for order 6 leaves this order alone in the twist."""
    flywheel = np.where(run_up.orders == 6.0, 0.0, run_up.torsion)
    both = with_twist(replace(run_up, amplitudes={TORSION: run_up.torsion, FLYWHEEL: flywheel}))
    figure = figures.order_figure(both, shown.TWISTING, shown.Beside(), "six")
    lines = lines_of(figure)
    np.testing.assert_allclose(lines["6"].get_ydata(), np.degrees(np.abs(run_up.order(6.0))))
    np.testing.assert_allclose(lines["all"].get_ydata(), lines["6"].get_ydata(), rtol=1e-4)
    assert "Black: all orders together" in figure.texts[-1].get_text()


@pytest.mark.parametrize("log", [False, True])
def test_a_colour_map_has_the_orders_and_their_frequencies(run_up, log):
    figure = figures.map_figure(run_up, shown.TORSIONAL, shown.Beside(log=log), "six", 300.0)
    left, right = (ax.collections[0].get_array().reshape(-1, figures.MAP_COLUMNS) for ax in figure.axes[:2])
    top = np.unravel_index(left.argmax(), left.shape)
    assert run_up.orders[top[0]] == 6.0
    speeds, hz = np.linspace(*run_up.speeds[[0, -1]], left.shape[1]), np.linspace(0.0, 300.0, figures.MAP_ROWS)
    found = np.unravel_index(right.argmax(), right.shape)
    assert found[1] == top[1]
    assert abs(hz[found[0]] / (6.0 * speeds[top[1]] / (2.0 * math.pi)) - 1.0) < 0.25 / 6.0 + 0.01


def test_labels_are_spread_in_their_sequence():
    wanted = [5.0, 5.1, 1.0, 9.9]
    places = spread(wanted, 1.0, 0.0, 10.0)
    assert np.argsort(places).tolist() == np.argsort(wanted).tolist() and np.diff(np.sort(places)).min() >= 1.0 - 1e-12
    assert np.diff(np.sort(spread([5.0] * 6, 4.0, 0.0, 10.0))) == pytest.approx(2.0)


def test_orders_meet_modes_at_critical_speeds(modes):
    found = modes.crossings([6.0, 9.0, 12.0], "torsional")
    assert [(crossing.order, crossing.mode) for crossing in found] == [(9.0, "torsional 1"), (6.0, "torsional 1")]
    for crossing in found:
        assert crossing.speed / RPM == pytest.approx(60.0 * MODE_HZ / crossing.order)
    assert modes.nearest(6.0, 2300.0 * RPM).speed / RPM == pytest.approx(2380.0)
    assert modes.nearest(6.0, 2300.0 * RPM, "axial") is None


def test_modes_of_an_elastic_crank_are_followed_by_their_shapes():
    """Where frequencies veer shapes change with the speed: the criterion misses one by the square of the step."""
    body = crank_body(SIX, "beam")
    coarse, fine = (campbell(SIX, body, np.linspace(1800.0, 2400.0, n) * RPM, "beam", 500.0) for n in (5, 9))
    assert {"bending", "torsional", "axial", "drive line"} == set(fine.kinds)
    np.testing.assert_allclose(coarse.hz, fine.hz[::2], rtol=1e-9)
    missed = [1.0 - found.agreement.min() for found in (coarse, fine)]
    assert missed[0] < 0.1 and 3.0 < missed[0] / missed[1] < 5.0


def test_verb_draws_a_file_and_says_what_it_lacks(run_up, tmp_path, capsys):
    strange = replace(run_up, attributes=dict(run_up.attributes) | {"engine": "gone"})
    path = strange.save(tmp_path / "up.h5")
    assert main(["plot", str(path), "--plots", str(tmp_path / "out")]) == 0
    said = capsys.readouterr()
    assert "no Campbell diagram" in said.err and "--engine" in said.err
    names = {place.name for place in (tmp_path / "out").iterdir()}
    assert {"torsion_orders.png", "axial_orders.png", "waterfall.png", "axial_harmonics.png"} <= names
    assert names <= set(figures.file_names())


def complete_run_up(run_up):
    """The run-up with twist, journals and rods as well, so that every picture of the register is drawn."""
    own = {FLYWHEEL: 0.1 * run_up.torsion}
    names = bearing_outputs(SIX)
    own |= {name: np.full_like(run_up.torsion, 1e-6) for name in names if name not in run_up.amplitudes}
    extremes = {name: np.tile([0.5, 1.0, 2.0], (run_up.speeds.size, 1)) * 1e-6 for name in [*names, AXIAL]}
    return replace(run_up, amplitudes=dict(run_up.amplitudes) | own, extremes=dict(run_up.extremes) | extremes)


def with_gaps(run_up, rows):
    """The run-up without a result at some speeds, as an unsettled speed leaves it."""
    lost = {name: own.copy() for name, own in run_up.amplitudes.items()}
    extremes = {name: own.copy() for name, own in run_up.extremes.items()}
    for own in (*lost.values(), *extremes.values()):
        own[rows] = math.nan
    return replace(run_up, amplitudes=lost, extremes=extremes)


@pytest.mark.parametrize(("rows", "log"), [([0, 60], False), ([97, 98, 120], True), (slice(None), False)])
def test_a_speed_without_a_result_is_a_gap_in_every_picture(run_up, modes, tmp_path, rows, log):
    """Row 98 is the resonance of order 6. All other speeds are drawn, to finite axes; without any they are empty."""
    whole = complete_run_up(run_up)
    lost = with_gaps(whole, rows)
    (tmp_path / "measured.csv").write_text("speed_rpm, order, amplitude, unit\n2380, 6, 1.1, deg\n1900, 6, 0.1, deg\n")
    measured = read_measured_orders(tmp_path / "measured.csv")
    rpm = lost.speeds_rpm
    entry = {
        "shaft": "crank", "diameter_mm": 80.0, "section": "plain", "barred_rpm": None,
        "stress_mpa": np.degrees(np.abs(lost.order(6.0))), "continuous_mpa": 40.0 + 0.0 * rpm,
        "transient_mpa": 60.0 + 0.0 * rpm,
    }  # fmt: skip
    beside = shown.Beside(SIX, modes, measured, peaks(lost), [entry], log=log)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        drawn = figures.save_run_up_pictures(tmp_path, lost, beside, "six", damped=lost)
        deviations(lost, measured)
    assert {path.name for path in drawn} == set(figures.file_names())
    figure = figures.order_figure(lost, shown.TORSIONAL, beside, "six")
    line = lines_of(figure)["6"]
    assert np.isfinite([*figure.axes[0].get_xlim(), *figure.axes[0].get_ylim()]).all()
    wanted = np.degrees(np.abs(whole.order(6.0)))
    wanted[rows] = math.nan
    np.testing.assert_allclose(line.get_ydata(), wanted)


@pytest.mark.parametrize("rows", [[60], [-1]])
def test_a_speed_without_a_result_is_a_gap_in_hand_and_in_bearing_loads(run_up, tmp_path, rows, capsys):
    lost = with_gaps(complete_run_up(run_up), rows)
    in_hand = OrdersOverSpeed.of(lost)
    in_hand.plot(path=tmp_path / "orders.png")
    assert "order 6" in repr(in_hand)
    if find_spec("bokeh"):
        assert [line.name for line in in_hand.iplot().renderers][-1].startswith("order")
    path = lost.save(tmp_path / "up.h5")
    assert (
        main(["bearing-loads", "diesel_i6", "--run-up", str(path), "--plots", str(tmp_path / "loads"), "--json"]) == 0
    )
    told = capsys.readouterr()
    assert len(json.loads(told.out)["speeds"]) == lost.speeds.size - 1
    assert f"no result at {lost.speeds_rpm[rows[0]]:.0f} rev/min" in told.err
