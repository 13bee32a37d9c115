"""Studies of variants: each variant is what a run of the changed engine is; nothing that is finished is lost."""

import json
import subprocess
import sys
import time
import warnings
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from one_line import one_line

import cranktrain as ct
from cranktrain.core.typed_file import record
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.results.run_up.run_up import half_range, with_twist
from cranktrain.store.variant_files import JOURNAL, VariantFiles
from cranktrain.store.whole_file import PREFIX
from cranktrain.studies.torsion.shaft_orders import ShaftOrders
from cranktrain_lab.variants import optimum, running
from cranktrain_lab.variants.design import Design
from cranktrain_lab.variants.distributions import checked
from cranktrain_lab.variants.results.statistics import pareto_front, rank_coefficients
from cranktrain_lab.variants.running import Means, run_variants
from cranktrain_lab.variants.study import study_of
from cranktrain_lab.variants.tables import StudyTable

pytest.importorskip("pyarrow")
SPEEDS = {"single_petrol": (3000.0, 9000.0), "v12_petrol": (2000.0, 6500.0)}
STEP = 500.0
LINEAR = {"crank": "torsional", "method": "linear", "inherit": False, "load": 1.0}
FORMULA = {"reduction.torsional_source": "ker-wilson"}


X = {"x": ("uniform", 0.0, 1.0)}


def six():
    """The six with a damper whose fluid thins, its crank by a formula."""
    return ct.load_engine("diesel_i6").with_(FORMULA)


def speeds(engine):
    first, last = SPEEDS.get(engine.name, (1000.0, 2500.0))
    return np.arange(first, last + 1.0, STEP)


@pytest.mark.parametrize("name", ["single_petrol", "v12_petrol", "six"])
def test_a_variant_is_the_run_up_of_the_changed_engine(name):
    engine = six() if name == "six" else ct.load_engine(name)
    changes = {"pulley.polar_inertia": 0.93, "flywheel.mass": 1.04, "cylinders.piston_mass": 1.06}
    if engine.damper is not None:
        changes["damper.viscosity"] = 0.7
    own = {key: getattr(getattr(engine, key.split(".")[0]), key.split(".")[1]) for key in changes}
    values = {key: share * own[key] for key, share in changes.items()}
    rpm = speeds(engine)
    found = ct.vary(
        engine, {key: ("values", [value]) for key, value in values.items()}, method="grid", speeds_rpm=rpm,
        outputs=["twist", "pulley.torsion", "pulley.torsion.order[2.5]"], inherit=False, workers=1,
    )  # fmt: skip
    run_up = ct.runup(
        engine.with_(values), from_rpm=rpm[0], to_rpm=rpm[-1], step_rpm=STEP, damper=engine.damper is not None, **LINEAR
    )
    whole = with_twist(run_up)
    order = np.abs(whole.order(2.5))
    np.testing.assert_allclose(found.curve("pulley.torsion.order[2.5]")[0], order, rtol=1e-6)
    for output in ("twist", "pulley.torsion"):
        exact = half_range(whole, whole.amplitudes[output])
        np.testing.assert_allclose(found.curve(output)[0], exact, rtol=1e-3)
        assert found[output][0] == found.curve(output)[0].max()


def test_heat_and_torque_of_the_damper_are_those_of_a_run_in_time():
    """Of a fluid that thins; the run couples orders, the linear run-up does not."""
    engine = six()
    found = ct.vary(
        engine, {"damper.viscosity": ("values", [60.0, 100.0])}, method="grid", speeds_rpm=[1500, 2000],
        outputs=["damper.heat", "damper.torque"], inherit=False,
    )  # fmt: skip
    thinner = engine.with_({"damper.viscosity": 60.0})
    run = ct.simulate(thinner, speed_rpm=2000, crank="torsional", damper=True, inherit=False, load=1.0)
    assert found.curve("damper.heat")[0, 1] == pytest.approx(run.last_cycle("damper.heat")[1].mean(), rel=0.03)
    torque = 0.5 * np.ptp(run.last_cycle("damper.torque")[1])
    assert found.curve("damper.torque")[0, 1] == pytest.approx(torque, rel=0.03)


