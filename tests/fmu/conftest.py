"""The FMUs under test, built as a user builds them: the default engine's, and both engines' with all that they have."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from coarse_engines import COARSE, NATIVE, built, coarse
from fmus_by_version import MODULES, VERSIONS, module_fmu, six, torsional_fmu
from inside_a_step import PARTNERS, Engine
from small_fmus import LOUD, MASS, SPRING, small_fmu

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.fmu.build import build_fmu
from cranktrain.fmu.flat import FlatModel
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain_lab.coupling.modules import COMBUSTION, CRANKTRAIN, VALVETRAIN
from cranktrain_lab.coupling.recording_unit import MeasuredPressures


@pytest.fixture(scope="session")
def engine():
    return coarse("diesel_i6").engine


@pytest.fixture(scope="session")
def body():
    return coarse("diesel_i6").cranks["solid"]


@pytest.fixture(scope="session")
def model(engine, body):
    """The six without block and damper, its crank rigid or solid."""
    return FlatModel(engine, {"rigid": coarse("diesel_i6").cranks["rigid"], "solid": body})


@pytest.fixture(scope="session")
def fmu(model, tmp_path_factory):
    """The six's FMU without block and damper."""
    return built(model, tmp_path_factory.mktemp("fmu"))


@pytest.fixture(scope="session")
def partner(tmp_path_factory):
    """The six's combustion."""
    return build_fmu("combustion_i6", tmp_path_factory.mktemp("partner"))


@pytest.fixture(scope="session")
def fmus(tmp_path_factory):
    """By version of FMI the native FMUs of the six, its crank torsional, by module."""
    return {fmi: six(tmp_path_factory.mktemp(f"fmi{fmi[0]}"), fmi) for fmi in VERSIONS}


@pytest.fixture(scope="session", params=[*PARTNERS, "single_petrol"])
def calling(request, tmp_path_factory):
    """Cranktrain of FMI 3.0, combustion and valve train; for the single the pressures of its trace alone."""
    folder = tmp_path_factory.mktemp(request.param)
    cranktrain = torsional_fmu(request.param, folder)
    if request.param in PARTNERS:
        return Engine(cranktrain, *(module_fmu(module, folder) for module in PARTNERS[request.param]))
    engine = load_engine(request.param)
    return Engine(cranktrain, MeasuredPressures(engine, GasTrace.from_engine(engine)))


@pytest.fixture(scope="session")
def calling_six(fmus):
    """The six with its valve train; only its cranktrain is of FMI 3.0."""
    two, three = fmus["2.0"], fmus["3.0"]
    return Engine(three[CRANKTRAIN], two[COMBUSTION], two[VALVETRAIN])


@pytest.fixture(scope="session", params=list(COARSE))
def whole(request):
    """Each engine with block and damper."""
    return coarse(request.param)


@pytest.fixture(scope="session")
def whole_fmu(whole, tmp_path_factory):
    return built(whole, tmp_path_factory.mktemp(whole.engine.name))


@pytest.fixture(scope="session", params=["native", "python"])
def each_fmu(request, whole, whole_fmu, tmp_path_factory):
    """Each engine's FMU with block and damper, of either kind."""
    if request.param == "python":
        return whole_fmu
    return built(whole, tmp_path_factory.mktemp(f"{whole.engine.name}_native"), NATIVE)


@pytest.fixture(scope="session")
def cache(tmp_path_factory):
    """Cache of packages and compiled kernels, shared by the workers of one test run."""
    folder = tmp_path_factory.getbasetemp().parent / "cranktrain-cache"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def ran(cache):
    """Run this repository's Python with words in a process of its own; FMUs find their kernels where other tests do."""
    environment = os.environ | {"CRANKTRAIN_CACHE": str(cache), "PYTHONPATH": str(SOURCES), "OMP_NUM_THREADS": "1"}

    def run(*words, cwd=None):
        words = [sys.executable, *map(str, words)]
        return subprocess.run(words, capture_output=True, text=True, env=environment, cwd=cwd, timeout=3600)

    return run


@pytest.fixture(scope="session")
def script(cache):
    """Run a script in a fresh process that can see fmpy and numba, but not this repository's sources.

    What is said of kernels that compile, which they do once on a machine, is left out unless ``announced``.
    ``variables`` are further ones of the environment.
    """

    def run(text, *arguments, cache=cache, check=True, announced=False, **variables):
        environment = {
            **{key: value for key, value in os.environ.items() if key != "PYTHONPATH"},
            "CRANKTRAIN_CACHE": str(cache),
            "PYTHONPATH": str(Path(__file__).parent),
            "OMP_NUM_THREADS": "1",
            **variables,
        }
        done = subprocess.run(
            [sys.executable, "-c", "from driver import *\n" + text, *map(str, arguments)],
            capture_output=True,
            text=True,
            env=environment,
            timeout=3600,  # kernels may be compiled within, on a busy machine
        )
        if check:
            assert done.returncode == 0, done.stderr[-3000:]
        if not announced:
            lines = done.stderr.splitlines(keepends=True)
            done.stderr = "".join(line for line in lines if ": compiling kernels, " not in line)
        return done

    return run


SOURCES = Path(__file__).parents[2] / "fmu_src"


@pytest.fixture(
    scope="session",
    params=[
        *("cranktrain", *MODULES, *(f"{name} native" for name in MODULES)),
        pytest.param("cranktrain native", marks=pytest.mark.slow),
    ],
)
def shipped(request, tmp_path_factory):
    """One FMU of each kind that is built here, those of the six, Python's and native: a path."""
    name, _, native = request.param.partition(" ")
    if request.param == "cranktrain":
        return request.getfixturevalue("fmu")
    folder, platforms = tmp_path_factory.mktemp(name + native), ("linux64",) if native else ()
    try:
        if name == "cranktrain":
            return built(request.getfixturevalue("model"), folder, platforms)
        return build_fmu(name, folder, platforms=platforms)
    except InputError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    """A folder with small FMUs in Python: a mass, a spring, and one of numbers as large as there may be."""
    folder = tmp_path_factory.mktemp("small")
    for kind in (MASS, SPRING, LOUD):
        small_fmu(folder, *kind)
    return folder


@pytest.fixture
def harness(small, tmp_path, monkeypatch, capsys):
    """Run a text as a harness file beside the small FMUs: exit code, object on stdout, stderr."""
    monkeypatch.chdir(tmp_path)
    for fmu in small.glob("*.fmu"):
        shutil.copy(fmu, tmp_path)

    def run(text, *options):
        Path("harness.toml").write_text(text, "utf-8")
        code = main(["harness", "harness.toml", "--json", *options])
        printed = capsys.readouterr()
        return code, json.loads(printed.out), printed.err

    return run
