"""The report: tables and curves equal their sources, the page is whole, reads anywhere and asks nobody."""

import json
import math
import re
import struct
import zlib
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest
from browser import needs_browser, shown

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.engine.file import engine_provenance, load_engine
from cranktrain.results.orders.harmonics import order_amplitudes
from cranktrain.results.orders.resonances import peaks
from cranktrain.results.run_up.run_up import AXIAL, TORSION, RunUp
from cranktrain.results.tables import NOTHING, housed_table
from cranktrain.structure.crank.modal import KINDS
from cranktrain.studies.report import findings as source
from cranktrain.studies.report.chart import Axis, line_chart
from cranktrain.studies.report.findings import Findings, Torsion
from cranktrain.studies.report.page import missing, page
from cranktrain.studies.report.sections import SECTIONS
from cranktrain.studies.report.vibration import cycle

EMPTY_TAGS = {"meta", "circle", "img", "line", "polyline", "br", "i"}
ENGINE = load_engine("diesel_i6")


def resonance(names=(TORSION,), zeta=0.05, engine="diesel_i6"):
    """A run-up in which orders 6 and 9 meet a mode at 238 Hz."""
    speeds, orders = np.arange(1000.0, 2801.0, 20.0) * math.pi / 30.0, np.array([3.0, 6.0, 9.0])
    ratio = np.outer(speeds, orders) / (2.0 * math.pi * 238.0)
    response = 0.01 / (1.0 - ratio**2 + 2j * zeta * ratio) / orders
    none = np.zeros(speeds.size, dtype=int)
    extremes = {name: np.column_stack((-abs(response).sum(1), 0 * speeds, abs(response).sum(1))) for name in names}
    scale = {TORSION: 1.0, AXIAL: 1e-2}
    return RunUp(
        speeds=speeds, orders=orders, amplitudes={name: scale[name] * response for name in names}, extremes=extremes,
        cycles=none, repeats=none, left=0.0 * speeds,
        attributes={"engine": engine, "crank": "torsional", "steady": "linear"},
    )  # fmt: skip


def png():
    """A picture of one pixel."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">2I5B", 1, 1, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(b"\0\xff\0\0")) + chunk(b"IEND", b"")
    )


@pytest.fixture(scope="module")
def modes():
    """What ``modal`` reports, with frequencies of the right number and made-up values."""
    share = {"bending": 0.1, "torsional": 0.8, "axial": 0.1}
    rows = [{"hz": 238.4, "shape": "torsional", "shares": share}, {"hz": 301.7, "shape": "axial", "shares": share}]
    named = {"first_torsional_hz": 238.4, "second_torsional_hz": 640.0, "first_axial_hz": 301.7}
    return {
        "crankshaft_free": {"modes": rows, "torsional_hz": [238.4, 640.0]},
        "cranktrain": {"modes": rows, **named},
        "critical_speeds": [{"order": o, "rpm": 60.0 * 238.4 / o} for o in ENGINE.published.critical_orders],
        "reduction": {"dofs_full": 81000, "modes": 150, "max_relative_error": 7e-4},
    }  # fmt: skip


@pytest.fixture(scope="module")
def found(modes, tmp_path_factory):
    folder = tmp_path_factory.mktemp("pictures")
    (folder / "stresses.png").write_bytes(png())
    torsion, damped = (Torsion(run, peaks(run)) for run in (resonance(), resonance(zeta=0.3)))
    return Findings(
        engine=ENGINE, origins=engine_provenance("diesel_i6"), modes=modes, torsion=torsion, damped=damped,
        run_up=resonance((TORSION, AXIAL)), damped_run_up=None,
        pictures={"stresses.png": folder / "stresses.png"}, seconds={"stage": 1.25},
    )  # fmt: skip


class Reader(HTMLParser):
    """Tags that close, tables as rows of texts by their titles, and what figures say of themselves."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tables, self.sources, self.said, self.rows = [], {}, [], [], None
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.sources += [found[key] for key in ("src", "href") if key in found]
        if tag not in EMPTY_TAGS:
            self.open.append(tag)
        if tag == "table":
            self.rows = self.tables.setdefault(found["aria-label"], [])
        elif tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")
        elif tag in ("svg", "img"):
            self.said.append(found.get("alt") or found.get("aria-label"))

    def handle_endtag(self, tag):
        if tag not in EMPTY_TAGS:
            assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data


