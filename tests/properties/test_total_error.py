"""Total error: its parts bound it, nobody beats the front, what to choose is the cheapest that is close enough."""

import math
import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from browser import needs_browser, shown
from hypothesis import given
from hypothesis import strategies as st
from some import some
from total_error import few

from cranktrain.core.errors import SolverError
from cranktrain.core.units import RPM
from cranktrain.dynamics.model.settings import Settings, resolved
from cranktrain.engine.file import load_engine
from cranktrain.engine.levels import CRANKS
from cranktrain.film.elastic.bore_compliance import BoreCompliance
from cranktrain.film.laws.bearings import Bearings, bearing_parameters
from cranktrain.film.laws.ehd import IN_LOOP, elastic_films
from cranktrain.film.laws.register import CHEAP, LAWS, MODERATE, PLAIN, Form, Law, bearing_law, register_law
from cranktrain.store.kept import Kept
from cranktrain.studies.planning.charted import charted
from cranktrain.studies.scene import load_scene
from cranktrain.studies.total_error import shipped
from cranktrain.studies.total_error.families import FAMILIES, wanted
from cranktrain.studies.total_error.point import Best, Split, TotalPoint, at_scene
from cranktrain_lab.tradeoff import settled
from cranktrain_lab.tradeoff.families import StudyScene
from cranktrain_lab.tradeoff.files import total_page, write_files
from cranktrain_lab.tradeoff.models import best_model, default_model, every_model, models
from cranktrain_lab.tradeoff.point import front, with_fronts
from cranktrain_lab.tradeoff.settled import distance, resampled, split
from cranktrain_lab.tradeoff.study import TotalStudy, total_study
from cranktrain_lab.tradeoff.total_choice import cheapest, default_rows, table_rows, total_choice_text

__all__ = ["few"]
SIX = load_engine("diesel_i6")
TORSION, FORCES = FAMILIES["torsion"], FAMILIES["forces"]


def scene_of(engine, rpm=2000.0):
    return StudyScene(f"{engine.name} {rpm:g}", engine, rpm * RPM, Settings())


def cycle(rng, samples=144):
    return {name: rng.normal(size=samples) for name in wanted(SIX)}


@given(st.integers(0, 2**32 - 1), st.floats(1e-6, 1e3), st.floats(1e-6, 1e3))
def test_the_parts_of_an_error_bound_it(seed, near, far):
    """A way over the fine run of the same model is no shorter than the straight one, whatever the three cycles are."""
    rng = np.random.default_rng(seed)
    reference = cycle(rng)
    fine = {name: values + far * rng.normal(size=values.size) for name, values in reference.items()}
    last = {name: values + near * rng.normal(size=values.size) for name, values in fine.items()}
    after = {name: values + 1e-3 * rng.normal(size=values.size) for name, values in last.items()}
    for family in FAMILIES.values():
        parts = split(family, SIX, last, after, fine, reference)
        assert parts.total <= (parts.model + parts.numerical) * (1.0 + 1e-12)
        assert parts.total >= abs(parts.model - parts.numerical) * (1.0 - 1e-12)
        assert 0.0 < parts.settling < 1.0
        # Also where steps are of different lengths.
        coarse = {name: resampled(values, 96) for name, values in last.items()}
        finer = {name: resampled(values, 288) for name, values in fine.items()}
        parts = split(family, SIX, coarse, coarse, finer, reference)
        assert parts.total <= (parts.model + parts.numerical) * (1.0 + 1e-9)


def test_a_distance_is_relative_to_the_alternating_part_of_the_worst_member():
    angle = 2.0 * math.pi * np.arange(1, 721) / 720
    still = {name: 5.0 + np.sin(angle) for name in wanted(SIX)}
    off = {**still, "pulley.torsion": still["pulley.torsion"] + 0.1}
    assert distance(TORSION, SIX, off, still, still) == pytest.approx(0.1 * math.sqrt(2.0))
    # Both axes of a bearing's force are one vector, the worst bearing counts.
    off = {**still, "bearing[3].force.x": still["bearing[3].force.x"] + 0.3}
    assert distance(FORCES, SIX, off, still, still) == pytest.approx(0.3)
    # A coarser cycle that holds all harmonics is as good.
    coarse = {name: values[4::5] for name, values in still.items()}
    assert distance(TORSION, SIX, coarse, still, still) == pytest.approx(0.0, abs=1e-12)
    assert distance(TORSION, SIX, {}, still, still) is None


