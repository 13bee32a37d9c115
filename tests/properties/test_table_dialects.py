"""One table, written in sixty dialects, is read alike to the last digit; what cannot be read is named by its line."""

import json
import random
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from one_line import one_line
from refusals import refused_files
from some import some
from table_dialects import Column, dialects

from cranktrain.core.errors import InputError
from cranktrain.core.text_table import read_table, table_chunks
from cranktrain.engine.torsional_chain import read_chain
from cranktrain.loads.pressure_points import read_points
from cranktrain.results.orders.measured import read_measured_orders

ROOT = Path(__file__).parents[2]
DIALECTS = dialects()
IDS = [f"{k}" for k in range(len(DIALECTS))]
ANGLE = Column(("Crank angle", "Kurbelwinkel"), ("deg", "°KW", "°", "°CA", "Grad"))
PRESSURE = Column(("Cylinder pressure", "Zylinderdruck"), ("bar",))
VOLUME = Column(("V", "Volumen"), ("cm3", "cm³", "ccm"))


def trace():
    """Angles and pressures with all digits, above and below a thousand."""
    rng = random.Random(4)
    return [(-360.0 + 7.5 * k, rng.uniform(1.0, 3200.0), rng.uniform(50.0, 2000.0)) for k in range(97)]


@pytest.mark.parametrize("dialect", DIALECTS, ids=IDS)
def test_pressures_are_alike_to_the_last_digit(dialect, tmp_path):
    rows = trace()
    path = tmp_path / "p.CSV"
    path.write_bytes(dialect.written([ANGLE, VOLUME, PRESSURE], [(a, v, p) for a, p, v in rows]))
    points = read_points(path, None, 6)
    ((angle, pressure),) = points.parts()
    assert angle.tolist() == [row[0] for row in rows] and pressure[:, 0].tolist() == [row[1] for row in rows]
    assert points.units == ["bar"]


def both(folder, dialect, end, columns, rows):
    """Files of one table, plainly written and in a dialect, whose name ends otherwise."""
    plain, path = folder / "plain.csv", folder / f"own.{end}"
    lines = [
        [column.names[0] for column in columns],
        *(["" if one is None else str(one) for one in row] for row in rows),
    ]
    plain.write_text("\n".join(map(",".join, lines)))
    path.write_bytes(dialect.written(columns, rows))
    return plain, path


@pytest.mark.parametrize("dialect", DIALECTS, ids=IDS)
def test_orders_are_alike_to_the_last_digit(dialect, tmp_path):
    rng = random.Random(5)
    rows = [(1600.0 + 100.0 * k, 0.5 * (k % 5 + 1), rng.uniform(0.0, 0.3), "deg") for k in range(20)]
    names = ("speed_rpm", "Drehzahl"), ("order", "Ordnung"), ("amplitude", "Amplitude"), ("unit", "Einheit")
    files = both(tmp_path, dialect, "Txt", tuple(map(Column, names)), rows)
    expected, found = ({output: {order: [one.tolist() for one in pair] for order, pair in orders.items()}
                        for output, orders in read_measured_orders(path).items()} for path in files)  # fmt: skip
    assert expected == found


@pytest.mark.parametrize("dialect", DIALECTS, ids=IDS)
def test_drive_lines_are_alike_to_the_last_digit(dialect, tmp_path):
    rng = random.Random(6)
    columns = (
        Column(("disc", "Scheibe")), Column(("inertia", "Trägheitsmoment"), ("kg m^2", "kg m²", "kg*m^2")),
        Column(("damping", "Dämpfung"), ("N m s/rad", "Nms/rad")), Column(("to", "nach")),
        Column(("stiffness", "Steifigkeit"), ("N m/rad", "Nm/rad", "N·m/rad")),
        Column(("loss_factor", "Verlustfaktor")),
    )  # fmt: skip
    rows = [(f"m{k}", rng.uniform(1e-3, 2.0), 0.0, None, rng.uniform(1e4, 1e6), rng.uniform(0, 0.1)) for k in range(6)]
    plain, path = both(tmp_path, dialect, "TSV", columns, [*rows, ("m6", 0.25, 0.0, "m1", 2e5, None)])
    assert read_chain(path) == read_chain(plain)


