"""FMUs of modules: built, valid, equal to direct calls, restorable, side by side, and refusing in one line."""

import json
import subprocess
import sys
import zipfile
from types import ModuleType
from typing import NamedTuple

import combustion_cycles
import numpy as np
import pytest
import valve_trains
from fmpy import read_csv, simulate_fmu
from fmpy.validation import validate_fmu
from fmus_by_version import check_counts

from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.fmu import archive, module_fmu
from cranktrain.fmu.build import build_fmu
from cranktrain.modules.combustion.simulation import CombustionSimulation
from cranktrain.modules.module_settings import with_chosen
from cranktrain.modules.register import module_files, module_path
from cranktrain.modules.valve_train.simulation import ValveTrainSimulation

RPM = combustion_cycles.RPM
BUILD = archive.ROOT / "build_fmu.py"


class Module(NamedTuple):
    """A module of the six: its models, a family of its page, and what its FMU is asked for."""

    kind: str
    folder: str
    models: ModuleType
    simulation: type
    shown: str
    refused: tuple
    """Name, value and words of each start value that is refused."""
    no_start: tuple
    cheap: dict
    """Settings that keep runs of any parameters short."""


ROWS = (
    Module(
        "combustion", "combustion", combustion_cycles, CombustionSimulation, "cylinder[1..6].fuel_mass",
        (("intake.temperature", 10.0, "'intake.temperature' is 10.0"),
         ("cylinder[3].fuel_mass", -1.0, "'cylinder[3].fuel_mass' is -1.0"),
         ("lift.source", "both", "valid: auto, built-in, input")),
        ("geometry.rod_length", 0.05, "'geometry.rod_length' 50 mm does not exceed"), {},
    ),
    Module(
        "valvetrain", "valve_train", valve_trains, ValveTrainSimulation, "cylinder[1..6].intake_lift",
        (("crank.speed", -1.0, "'crank.speed' is -1.0"), ("train.stiffness", 10.0, "'train.stiffness' is 10.0"),
         ("inputs.at", "middle", "valid: begin, end")),
        ("cam.base_radius", 0.004, "'cam.base_radius' 4 mm is too small for the intake cam"),
        {"start_cycles": 1.0, "tolerance": 1e-3},
    ),
)  # fmt: skip


@pytest.fixture(scope="module", params=ROWS, ids=lambda row: row.kind)
def module(request):
    return request.param


@pytest.fixture(scope="module")
def fmu(module, tmp_path_factory):
    return build_fmu(f"{module.kind}_i6", tmp_path_factory.mktemp(module.kind), platforms=())


def product_of(module):
    return module_fmu.module_product(module_files()[f"{module.kind}_i6"])


@pytest.mark.parametrize("name", list(module_files()))
def test_every_module_file_makes_a_valid_fmu(name, tmp_path):
    path = build_fmu(name, tmp_path, platforms=())
    assert validate_fmu(str(path)) == []
    assert path.stem == "".join(part.capitalize() for part in name.split("_"))
    check_counts(path)


def test_a_process_that_has_run_an_fmu_builds_one_whole_and_equal(module, fmu, tmp_path):
    """The FMU brings the wrapping library along, but not the binaries that its builder takes from there."""
    code = f"""
import sys
from fmpy import simulate_fmu
simulate_fmu({str(fmu)!r}, stop_time=2e-4, output_interval=1e-4)
assert "site-packages" not in sys.modules["pythonfmu"].__file__
from cranktrain.fmu.build import build_fmu
build_fmu("{module.kind}_i6", {str(tmp_path)!r}, platforms=())
"""
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
    assert (tmp_path / fmu.name).read_bytes() == fmu.read_bytes()


def test_it_carries_what_it_uses_and_nothing_of_the_cranktrain(module, fmu):
    with zipfile.ZipFile(fmu) as opened:
        names = opened.namelist()
        page = opened.read("documentation/index.html").decode()
    ours = [name.partition("/")[2].partition("/")[2] for name in names if name.startswith("resources/cranktrain_")]
    folders = {name.rpartition("/")[0] for name in ours if name.endswith(".py")} - {""}
    assert folders == {"core", "modules", f"modules/{module.folder}"}
    assert module.shown in page and "<!--" not in page


