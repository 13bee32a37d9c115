"""The verb noise: a reduced block with its panels file, its result, pictures and sound, and wrong input."""

import numpy as np
import pytest
from box_block import box_block
from scipy.io import wavfile

from cranktrain.cli.main import main
from cranktrain.engine.file import load_engine
from cranktrain.store.bodies import export_body

PANELS = """
[panels.lid]
interfaces = ["cover"]
areas = [3600]
normals = [[0, -1, 0]]
thickness = 6

[panels.mains]
interfaces = ["bore[1]", "bore[7]"]
areas = [2000, "20 cm^2"]
normals = [[1, 0, 0]]
"""
RUN = "--crank", "rigid", "--bearings", "linear"


@pytest.fixture(scope="module")
def own_block(tmp_path_factory):
    """A reduced block made by hand, and its panels file."""
    folder = tmp_path_factory.mktemp("block")
    (folder / "panels.toml").write_text(PANELS)
    body = export_body(folder / "box.npz", box_block(load_engine("diesel_i6")))
    return "--block-body", str(body), "--panels", str(folder / "panels.toml")


def test_levels_pictures_and_sound_of_three_speeds(own_block, tmp_path, run_json, capsys):
    stored = str(tmp_path / "noise.h5")
    speeds = "--speed", "2000", "1800", "2200", "--step-deg", "2"
    found = run_json("noise", "diesel_i6", *RUN, *own_block, *speeds, "--check-step", "--output", stored)
    assert [one["speed_rpm"] for one in found["speeds"]] == [1800.0, 2000.0, 2200.0] and found["result"] == stored
    for one in found["speeds"]:
        powers = {row["panel"]: row["sound_power_db"] for row in one["panels"]}
        total = 10.0 * np.log10(sum(10.0 ** (0.1 * value) for value in powers.values()))
        assert set(powers) == {"lid", "mains"} and total == pytest.approx(one["sound_power_db"], abs=0.02)
        assert all(band["step_error_db"] < 3.0 and not band["note"] for band in one["bands"] if band["hz"] < 500.0)
    again = run_json("noise", stored, "--radiation", "plate")
    assert again["assumption"] != found["assumption"] and again["result"] is None
    for one, other in zip(again["speeds"], found["speeds"], strict=True):
        assert one["sound_power_db"] < other["sound_power_db"]
    pictures, sound = tmp_path / "pictures", str(tmp_path / "a.wav")
    assert main(["noise", stored, "--plots", str(pictures), "--panel", "lid", "--wav", sound]) == 0
    shown = capsys.readouterr().out
    assert {path.name for path in pictures.iterdir()} == {"noise_bands.png", "noise_waterfall.png"}
    rate, samples = wavfile.read(sound)
    assert samples.size / rate == pytest.approx(3 * 2.0, abs=0.3)
    assert "full scale" in shown and "lid" in shown
    for wrong, word in (
        (("--speed", "900"), "--speed belongs to a run"),
        (("--panel", "led"), "did you mean 'lid'"),
        (("--map", str(tmp_path / "map.png")), "no surface to draw"),
    ):
        assert main(["noise", stored, *wrong]) == 2
        error = capsys.readouterr().err.strip().splitlines()[-1]
        assert word in error


def test_a_reduced_block_without_panels_is_refused(own_block, capsys):
    assert main(["noise", "diesel_i6", "--speed", "2000", *own_block[:2]]) == 2
    error = capsys.readouterr().err.strip()
    assert "a reduced block has no surface" in error and "\n" not in error
