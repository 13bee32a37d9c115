"""Differences between runs of a scene, the ladder that a plan climbs, and plans against a run at the next level."""

import math
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from cranktrain.engine.levels import CRANKS
from cranktrain.studies.planning.difference import LastCycle, by_family, longest_step, relative_differences
from cranktrain.studies.planning.ladder import bearing_levels, candidates, every_pair, next_pair
from cranktrain.studies.planning.planning import plan
from cranktrain.studies.planning.running import SceneRun
from cranktrain.studies.planning.scene_model import SceneModel
from cranktrain.studies.scene import load_scene

SPEED = 200.0
ORDER_HZ = SPEED / (2.0 * math.pi)


def cycle(signal, n=288):
    """Last cycle of one output as a function of the crank angle."""
    return LastCycle(signal(4.0 * math.pi * np.arange(n) / n)[None, :], 1.0, 1.0, np.zeros(1))


def difference(run, reference, highest_order, n=288, m=288):
    return relative_differences(cycle(run, n), cycle(reference, m), SPEED, highest_order * ORDER_HZ)[0]


def test_amplitude_and_phase_of_one_order():
    def signal(angle, size=1.0, phase=0.0):
        return 7.0 + size * np.sin(3.0 * angle + phase)

    assert difference(lambda a: signal(a, 1.02), signal, 6.0) == pytest.approx(0.02, rel=1e-9)
    # |e^{i phase} - 1| = 2 sin(phase/2)
    assert difference(lambda a: signal(a, 1.0, 0.1), signal, 6.0) == pytest.approx(2.0 * math.sin(0.05), rel=1e-9)
    # a shifted mean counts against the alternating part, whose RMS is 1/sqrt(2)
    assert difference(lambda a: signal(a) + 0.01, signal, 6.0) == pytest.approx(0.01 * math.sqrt(2.0), rel=1e-9)


def test_nothing_above_the_frequency_counts():
    def rough(angle, more=0.3):
        return np.sin(3.0 * angle) + more * np.sin(8.0 * angle)

    for highest, found in ((7.5, 0.0), (8.0, 0.3)):
        assert difference(rough, partial(rough, more=0.0), highest) == pytest.approx(found, rel=1e-9, abs=1e-12)
    assert difference(np.zeros_like, np.zeros_like, 6.0) == 0.0
    assert longest_step(SPEED, 500.0) / SPEED == pytest.approx(1.0 / (4.0 * 500.0))  # four steps to a period


def test_beyond_what_is_sampled_it_is_the_rms_over_samples():
    rng = np.random.default_rng(5)
    one, other = rng.normal(size=(2, 48))
    runs = (LastCycle(values[None, :], 1.0, 1.0, np.zeros(1)) for values in (one, other))
    found = relative_differences(*runs, SPEED, 1e6)[0]
    assert found == pytest.approx(np.sqrt(np.mean((one - other) ** 2)) / np.std(other), rel=1e-12)


@pytest.mark.parametrize(("n", "m"), [(288, 576), (144, 360), (120, 90)])
def test_runs_of_different_steps_meet_in_common_samples(n, m):
    def signal(angle):
        return np.sin(3.0 * angle) + 0.5 * np.cos(0.5 * angle)

    assert difference(signal, signal, 6.0, n, m) == pytest.approx(0.0, abs=1e-12)
    assert difference(lambda a: 1.1 * signal(a), signal, 6.0, n, m) == pytest.approx(0.1, rel=1e-9)


def test_families_take_their_worst_member():
    names = ("bearing[1].force.x", "bearing[2].force.x", "pulley.torsion", "mount[3].force.y")
    found = {"bearing.force.x": 3.0, "pulley.torsion": 2.0, "mount[3].force.y": 4.0}
    assert by_family(names, [1.0, 3.0, 2.0, 4.0]) == found


def scene_of(folder, outputs='"pulley.torsion"', engine="diesel_i6", wish=""):
    path = folder / "scene.toml"
    path.write_text(
        f'engine = "{engine}"\nspeeds_rpm = [1500]\noutputs = [{outputs}]\nfrequency_hz = 300\naccuracy = 0.1\n{wish}\n'
    )
    return load_scene(path)


@pytest.mark.parametrize("engine", ["diesel_i6", "diesel_v8"])
@pytest.mark.parametrize("wish", ["", 'crank = "beam"', 'bearings = "linear"', 'crank = "torsional"'])
def test_the_ladder_climbs_and_ends(engine, wish, tmp_path):
    scene = scene_of(tmp_path, engine=engine, wish=wish)
    levels = bearing_levels(scene)

    def height(pair):
        return list(CRANKS).index(pair[0]), levels.index(pair[1])

    chain = candidates(scene)
    assert chain == sorted(chain, key=height)
    for start in (*chain, *every_pair(scene, with_ehd=True)):
        pair, climbed = start, 0
        while (above := next_pair(scene, pair)) is not None:
            assert height(above) > height(pair)
            assert all(new >= old for new, old in zip(height(above), height(pair), strict=True))
            pair, climbed = above, climbed + 1
        assert pair == ("solid", levels[-1])
        assert climbed <= len(levels) + len(CRANKS)


def test_what_is_fixed_does_not_change(tmp_path):
    scene = scene_of(tmp_path, '"pulley.axial"')
    assert next_pair(scene, ("beam", "impedance"), bearings=False) == ("solid", "impedance")
    assert next_pair(scene, ("beam", "impedance"), crank=False) == ("beam", "table")
    assert next_pair(scene, ("solid", "ehd:fine")) is None
    assert next_pair(scene, ("solid", "table"), bearings=False) is None


def test_held_mains_leave_no_films_on_the_pins(tmp_path):
    scene = scene_of(tmp_path, '"pulley.torsion", "big_end[1].film_thickness_min"')
    assert scene.big_ends == "impedance"
    assert candidates(scene)[0] == ("beam", "impedance")
    assert not any(bearings == "held" for _, bearings in every_pair(scene, with_ehd=False))


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
