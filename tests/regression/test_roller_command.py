"""``cranktrain bearing roller``: keys, units, what belongs together; wrong input in one line with exit code 2."""

import math

import pytest

from cranktrain.cli.main import main
from cranktrain.engine.file import load_engine

GIVEN = ("bearing", "roller", "--rollers", "16", "--length-mm", "10")
REAL = (*GIVEN, "--roller-diameter-mm", "10", "--pitch-mm", "70")
ALWAYS = ("deflection_um", "q_max_n", "stiffness_n_per_mm", "tilt_stiffness_nm_per_rad")


def test_the_issues_example(run_json):
    result = run_json(*GIVEN, "--clearance-um", "0", "--load-n", "5000")
    assert tuple(result)[:4] == ALWAYS
    assert result["deflection_um"] == pytest.approx(7.598255, rel=1e-6)
    assert result["q_max_n"] == pytest.approx(1276.2842, rel=1e-6)
    assert result["stiffness_n_per_mm"] == pytest.approx(731162.02, rel=1e-6)
    # Straight, aligned rollers: l²/12 of the radial stiffness.
    assert result["tilt_stiffness_nm_per_rad"] == pytest.approx(731162.02e3 * 0.01**2 / 12, rel=1e-6)
    assert result["load_factor"] == pytest.approx(4.0841, abs=1e-4)
    # Seven of the sixteen: those across the load only just touch.
    assert result["loaded_rollers"] == 7
    assert result["many_rollers"]["deflection_um"] == pytest.approx(7.598, rel=1e-3)


def test_no_load(run_json):
    result = run_json(*GIVEN, "--clearance-um", "40", "--load-n", "0")
    assert [result[key] for key in ALWAYS] == [0.0] * 4
    assert result["load_factor"] is None and math.copysign(1.0, result["stiffness_n_per_mm"]) == 1.0


def test_position_of_the_rollers_matters_by_what_is_said(run_json):
    on, beside = (run_json(*GIVEN, "--load-n", "500", "--clearance-um", "60", "--position", p) for p in
                  ("roller", "between"))  # fmt: skip
    told = beside["stiffness_n_per_mm"] / on["stiffness_n_per_mm"] - 1.0
    assert on["stiffness_variation"] == pytest.approx(told, rel=1e-9) and abs(told) > 0.01


def test_ring(run_json, monkeypatch, tmp_path):
    monkeypatch.setenv("CRANKTRAIN_CACHE", str(tmp_path))
    result = run_json(*REAL, "--load-n", "5000", "--ring")
    for key in ("stiffness_n_per_mm", "tilt_stiffness_nm_per_rad"):
        assert 0.7 * result[key] < result["ring"][key] < result[key]


def test_mains_of_an_engine(run_json, monkeypatch, tmp_path):
    monkeypatch.setenv("CRANKTRAIN_CACHE", str(tmp_path))
    result = run_json("bearing", "roller", "--engine", "diesel_v8", "--load-n", "40000")
    rollers = load_engine("diesel_v8").main_roller
    assert [entry["main"] for entry in result["mains"]] == list(range(1, len(rollers.rollers) + 1))
    for entry, stiffness in zip(result["mains"], rollers.stiffness, strict=True):
        assert entry["engine_file"]["stiffness_n_per_mm"] == pytest.approx(1e-3 * stiffness)
        assert 0.7 * entry["stiffness_n_per_mm"] < entry["ring"]["stiffness_n_per_mm"] < entry["stiffness_n_per_mm"]
    # The command of one bearing's dimensions finds the same.
    own = (
        "--rollers", rollers.rollers[0], "--length-mm", 1e3 * rollers.roller_length[0],
        "--roller-diameter-mm", 1e3 * rollers.roller_diameter[0], "--pitch-mm", 1e3 * rollers.pitch_diameter[0],
        "--clearance-um", 1e6 * rollers.clearance[0], "--profile", rollers.profile[0], "--law", rollers.law,
    )  # fmt: skip
    alone = run_json("bearing", "roller", *map(str, own), "--load-n", "40000")
    for key in ALWAYS:
        assert alone[key] == pytest.approx(result["mains"][0][key], rel=1e-9)


def test_table_for_people(capsys):
    assert main([*REAL, "--load-n", "5e6"]) == 0
    shown = capsys.readouterr()
    assert "radial stiffness / (N/mm)" in shown.out
    assert "warning: contact pressure" in shown.err and "4000 MPa" in shown.err
