"""The verb fatigue: what its JSON holds, pictures, and wrong input."""

import json
import re

import pytest

from cranktrain.cli.main import main
from cranktrain.engine.file import engine_path
from cranktrain.studies.report.findings import Asked, steps
from cranktrain.studies.report.verdict import verdicts

QUICK = ("--crank", "beam", "--bearings", "linear")


def test_the_six(tmp_path, run_json):
    path = tmp_path / "made" / "diesel_i6_fatigue.json"
    to = ("--plots", str(tmp_path), "--output", str(path))
    found = run_json("fatigue", "diesel_i6", "--speed", "1600", "2000", *QUICK, *to)
    assert json.loads(path.read_text("utf-8")) == found
    report = next(steps(Asked("diesel_i6", folders=[path.parent])))
    factor, rule = (one for one in verdicts(report) if one.key == "crank_strength")
    assert factor.value == min(place["safety_factor"] for place in found["fillets"])
    assert (rule.said == "passed") == found["rule"]["accepted"]
    names = [place["name"] for place in found["fillets"]]
    assert len(names) == len(set(names)) == 24 + 6
    assert {"web[1].pin", "web[12].main", "pin[6].oil_bore"} <= set(names)
    assert {"name", "safety_factor", "amplitude_mpa", "mean_mpa", "converged"} <= set(found["fillets"][0])
    assert all(1.0 < place["safety_factor"] < 20.0 and place["converged"] for place in found["fillets"])
    assert {place["speed_rpm"] for place in found["fillets"]} == {1600.0, 2000.0}
    rule = found["rule"]
    assert [place["name"] for place in rule["places"]] == names
    assert rule["accepted"] == all(place["acceptability"] >= 1.15 for place in rule["places"])
    assert rule["outside"] == []
    assert [at["bending"] for at in found["speeds"]] == ["crank", "crank"]
    assert all(at["unbalanced_relative"] < 1e-2 for at in found["speeds"])
    assert all((tmp_path / name).is_file() for name in ("safety_factors.png", "haigh.png"))


def test_the_result_replaces_no_other_file(tmp_path, capsys):
    path = tmp_path / "notes.json"
    path.write_text("[1]")
    assert main(["fatigue", "diesel_i6", *QUICK, "--output", str(path)]) == 2
    assert "is no result of cranktrain fatigue" in capsys.readouterr().err and path.read_text() == "[1]"


def test_a_crank_outside_the_rule_is_not_accepted_by_it(capsys, run_json):
    found = run_json("fatigue", "diesel_v8", *QUICK)
    assert found["speeds"][0]["rpm"] == pytest.approx(1200.0)
    assert found["rule"]["accepted"] is None
    assert found["rule"]["outside"] == ["s = 0.557 (at most 0.5)"]
    assert not any(place["converged"] for place in found["fillets"])
    assert main(["fatigue", "diesel_v8", *QUICK]) == 0
    assert "does not judge this crank" in capsys.readouterr().out


def test_locked_journals_bend_each_throw_alone_and_more_load_is_less_safe(run_json):
    arguments = ("diesel_i6", "--speed", "1200", "--crank", "torsional", "--load")
    half, full = (run_json("fatigue", *arguments, load) for load in ("0.5", "1"))
    assert half["speeds"][0]["bending"] == "single throws"
    least = [min(place["safety_factor"] for place in found["fillets"]) for found in (half, full)]
    assert least[1] < least[0]


def test_a_crank_without_its_material_is_refused(tmp_path, capsys):
    path = tmp_path / "six.toml"
    path.write_text(re.sub(r"(?s)\[crank_strength\].*?\n\n", "", engine_path("diesel_i6").read_text("utf-8")), "utf-8")
    assert main(["fatigue", str(path)]) == 2
    says = "has no [crank_strength], which fatigue needs: add the keys tensile_strength, forming and roughness"
    assert says in capsys.readouterr().err
