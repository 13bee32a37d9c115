"""Peaks of a fillet in sub-models against a crank that is refined there as a whole."""

import pytest
from benchmarks.fillet_stress import compare
from some import some


@pytest.mark.slow
@pytest.mark.parametrize("fillet", ["pin[1] front fillet", "pin[1] rear fillet"])
def test_peaks_are_those_of_a_refined_crank(fillet):
    """Edges of R/4 in both, which resolve the surface. By resultants within 4 %, by motion 6 % too low at most."""
    for case, found in some(compare(4.0, [fillet]).items()):
        peak = found[fillet]
        assert peak["free_surface"] < 0.03, case
        assert peak["resultants"] == pytest.approx(peak["refined"], rel=0.04), case
        assert 0.94 * peak["refined"] < peak["motion"] < 1.01 * peak["refined"], case
