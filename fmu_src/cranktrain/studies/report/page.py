"""The report as one HTML file: without network and libraries, for print, screen and telephone."""

import html

from cranktrain.results.page_head import filled_page
from cranktrain.store.whole_file import marked
from cranktrain.studies.report.findings import Findings
from cranktrain.studies.report.sections import SECTIONS, Section

MARK = 'content="cranktrain report"'
REPORT = marked("report of cranktrain", MARK)


def page(found: Findings) -> str:
    """Text of the page; while sections are being made, it lists the missing ones."""
    titles = [section.title for section in SECTIONS]
    contents = "".join(f'<li><a href="#s{k}">{html.escape(title)}</a></li>' for k, title in enumerate(titles, 1))
    body = "".join(_section(k, section, found) for k, section in enumerate(SECTIONS, 1))
    if left := pending(found):
        again = f"<code>{html.escape(found.asked.command)}</code>"
        text = f"This report is not complete. Still to be made: {html.escape(', '.join(left))}. If it was interrupted: "
        body = f'<p class="missing" id="incomplete">{text}{again}</p>{body}'
    return whole_page("report", f"{found.engine.title}: cranktrain report", contents, body)


def whole_page(kind: str, title: str, contents: str, body: str) -> str:
    """A page of ``kind``, as :func:`filled_page` has it, with its sections and a list of them, both as HTML."""
    return filled_page(__package__, "report.html", kind, title, title, CONTENTS=contents, BODY=body)


def missing(found: Findings) -> dict[str, str]:
    """Sections without data, and instructions to produce the data."""
    return {section.title: section.remedy(found) for section in SECTIONS if not section.make(found)}


def pending(found: Findings) -> list[str]:
    """Sections that the running command has not made yet; none after its end."""
    if not found.running:
        return []
    makes = found.asked.makes
    own = [section for section in SECTIONS if not section.lacks(found.engine) and (makes or not section.commands)]
    return [section.title for section in own if not section.make(found)]


def _section(number: int, section: Section, found: Findings) -> str:
    parts = section.make(found)
    if not parts:
        needs = " or ".join(f"[{name}]" for name in section.needs)
        why = f": the engine file has no {needs}" if section.lacks(found.engine) else ""
        remedy = html.escape(section.remedy(found))
        parts = [f'<p class="missing">Not in this report{why}. To include it: <code>{remedy}</code></p>']
    reference = section.reference(found.engine.name)
    beside = f'<p class="reference">Beside the reference: {reference}.</p>' if reference else ""
    kind = ' class="front"' if number == 1 else ""
    title = html.escape(section.title)
    return f'<section id="s{number}"{kind}><h2>{number}. {title}</h2>{beside}{"".join(parts)}</section>'
