"""The report: tables and curves equal their sources, the page is whole, reads anywhere and asks nobody."""

import base64
import io
import itertools
import json
import math
import re
import shlex
from dataclasses import replace
from hashlib import sha256
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from browser import needs_browser, shown
from matplotlib.image import imread, imsave

from cranktrain.cli.functions import verb_of
from cranktrain.cli.main import _parser, main
from cranktrain.cli.parser import question
from cranktrain.cli.report import _asked, report
from cranktrain.core.errors import InputError, SolverError
from cranktrain.engine.file import engine_path, engine_provenance, load_engine
from cranktrain.engine.limits import Limits
from cranktrain.engine.parts import MeanLoad
from cranktrain.film.laws.register import bearing_law
from cranktrain.loads.cylinder_volume import mean_effective_pressure
from cranktrain.results.orders.harmonics import order_amplitudes
from cranktrain.results.orders.resonances import peaks
from cranktrain.results.run_up import run_up as over_speed
from cranktrain.results.run_up.run_up import AXIAL, FLYWHEEL, TORSION, RunUp
from cranktrain.results.tables import NOTHING, housed_table
from cranktrain.structure.crank.modal import KINDS
from cranktrain.studies.in_motion.report import states_text
from cranktrain.studies.report import findings as source
from cranktrain.studies.report.chart import DECADES, MAP_COLOURS, Axis, Switches, line_chart, map_chart
from cranktrain.studies.report.findings import Asked, Findings, Torsion
from cranktrain.studies.report.front import layout_text
from cranktrain.studies.report.page import missing, page
from cranktrain.studies.report.sections import SECTIONS, peak_memory
from cranktrain.studies.report.verdict import Verdict, verdict_text, verdicts
from cranktrain.studies.report.vibration import cycle, torsion

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
    imsave(folder / "stresses.png", np.zeros((1, 1, 3)))
    torsion, damped = (Torsion(run, peaks(run)) for run in (resonance(), resonance(zeta=0.3)))
    return Findings(
        asked=Asked("diesel_i6"), engine=ENGINE, origins=engine_provenance("diesel_i6"), modes=modes, torsion=torsion,
        damped=damped, run_up=resonance((TORSION, AXIAL)), damped_run_up=None,
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
    before, after = (np.degrees(np.abs(part.run_up.order(6.0)).max()) for part in (found.torsion, found.damped))
    rows = tables["Largest amplitude over the speed range, without and with the damper"]
    own = [f"{before:.3g}", f"{after:.3g}", f"{100.0 * (after / before - 1.0):+.0f} %"]
    assert next(row for row in rows if row[0] == "6")[1:4] == own
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
        # both points on the linear and on the logarithmic drawing
        assert chart.count("<circle") == chart.count("order 6, measured") == 4 and ">measured<" in chart
    _, *rows = Reader(text).tables["Torsion of the pulley, measured and computed"][:3]
    k = int(sizes.argmax())
    assert [row[0] for row in rows] == ["6", "9"]  # the run-up has no order 4
    assert rows[0][1] == f"{speeds[k] * 30.0 / math.pi:.0f}" and rows[0][-1] == "-50 %"
    assert rows[0][2] == f"{math.degrees(sizes[k]):.3g}" and rows[0][3] == f"{math.degrees(sizes[k] / 2):.3g}"
    assert rows[1][-2:] == [NOTHING, NOTHING]
    assert "measured" not in Reader(page(found)).tables and "<circle" not in page(found)


@pytest.mark.parametrize(
    ("name", "content", "options", "says"),
    [
        ("orders.csv", "speed_rpm,order,amplitude,unit\n2380,6.2,0.21,deg\n", ("--measured", "orders.csv"),
         "orders.csv, line 2: order 6.2 is not a multiple of 0.5"),
        ("diesel_i6_fatigue.json", '{"fillets": 3}', ("--results", "."), "is no result of 'cranktrain fatigue"),
        ("report.html", "<html>a page of someone", (), "is no report of cranktrain"),
    ],
)  # fmt: skip
def test_what_cannot_be_reported_is_refused_before_the_work(
    tmp_path, monkeypatch, capsys, name, content, options, says
):
    monkeypatch.chdir(tmp_path)
    Path(name).write_text(content)
    assert main(["report", "diesel_i6", *options, "--output", "report.html"]) == 2
    assert says in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == [name] and Path(name).read_text() == content


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
        source.findings(Asked("diesel_i6", path))
    with pytest.raises(InputError, match="is not a folder"):
        source.findings(Asked("diesel_i6", None, [tmp_path / "none"]))


def test_the_verb_writes_its_own_files_only(found, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(source, "steps", lambda *_: iter([found]))
    monkeypatch.setattr("cranktrain.cli.report.FOLDERS", ())
    path = tmp_path / "report.html"
    for _ in range(2):  # the second replaces the first
        assert main(["report", "diesel_i6", "--output", str(path), "--json"]) == 0
    said = json.loads(capsys.readouterr().out.split("}\n{")[0] + "}")
    assert said["missing"] == missing(found) and path.read_text("utf-8") == page(found)


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
            imsave(tmp_path / "made" / "stresses.png", np.zeros((1, 1, 3)))
        return SimpleNamespace(returncode=2 if "fatigue" in words else 0)

    poor = Findings(**{**vars(found), "pictures": {}})
    monkeypatch.setattr(source, "steps", lambda asked, *_: iter([replace(poor, asked=asked)]))
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


def test_an_interrupted_report_has_what_was_made_and_says_what_it_lacks(found, tmp_path, monkeypatch, capsys):
    def steps(asked, *_):
        part = replace(found, asked=asked, running=True, torsion=None, damped=None)
        yield replace(part, modes=None)
        yield part
        raise KeyboardInterrupt

    monkeypatch.setattr(source, "steps", steps)
    path = tmp_path / "report.html"
    assert main(["report", "diesel_i6", "--output", str(path)]) == 130
    said, text = capsys.readouterr().err, path.read_text("utf-8")
    assert "interrupted" in said and "without: Torsional vibration over the speed range" in said
    assert "Crankshaft, free" in text or "Critical speeds of the first torsional mode" in text  # the second step
    note = re.search(r'id="incomplete">(.*?)</p>', text)[1]
    assert "Torsional vibration over the speed range" in note and "Natural frequencies" not in note
    assert f"cranktrain report diesel_i6 --output {path}" in note
    assert 'id="incomplete"' not in page(found)


def test_remedies_can_be_pasted_with_the_path_as_it_was_given(found):
    """A shell reads every command as the program does; paths with blanks and quotes stay one word."""
    name, folder = "my engines/it's one.toml", "made of it"
    running = ("--pressure", "traces of it.csv", "--load", "0.5")
    asked = Asked(name, None, [folder], running=running, again=("--results", folder, "--quick"))
    poor = replace(found, asked=asked, run_up=None, pictures={}, damped=None)
    commands = [one for text in missing(poor).values() for one in text.split(" && ") if one.startswith("cranktrain ")]
    assert len(commands) > 10
    for command in commands:
        _, verb, *words = shlex.split(command)
        options = _parser(verb).parse_args([verb, *words])
        assert options.engine == name
        if verb in ("runup", "simulate", "stress", "fatigue", "report"):
            assert (options.pressure, options.load) == ("traces of it.csv", 0.5)
        if verb not in ("report", "bearing-loads", "plot"):
            assert options.output.startswith(f"{folder}/diesel_i6_")
    bare = replace(ENGINE, damper=None, crank_strength=None, big_end_bearing=None)
    lacking = missing(replace(poor, engine=bare))
    assert lacking["With the torsional damper"] == "add [damper] to the engine file"
    assert lacking["Fatigue of the crankshaft"] == "add [crank_strength] to the engine file"
    assert not any("--damper" in text or "--with-damper" in text or "--big-ends" in text for text in lacking.values())
    text = page(replace(poor, engine=bare))
    assert "Not in this report: the engine file has no [crank_strength]." in text
    rows = dict(Reader(text).tables["The engine"][1:])
    assert rows["big ends"] == "without films, no [big_end_bearing] in the engine file"
    assert rows["torsional damper"] == "no [damper] in the engine file"


def test_the_first_page_states_the_engine(found):
    """P = p V n/2 of a four-stroke; the mean effective pressure is linear in the load."""
    rows = dict(Reader(page(found)).tables["The engine"][1:])
    assert rows["layout"] == "4-stroke, 6 cylinders, in line" and rows["firing"].startswith("Fires 1-5-3-6-2-4, every")
    trace, rated = found.trace(ENGINE.best_speed), ENGINE.rated_speed
    share = 1.0 - trace.falloff * (rated / ENGINE.best_speed - 1.0) ** 2
    work = [mean_effective_pressure(ENGINE, pressure) for pressure in (trace.motored, trace.fired)]
    power = (work[0] + share * (work[1] - work[0])) * ENGINE.displacement * rated / (2.0 * math.pi) / 2.0
    assert float(rows["indicated power at rated speed"].split()[0]) == pytest.approx(1e-3 * power, rel=1e-3)
    assert float(rows["peak pressure, absolute"].split()[0]) == pytest.approx(1e-5 * trace.peak, rel=1e-3)
    none, half, whole = (source.at_load(ENGINE, None, rated, load).imep for load in (0.0, 0.5, 1.0))
    assert half == pytest.approx(0.5 * (none + whole), rel=1e-9) and none < 0.0 < half
    made = dict(Reader(page(next(source.steps(Asked("diesel_i6"))))).tables["This report"][1:])
    assert made["digest of the file, SHA-256"] == sha256(engine_path("diesel_i6").read_bytes()).hexdigest()
    assert made["command"] == "cranktrain report diesel_i6"
    boxer = replace(ENGINE, cylinders=replace(ENGINE.cylinders, bank_angles=(0.0, math.pi) * 3))
    assert layout_text(boxer) == "4-stroke, 6 cylinders, opposed"


def judged(found, **limits):
    return {one.key: one for one in verdicts(replace(found, engine=replace(ENGINE, limits=Limits(**limits))))}


def test_each_limit_is_judged_by_what_was_found(found):
    """One order of amplitude a swings from −a to a; the mean piston speed is twice stroke times revolutions."""
    top = ENGINE.speeds[1]
    one_order = replace(found.damped.run_up, amplitudes={
        name: np.where(found.damped.run_up.orders == 6.0, share * found.damped.run_up.torsion, 0.0)
        for name, share in ((TORSION, 1.0), (FLYWHEEL, -0.5))
    })  # fmt: skip
    made = replace(found, damped=Torsion(one_order, []))
    own = one_order.speeds <= 1.001 * top
    largest = np.abs(one_order.order(6.0))[own].max()
    piston = 2.0 * (2.0 * ENGINE.crankshaft.throw) * top / (2.0 * math.pi)
    free = judged(made)
    assert free["limits.pulley_torsion"].value == pytest.approx(math.degrees(largest), rel=1e-4)
    assert free["limits.twist"].value == pytest.approx(1.5 * math.degrees(largest), rel=1e-4)
    assert free["limits.piston_speed"].value == pytest.approx(piston)
    assert {free[f"limits.{key}"].said for key in ("pulley_torsion", "twist", "piston_speed", "peak_pressure")} == {
        "no limit stated"
    }
    held = judged(made, pulley_torsion=1.01 * largest, twist=1.49 * largest, piston_speed=1.01 * piston)
    said = {key: one.said for key, one in held.items() if key.startswith("limits.")}
    assert said == {
        "limits.pulley_torsion": "passed", "limits.twist": "not passed", "limits.piston_speed": "passed",
        "limits.peak_pressure": "no limit stated",
    }  # fmt: skip
    assert held["damper.power_limit"].said == held["crank_strength"].said == "not computed"
    assert held["bearing_limits.main_film"].said == "not computed"
    assert "not passed: twist from pulley to flywheel" in verdict_text(list(held.values()))


def test_limits_without_a_computed_value_are_not_judged_rather_than_not_passed():
    """Ten stated limits: the counts of passed, broken and open ones add up to ten, and "0 of 10" is never said."""
    limits = [Verdict(f"quantity {k}", "1", None, 1.0, "section", f"limits.{k}") for k in range(10)]
    assert verdict_text(limits) == "10 of 10 stated limits are not judged, because their value is not computed."
    some = [one._replace(value=value) for one, value in zip(limits, (0.5, 0.9, 2.0), strict=False)] + limits[3:]
    text = verdict_text(some)
    assert text.startswith("2 of 3 judged limits are passed; not passed: quantity 2; 7 of 10 stated limits are not")


def test_one_mode_at_rest_and_in_motion_is_named_with_both_frequencies():
    motion = {"first_torsional_hz": 412.0, "state": {"rpm": 2000.0}}
    modes = {"cranktrain": {"first_torsional_hz": 428.0}, "in_motion": motion}
    said = "428 Hz at rest and 412 Hz in motion at 2000 rev/min are one mode on two supports"
    assert said in states_text(modes)
    housed = {**modes, "block": {"first_torsional_hz": 420.4}}
    assert "420 Hz at rest in the flexible block and 412 Hz" in states_text(housed)
    assert "listed twice" not in states_text({"cranktrain": {"first_torsional_hz": 428.0}})


def test_the_mode_of_the_torsional_crank_is_told_apart_from_that_of_the_solid_crank_at_rest(found):
    """The section's "at rest" is the torsional crank's, and its table and sentence have the same number."""
    peaks_of = [replace(peak, kind="torsional", mode_hz=236.6) for peak in found.torsion.peaks]
    made = replace(found, torsion=Torsion(found.torsion.run_up, peaks_of))
    told = torsion(made)[0]
    assert "at 236.6 Hz, that of the solid crank at rest at 238.4 Hz, because this crank is fitted" in told
    formula = ENGINE.with_({"reduction.torsional_source": "carter"})
    assert "because its shafts have the stiffness of a formula, carter." in torsion(replace(made, engine=formula))[0]
    assert "mode of this crank" not in torsion(replace(made, modes=None))[0]


def test_heat_of_the_damper_and_fatigue_are_judged(found):
    damper, heat = ENGINE.damper, np.zeros((found.run_up.speeds.size, 3))
    heat[40] = 0.0, 1.2 * damper.power_limit * damper.cooling_area, 1e9
    run_up = replace(found.run_up, extremes={"damper.heat": heat})
    place = {"name": "web[1].pin", "speed_rpm": 2400.0}
    rule = {"places": [{**place, "acceptability": 1.2}], "required": 1.15, "outside": []}
    fatigue = {"fillets": [{**place, "safety_factor": 0.9}, {**place, "safety_factor": None}], "rule": rule}
    all_of = verdicts(replace(found, damped_run_up=run_up, fatigue=fatigue))
    hot = next(one for one in all_of if one.key == "damper.power_limit")
    assert hot.said == "not passed" and hot.value == pytest.approx(1.2 * hot.limit)
    assert hot.where == f"at {run_up.speeds_rpm[40]:.0f} rev/min"
    factor, accepted = (one for one in all_of if one.key == "crank_strength")
    assert (factor.said, accepted.said) == ("not passed", "passed") and "web[1].pin" in factor.where


def test_a_logarithmic_drawing_has_equal_steps_for_equal_ratios():
    """Curves 1, 10 and 100 lie a decade apart, as the numbers do; peak to peak is twice zero to peak at each place."""
    x = np.arange(3.0)
    curves = {f"{size:g}": np.full(3, size) for size in (100.0, 10.0, 1.0)}
    text = line_chart("decades", x, curves, ("x", "zero to peak / deg"), switches=Switches(log=True))
    assert 'class="to-log" checked' in text and 'class="to-pp" checked' not in text
    steps = {}
    for kind in ("linear", "log"):
        svg = re.search(rf'<svg class="{kind}".*?</svg>', text)[0]
        heights = dict(re.findall(r'<polyline data-k="(\d)" points="[^ ,]*,([^ ]*)', svg))
        steps[kind] = np.diff([float(heights[k]) for k in "012"])
    assert steps["log"] == pytest.approx(steps["log"][0], abs=0.2) and steps["log"][0] > 50
    assert steps["linear"][1] == pytest.approx(0.1 * steps["linear"][0], abs=0.2)
    numbers = re.findall(r'<text class="(zp|pp)"[^>]*y="([0-9.]+)" text-anchor="end">([^<]*)<', svg)
    zero, peak = ([(y, float(n)) for kind, y, n in numbers if kind == own] for own in ("zp", "pp"))
    assert [(y, 2.0 * n) for y, n in zero] == peak and len(zero) >= 3
    assert "switches" not in line_chart("plain", x, {"a": x}, ("x", "y"))


def test_a_map_has_the_colour_of_each_value():
    """The largest value has the last colour, values below the range the first, missing ones are white."""
    values = np.array([[1.0, 1e-9], [math.nan, 10.0**-DECADES]])
    text = map_chart("map", np.array([1.0, 2.0]), np.array([0.5, 1.0]), values, ("x", "y", "deg"))
    rows = imread(io.BytesIO(base64.b64decode(re.search(r"base64,([^\"]*)", text)[1])))[::-1] * 255
    assert tuple(rows[0, 0]) == MAP_COLOURS[-1] and tuple(rows[0, 1]) == tuple(rows[1, 1]) == MAP_COLOURS[0]
    assert tuple(rows[1, 0]) == (255, 255, 255)


def test_the_twist_is_pulley_against_flywheel_and_maps_follow_its_orders():
    """One order of amplitude a swings by 2a; the map of frequencies has it along f = order times speed."""
    run = resonance()
    flywheel = np.where(run.orders == 6.0, -0.5 * run.torsion, run.torsion)
    both = over_speed.with_twist(replace(run, amplitudes={TORSION: run.torsion, FLYWHEEL: flywheel}))
    np.testing.assert_allclose(
        over_speed.half_range(both, both.amplitudes[over_speed.TWIST]), 1.5 * np.abs(run.order(6.0)), rtol=1e-4
    )
    assert over_speed.TWIST not in over_speed.with_twist(run).amplitudes
    speeds = run.speeds[10:60:7]
    hz = np.array([6.0 * speeds[3] / (2.0 * math.pi)])
    found = over_speed.frequency_map(both, over_speed.TWIST, speeds, hz)
    assert found[0, 3] == pytest.approx(1.5 * abs(run.order(6.0)[31]))
    above = over_speed.frequency_map(both, over_speed.TWIST, speeds, np.array([10.0 * speeds[-1] / (2.0 * math.pi)]))
    assert np.isnan(above).all()
    np.testing.assert_allclose(
        over_speed.order_map(both, over_speed.TWIST, speeds)[1], 1.5 * np.abs(run.order(6.0))[10:60:7]
    )


def test_a_balance_that_does_not_settle_gives_a_linear_run_up_and_says_so(monkeypatch):
    asked_for, told = [], []

    def run_up(engine, body, settings, speeds, orders, rule, gas):
        asked_for.append(rule)
        if rule == "harmonic-balance":
            raise SolverError("the orders do not settle at 78 rev/min")
        return resonance()

    monkeypatch.setattr(source, "assemble", lambda engine, settings, **_: SimpleNamespace(
        engine=engine, body=None, settings=settings))  # fmt: skip
    monkeypatch.setattr(source, "frequency_run_up", run_up)
    monkeypatch.setattr(source, "torsional_peaks", lambda *_: [])
    source._torsion(ENGINE, False, Asked("diesel_i6"), told.append, None)
    assert asked_for == ["harmonic-balance", "linear"] and "the orders do not settle at 78 rev/min" in told[-1]


def test_commands_of_an_engine_with_a_load_of_its_own_name_the_reports_load():
    """The verbs would balance its mean torque otherwise, and run with another burn than the report."""
    generator = replace(ENGINE, load=MeanLoad(kind="power", speed=ENGINE.rated_speed, power=1e5))
    for engine, given, running in (
        (ENGINE, [], ()),
        (generator, [], ("--load", "1")),
        (generator, ["--load", "0.5"], ("--load", "0.5")),
    ):
        options = _parser("report").parse_args(["report", "diesel_i6", *given])
        asked = _asked("diesel_i6", question(verb_of(report), options), engine)
        assert asked.running == running and asked.load == (0.5 if given else 1.0)


def test_the_error_of_the_grid_stands_with_elastic_films_alone(found, tmp_path):
    section = next(one for one in SECTIONS if one.title == "Bearings over the speed")
    shown = tmp_path / "bearings_over_speed.png"
    shown.write_bytes(b"PNG")
    for level, block in itertools.product(("impedance", "ehd", "ehd:fine"), ("ground", "flexible")):
        run_up = replace(found.run_up, attributes={**found.run_up.attributes, "bearings": level, "block": block})
        said = " ".join(section.make(replace(found, run_up=run_up, pictures={shown.name: shown})))
        errors = bearing_law(level).film_errors.get(block, ())
        assert (f"Grid of level {level}" in said) == bool(errors) == level.startswith("ehd")
        assert all(f"within {100.0 * error:.0f} %" in said for error in errors)


def test_memory_of_a_report_is_the_largest_resident_set_that_the_system_tells():
    status = Path("/proc/self/status")
    if not status.exists():
        assert peak_memory() is None or peak_memory() > 0.0
        return
    words = dict(line.split(":", 1) for line in status.read_text("utf-8").splitlines())
    assert peak_memory() == pytest.approx(1024 * int(words["VmHWM"].split()[0]), rel=0.05)


def test_charts_show_the_orders_that_are_asked_for_and_methods_are_links(found, tmp_path, monkeypatch):
    text = page(replace(found, asked=Asked("diesel_i6", orders=(9.0,), peak_to_peak=True)))
    assert list(charts(text)["Torsion of the pulley, orders over the speed, without damper"]["y"]) == ["order 9"]
    assert 'class="to-pp" checked' in text
    folder = tmp_path / "out" / "tradeoff"
    folder.mkdir(parents=True)
    (folder / "tradeoff.html").write_text("<html>")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(source, "steps", lambda *_: iter([found]))
    assert main(["report", "diesel_i6", "--output", "pages/report.html"]) == 0
    assert '<a href="../out/tradeoff/tradeoff.html">' in Path("pages/report.html").read_text("utf-8")
