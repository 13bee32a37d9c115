"""Calibration: known values are found again, slopes are derivatives, bounds hold, bad files say what is wrong."""

from dataclasses import replace

import numpy as np
import pytest
from engine_texts import SIX, read
from one_line import one_line
from refusals import text_of
from some import some

from cranktrain.core.errors import InputError
from cranktrain.engine import values
from cranktrain.engine.file import load_engine
from cranktrain.store.engine_text import Written, rewritten
from cranktrain_lab.calibration import calibrate
from cranktrain_lab.calibration.calibrate import report_of
from cranktrain_lab.calibration.problem import Problem, match, sensitivities
from cranktrain_lab.calibration.search import search
from cranktrain_lab.calibration.targets import Task, load_targets
from cranktrain_lab.calibration.train import Change, Train, changes, digests

TARGETS = text_of("targets")
HEAVIER = Written(31.23, "calibrated", "to a test 238 Hz")


@pytest.fixture(scope="module")
def coarse():
    """The six on the coarse mesh of other tests, its task, and the problem on ground."""
    from bodies import COARSE

    from cranktrain.structure.crank.reduction import reduced_crankshaft

    engine = load_engine("diesel_i6")
    engine = replace(engine, crankshaft=replace(engine.crankshaft, mesh_size=COARSE))
    return engine, reduced_crankshaft(engine)


@pytest.fixture
def task(tmp_path, coarse):
    path = tmp_path / "t.toml"
    path.write_text(TARGETS, encoding="utf-8")
    return load_targets(path, coarse[0])


def problem_of(coarse, task, changes=None, dimensions=None):
    engine, body = coarse
    return Problem(engine, Train(engine, body, None, changes or {}), task, dimensions or {}, {})


def test_quick_matrices_have_the_frequencies_of_all_modes(coarse, task):
    from cranktrain.structure.crank.modal import cranktrain_modes, free_modes
    from cranktrain.structure.crank.reduction import complete_crankshaft

    engine, body = coarse
    train = Train(engine, body, None, {})
    complete = complete_crankshaft(engine, body)
    for own, (hz, shares, _) in (
        (train.cranktrain_modes(engine, train.cranktrain(engine, {})), cranktrain_modes(engine, complete)),
        (train.crankshaft_modes(engine, train.crankshaft(engine, {})), free_modes(engine, complete)),
    ):
        hz, shares = hz[hz > 1.0], shares[hz > 1.0]
        np.testing.assert_allclose(own.hz[:8], hz[:8], rtol=1e-3)
        np.testing.assert_allclose(own.shares[:3, :3], shares[:3], atol=5e-3)


def test_known_values_are_found_again_from_their_own_frequencies(coarse, task):
    problem, known = problem_of(coarse, task), np.array([33.0, 0.165, 4.6e8])
    own = match(task.targets, problem.modes(known))
    targets = tuple(replace(t, hz=float(hz)) for t, hz in zip(task.targets, own.hz, strict=True))
    found = search(replace(problem, task=replace(task, targets=targets)), seed=3, evaluations=300)
    assert found.cost < 1e-6
    np.testing.assert_allclose(found.free, known, rtol=2e-3)


def test_sensitivities_are_the_derivatives_of_frequencies(coarse, task):
    problem, at = problem_of(coarse, task), np.array([33.0, 0.165, 4.6e8])
    modes = problem.modes(at)
    found = match(task.targets, modes)
    slopes = sensitivities(problem, at, modes, found.places)
    for j in some(range(at.size)):
        moved = (at * (1.0 + side * np.eye(3)[j]) for side in (1e-3, -1e-3))
        ahead, behind = (np.log(match(task.targets, problem.modes(one)).hz) for one in moved)
        np.testing.assert_allclose(slopes[:, j], (ahead - behind) / 2e-3, atol=2e-5)


def test_values_stay_within_their_bounds_and_reports_say_which_are_at_one(coarse, task):
    far = replace(task, targets=tuple(replace(t, hz=3.0 * t.hz) for t in task.targets))
    problem = problem_of(coarse, far)
    found = search(problem, start=np.array([1.0, 9.0, 5e8]), evaluations=60)
    assert np.all((problem.low <= found.free) & (found.free <= problem.high))
    report = report_of(problem, found.free)
    assert not report["met"]
    assert any(row["at_bound"] for row in report["parameters"])


def test_the_same_seed_finds_the_same_values(coarse, task):
    problem = problem_of(coarse, task)
    first, again = (search(problem, seed=5, evaluations=40).free for _ in range(2))
    np.testing.assert_array_equal(first, again)