def test_a_heavy_flywheel_takes_all_torque_of_the_rods():
    """At low speed, a crank turns almost rigidly; then the last piece carries what the single's rod has on its pin."""
    engine = ct.load_engine("single_petrol")
    heavy = engine.with_(flywheel__polar_inertia=1.0, flywheel__diametral_inertia=0.51, flywheel__mass=30.0)
    given = {"outputs": ["shaft.torque", "shaft.stress"], "speeds_rpm": 1500, "inherit": False}
    found = ct.vary(heavy, {"load": ("values", [1.0])}, n=1, **given)
    made = ct.assemble(heavy, ct.Settings(crank="torsional"), inherit=False)
    rods = ShaftOrders(heavy, made.body, made.settings, GasTrace.from_engine(heavy), 24.0)
    known = rods.known(np.array([1500.0 * np.pi / 30.0])).sum(axis=2)
    torque = 0.5 * np.ptp(rods.signal(known, 1))
    assert found["shaft.torque"][0] == pytest.approx(torque, rel=0.02)
    c = heavy.crankshaft
    thin = min(c.flange_diameter, c.main_diameter)
    assert found["shaft.stress"][0] >= 0.999 * found["shaft.torque"][0] / (np.pi * thin**3 / 16.0)


def test_a_variant_in_time_is_a_run_of_the_changed_engine():
    engine = ct.load_engine("single_petrol")
    mass = 1.3 * engine.cylinders.piston_mass
    found = ct.vary(
        engine, {"cylinders.piston_mass": ("values", [mass])}, crank="beam", speeds_rpm=6000, n=1, settle=1e-4,
        outputs=["largest bearing.force.y", "pulley.torsion", "least bearing.film_thickness_min"], workers=1,
    )  # fmt: skip
    run = ct.simulate(engine.with_(cylinders__piston_mass=mass), speed_rpm=6000, crank="beam", settle=1e-4, load=1.0)
    cycle = run.last_cycle("bearing[1].force.y")[1]
    assert found["largest bearing[1].force.y"][0] == pytest.approx(cycle.max(), rel=1e-3)
    assert found["pulley.torsion"][0] == pytest.approx(0.5 * np.ptp(run.last_cycle("pulley.torsion")[1]), rel=1e-3)
    least = run.last_cycle("bearing[2].film_thickness_min")[1].min()
    assert found["least bearing[2].film_thickness_min"][0] == pytest.approx(least, rel=2e-3)


@pytest.mark.parametrize(
    ("kind", "numbers", "mean", "deviation"),
    [("uniform", {"low": 2.0, "high": 5.0}, 3.5, 3.0 / np.sqrt(12.0)),
     ("triangular", {"low": 0.0, "mode": 1.0, "high": 2.0}, 1.0, np.sqrt(1.0 / 6.0)),
     ("normal", {"mean": -3.0, "deviation": 0.2}, -3.0, 0.2),
     ("lognormal", {"median": 2.0, "factor": 1.2}, 2.0 * np.exp(0.5 * np.log(1.2) ** 2), None)],
)  # fmt: skip
@pytest.mark.parametrize("method", ["latin-hypercube", "sobol"])
def test_designs_have_the_moments_of_their_distributions(kind, numbers, mean, deviation, method):
    one = checked(kind, numbers, (), "here")
    values = Design(method, 1024, seed=5).values([one, checked("uniform", {"low": 0.0, "high": 1.0}, (), "there")])
    assert values[:, 0].mean() == pytest.approx(mean, rel=5e-3)
    assert deviation is None or values[:, 0].std() == pytest.approx(deviation, rel=0.02)
    assert abs(np.corrcoef(values.T)[0, 1]) < 0.1
    shares = np.sort((values[:, 1] * 1024).astype(int))
    assert np.array_equal(shares, np.arange(1024)), "each share of the range is met once"


def test_cut_normal_stays_within_its_ends():
    one = checked("normal", {"mean": 1.0, "deviation": 1.0, "low": 0.5, "high": 1.2}, (), "here")
    values = one.quantile(np.linspace(0.0, 1.0, 101))
    assert values[0] == pytest.approx(0.5) and values[-1] == pytest.approx(1.2) and np.all(np.diff(values) > 0.0)


def test_rank_coefficients_share_nothing_by_chance():
    rng = np.random.default_rng(1)
    x = rng.random((200, 3))
    x[:, 1] = 0.7 * x[:, 0] + 0.3 * x[:, 1]
    found = rank_coefficients(x, np.exp(x[:, 0]))
    assert found[0] == pytest.approx(1.0, abs=1e-9) and np.abs(found[1:]).max() < 1e-9


def test_the_front_is_what_none_beats():
    costs = np.random.default_rng(2).random((300, 3))
    costs[7] = np.nan
    costs[11] = costs[12]
    front = set(pareto_front(costs).tolist())
    for k in range(300):
        beaten = np.any(np.all(costs <= costs[k], axis=1) & np.any(costs < costs[k], axis=1))
        equal_before = any(np.array_equal(costs[j], costs[k]) for j in front if j != k)
        assert (k in front) == (not beaten and not equal_before and k != 7), k


