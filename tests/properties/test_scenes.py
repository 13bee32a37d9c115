"""Scenes of every kind: each is planned, run and checked by one run at the next level with half the step."""

from pathlib import Path

import pytest

from cranktrain.studies.planning.planning import plan
from cranktrain.studies.planning.running import SceneRun
from cranktrain.studies.planning.scene_model import SceneModel
from cranktrain.studies.scene import load_scene

SCENES = sorted((Path(__file__).parents[1] / "data" / "scenes").glob("*.toml"))


@pytest.mark.slow
@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_the_predicted_error_is_within_a_factor_of_two_of_the_verified_one(path, tmp_path):
    scene = load_scene(path)
    model = SceneModel(scene)
    made = plan(scene, model=model)
    runs = SceneRun(made, model, tmp_path / "result.h5")
    runs.run(made.case)
    runs.run(made.next)
    check = runs.verification()
    assert check is not None
    assert 0.5 <= check["ratio"] <= 2.0
    # what the scene does not fix the plan answers for
    if scene.crank is None and scene.bearings is None and scene.budget is None:
        assert made.within_accuracy
        assert check["verified_error"] <= 2.0 * scene.accuracy
