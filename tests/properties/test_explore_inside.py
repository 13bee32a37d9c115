"""Look inside on the page of ``cranktrain explore``: what is shown at a crank angle is what the run recorded there."""

import asyncio
import math
from dataclasses import replace

import numpy as np
import pytest
from browser import needs_browser
from explored import TORSIONAL, differing, drawn, in_a_loop, visited
from one_line import one_line
from some import some

import cranktrain as ct
from cranktrain.core.errors import StoreError
from cranktrain.engine.file import load_engine
from cranktrain.results.bearings.cycle import rod_lean
from cranktrain.store.hdf5 import write_result

pytest.importorskip("panel")

from cranktrain_lab.explore.inside.charts import JOURNAL, cell_columns, single_line
from cranktrain_lab.explore.inside.crank_surface import PRINCIPAL, STRESSES, VON_MISES, CrankSurface, coarser
from cranktrain_lab.explore.inside.cycle import FRAME_DEG, InsideCycle
from cranktrain_lab.explore.inside.recording import LookInside
from cranktrain_lab.explore.inside.view import InsideView

SPEED = 3000.0 * math.pi / 30.0
ANGLE = 380
"""Crank angle at which the single's film carries the gas force, deg."""


def recorded(name="single_petrol", crank="torsional", bearings="auto", big_ends="rigid", settle=1e-2):
    engine = load_engine(name)
    look = LookInside(engine, crank, bearings, big_ends, 1.0, SPEED, settle)
    look.check()
    return (engine, *look.record(lambda stage: None, lambda stage, share: None))


@pytest.fixture(scope="module")
def single():
    """Engine, cycle to look into, recorded cycle and stresses of the solid single on elastic films."""
    return recorded(crank="solid", bearings="ehd", big_ends="ehd")


@pytest.fixture(scope="module")
def online():
    """The torsional single on films that are solved online in a rigid bore."""
    return recorded(bearings="reynolds")


def at(cycle, name):
    """A recorded output at ANGLE, by the sample that is nearest to it."""
    apart = np.abs(np.angle(np.exp(0.5j * (cycle.crank_angle - math.radians(ANGLE)))))
    return cycle.outputs[name][apart.argmin()]


def vector(cycle, name):
    return at(cycle, f"{name}.x") + 1j * at(cycle, f"{name}.y")


def point(chart):
    return chart.point.data["x"][0] + 1j * chart.point.data["y"][0]


def force_of(columns, radius):
    """Force of the pressure in rectangles (deg, mm, MPa) on the journal, in axes of the shell, N."""
    left, right = (np.radians(columns[name]) for name in ("left", "right"))
    across = 1e-3 * (columns["top"] - columns["bottom"])
    normal = 1j * (np.exp(1j * right) - np.exp(1j * left))
    return (1e6 * columns["p"] * across * radius * normal).sum()


