"""Tables of texts fit the line: no column without a value, no heading or number cut, nothing lost."""

import re

import pytest

from cranktrain.cli.console import show, show_rows
from cranktrain.engine.file import load_engine
from cranktrain.results.columns import NOTHING, pages, told_columns
from cranktrain.results.tables import Table
from cranktrain.studies.report.elements import table

HEADER = ["place", "safety factor", "amplitude / MPa", "rev/min", "critical rev/min by order", "least film / um", "why"]
ORDERS = "3: 400, 6: 200, 9: 133, 12: 100"
ROWS = [
    [f"web[{k}].main", f"{2.0 + k:.3f}", f"{162.5 * k:.1f}", "2000", ORDERS, f"{k}e-12", "a rule"] for k in range(1, 4)
]
BESIDE = 3


def shown(parts, width, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", str(width))
    show_rows("A table", *parts)
    return capsys.readouterr().out.splitlines()


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


def test_headings_wrap_before_numbers_and_a_unit_keeps_its_stroke():
    [page] = pages(["amplitude / MPa", "x"], [["162.55555555", "1"]], 20, BESIDE)
    assert page.header[0] == "amplitude\n/ MPa" and page.rows == [["162.55555555", "1"]]
    [page] = pages(["by order"], [["3: 400, 6: 200, 9: 133"]], 20, BESIDE)
    assert page.rows == [["3: 400, 6: 200,\n9: 133"]]


def test_a_matrix_in_a_cell_takes_the_width_of_its_rows():
    """Rows of a matrix stay rows, and the column is as wide as the longest of them."""
    [page] = pages(["", "stiffness"], [["k", "3.4519e+09  1.7608e+09\n3.149e+08  5.9483e+08"]], 99, BESIDE)
    assert page.widths == [1, 22] and page.rows == [["k", "3.4519e+09  1.7608e+09\n3.149e+08  5.9483e+08"]]


def test_columns_without_a_value_are_left_out():
    rows = [["a", "", NOTHING, "0"], ["b", " ", "", NOTHING]]
    assert told_columns(["w", "x", "y", "z"], rows) == [0, 3]
    assert told_columns(["w", "x"], []) == [0, 1]
    page = table(Table("A table", ("w", "x", "y", "z"), tuple(map(tuple, rows))))
    assert re.findall("<th[^>]*>(.)</th>", page) == ["w", "z"]


@pytest.mark.parametrize("width", [60, 100, 120])
def test_the_console_takes_the_width_that_it_is_told(width, monkeypatch, capsys):
    lines = shown((HEADER, ROWS), width, monkeypatch, capsys)
    assert max(map(len, lines)) <= width
    text = "\n".join(lines)
    for heading in HEADER:
        assert all(word in text for word in heading.split())
    assert ("A table, continued" in text) == (width == 60)


def test_the_published_columns_of_an_engine_without_published_values_are_left_out(monkeypatch, capsys):
    from cranktrain.results.tables import critical_speed_table

    monkeypatch.setenv("COLUMNS", "100")
    for name, has in (("diesel_i6", True), ("four_petrol", False)):
        entry = {"order": 6.0, "rpm": 2372.0, "excitation": 1.0, "vector_sum": 1.0}
        show(critical_speed_table(load_engine(name), [entry]))
        assert ("published" in capsys.readouterr().out) is has
