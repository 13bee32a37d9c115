"""Several results in one picture: whose curve is which, what is drawn, and what is refused in one line."""

import math

import numpy as np
import pytest

from cranktrain.cli.main import main
from cranktrain.results import overlays
from cranktrain.results.overlays import check_overlaid, cycle_overlay, file_name, legend_names, order_overlay
from cranktrain.results.run_up.run_up import TORSION, RunUp
from cranktrain.results.views.loaded import LoadedRun

LEVELS = {"crank": "solid", "bearings": "linear", "step": math.radians(5.0)}


def run_up(engine="my_four", hz=238.0, size=0.01, **attributes):
    """Orders 3, 6 and 9 meet a mode; order 0.5 is large and no resonance."""
    speeds, orders = np.linspace(800.0, 5800.0, 101) * math.pi / 30.0, np.array([0.5, 3.0, 6.0, 9.0])
    ratio = np.outer(speeds, orders) / (2.0 * math.pi * hz)
    response = size / (1.0 - ratio**2 + 0.1j * ratio) / orders
    response[:, 0] = 20.0 * size * (speeds[0] / speeds) ** 2
    none = np.zeros(speeds.size, dtype=int)
    return RunUp(
        speeds=speeds, orders=orders, amplitudes={TORSION: response}, extremes={}, cycles=none, repeats=none,
        left=0.0 * speeds, attributes={"engine": engine, **LEVELS, **attributes},
    )  # fmt: skip


def run(rpm=3000.0, size=0.01, engine="my_four", **attributes):
    """One cycle of order 2, and of a force."""
    angle = np.linspace(0.0, 4.0 * math.pi, 721)
    speed = rpm * math.pi / 30.0
    outputs = {TORSION: size * np.cos(2.0 * angle), "bearing[1].force.y": 1e3 * np.sin(angle)}
    return LoadedRun(angle / speed, angle, outputs, {"engine": engine, **LEVELS, "speed": speed, **attributes})


def test_a_legend_names_engines_and_what_differs_and_files_where_nothing_does():
    one = {"a/x.h5": run(), "b/x.h5": run(rpm=4000.0, crank="beam")}
    assert legend_names(one) == ["my_four, 3000 rev/min, crank solid", "my_four, 4000 rev/min, crank beam"]
    assert legend_names({"a.h5": run(step=math.radians(2.5)), "b.h5": run()})[0] == "my_four, step 2.5 deg"
    assert legend_names({"a.h5": run_up(), "b.h5": run_up("v8")}) == ["my_four", "v8"]
    assert legend_names({"a.h5": run(), "b.h5": run()}) == ["my_four, a.h5", "my_four, b.h5"]
    assert legend_names({"u/a.h5": run(), "v/a.h5": run()}) == ["my_four, u/a.h5", "my_four, v/a.h5"]


def test_cycles_and_orders_of_runs_are_those_of_their_files_in_degrees():
    figure = cycle_overlay({"a.h5": run(), "b.h5": run(rpm=4000.0, size=0.02)}, TORSION)
    above, apart, below = figure.axes
    heights = [np.ptp(line.get_ydata()) for line in (*above.lines, *apart.lines)]
    np.testing.assert_allclose(heights, np.degrees([0.02, 0.04, 0.02]), rtol=1e-4)
    strongest = [max(bars, key=lambda bar: bar.get_height()) for bars in below.containers]
    np.testing.assert_allclose([bar.get_height() for bar in strongest], np.degrees([0.01, 0.02]), rtol=1e-4)
    assert all(abs(bar.get_x() + 0.5 * bar.get_width() - 2.0) < 0.25 for bar in strongest)


