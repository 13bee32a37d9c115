"""Pages of the site that are made from the code when it is built, and its equations.

MkDocs calls this file as a hook (``mkdocs.yml``). Command line, library and FMU variables are never written
by hand. Equations become MathML here, so that the site needs no script and no network.
"""

from __future__ import annotations

import html
import inspect
import re
import tomllib
from pathlib import Path
from typing import Any

import command_help
from latex2mathml.converter import convert
from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[1]
EQUATION = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
VIEWS = "cranktrain.results.views"
BEHIND_THE_FACE = (
    "cranktrain.results.run.Run", f"{VIEWS}.plot_data.Series", f"{VIEWS}.time_series.TimeSeries",
    f"{VIEWS}.over_speed.OrdersOverSpeed", f"{VIEWS}.over_speed.Campbell", f"{VIEWS}.found.VerbResult",
    f"{VIEWS}.frequencies.Frequencies",
)  # fmt: skip
"""What functions of the library take and return besides its own names."""
LINK = re.compile(r"\]\((?!https?:|#)([^)]+)\)")


def on_files(files: Any, config: Any) -> Any:
    """Add the generated pages."""
    pages = {
        "reference/command_line.md": command_help.page(),
        "reference/library.md": library(),
        "reference/fmu_variables.md": fmu_variables(),
        "contributing.md": of_the_root("CONTRIBUTING.md"),
        "changelog.md": of_the_root("CHANGELOG.md"),
    }
    for place, content in pages.items():
        files.append(File.generated(config, place, content=content))
    return files


def on_page_content(text: str, **_: Any) -> str:
    """Equations in TeX as MathML."""

    def equation(found: re.Match[str]) -> str:
        return convert(html.unescape(found[2]), display="block" if found[1] == "div" else "inline")

    return EQUATION.sub(equation, text)


def library() -> str:
    """What ``import cranktrain as ct`` offers, from its docstrings."""
    import cranktrain as ct
    from cranktrain.studies.requests.fields import Question

    things = {name: getattr(ct, name) for name in sorted(ct.__all__) if name != "__version__"}
    questions = {thing for thing in things.values() if isinstance(thing, type) and issubclass(thing, Question)}
    things = {name: thing for name, thing in things.items() if thing not in questions}
    sections = [
        _verb(name, thing, thing.verb.ask in questions)
        if hasattr(thing, "verb")
        else f"::: {thing.__module__}.{thing.__qualname__}\n"
        for name, thing in things.items()
    ]
    sections += [f"::: {place}\n" for place in BEHIND_THE_FACE]
    head = (
        "# Library\n\n`import cranktrain as ct`, then `ct.` and one of these names. A verb of the command line is the\n"
        "function of its name with the same options; the classes of results stand at the end of the page. See\n"
        "[work from Python](../how-to/library.md).\n\n"
    )
    return head + "\n".join(sections)


def _verb(name: str, function: Any, is_public: bool) -> str:
    """Description of a verb's function with its keywords, types and meaning; and of its question, if it is public."""
    known = function.verb
    doc = (function.__doc__ or "").partition("\nParameters\n")
    meanings = dict(line.split(" : ", 1) for line in doc[2].splitlines() if " : " in line)
    kinds = {known.subject.name: known.subject.kind} if known.subject is not None else {}
    kinds |= {one.name: one.kind for one in known.fields}
    rows = [f"* `{key}` ({html.escape(kind)}) – {html.escape(meanings[key])}" for key, kind in kinds.items()]
    text = "\n\n".join(" ".join(part.split()) for part in doc[0].strip().split("\n\n"))
    returned = inspect.signature(function).return_annotation
    subject = known.subject.name if known.subject is not None else ""
    value = f" As a value that can be kept, replaced and sent: `ct.{known.ask.__name__}(…).answer({subject})`."
    asked = f"Returns `{returned}`.{value if is_public else ''}"
    return f"## {name}\n\n{html.escape(text)}\n\n{asked}\n\n" + "\n".join(rows) + "\n"


def fmu_variables() -> str:
    """The FMUs' variables: the cranktrain's, and those of the modules beside it."""
    from cranktrain.modules.register import MODULES

    sections = {"Cranktrain": ROOT / "modelDescription"}
    sections |= {name.replace("_", " ").capitalize(): module.folder for name, module in MODULES.items()}
    return "# FMU variables\n\n" + "\n".join(_variables(title, folder) for title, folder in sections.items())


def _variables(title: str, folder: Path) -> str:
    """The variables that one ``interface.toml`` lists."""
    interface = tomllib.loads((folder / "interface.toml").read_text("utf-8"))
    rows = [
        f"| `{v['name']}` | {v['causality']} | {v.get('unit', '')} | {' '.join(v['description'].split())} |"
        for v in interface["variable"]
    ]
    place = (folder / "interface.toml").relative_to(ROOT)
    head = f"## {title}\n\nMade from `{place.as_posix()}`.\n\n| name | causality | unit | |\n"
    return head + "| --- | --- | --- | --- |\n" + "\n".join(rows) + "\n"


def of_the_root(name: str) -> str:
    """A page of the repository's root; its links lead from ``docs/``, or are none where they leave the site."""

    def target(found: re.Match[str]) -> str:
        place = found[1]
        return f"]({place.removeprefix('docs/')})" if place.startswith("docs/") else "]"

    return LINK.sub(target, (ROOT / name).read_text("utf-8"))