def test_a_cycle_at_other_samples_is_the_same_series():
    def at(count):
        angle = 2.0 * math.pi * np.arange(1, count + 1) / count
        return 3.0 + np.sin(angle) + 0.5 * np.cos(12 * angle + 0.3) + 0.1 * np.sin(50 * angle)

    for one, other in ((120, 720), (720, 120), (288, 720), (1440, 180), (180, 288)):
        assert resampled(at(one), other) == pytest.approx(at(other), abs=1e-12)


def test_a_model_without_an_output_has_no_error_of_it():
    rng = np.random.default_rng(1)
    full = cycle(rng)
    less = {name: values for name, values in full.items() if name != "cover.acceleration"}
    assert split(FAMILIES["cover"], SIX, less, less, less, full) is None
    assert split(TORSION, SIX, less, less, less, full).total == 0.0


def test_levels_that_do_not_exist_together_are_left_out():
    found = [(m.settings.crank, m.settings.bearings, m.settings.block) for m in every_model(scene_of(SIX))]
    assert found[-1] == ("solid", "ehd:fine", "flexible") and len(set(found)) == len(found)
    for crank, bearings, block in found:
        law = bearing_law(bearings)
        assert law.carries or not CRANKS[crank].bends
        assert CRANKS[crank].bends or not law.tilt
        assert block == "ground" or (law.carries and CRANKS[crank].elastic)
    assert {crank for crank, _, _ in found} == set(CRANKS)
    assert best_model(scene_of(load_engine("diesel_v8"))).settings.bearings == "roller"
    default = default_model(scene_of(SIX)).settings
    assert (default.crank, default.bearings, default.block) == ("solid", "impedance", "ground")
    # Models without any output are no points.
    names = [model.name for model in models(scene_of(SIX), False)]
    assert "rigid/held/ground" not in names and "torsional/held/ground" in names
    quick = models(scene_of(SIX), True)
    assert {bearing_law(model.settings.bearings).cost for model in quick} == {CHEAP, MODERATE}


def test_a_bore_may_bring_the_grid_of_its_films():
    """The reference's elastic films run on the grid that their bore names, all others on the usual one."""
    bore = BoreCompliance(np.zeros((1, 5, 3)), np.array([1e-11]), np.zeros((1, 4)), np.ones(1), 1e-3)
    rows = np.tile(bearing_parameters(SIX.plain_mains, 0.01), (2, 1))

    def nodes(own):
        return elastic_films(Bearings(rows, SIX.main_bearing, parts={"bore": own}, oil=SIX.oil)).memory.start.shape[1]

    fine = nodes(replace(bore, grid=settled.FINE_GRID))
    assert fine - nodes(bore) == settled.FINE_GRID.size - IN_LOOP.size > 0


def test_a_law_that_is_registered_is_a_choice():
    linear = LAWS["linear"].forms[PLAIN]
    try:
        register_law(Law("springs", "springs", {PLAIN: Form(linear.kernel, linear.record)}, clearance=False))
        assert best_model(scene_of(SIX)).settings.bearings == "springs"
    finally:
        LAWS.pop("springs", None)


def test_outputs_are_those_that_a_model_answers():
    """By the registers: the cover needs a block that moves, axial motion a crank that bends, a film an oil film."""
    for model in some(every_model(scene_of(SIX))):
        s = model.settings
        answered = {name for name, family in FAMILIES.items() if family.answered(s, SIX)}
        assert ("cover" in answered) == (s.block == "flexible")
        assert ("axial" in answered) == CRANKS[s.crank].bends
        assert ("film" in answered) == bearing_law(s.bearings).film
        assert ("torsion" in answered) == CRANKS[s.crank].elastic
        assert ("forces" in answered) == bearing_law(s.bearings).carries


