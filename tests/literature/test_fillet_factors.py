"""Fillet factors from finite elements against those of other finite elements and the rule IACS UR M53."""

import json
from pathlib import Path

import numpy as np
import pytest

from cranktrain.results.strength.iacs_m53 import ThrowShape, fillet_factors
from cranktrain.structure.stress.fillet_factors import free_surface, throw_factors
from cranktrain.structure.stress.throw_mesh import QuarterThrow

DATA = json.loads((Path(__file__).parents[1] / "data" / "fillet_scf.json").read_text())[0]["finite_elements"]
CASES = [case for case in DATA if case["s"] >= 0.0]
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


def by_rule(case):
    """Empirical factors of the same throw."""
    return fillet_factors(
        ThrowShape(
            pin_diameter=DIAMETER, journal_diameter=DIAMETER, throw=(1.0 - case["s"]) * DIAMETER,
            web_thickness=case["w"] * DIAMETER, web_width=case["b"] * DIAMETER, pin_fillet=case["r"] * DIAMETER,
            journal_fillet=case["r"] * DIAMETER,
        )
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: f"overlap {case['s']:g}")
def test_factors_of_other_finite_elements_and_of_the_rule(case):
    """Pin and journal overlap: within 3 % of the other's, within 12 % of the rule's."""
    found = throw_factors(quarter(case))
    assert found.free_surface <= CONVERGED
    for name in ("alpha_b", "beta_b", "alpha_t", "beta_t"):
        expected = case[name[:-1] + name[-1].upper()]
        assert getattr(found, name) == pytest.approx(expected, rel=0.03), name
    assert found.beta_q == pytest.approx(case["beta_Q_zero_moment"], rel=0.03)
    rule = by_rule(case)
    for name in ("alpha_b", "beta_b", "alpha_t", "beta_t"):
        assert getattr(found, name) == pytest.approx(getattr(rule, name), rel=0.12), name


def test_a_free_surface_has_a_principal_stress_that_vanishes():
    plane = [[90.0, 1.0], [30.0, 1.0], [0.0, 1.0], [5.0, 0.0], [0.0, 0.0], [0.0, 0.0]]
    assert free_surface(np.array(plane)) == pytest.approx(0.0, abs=1e-12)
    assert free_surface(np.array(plane) + np.array([3.0, 3.0, 3.0, 0, 0, 0])[:, None]) > 0.02