def charts(text):
    figures = re.findall(r'<svg [^>]*aria-label="([^"]*)">.*?<script type="application/json">(.*?)</script>', text)
    return {title: json.loads(data) for title, data in figures}


def test_the_page_is_whole_and_asks_nobody(found):
    text = page(found)
    read = Reader(text)
    assert read.open == []
    assert not re.search(r"https?://", text)
    assert all(source.startswith(("#", "data:image/png;base64,")) for source in read.sources)
    assert len(read.said) >= 6 and all(read.said)  # torsion, damper, cycles, run-up, axial, stress


def test_tables_hold_the_numbers_of_their_sources(found):
    tables = Reader(page(found)).tables
    header, *rows = tables["Critical speeds of the first torsional mode at rest"]
    published = ENGINE.published
    assert [float(row[0]) for row in rows] == list(published.critical_orders)
    for row, order, speed, measured in zip(
        rows, published.critical_orders, published.critical_speeds, published.measured_critical_speeds, strict=True
    ):
        assert float(row[header.index("rev/min")]) == round(60.0 * 238.4 / order)
        assert float(row[header.index("published")]) == round(speed * 30.0 / math.pi)
        assert float(row[header.index("measured")]) == round(measured * 30.0 / math.pi)
    everything = tables["All values of diesel_i6"][1:]
    assert [row[0] for row in everything] == [key for key, *_ in engine_provenance("diesel_i6")]
    fitted = tables["Calibrated values and the numbers they were fitted to"][1:]
    assert {row[0] for row in fitted} == {row[0] for row in everything if row[3] == "calibrated"}


def test_in_a_block_modes_are_called_by_the_crank_and_stand_beside_the_published_ones():
    """Of the V8: 383 Hz is mostly the block's, of the crank's shares the axial one is the largest."""
    shares = {252.0: (52, 0, 34, 14), 296.0: (39, 53, 2, 6), 312.0: (49, 39, 1, 11), 383.1: (28, 0, 33, 38)}
    shares |= {402.9: (34, 0, 57, 9), 437.6: (15, 0, 4, 81)}
    modes = [
        {"hz": hz, "shape": "block", "shares": dict(zip((*KINDS, "block"), np.array(own) / 100.0, strict=True))}
        for hz, own in shares.items()
    ]
    rows = housed_table(load_engine("diesel_v8"), {"modes": modes, "first_torsional_hz": 296.0}).rows
    assert [(row[0], row[1], row[5]) for row in rows] == [
        ("252.0", "bending", "252"), ("296.0", "torsional", "296"), ("312.0", "bending", "312"),
        ("383.1", "axial", "383"), ("402.9", "axial", NOTHING),
    ]  # fmt: skip


def test_curves_hold_the_numbers_of_the_run_up(found):
    data = charts(page(found))["Torsion of the pulley, orders over the speed, without damper"]
    run = found.torsion.run_up
    np.testing.assert_allclose(data["x"], run.speeds_rpm, rtol=1e-5)
    np.testing.assert_allclose(data["y"]["order 6"], np.degrees(np.abs(run.order(6.0))), rtol=1e-3)
    axial = charts(page(found))["Axial motion of the pulley, orders over the speed, run-up"]
    np.testing.assert_allclose(axial["y"]["order 9"], 1e6 * np.abs(found.run_up.order(9.0, AXIAL)), rtol=1e-3)