ERROR = st.floats(1e-6, 1e2)
FIGURES = st.lists(st.tuples(ERROR, ERROR, st.none() | ERROR), min_size=1, max_size=25)


def point(cost, torsion, film, **more):
    errors = dict.fromkeys(FAMILIES)
    errors["torsion"] = Split(torsion, torsion, 0.0, 0.0)
    if film is not None:
        errors["film"] = Split(film, 0.5 * film, 0.6 * film, 0.0)
    known = {"scene": "here 2000", "speed_rpm": 2000.0, "crank": "solid", "bearings": "table", "block": "ground"}
    known |= {"seconds": 0.1, "cycles": 5, "repeats": 1}
    return TotalPoint(**{**known, "integrator": "esdirk4", "step_deg": 2.5, "cost": cost, "errors": errors, **more})


@given(FIGURES)
def test_nobody_beats_the_front_of_a_family(figures):
    points = with_fronts([point(*one) for one in figures])
    for family in ("torsion", "film"):
        own = {(p.cost, p.total(family)) for p in points if p.total(family) is not None}
        found = {(p.cost, p.total(family)) for p in points if family in p.front}
        for cost, error in own:
            beaten = any(c <= cost and e <= error and (c, e) != (cost, error) for c, e in own)
            assert beaten != ((cost, error) in found)
        least = front(points, family)
        assert [p.cost for p in least] == sorted({cost for cost, _ in found})
        assert all(p.total(family) > q.total(family) for p, q in pairwise(least))


@given(FIGURES, ERROR, ERROR)
def test_what_to_choose_is_the_cheapest_within_the_accuracy(figures, torsion, film):
    points = [point(*one) for one in figures]
    accuracies = {"torsion": torsion, "film": film}
    within = [p for p in points if all(p.total(f) is not None and p.total(f) <= a for f, a in accuracies.items())]
    found = cheapest(points, accuracies)
    assert (found is None) == (not within)
    if found is not None:
        assert found in within and found.cost == min(p.cost for p in within)
    # Of one family it lies on the front.
    alone = cheapest(points, {"torsion": torsion})
    if alone is not None:
        assert (alone.cost, alone.total("torsion")) in [(p.cost, p.total("torsion")) for p in front(points, "torsion")]


@pytest.mark.parametrize(
    ("others", "said"),  # each closer in one family for less, none in both; closer in both
    [([(0.5, 0.5, 0.05), (0.4, 0.3, 0.3)], "on the front"), ([(0.5, 0.2, 0.09)], "closer: 0.5 s/s")],
)
def test_the_default_stands_against_all_families_together(others, said):
    own = point(1.0, 0.4, 0.1, default=True)
    points = with_fronts([own, *(point(*one, crank="beam") for one in others)])
    rows = default_rows(points)
    assert [row[0] for row in rows[:-1]] == [FAMILIES["torsion"].title, FAMILIES["film"].title]
    assert rows[-1][1:5] == ["–"] * 4
    assert rows[-1][5] == said.replace("closer", points[1].label)
    assert "on the front" not in [row[5] for row in rows[:-1]]


