"""Tables of texts fit the line: no column without a value, no heading or number cut, nothing lost."""

import re

import pytest

from cranktrain.cli.console import show_rows
from cranktrain.results.columns import NOTHING, pages, told_columns
from cranktrain.results.tables import Table
from cranktrain.studies.report.elements import table

HEADER = ["place", "safety factor", "amplitude / MPa", "rev/min", "critical rev/min by order", "least film / um", "why"]
ORDERS = "3: 400, 6: 200, 9: 133, 12: 100"
ROWS = [
    [f"web[{k}].main", f"{2.0 + k:.3f}", f"{162.5 * k:.1f}", "2000", ORDERS, f"{k}e-12", "a rule"] for k in range(1, 4)
]
BESIDE = 3


@pytest.mark.parametrize("room", [30, 60, 80, 99, 119, 300])
def test_tables_fit_the_line_and_keep_all_words_whole(room):
    found = pages(HEADER, ROWS, room, BESIDE)
    columns = [k for page in found for k in (page.columns if page is found[0] else page.columns[1:])]
    assert columns == list(range(len(HEADER)))
    for page in found:
        assert sum(page.widths) + BESIDE * len(page.widths) <= room or len(page.columns) == 2
        for width, *texts in zip(page.widths, page.header, *page.rows, strict=True):
            assert max(len(word) for text in texts for word in text.split()) <= width
        for k, text in zip(page.columns, page.header, strict=True):
            assert text.split() == HEADER[k].split()
        for row, texts in zip(ROWS, page.rows, strict=True):
            assert [text.split() for text in texts] == [row[k].split() for k in page.columns]


@pytest.mark.parametrize(
    ("header", "row", "room", "wrapped", "rows", "widths"),
    [
        (["amplitude / MPa", "x"], ["162.55555555", "1"], 20, "amplitude\n/ MPa", ["162.55555555", "1"], None),
        (["by order"], ["3: 400, 6: 200, 9: 133"], 20, "by order", ["3: 400, 6: 200,\n9: 133"], None),
        (["", "stiffness"], ["k", "3.4e+09  1.7608e+09\n3.1e+08  5.94e+08"], 99, "",
         ["k", "3.4e+09  1.7608e+09\n3.1e+08  5.94e+08"], [1, 19]),
    ],
)  # fmt: skip
def test_headings_wrap_before_numbers_and_rows_of_a_matrix_stay_rows(header, row, room, wrapped, rows, widths):
    [page] = pages(header, [row], room, BESIDE)
    assert page.header[0] == wrapped and page.rows == [rows] and widths in (None, page.widths)


def test_columns_without_a_value_are_left_out():
    rows = [["a", "", NOTHING, "0"], ["b", " ", "", NOTHING]]
    assert told_columns(["w", "x", "y", "z"], rows) == [0, 3]
    assert told_columns(["w", "x"], []) == [0, 1]
    page = table(Table("A table", ("w", "x", "y", "z"), tuple(map(tuple, rows))))
    assert re.findall("<th[^>]*>(.)</th>", page) == ["w", "z"]


@pytest.mark.parametrize("width", [60, 100, 120])
def test_the_console_takes_the_width_that_it_is_told(width, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", str(width))
    show_rows("A table", HEADER, ROWS)
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= width
    text = "\n".join(lines)
    for heading in HEADER:
        assert all(word in text for word in heading.split())
    assert ("A table, continued" in text) == (width == 60)