def test_an_interrupted_search_keeps_the_best(coarse, task):
    def stop(share, cost):
        if share > 0.3:
            raise KeyboardInterrupt

    found = search(problem_of(coarse, task), evaluations=150, follow=stop)
    assert found.interrupted and np.isfinite(found.cost)
    assert found.evaluations < 150


def test_an_interrupt_while_new_bodies_are_meshed_keeps_what_the_search_found(coarse, monkeypatch, tmp_path):
    """The search takes minutes, and so do the bodies of its result."""
    engine, body = coarse
    path = tmp_path / "t.toml"
    width = '"crankshaft.web_thickness" = { low = 22, high = 27, unit = "mm" }\n'
    path.write_text(TARGETS.replace("[derived]", width + "[derived]"), encoding="utf-8")
    task, zero = load_targets(path, engine), np.zeros((6 * len(body.interfaces),) * 2)
    bodies = iter([body])

    def meshed(engine, progress):
        for one in bodies:
            return one
        raise KeyboardInterrupt

    def dimension(before, after, *_):
        return [Change("crankshaft", zero, zero)] if before.crankshaft != after.crankshaft else []

    monkeypatch.setattr(calibrate, "changes", dimension)
    monkeypatch.setattr(calibrate, "reduced_crankshaft", meshed)
    problem, found = calibrate._fitted(engine, task, 1, 60, lambda stage: None, lambda share, cost: None)
    assert found.interrupted and found.evaluations >= 60
    assert float(np.square(problem.residuals(found.free)).sum()) == pytest.approx(found.cost, rel=1e-6)


def test_values_that_meet_the_targets_are_confirmed(coarse, task, monkeypatch, tmp_path):
    """Also those that only formulas use; and a file that cannot be written loses no report."""
    engine, body = coarse
    assert calibrate.start_values(engine, task)["gyration"] == pytest.approx(
        np.sqrt(engine.flywheel.polar_inertia / engine.flywheel.mass), rel=5e-3
    )
    monkeypatch.setattr(calibrate, "reduced_crankshaft", lambda engine, progress: body)
    monkeypatch.setattr(calibrate, "load_engine", lambda path: engine)
    start = calibrate.start_values(engine, task)
    problem = problem_of(coarse, task)
    found = match(task.targets, problem.modes(np.array(list(start.values()))))
    text = TARGETS
    for target, hz in zip(task.targets, found.hz, strict=True):
        text = text.replace(f"hz = {target.hz:g},", f"hz = {hz:.6g},")
    (tmp_path / "met.toml").write_text(text, encoding="utf-8")
    report = calibrate.calibrate("diesel_i6", tmp_path / "met.toml", tmp_path / "new.toml")
    assert report["confirmed"] and report["met"] and report["evaluations"] == 0
    assert [p["value"] * (1e-3 if p["unit"] == "mm" else 1.0) for p in report["parameters"]] == pytest.approx(
        list(start.values()), rel=1e-3
    )

    def refused(path):
        raise InputError("no engine")

    monkeypatch.setattr("cranktrain.store.engine_text.load_engine", refused)
    report = calibrate.calibrate("diesel_i6", tmp_path / "met.toml", tmp_path / "other.toml")
    assert report["refused"] == "no engine" and report["file"] is None and report["targets"]
    assert [path.name for path in tmp_path.glob("*.toml") if path.name not in ("t.toml", "met.toml")] == ["new.toml"]


def test_a_change_at_interfaces_acts_per_unit_of_its_dimension(coarse, task):
    engine, body = coarse
    size = 6 * len(body.interfaces)
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    at = 6 * body.index("flywheel")
    mass[at : at + 3, at : at + 3] = np.eye(3)
    heavier = {"flywheel.mass": [Change("crankshaft", stiffness, mass)]}
    train = Train(engine, body, None, heavier)
    by_change = train.cranktrain(engine, {"flywheel.mass": 1.0})
    # A point mass in the middle of the interface.
    f = engine.flywheel
    offset = f.mass * f.offset / (f.mass + 1.0)
    shifted = f.diametral_inertia + f.mass * (f.offset - offset) ** 2 + 1.0 * offset**2
    part = replace(f, mass=f.mass + 1.0, offset=offset, diametral_inertia=shifted)
    exact = train.cranktrain(replace(engine, flywheel=part), {})
    hz = [train.cranktrain_modes(engine, matrices).hz[:9] for matrices in (by_change, exact)]
    # Modes above the cut-off answer statically: they do not feel the mass.
    np.testing.assert_allclose(hz[0], hz[1], rtol=1e-3)


