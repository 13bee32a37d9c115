"""Files that released versions wrote are opened, with the values that they were written with.

``tests/data/formats`` has a folder for each release whose formats differ from the one before, made by
``tests/format_samples.py``; nothing in it is ever made anew.
"""

import re
from pathlib import Path

import format_samples
import numpy as np
import pytest
from one_line import one_line

import cranktrain as ct
from cranktrain.core import reduced_body
from cranktrain.core.errors import StoreError
from cranktrain.engine.file import load_engine
from cranktrain.film.table import database
from cranktrain.modules.register import module_of
from cranktrain.store import hdf5
from cranktrain.store.bodies import import_body
from cranktrain.store.film_tables import load_film_table
from cranktrain.studies.scene import load_scene
from cranktrain_lab.calibration.targets import load_targets
from cranktrain_lab.harness.file import load_harness
from cranktrain_lab.identification.identify import read_measured_file
from cranktrain_lab.noise import result as noise
from cranktrain_lab.variants.results.variants import Variants
from cranktrain_lab.variants.study import load_study
from cranktrain_lab.wear.records import WearHistory

ROOT = Path(__file__).parents[2]
RELEASES = sorted((ROOT / "tests" / "data" / "formats").iterdir())
each_release = pytest.mark.parametrize("release", RELEASES, ids=lambda folder: folder.name)
BODIES = ("body.h5", "body.npz", "body")


def test_there_is_a_release():
    assert RELEASES


@each_release
def test_runs(release):
    run = ct.load_run(release / "run.h5")
    assert run.attributes["engine"] == "single_petrol"
    assert run["pulley.torsion"].shape == run.time.shape and np.ptp(run["pulley.torsion"]) > 0.0
    assert run.angle[-1] - run.angle[0] == pytest.approx(4.0 * np.pi, rel=1e-3)


@each_release
def test_run_ups(release):
    run_up = ct.load_run(release / "run_up.h5")
    np.testing.assert_allclose(run_up.speeds_rpm, [1000.0, 1200.0, 1400.0])
    assert run_up["pulley.torsion", 1].to("deg")[0] == pytest.approx(3.56, abs=0.01)


@each_release
@pytest.mark.parametrize("name", BODIES)
def test_bodies(release, name):
    body = import_body(release / name)
    assert body.mass == 5.0 and body.interfaces == ("gear",)
    np.testing.assert_allclose(np.diag(body.inertia), [0.03, 0.03, 0.05])


@each_release
def test_film_tables(release):
    table = load_film_table(release / "film_table.h5", format_samples.TABLE)
    assert np.isfinite(table.arrays.aligned).all()


@each_release
def test_variants(release):
    pytest.importorskip("pyarrow")
    found = Variants.load(release / "variants")
    assert found.names == ("flywheel.mass",) and found.numbers.size == 4
    assert load_study(release / "study.toml").engine.name == "single_petrol"


@each_release
def test_wear_histories(release):
    history = WearHistory.load_file(release / "wear.h5")
    assert history.settled and history.bearings.tolist() == [1.0, 2.0] and history.worn.max() == 2e-6


@each_release
def test_files_of_users(release):
    """An engine with all its keys, modules, scene, harness, targets and measured data."""
    engine = load_engine(release / "engine.toml")
    assert engine.name == "single_petrol" and engine.n_cylinders == 1
    for name in ("combustion_i6", "valvetrain_i6"):
        path = release / f"{name}.toml"
        assert module_of(path).read(path) is not None
    assert load_scene(release / "scene.toml").engine.name == "diesel_i6"
    assert load_harness(release / "harness.toml").scenarios
    assert load_targets(release / "diesel_i6_pulley.targets.toml", load_engine("diesel_i6")).targets
    table, _ = read_measured_file(release / "diesel_i6_measured.toml")
    assert table is not None


def test_a_later_schema_is_refused_in_one_line(tmp_path):
    import h5py

    path = tmp_path / "run.h5"
    path.write_bytes((RELEASES[-1] / "run.h5").read_bytes())
    with h5py.File(path, "r+") as file:
        file.attrs["schema"] = hdf5.RESULT_SCHEMA + 1
    with one_line(match=rf"schema {hdf5.RESULT_SCHEMA + 1}", kind=StoreError):
        ct.load_run(path)


def test_the_page_states_the_formats_as_they_are():
    """Numbers in the table of docs/public.md."""
    text = (ROOT / "docs" / "public.md").read_text("utf-8")
    stated = {name: int(number) for name, number in re.findall(r"^\| ([^|`]+?) \|[^|]*\| (\d+) \|", text, re.MULTILINE)}
    assert stated == {
        "result": hdf5.RESULT_SCHEMA,
        "run-up": hdf5.RUN_UP_SCHEMA,
        "reduced body": reduced_body.SCHEMA,
        "film table": database.SCHEMA,
        "wear history": hdf5.WEAR_SCHEMA,
        "noise": noise.SCHEMA,
        "variants": 1,
    }
