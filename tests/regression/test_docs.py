"""What the documents say holds: links lead somewhere, commands are understood, code runs, the site builds."""

import argparse
import html
import json
import re
import shlex
from pathlib import Path

import pytest
from browser import needs_browser, shown
from public_names import parsers_of

import cranktrain as ct
from cranktrain.cli.functions import verb_of
from cranktrain.cli.main import _parser, _verb
from cranktrain.cli.verbs import VERBS

ROOT = Path(__file__).resolve().parents[2]
FILES = {
    str(path.relative_to(ROOT)): path.read_text("utf-8")
    for path in sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
}
GENERATED = re.compile(r"docs/(reference/\w+|contributing|changelog|notebooks/\w+)\.md")
"""Pages that ``docs/reference.py`` and ``docs/notebook_pages.py`` add to the site."""
EXAMPLES = "docs/how-to/library_examples.md"
COMMAND = re.compile(r"^(?: {4})?cranktrain ((?:(?!\.\.\.).)*?)(?:\s*#.*)?$", re.MULTILINE)
FOLDERS = (
    "",
    "fmu_src",
    "fmu_src/cranktrain",
    "fmu_src/cranktrain_lab",
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
    lost = []
    for link in re.findall(r"\]\(([^)\s]+)\)", FILES[name]):
        if link.startswith(("http://", "https://")):
            continue
        place, _, anchor = link.partition("#")
        path = (ROOT / name).parent.joinpath(place).resolve() if place else ROOT / name
        there = path.exists() or GENERATED.fullmatch(str(path.relative_to(ROOT)))
        if not there or (anchor and anchor not in anchors(path.read_text("utf-8"))):
            lost.append(link)
    assert lost == []


def test_every_decision_is_in_the_index():
    pages = {Path(name).name for name in FILES if name.startswith("docs/decisions/0")}
    assert set(re.findall(r"^\* \[\d{4}: .*\]\((\S+)\)$", FILES["docs/decisions/README.md"], re.MULTILINE)) == pages


@pytest.mark.parametrize("name", sorted(FILES.keys() - {"CHANGELOG.md"}))
def test_files_exist(name):
    named = re.findall(r"`((?:[\w-]+/)+[\w.-]+\.(?:py|toml|txt|csv))`", FILES[name])
    assert [file for file in named if not any((ROOT / folder / file).is_file() for folder in FOLDERS)] == []


@pytest.mark.parametrize("name", sorted(FILES.keys() - {"CONTRIBUTING.md"}))  # test_contributing runs those
def test_commands_are_understood(name):
    for command in COMMAND.findall(FILES[name]):
        words = shlex.split(command)
        _parser(_verb(words)).parse_args(words)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, built without a broken link or a page that is in no menu; what fails to build ends here."""
    for package in ("mkdocs", "material", "mkdocstrings", "nbclient", "nbconvert", "ipykernel", "xarray"):
        pytest.importorskip(package)
    from mkdocs.commands.build import build
    from mkdocs.config import load_config

    folder = tmp_path_factory.mktemp("site")
    build(load_config(str(ROOT / "mkdocs.yml"), site_dir=str(folder), strict=True))
    return folder


def words(page):
    """Text of a page, as it is read."""
    body = page.read_text("utf-8").partition("<article")[2].partition("</article>")[0]
    return " ".join(html.unescape(re.sub(r"<[^>]*>", " ", body)).split())


def test_equations_are_mathml(site):
    assert "<math" in (site / "theory" / "linear.html").read_text("utf-8")


def test_the_whole_help_of_every_verb_is_on_the_site(site):
    """Every option with its help; nothing of it depends on how wide the page is."""
    text = re.sub(r"\s", "", words(site / "reference" / "command_line.html"))
    for name, parser in parsers_of(_parser(*VERBS)):
        if name not in VERBS:  # a family, whose kinds have sections
            continue
        shape = parser._get_formatter()
        actions = [one for one in parser._actions if one.help not in (None, argparse.SUPPRESS)]
        for part in [parser.description, *map(shape._expand_help, actions)]:
            if part != "show this help message and exit":
                assert re.sub(r"\s", "", part) in text, f"{name}: {part}"
        options = [one for action in actions for one in action.option_strings if action.dest != "help"]
        assert all(one in text for one in options), name
    assert "--no-film-table" in text


def test_descriptions_of_the_library_stand_beside_their_types(site):
    """The first attribute of ``Assembly``, a parameter of a verb's function, and no role of another tool."""
    text = words(site / "reference" / "library.html")
    assert re.search(r"engine \( ?Engine ?\) – engine as passed to assemble", text)
    assert re.search(r"speed_rpm \( ?float ?\) – rev/min, at least 20", text)
    for page in site.rglob("*.html"):
        assert not re.search(r":(mod|func|class|meth|attr|data): ?<code>", page.read_text("utf-8")), page.name


def test_notebooks_are_on_the_site_with_what_they_show(site):
    for path in (ROOT / "docs" / "notebooks").glob("*.ipynb"):
        page = site / "notebooks" / f"{path.stem}.html"
        pictures = re.findall(r'<img[^>]* src="([^"]+)"', page.read_text("utf-8").partition("<article")[2])
        assert all((page.parent / one).stat().st_size > 5000 for one in pictures if not one.startswith("data:"))
        assert (site / "notebooks" / path.name).is_file() and "executed when this page was made" in words(page)
    assert "least film" in words(site / "notebooks" / "first_run.html")


SEARCH = """<script>addEventListener("load", () => setTimeout(() => {
  const line = document.querySelector("input[name=query]");
  line.focus();
  setTimeout(() => { line.value = "fatigue"; line.dispatchEvent(new Event("keyup", {bubbles: true})); }, 500);
}, 300));</script></body>"""


@needs_browser
@pytest.mark.parametrize("width", [1300, 800])
def test_search_works_from_a_folder(site, width):
    """Of a page that is opened as a file: results with links, and nothing in the console."""
    page = site / f"searched_{width}.html"
    page.write_text((site / "index.html").read_text("utf-8").replace("</body>", SEARCH), "utf-8")
    document, console, _ = shown(page, width, budget_ms=8000)
    assert not console
    assert re.search(r'md-search-result__link[^>]*href="[^"]*how-to/fatigue', document) or re.search(
        r'href="[^"]*how-to/fatigue[^"]*"[^>]*md-search-result__link', document
    )


def test_the_site_asks_no_network(site):
    for page in [*site.rglob("*.html"), *(site / "assets").glob("*.js")]:
        asked = re.findall(r"""<(?:script|link|img|iframe)[^>]*(?:src|href)="(https?:[^"]+)""", page.read_text("utf-8"))
        assert not asked, (page.name, asked)


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
    from cranktrain_lab.variants.study import load_study

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


def python_of(name, heading="", until=""):
    """Blocks of Python of a page, of one section."""
    text = FILES[name].partition(heading)[2] if heading else FILES[name]
    return re.findall(r"```python\n(.*?)```", text.partition(until)[0] if until else text, re.DOTALL)


@pytest.mark.slow
def test_examples_of_seconds_run(tmp_path, monkeypatch, recwarn):
    pytest.importorskip("xarray")
    monkeypatch.chdir(tmp_path)
    found = {}
    for text in python_of(EXAMPLES, "## In seconds", "## In minutes"):
        exec(text, found)
    assert {path.name for path in tmp_path.iterdir()} >= {"run.csv", "run_up", "orders.csv", "scene.h5"}
    assert len(repr(found["plan"]).splitlines()) < 10


@pytest.mark.slow
def test_examples_of_minutes_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = {}
    for text in [*python_of(EXAMPLES, "## In seconds", "## In minutes"), *python_of(EXAMPLES, "## In minutes")]:
        exec(text, found)
    assert {path.name for path in tmp_path.iterdir()} >= {"stress.h5", "mode.png", "calibrated.toml", "report.html"}


def test_every_public_name_has_an_example_that_runs():
    """In code that other tests run: notebooks, README, tutorial, the library's two pages."""
    pages = (
        "README.md",
        "docs/tutorial.md",
        "docs/how-to/library.md",
        "docs/how-to/vary.md",
        "docs/how-to/explore.md",
        EXAMPLES,
    )
    code = [text for name in pages for text in python_of(name)]
    for path in (ROOT / "docs" / "notebooks").glob("*.ipynb"):
        code += [
            "".join(one["source"]) for one in json.loads(path.read_text("utf-8"))["cells"] if one["cell_type"] == "code"
        ]
    used = set(re.findall(r"\bct\.(\w+)", "\n".join(code)))
    questions = {verb_of(thing).ask.__name__ for name in used if hasattr(thing := getattr(ct, name), "verb")}
    assert set(ct.__all__) - {"__version__"} <= used | questions
