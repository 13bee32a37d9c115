"""Head of all HTML files of the package: no network requests, and a layout that fits a telephone."""

from __future__ import annotations

import html


def page_head(kind: str, title: str) -> str:
    """From the doctype to the title; ``kind`` is the kind of file, such as ``report``."""
    return (
        '<!doctype html>\n<html lang="en">\n<meta charset="utf-8">'
        f'<meta name="generator" content="cranktrain {kind}">\n'
        '<meta http-equiv="Content-Security-Policy"\n'
        " content=\"default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:\">\n"
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(title)}</title>"
    )
