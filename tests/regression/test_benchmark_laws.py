"""Benchmarks that judge: cost at equal error, exponents, programs that are not here, and the tables made of them."""

import importlib.util
import sys
from pathlib import Path

import pytest
from benchmarks.cost_law import VARIANTS, extrapolated, fitted, in_line
from benchmarks.peer_programs.environment import Absent, Program, environment
from benchmarks.peer_programs.equal_error import Point, beside, cost_at, front
from benchmarks.peers import PEERS
from benchmarks.peers import main as compare

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def figures():
    specification = importlib.util.spec_from_file_location("figures", ROOT / "docs" / "figures.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_cost_at_an_error_follows_the_front_and_extrapolates_nothing():
    """A second-order method costs twice for a quarter of the error; one that is worse in both does not count."""
    points = [Point(str(k), 4.0**-k, 2.0**k) for k in range(4)] + [Point("worse", 0.3, 5.0)]
    assert [point.setting for point in front(points)] == ["0", "1", "2", "3"]
    assert cost_at(points, 4.0**-1.5) == pytest.approx(2.0**1.5)
    assert cost_at(points, 4.0**-3) == pytest.approx(8.0)
    assert cost_at(points, 4.0**-3.01) is None
    assert cost_at(points, 10.0) == 1.0
    slower = [Point(point.setting, point.error, 3.0 * point.seconds) for point in points]
    assert [row["ratio"] for row in beside(points, slower, (0.25, 1e-9))] == [3.0, None]


def test_exponent_of_a_power_is_that_power():
    law = fitted([1.0, 2.0, 5.0, 9.0], [3.0 * x**1.5 for x in (1.0, 2.0, 5.0, 9.0)])
    assert law["exponent"] == pytest.approx(1.5) and law["scatter"] < 1e-12
    assert fitted([1.0, 2.0], [1.0, 4.0]) == {"exponent": pytest.approx(2.0), "standard_error": None, "scatter": None}


@pytest.mark.parametrize("count", [2, 3, 5, 12])
def test_in_line_engines_fire_at_even_intervals(count):
    angles = in_line(count).firing_angles
    assert sorted(angles) == pytest.approx([4.0 * 3.141592653589793 * k / count for k in range(count)])


def test_a_program_that_cannot_be_had_is_absent_with_a_reason():
    with pytest.raises(Absent, match=r"needs Python 9\.9"):
        environment(Program(("nothing==0",), "run.py", (9, 9)))


def test_unknown_programs_are_refused(capsys):
    assert compare("adams") == 2
    assert f"unknown program 'adams'; valid: {', '.join(PEERS)}" in capsys.readouterr().err


def canned_variants():
    row = {"variants": VARIANTS, "seconds": 0.2, "spread": 0.01, "cycles": 8}
    cluster = {"workers": 2, "wall_s": 2.5, "tasks_s": 4.0, "workers_s": 4.2, "scheduler_s": 0.2}
    names = "torsional, structure reused", "torsional, structure anew", "solid, structure reused"
    found = {name: {**row, "cluster": dict(cluster)} for name in names}
    found[names[1]]["cluster"] = {"absent": "no Dask"}
    return found | {"structure": {"seconds": 100.0, "degrees_of_freedom": 80511}}


def test_ten_thousand_variants_are_their_number_times_one():
    hours = extrapolated(canned_variants())
    row = hours["torsional, structure reused"]
    assert row["processor_hours"] == pytest.approx(10_000 * 0.2 / 3600.0)
    assert row["overhead"] == pytest.approx(0.1)
    assert row["hours_on_a_cluster_of_two"] == pytest.approx(1.1 * row["hours_on_one_machine_of_two"])
    assert hours["torsional, structure anew"]["hours_on_a_cluster_of_two"] is None
    anew = hours["solid, structure anew"]
    assert anew["seconds_each"] == pytest.approx(100.2)
    # What a cluster spends on a task does not grow with the task.
    assert anew["overhead"] == pytest.approx(0.1 * 0.2 / 100.2)


def test_tables_and_picture_of_the_cost_law(figures, tmp_path):
    from benchmarks._cost_law_chart import draw

    law = {"sizes": [1, 2, 4], "seconds": [0.01, 0.02, 0.04], "exponent": 1.0, "standard_error": 0.0, "scatter": 0.0}
    pair = {"sizes": [1, 2], "seconds": [1.0, 1.1], "exponent": 0.1, "standard_error": None, "scatter": None}
    measured = canned_variants()
    found = dict.fromkeys(("modes", "ports", "films", "grid", "speeds"), law) | {"workers": pair}
    found["variants"] = {"measured": measured, "extrapolated": extrapolated(measured)}
    text = figures.cost_law_text(found)
    assert "| speeds | 1, 2, 4 | 0.01, 0.02, 0.04 s a run-up | 1.00 ± 0.00 | 0 % |" in text
    assert "| torsional, structure anew | 0.2 | – |" in text and "80511 degrees of freedom" in text
    draw(found, tmp_path / "law.png")
    assert (tmp_path / "law.png").read_bytes().startswith(b"\x89PNG")


def test_tables_of_other_programs(figures):
    points = [{"setting": "1°", "error": 1e-3, "seconds": 0.002}]
    iterated = {
        "program": "Other 1.0", "compared": "a crank", "cost": "a cycle", "difference_of_references": 2e-3,
        "own": points, "other": points, "not_comparable": "films are left out",
        "at_equal_error": [{"error": 1e-3, "own_s": 0.002, "other_s": 0.02, "ratio": 10.0},
                           {"error": 1e-4, "own_s": 0.003, "other_s": None, "ratio": None}],
    }  # fmt: skip
    direct = {
        "program": "Direct 2", "compared": "a chain", "cost": "a run-up", "own_s": 0.1, "other_s": 0.3, "ratio": 3.0,
        "not_comparable": "nothing",
    }  # fmt: skip
    text = figures.peers_text({"other": iterated, "direct": direct, "ross": {"absent": "needs Python 3.13"}})
    assert "| **Other 1.0** | a crank; a cycle | 0.001 | 20 ms | 2 ms | **10** |" in text
    assert "|  |  | 0.0001 | – | 3 ms | – |" in text
    assert "| **Direct 2** | a chain; a run-up | rounding | 300 ms | 100 ms | **3** |" in text
    assert "| ross | absent: needs Python 3.13 |" in text
    assert "difference of references 2.0e-03" in text


def test_scripts_of_other_programs_are_there_and_compile():
    folder = ROOT / "benchmarks" / "peer_programs"
    scripts = list(folder.glob("run_*.py"))
    assert len(scripts) == 3
    for path in scripts:
        compile(path.read_text("utf-8"), str(path), "exec")
    assert "benchmarks._variants" in sys.modules
