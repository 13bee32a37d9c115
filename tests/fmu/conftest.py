"""The FMU under test: built as a user builds it, from a coarse mesh of the default engine."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

COARSE = 0.025  # m; a mesh of seconds: these tests are about the FMU, not about the crankshaft


@pytest.fixture(scope="session")
def engine():
    from cranktrain.engine import load_engine

    engine = load_engine("diesel_i6")
    return replace(engine, crankshaft=replace(engine.crankshaft, mesh_size=COARSE))


@pytest.fixture(scope="session")
def body(engine):
    from cranktrain.structure.reduction import running_body

    return running_body(engine)


@pytest.fixture(scope="session")
def fmu(engine, body, tmp_path_factory):
    import build_fmu

    return build_fmu.build(engine, body, tmp_path_factory.mktemp("fmu"), print)


@pytest.fixture(scope="session")
def cache(tmp_path_factory):
    """Cache of packages and compiled kernels, shared by the workers of one test run."""
    folder = tmp_path_factory.getbasetemp().parent / "cranktrain-cache"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def script(cache):
    """Run a script in a fresh process that can see fmpy and numba, but not this repository's sources."""

    def run(text, *arguments, cache=cache, check=True):
        environment = {
            **{key: value for key, value in os.environ.items() if key != "PYTHONPATH"},
            "CRANKTRAIN_CACHE": str(cache),
            "PYTHONPATH": str(Path(__file__).parent),
            "OMP_NUM_THREADS": "1",
        }
        done = subprocess.run(
            [sys.executable, "-c", "from driver import *\n" + text, *map(str, arguments)],
            capture_output=True,
            text=True,
            env=environment,
            timeout=300,
        )
        if check:
            assert done.returncode == 0, done.stderr[-3000:]
        return done

    return run
