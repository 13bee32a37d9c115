"""Peaks of a fillet in sub-models against a crank that is refined there as a whole."""

import pytest
from benchmarks.fillet_stress import compare

FILLET = "pin[1] rear fillet"


@pytest.mark.slow
def test_peaks_are_those_of_a_refined_crank_within_four_percent():
    """Edges of R/4 in both, which resolve the surface; forces at the cuts and motion of the cuts both hold."""
    for case, found in compare(4.0, [FILLET]).items():
        peak = found[FILLET]
        assert peak["free_surface"] < 0.03, case
        assert peak["motion"] == pytest.approx(peak["refined"], rel=0.04), case
        assert peak["resultants"] == pytest.approx(peak["refined"], rel=0.04), case
        assert peak["coarse"] < 0.9 * peak["refined"], case