@pytest.mark.parametrize(
    ("text", "names", "units"),
    [
        ("CA [deg];p [bar]\n0;1\n1;2\n", ("CA", "p"), ("deg", "bar")),
        ("CA;V;p\ndeg;cm3;bar\n0;1;2\n1;2;3\n", ("CA", "V", "p"), ("deg", "cm3", "bar")),
        ("1;2\nCA;p\ndeg;bar\n0;1\n1;2\n", ("CA", "p"), ("deg", "bar")),
        ("% angle pressure\n% deg bar\n 0 1\n 1 2\n", ("angle", "pressure"), ("deg", "bar")),
        ("| CA [deg] | p [bar] |\n|---|---|\n| 0 | 1 |\n| 1 | 2 |\n", ("CA", "p"), ("deg", "bar")),
        ("Bench 3\nSpeed;3000\nCA;p\n(deg);(bar)\n0;1\n1;2\n", ("CA", "p"), ("deg", "bar")),
        ("  CA    p\n  deg   bar\n   0.00  1\n   1.00  2\n", ("CA", "p"), ("deg", "bar")),
        ("CA in deg;p / bar;\n0;1;\n1;2;\n", ("CA", "p"), ("deg", "bar")),
        ("time;a;b\n0;0;1\n1;2;2\n", ("time", "a", "b"), ("", "", "")),
        ("m;s\n0;1\n1;2\n", ("m", "s"), ("", "")),
        ("s;bar\n0;1\n1;2\n", ("", ""), ("s", "bar")),
        ("0 1\n1 2\n", ("", ""), ("", "")),
    ],
)
def test_names_and_units_are_found_above_the_values(tmp_path, text, names, units):
    path = tmp_path / "t.csv"
    path.write_text(text)
    table = read_table(path, "table", "give one")
    assert (table.names, table.units) == (names, units)
    assert table.values[:, -1].tolist() in ([1.0, 2.0], [2.0, 3.0]) and table.values[:, 0].tolist() == [0.0, 1.0]


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("CA;p\n0;1.5\n1;2.5\n;\n;;\n", [[0.0, 1.5], [1.0, 2.5]]),
        ('"CA","p"\n"0","1,5"\n"1","2,5"\n', [[0.0, 1.5], [1.0, 2.5]]),
        ("CA,p\n0;1.5\n1;2.5\n", [[0.0, 1.5], [1.0, 2.5]]),
        ("CA;p\n0;1.5\n1;---\n2;n.a.\n", [[0.0, 1.5], [1.0, None], [2.0, None]]),
        ("Speed;3000\n0;1.5\n1;2.5\n", [[0.0, 1.5], [1.0, 2.5]]),
        ("\ufeffsep=;\nCA;p\n0;1'000,5\n1;2'000,5\n", [[0.0, 1000.5], [1.0, 2000.5]]),
        ("CA p\n  0.000000D+00  0.15D+01\n  0.1D+01  0.25D+01\n", [[0.0, 1.5], [1.0, 2.5]]),
        ("CA;p\r\u22121;1.5\r1;2.5\r\x1a", [[-1.0, 1.5], [1.0, 2.5]]),
    ],
)
def test_odd_tables_are_read(tmp_path, text, values):
    path = tmp_path / "t.csv"
    path.write_bytes(text.encode())
    found = read_table(path, "table", "give one")
    assert [[None if np.isnan(one) else one for one in row] for row in found.values.tolist()] == values
    assert found.names == ("CA", "p") or "Speed" in text


def test_columns_are_chosen_by_name_or_number(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("t [s];CA [deg];PCYL1 [bar];state\n0;10;1,5;ok\n1;20;2,5;ok\n")
    for columns in (("PCYL1", "CA"), ("#3", "#2"), ("pcyl1 [bar]", "ca")):
        table = read_table(path, "table", "give one", columns=columns)
        assert table.values.tolist() == [[1.5, 10.0], [2.5, 20.0]] and table.units == ("bar", "deg")
    with pytest.raises(InputError, match=r"t\.csv: no column 'PCYL2'; did you mean 'PCYL1'\?"):
        read_table(path, "table", "give one", columns=["PCYL2"])


@pytest.mark.parametrize(("text", "says"), refused_files()["table"]["in_encodings"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_the_first_line_that_does_not_fit_is_named(tmp_path, text, says, encoding):
    if "\0" in text and encoding != "utf-8":
        return
    path = tmp_path / "t.csv"
    path.write_bytes(text.encode(encoding))
    with one_line("t.csv", says):
        read_table(path, "table", "give one")


def test_a_bad_line_far_down_a_long_file_has_its_own_number(tmp_path):
    """Beyond the first block that is parsed at once; the lines before it are read."""
    path, count = tmp_path / "long.csv", 400_000
    lines = [f"{k};{k % 97}.25" for k in range(count)]
    lines[350_000] = "350000;3,2,1"
    path.write_text("angle;p\n" + "\n".join(lines))
    read = 0
    with pytest.raises(InputError, match=r"long\.csv: line 350002: '350000;3,2,1' is not two numbers"):
        for part in table_chunks(path, "table", "give one", rows=50_000):
            assert len(part.lines) <= 50_000 and part.first_line == part.lines[0]
            assert np.array_equal(part.values[:, 0], part.lines - 2)
            read += len(part.lines)
    assert 200_000 < read < 350_001


def test_decimal_commas_that_begin_late_are_read(tmp_path):
    path = tmp_path / "late.csv"
    path.write_text("CA;p\n" + "".join(f"{k};{k % 60}\n" for k in range(3000)) + "3000;1,5\n3001,25;2\n")
    assert read_table(path, "table", "").values[-2:].tolist() == [[3000.0, 1.5], [3001.25, 2.0]]


def test_tables_of_words_end_at_a_stated_size(tmp_path, monkeypatch):
    """They are held whole; a table of numbers by mistake would fill the memory."""
    path = tmp_path / "orders.csv"
    path.write_text("speed_rpm,order,amplitude,unit\n" + "1000,0.5,0.1,deg\n" * 60)
    monkeypatch.setattr("cranktrain.core.text_rows.MOST", 60)
    assert read_measured_orders(path)
    monkeypatch.setattr("cranktrain.core.text_rows.MOST", 59)
    with pytest.raises(InputError, match=r"^orders\.csv: line 61: has more than 59 rows, too many for a file of"):
        read_measured_orders(path)


@pytest.mark.slow
def test_memory_does_not_grow_with_the_file():
    """A trace of 400 MB takes no more memory than one of 80 MB in each reader that it can reach."""
    command = [sys.executable, "-m", "benchmarks.large_tables", "--megabytes", "80", "400"]
    told = json.loads(subprocess.check_output(command, cwd=ROOT, text=True))
    runs, true = told["runs"], told["true_peak_bar"]
    peaks = {(run["command"], run["megabytes"]): run["peak_memory_mb"] for run in runs}
    for name in some({run["command"] for run in runs}):
        assert peaks[name, 400] < peaks[name, 80] + 40 and peaks[name, 400] < 500
        found = [run["peak_bar"] for run in runs if run["command"] == name and run["peak_bar"] is not None]
        assert found == pytest.approx(len(found) * [true], rel=1e-3) and len(found) in (0, 2)
