"""Common head of the package's HTML files, and insertion of texts into their templates; no network requests."""

import html
import json
import math
from importlib.resources import files
from typing import Any


def page_head(kind: str, title: str) -> str:
    """HTML from the doctype to the title; ``kind`` is the kind of file, such as ``report``."""
    return (
        '<!doctype html>\n<html lang="en">\n<meta charset="utf-8">'
        f'<meta name="generator" content="cranktrain {kind}">\n'
        '<meta http-equiv="Content-Security-Policy"\n'
        " content=\"default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:\">\n"
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(title)}</title>"
    )


def filled_page(package: str, template: str, kind: str, title: str, heading: str, **parts: str) -> str:
    """Fill a package's template file: head, heading, and the HTML ``parts`` in place of ``@PART@``."""
    page = files(package).joinpath(template).read_text(encoding="utf-8")
    for word, text in {"HEAD": page_head(kind, title), "TITLE": html.escape(heading), **parts}.items():
        page = page.replace(f"@{word}@", text)
    return page


def script_data(data: dict[str, Any]) -> str:
    """JSON text for use inside a script element, with ``<`` escaped so that no closing tag can end the script."""
    return json.dumps(jsonable(data), allow_nan=False).replace("<", "\\u003c")


def jsonable(value: Any) -> Any:
    """Return a value for JSON: numbers that are not finite become null, arrays lists, NumPy scalars plain numbers."""
    if isinstance(value, dict):
        return {str(key): jsonable(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [jsonable(entry) for entry in value]
    if hasattr(value, "tolist"):
        return jsonable(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value