def own_hand(old, form):
    """An engine file as users write it: the table of the flywheel in another form."""
    start = old.index("[flywheel]")
    line = next(one for one in old[start:].splitlines() if one.startswith("mass ="))
    return old[:start] + old[start:].replace("[flywheel]", form[0], 1).replace(line, form[1], 1)


@pytest.mark.parametrize(
    "form",
    [
        ("[flywheel]", 'mass = { value = 32, unit = "kg", origin = "chosen" } # "weighed" # twice'),
        ("[ flywheel ]  # [of cast iron]", '\tmass  = { value = 32, unit = "kg", origin = "chosen" }'),
        ("  [flywheel]#", 'mass = { value = 32, unit = "kg", origin = "chosen", note = "a # in a text" }#'),
    ],
)
def test_remarks_and_indents_of_a_file_are_kept(tmp_path, form):
    old = own_hand(SIX, form)
    new = rewritten(old, load_engine("diesel_i6"), {"flywheel.mass": HEAVIER})
    assert read(tmp_path, new).flywheel.mass == pytest.approx(31.23)
    (before, after) = next((a, b) for a, b in zip(old.splitlines(), new.splitlines(), strict=True) if a != b)
    assert before == form[1]
    assert after[0] == before[0]
    assert after.rpartition("}")[2].strip() == before.rpartition("}")[2].strip()


def test_lists_over_several_lines_and_tables_that_a_file_lacks(tmp_path):
    old, engine = SIX, load_engine("diesel_i6")
    old = old.replace("value = [40, 38, 38, 38,", "value = [40, 38, 38, # mm\n  38,", 1)
    start = old.index("[damping]")
    old = old[:start] + old[old.index("# A run uses the damper", start) :]
    changes = {
        "crankshaft.main_widths[2]": Written(0.0375, "derived", "of a test"),
        "damping.ratio": Written(0.02, "calibrated", "to a test 3 %"),
    }
    found = read(tmp_path, rewritten(old, engine, changes))
    assert found.crankshaft.main_widths[:3] == pytest.approx((0.04, 0.0375, 0.038))
    assert found.damping.ratio == 0.02


DOTTED = ("[flywheel]", 'mass.value = 32\nmass.unit = "kg"\nmass.origin = "chosen"')
NESTED = ("[flywheel.mass]\nvalue = 32\nunit = 'kg'\norigin = 'chosen'\n[ 'flywheel' ]", "")


@pytest.mark.parametrize(("form", "said"), [(DOTTED, "is not written as mass = "), (NESTED, "has no line [flywheel]")])
def test_entries_that_cannot_be_replaced_are_refused(form, said):
    with one_line("flywheel.mass: ", said):
        rewritten(own_hand(SIX, form), load_engine("diesel_i6"), {"flywheel.mass": HEAVIER})


def test_an_engine_file_without_a_place_for_a_value_is_refused_before_the_search(tmp_path, monkeypatch, capsys):
    """A search takes minutes: all that prevents its file is said before, on one line."""
    from cranktrain.cli.main import main

    monkeypatch.setattr(calibrate, "_fitted", lambda *given: pytest.fail("searched"))
    engine, targets = tmp_path / "own.toml", tmp_path / "targets.toml"
    engine.write_text(own_hand(SIX, DOTTED), "utf-8")
    targets.write_text(TARGETS, "utf-8")
    assert main(["identify", str(engine), str(targets), "--output", str(tmp_path / "new.toml")]) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert "flywheel.mass: is not written as mass = " in said
    assert main(["identify", "diesel_i6", str(targets), "--output", str(targets)]) == 2
    assert targets.read_text("utf-8") == TARGETS
    assert not (tmp_path / "new.toml").exists()


def test_keys_reach_entries_of_lists():
    engine = load_engine("diesel_v8")
    assert values.value(engine, "main_roller.stiffness[5]") == engine.main_roller.stiffness[4]
    softer = values.with_value(engine, "main_roller.stiffness[5]", 5e8)
    assert softer.main_roller.stiffness == (*engine.main_roller.stiffness[:4], 5e8)
    assert set(values.with_value(engine, "main_roller.stiffness", 5e8).main_roller.stiffness) == {5e8}
    with one_line("5 entries"):
        values.value(engine, "main_roller.stiffness[6]")


@pytest.mark.parametrize("name", ["diesel_i6", "diesel_v8"])
def test_the_bodies_of_a_shipped_engine_are_its_own_bodies_at_the_start(name):
    """What is derived anew from its own values differs by rounding at most, and asks for no mesh."""
    engine = load_engine(name)
    task = load_targets(name, engine)
    start = calibrate.engine_with(engine, task, calibrate.start_values(engine, task), {})
    assert digests(start, flexible=True) == digests(engine, flexible=True)
    assert start.flywheel.polar_inertia == pytest.approx(engine.flywheel.polar_inertia, rel=2e-4)
    assert isinstance(task, Task) and task.flexible
    assert {round(t.hz) for t in task.targets} >= {round(hz) for hz in engine.published.cranktrain_hz}


