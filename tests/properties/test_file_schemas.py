"""JSON schemas for editors are made of what the readers read by: both take the same files and refuse the same slips."""

import json
import re
import tomllib
from pathlib import Path

import pytest
from jsonschema import Draft7Validator
from one_line import one_line
from refusals import refused_files
from superelements import shaft, write_superelement

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.engine.file import engine_folder, engine_names, engine_path, load_engine
from cranktrain.modules.register import module_files, module_of
from cranktrain.structure.fem.own_body import read_body
from cranktrain.studies.file_schemas import FILE_KINDS, file_schema
from cranktrain.studies.scene import load_scene
from cranktrain_lab.calibration.targets import load_targets
from cranktrain_lab.harness.file import load_harness
from cranktrain_lab.identification.identify import read_measured_file

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
OF_MODULE = {"combustion": "combustion", "valvetrain": "valve-train"}
FILES = [
    *(("engine", engine_path(name)) for name in engine_names()),
    ("engine", EXAMPLES / "four_with_balancers.toml"),
    *((OF_MODULE[module_of(path).name], path) for path in module_files().values()),
    *(("scene", EXAMPLES / f"{name}.toml") for name in ("scene", "six_at_2000", "v8")),
    *(("scene", path) for path in sorted((ROOT / "tests" / "data" / "scenes").glob("*.toml"))),
    *(("targets", path) for path in sorted(engine_folder().glob("*.targets.toml"))),
    ("targets", EXAMPLES / "diesel_i6_pulley.targets.toml"),
    ("measured", EXAMPLES / "diesel_i6_measured.toml"),
    ("harness", EXAMPLES / "harness.toml"),
    *(("harness", path) for path in sorted((ROOT / "tests" / "system").glob("*.toml"))),
]
READERS = {
    "measured": read_measured_file,
    "targets": lambda path: load_targets(path, load_engine("diesel_i6")),
    "engine": load_engine, "scene": load_scene, "harness": load_harness,
    "combustion": lambda path: module_of(path).read(path), "valve-train": lambda path: module_of(path).read(path),
}  # fmt: skip


@pytest.fixture(scope="module")
def validators():
    """A validator of each kind of file, whose schema is one of draft 7."""
    schemas = {kind: file_schema(kind) for kind in FILE_KINDS}
    for schema in schemas.values():
        Draft7Validator.check_schema(schema)
        json.dumps(schema, allow_nan=False)
    return {kind: Draft7Validator(schema) for kind, schema in schemas.items()}


@pytest.mark.parametrize(("kind", "path"), FILES, ids=lambda part: getattr(part, "stem", part))
def test_files_that_are_read_are_valid(validators, kind, path):
    errors = [error.message for error in validators[kind].iter_errors(tomllib.loads(path.read_text("utf-8")))]
    assert not errors


SIX = (engine_folder() / "diesel_i6.toml").read_text("utf-8")
FOUR = (EXAMPLES / "four_with_balancers.toml").read_text("utf-8")
SCENE = (EXAMPLES / "scene.toml").read_text("utf-8")
RUN_UP = SCENE.replace("speeds_rpm = [2000]\n", "") + "\n[run_up]\nfrom = 1000\nto = 2000\npoints = 5\n"
HARNESS = (EXAMPLES / "harness.toml").read_text("utf-8")
TARGETS = (EXAMPLES / "diesel_i6_pulley.targets.toml").read_text("utf-8")
BURN = module_files()["combustion_i6"].read_text("utf-8")
VALVES = module_files()["valvetrain_i6"].read_text("utf-8")
TEXTS = {
    "SIX": SIX, "FOUR": FOUR, "SCENE": SCENE, "RUN_UP": RUN_UP, "HARNESS": HARNESS, "TARGETS": TARGETS, "BURN": BURN,
    "VALVES": VALVES,
}  # fmt: skip


def test_a_superelement_is_valid_and_its_slips_are_not(validators, tmp_path):
    path = write_superelement(tmp_path, shaft(4), {"start": 1, "end": 5})
    text = path.read_text("utf-8")
    assert validators["superelement"].is_valid(tomllib.loads(text))
    for old, new, said in (
        ("units", "unit", "unknown key 'unit'; did you mean 'units'"),
        ("m-kg-s", "mm-kg-s", "units 'mm-kg-s' do not exist"),
        ('matrices = "', 'matrices = 3 # "', "matrices: 3 is not a text"),
        ("5 = [", "5 = [1.0, ", "expected is NUMBER"),
    ):
        path.write_text(text.replace(old, new, 1), "utf-8")
        assert not validators["superelement"].is_valid(tomllib.loads(path.read_text("utf-8")))
        with pytest.raises(InputError, match=said):
            read_body(path)


@pytest.mark.parametrize(("kind", "name", "old", "new", "said"), refused_files()["schemas"]["slips"])
def test_slips_are_refused_by_the_schema_and_by_the_reader(validators, tmp_path, kind, name, old, new, said):
    pattern = old if "\\" in old else re.escape(old)
    assert re.search(pattern, TEXTS[name])
    wrong = re.sub(pattern, new, TEXTS[name], count=1)
    assert not validators[kind].is_valid(tomllib.loads(wrong))
    path = tmp_path / "own.toml"
    path.write_text(wrong, "utf-8")
    with one_line(match=rf"^own\.toml: .*({said})"):
        READERS[kind](path)


def test_ranges_are_those_of_the_reader_in_every_unit(validators):
    """An end in each of a quantity's units, just inside and just outside; a default of 0, though no rubber has it."""
    of = validators["engine"].evolve(
        schema={**validators["engine"].schema, "$ref": "#/definitions/OilTemperature_entries"}
    )
    for unit, low, high in (("degC", -80.0, 300.0), ("K", 193.15, 573.15)):
        for value, valid in ((low, True), (high, True), (low - 1e-3, False), (high + 1e-3, False)):
            entry = {"value": [value], "unit": unit, "origin": "chosen"}
            assert of.is_valid(entry) == valid, entry
    document = tomllib.loads(SIX)
    for value, valid in ((0, True), (1e-5, False)):
        document["damper"]["loss_factor"] = {"value": value, "origin": "chosen"}
        assert validators["engine"].is_valid(document) == valid


def test_the_verb_prints_or_writes_the_schema(tmp_path, capsys):
    target = tmp_path / "engine.schema.json"
    assert main(["schema", "engine", "--output", str(target)]) == 0
    assert main(["schema", "engine", "--output", str(target)]) == 0, "it replaces a schema"
    assert capsys.readouterr().out == "" and main(["schema", "engine"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads(target.read_text("utf-8")) == json.loads(json.dumps(file_schema("engine")))
    other = tmp_path / "other.toml"
    other.write_text("x = 1", "utf-8")
    assert main(["schema", "scene", "--output", str(other)]) == 2 and other.read_text("utf-8") == "x = 1"


def test_a_schema_is_the_same_whatever_was_read_before():
    """Quantities of modules and tables of harness files may have one name: Ramp."""
    before = file_schema("harness")
    for kind in ("combustion", "valve-train", "engine"):
        file_schema(kind)
    assert file_schema("harness") == before and "note" not in json.dumps(before)
