"""``cranktrain modal`` and ``simulate`` at crank levels other than the solid one."""

import re

import pytest

from cranktrain.cli.main import main
from cranktrain.engine.file import engine_path


@pytest.fixture
def formula(tmp_path):
    """The six with its torsional stiffnesses from a formula: no finite elements needed."""
    text = engine_path("diesel_i6").read_text(encoding="utf-8")
    path = tmp_path / "six.toml"
    path.write_text(
        re.sub('torsional_source = { value = "[a-z-]+"', 'torsional_source = { value = "ker-wilson"', text),
        encoding="utf-8",
    )
    return path


def test_a_torsional_run_tells_of_torsion_and_of_no_bearing(formula, tmp_path, capsys, run_json):
    arguments = ["simulate", str(formula), "--crank", "torsional", "--speed", "2000", "--cycles", "10"]
    summary = run_json(*arguments, "--output", str(tmp_path / "run.h5"))
    assert summary["pulley"]["torsion_deg"]["peak_to_peak"] > 0.1
    assert "axial_um" not in summary["pulley"] and summary["bearings"] == []
    pulley = run_json(*arguments, "--steady", "--output", str(tmp_path / "run.h5"))["pulley"]
    time, frequency = (dict(map(tuple, pulley[key]["orders"])) for key in ("torsion_deg", "steady_torsion_deg"))
    assert time[6.0] == pytest.approx(frequency[6.0], rel=0.005)
    assert main([*arguments, "--output", str(tmp_path / "run.h5")]) == 0
    assert "Main bearings" not in capsys.readouterr().out


@pytest.mark.parametrize("level", ["rigid", "beam"])
def test_levels_from_dimensions_run_on_films(level, tmp_path, run_json):
    arguments = ["simulate", "diesel_i6", "--crank", level, "--speed", "2000", "--cycles", "1"]
    assert len(run_json(*arguments, "--output", str(tmp_path / "run.h5"))["bearings"]) == 7


def test_modal_names_the_command_that_makes_the_solid_crank_of_an_own_file(formula, capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("CRANKTRAIN_CACHE", str(tmp_path / "cache"))  # no solid crank there
    assert main(["modal", str(formula), "--crank", "torsional"]) == 0
    assert f"cranktrain reduce {formula} makes it" in " ".join(capsys.readouterr().out.split())


@pytest.mark.slow
@pytest.mark.parametrize("level", ["rigid", "torsional", "beam"])
def test_modal_puts_a_level_beside_the_solid(level, capsys, run_json):
    assert main(["reduce", "diesel_i6", "--json"]) == 0
    capsys.readouterr()
    report = run_json("modal", "diesel_i6", "--crank", level)
    first = report["cranktrain"]["first_torsional"]
    assert first["solid_hz"] == pytest.approx(238.0, rel=0.01)
    assert ("hz" in first) == (level != "rigid")
    assert main(["modal", "diesel_i6", "--crank", level]) == 0
    assert "deviation" in capsys.readouterr().out
