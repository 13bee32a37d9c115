"""Benchmarks that judge: cost at equal error, exponents, programs that are not here, and the tables made of them."""

import pytest
from benchmarks.cost_law import VARIANTS, extrapolated, fitted, in_line
from benchmarks.peer_programs.environment import Absent, Program, environment
from benchmarks.peer_programs.equal_error import Point, beside, cost_at, front
from benchmarks.peers import PEERS
from benchmarks.peers import main as compare


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
