"""The archive: reproducible, complete, valid, and described by one table; from an engine file to the whole engine."""

import ast
import json
import re
import shlex
import shutil
import zipfile
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import build_fmu
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu
from fmus_by_version import check_counts

from cranktrain.core.errors import InputError, StoreError
from cranktrain.engine.file import engine_path, load_engine
from cranktrain.fmu import archive, build, engine_fmu, running_code
from cranktrain.fmu.description import read_interface


def test_equal_inputs_give_equal_bytes(fmu, model, tmp_path):
    again = engine_fmu.build(model, tmp_path, print)
    assert again.read_bytes() == Path(fmu).read_bytes()


def test_guid_changes_with_the_data(fmu, model, tmp_path):
    other = engine_fmu.build(model._replace(engine=replace(model.engine, title="another")), tmp_path, print)
    assert read_model_description(other).guid != read_model_description(str(fmu)).guid


def test_shown_description_is_the_built_one(fmu, engine):
    shown = (archive.DESCRIPTION / "modelDescription.xml").read_text(encoding="utf-8")
    with zipfile.ZipFile(fmu) as opened:
        built = opened.read("modelDescription.xml").decode()
    passing = re.compile(r' (guid|version)="[^"]*"')
    assert passing.sub("", shown) == passing.sub("", built), "run: python build_fmu.py diesel_i6 --description"


def test_archive_holds_what_a_respected_fmu_holds(whole, whole_fmu):
    engine = whole.engine
    model = {"diesel_i6": "CranktrainDieselI6", "diesel_v8": "CranktrainDieselV8"}[engine.name]
    assert whole_fmu.name == f"{model}.fmu"
    with zipfile.ZipFile(whole_fmu) as opened:
        names = set(opened.namelist())
        page = opened.read("documentation/index.html").decode()
        assert opened.read("model.png")[:4] == b"\x89PNG"
        binaries = [opened.read(name) for name in names if name.endswith(".h5") or "__pycache__" in name]
    assert binaries == [] and validate_fmu(str(whole_fmu)) == []
    assert {
        "documentation/licenses/license.txt",
        "documentation/licenses/pythonfmu.txt",
        "documentation/externalDependencies.txt",
        f"binaries/linux64/{model}.so",
    } <= names
    mains = len(engine.crankshaft.main_widths)
    assert engine.title in page and f"bearing[1..{mains}].film_thickness_min" in page and "<!--" not in page
    assert f"piston[1..{engine.n_cylinders}].side_force" in page and "mount[1..4].force.y" in page


def test_every_real_has_a_unit_and_every_output_its_dependencies(whole, whole_fmu):
    with zipfile.ZipFile(whole_fmu) as opened:
        root = ElementTree.fromstring(opened.read("modelDescription.xml"))
    units = {unit.get("name") for unit in root.iter("Unit")}
    reals = list(root.iter("Real"))
    assert reals and all(real.get("unit") in units for real in reals)
    unknowns = root.find("ModelStructure/Outputs")
    assert all(unknown.get("dependencies") == "" for unknown in unknowns)
    cylinders = whole.engine.n_cylinders
    assert len(root.find("ModelStructure/InitialUnknowns")) == len(unknowns)
    variables = list(root.iter("ScalarVariable"))  # an index counts from 1
    assert all(variables[int(unknown.get("index")) - 1].get("causality") == "output" for unknown in unknowns)
    inputs = [v.get("name") for v in variables if v.get("causality") == "input"]
    pressures = [f"cylinder[{i + 1}].pressure" for i in range(cylinders)]
    behind = ["shaft.load_torque", "valvetrain.torque", "flywheel.axial_force", "pressure.angle"]
    taken = [f"cylinder[{i + 1}].deviation_taken" for i in range(cylinders)]
    assert inputs == ["speed", *pressures, *behind, *taken]


def test_the_documentation_counts_the_variables(whole_fmu):
    """Its table of FMUs: inputs, outputs, parameters."""
    check_counts(whole_fmu)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('unit = "Pa"', 'unit = "psi"', "unit 'psi'"),
        ('display_unit = "bar"', 'display_unit = "torr"', "display unit 'torr'"),
        ("nominal = 200.0", "nominel = 200.0", "did you mean 'nominal'"),
        ('setting = "gas_load"', "", "'gas.load'"),
        ('terminals = ["gas"]', 'terminals = ["gaz"]', "terminal 'gaz' does not exist; did you mean 'gas'"),
        ('terminals = ["gas"]', 'terminals = ["gaz"]', "terminal 'gaz' does not exist; did you mean 'gas'"),
    ],
)
def test_a_wrong_interface_is_refused_by_name(tmp_path, old, new, words):
    for name in ("interface.toml", "units.toml"):
        (tmp_path / name).write_text((archive.DESCRIPTION / name).read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=re.escape(words)):
        read_interface(tmp_path)