def test_measured_orders_lie_on_the_charts_and_stand_beside_the_computed_ones(found):
    """At twice the computed amplitude the computed one is 50 % below; a point beyond the run-up has none beside it."""
    run = found.torsion.run_up
    speeds, sizes = run.speeds[[10, 60]], 2.0 * np.abs(run.order(6.0))[[10, 60]]
    beyond = np.array([run.speeds[-1] * 1.1])
    measured = {TORSION: {6.0: (speeds, sizes), 9.0: (beyond, np.array([1e-3])), 4.0: (speeds, sizes)}}
    text = page(Findings(**{**vars(found), "measured": measured}))
    for words in ("without damper", "with damper", "run-up"):
        chart = text.split(f"Torsion of the pulley, orders over the speed, {words}", 1)[1].split("</figure>")[0]
        assert chart.count("<circle") == chart.count("order 6, measured") == 2 and ">measured<" in chart
    _, *rows = Reader(text).tables["Torsion of the pulley, measured and computed"][:3]
    k = int(sizes.argmax())
    assert [row[0] for row in rows] == ["6", "9"]  # the run-up has no order 4
    assert rows[0][1] == f"{speeds[k] * 30.0 / math.pi:.0f}" and rows[0][-1] == "-50 %"
    assert rows[0][2] == f"{math.degrees(sizes[k]):.3g}" and rows[0][3] == f"{math.degrees(sizes[k] / 2):.3g}"
    assert rows[1][-2:] == [NOTHING, NOTHING]
    assert "measured" not in Reader(page(found)).tables and "<circle" not in page(found)


def test_measured_orders_that_are_none_are_refused_before_the_work(tmp_path, capsys):
    path = tmp_path / "orders.csv"
    path.write_text("speed_rpm,order,amplitude,unit\n2380,6.2,0.21,deg\n")
    command = ["report", "diesel_i6", "--measured", str(path), "--output", str(tmp_path / "report.html")]
    assert main(command) == 2
    assert "orders.csv, line 2: order 6.2 is not a multiple of 0.5" in capsys.readouterr().err
    assert not (tmp_path / "report.html").exists()


def test_the_damper_takes_off_what_both_run_ups_differ_by(found):
    rows = Reader(page(found)).tables["Largest amplitude over the speed range, without and with the damper"]
    before, after = (np.degrees(np.abs(part.run_up.order(6.0)).max()) for part in (found.torsion, found.damped))
    row = next(row for row in rows if row[0] == "6")
    assert row[1:3] == [f"{before:.3g}", f"{after:.3g}"]
    assert row[3] == f"{100.0 * (after / before - 1.0):+.0f} %"


def test_a_cycle_from_its_orders_has_these_orders():
    run, angle = resonance(), np.arange(288) * 4.0 * math.pi / 288
    orders, amplitudes = order_amplitudes(cycle(run, TORSION, 70, angle), 9.0)
    own = [np.flatnonzero(orders == order)[0] for order in run.orders]
    np.testing.assert_allclose(amplitudes[own], run.amplitudes[TORSION][70], rtol=1e-10)
    assert np.abs(np.delete(amplitudes, own)).max() < 1e-12


def test_what_is_missing_says_which_command_makes_it(found):
    poor = Findings(**{**vars(found), "run_up": None, "pictures": {}, "damped": None})
    lacking, text = missing(poor), page(poor)
    assert {"Axial vibration of the pulley", "Stress of the crankshaft", "With the torsional damper"} <= set(lacking)
    assert all(command for command in lacking.values())
    assert text.count('class="missing"') == len(lacking)
    assert "cranktrain stress diesel_i6 --speed 2400" in text
    assert set(missing(found)) == set(lacking) - {
        "Axial vibration of the pulley", "Stress of the crankshaft", "With the torsional damper",
        "Torsional vibration with films",
    }  # fmt: skip


