"""Results as people use them: short texts, units, data frames, pictures; arrays stay arrays."""

import pickle
import re
import sys

import numpy as np
import pytest
from some import some

import cranktrain as ct
from cranktrain.core.errors import StoreError
from cranktrain.results.views.found import VerbResult
from cranktrain.results.views.plot_data import Series
from cranktrain.store.hdf5 import write_result

NAME = "pulley.torsion"
LINES = 10


@pytest.fixture(scope="module")
def run():
    return ct.simulate("single_petrol", speed_rpm=4000, cycles=2, crank="torsional", inherit=False)


@pytest.fixture(scope="module")
def run_up():
    choices = {"crank": "torsional", "method": "linear", "inherit": False}
    return ct.runup("single_petrol", from_rpm=4000, to_rpm=8000, step_rpm=500, **choices)


@pytest.fixture(scope="module")
def diagram():
    return ct.campbell("single_petrol", crank="beam", from_rpm=2000, to_rpm=8000)


@pytest.fixture(scope="module")
def modes():
    return ct.modal("single_petrol", crank="beam")


def test_texts_are_short_say_what_was_run_and_tables_are_of_a_notebook(run, run_up, diagram, modes):
    for found in (run, run_up, diagram, modes):
        text, page = repr(found), found._repr_html_()
        assert len(text.splitlines()) < LINES and all(len(line) < 160 for line in text.splitlines())
        assert page.startswith("<table>") and page.count("<tr>") >= 2 and len(page) < 5000
    assert "single_petrol, 4000 rev/min, crank torsional" in repr(run) and run.settling.text in repr(run)
    assert "4000 to 8000 rev/min" in repr(run_up) and "deg at" in repr(run_up)
    assert diagram.names[0] in repr(diagram) and repr(modes).startswith("<modal, ")


def test_a_series_is_in_any_unit(run):
    torsion = run[NAME]
    assert torsion.unit == "rad"
    assert np.allclose(torsion.to("deg"), np.degrees(run.outputs[NAME]), rtol=1e-14)
    assert np.allclose(torsion.to("deg").to("rad"), run.outputs[NAME], rtol=1e-14) and torsion.to("deg").unit == "deg"
    speed = run["crank.speed"]
    assert np.mean(speed.to("rev/min")) == pytest.approx(4000, rel=0.02)
    assert np.allclose(run["shaft.torque"].to("lbf ft"), run.outputs["shaft.torque"] / 1.3558179483314004)
    celsius = Series(np.array([0.0, 100.0]), "degC", "oil")
    assert np.allclose(celsius.to("K"), [273.15, 373.15]) and np.allclose(celsius.to("K").to("degC"), celsius)
    for unit, told in (("kg", f"'{NAME}' is in rad"), ("wombats", "is not known"), (3, "is not known")):
        with pytest.raises(ct.InputError, match=told):
            torsion.to(unit)
    with pytest.raises(ct.InputError, match="no unit is known"):
        Series(np.zeros(2)).to("m")


def test_a_series_is_the_array_that_it_shows(run):
    """Nothing is copied; what is computed from it is a plain array, as its unit may be another one."""
    torsion, plain = run[NAME], run.outputs[NAME]
    assert type(plain) is np.ndarray and np.shares_memory(torsion, plain) and isinstance(torsion, np.ndarray)
    computed = torsion * torsion, torsion + 1.0, -torsion, np.abs(torsion), np.sqrt(torsion**2), torsion @ torsion
    assert not any(isinstance(one, Series) for one in computed)
    for whole in (np.max, np.min, np.mean, np.std, np.sum, np.ptp, np.linalg.norm):
        assert whole(torsion) == whole(plain) and not isinstance(whole(torsion), Series)
    assert not isinstance(torsion[0], np.ndarray) and torsion[5:].unit == "rad" and torsion.copy().unit == "rad"
    assert np.array_equal(np.fft.rfft(torsion), np.fft.rfft(plain))
    total = np.zeros(plain.size)
    total += torsion
    assert np.array_equal(total, plain) and type(total) is np.ndarray
    doubled = torsion.copy()
    doubled *= 2.0
    assert np.array_equal(doubled, 2.0 * plain) and doubled.unit == "rad"
    again = pickle.loads(pickle.dumps(torsion))
    assert np.array_equal(again, plain) and (again.unit, again.name) == ("rad", NAME)
    assert len(repr(torsion).splitlines()) < LINES


