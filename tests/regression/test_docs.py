"""What the documents say holds: links lead somewhere, files exist, commands are understood, the tutorial runs."""

import re
import shlex
from pathlib import Path

import pytest

import cranktrain
from cranktrain.cli.main import _parser

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = Path(cranktrain.__file__).parent
FILES = {
    str(path.relative_to(ROOT)): path.read_text("utf-8")
    for path in sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
}
GENERATED = re.compile(r"docs/(reference/\w+|decisions/index|contributing|changelog)\.md")
"""Pages that ``docs/reference.py`` adds to the site."""
COMMAND = re.compile(r"^(?: {4})?cranktrain ((?:(?!\.\.\.).)*?)(?:\s*#.*)?$", re.MULTILINE)
FOLDERS = (
    "",
    "fmu_src",
    "fmu_src/cranktrain",
    "modelDescription",
    "tests",
    "tests/literature",
    "fmu_src/cranktrain/engine/data",
)


def anchors(text):
    """Anchors of a page's headings, as MkDocs makes them."""
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", heading.lower()).strip()) for heading in headings}


@pytest.mark.parametrize("name", FILES)
def test_links_lead_somewhere(name):
    for link in re.findall(r"\]\(([^)\s]+)\)", FILES[name]):
        if link.startswith(("http://", "https://")):
            continue
        place, _, anchor = link.partition("#")
        path = (ROOT / name).parent.joinpath(place).resolve() if place else ROOT / name
        assert path.exists() or GENERATED.fullmatch(str(path.relative_to(ROOT))), link
        assert not anchor or anchor in anchors(path.read_text("utf-8")), link


@pytest.mark.parametrize("name", sorted(FILES.keys() - {"CHANGELOG.md"}))
def test_files_exist(name):
    for file in re.findall(r"`((?:[\w-]+/)+[\w.-]+\.(?:py|toml|txt|csv))`", FILES[name]):
        assert any((ROOT / folder / file).is_file() for folder in FOLDERS), file


@pytest.mark.parametrize("name", FILES)
def test_commands_are_understood(name):
    for command in COMMAND.findall(FILES[name]):
        _parser().parse_args(shlex.split(command))


def test_site_builds(tmp_path):
    """Without a broken link or a page that is in no menu."""
    pytest.importorskip("mkdocs")
    pytest.importorskip("material")
    from mkdocs.commands.build import build
    from mkdocs.config import load_config

    build(load_config(str(ROOT / "mkdocs.yml"), site_dir=str(tmp_path), strict=True))
    assert "<math" in (tmp_path / "theory" / "linear.html").read_text("utf-8")
    assert "--bearings" in (tmp_path / "reference" / "command_line.html").read_text("utf-8")


@pytest.mark.parametrize("name", ["README.md", "docs/tutorial.md"])
def test_python_runs(name, tmp_path, monkeypatch):
    """With a crank of beams and one cycle, which take no finite elements."""
    if name == "README.md":
        pytest.importorskip("h5netcdf")
    (text,) = re.findall(r"```python\n(.*?)```", FILES[name], re.DOTALL)
    monkeypatch.chdir(tmp_path)
    found = {}
    exec(re.sub(r"speed_rpm=2000.*", 'speed_rpm=2000, cycles=1, crank="beam")', text), found)
    assert found["torsion"].shape == found["run"].time.shape
    assert found["amplitude"][6.0] > 0.0
    assert (tmp_path / "torsion.png").is_file()
    if name == "README.md":
        assert found["data"]["pulley.torsion"].attrs["units"] == "rad"
        assert (tmp_path / "run_up.png").is_file() and len(set(found["largest"].values())) == 3


def test_python_of_the_library_s_page_runs(tmp_path, monkeypatch):
    """All its blocks, one after the other as they stand there."""
    pytest.importorskip("xarray")
    monkeypatch.chdir(tmp_path)
    found = {}
    for text in re.findall(r"```python\n(.*?)```", FILES["docs/how-to/library.md"], re.DOTALL):
        exec(text, found)
    assert found["run"].engine.name == "single_petrol" and (tmp_path / "heavy.toml").is_file()
    assert (tmp_path / "orders.png").is_file() and (tmp_path / "campbell.png").is_file()


def test_python_and_studies_of_the_page_on_variants_run(tmp_path, monkeypatch):
    """Its script as it stands there, its study files read as they stand there."""
    pytest.importorskip("pyarrow")
    from cranktrain.studies.variants.study import load_study

    monkeypatch.chdir(tmp_path)
    page = FILES["docs/how-to/vary.md"]
    (text,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    found = {}
    exec(text, found)
    assert len(found["found"]) == 64 and (tmp_path / "single.png").is_file() and found["best"]["evaluations"] <= 60
    studies = re.findall(r"```toml\n# (\w+\.toml)\n(.*?)```", page, re.DOTALL)
    assert len(studies) == 2
    for name, study in studies:
        (tmp_path / name).write_text(study, "utf-8")
        assert load_study(tmp_path / name).engine.name == "diesel_i6"
    assert load_study(ROOT / "examples" / "damper_study.toml").aim.minimize == "twist"
