"""Commands with FMUs of FMI 3.0, and of both versions together: couple, harness, SSP, reference runs."""

import csv
import json
import zipfile
from pathlib import Path

import build_fmu as command
import numpy as np
import pytest
from fmpy import read_model_description
from fmus_by_version import VERSIONS

from cranktrain.cli.main import main
from cranktrain_lab.coupling.modules import COMBUSTION, CRANKTRAIN

MIXED = [("2.0", "3.0"), ("3.0", "2.0"), ("3.0", "3.0")]
SCENARIOS = """
title = "Versions"
speed_rpm = 2000
cycles = 1
step_deg = 3
step_limit_s = 5

[units.cranktrain]
fmu = "{cranktrain}"
start = {{ "crank.level" = "torsional" }}

[units.combustion]
fmu = "{combustion}"

[[scenario]]
name = "normal"
assert = [{{ output = "combustion.cylinder[2].pressure", what = "maximum", unit = "bar", least = 60, most = 250 }}]

[[scenario]]
name = "noise"
noise = [{{ input = "cranktrain.cylinder[2].pressure", rms = 0.1, unit = "bar", seed = 7 }}]
assert = [
    {{ output = "cranktrain.pulley.torsion", what = "peak_to_peak", ratio_to = "normal", least = 0.9, most = 1.1 }},
]

[[scenario]]
name = "dies"
fault = [{{ of = "combustion", kind = "dies", at_cycles = 0.25 }}]
ends = [{{ of = "combustion", at_cycles = 0.25, says = "SIGSEGV" }}]
"""


def coupled(fmus, versions, capsys, *more):
    """Exit code and what is said of some cycles of both units."""
    paths = [fmus[fmi][module] for fmi, module in zip(versions, (CRANKTRAIN, COMBUSTION), strict=True)]
    paths = "--cranktrain", paths[0], "--combustion", paths[1], "--no-valvetrain"
    run = "--speed", 2000, "--cycles", 1, "--step-deg", 3, "--json", "--output", "run.h5"
    code = main(["couple", "diesel_i6", *map(str, (*paths, *run, *more))])
    return code, capsys.readouterr()


def test_an_ssp_of_arrays_is_of_version_2(fmus, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    choice = "--set", "cranktrain.crank.level=torsional", "--set", "combustion.cylinder[1].firing_angle=0"
    code, said = coupled(fmus, ("3.0", "3.0"), capsys, *choice, "--export-ssp", "made.ssp")
    assert code == 0, said.err
    with zipfile.ZipFile("made.ssp") as archive:
        assert b'version="2.0"' in archive.read("SystemStructure.ssd")


@pytest.mark.parametrize("versions", MIXED[:2])
def test_an_ssp_of_arrays_and_scalars_is_refused_in_one_line(fmus, versions, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    code, said = coupled(fmus, versions, capsys, "--export-ssp", "made.ssp")
    assert code == 2 and not Path("made.ssp").exists()
    [line] = said.err.splitlines()
    assert "an SSP connects arrays of FMI 3.0 whole" in line and "take FMUs of FMI 2.0 alone" in line


@pytest.mark.parametrize("versions", MIXED)
def test_a_harness_watches_units_of_both_versions(fmus, versions, tmp_path, monkeypatch, capsys):
    """In processes of their own: one that dies ends its scenario alone."""
    monkeypatch.chdir(tmp_path)
    text = SCENARIOS.format(cranktrain=fmus[versions[0]][CRANKTRAIN], combustion=fmus[versions[1]][COMBUSTION])
    Path("harness.toml").write_text(text, "utf-8")
    code = main(["harness", "harness.toml", "--json"])
    found = json.loads(capsys.readouterr().out)
    failed = [(one["name"], a) for one in found["scenarios"] for a in one["assertions"] if not a["passed"]]
    assert (code, failed) == (0, []) and len(found["scenarios"]) == 3


@pytest.mark.parametrize("module", ["combustion_i6", "valvetrain_i6"])
def test_a_reference_run_has_a_column_for_each_element(module, tmp_path):
    """As many as there are elements, under the names that FMI 2.0 has but for the number's place; the same values."""
    tables = {}
    for fmi in VERSIONS:
        folder = tmp_path / fmi
        code = command.main([module, "--fmi", fmi, "--platform", "linux64", "--reference", "-o", str(folder)])
        if code != 0:
            pytest.skip("the libraries were not made here")
        [path] = folder.glob("*_ref.csv")
        with path.open() as opened:
            heads, *rows = csv.reader(opened)
        tables[fmi] = heads, np.array(rows, dtype=float)
        assert (folder / path.name.replace("_ref.csv", "_ref.opt")).is_file()
    [fmu] = (tmp_path / "3.0").glob("*.fmu")
    outputs = [v for v in read_model_description(str(fmu)).modelVariables if v.causality == "output"]
    (heads2, rows2), (heads3, rows3) = tables.values()
    assert len(heads3) == len(heads2) == 1 + sum(int(np.prod(v.shape)) for v in outputs)
    order = {place(name): k for k, name in enumerate(heads3)}
    np.testing.assert_array_equal(rows3[:, [order[place(name)] for name in heads2]], rows2)


def place(name):
    """An element's name without its number, and the number."""
    array, _, rest = name.partition("[")
    number, _, end = rest.partition("]")
    return array + end, number
