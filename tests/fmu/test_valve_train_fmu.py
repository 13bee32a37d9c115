"""The valve train FMU: equal to direct calls, restorable, refusing in one line, beside another module in one process.

Validity, sizes and the cross-check of builds are those of every module file, see ``test_combustion_fmu.py``.
"""

import json
import subprocess
import sys
import zipfile

import numpy as np
import pytest
from fmpy import read_csv, simulate_fmu
from valve_trains import running, six

from cranktrain.core.errors import CranktrainError
from cranktrain.fmu import archive, module_fmu
from cranktrain.fmu.build import build_fmu
from cranktrain.modules.module_settings import with_chosen
from cranktrain.modules.register import module_files
from cranktrain.modules.valve_train.simulation import ValveTrainSimulation


@pytest.fixture(scope="module")
def valvetrain_fmu(tmp_path_factory):
    return build_fmu("valvetrain_i6", tmp_path_factory.mktemp("valvetrain"), platforms=())


def test_it_carries_what_it_uses(valvetrain_fmu):
    with zipfile.ZipFile(valvetrain_fmu) as opened:
        names = opened.namelist()
    ours = [name.partition("/")[2].partition("/")[2] for name in names if name.startswith("resources/cranktrain_")]
    assert {name.rpartition("/")[0] for name in ours if name.endswith(".py")} - {""} == {
        "core", "modules", "modules/valve_train",
    }  # fmt: skip


def test_variables_are_those_of_the_simulation():
    product = module_fmu.module_product(module_files()["valvetrain_i6"])
    simulation = running(six())
    for cause, names in (("input", simulation.input_names), ("output", simulation.output_names)):
        assert tuple(v.name for v in product.variables if v.causality == cause) == names
    settings = {v.setting: v.start for v in product.variables if v.causality == "parameter"}
    angles = {f"firing_angles[{i + 1}]": angle for i, angle in enumerate(six().firing_angles)}
    assert settings == {name: getattr(six(), name) for name in settings if name not in angles} | angles


def test_fmu_and_direct_calls_agree_to_the_bit(valvetrain_fmu, script):
    done = script("import json\nprint(json.dumps(Unit(sys.argv[1]).start().run(200).bits()))", valvetrain_fmu)
    simulation = running(six())
    for k in range(200):
        simulation.step(k * 1e-4 + 1e-4)
    assert json.loads(done.stdout) == [float(value).hex() for value in simulation.outputs]


def test_a_state_goes_on_in_another_process_to_the_bit(valvetrain_fmu, script, tmp_path):
    keep = """
unit = Unit(sys.argv[1]).start({"crank.speed": 360.0}).run(150)
state = unit.fmu.getFMUstate()
open(sys.argv[2], "wb").write(unit.fmu.serializeFMUstate(state))
print(unit.run(300, first=150).bits())
"""
    go_on = """
unit = Unit(sys.argv[1]).start()
unit.set_named("crank.speed", 360.0)
unit.fmu.setFMUstate(unit.fmu.deSerializeFMUstate(open(sys.argv[2], "rb").read()))
print(unit.run(300, first=150).bits())
"""
    first = script(keep, valvetrain_fmu, tmp_path / "state").stdout
    assert script(go_on, valvetrain_fmu, tmp_path / "state").stdout == first


def test_refusals_are_one_line(valvetrain_fmu, script):
    script(
        """
unit = Unit(sys.argv[1])
for name, value, words in (
    ("crank.speed", -1.0, "'crank.speed' is -1.0"),
    ("train.stiffness", 10.0, "'train.stiffness' is 10.0"),
    ("inputs.at", "middle", "valid: begin, end"),
):
    status, text = unit.refusal(lambda: unit.set_named(name, value))
    assert words in text, text
unit.set_named("cam.base_radius", 0.004)
status, text = unit.refusal(lambda: unit.start())
assert "'cam.base_radius' 4 mm is too small for the intake cam" in text, text
""",
        valvetrain_fmu,
    )


def test_two_kinds_of_modules_run_in_one_process(valvetrain_fmu, script, tmp_path):
    other = build_fmu("combustion_i6", tmp_path, platforms=())
    script(
        """
alone = [Unit(path).start().run(30).bits() for path in sys.argv[1:3]]
a, b = (Unit(path).start() for path in sys.argv[1:3])
for k in range(30):
    a.run(1, first=k)
    b.run(1, first=k)
assert [a.bits(), b.bits()] == alone
""",
        valvetrain_fmu,
        other,
    )


def test_the_cross_check_files_are_met(tmp_path):
    done = subprocess.run(
        [sys.executable, str(archive.ROOT / "build_fmu.py"), "valvetrain_i6", "-o", str(tmp_path), "--reference",
         "--python"],
        capture_output=True, text=True, timeout=3600,
    )  # fmt: skip
    assert done.returncode == 0 and done.stdout.splitlines() == [str(tmp_path / "ValvetrainI6.fmu")], done.stderr
    options = dict(line.split(", ") for line in (tmp_path / "ValvetrainI6_ref.opt").read_text().splitlines())
    given, reference = (read_csv(str(tmp_path / f"ValvetrainI6_{kind}.csv")) for kind in ("in", "ref"))
    path = str(tmp_path / "ValvetrainI6.fmu")
    result = simulate_fmu(path, input=given, output_interval=float(options["StepSize"]))
    for name in reference.dtype.names:
        assert np.array_equal(result[name], reference[name]), name


def test_whatever_the_interface_allows_runs_or_is_refused():
    """Parameters and inputs at their bounds and between, steps from a picosecond to a twentieth of a second."""
    variables = module_fmu.module_product(module_files()["valvetrain_i6"]).variables
    parameters = [v for v in variables if v.causality == "parameter"]
    random = np.random.default_rng(17)

    def value(variable):
        if variable.type == "String":
            return str(random.choice(variable.choices))
        near = min(max(variable.start * 10.0 ** random.normal(0.0, 0.5), variable.min), variable.max)
        bounds = [variable.min, variable.max]
        return float(random.choice([*bounds, near, near, near, near, near]))

    ran = refused = 0
    for _ in range(40):
        picked = random.choice(parameters, size=random.integers(0, 6), replace=False)
        chosen = {v.setting: value(v) for v in picked if v.setting not in ("tolerance", "start_cycles")}
        try:
            simulation = ValveTrainSimulation(with_chosen(six(), chosen | {"start_cycles": 1.0, "tolerance": 1e-3}))
            simulation.inputs[:] = random.choice([0.0, 1.0, 50.0, 200.0, 500.0]), 0.0
            simulation.initialize()
            for _ in range(10):
                simulation.step(simulation.time + 10.0 ** random.uniform(-12.0, -1.3))
                assert np.isfinite(simulation.outputs).all(), chosen
            ran += 1
        except CranktrainError as error:
            assert "\n" not in str(error)
            refused += 1
    assert ran > 15 and refused > 3, (ran, refused)