def test_numbers_along_axes_are_round_and_within():
    for low, high in ((1000.0, 2800.0), (-0.013, 1.17), (0.0, 3.3e-4)):
        ticks = Axis("", low, high).ticks()
        assert 4 <= len(ticks) <= 8 and low <= ticks[0] and ticks[-1] <= high * (1.0 + 1e-9)
        assert np.ptp(np.diff(ticks)) < 1e-9 * high
    assert Axis("", 0.0, 720.0, 120.0).ticks() == [120.0 * k for k in range(7)]


def test_gaps_split_a_curve():
    y = np.array([0.0, 1.0, np.nan, 1.0, 2.0])
    text = line_chart("A < B", np.arange(5.0), {"one & two": y}, ("x", "y"))
    assert text.count("<polyline") == 2 and "A &lt; B" in text and "one &amp; two" in text
    assert charts(text)["A &lt; B"]["y"]["one & two"][2] is None


def test_files_of_other_engines_and_missing_folders_are_refused(tmp_path):
    path = tmp_path / "run_up.h5"
    resonance(engine="diesel_v8").save(path)
    with pytest.raises(InputError, match="'diesel_v8', not of 'diesel_i6'"):
        source.findings("diesel_i6", path)
    with pytest.raises(InputError, match="is not a folder"):
        source.findings("diesel_i6", None, [tmp_path / "none"])


def test_the_verb_writes_its_own_files_only(found, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(source, "findings", lambda *_: found)
    path = tmp_path / "report.html"
    for _ in range(2):  # the second replaces the first
        assert main(["report", "diesel_i6", "--output", str(path), "--json"]) == 0
    said = json.loads(capsys.readouterr().out.split("}\n{")[0] + "}")
    assert said["missing"] == missing(found) and path.read_text("utf-8") == page(found)
    path.write_text("<html>a page of someone")
    assert main(["report", "diesel_i6", "--output", str(path)]) == 2
    assert "is no report of cranktrain" in capsys.readouterr().err


def test_sections_have_titles_of_their_own_and_a_way_to_be_made():
    assert len({section.title for section in SECTIONS}) == len(SECTIONS)
    nothing = SimpleNamespace(run_up=None, damped_run_up=None, damped=None, pictures={})
    for section in SECTIONS:
        if section.commands:
            assert section.make(nothing) == []


@needs_browser
@pytest.mark.parametrize("width", [500, 1200])
def test_a_browser_shows_it_without_a_word_on_the_console(found, tmp_path, width):
    path = tmp_path / "report.html"
    # the page itself says how far it reaches beyond the window
    probe = "<script>document.title = document.documentElement.scrollWidth - innerWidth;</script></body>"
    path.write_text(page(found).replace("</body>", probe), encoding="utf-8")
    document, console, picture = shown(path, width)
    assert console == [] and len(picture) > 10_000
    assert int(re.search(r"<title>(-?\d+)</title>", document)[1]) <= 0


def test_the_verb_makes_what_is_missing_once_and_goes_on_without_what_fails(found, tmp_path, monkeypatch, capsys):
    ran = []

    def run(words, **_):
        ran.append(words[3:])
        if "stress" in words:
            (tmp_path / "made" / "stresses.png").write_bytes(png())
        return SimpleNamespace(returncode=2 if "fatigue" in words else 0)

    poor = Findings(**{**vars(found), "pictures": {}})
    monkeypatch.setattr(source, "findings", lambda *_: poor)
    monkeypatch.setattr("cranktrain.cli.report.subprocess.run", run)
    monkeypatch.setattr("cranktrain.cli.report.FOLDERS", ())
    path, folder = tmp_path / "report.html", str(tmp_path / "made")
    assert main(["report", "diesel_i6", "--make", folder, "--output", str(path), "--json"]) == 0
    said = capsys.readouterr()
    commands = [" ".join(words) for words in ran]
    assert len(set(commands)) == len(commands) and sum("runup" in one.split() for one in commands) == 2
    assert "ended with code 2" in said.err and "cranktrain fatigue" in said.err
    missing_now = json.loads(said.out)["missing"]
    assert "Fatigue of the crankshaft" in missing_now and "Stress of the crankshaft" not in missing_now