def test_a_study_splits_what_it_measures(few, tmp_path):
    found = total_study([few], store=Kept(tmp_path / "kept"))
    points = {p.label: p for p in found.points}
    cranks, steps = ("rigid", "beam"), ("2.5", "5", "6")
    assert set(points) == {f"{crank}/linear/ground {step}°" for crank in cranks for step in steps}
    assert [p.label for p in found.points if p.default] == ["beam/linear/ground 5°"]
    for label, p in points.items():
        assert p.status == "ok" and p.cost > 0.0 and p.cycles >= 2
        assert p.errors["film"] is None and p.errors["cover"] is None
        assert (p.errors["torsion"] is None) == label.startswith("rigid")
        for parts in filter(None, p.errors.values()):
            assert abs(parts.model - parts.numerical) <= parts.total <= parts.model + parts.numerical
            assert parts.settling < 3.0e-3
    # The best model at its own fine step has no model error; what is left is the step's.
    best = points["beam/linear/ground 2.5°"].errors["torsion"]
    assert best.model == 0.0 and best.total == best.numerical
    assert points["beam/linear/ground 6°"].errors["torsion"].numerical > 5.0 * best.numerical
    # A rigid crank does not share its load as one that bends: a finer step changes nothing of that.
    rigid = [points[f"rigid/linear/ground {step}°"].errors["forces"] for step in ("2.5", "6")]
    assert min(one.model for one in rigid) > 0.1 and rigid[0].total == pytest.approx(rigid[1].total, rel=0.1)

    again = total_study([few], store=Kept(tmp_path / "kept"), say=None)
    assert again.points == found.points
    names = {path.name for path in write_files(found, tmp_path / "out")}
    pictures = {f"total-{name}-few-2000{end}" for name in ("torsion", "axial", "forces") for end in (".png", ".svg")}
    assert names == {*pictures, "total.html", "total.csv", "total.txt", "total.json"}
    text = (tmp_path / "out" / "total.html").read_text("utf-8")
    assert not any(word in text for word in ("src=", "@import", "href=", "@DATA@"))
    # Whether the default is on the front depends on measured times.
    assert "for 10 %" in total_choice_text(found) and "all of these together: " in total_choice_text(found)
    digest, read = shipped.read((tmp_path / "out" / "total.json").read_text("utf-8"))
    assert read.points == found.points and read.best == found.best and read.current
    assert digest == shipped.engine_digest(few.engine)
    heavier = replace(few.engine, cylinders=replace(few.engine.cylinders, piston_mass=2.0))
    assert shipped.engine_digest(heavier) != digest


def test_what_has_run_is_kept_and_what_failed_says_why(few, tmp_path, monkeypatch):
    honest, calls = settled._run, []

    def interrupted(job, say):
        calls.append(job)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return honest(job, say)

    monkeypatch.setattr(settled, "_run", interrupted)
    with pytest.raises(KeyboardInterrupt):
        total_study([few], store=Kept(tmp_path))
    assert len(list(tmp_path.glob("*.npz"))) == 2

    def lost(job, say):
        calls.append(job)
        raise SolverError("film of main[3] lost")

    calls.clear()
    monkeypatch.setattr(settled, "_run", lost)
    found = total_study([few], store=Kept(tmp_path))
    assert calls and {p.status for p in found.points} == {"failed: film of main[3] lost"}
    assert all(p.total("forces") is None for p in found.points)
    assert table_rows(found.points) == []
    with monkeypatch.context() as patch:
        patch.setattr(settled, "_run", lambda job, say: pytest.fail("ran again"))
        assert total_study([few], store=Kept(tmp_path)).points == found.points


def test_half_a_run_is_not_kept(few, tmp_path, monkeypatch):
    honest = settled.run_cycles
    monkeypatch.setattr(settled, "run_cycles", lambda *given: replace(honest(*given), complete=False))
    with pytest.raises(KeyboardInterrupt):
        total_study([few], store=Kept(tmp_path))
    assert not list(tmp_path.iterdir())


def figures_of(points):
    best = {p.scene: Best("solid/ehd/flexible", "esdirk4", 1.0, True, 300.0) for p in points}
    return shipped.Shipped(tuple(points), best, "measured by others")


def scene_file(path, **keys):
    entries = {
        "engine": '"diesel_i6"', "speeds_rpm": "[1500]", "outputs": '["pulley.torsion"]', "frequency_hz": "400",
        "accuracy": "0.1", **keys,
    }  # fmt: skip
    path.write_text("".join(f"{key} = {value}\n" for key, value in entries.items()), "utf-8")
    return load_scene(path)


def both(cost, slow, fast, **more):
    """A choice at 1000 and at 2000 rev/min."""
    return [point(cost, error, None, scene=f"six {rpm}", speed_rpm=float(rpm), **more)
            for rpm, error in ((1000, slow), (2000, fast))]  # fmt: skip


FIGURED = figures_of([
    *both(0.1, 0.02, 0.3, crank="beam", bearings="impedance"), *both(0.4, 0.05, 0.08, bearings="impedance"),
    *both(1.5, 0.01, 0.06, bearings="table"), *both(2.5, 0.01, 0.02, bearings="table", block="flexible"),
])  # fmt: skip