def test_variables_are_those_of_the_simulation(module):
    product, six = product_of(module), module.models.six()
    simulation = module.models.running(six)
    for cause, names in (("input", simulation.input_names), ("output", simulation.output_names)):
        assert tuple(v.name for v in product.variables if v.causality == cause) == names
    starts = {v.name: v.start for v in product.variables}
    for name, value in zip(simulation.input_names[2:], simulation.inputs[2:], strict=True):
        assert starts[name] == value
    settings = {v.setting: v.start for v in product.variables if v.causality == "parameter"}
    angles = {f"firing_angles[{i + 1}]": angle for i, angle in enumerate(six.firing_angles)}
    assert settings == {name: getattr(six, name) for name in settings if name not in angles} | angles


def test_fmu_and_direct_calls_agree_to_the_bit(module, fmu, script):
    done = script("import json\nprint(json.dumps(Unit(sys.argv[1]).start().run(200).bits()))", fmu)
    simulation = module.models.running(module.models.six())
    for k in range(200):
        simulation.step(k * 1e-4 + 1e-4)
    assert json.loads(done.stdout) == [float(value).hex() for value in simulation.outputs]


def test_refusals_are_one_line(module, fmu, script):
    script(
        f"""
unit = Unit(sys.argv[1])
for name, value, words in {module.refused!r}:
    unit.refuses(lambda: unit.set_named(name, value), words)
name, value, words = {module.no_start!r}
unit.set_named(name, value)
unit.refuses(lambda: unit.start(), words)
""",
        fmu,
    )


def test_modules_of_two_kinds_and_engines_run_in_one_process(script, tmp_path):
    script(
        """
alone = [Unit(path).start().run(30).bits() for path in sys.argv[1:]]
units = [Unit(path).start() for path in sys.argv[1:]]
for k in range(30):
    for unit in units:
        unit.run(1, first=k)
assert [unit.bits() for unit in units] == alone
""",
        *(build_fmu(name, tmp_path, platforms=()) for name in ("combustion_i6", "combustion_v8", "valvetrain_i6")),
    )


def test_the_cross_check_files_are_met(module, ran, tmp_path):
    words = f"{module.kind}_i6", "-o", tmp_path, "--reference", "--python"
    done, stem = ran(BUILD, *words), f"{module.kind.capitalize()}I6"
    assert done.returncode == 0 and done.stdout.splitlines() == [str(tmp_path / f"{stem}.fmu")], done.stderr
    options = dict(line.split(", ") for line in (tmp_path / f"{stem}_ref.opt").read_text().splitlines())
    given, reference = (read_csv(str(tmp_path / f"{stem}_{kind}.csv")) for kind in ("in", "ref"))
    if "crank.angle" in given.dtype.names:
        assert given["crank.angle"][-1] == pytest.approx(float(options["StopTime"]) * 2000.0 * RPM)
    result = simulate_fmu(str(tmp_path / f"{stem}.fmu"), input=given, output_interval=float(options["StepSize"]))
    for name in reference.dtype.names:
        assert np.array_equal(result[name], reference[name]), name
    # a reference of another kind is left alone
    (tmp_path / f"{stem}_in.csv").write_text("something of somebody's")
    again = ran(BUILD, *words)
    assert again.returncode == 2 and len(again.stderr.splitlines()[-1:]) == 1


def test_a_file_of_an_unknown_module_is_refused(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(module_files()["combustion_i6"].read_text("utf-8").replace('module = "comb', 'module = "camb'))
    assert module_path(path) == path
    with pytest.raises(InputError, match=r"mine.toml: module: 'cambustion' is not known; did you mean 'combustion'"):
        build_fmu(path, tmp_path)


def test_whatever_the_interface_allows_runs_or_is_refused(module):
    """Parameters and inputs at their bounds and between, steps from a picosecond to a twentieth of a second."""
    of = {cause: [v for v in product_of(module).variables if v.causality == cause] for cause in ("parameter", "input")}
    random = np.random.default_rng(16)

    def value(variable):
        if variable.type == "String":
            return str(random.choice(variable.choices))
        low = -1e3 if variable.min is None else variable.min
        high = 1e3 if variable.max is None else variable.max
        near = min(max(variable.start * 10.0 ** random.normal(0.0, 0.5), low), high)
        return float(random.choice([low, high, near, near, near, random.uniform(low, high)]))

    ran = refused = 0
    for _ in range(40):
        picked = random.choice(of["parameter"], size=random.integers(0, 8), replace=False)
        chosen = {v.setting: value(v) for v in picked if v.setting not in ("tolerance", "start_cycles")}
        try:
            simulation = module.simulation(with_chosen(module.models.six(), chosen | module.cheap))
            count = len(of["input"])
            for k in random.choice(count, size=min(count, random.integers(0, 6)), replace=False):
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