def test_the_slider_moves_all_charts_to_what_the_run_recorded(single):
    engine, cycle, run, _ = single
    view = InsideView(cycle)
    bearing, before = engine.main_bearing, {}
    for name in ("main[1]", "main[2]", "big_end[1]"):
        view.player.value, view.bearing.value = 0, name
        before = {chart: dict(chart.point.data) for chart in (view.orbit, view.polar)}
        values, cells = view.crank.view.values.copy(), view.film.cells.data["p"].copy()
        view.player.value = ANGLE
        output = name.replace("main", "bearing")
        own = engine.big_end_bearing if name.startswith("big") else bearing
        assert point(view.orbit) == pytest.approx(vector(run, f"{output}.position") / own.clearance, rel=1e-6)
        lean = rod_lean(engine, 0, at(run, "crank.angle"))[0] if name.startswith("big") else 0.0
        load = -1e-3 * vector(run, f"{output}.force") * np.exp(-1j * lean)
        assert point(view.polar) == pytest.approx(load, rel=1e-5)
        assert all(chart.point.data != before[chart] for chart in before)
        assert not np.array_equal(values, view.crank.view.values)
        assert not np.array_equal(cells, view.film.cells.data["p"])
        # Even over each cell: the rule of midpoints on 24 nodes around, against the film's own quadrature.
        found = force_of(view.film.cells.data, 0.5 * own.diameter)
        assert abs(found + 1e3 * load) < 0.02 * np.abs(view.look.shell).max()
    # Load in the crank's axes, which turn with it; deformation by the modes, and its enlargement.
    view.bearing.value, view.side.value = "main[1]", JOURNAL
    wanted = 1e-3 * vector(run, "bearing[1].force") * np.exp(-1j * at(run, "crank.angle"))
    assert point(view.polar) == pytest.approx(wanted, rel=1e-5)
    weights = cycle.surface.enlargement * cycle.surface.coordinates[ANGLE // FRAME_DEG]
    assert np.array(view.crank.view.weights) == pytest.approx(weights)
    view.enlargement.value = 2.0 * cycle.surface.enlargement
    assert np.array(view.crank.view.weights) == pytest.approx(2.0 * weights)


@pytest.mark.parametrize("degrees", [0, ANGLE, 715])
def test_greatest_colour_is_the_greatest_stress_of_the_crank(single, degrees):
    _, cycle, _, stress = single
    view = InsideView(cycle)
    scale = {}
    sample = np.array([stress.nearest(math.radians(degrees))])
    tensor = stress.tensors(sample)[0].astype(float)
    matrices = tensor[[0, 3, 5, 3, 1, 4, 5, 4, 2]].T.reshape(-1, 3, 3)
    principal = np.linalg.eigvalsh(matrices)
    signed = np.where(principal[:, 2] > -principal[:, 0], principal[:, 2], principal[:, 0])
    for name, wanted in ((VON_MISES, stress.von_mises(sample)[0]), (PRINCIPAL, signed)):
        view.stress.value = name
        scale = view.crank.view.low, view.crank.view.high
        view.player.value = degrees
        assert (view.crank.view.low, view.crank.view.high) == scale, "the scale is that of the whole cycle"
        found = view.crank.view.values
        for extreme in (np.min, np.max):
            assert extreme(found) == pytest.approx(1e-6 * extreme(wanted), rel=1e-5, abs=1e-6)
        assert f"greatest {1e-6 * wanted[np.abs(wanted).argmax()]:.1f} MPa" in view.crank.view.caption


def test_a_film_of_a_rigid_bore_is_solved_where_the_journal_was(online):
    """Pressure times area is the film's recorded force at every frame; cells go round the shell once."""
    engine, cycle, run, _ = online
    bearing = engine.main_bearing
    for look in some(cycle.bearings[:2]):
        number = look.name[5:-1]
        force = run.outputs[f"bearing[{number}].force.x"] + 1j * run.outputs[f"bearing[{number}].force.y"]
        recorded_force = force[run.last_samples]
        for frame in range(0, 720 // FRAME_DEG, 7):
            begin, end = look.film.cells(frame)
            assert (end - begin).sum() == pytest.approx(2.0 * math.pi, rel=1e-5)
            found = look.film.force(frame, 0.5 * bearing.diameter, bearing.width)
            assert abs(found - recorded_force[look.sample(frame)]) < 0.01 * np.abs(recorded_force).max()


def test_what_a_level_lacks_is_said_in_one_line(online):
    _, cycle, _, _ = online
    view = InsideView(cycle)
    assert "twists only" in view._no_crank.object and not view.stress.visible
    for name, there in (("big_end[1]", False), ("main[1]", True)):
        view.bearing.value = name
        for text, box in ((view._no_film, view._film_box), (view._no_orbit, view._orbit_box)):
            assert box.visible == there and (there or "level rigid has no film" in text.object)
    bare = tuple(replace(one, film=None) for one in cycle.bearings)
    view.take(replace(cycle, bearings=bare, levels={**cycle.levels, "bearings": "impedance", "crank": "beam"}))
    assert "level impedance reads the film's force" in view._no_film.object
    assert "A beam crank" in view._no_crank.object
    assert "press <b>Look inside</b>" in InsideView()._head.object


def test_a_saved_cycle_is_read_again(single, tmp_path):
    engine, cycle, _, _ = single
    path = cycle.save(tmp_path / "cycle.h5")
    found = InsideCycle.load(path, engine)
    assert (found.engine, found.levels, found.note) == (cycle.engine, cycle.levels, "")
    for one, other in zip(found.bearings, cycle.bearings, strict=True):
        assert one.name == other.name and one.clearance == other.clearance
        for key in ("angle", "shell", "journal", "orbit"):
            assert np.array_equal(getattr(one, key), getattr(other, key))
        assert np.array_equal(one.film.pressure, other.film.pressure)
    for name in STRESSES:
        assert np.array_equal(found.surface.stresses[name], cycle.surface.stresses[name])
    with one_line("not overwritten"):
        cycle.save(path)
    with one_line("of engine 'single_petrol', not 'v_twin'"):
        InsideCycle.load(path, load_engine("v_twin"))
    cut = tmp_path / "cut.h5"
    cut.write_bytes(path.read_bytes()[:5000])
    with pytest.raises(StoreError):
        InsideCycle.load(cut, engine)


def test_a_result_of_simulate_shows_loads_and_orbits(tmp_path):
    """The polar load is that of the file; the page says what the file has not."""
    engine = load_engine("single_petrol")
    run = ct.simulate(engine, speed_rpm=3000.0, crank="torsional", bearings="impedance", settle=1e-2)
    cycle = InsideCycle.load(run.save(tmp_path / "run.h5"), engine)
    assert cycle.surface is None and "stresses and film pressure take 'Look inside'" in cycle.note
    assert cycle.rpm == pytest.approx(3000.0)
    view = InsideView(cycle)
    view.player.value = ANGLE
    x = run.last_cycle("bearing[1].force.x")[1]
    crank = run.last_cycle("crank.angle")[1]
    nearest = np.abs(np.angle(np.exp(0.5j * (crank - math.radians(ANGLE))))).argmin()
    assert view.polar.point.data["x"][0] == pytest.approx(-1e-3 * x[nearest], rel=1e-6, abs=1e-6)
    nothing = write_result(tmp_path / "none.h5", {"x": (np.zeros(3), "m")}, {"engine": "single_petrol"})
    with one_line("holds no cycle with bearings"):
        InsideCycle.load(nothing, engine)


def test_cells_across_the_seam_lie_on_both_sides():
    pressure = np.array([[1.0], [2.0], [3.0]])
    ends = np.array([-200.0, -60.0, 100.0, 160.0])
    found = cell_columns(ends[:-1], ends[1:], np.array([-1.0, 1.0]), pressure)
    width = found["right"] - found["left"]
    assert found["left"].min() == -180.0 and found["right"].max() == 180.0
    for value, total in ((1.0, 140.0), (2.0, 160.0), (3.0, 60.0)):
        assert width[found["p"] == value].sum() == pytest.approx(total)


def test_a_peak_on_one_line_is_called_not_resolved():
    """The measure of runs: the mean of the neighbours across against the peak, zero beyond the ends."""
    smooth = np.outer([1.0, 2.0, 1.0], [0.5, 0.9, 1.0, 0.9, 0.5])
    assert not single_line(smooth)
    sharp = smooth.copy()
    sharp[1] = [0.0, 0.0, 9.0, 0.1, 0.0]
    assert single_line(sharp) and not single_line(np.zeros((3, 4)))


def test_a_large_surface_becomes_coarser_and_keeps_its_greatest_stress():
    """A sphere of triangles: its area stays, and what is small enough stays as it is."""
    n = 60
    u, v = np.meshgrid(np.linspace(0, np.pi, n), np.linspace(0, 2 * np.pi, 2 * n, endpoint=False), indexing="ij")
    points = np.stack((np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)), axis=-1).reshape(-1, 3)
    k = np.arange(2 * n * n).reshape(n, 2 * n)
    a, b, c, d = k[:-1], k[1:], np.roll(k, -1, axis=1)[1:], np.roll(k, -1, axis=1)[:-1]
    triangles = np.concatenate([np.stack(one, axis=-1).reshape(-1, 3) for one in ((a, b, c), (a, c, d))])
    values = np.random.default_rng(3).random((4, len(points))).astype(np.float32)
    none = np.zeros((1, len(points), 3), np.float32), np.zeros((4, 1)), np.zeros(4)
    fine = CrankSurface(points, triangles.astype(np.int32), *none, {VON_MISES: values, PRINCIPAL: values})
    found = coarser(fine, 2000)
    assert 500 < len(found.triangles) <= 2000 and coarser(fine, 10**6) is fine
    assert found.stresses[VON_MISES].max() == values.max()
    assert found.triangles.max() < len(found.points) == found.stresses[PRINCIPAL].shape[1]
    a, b, c = found.points[found.triangles].transpose(1, 0, 2)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    assert area.sum() == pytest.approx(4.0 * math.pi, rel=0.1)


def inside_of(explored):
    """The part of the visitor's page that looks inside."""
    return explored.closing[-1].__self__.inside


SLIDE = """(() => { const e = [...within(document)].find(e => e.matches('input[type=range]'));
e.value = %d; e.dispatchEvent(new Event('input')); e.dispatchEvent(new Event('change')) })()"""


@needs_browser
@in_a_loop
async def test_the_crank_is_drawn_and_plays_in_a_browser(single):
    """Slider, play and pause move crank and charts."""
    _, cycle, _, _ = single
    async with visited(800, 1000, inside=cycle) as (explored, page):
        await page.until("said().includes('0°: greatest')")
        await page.until("[...within(document)].filter(e => e.matches('canvas')).length >= 4")
        await asyncio.sleep(1.0)
        before = await page.picture()
        assert np.mean(np.ptp(drawn(before), axis=-1) > 0.25) > 0.02, "pixels with a colour"
        await page.run(SLIDE % ANGLE)
        await page.until(f"said().includes('{ANGLE}°: greatest')")
        inside = inside_of(explored)
        assert inside.frame == ANGLE // FRAME_DEG
        assert point(inside.orbit) == inside.look.orbit[inside.look.sample(inside.frame)]
        await asyncio.sleep(1.0)
        assert differing(await page.picture(), before) > 0.01
        buttons = "[...within(document)].filter(e => e.matches('button') && e.querySelector('svg, i')).length"
        assert await page.run(buttons) >= 4
        inside.player.direction = 1
        await page.until(f"!said().includes('{ANGLE}°: greatest')")
        inside.player.direction = 0
        assert inside.frame != ANGLE // FRAME_DEG
        assert await page.run("document.documentElement.scrollWidth") <= 800


@needs_browser
@in_a_loop
async def test_a_click_records_a_cycle_in_the_background_and_shows_it(tmp_path, monkeypatch):
    """Without data the page says what to press; a run that is done is shown, and a click saves it."""
    monkeypatch.chdir(tmp_path)
    async with visited() as (explored, page):
        await page.until("said().includes('Nothing to look into yet')")
        await page.run(TORSIONAL)
        await page.click("button", "Look inside")
        await page.until("/done, \\d+ s/.test(said())", 180)
        await page.until("said().includes('twists only')")
        await page.click("button", "Save this cycle")
        await page.until("said().includes('_inside.h5 written')")
        await page.click("button", "Look inside")
        await page.until("/starting, \\d+ s/.test(said())")
        await page.click("button", "Stop")
        await page.until("said().includes('the cycle was not finished')", 60)
        assert inside_of(explored).cycle is not None
    [path] = tmp_path.glob("*.h5")
    assert InsideCycle.load(path, load_engine("single_petrol")).bearings
