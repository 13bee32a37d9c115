"""The combustion FMU: built, valid, equal to direct calls, restorable, and refusing in one line."""

import json
import subprocess
import sys
import zipfile

import numpy as np
import pytest
from combustion_cycles import RPM, running, six
from fmpy import read_csv, read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.fmu import archive, module_fmu
from cranktrain.fmu.build import build_fmu
from cranktrain.modules.combustion.simulation import CombustionSimulation
from cranktrain.modules.module_settings import with_chosen
from cranktrain.modules.register import MODULES, module_files, module_path


@pytest.fixture(scope="session")
def combustion_fmu(tmp_path_factory):
    return build_fmu("combustion_i6", tmp_path_factory.mktemp("combustion"), platforms=())


@pytest.mark.parametrize("name", list(module_files()))
def test_every_module_file_makes_a_valid_fmu(name, tmp_path):
    path = build_fmu(name, tmp_path, platforms=())
    assert validate_fmu(str(path)) == []
    assert path.stem == "".join(part.capitalize() for part in name.split("_"))
    variables = read_model_description(str(path)).modelVariables
    counted = [sum(v.causality == kind for v in variables) for kind in ("input", "output", "parameter")]
    text = (archive.ROOT / "docs" / "fmu.md").read_text(encoding="utf-8")
    row = next(line for line in text.splitlines() if line.startswith(f"| `{path.name}`"))
    assert [int(cell) for cell in row.split("|")[3:6]] == counted


def test_equal_inputs_give_equal_bytes(combustion_fmu, tmp_path):
    assert build_fmu("combustion_i6", tmp_path, platforms=()).read_bytes() == combustion_fmu.read_bytes()


def test_a_process_that_has_run_an_fmu_builds_one_whole(combustion_fmu, tmp_path):
    """The FMU brings the wrapping library along, but not the binaries that its builder takes from there."""
    code = f"""
import sys
from fmpy import simulate_fmu
simulate_fmu({str(combustion_fmu)!r}, stop_time=2e-4, output_interval=1e-4, output=["cylinder[1].pressure"])
assert "site-packages" not in sys.modules["pythonfmu"].__file__
from cranktrain.fmu.build import build_fmu
build_fmu("combustion_i6", {str(tmp_path)!r}, platforms=())
"""
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
    assert (tmp_path / combustion_fmu.name).read_bytes() == combustion_fmu.read_bytes()


def test_it_carries_what_it_uses_and_nothing_of_the_cranktrain(combustion_fmu):
    with zipfile.ZipFile(combustion_fmu) as opened:
        names = opened.namelist()
        page = opened.read("documentation/index.html").decode()
    ours = [name.partition("/")[2].partition("/")[2] for name in names if name.startswith("resources/cranktrain_")]
    folders = {name.rpartition("/")[0] for name in ours if name.endswith(".py")} - {""}
    assert folders == {"core", "modules", "modules/combustion"}
    assert "cylinder[1..6].fuel_mass" in page and "<!--" not in page


def test_variables_are_those_of_the_simulation():
    product = module_fmu.module_product(module_files()["combustion_i6"])
    simulation = running(six())
    for cause, names in (("input", simulation.input_names), ("output", simulation.output_names)):
        assert tuple(v.name for v in product.variables if v.causality == cause) == names
    starts = {v.name: v.start for v in product.variables}
    for name, value in zip(simulation.input_names[2:], simulation.inputs[2:], strict=True):
        assert starts[name] == value
    settings = {v.setting: v.start for v in product.variables if v.causality == "parameter"}
    angles = {f"firing_angles[{i + 1}]": angle for i, angle in enumerate(six().firing_angles)}
    assert settings == {name: getattr(six(), name) for name in settings if name not in angles} | angles


def test_fmu_and_direct_calls_agree_to_the_bit(combustion_fmu, script):
    done = script("import json\nprint(json.dumps(Unit(sys.argv[1]).start().run(200).bits()))", combustion_fmu)
    simulation = running(six())
    for k in range(200):
        simulation.step(k * 1e-4 + 1e-4)
    assert json.loads(done.stdout) == [float(value).hex() for value in simulation.outputs]


def test_a_state_goes_on_in_another_process_to_the_bit(combustion_fmu, script, tmp_path):
    keep = """
unit = Unit(sys.argv[1]).start({"scatter.fuel": 0.02, "scatter.seed": 7.0}).run(150)
state = unit.fmu.getFMUstate()
open(sys.argv[2], "wb").write(unit.fmu.serializeFMUstate(state))
print(unit.run(300, first=150).bits())
"""
    go_on = """
unit = Unit(sys.argv[1]).start()
unit.fmu.setFMUstate(unit.fmu.deSerializeFMUstate(open(sys.argv[2], "rb").read()))
print(unit.run(300, first=150).bits())
"""
    first = script(keep, combustion_fmu, tmp_path / "state").stdout
    assert script(go_on, combustion_fmu, tmp_path / "state").stdout == first


def test_refusals_are_one_line(combustion_fmu, script):
    script(
        """
unit = Unit(sys.argv[1])
for name, value, words in (
    ("intake.temperature", 10.0, "'intake.temperature' is 10.0"),
    ("cylinder[3].fuel_mass", -1.0, "'cylinder[3].fuel_mass' is -1.0"),
    ("lift.source", "both", "valid: auto, built-in, input"),
):
    status, text = unit.refusal(lambda: unit.set_named(name, value))
    assert words in text, text
unit.set_named("geometry.rod_length", 0.05)
status, text = unit.refusal(lambda: unit.start())
assert "'geometry.rod_length' 50 mm does not exceed" in text, text
""",
        combustion_fmu,
    )