def test_failures_are_kept_with_their_reasons(tmp_path):
    def answer(values):
        if values["x"] > 0.75:
            raise ct.SolverError("the film ruptured")
        return {"y": np.nan if values["x"] < 0.25 else values["x"]}

    found = ct.vary(answer, X, outputs=["y"], n=40, output=tmp_path / "v")
    assert sorted(set(found.failed.values())) == ["the film ruptured", "y is not finite"]
    assert len(found.failed) == 20 and np.isnan(found["y"]).sum() == 20
    assert found.to_dataframe()["failed"].value_counts()["the film ruptured"] == 10


def asked(n=30):
    table = {
        "outputs": ["twist"], "speeds_rpm": [4000.0, 6000.0], "inherit": False, "design": {"n": n},
        "vary": {"flywheel.mass": {"low": "-5 %", "high": "+5 %"}, "load": {"low": 0.9, "high": 1.1}},
    }  # fmt: skip
    return study_of(record(StudyTable, table), "asked", engine=ct.load_engine("single_petrol"))


def test_parts_and_processes_change_nothing(tmp_path, monkeypatch):
    """Small Parquet files, and a pool of one process."""
    one = ct.Variants(run_variants(asked(), tmp_path / "one", Means(workers=1)))
    pool = running.worker_pool
    monkeypatch.setattr(running, "worker_pool", lambda count, begin, given: pool(1, begin, given))
    monkeypatch.setattr("cranktrain.store.variant_files.ROWS", 7)
    two = ct.Variants(run_variants(asked(), tmp_path / "two", Means(workers=2)))
    assert len(list((tmp_path / "two").glob("part-*.parquet"))) == 5
    np.testing.assert_array_equal(one.values, two.values)
    np.testing.assert_allclose(one.curve("twist"), two.curve("twist"), rtol=1e-9)
    pandas = pytest.importorskip("pandas")
    assert len(pandas.read_parquet(tmp_path / "two")) == 30


SCRIPT = """
import sys, time
import cranktrain as ct
def answer(values):
    time.sleep(0.02)
    return {"y": values["x"] ** 2}
ct.vary(answer, {"x": ("uniform", 0.0, 1.0)}, outputs=["y"], n=500, output=sys.argv[1])
"""


def test_a_killed_study_loses_no_finished_variant(tmp_path):
    folder = tmp_path / "v"
    process = subprocess.Popen([sys.executable, "-c", SCRIPT, str(folder)])
    journal = folder / JOURNAL
    while process.poll() is None and not (journal.is_file() and journal.read_bytes().count(b"\n") >= 20):
        time.sleep(0.02)
    process.kill()
    process.wait()
    finished = [json.loads(line)[0] for line in journal.read_text().splitlines(keepends=True) if line.endswith("\n")]
    assert 20 <= len(finished) < 500
    with journal.open("a") as file:
        file.write("[499, [0.1], {")  # a line cut short
    calls = []
    answer = counted(calls)
    answer.__qualname__ = "answer"
    found = ct.vary(answer, X, outputs=["y"], n=500, output=folder)
    assert len(calls) == 500 - len(finished) and len(found) == 500
    np.testing.assert_allclose(found["y"], found["x"] ** 2, rtol=1e-12)
    with pytest.raises(ct.InputError, match="holds variants of another study"):
        ct.vary(answer, {"x": ("uniform", 0.0, 2.0)}, outputs=["y"], n=500, output=folder)


def counted(calls):
    def answer(values):
        calls.append(values["x"])
        return {"y": values["x"] ** 2}

    return answer


def test_a_part_that_is_lost_is_run_again_and_replaces_no_other(tmp_path, monkeypatch):
    """Parts are numbered on behind the last one, not by their count."""
    monkeypatch.setattr("cranktrain.store.variant_files.ROWS", 10)
    calls = []
    asked = {"outputs": ["y"], "n": 40, "output": tmp_path / "v"}
    first = ct.vary(counted(calls), X, **asked)
    (tmp_path / "v" / "part-00001.parquet").unlink()
    del calls[:]
    again = ct.vary(counted(calls), X, **asked)
    assert len(calls) == 10 and len(again) == 40
    np.testing.assert_array_equal(again["y"], first["y"])


