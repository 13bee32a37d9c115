"""Running in: the fitted profile, what is refused, and shells that stop wearing."""

import numpy as np
import pytest

from cranktrain.core.errors import InputError
from cranktrain.engine.file import engine_path, load_engine
from cranktrain.film.contact.gap import relief
from cranktrain_lab.wear.run_in import fitted_profile, run_in

ZETA = np.linspace(0.0, 1.0, 101)


@pytest.mark.parametrize("profile", [(6e-6, 0.5, 2.0), (2e-6, 1.0, 1.0), (9e-6, 0.25, 3.0)])
def test_a_profile_is_fitted_by_itself(profile):
    worn = np.array([relief(zeta, profile) for zeta in ZETA])
    assert fitted_profile(ZETA, worn) == pytest.approx(profile, rel=1e-3)
    assert fitted_profile(ZETA, 0.0 * worn)[0] == 0.0


def test_what_cannot_be_run_in_is_refused(tmp_path):
    with pytest.raises(InputError, match="roller bearings without an oil film"):
        run_in("diesel_v8", crank="beam")
    kept = tmp_path / "kept.toml"
    kept.write_text("", "utf-8")
    with pytest.raises(InputError, match="exists"):
        run_in("diesel_i6", kept, crank="beam")


@pytest.mark.slow
def test_a_shell_wears_where_edges_touch_and_the_file_says_so(tmp_path):
    new = tmp_path / "run_in.toml"
    found = run_in("diesel_i6", new, crank="beam", passes=4, cycles=2)
    gaps, worn = found["least_gap_um"], np.array(found["worn_um"])
    # Edges lie in the straight shell; each pass leaves less of that. The middle does not wear as the edge does.
    assert gaps[0] < 0.0 and gaps[-1] > 0.5 * gaps[0]
    assert worn[-1] == worn.max() > 1.0 > worn[0]
    engine = load_engine(new)
    assert 1e6 * engine.plain_mains.relief_depth == pytest.approx(found["relief_depth_um"], rel=1e-3)
    assert "run-in at 1000 rev/min" in new.read_text("utf-8")
    assert engine.plain_mains.clearance == load_engine(engine_path("diesel_i6")).plain_mains.clearance
