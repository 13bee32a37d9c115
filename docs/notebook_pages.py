"""Notebooks as pages of the site: executed, and converted to Markdown with their outputs.

``docs/notebooks`` holds notebooks without outputs. MkDocs calls this file as a hook; tests call :func:`executed`. An
execution is kept in ``out/notebooks`` for as long as neither the notebook nor the package changes.
"""

from __future__ import annotations

import re
import sys
import tempfile
from hashlib import sha256
from pathlib import Path
from typing import Any

import nbformat

ROOT = Path(__file__).resolve().parents[1]
NOTEBOOKS = ROOT / "docs" / "notebooks"
KEPT = ROOT / "out" / "notebooks"
LIMIT_S = 1800
PLAIN_TABLE = re.compile(r'<style scoped>.*?</style>\n?|(?<=<table) border="1" class="dataframe"', re.DOTALL)


def on_files(files: Any, config: Any) -> Any:
    """Add a page, and its pictures, for each notebook; the notebook itself is there to be downloaded."""
    from mkdocs.structure.files import File

    for path in sorted(NOTEBOOKS.glob("*.ipynb")):
        text, pictures = page(path, kept(path))
        files.append(File.generated(config, f"notebooks/{path.stem}.md", content=text))
        for name, content in pictures.items():
            files.append(File.generated(config, f"notebooks/{name}", content=content))
    return files


def executed(path: Path) -> Any:
    """A notebook after all its cells ran in an empty folder; ``CellExecutionError`` of the first that fails."""
    from nbclient import NotebookClient

    book = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory(prefix="cranktrain-notebook-") as folder:
        where = {"metadata": {"path": folder}}
        NotebookClient(book, kernel_name="python3", timeout=LIMIT_S, resources=where).execute()
    place = _place(path)
    place.parent.mkdir(parents=True, exist_ok=True)
    for old in place.parent.glob(f"{path.stem}-*.ipynb"):
        old.unlink()
    nbformat.write(book, place)
    return book


def kept(path: Path) -> Any:
    """The kept execution of a notebook, or a new one."""
    place = _place(path)
    return nbformat.read(place, as_version=4) if place.is_file() else executed(path)


def page(path: Path, book: Any) -> tuple[str, dict[str, bytes]]:
    """A notebook with outputs as Markdown, and its pictures by name."""
    from nbconvert import MarkdownExporter

    text, found = MarkdownExporter().from_notebook_node(book, {"output_files_dir": path.stem})
    title, _, rest = PLAIN_TABLE.sub("", text).strip().partition("\n")
    note = f"*A [notebook]({path.name}), executed when this page was made.*"
    return f"{title}\n\n{note}\n{rest}\n", dict(found["outputs"])


def _place(path: Path) -> Path:
    """File of the execution of a notebook as it and the package are now."""
    digest = sha256(sys.version.encode())
    sources = (one for ending in ("py", "toml") for one in (ROOT / "fmu_src").rglob(f"*.{ending}"))
    for one in (path, *sorted(sources)):
        digest.update(one.read_bytes())
    return KEPT / f"{path.stem}-{digest.hexdigest()[:16]}.ipynb"
