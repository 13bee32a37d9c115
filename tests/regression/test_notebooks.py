"""Notebooks of the documents run from the first cell to the last, and say what they claim."""

import json
import re
import sys
from pathlib import Path

import pytest

import cranktrain as ct

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOKS = {path.stem: path for path in sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))}
COLOUR = re.compile(r"\x1b\[[0-9;]*m")
NUMBER = r"(-?\d+\.?\d*)"


def code(name):
    cells = json.loads(NOTEBOOKS[name].read_text("utf-8"))["cells"]
    return "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")


def run(name, monkeypatch):
    """Texts that a notebook's cells print, warnings among them."""
    pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    pytest.importorskip("xarray")
    monkeypatch.syspath_prepend(ROOT / "docs")
    monkeypatch.setenv("PYTHONPATH", f"{ROOT / 'fmu_src'}")
    executed = sys.modules.get("notebook_pages") or __import__("notebook_pages")
    book = executed.kept(NOTEBOOKS[name])
    outputs = [one for cell in book.cells if cell.cell_type == "code" for one in cell.outputs]
    text = "\n".join(one.get("text") or one.get("data", {}).get("text/plain", "") for one in outputs)
    text = COLOUR.sub("", text)
    assert not re.search(r"\w+Warning\b", text), text
    pictures = [one for one in outputs if "image/png" in one.get("data", {})]
    return text, len(pictures)


def numbers(pattern, text):
    found = re.search(pattern, text)
    assert found, f"{pattern} is not in:\n{text}"
    return [float(one) for one in found.groups()]


def test_the_five_are_there():
    assert set(NOTEBOOKS) == {"first_run", "own_engine", "damper_choice", "bearing_study", "coupling"}


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_outputs_are_not_stored(name):
    book = json.loads(NOTEBOOKS[name].read_text("utf-8"))
    cells = [cell for cell in book["cells"] if cell["cell_type"] == "code"]
    assert cells and all(cell["outputs"] == [] and cell["execution_count"] is None for cell in cells)
    assert book["cells"][0]["cell_type"] == "markdown" and book["cells"][0]["source"][0].startswith("# ")


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_public_names_only(name):
    text = code(name)
    assert not re.search(r"(from|import) cranktrain\.", text)
    assert set(re.findall(r"\bct\.(\w+)", text)) <= set(ct.__all__)


def test_first_run(monkeypatch):
    text, pictures = run("first_run", monkeypatch)
    assert pictures == 2 and "np.True_" in text  # what was saved is what is read
    (least,) = numbers(rf"least film {NUMBER} um", text)
    assert 0.5 < least < ct.load_engine("single_petrol").main_bearing.clearance * 1e6


def test_own_engine(monkeypatch):
    text, pictures = run("own_engine", monkeypatch)
    assert pictures == 3
    assert "did you mean 'piston_mass'" in text and "measures length, not mass" in text and "is not within" in text
    assert re.search(r"^True$", text, re.MULTILINE), "the file is another engine"


def test_damper_choice(monkeypatch):
    """The optimum of two masses, whose inertia ratio comes from a shift of frequency, is near that of the sweep."""
    text, pictures = run("damper_choice", monkeypatch)
    assert pictures == 2
    bare, damped, best = numbers(rf"without damper {NUMBER} deg, best of the sweep {NUMBER} deg at {NUMBER}", text)
    (predicted,) = numbers(rf": {NUMBER} N m s/rad", text)
    assert damped < 0.5 * bare and predicted == pytest.approx(best, rel=0.25)


def test_bearing_study(monkeypatch):
    text, pictures = run("bearing_study", monkeypatch)
    assert pictures == 2 and "main[2]" in text and "big_end[1]" in text
    (error,) = numbers(rf"'max_interpolation_error': {NUMBER}", text)
    assert 0.0 < error < 0.05


def test_coupling(monkeypatch):
    """Steps of half the size leave the torque; a lost pressure leaves less torsion; the fault is where it is told."""
    text, _ = run("coupling", monkeypatch)
    torques = [float(one) for one in re.findall(rf"indicated torque {NUMBER} N m", text)]
    assert len(torques) == 3 and torques[0] == pytest.approx(torques[2], rel=5e-3) and torques[2] > 10.0
    table = text[text.index("scenarios.name") :]
    assert table.count("True") == 5 and "False" not in table
