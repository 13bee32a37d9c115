"""Peaks of run-ups of short cranks lie at the modes in motion that they are said to belong to."""

import json
from pathlib import Path

import pytest

from cranktrain.cli.main import main

DATA = Path(__file__).parents[1] / "data" / "engines"
LARGE = 0.2
"""Peaks of the crank with at least this fraction of the largest of them are judged."""
pytestmark = pytest.mark.filterwarnings("ignore:.*fires at uneven intervals")


def crank_peaks(folder, capsys, engine, *options):
    """Periodic peaks of a run-up above its drive line's frequencies, the highest first, as ``--json`` has them."""
    words = ["runup", str(engine), "--workers", "1", "--output", str(folder / "r.h5"), "--json", *options]
    assert main(words) == 0
    return [peak for peak in json.loads(capsys.readouterr().out)["peaks"] if peak["hz"] > 300.0 and peak["periodic"]]


def assert_named(found, within=0.007):
    """Large peaks have a mode in motion, within 0.7 %; there are at least four of them."""
    large = [peak for peak in found if peak["amplitude"] >= LARGE * found[0]["amplitude"]]
    assert len(large) >= 4
    for peak in large:
        assert peak["mode_in_motion_hz"] == pytest.approx(peak["hz"], rel=within), peak


@pytest.mark.slow
@pytest.mark.parametrize(
    ("engine", "low", "high"), [("gas_i4", 1000, 6500), ("moto_i4", 1500, 14000), ("vtwin", 1000, 7500)]
)
def test_peaks_of_short_solid_cranks_on_films_have_their_modes(tmp_path, capsys, engine, low, high):
    step = "100" if high > 10000 else "50"
    path = DATA / f"{engine}.toml"
    assert_named(crank_peaks(tmp_path, capsys, path, "--from", str(low), "--to", str(high), "--step", step))


@pytest.mark.slow
def test_peaks_of_a_four_from_a_layout_have_their_modes(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["new", "four", "--layout", "i4", "--bore-mm", "86", "--stroke-mm", "86"]) == 0
    capsys.readouterr()
    assert_named(crank_peaks(tmp_path, capsys, "four.toml", "--from", "1000", "--to", "6300", "--step", "50"))


def test_the_peak_of_a_crank_of_beams_has_the_mode_with_less_torsion_in_its_energy(tmp_path, capsys):
    """Order 6 of a four; the mode near 600 Hz twists more and is damped twice as much."""
    options = ("--crank", "beam", "--from", "4200", "--to", "5000", "--step", "50")
    first = next(peak for peak in crank_peaks(tmp_path, capsys, DATA / "gas_i4.toml", *options) if peak["order"] == 6.0)
    assert first["mode_in_motion_hz"] == pytest.approx(first["hz"], rel=0.007)
    assert 25.0 < first["mode_in_motion_torsion_percent"] < 60.0