def test_a_run_in_a_data_frame(run):
    frame = run.to_dataframe()
    assert np.array_equal(frame[NAME].to_numpy(), run.outputs[NAME]) and np.array_equal(frame.index, run.time)
    assert frame.attrs["units"][NAME] == "rad" and set(frame.columns) == {"angle", *run.names}
    assert list(run.to_dataframe(NAME).columns) == ["angle", NAME]
    with pytest.raises(ct.InputError, match=f"did you mean '{NAME}'"):
        run.to_dataframe("pulley.torson")


def test_a_run_read_again_is_the_same_in_hand(run, tmp_path):
    again = ct.load_run(run.save(tmp_path / "run.h5"))
    assert np.array_equal(again[NAME], run[NAME]) and again[NAME].unit == "rad"
    assert again.orders(NAME) == run.orders(NAME) and again.title == run.title
    assert len(repr(again).splitlines()) < LINES and again._repr_html_() == run._repr_html_()
    assert set(run.names) <= set(again.names)
    again.plot(NAME, tmp_path / "again.png")
    with pytest.raises(StoreError, match=r"none\.h5"):
        ct.load_run(tmp_path / "none.h5")


def test_a_run_up_in_hand(run_up, tmp_path):
    order, rest = run_up.orders[3], np.abs(run_up.torsion)
    assert np.array_equal(run_up[NAME], rest) and run_up[NAME].unit == "rad"
    assert np.array_equal(run_up[NAME, order], rest[:, 3])
    assert np.allclose(run_up[NAME, order].to("deg"), np.degrees(rest[:, 3]))
    frame = run_up.to_dataframe()
    assert np.allclose(frame.index, run_up.speeds_rpm) and np.array_equal(frame[order].to_numpy(), rest[:, 3])
    again = ct.load_run(run_up.save(tmp_path / "run_up.h5"))
    assert np.array_equal(again.torsion, run_up.torsion) and again.names == run_up.names
    for place, told in (("pulley.torson", "did you mean"), ((NAME, 99.0), "order 99 is not in this run-up")):
        with pytest.raises(ct.InputError, match=told):
            run_up[place]
    with pytest.raises(ct.InputError, match="order 99 is not in"):
        run_up.plot(orders=[99])


def test_a_diagram_in_hand(diagram):
    frame = diagram.to_dataframe()
    assert list(frame.columns) == list(diagram.names) and np.array_equal(frame.to_numpy(), diagram.hz)
    assert np.allclose(frame.index, np.linspace(2000, 8000, len(frame)))
    # The drive line's own mode hardly depends on the speed; bending in turning axes splits.
    assert np.ptp(frame["drive line"]) < 0.01 * frame["drive line"].mean()
    assert np.ptp(frame["bending 1"]) > 0.1 * frame["bending 1"].mean()


def test_modes_in_hand(modes):
    frame = modes.to_dataframe()
    assert frame["hz"].tolist() == [one["hz"] for one in modes["cranktrain"]["modes"]]
    assert modes.to_dataframe("drive_line.modes")["hz"][0] == modes["drive_line"]["modes"][0]["hz"]
    assert isinstance(modes, dict) and modes["level"] == "beam"
    with pytest.raises(ct.InputError, match=r"no table 'cranktrain\.mode'; did you mean 'cranktrain\.modes'"):
        modes.to_dataframe("cranktrain.mode")


