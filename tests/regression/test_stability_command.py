"""The verb ``stability``: its JSON, its pictures, what it keeps and what it refuses. A map of two by three cells."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cranktrain.cli.main import main
from cranktrain.store import kept
from cranktrain_lab import stability
from cranktrain_lab.stability import kept_maps
from cranktrain_lab.stability.draw import shown_deviation
from cranktrain_lab.stability.stability_map import (
    Axis,
    Boundary,
    StabilityMap,
    as_record,
    bisected,
    deviation,
    from_record,
)


def small(measure=True):
    return StabilityMap(
        name="small",
        title="A small map",
        rows=Axis("stiffness", "N/m", np.array([1e3, 1e5]), log=True),
        columns=Axis("step", "deg", np.array([1.0, 2.0, 4.0])),
        stable=np.array([[True, True, False], [True, False, False]]),
        measure=np.array([[0.1, 0.5, np.nan], [0.7, 1.1, 3.0]]) if measure else None,
        measure_label="spectral radius",
        theory=(Boundary("bound", np.array([[3.0, 1e3], [1.5, 1e5]]), "closed form"),),
        numerical=(Boundary("bound", np.array([[3.01, 1e3], [1.49, 1e5]]), "bisection"),),
        max_deviation=0.007,
        explanation="It fails.\nTake shorter steps.",
    )


@pytest.fixture
def calls(monkeypatch, tmp_path):
    """Three maps that count how often they are computed; the second can be told to fail."""
    made = {"first": 0, "second": 0, "third": 0, "fail": False}

    def maker(name):
        def compute(quick, progress):
            progress("half", 0.5)
            if made["fail"] and name == "second":
                raise KeyboardInterrupt
            made[name] += 1
            record = as_record(small(measure=name != "third"))
            return from_record(name, record)

        return compute

    # In place, for modules that are imported while the test runs.
    for name in list(stability.MAPS):
        monkeypatch.delitem(stability.MAPS, name)
    for name in ("first", "second", "third"):
        monkeypatch.setitem(stability.MAPS, name, maker(name))
    monkeypatch.setattr(kept_maps, "map_digest", lambda name: name)
    monkeypatch.setattr(kept, "cache_folder", lambda: tmp_path / "cache")
    return made


def run(tmp_path, *options):
    return main(["stability", "--workers", "1", "--output", str(tmp_path / "out"), *options])


def test_json_holds_every_map_with_its_picture(calls, tmp_path, capsys):
    assert run(tmp_path, "--json") == 0
    maps = json.loads(capsys.readouterr().out)["maps"]
    assert list(maps) == ["first", "second", "third"]
    first = maps["first"]
    assert first["axes"]["rows"] == {"name": "stiffness", "unit": "N/m", "values": [1e3, 1e5], "log": True}
    assert first["stable"] == [[True, True, False], [True, False, False]]
    assert first["measure"][0][2] is None
    assert first["theory"][0]["points"] == [[3.0, 1e3], [1.5, 1e5]]
    assert first["max_deviation"] == 0.007
    for name in maps:
        assert (tmp_path / "out" / f"{name}.png").read_bytes()[:4] == b"\x89PNG"
        assert b"<svg" in (tmp_path / "out" / f"{name}.svg").read_bytes()
    assert len(list((tmp_path / "out").iterdir())) == 6


def test_one_map_by_name_and_a_table_for_people(calls, tmp_path, capsys):
    assert run(tmp_path, "--map", "second") == 0
    shown = capsys.readouterr().out
    assert "second" in shown and "0.7 %" in shown and "Take shorter steps." in shown
    assert calls["first"] == 0


def test_a_page_holds_every_map_with_its_picture(calls, tmp_path):
    assert run(tmp_path, "--page", str(tmp_path / "maps.md")) == 0
    text = (tmp_path / "maps.md").read_text()
    assert text.count("](out/") == 3 and "* Take shorter steps." in text and "| bound | theory | closed form |" in text
    assert not (tmp_path / ".maps.md").exists()


def test_a_page_that_cannot_be_written_is_refused_with_one_line(calls, tmp_path, capsys):
    assert run(tmp_path, "--page", str(tmp_path / "nowhere" / "maps.md")) == 2
    assert "--page" in capsys.readouterr().err
    assert calls["first"] == 0


def test_kept_maps_are_not_computed_again(calls, tmp_path):
    assert run(tmp_path) == run(tmp_path) == 0
    assert (calls["first"], calls["second"], calls["third"]) == (1, 1, 1)
    # A coarse map is another one.
    assert run(tmp_path, "--quick", "--map", "first") == 0
    assert calls["first"] == 2
    assert run(tmp_path, "--anew", "--map", "first") == 0
    assert calls["first"] == 3


def test_an_interrupted_run_goes_on_with_what_is_missing(calls, tmp_path):
    calls["fail"] = True
    assert run(tmp_path) == 130
    calls["fail"] = False
    assert run(tmp_path) == 0
    assert (calls["first"], calls["second"], calls["third"]) == (1, 1, 1)


def test_a_kept_map_that_is_broken_is_computed_anew(calls, tmp_path):
    assert run(tmp_path, "--map", "first") == 0
    (file,) = (tmp_path / "cache" / "stability").iterdir()
    file.write_text(file.read_text()[:-40])
    assert run(tmp_path, "--map", "first") == 0
    assert calls["first"] == 2


def test_a_folder_that_cannot_be_is_refused_before_any_map(calls, tmp_path, capsys):
    (tmp_path / "out").write_text("a file")
    assert run(tmp_path) == 2
    assert "--output" in capsys.readouterr().err
    assert calls["first"] == 0


def test_maps_do_not_import_each_other():
    """What a kept map depends on leaves other maps out."""
    folder = Path(kept_maps.__file__).parent
    for name in stability.MAPS:
        text = (folder / f"{name}.py").read_text()
        assert not [other for other in stability.MAPS if other != name and f"stability.{other}" in text]


def test_a_record_gives_the_map_back():
    for one in (small(), small(measure=False), replace(small(), max_deviation=np.inf)):
        again = from_record("small", json.loads(json.dumps(as_record(one), allow_nan=False)))
        assert as_record(again) == as_record(one)
    assert shown_deviation(again) == "inf %"
    broken = as_record(small())
    broken["stable"] = [[True]]
    with pytest.raises(ValueError, match="axes"):
        from_record("small", broken)


def test_bisection_finds_a_change_either_way_and_says_where_there_is_none():
    assert bisected(lambda x: x > 3.0, 1.0, 100.0, 1e-9) == pytest.approx(3.0, rel=1e-8)
    assert bisected(lambda x: x < 3.0, 0.0, 100.0, 1e-9) == pytest.approx(3.0, rel=1e-8)
    assert np.isnan(bisected(lambda x: True, 0.0, 1.0, 1e-3))


def test_deviation_counts_a_boundary_that_only_one_of_both_has():
    lost = np.array([1.0, np.nan, 2.2])
    assert deviation(lost, np.array([1.0, np.nan, 2.0])) == pytest.approx(0.1)
    assert deviation(lost, np.array([1.0, 5.0, 2.0])) == np.inf
    assert deviation(np.array([5.0]), np.array([np.inf])) == np.inf
    assert np.isnan(deviation(np.array([np.nan]), np.array([np.inf])))
