"""How a plan tries integrators and steps: on its own scene, from the longest step down, no run more than needed."""

import math

import numpy as np
import pytest

from cranktrain.core.errors import InputError
from cranktrain.studies.planning.planning import METHODS, _Chooser, _Judged
from cranktrain.studies.planning.scene_model import SceneModel
from cranktrain.studies.scene import load_scene

SPEEDS = (1000.0, 1500.0, 2000.0)
ALLOWED = 0.01


class Figures:
    """Stand-in for measurements: error c h^p of each integrator by step (deg), twice as much at the highest speed."""

    def __init__(self, model, laws):
        self.model, self.laws, self.runs = model, laws, []

    def worst(self, case, reference, speeds):
        assert reference.step == pytest.approx(0.5 * case.step)
        self.runs += [(case.bearings, case.integrator, round(math.degrees(case.step), 6), speed) for speed in speeds]
        factor, order = self.laws.get(case.integrator, (1.0, 0.0))
        error = factor * math.degrees(case.step) ** order
        return np.array([max(error * (2.0 if speed == max(self.model.scene.speeds) else 1.0) for speed in speeds)])

    def cost(self, case, speeds):
        return 1.0 / case.step


@pytest.fixture
def chooser(tmp_path):
    """A chooser of a scene at three speeds whose figures follow laws that are given."""

    def made(laws, **keys):
        lines = {"engine": '"diesel_i6"', "speeds_rpm": list(SPEEDS), "outputs": '["pulley.torsion"]',
                 "frequency_hz": 300, "accuracy": 0.02} | keys  # fmt: skip
        path = tmp_path / "scene.toml"
        path.write_text("\n".join(f"{name} = {value}" for name, value in lines.items()) + "\n", "utf-8")
        scene = load_scene(path)
        return _Chooser(scene, Figures(SceneModel(scene), laws))

    return made


def judged(*pair):
    return _Judged(pair, 0.0, True, "")


def test_the_longest_step_that_serves_at_every_speed_wins_and_one_that_fails_at_one_is_not_run_at_others(chooser):
    """Third order: 2 × 1e-4 h³ is within 1 % up to 3.7 deg, so 3 deg of esdirk4 is the longest tried that serves."""
    plan = chooser({"esdirk4": (1.0e-4, 3.0)})
    case = plan._method(judged("beam", "impedance"), ALLOWED)
    assert (case.integrator, round(math.degrees(case.step), 6)) == ("esdirk4", 3.0)
    steps = {step for _, name, step, _ in plan.measured.runs if name == "esdirk4"}
    first = plan.scene.speeds[0]
    hopeless = [(step, speed) for _, name, step, speed in plan.measured.runs if name == "esdirk4" and step >= 5.0]
    assert steps == {min(6.0, round(math.degrees(plan.longest), 6)), 4.0, 3.0}
    assert hopeless and {speed for _, speed in hopeless} == {first}
    assert 0.25 not in steps  # finer ones are not run once one serves
    others = {(name, speed) for _, name, _, speed in plan.measured.runs if name != "esdirk4"}
    assert {speed for _, speed in others} == {first}


def test_films_solved_online_begin_where_the_cheap_ones_are_hopeful(chooser):
    """On the engine's lowest film level the error may be three times what is allowed: there h ≤ 6.7 deg, not 10."""
    plan = chooser({"esdirk57": (1.0e-4, 3.0)})
    case = plan._method(judged("solid", "reynolds"), ALLOWED)
    assert case.bearings == "reynolds" and case.integrator == "esdirk57"
    screened = [run for run in plan.measured.runs if run[0] == "impedance"]
    assert {speed for *_, speed in screened} == {plan.scene.speeds[0]}
    # Integrators that the cheap films find hopeless are never run on the dear ones.
    assert {name for bearings, name, *_ in plan.measured.runs if bearings == "reynolds"} == {"esdirk57"}
    assert {name for _, name, *_ in screened} == set(METHODS)


def test_an_accuracy_that_no_step_reaches_names_what_the_finest_leaves_at_all_speeds(chooser):
    """0.1 h of esdirk4 leaves 0.025 at 0.25 deg, twice that at the highest speed; half of an accuracy may be so."""
    plan = chooser({"esdirk4": (0.1, 1.0)})
    with pytest.raises(InputError, match=r"is 0\.05; the nearest valid accuracy is 1e-01"):
        plan._method(judged("beam", "impedance"), ALLOWED)


@pytest.mark.parametrize(("compare", "levels"), [(False, {"impedance"}), (True, {"impedance", "table"})])
def test_charted_levels_run_nothing_above_them_unless_asked(chooser, monkeypatch, compare, levels):
    """The film table of the next level may take minutes, and the error against the best model is known without it."""
    plan, runs = chooser({}, outputs='["pulley.torsion", "bearing[4].force.y"]'), set()

    class Counted(Figures):
        def worst(self, case, reference, speeds):
            runs.update((case.bearings, reference.bearings))
            return np.array([1.0e-3, 2.0e-3])

        def settling(self, case, speeds):
            return np.zeros(2)

    plan.measured, plan.compare = Counted(plan.model, {}), compare
    assembled = type("Made", (), {"body": type("Body", (), {"n_modes": 7})})
    monkeypatch.setattr(SceneModel, "assembly", lambda self, case: assembled)
    chosen = _Judged(("solid", "impedance"), 0.2, True, "", np.array([0.1, 0.2]))
    made = plan._figures(
        chosen, plan.model.case("solid", "impedance", "esdirk47", math.radians(5.0)), [chosen], "modes"
    )
    assert runs == levels
    assert made.next.bearings == "table" and (made.next_real_time_factor is None) != compare
    assert made.total_error == pytest.approx(math.hypot(2.0e-3, 0.2))
    if not compare:
        assert made.predicted_error == pytest.approx(made.total_error)
        assert made.as_dict()["next_level"] is None