@pytest.mark.parametrize(
    "line", ["[0, [0.5], {", "[0, [0.5, 1.0], {}, \"\"]\n", "[0, [0.5], {\"z\": [1.0]}, \"\"]\n", "\0\0\0\n", "7\n",
             "[0, [0.5], {\"y\": [1.0, 2.0]}, \"\"]\n", "[0, [0.5], {\"y\": [\"a\"]}, \"\"]\n"]
)  # fmt: skip
def test_what_a_kill_or_a_power_cut_leaves_is_not_taken_for_a_variant(tmp_path, line):
    """Killed as the folder was begun, as a line was added, as its journal was replaced."""
    folder, calls = tmp_path / "v", []
    folder.mkdir()
    (folder / f"{PREFIX}killed00.json").write_text("{")
    asked = {"outputs": ["y"], "n": 20, "output": folder}
    ct.vary(counted([]), X, **asked)
    (folder / "part-00000.parquet").unlink()
    (folder / JOURNAL).write_text(line)
    (folder / f"{JOURNAL}.new").write_text("[0,")
    found = ct.vary(counted(calls), X, **asked)
    assert len(calls) == len(found) == 20
    np.testing.assert_allclose(found["y"], found["x"] ** 2, rtol=1e-12)
    again = ct.vary(counted(calls), X, anew=True, **asked)
    assert len(again) == 20


def test_values_that_shape_the_crank():
    """Allowed where no finite elements are, told of where they are."""
    varied = {"crankshaft.pin_diameter": ("values", ["-5 %", "+0 %", "+5 %"])}
    given = {"outputs": ["frequency[2]"], "speeds_rpm": 5000, "method": "grid", "inherit": False}
    given["derived"] = {"big_end_bearing.diameter": "crankshaft.pin_diameter"}
    hz = ct.vary("single_petrol", varied, **given)["frequency[2]"]
    assert np.all(np.diff(hz) > 0.0), "a thicker pin is stiffer"
    with pytest.raises(ct.InputError, match="shapes the crankshaft's finite elements"):
        ct.vary("v6_split", varied, **given)


def test_an_optimum_lies_at_its_limit():
    """The least twist under less heat than the least twist has: heat is at its limit, twist is more."""
    engine = six()
    given = {"speeds_rpm": range(1200, 2401, 200), "inherit": False, "evaluations": 120, "workers": 1}
    varied = {"damper.viscosity": ("uniform", 20.0, 400.0), "damper.ring_inertia": ("uniform", 0.07, 0.13)}
    free = ct.optimize(engine, varied, minimize="twist", outputs=["damper.heat"], **given)
    heat = next(one["value"] for one in free["outputs"] if one["output"] == "damper.heat")
    held = ct.optimize(engine, varied, minimize="twist", limits={"damper.heat": {"at_most": 0.9 * heat}}, **given)
    least, found = ({one["output"]: one["value"] for one in made["outputs"]} for made in (free, held))
    assert held["passed"] and 0.88 * heat <= found["damper.heat"] <= 0.9 * heat * (1 + 1e-9)
    assert found["twist"] >= least["twist"]
    none = ct.optimize(engine, varied, minimize="twist", limits={"damper.heat": {"at_most": 1.0}}, **given)
    assert none["passed"] is False and not none["outputs"][1]["met"]


def two_mass(folder, *optimize, more=""):
    """A study file of the two-mass model."""
    path = folder / "two.toml"
    varied = '[vary]\n"damping_ratio" = { low = 0.05, high = 0.5 }', more, "[optimize]", 'minimize = "amplification"'
    path.write_text("\n".join(('model = "two-mass"\noutputs = ["amplification"]', *varied, *optimize)) + "\n")
    return path


@pytest.mark.parametrize("evaluations", [10, 11, 25, 100])
def test_a_search_of_few_evaluations_has_an_optimum(tmp_path, evaluations):
    """Fewer than a first generation: the least amplification of those that were made, which resuming does not lose."""
    ratio = '"frequency_ratio" = { low = 0.7, high = 1.1 }'
    path = two_mass(tmp_path, f"evaluations = {evaluations}", more=ratio)
    first, again = (ct.optimize(path, output=tmp_path / "o", workers=1) for _ in range(2))
    every = VariantFiles.open(tmp_path / "o").column("amplification")
    assert first["outputs"][0]["value"] == pytest.approx(every.min(), rel=1e-12)
    assert 5 <= first["evaluations"] <= evaluations
    assert again["values"] == first["values"]
    assert again["resumed"] == first["evaluations"] == again["evaluations"]