def test_two_modules_run_in_one_process(combustion_fmu, script, tmp_path):
    other = build_fmu("combustion_v8", tmp_path, platforms=())
    script(
        """
alone = [Unit(path).start().run(30).bits() for path in sys.argv[1:3]]
a, b = (Unit(path).start() for path in sys.argv[1:3])
for k in range(30):
    a.run(1, first=k)
    b.run(1, first=k)
assert [a.bits(), b.bits()] == alone
""",
        combustion_fmu,
        other,
    )


def test_the_cross_check_files_are_met(tmp_path):
    done = subprocess.run(
        [sys.executable, str(archive.ROOT / "build_fmu.py"), "combustion_i6", "-o", str(tmp_path), "--reference",
         "--python"],
        capture_output=True, text=True, timeout=3600,
    )  # fmt: skip
    assert done.returncode == 0 and done.stdout.splitlines() == [str(tmp_path / "CombustionI6.fmu")], done.stderr
    path = tmp_path / "CombustionI6.fmu"
    options = dict(line.split(", ") for line in (tmp_path / "CombustionI6_ref.opt").read_text().splitlines())
    given, reference = (read_csv(str(tmp_path / f"CombustionI6_{kind}.csv")) for kind in ("in", "ref"))
    assert given["crank.angle"][-1] == pytest.approx(float(options["StopTime"]) * 2000.0 * RPM)
    result = simulate_fmu(str(path), input=given, output_interval=float(options["StepSize"]))
    for name in reference.dtype.names:
        assert np.array_equal(result[name], reference[name]), name
    # a reference of another kind is left alone
    (tmp_path / "CombustionI6_in.csv").write_text("something of somebody's")
    again = subprocess.run(
        [sys.executable, str(archive.ROOT / "build_fmu.py"), "combustion_i6", "-o", str(tmp_path), "--reference",
         "--python"],
        capture_output=True, text=True, timeout=3600,
    )  # fmt: skip
    assert again.returncode == 2 and len(again.stderr.splitlines()[-1:]) == 1


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["combustion_i7"], "unknown module 'combustion_i7': did you mean 'combustion_i6'?"),
        (["combustion_i6", "--no-block"], "belong to an engine, not to a module"),
    ],
)
def test_what_cannot_be_built_is_refused_in_one_line(words, says, tmp_path):
    done = subprocess.run(
        [sys.executable, str(archive.ROOT / "build_fmu.py"), *words, "-o", str(tmp_path / "dist")],
        capture_output=True, text=True, timeout=3600,
    )  # fmt: skip
    assert done.returncode == 2 and done.stdout == "" and not (tmp_path / "dist").exists()
    assert len(done.stderr.splitlines()) == 1 and says in done.stderr


def test_a_file_of_an_unknown_module_is_refused(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(module_files()["combustion_i6"].read_text("utf-8").replace('module = "comb', 'module = "camb'))
    assert module_path(path) == path
    with pytest.raises(InputError, match=r"mine.toml: module: 'cambustion' is not known; did you mean 'combustion'"):
        build_fmu(path, tmp_path)


def test_the_register_names_folders():
    for name, row in MODULES.items():
        assert (row.folder / "interface.toml").is_file() and row.folder.name.replace("_", "") == name


def test_the_model_description_tells_the_geometry(combustion_fmu):
    starts = {v.name: v.start for v in read_model_description(str(combustion_fmu)).modelVariables}
    assert float(starts["geometry.bore"]) == 0.105 and float(starts["geometry.stroke"]) == pytest.approx(0.12)
    assert [float(starts[f"cylinder[{i}].firing_angle"]) for i in range(1, 7)] == pytest.approx(
        list(six().firing_angles)
    )


def test_whatever_the_interface_allows_runs_or_is_refused():
    """Parameters and inputs at their bounds and between, steps from a picosecond to a twentieth of a second."""
    variables = module_fmu.module_product(module_files()["combustion_i6"]).variables
    of = {cause: [v for v in variables if v.causality == cause] for cause in ("parameter", "input")}
    random = np.random.default_rng(16)

    def value(variable):
        if variable.type == "String":
            return str(random.choice(variable.choices))
        low = -1e3 if variable.min is None else variable.min
        high = 1e3 if variable.max is None else variable.max
        near = min(max(variable.start * 10.0 ** random.normal(0.0, 0.5), low), high)
        return float(random.choice([low, high, near, near, random.uniform(low, high)]))

    ran = refused = 0
    for _ in range(40):
        picked = random.choice(of["parameter"], size=random.integers(0, 9), replace=False)
        chosen = {v.setting: value(v) for v in picked if v.setting not in ("tolerance", "start_cycles")}
        try:
            simulation = CombustionSimulation(with_chosen(six(), chosen))
            for k in random.choice(len(of["input"]), size=random.integers(0, 6), replace=False):
                simulation.inputs[k] = value(of["input"][k])
            simulation.inputs[:2] = random.choice([0.0, 1.0, 50.0, 200.0, 500.0]), 0.0
            simulation.initialize()
            for _ in range(10):
                simulation.step(simulation.time + 10.0 ** random.uniform(-12.0, -1.3))
                assert np.isfinite(simulation.outputs).all(), chosen
            ran += 1
        except CranktrainError as error:
            assert "\n" not in str(error)
            refused += 1
    assert ran > 15 and refused > 3, (ran, refused)
