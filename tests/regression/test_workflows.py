"""What GitHub runs is there: parts of ``.ci/run``, files, Pythons that the package names, jobs that others wait for."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from some import some

ROOT = Path(__file__).parents[2]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
SCRIPT = (ROOT / ".ci" / "run").read_text("utf-8") if (ROOT / ".ci" / "run").is_file() else ""


def read(path):
    yaml = pytest.importorskip("yaml")
    return yaml.safe_load(path.read_text("utf-8"))


def jobs(name):
    return read(ROOT / ".github" / "workflows" / name)["jobs"]


def parts():
    """Parts that the script takes: the patterns of its one ``case``."""
    table = SCRIPT.partition('case "$part" in')[2].partition("*)")[0]
    names = re.findall(r"^ {8}([\w| ]+)\)", table, re.MULTILINE)
    return {part.strip() for name in names for part in name.split("|")}


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_parts_and_needs_exist(path):
    workflow = read(path)
    for name, job in some(workflow["jobs"].items()):
        needs = job.get("needs", [])
        assert job.get("steps") or "uses" in job, name
        assert set([needs] if isinstance(needs, str) else needs) <= workflow["jobs"].keys(), name
        if "uses" in job:
            assert (ROOT / job["uses"]).is_file()
            continue
        assert job["timeout-minutes"] <= 120
        for step in job["steps"]:
            assert ("run" in step) != ("uses" in step)
            assert "uses" not in step or re.fullmatch(r"[\w-]+/[\w/-]+@[\w./]+", step["uses"])
            for line in step.get("run", "").splitlines():
                words = line.split()
                assert words[0] != ".ci/run" or set(words[1:]) <= parts(), line


def test_the_script_takes_no_other_part():
    assert {"lint", "docs", "newer", "test", "some", "wheel", "installed"} == parts()
    if sys.platform != "win32":
        done = subprocess.run([ROOT / ".ci" / "run", "tests"], capture_output=True, text=True)
        assert done.returncode == 2 and "no part 'tests'" in done.stderr


def test_files_of_the_script_exist():
    named = re.findall(r"tests/[\w/]+\.py", SCRIPT)
    listed = re.search(r"printf 'tests/properties/test_%s\.py ' ([\w ]+)\)", SCRIPT)[1].split()
    named += [f"tests/properties/test_{name}.py" for name in listed]
    assert len(named) > 8 and all((ROOT / name).is_file() for name in named)


def test_pythons_are_those_of_the_package():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    stated = [one.rpartition(" ")[2] for one in project["classifiers"] if re.search(r"Python :: 3\.\d+$", one)]
    assert project["requires-python"] == f">={stated[0]}"
    for workflow, name in (("ci.yml", "tests"), ("ci.yml", "windows"), ("release.yml", "installed")):
        assert jobs(workflow)[name]["strategy"]["matrix"]["python"] == stated


def test_the_citation_is_of_this_package():
    """Whole by its schema: ``make lint``."""
    citation = read(ROOT / "CITATION.cff")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert citation["license"] == project["license"] and citation["cff-version"] == "1.2.0"
    released = re.search(r"^## (\d+\.\d+\.\d+) \((\d{4}-\d\d-\d\d)\)", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M)
    assert (citation["version"], str(citation["date-released"])) == released.groups()