def test_run_ups_have_a_panel_for_each_resonant_order_and_a_curve_for_each_file():
    made = {"a.h5": run_up(), "b.h5": run_up("other", hz=280.0, size=1e-4)}
    figure = order_overlay(made, TORSION, log=True)
    assert [ax.get_title(loc="left") for ax in figure.axes] == ["order 0.5", "order 3", "order 6", "order 9"]
    for ax, order in zip(figure.axes[1:], (3.0, 6.0, 9.0), strict=True):
        assert ax.get_yscale() == "log"
        *curves, apart = ax.lines
        assert apart.get_label() == "difference"
        for line, hz in zip(curves, (238.0, 280.0), strict=True):
            peak = line.get_xdata()[np.argmax(line.get_ydata())]
            assert peak == pytest.approx(60.0 * hz / order, abs=50.0)
    few = order_overlay(made, TORSION, [6.0], peak_to_peak=True).axes
    assert len(few) == 1
    np.testing.assert_allclose(few[0].lines[0].get_ydata(), 2.0 * np.degrees(np.abs(made["a.h5"].order(6.0))))


def test_orders_that_are_chosen_are_resonances_of_every_engine(monkeypatch):
    """An engine whose resonances are a thousand times larger does not choose all orders."""
    monkeypatch.setattr(overlays, "PANELS", 2)
    great, small = run_up(size=1.0), run_up("small", size=1e-3)
    great.amplitudes[TORSION][:, 2] = great.amplitudes[TORSION][:, 3] = 0.0  # order 3 alone
    small.amplitudes[TORSION][:, 1] = small.amplitudes[TORSION][:, 3] = 0.0  # order 6 alone
    figure = order_overlay({"a.h5": great, "b.h5": small}, TORSION)
    assert [ax.get_title(loc="left") for ax in figure.axes] == ["order 3", "order 6"]


def test_other_kinds_too_many_files_and_missing_outputs_are_refused():
    for results, outputs, said in (
        ({"a.h5": run(), "b.h5": run_up()}, [TORSION], "b.h5 is a run-up and a.h5 a run at one speed"),
        ({f"{k}.h5": run() for k in range(7)}, [TORSION], "7 files"),
        ({"a.h5": run(), "b.h5": run()}, ["pulley.torsoin"], "a.h5: output 'pulley.torsoin' is not in this result"),
    ):
        with pytest.raises(overlays.InputError, match=said.replace("(", r"\(")):
            check_overlaid(results, outputs)


def test_the_command_lays_files_of_one_kind_over_each_other(tmp_path, capsys):
    up = [str(run_up(engine).save(tmp_path / f"{engine}.h5")) for engine in ("one", "two")]
    assert main(["plot", *up, "--plots", str(tmp_path / "out")]) == 0
    picture = tmp_path / "out" / file_name(TORSION)
    assert capsys.readouterr().out.split() == [str(picture)] and picture.stat().st_size > 1000
    single = str(tmp_path / "single.h5")
    asked = ["--speed", "4000", "--crank", "rigid", "--bearings", "linear", "--cycles", "1", "--output", single]
    assert main(["simulate", "single_petrol", *asked]) == 0
    capsys.readouterr()
    assert main(["plot", single, "--outputs", "bearing[1].force.y", "--plots", str(tmp_path / "out")]) == 0
    assert capsys.readouterr().out.split() == [str(tmp_path / "out" / "overlay_bearing_1_force_y.png")]
    for words, said in (
        ([*up, "--engine", "diesel_i6"], "--engine goes with one run-up"),
        ([up[0], up[0]], "is named twice"),
        ([up[0], single], "is a run-up and"),
        ([single, "--orders", "3"], "--orders goes with run-ups"),
        ([up[0], "--outputs", TORSION], "--outputs goes with several files"),
        ([*up, "--orders", "7"], "order 7 is not in this run-up"),
        ([up[0], str(tmp_path / "none.h5")], "none.h5: no such file"),
    ):
        assert main(["plot", *words, "--plots", str(tmp_path / "new")]) == 2
        [line] = capsys.readouterr().err.splitlines()
        assert said in line
    assert not list((tmp_path / "new").glob("*.png"))