@pytest.mark.parametrize("name", ["run", "run_up", "diagram", "modes"])
def test_pictures_and_interactive_ones(name, request, tmp_path):
    found, path = request.getfixturevalue(name), tmp_path / f"{name}.png"
    figure = found.plot(path=path)
    assert path.stat().st_size > 10_000 and figure._repr_png_().startswith(b"\x89PNG")
    labels = " ".join(ax.get_xlabel() + ax.get_ylabel() for ax in figure.axes)
    assert re.search(r"rev/min|deg|mode", labels) and re.search(r"/ (deg|rad|Hz)", labels)
    bokeh = pytest.importorskip("bokeh.plotting")
    figure = found.iplot()
    assert isinstance(figure, bokeh.figure) and "/" in figure.yaxis[0].axis_label
    for line in some(figure.renderers):
        assert line.name and len(line.data_source.data["x"]) == len(line.data_source.data["y"]) > 1


def test_an_interactive_picture_needs_one_unit_and_bokeh(run, monkeypatch):
    with pytest.raises(ct.InputError, match="outputs of one unit"):
        run.iplot(NAME, "shaft.torque")
    monkeypatch.setitem(sys.modules, "bokeh.plotting", None)
    with pytest.raises(ct.InputError, match=r"iplot needs bokeh; pip install bokeh, or cranktrain\[explore\]"):
        run.iplot()


def test_xarray_holds_units_and_axes(run, run_up, diagram):
    pytest.importorskip("xarray")
    assert run.to_xarray()[NAME].attrs["units"] == "rad"
    orders = run_up.to_xarray()
    assert orders[NAME].dims == ("speed_rpm", "order") and np.array_equal(orders[NAME], run_up.torsion)
    hz = diagram.to_xarray()
    assert hz.dims == ("speed_rpm", "mode") and np.array_equal(hz.sel(mode=diagram.names[0]), diagram.hz[:, 0])


def test_tables_within_records_are_one_table():
    mains = [[{"name": f"main[{k}]", "load_kn": 10.0 * speed + k} for k in (1, 2)] for speed in (1, 2)]
    speeds = [{"name": f"run {s}", "rpm": 1000 * s, "power_w": {"all": 5.0}, "mains": mains[s - 1]} for s in (1, 2)]
    found = VerbResult.of({"speeds": speeds}, "bearing-loads")
    assert list(found.tables) == ["speeds", "speeds.mains"]
    assert found.to_dataframe().columns.tolist() == ["name", "rpm", "power_w.all"]
    frame = found.to_dataframe("speeds.mains")
    assert frame["rpm"].tolist() == [1000, 1000, 2000, 2000] and frame["load_kn"].tolist() == [11.0, 12.0, 21.0, 22.0]
    assert frame["speeds.name"].tolist() == ["run 1", "run 1", "run 2", "run 2"]
    assert frame["name"].tolist() == ["main[1]", "main[2]"] * 2


def test_a_coupled_run_is_read_over_the_crank_that_it_has(tmp_path):
    time = np.linspace(0.0, 0.12, 1441)
    angle = 4.0 * np.pi * time / 0.06
    own = {"cranktrain/crank.angle": (angle, "rad"), "cranktrain/pulley.torsion": (0.1 * np.sin(0.5 * angle), "rad")}
    attributes = {"engine": "single", "speed_rpm": 2000.0, "scheme": "jacobi"}
    write_result(tmp_path / "a.h5", {"time": (time, "s"), **own}, attributes)
    found = ct.load_run(tmp_path / "a.h5")
    assert found.orders("cranktrain/pulley.torsion")[0.5] == pytest.approx(0.1, rel=1e-6)
    assert found["cranktrain/pulley.torsion"].to("deg").max() == pytest.approx(np.degrees(0.1), rel=1e-6)
    assert "single, 2000 rev/min, coupled by jacobi" in repr(found)
    write_result(tmp_path / "b.h5", {"time": (time, "s"), "mass/place": (time, "m")}, attributes)
    with pytest.raises(StoreError, match=r"no unit has recorded its crank\.angle"):
        ct.load_run(tmp_path / "b.h5")
