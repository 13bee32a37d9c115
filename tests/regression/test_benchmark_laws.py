"""Benchmarks that judge: cost at equal error, exponents, programs that are not here, and the tables made of them."""

import pytest
from benchmarks.cost_law import fitted
from benchmarks.peer_programs.environment import Absent, Program, environment
from benchmarks.peer_programs.equal_error import Point, beside, cost_at, front


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


def test_a_program_that_cannot_be_had_is_absent_with_a_reason():
    with pytest.raises(Absent, match=r"needs Python 9\.9"):
        environment(Program(("nothing==0",), "run.py", (9, 9)))
