"""The wheel, from the source archive, simulates and builds FMUs in an environment of its own; nothing compiles."""

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

import cranktrain
from cranktrain.core.errors import InputError
from cranktrain.core.machine_code import OFF, WHOLE, library_name, this_platform
from cranktrain.fmu.native import link
from cranktrain.modules.register import MODULES

ROOT = Path(cranktrain.__file__).parents[2]
PIECES = "fmu_src", "modelDescription", "MANIFEST.in", "pyproject.toml", "setup.py", "README.md", "LICENSE"
SIMULATE = """
import sys
from cranktrain.cli.main import main
code = main("simulate diesel_i6 --speed 2000 --crank rigid --bearings linear --cycles 1 --output run.h5".split())
print(code, "numba" in sys.modules)
"""
BUILD = """
import cranktrain as ct
for name in ("valvetrain_i6", "combustion_v8"):
    print(ct.build_fmu(name, "dist", platforms=[{platform!r}]))
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Built as ``make wheel`` does, through the source archive, of a copy with this machine's libraries."""
    if not (ROOT / "setup.py").is_file():
        pytest.skip("not in the repository")
    copy, ignore = tmp_path_factory.mktemp("sources"), shutil.ignore_patterns("__pycache__", "lib", "*.egg-info")
    for name in PIECES:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, copy / name, ignore=ignore)
        else:
            shutil.copyfile(ROOT / name, copy / name)
    try:
        for kind in (WHOLE, *MODULES):
            made = link.library(kind, this_platform())
            place = copy / "fmu_src" / "cranktrain" / "fmu" / "native" / "lib" / this_platform()
            place.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(made, place / library_name(kind, made.suffix))
    except InputError as error:
        pytest.skip(str(error))
    command = [sys.executable, "-m", "build", "-o", str(copy / "dist"), str(copy)]
    done = subprocess.run(command, capture_output=True, text=True)
    if "No matching distribution" in done.stdout + done.stderr:
        pytest.skip("no package index within reach")
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr
    return next((copy / "dist").glob("*.whl"))


@pytest.fixture(scope="module")
def python(wheel, tmp_path_factory):
    """Run a text in an environment that has the wheel and what it depends on, but none of the repository."""
    place = tmp_path_factory.mktemp("environment")
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", OFF)}
    environment["CRANKTRAIN_CACHE"] = str(place / "cache")
    subprocess.run([sys.executable, "-m", "venv", str(place / "venv")], check=True)
    own = place / "venv" / ("Scripts" if os.name == "nt" else "bin") / "python"
    subprocess.run([own, "-m", "pip", "install", "-q", "--no-deps", str(wheel)], check=True, env=environment)
    # Dependencies are this environment's; its own links to the repository, files of the kind .pth, are not followed.
    site = subprocess.check_output([own, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"], text=True)
    Path(site.strip(), "dependencies.pth").write_text(sysconfig.get_path("purelib"))

    def run(text):
        done = subprocess.run(
            [own, "-c", text], cwd=place, capture_output=True, text=True, env=environment, timeout=3600
        )
        assert done.returncode == 0, done.stderr[-3000:]
        return done.stdout.split("\n")

    run.place = place
    return run


@pytest.mark.slow
def test_the_wheel_carries_libraries_and_what_an_fmu_is_built_from(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    libraries = [name for name in names if name.startswith(f"cranktrain/fmu/native/lib/{this_platform()}/")]
    assert len(libraries) == 1 + len(MODULES)
    for name in ("cranktrain_slave.py", "LICENSE", "modelDescription/interface.toml", "modelDescription/units.toml"):
        assert f"cranktrain/fmu/carried/{name}" in names
    assert "cranktrain/fmu/native/c/fmi2.c" in names


@pytest.mark.slow
def test_the_version_is_known_without_git(wheel, python):
    """The sources were copied without their repository; a tag gives them another one."""
    version = python("import cranktrain; print(cranktrain.__version__)")[0]
    assert version.endswith(".dev0") and wheel.name == f"cranktrain-{version}-py3-none-any.whl"


def other_python(version):
    """A Python of a version that makes environments, or None."""
    own = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv", "versions").glob(
        f"{version}.*/bin/python{version}"
    )
    for found in (shutil.which(f"python{version}"), *own):
        if found and not subprocess.run([found, "-c", "import venv, ensurepip"], capture_output=True).returncode:
            return str(found)
    return None


@pytest.mark.slow
@pytest.mark.parametrize("version", ["3.11", "3.12", "3.13"])
def test_the_wheel_runs_in_an_empty_environment(wheel, version):
    """With dependencies of its own, no compiler on the path, no cache: nothing compiles, the FMU has its binary."""
    found = other_python(version)
    if found is None:
        pytest.skip(f"no other Python: {version}")
    script = ROOT / "tests" / "installed_wheel.py"
    done = subprocess.run([found, script, wheel, "--fmu", "valvetrain_i6"], capture_output=True, text=True)
    if "No matching distribution" in done.stderr or "Could not find a version" in done.stderr:
        pytest.skip("no package index within reach")
    assert done.returncode == 0, done.stdout + done.stderr[-3000:]
    said = json.loads(done.stdout)
    assert said["compiled"] == [] and this_platform() in said["binaries"] and said["python"].startswith(version)


@pytest.mark.slow
def test_a_simulation_from_the_wheel_compiles_nothing(python):
    place = python("import cranktrain; print(cranktrain.__file__)")[0]
    assert Path(place).is_relative_to(python.place)
    assert python(SIMULATE)[-2] == "0 False"
    assert not list((python.place / "cache").rglob("*.nb?"))


@pytest.mark.slow
def test_the_wheel_builds_native_fmus_without_a_compiler(python):
    paths = [Path(line) for line in python(BUILD.format(platform=this_platform())) if line.endswith(".fmu")]
    for path in paths:
        names = zipfile.ZipFile(python.place / path).namelist()
        assert "resources/native.bin" in names and f"binaries/{this_platform()}/{path.stem}.so" in names
    assert len(paths) == 2
    assert not list((python.place / "cache").rglob("programs"))