WRONG = [
    ({"damper.viscosity": {"low": "-20 %", "high": "+1e400 %"}}, {}, "high inf .* is no number of an engine"),
    ({"damper.viscosity": ("values", ["100 Pa s", "1e999 Pa s"])}, {}, "values inf .* is no number of an engine"),
    ({"damper.viscosty": ("uniform", 80, 120)}, {}, "did you mean 'viscosity'"),
    ({"damper.viscosity": ("unifrm", 80, 120)}, {}, "did you mean 'uniform'"),
    ({"damper.viscosity": ("uniform", 120, 80)}, {}, "low 120 is not below high 80"),
    ({"damper.viscosity": ("uniform", 80, 1e9)}, {}, "is not within 0.0001 to 100000 Pa s"),
    ({"damper.viscosity": 5}, {}, "is no distribution"),
    ({"damper.law": ("values", ["newtonian"])}, {}, "is not a physical quantity"),
    ({}, {}, "nothing is varied"),
    ({"load": ("uniform", 0, 1)}, {"outputs": ["twst"]}, "did you mean 'twist'"),
    ({"load": ("uniform", 0, 1)}, {"n": 100, "method": "sobol"}, "take 128"),
    ({"load": ("uniform", 0, 1)}, {"workers": 0}, "workers is 0"),
    ({"load": ("uniform", 0, 1)}, {"pareto": ["twist", "heat"]}, "'heat' is not among the study's outputs"),
]


@pytest.mark.parametrize(("varied", "given", "told"), WRONG)
def test_wrong_studies_are_one_line(varied, given, told):
    with one_line(match=told):
        ct.vary("diesel_i6", varied, **{"outputs": ["twist"], "speeds_rpm": 2000, "inherit": False, "n": 4, **given})


def test_limits_that_exclude_each_other_are_refused(tmp_path):
    path = two_mass(tmp_path, "limits = { amplification = { at_least = 5, at_most = 4 } }")
    with one_line("limits.'amplification': at_least 5 ... is above at_most 4 ... ; exchange them"):
        ct.optimize(path, output=tmp_path / "o")
    assert not (tmp_path / "o").exists()


def test_a_picture_lies_beside(tmp_path, capsys):
    from cranktrain.cli.main import main

    path = tmp_path / "small.toml"
    path.write_text(
        'engine = "single_petrol"\noutputs = ["twist", "frequency[1]"]\ninherit = false\n'
        'design.n = 30\npareto.minimize = ["twist", "frequency[1]"]\nspeeds = { from = 3000, to = 9000, points = 13 }\n'
        'vary."flywheel.mass" = { distribution = "normal", deviation = "3 %" }\nvary.load = { low = 0.9, high = 1.1 }\n'
    )
    assert main(["vary", str(path), "--output", str(tmp_path / "v"), "--workers", "1", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["variants"] == 30 and said["outputs"][0]["unit"] == "deg" and said["pareto"]
    assert (tmp_path / "v.png").read_bytes()[:4] == b"\x89PNG"
    found = ct.Variants.load(tmp_path / "v")
    assert found.to_dataframe().shape == (30, 5) and "30 variants" in repr(found)
    xarray = pytest.importorskip("xarray")
    assert isinstance(found.to_xarray(), xarray.Dataset) and found.to_xarray()["twist"].attrs["units"] == "rad"


def test_nothing_of_a_variant_stays_behind():
    """Warnings of the engine's own doubts are told once, by its loading, not by each variant."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ct.vary("v12_petrol", {"load": ("uniform", 0.9, 1.0)}, outputs=["twist"], n=3, speeds_rpm=3000, inherit=False)
    assert not list(Path().glob("*_variants"))


def test_a_frequency_that_a_crank_has_not_is_refused_at_once():
    with one_line("torsional frequencies only, no frequency[50]", kind=ct.SolverError):
        ct.vary("single_petrol", {"load": ("uniform", 0.9, 1.0)}, outputs=["frequency[50]"], speeds_rpm=3000, n=4,
                inherit=False)  # fmt: skip


@pytest.mark.parametrize("asked", [partial(ct.vary, outputs=["twist"]), partial(ct.optimize, minimize="twist")])
def test_a_lack_of_parquet_is_told_before_the_model_is_made(asked, monkeypatch):
    for module in (running, optimum):
        monkeypatch.setattr(module, "model_of", lambda *given: pytest.fail("the model is made"))
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ct.InputError, match=r"kept as Parquet; pip install pyarrow"):
        asked("single_petrol", {"flywheel.mass": ("uniform", 4.0, 6.0)}, speeds_rpm=[3000.0, 4000.0])