def test_code_that_needs_more_than_numba_is_refused(tmp_path, monkeypatch):
    sources = tmp_path / "fmu_src"
    shutil.copytree(running_code.SOURCES, sources, ignore=shutil.ignore_patterns("__pycache__"))
    errors = sources / "cranktrain" / "core" / "errors.py"
    errors.write_text(errors.read_text() + "\nimport h5py\n")
    monkeypatch.setattr(running_code, "SOURCES", sources)
    with pytest.raises(InputError, match="imports h5py"):
        running_code.running_code()


def test_packaged_code_never_names_the_package_it_came_from():
    named = set()
    for source in running_code.running_code().values():
        for node in ast.walk(ast.parse(running_code.renamed(source, "cranktrain_0"))):
            if isinstance(node, ast.ImportFrom):
                named.add(str(node.module).split(".")[0])
            if isinstance(node, ast.Import):
                named |= {alias.name.split(".")[0] for alias in node.names}
    assert "cranktrain_0" in named and "cranktrain" not in named


def test_failed_build_leaves_no_file(model, tmp_path):
    body = model.cranks["solid"]
    broken = replace(body, omega=body.omega * float("nan"))
    with pytest.raises(StoreError, match="omega"):
        engine_fmu.build(model._replace(cranks={"solid": broken}), tmp_path, print)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "built"),
    [
        ("", None),
        ("--native", None),
        ("--native --platform linux64,win64", ["linux64", "win64"]),
        ("--platform win64,linux64 --native", ["win64", "linux64"]),
        ("--python", ()),
        ("--platform 'linux64, win64,linux64'", ["linux64", "win64"]),
    ],
)
def test_the_command_asks_for_what_its_options_say(monkeypatch, words, built):
    asked = []
    monkeypatch.setattr(build, "build_fmu", lambda *_, platforms, **__: asked.append(platforms))
    assert build_fmu.main(["diesel_i6", *shlex.split(words)]) == 0
    assert asked == [built]


COARSER = {"diesel_i6": {"crankshaft": 25, "block": 70}, "diesel_v8": {"crankshaft": 50, "block": 60}}
"""Largest element edges, mm."""


def coarse_file(name, folder):
    """Engine file with coarser meshes and fewer modes of the block."""
    text = engine_path(name).read_text(encoding="utf-8")
    for table, size in COARSER[name].items():
        pattern = rf"(?s)(\n\[{table}\]\n.*?\nmesh_size = \{{ value = )[0-9.]+"
        text, count = re.subn(pattern, rf"\g<1>{size}", text, count=1)
        assert count == 1
    text, count = re.subn(r"(?s)(\n\[block\]\n.*?\nfixed_modes = \{ value = )[0-9]+", r"\g<1>30", text, count=1)
    assert count == 1
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.slow
@pytest.mark.parametrize("name", list(COARSER))
def test_from_engine_file_to_the_whole_engine_in_fmpy(name, tmp_path, script, ran):
    done = ran(archive.ROOT / "build_fmu.py", coarse_file(name, tmp_path), "-o", tmp_path, "--no-film-table")
    assert done.returncode == 0, done.stderr[-3000:]
    fmu = done.stdout.splitlines()[-1]
    ran = script(
        """
import json
import numpy as np
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu
assert validate_fmu(sys.argv[1]) == []
levels = {"block.level": "flexible", "damper.level": "fitted", "speed": 188.5}
result = simulate_fmu(sys.argv[1], start_values=levels, stop_time=1.2, output_interval=2e-4)
assert all(np.isfinite(result[name]).all() for name in result.dtype.names)
last = result["time"] > 1.2 - 6 * 4 * np.pi / 188.5
mean = lambda name: float(result[name][last].mean())
print(json.dumps({name: mean(name) for name in result.dtype.names}))
""",
        fmu,
    )
    mean = json.loads(ran.stdout)
    # Over some cycles the mounts hold the engine against the torque that it gives to its shaft; the rest is its swing.
    mounts = load_engine(name).mounts
    moment = 0.0
    for i, (x, y, _) in enumerate(mounts.positions, 1):
        moment += x * mean[f"mount[{i}].force.y"] - y * mean[f"mount[{i}].force.x"] + mean[f"mount[{i}].moment.z"]
    assert moment == pytest.approx(mean["shaft.torque"], rel=0.02)
    assert mean["shaft.torque"] > 500.0 and mean["damper.heat"] > 10.0
