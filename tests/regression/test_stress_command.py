"""The verb stress: what its JSON and its file hold, its check, and wrong input."""

import numpy as np
import pytest

from cranktrain.cli.main import main
from cranktrain.engine.file import load_engine
from cranktrain.store.bodies import export_body
from cranktrain.store.hdf5 import read_result
from cranktrain.structure.crank.beam import beam_body


@pytest.mark.slow
def test_stresses_of_a_cycle(coarse, capsys, run_json):
    output, pictures = coarse.with_name("run.h5"), coarse.with_name("pictures")
    given = ["stress", str(coarse), "--speed", "2200", "--settle", "1e-2"]
    report = run_json(*given, "--output", str(output), "--plots", str(pictures))
    angles, greatest = np.array(report["angles_deg"]), np.array(report["max_von_mises_mpa"])
    assert np.all(np.diff(angles) > 0.0) and 0.0 <= angles[0] < angles[-1] < 720.0
    place = report["location"]
    assert place["von_mises_mpa"] == pytest.approx(greatest.max())
    assert place["angle_deg"] == pytest.approx(angles[greatest.argmax()])
    assert "fillet" in place["feature"]
    assert report["static_check_relative"] < 0.02
    assert {path.name for path in pictures.iterdir()} == {"stresses.png", "stress_envelope.png"}
    datasets, attributes = read_result(output)
    assert datasets["envelope_von_mises"][0].max() == pytest.approx(1e6 * greatest.max())
    assert attributes["static_check_relative"] == report["static_check_relative"]
    assert main([*given, "--no-check", "--output", str(output)]) == 0
    shown = capsys.readouterr().out
    assert place["feature"] in shown and "Direct finite-element" not in shown


@pytest.mark.slow
def test_fillets_of_a_throw_by_sub_models(coarse, run_json):
    """Higher than the crank's own mesh reads them, resolved, both drives close; and what fatigue makes of them."""
    given = str(coarse), "--settle", "1e-2", "--fillets", "1", "--speed", "2200"
    report = run_json("stress", *given, "--no-check", "--output", str(coarse.with_name("fillets.h5")))
    fillets = {one["name"]: one for one in report["fillets"]}
    spots = {one["feature"]: one["von_mises_mpa"] for one in report["hot_spots"]}
    assert len(fillets) == 5 and "oil hole[1]" in fillets
    for name, one in fillets.items():
        assert one["converged"] and one["by_motion_mpa"] == pytest.approx(one["von_mises_mpa"], rel=0.1), name
        assert "hole" in name or one["von_mises_mpa"] > 1.05 * spots[name], name
    places = run_json("fatigue", *given)["fillets"]
    fine = {one["name"]: one for one in places if one["by"] == "sub-model"}
    assert set(fine) == {"web[1].pin", "web[2].pin", "web[1].main", "web[2].main", "pin[1].oil_bore"}
    for name, one in fine.items():
        assert one["safety_factor"] == pytest.approx(one["safety_factor_by_rule_factors"], rel=0.5) or "bore" in name


@pytest.mark.parametrize("option", ["--body", "--mesh"])
def test_a_reduced_body_in_place_of_the_elements_is_refused(tmp_path, capsys, option):
    body = export_body(tmp_path / "crank.npz", beam_body(load_engine("diesel_i6")))
    assert main(["stress", "diesel_i6", "--speed", "2200", option, str(body)]) == 2
    error = capsys.readouterr().err.strip()
    assert "crank.npz: a reduced body has no stresses" in error and "\n" not in error
