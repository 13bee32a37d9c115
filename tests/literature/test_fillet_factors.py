"""Fillet factors from finite elements against those of other finite elements and the rule IACS UR M53."""

from functools import cache

import numpy as np
import pytest
from expected import data
from test_iacs_m53 import shape

from cranktrain.results.strength.iacs_m53 import fillet_factors
from cranktrain.structure.stress.fillet_factors import free_surface, throw_factors
from cranktrain.structure.stress.throw_mesh import QuarterThrow

CASES = data("fillet_scf")[0]["finite_elements"]
DIAMETER = 0.1
CONVERGED = 0.03
"""Least over largest principal stress at the peak, from which it counts as converged."""


def quarter(case):
    """Quarter throw of equal pin and journal, half a diameter wide each."""
    d = DIAMETER
    return QuarterThrow(
        pin_diameter=d, main_diameter=d, throw=(1.0 - case["s"]) * d, web_thickness=case["w"] * d,
        web_width=case["b"] * d, pin_fillet=case["r"] * d, main_fillet=case["r"] * d, half_pin=0.25 * d,
        half_main=0.25 * d,
    )  # fmt: skip


@cache
def by_elements(number):
    """Factors of a case from our finite elements."""
    return throw_factors(quarter(CASES[number]))


@pytest.mark.slow
@pytest.mark.parametrize("number", range(len(CASES)))
def test_factors_of_other_finite_elements(number):
    """Within 3 %; shear only where pin and journal overlap, as the source has it."""
    found, case = by_elements(number), CASES[number]
    assert found.free_surface <= CONVERGED
    names = {"alpha_b": "alpha_B", "beta_b": "beta_B", "alpha_t": "alpha_T", "beta_t": "beta_T"}
    if case["s"] >= 0.0:
        names["beta_q"] = "beta_Q_zero_moment"
    for name, theirs in names.items():
        assert getattr(found, name) == pytest.approx(case[theirs], rel=0.03), name


MISSED = pytest.mark.xfail(strict=True, reason="13 % above the rule; the other finite elements are 11 % above")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "name"),
    [
        pytest.param(k, name, marks=MISSED if (case["s"], name) == (0.1, "alpha_b") else ())
        for k, case in enumerate(CASES)
        for name in ("alpha_b", "beta_b", "alpha_t", "beta_t")
        if case["s"] >= 0.0
    ],
)
def test_factors_of_the_rule(number, name):
    assert getattr(by_elements(number), name) == pytest.approx(
        getattr(fillet_factors(shape(CASES[number])), name), rel=0.12
    )


def test_a_free_surface_has_a_principal_stress_that_vanishes():
    plane = [[90.0, 1.0], [30.0, 1.0], [0.0, 1.0], [5.0, 0.0], [0.0, 0.0], [0.0, 0.0]]
    assert free_surface(np.array(plane)) == pytest.approx(0.0, abs=1e-12)
    assert free_surface(np.array(plane) + np.array([3.0, 3.0, 3.0, 0, 0, 0])[:, None]) > 0.02
