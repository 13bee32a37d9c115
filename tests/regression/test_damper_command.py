"""The verb damper-optimum and modal --damper: what their JSON holds, and wrong input."""

import pytest

from cranktrain.cli.main import main


def test_two_masses(run_json):
    result = run_json("damper-optimum", "--inertia-ratio", "1")
    assert result["damping_ratio"] == pytest.approx(1.0 / 12.0**0.5, rel=1e-12)
    assert result["amplification"] == pytest.approx(3.0)
    assert result["frequency_ratio"] == pytest.approx((2.0 / 3.0) ** 0.5)
    assert result["by_search"] == pytest.approx({k: v for k, v in result.items() if k != "by_search"}, rel=1e-6)


def test_an_engine(coarse, capsys, run_json):
    first = run_json("damper-optimum", str(coarse))
    second = run_json("damper-optimum", str(coarse), "--mode", "2")
    for result in (first, second):
        assert {"damping_ratio", "amplification", "frequency_ratio", "damping_nms_per_rad"} <= set(result)
        critical = 4.0 * 3.141592653589793 * result["mode_hz"] * result["effective_inertia_kgm2"]
        assert result["damping_nms_per_rad"] == pytest.approx(result["damping_ratio"] * critical)
    assert second["mode_hz"] > first["mode_hz"]
    assert main(["damper-optimum", str(coarse)]) == 0
    assert "on the crank" in capsys.readouterr().out


def test_modal_with_damper(coarse, capsys, run_json):
    plain = run_json("modal", str(coarse))
    report = run_json("modal", str(coarse), "--damper")
    assert "damper" not in plain
    assert report["cranktrain"] == plain["cranktrain"]  # what the reference lists is without damper
    first = report["damper"]["first_torsional"]
    assert set(first) == {"hz", "damping_ratio", "ring_free_hz", "ring_locked_hz"}
    assert first["hz"] in [mode["hz"] for mode in report["damper"]["modes"]]
    assert main(["modal", str(coarse), "--damper"]) == 0
    assert "ring locked" in capsys.readouterr().out


def test_an_engine_without_damper(coarse, tmp_path, capsys):
    text = coarse.read_text("utf-8")
    start = text.index("[damper]")
    none = tmp_path / "none.toml"
    none.write_text(text[:start] + text[text.index("\n[", start + 1) + 1 :], encoding="utf-8")
    for verb, *more in (("damper-optimum",), ("modal", "--damper")):
        assert main([verb, str(none), *more]) == 2
        error = capsys.readouterr().err
        assert "has no [damper]" in error and error.count("\n") == 1