def test_a_dimension_that_moves_an_interface_strains_no_rigid_motion(tmp_path, monkeypatch):
    """A longer flange carries the flywheel's place along; its change of stiffness knows rigid motions as before."""
    from cranktrain.core.reduced_body import skew
    from cranktrain.structure.crank.reduction import crankshaft_interfaces
    from cranktrain.structure.fem.elasticity import finite_elements
    from cranktrain.structure.fem.mesh import crankshaft_mesh

    monkeypatch.setenv("CRANKTRAIN_CACHE", str(tmp_path))
    engine = load_engine("diesel_i6")
    short = {"throw_angles": (0.0,), "main_widths": (0.04, 0.04), "counterweights": (True, True)}
    one = replace(engine.crankshaft, **short, mesh_size=0.04)
    engine = replace(engine, crankshaft=one, thrust=replace(engine.thrust, main=1))
    longer = replace(engine, crankshaft=replace(one, flange_length=one.flange_length + 0.01))
    (change,) = changes(engine, longer, 0.01, False, lambda stage: None)
    places = crankshaft_interfaces(finite_elements(crankshaft_mesh(one, 1), engine.material), one).positions
    rigid = np.vstack([np.hstack((np.eye(3), -skew(at))) if k == 0 else np.hstack((np.zeros((3, 3)), np.eye(3)))
                       for at in places for k in (0, 1)])  # fmt: skip
    # Energy of unit rigid motions beside that of unit motions of single interfaces.
    assert np.abs(rigid.T @ change.stiffness @ rigid).max() < 1e-6 * np.abs(change.stiffness).max()
    # The mass that a flange 10 mm longer adds moves with them.
    added = engine.material.density * 0.25 * np.pi * one.flange_diameter**2
    assert (rigid.T @ change.mass @ rigid)[0, 0] == pytest.approx(added, rel=0.06)


MOVING = """
[targets.critical_6]
of = "motion"
shape = "torsional"
number = 1
order = 6
rpm = {rpm}
tolerance = 0.001
basis = "measured"
source = "a test"

[parameters]
pulley_gyration = {{ low = 45, high = 80, unit = "mm" }}

[derived]
"pulley.polar_inertia" = {{ formula = "pulley.mass * pulley_gyration ** 2" }}
"pulley.diametral_inertia" = {{ formula = "0.5 * pulley.polar_inertia + pulley.mass * 0.06 ** 2 / 12" }}
"main_bearing.stiffness_x" = {{ formula = "film_stiffness_x" }}
"main_bearing.stiffness_y" = {{ formula = "film_stiffness_y" }}
"""


@pytest.mark.slow
def test_a_target_in_motion_is_met_by_the_mode_of_the_running_crank(tmp_path):
    """The refitted pulley moves the eigenproblem's own torsion to where the quick matrices have it."""
    from bodies import COARSE

    from cranktrain.store.engine_text import rounded
    from cranktrain.structure.assembly import assemble
    from cranktrain.structure.in_motion.eigenproblem import modes_in_motion
    from cranktrain.studies.in_motion.report import SPRING_LEVELS, film_springs, reference_speed, settled_simulation

    path = tmp_path / "coarse.toml"
    path.write_text(SIX.replace("mesh_size = { value = 18", f"mesh_size = {{ value = {1e3 * COARSE:g}", 1), "utf-8")

    def torsion(engine):
        settled = settled_simulation(assemble(engine, SPRING_LEVELS), reference_speed(engine))
        return modes_in_motion(settled).torsional_hz

    before = torsion(load_engine(path))
    targets = tmp_path / "moving.targets.toml"
    targets.write_text(MOVING.format(rpm=10.0 * 0.985 * before), "utf-8")
    report = calibrate.calibrate(path, targets, tmp_path / "new.toml", evaluations=60)
    assert report["met"] and report["targets"][0]["basis"] == "measured"
    assert report["targets"][0]["rpm"] == pytest.approx(9.85 * before, rel=1e-3)
    new = load_engine(tmp_path / "new.toml")
    assert torsion(new) == pytest.approx(0.985 * before, rel=3e-3)
    springs = film_springs(assemble(load_engine(path), SPRING_LEVELS))
    assert new.main_bearing.stiffness_x == rounded(springs["film_stiffness_x"])
    assert new.main_bearing.stiffness_y == rounded(springs["film_stiffness_y"])
