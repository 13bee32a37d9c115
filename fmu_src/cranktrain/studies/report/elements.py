"""Elements of the report's page: paragraphs, tables and pictures as HTML."""

import base64
import html
from collections.abc import Sequence

from cranktrain.results.columns import NOTHING, told_columns
from cranktrain.results.tables import Table


def paragraph(text: str) -> str:
    """HTML paragraph of plain text."""
    return f"<p>{html.escape(text)}</p>"


def link(text: str, place: str) -> str:
    """HTML link with a text to an address."""
    return f'<a href="{html.escape(place)}">{html.escape(text)}</a>'


def table(content: Table) -> str:
    """HTML of a table of texts without empty columns; words are aligned left, numbers right."""
    told = told_columns(content.header, content.rows)
    header, *rows = ([row[k] for k in told] for row in (content.header, *content.rows))
    words = ["" if all(map(_numeric, column)) else ' class="words"' for column in zip(*rows, strict=True)]
    words = words or [""] * len(header)

    def cells(kind: str, row: Sequence[str]) -> str:
        pairs = zip(words, row, strict=True)
        return "<tr>" + "".join(f"<{kind}{how}>{html.escape(text)}</{kind}>" for how, text in pairs) + "</tr>"

    title = html.escape(content.title)
    body = "".join(cells("td", row) for row in rows)
    inside = f"<thead>{cells('th', header)}</thead><tbody>{body}</tbody>"
    return f'<p class="caption">{title}</p><div class="scroll"><table aria-label="{title}">{inside}</table></div>'


def _numeric(text: str) -> bool:
    """True if a cell is a number, with or without a per cent sign, or a dash."""
    try:
        float(text.removesuffix("%").strip() or "0")
    except ValueError:
        return text == NOTHING
    return True


def picture(png: bytes, words: str) -> str:
    """HTML of a picture that is embedded in the page, with its caption."""
    source = base64.b64encode(png).decode("ascii")
    said = html.escape(words)
    return f'<figure><img alt="{said}" src="data:image/png;base64,{source}"><figcaption>{said}</figcaption></figure>'
