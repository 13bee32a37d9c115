"""Examples that run FMUs: each to its end, in a process of its own, with one number that is known and a picture."""

import json
from pathlib import Path

import pytest

from cranktrain.fmu.build import build_fmu

ROOT = Path(__file__).parents[2]
RUN = """
import importlib.util, json, sys
from pathlib import Path
specification = importlib.util.spec_from_file_location("example", sys.argv[1])
example = importlib.util.module_from_spec(specification)
specification.loader.exec_module(example)
fmus = list(map(Path, sys.argv[4:]))
print(json.dumps(example.main(sys.argv[2], fmus[0] if len(fmus) == 1 else fmus, json.loads(sys.argv[3]))))
"""


@pytest.fixture(scope="session")
def combustion(tmp_path_factory):
    return build_fmu("combustion_i6", tmp_path_factory.mktemp("combustion"))


@pytest.fixture
def run(ran, tmp_path):
    """What an example's ``main`` returns, with a picture, FMUs and how long to run."""

    def run(name, length, *fmus):
        picture = tmp_path / f"{name}.png"
        done = ran("-c", RUN, ROOT / "examples" / f"{name}.py", picture, json.dumps(length), *fmus)
        assert done.returncode == 0, done.stderr
        assert picture.stat().st_size > 10_000
        return json.loads(done.stdout.splitlines()[-1])

    return run


def test_csv_driven(run, fmu):
    """Pressures from the file in place of the trace that they are made of, at the angle of the mean wind-up."""
    assert run("csv_driven", 0.5, fmu) == pytest.approx(1.0, abs=0.05)


def test_coupled(run, fmu, combustion):
    told = run("coupled", 2, fmu, combustion)
    assert told["imep_pa"] == pytest.approx(15.34e5, rel=0.01) and told["steps"] == 1440


@pytest.mark.slow
def test_ssp(run, fmu, combustion):
    """Another master, which steps both at once: once its start has swung out, torsion is a few percent off at most."""
    swing, mean = run("ssp", 8, fmu, combustion)
    assert abs(mean) < 1e-3 and abs(swing) < 0.03


def test_own_combustion(run, fmu, combustion):
    """Torques are as the mean pressures, which each FMU knows for itself: 13.5 and 15.34 bar."""
    found = run("own_combustion", 2, fmu, combustion)
    assert found["own"] / found["module"] == pytest.approx(13.5 / 15.34, rel=0.01)
