"""FMUs of scenes: they run as ``cranktrain run`` does, to the last bit, and carry no more than their levels need."""

import json
import re
import zipfile

import pytest
from coarse_engines import COARSE, coarse
from engine_texts import coarse_text
from film_tables import coarse_mains
from fmpy import read_model_description
from fmpy.validation import validate_fmu
from some import some

from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.fmu import flat
from cranktrain.fmu.build import build_scene
from cranktrain.studies.planning.planning import plan
from cranktrain.studies.planning.scene_model import SceneModel
from cranktrain.studies.scene import load_scene

SCENES = {
    "torsion": ("diesel_i6", 'outputs = ["pulley.torsion", "shaft.torque"]\ncrank = "torsional"\n'),
    "rigid loads": (
        "diesel_i6",
        'outputs = ["bearing[4].force.y", "bearing[2].force.x"]\ncrank = "rigid"\nbearings = "impedance"\n',
    ),
    "v8-damped": (
        "diesel_v8",
        'outputs = ["pulley.torsion", "damper.torque"]\ncrank = "solid"\nbearings = "roller"\ndamper = true\n',
    ),
}


@pytest.fixture(scope="module", autouse=True)
def coarse_tables():
    """Plans look at levels above the chosen one."""
    with pytest.MonkeyPatch.context() as patch:
        coarse_mains(patch)
        yield


@pytest.fixture(scope="module", params=list(SCENES))
def scene(request, tmp_path_factory):
    """Scene on a coarse engine, with method and step fixed."""
    name, wishes = SCENES[request.param]
    folder = tmp_path_factory.mktemp("scene")
    (folder / "engine.toml").write_text(coarse_text(name, 1e3 * COARSE[name], count=1), encoding="utf-8")
    frequency = 50 if "rigid" in request.param else 500
    path = folder / f"{request.param}.toml"
    path.write_text(
        f'engine = "engine.toml"\nspeeds_rpm = [1600]\nfrequency_hz = {frequency}\naccuracy = 0.4\ncycles = 2\n'
        f'integrator = "esdirk4"\nstep_deg = 3\nload = 0.8\n{wishes}',
        encoding="utf-8",
    )
    return load_scene(path)


@pytest.fixture(scope="module")
def scene_fmu(scene, tmp_path_factory):
    said = []
    path = build_scene(scene, tmp_path_factory.mktemp("fmu"), said.append)
    assert any(re.search(r"\d MB, model data \d", line) for line in said)
    return path


def test_outputs_are_those_of_a_run(scene, scene_fmu, script):
    made = plan(scene)
    run = SceneModel(scene).run(made.case, scene.speeds[0])
    h = communication_step(scene.speeds[0], made.case.step)
    steps = run.time.size - 1
    done = script(
        """
names, steps, h = json.loads(sys.argv[2]), int(sys.argv[3]), float.fromhex(sys.argv[4])
unit = Unit(sys.argv[1]).start()
rows = [unit.get(*names)]
for k in range(steps):
    unit.fmu.doStep(k * h, (k + 1) * h - k * h)
    rows.append(unit.get(*names))
print(json.dumps([[value.hex() for value in row] for row in rows]))
unit.close()
""".replace("names,", "import json\nnames,", 1),
        scene_fmu, json.dumps(scene.outputs), steps, h.hex(),
    )  # fmt: skip
    found = [[float.fromhex(value) for value in row] for row in json.loads(done.stdout.splitlines()[-1])]
    for i, name in some(enumerate(scene.outputs)):
        values = [row[i] for row in found]
        scale = max(abs(run.outputs[name]))
        assert values == pytest.approx(run.outputs[name].tolist(), rel=1e-12, abs=1e-12 * scale), name


def test_it_carries_what_its_level_needs(scene, scene_fmu):
    with zipfile.ZipFile(scene_fmu) as archive:
        bin_name = next(name for name in archive.namelist() if name.endswith("model.bin"))
        data = archive.read(bin_name)
    model = flat.from_bytes(data)
    assert model.table is None and model.bore is None and model.block is None and model.big_end_table is None
    assert model.engine.block is None and model.engine.mounts is None
    carried, absent = (model.damped, model.cranks) if scene.damper == "fitted" else (model.cranks, model.damped)
    assert len(carried) == 1 and not absent
    whole = coarse("diesel_v8" if scene.damper == "fitted" else "diesel_i6")
    bare = whole._replace(block=None, damped={})
    assert len(data) < len(flat.to_bytes(bare))
    assert len(data) < 0.5 * len(flat.to_bytes(whole))


def test_it_lists_what_its_level_answers(scene, scene_fmu):
    assert validate_fmu(str(scene_fmu)) == []
    description = read_model_description(str(scene_fmu))
    variables = {v.name: v for v in description.modelVariables}
    outputs = [v.name for v in description.modelVariables if v.causality == "output"]
    solver = ["solver.residual", "solver.substeps", "solver.iterations", "solver.limited"]
    assert sorted(outputs) == sorted({"crank.angle", "crank.speed", "frame.speed", *scene.outputs, *solver})
    assert not any(name.endswith(".level") for name in variables)
    assert ("damper.oil_temperature" in variables) == (scene.damper == "fitted")
    assert variables["solver.integrator"].start == "esdirk4"
    assert float(variables["solver.step"].start) == scene.step
    assert float(variables["gas.load"].start) == 0.8
    assert float(variables["speed"].start) == scene.speeds[0]
    assert description.modelName.startswith("CranktrainDiesel")
    assert "cylinder[1].pressure" in variables