def test_a_plan_takes_the_cheapest_choice_within_its_accuracy(tmp_path):
    path = tmp_path / "scene.toml"

    def chosen(**keys):
        return charted(scene_file(path, **keys), lambda pair: True, FIGURED)

    assert chosen().chosen.pair == ("solid", "impedance")
    assert chosen().chosen.total == 0.08  # the larger error of the speeds on either side
    assert chosen(accuracy="0.07").chosen.pair == ("solid", "table")
    assert chosen(speeds_rpm="[1000]", accuracy="0.03").chosen.pair == ("beam", "impedance")
    beyond = chosen(accuracy="0.03")
    assert beyond.chosen is None and beyond.closest.pair == ("solid", "table")
    assert beyond.elsewhere.block == "flexible"
    assert "with block flexible solid/table/flexible" in beyond.shortfall(0.03)[0]
    assert "by earlier sources" in beyond.against
    assert chosen(block='"flexible"', accuracy="0.03").chosen.block == "flexible"
    assert chosen(budget_real_time_factor="1", accuracy="0.07").chosen is None


@pytest.mark.parametrize(
    ("key", "value"),
    [("speeds_rpm", "[2300]"), ("outputs", '["pulley.torsion", "shaft.torque"]'), ("load", "0.5"), ("damper", "true"),
     ("step_deg", "2"), ("engine", '"diesel_v8"'), ("outputs", '["pulley.axial"]')],
)  # fmt: skip
def test_figures_say_nothing_of_what_they_do_not_cover(key, value, tmp_path, monkeypatch):
    monkeypatch.setattr(shipped, "_all", lambda: {shipped.engine_digest(SIX): FIGURED})
    assert charted(scene_file(tmp_path / "scene.toml"), lambda pair: True) is not None
    assert charted(scene_file(tmp_path / "scene.toml", **{key: value}), lambda pair: True) is None


@needs_browser
def test_the_page_draws_itself_in_a_browser(few, tmp_path):
    """Marks of all choices, the front's numbers clear of each other, a row for each choice of the front."""
    points = with_fronts([point(0.1 * k, 1.0 / k, None, step_deg=float(k)) for k in range(1, 6)])
    points.append(point(0.5, 0.5, None, default=True, bearings="impedance"))
    best = {"here 2000": Best("solid/ehd/flexible", "esdirk4", 1.0, True, 300.0)}
    study = TotalStudy((replace(few, name="here 2000"),), tuple(points), best)
    path = tmp_path / "page.html"
    path.write_text(total_page(study), "utf-8")
    document, console, picture = shown(path, 1200, 1100)
    assert console == [] and picture.startswith(b"\x89PNG")
    assert document.count("<path") == len(points)
    rows = re.findall(r"<tr class=\"\">|<tr>", document.partition('id="front"')[2])
    assert len(rows) == 6  # the front, and the default behind it
    numbers = re.findall(r'<text class="number" x="([\d.]+)" y="([\d.]+)"', document)
    assert len(numbers) == 5
    places = [(float(x), float(y)) for x, y in numbers]
    for k, (x, y) in enumerate(places):
        assert all(abs(x - u) >= 8.0 or abs(y - v) >= 11.0 for u, v in places[:k])


@pytest.mark.parametrize("name", ["diesel_i6", "diesel_v8"])
def test_no_measured_model_is_cheaper_than_a_shipped_default_and_as_close(name):
    """In all families together, at its own step and by a tenth of its cost; docs/decisions/0023-default-levels.md."""
    engine = load_engine(name)
    known = shipped.shipped(engine)
    for scene in some(known.best):
        points = at_scene(known.points, scene)
        usual = resolved(Settings(), engine)
        (own,) = (point for point in points if point.default)
        assert (own.crank, own.bearings, own.block) == (usual.crank, usual.bearings, usual.block)
        alike = [p for p in points if (p.integrator, p.step_deg) == (own.integrator, own.step_deg)]
        totals = {family: own.total(family) for family in FAMILIES if own.total(family) is not None}
        assert cheapest(alike, totals).cost > 0.9 * own.cost
