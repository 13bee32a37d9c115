"""The rule IACS UR M53: published factors, and limits that the rule's text states or implies."""

import math
from dataclasses import replace

import pytest
from expected import data

from cranktrain.engine.limits import CrankStrength
from cranktrain.results.strength.iacs_m53 import (
    ThrowShape,
    fatigue_strength,
    fillet_factors,
    fillet_stress,
    oil_bore_factors,
    oil_bore_stress,
    pin_bending,
    torsion,
    web_bending,
)

(RULE,) = data("fillet_scf")
STEEL = CrankStrength(tensile_strength=785e6, forming="free-form", roughness=4e-6)


def throw(s, w, b, r, diameter=0.1):
    """Throw of these ratios with a journal as thick as its pin."""
    ratios = {"pin_diameter": 1.0, "journal_diameter": 1.0, "throw": 1.0 - s, "web_thickness": w, "web_width": b,
              "pin_fillet": r, "journal_fillet": r}  # fmt: skip
    return ThrowShape(**{name: ratio * diameter for name, ratio in ratios.items()})


def shape(row):
    return throw(row["s"], row["w"], row["b"], row["r"])


@pytest.mark.parametrize("row", RULE["expected"], ids=lambda row: f"s {row['s']:g}")
def test_published_factors(row):
    found = fillet_factors(shape(row))
    for name in ("alpha_B", "alpha_T", "beta_B", "beta_Q"):
        # The table has five digits.
        assert getattr(found, name.lower()) == pytest.approx(row[name], rel=1e-4), name
    assert found.beta_t == found.alpha_t
    assert shape(row).outside == ()


@pytest.mark.parametrize("row", RULE["finite_elements"], ids=lambda row: f"s {row['s']:g}")
def test_published_finite_elements_lie_within_the_scatter_of_the_rule(row):
    found = fillet_factors(shape(row))
    scatter = 0.12 if row["s"] >= 0.0 else 0.25  # as the data say
    for name in ("alpha_B", "beta_B", "alpha_T", "beta_T"):
        assert getattr(found, name.lower()) == pytest.approx(row[name], rel=scatter), name


def test_factors_are_of_the_form_alone_and_end_where_the_rule_says():
    """The same for all sizes; an overlap below -1/2 counts as that; what lies outside is named; a bore that closes."""
    small, large = throw(0.2, 0.35, 1.5, 0.06, 0.05), throw(0.2, 0.35, 1.5, 0.06, 0.5)
    assert fillet_factors(small) == pytest.approx(fillet_factors(large), rel=1e-12)
    assert fillet_factors(throw(-0.8, 0.5, 1.5, 0.05)) == pytest.approx(fillet_factors(throw(-0.5, 0.5, 1.5, 0.05)))
    assert throw(0.557, 0.35, 1.5, 0.06).outside == ("s = 0.557 (at most 0.5)",)
    assert throw(0.2, 0.15, 2.5, 0.06).outside == ("w = 0.15 (at least 0.2)", "b = 2.5 (at most 2.2)")
    assert oil_bore_factors(0.0) == (3.0, 4.0)


def test_recessed_fillets_raise_bending_and_a_journal_has_its_own_torsion_factor():
    """Recesses raise bending alone; the journal's factor counts its own fillet over its own diameter."""
    plain = throw(0.2, 0.35, 1.5, 0.06)
    recessed = replace(plain, pin_recess=0.003, journal_recess=0.002)
    factor = 1.0 + 0.05 * (1.8 + 3.2 * 0.2)
    a, b = fillet_factors(plain), fillet_factors(recessed)
    assert b == pytest.approx((factor * a[0], a[1], factor * a[2], factor * a[3], a[4]))
    plain = throw(0.2, 0.35, 1.5, 0.06)
    other = replace(plain, journal_diameter=0.12, throw=0.09, journal_fillet=0.0072)
    a, b = fillet_factors(plain), fillet_factors(other)
    # As large an overlap, and the same r over the own diameter: the same factor.
    assert other.ratios["s"] == pytest.approx(0.2)
    assert b.beta_t == pytest.approx(a.beta_t)
    assert b.beta_b == pytest.approx(a.beta_b * 1.2**-0.5568)


def test_stresses_are_those_of_a_bar_and_a_shaft():
    """Nominal stresses, and the equivalent stress where bending or torsion is alone."""
    plain = throw(0.2, 0.35, 1.5, 0.06)
    second = 0.15 * 0.035**3 / 12.0
    assert web_bending(plain, 100.0) == pytest.approx(100.0 * 0.0175 / second)
    polar = math.pi / 32.0 * (0.1**4 - 0.04**4)
    assert torsion(0.1, 0.04, 100.0) == pytest.approx(100.0 * 0.05 / polar)
    assert pin_bending(replace(plain, pin_bore=0.04), 100.0) == pytest.approx(100.0 * 0.05 / (0.5 * polar))
    assert fillet_stress(80e6, 0.0) == pytest.approx(90e6)
    assert fillet_stress(0.0, 60e6, 0.0) == pytest.approx(math.sqrt(3.0) * 60e6)
    assert oil_bore_stress(80e6, 0.0) == pytest.approx(80e6)
    assert oil_bore_stress(0.0, 60e6) == pytest.approx(60e6)
    b, t = 70e6, 40e6
    assert oil_bore_stress(b, t) == pytest.approx(b / 3.0 * (1.0 + 2.0 * math.sqrt(1.0 + 2.25 * (t / b) ** 2)))


def test_fatigue_strength_term_by_term():
    """At 785 MPa the term of strength vanishes; a pin of 100 mm, a fillet of 4 mm; forming counts in the fillet."""
    expected = (0.42 * 785.0 + 39.3) * (0.264 + 1.073 * 100.0**-0.2 + 196.0 / 785.0 * 0.5)
    assert 1e-6 * fatigue_strength(STEEL, 0.1, 0.004) == pytest.approx(expected)
    assert fatigue_strength(STEEL, 0.1, 0.001) == fatigue_strength(STEEL, 0.1, 0.002)
    forged = replace(STEEL, forming="grain-flow")
    assert fatigue_strength(forged, 0.1, 0.004) == pytest.approx(1.05 * fatigue_strength(STEEL, 0.1, 0.004))
    assert fatigue_strength(forged, 0.1, 0.004, fillet=False) == fatigue_strength(STEEL, 0.1, 0.004)
