"""The report as one HTML file: no network, no library; it prints, and is read on a telephone."""

from __future__ import annotations

import html

from cranktrain.engine.firing import firing_text
from cranktrain.results.page_head import filled_page
from cranktrain.store.whole_file import marked
from cranktrain.studies.report.findings import Findings
from cranktrain.studies.report.sections import SECTIONS, Section

MARK = 'content="cranktrain report"'
REPORT = marked("report of cranktrain", MARK)


def page(found: Findings) -> str:
    """The page's text."""
    titles = [section.title for section in SECTIONS]
    contents = "".join(f'<li><a href="#s{k}">{html.escape(title)}</a></li>' for k, title in enumerate(titles, 1))
    body = f"<p>{html.escape(firing_text(found.engine))}.</p>"
    body += "".join(_section(k, section, found) for k, section in enumerate(SECTIONS, 1))
    return whole_page("report", f"{found.engine.title}: cranktrain report", contents, body)


def whole_page(kind: str, title: str, contents: str, body: str) -> str:
    """A page of ``kind``, as :func:`filled_page` has it, with its sections and a list of them, both as HTML."""
    return filled_page(__package__, "report.html", kind, title, title, CONTENTS=contents, BODY=body)


def missing(found: Findings) -> dict[str, str]:
    """Sections that lack their data, and what makes them."""
    return {section.title: section.remedy(found.engine, found.name) for section in SECTIONS if not section.make(found)}


def _section(number: int, section: Section, found: Findings) -> str:
    parts = section.make(found)
    if not parts:
        remedy = html.escape(section.remedy(found.engine, found.name))
        parts = [f'<p class="missing">Not in this report. To include it: <code>{remedy}</code></p>']
    reference = section.reference(found.engine.name)
    beside = f'<p class="reference">Beside the reference: {reference}.</p>' if reference else ""
    return f'<section id="s{number}"><h2>{number}. {html.escape(section.title)}</h2>{beside}{"".join(parts)}</section>'
