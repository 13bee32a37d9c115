"""The page of ``cranktrain explore``: its knobs, its fast answers, the engine file it writes, and who is admitted."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from one_line import one_line
from some import some

from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import engine_folder, engine_provenance, load_engine
from cranktrain.engine.firing import firing_angles, intervals
from cranktrain.structure.assembly import assemble
from cranktrain.studies.campbell import campbell
from cranktrain.studies.torsion.frequency_run_up import frequency_run_up
from cranktrain_lab.explore import knobs
from cranktrain_lab.explore.engine_file import write_engine
from cranktrain_lab.explore.live import ORDERS, Curves, LiveTorsion
from cranktrain_lab.explore.page import History
from cranktrain_lab.variants.torsional import structure_of

RUBBER = {
    "damper.kind": "rubber", "damper.stiffness": "92000 N m/rad", "damper.loss_factor": 0.2,
    "damper.frequency": "150 Hz",
}  # fmt: skip


def keys(engine):
    return {knob.key for knob in knobs.knobs_of(engine)}


def test_knobs_are_those_of_the_engine_file():
    """No damper, no knob of one; each kind has its own; a chain has a knob a shaft, a formula's crank its diameters."""
    assert not any(key.startswith("damper") for key in keys(load_engine("v12_petrol")))
    six = load_engine("diesel_i6")
    assert {"damper.ring_inertia", "damper.viscosity"} <= keys(six)
    assert {"damper.stiffness", "damper.loss_factor"} <= keys(six.with_(RUBBER))
    assert "damper.viscosity" not in keys(six.with_(RUBBER))
    assert "crankshaft.main_diameter" in keys(load_engine("single_petrol"))
    assert "crankshaft.main_diameter" not in keys(six), "its stiffness is that of finite elements"
    assert "drive_line_chain.stiffnesses[2]" in keys(load_engine("four_petrol"))


@pytest.mark.parametrize("name", ["single_petrol", "four_petrol", "v12_petrol", "diesel_i6", "two_stroke_six"])
def test_every_knob_turns_within_what_an_engine_file_takes(name):
    """A tenth more of any value is an engine that the reader of engine files takes, with all that goes along."""
    engine = load_engine(name)
    for knob in some(knobs.knobs_of(engine)):
        if knob.key == knobs.LOAD:
            continue
        value = min(1.02 * knob.own, knob.high)
        changed = knobs.chosen_engine(engine, knobs.knobs_of(engine), knobs.Chosen({knob.key: value}))
        again = {one.key: one.own for one in knobs.knobs_of(changed)}
        assert again[knob.key] == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "count"), [("single_petrol", 1), ("four_petrol", 2), ("diesel_i6", 4), ("three_petrol", 1)]
)
def test_firing_orders_keep_the_intervals(name, count):
    """An in-line four has two even orders from cylinder 1 on, a six of three pairs four; a single fires as it does."""
    engine = load_engine(name)
    found = knobs.firing_orders(engine)
    assert len(found) == len(set(found)) == count
    assert found[0] == engine.cylinders.firing_order
    for order in found:
        gaps = intervals(firing_angles(knobs.with_order(engine, order)), engine.cylinders.cycle)
        assert np.allclose(gaps, engine.cylinders.cycle / engine.n_cylinders, rtol=1e-6)


def test_live_answers_are_those_of_a_linear_run_up():
    """Turned knobs give the orders of ``runup --crank torsional --method linear`` of an engine with these values."""
    engine = load_engine("v12_petrol")
    live = LiveTorsion(engine)

    def asked(chosen):
        made = assemble(
            knobs.chosen_engine(engine, live.knobs, chosen), Settings(crank="torsional", gas_load=chosen.load)
        )
        return np.abs(frequency_run_up(made.engine, made.body, made.settings, live.speeds, ORDERS).torsion.T)

    loaded = knobs.Chosen({knobs.LOAD: 0.6})
    assert np.allclose(live.answer(loaded).orders, asked(loaded), rtol=1e-9, atol=1e-12)
    turned = knobs.Chosen(
        {"flywheel.polar_inertia": 0.15, "crankshaft.pin_diameter": 0.06, knobs.LOAD: 0.6},
        knobs.firing_orders(engine)[3],
    )
    found, wanted = live.answer(turned).orders, asked(turned)
    # Damping in motion is measured once, at the engine's own values; here it is a sixth more than that of the change.
    apart = np.abs(found - wanted).sum()
    assert apart < 0.03 * wanted.sum()
    assert np.abs(found - live.answer(loaded).orders).sum() > 10.0 * apart


def test_more_inertia_lowers_frequencies_and_no_burn_leaves_compression():
    """Doubled pulley inertia lowers all frequencies; without burn the half order is that of compression."""
    live = LiveTorsion(load_engine("single_petrol"))
    own = live.answer(knobs.Chosen())
    heavy = live.answer(knobs.Chosen({"pulley.polar_inertia": 2.0 * live.engine.pulley.polar_inertia}))
    assert np.all(heavy.hz < own.hz)
    idle = live.answer(knobs.Chosen({knobs.LOAD: 0.0}))
    assert 0.0 < idle.order(0.5).max() < 0.5 * own.order(0.5).max(), "compression alone, once in two revolutions"


@pytest.mark.parametrize("name", ["diesel_v8", "v12_petrol"])
def test_frequencies_of_the_page_are_those_of_the_campbell_diagram_with_the_ring(name):
    """Over the speed, because the damper's fluid thins; a heavier ring lowers the mode, without a ring it is higher."""
    live = LiveTorsion(load_engine(name))
    found = live.answer(knobs.Chosen())
    made = live._model.assembly_of(live.engine, 1.0)
    modes = campbell(made.engine, made.body, found.hz_speeds, "torsional", damper=made.engine.damper is not None)
    np.testing.assert_allclose(found.hz[:, :2], modes.hz[:, :2], rtol=2e-3)
    if made.engine.damper is None:
        return
    heavy = live.answer(knobs.Chosen({"damper.ring_inertia": 1.5 * made.engine.damper.ring_inertia}))
    alone = structure_of(made).frequencies_hz()
    assert np.all(heavy.hz[:, 1] < found.hz[:, 1]) and np.all(found.hz[:, 1] < alone[1])
    assert np.ptp(found.hz[:, 1]) > 1.0


def test_orders_of_a_new_page_are_resonances_and_what_is_large():
    def of_orders(rows):
        """Curves of which each row is the amplitude of an order over five speeds."""
        sizes, none = np.zeros((len(ORDERS), 5)), np.zeros(0)
        for order, row in rows.items():
            sizes[ORDERS.index(order)] = row
        return Curves(np.arange(1.0, 6.0), sizes, none, none, none, 0.0, none, np.zeros((0, 0)), 0.0)

    slow = {0.5 * k: [10.0 - 0.1 * k, 5.0, 2.0, 1.0, 0.5] for k in range(1, 7)}
    peaks = {6.0: [0.0, 0.1, 0.3, 0.1, 0.0], 9.0: [0.0, 0.2, 0.1, 0.0, 0.0]}
    for rows, drowned, largest in (
        (slow | peaks, True, [0.5, 1.0, 6.0, 9.0]), (slow, False, [0.5, 1.0, 1.5, 2.0]), (peaks, False, None)
    ):  # fmt: skip
        curves = of_orders(rows)
        assert curves.drowned == drowned and largest in (None, curves.largest_orders(4))


def test_a_checkbox_changes_the_scale():
    pytest.importorskip("panel")
    from cranktrain_lab.explore.page import Explored, Page

    explored = Explored("single_petrol", LiveTorsion(load_engine("single_petrol")))
    page = Page(explored)
    linear, log = page._orders_chart.plot, page._orders_chart.log_plot
    for chosen in (page._now.drowned, True, False):
        assert (linear.visible, log.visible) == (not page._log.value, page._log.value)
        page._log.value = chosen
    assert {id(one.data_source) for one in linear.renderers} == {id(one.data_source) for one in log.renderers}
    scale = log.y_range
    top = np.degrees(max(page._now.order(order).max() for order in page._orders.value))
    assert scale.start == pytest.approx(1e-3 * top) and scale.end > top
    explored.close()


def test_added_bodies_that_are_not_linear_are_left_out_and_said_to_be():
    engine = load_engine("four_petrol")
    live = LiveTorsion(engine)
    assert not live.notes and live.engine.body
    mesh = replace(engine.connection[0], gear_mesh=replace(engine.connection[0].gear_mesh, backlash=1e-4))
    live = LiveTorsion(replace(engine, connection=(mesh, *engine.connection[1:])))
    assert "added bodies" in live.notes[0] and "teeth with backlash" in live.notes[0]
    assert live.whole.body and not live.engine.body


@pytest.mark.parametrize(("key", "value", "said"), [
    ("pulley.polar_inertia", 1e3, " is not within"), ("damper.viscosity", 1.0, "no such knob"),
])  # fmt: skip
def test_values_outside_a_knob_and_of_no_knob_are_refused(key, value, said):
    engine = load_engine("single_petrol")
    with one_line(key, said):
        knobs.changes_of(engine, knobs.knobs_of(engine), knobs.Chosen({key: value}))


def test_history_undoes_what_was_let_go():
    history = History()
    for value in (2.0, 3.0):
        history.turn("a.b", value, 1.0)
    history.rest()
    history.turn("a.b", 5.0, 1.0)
    assert history.undo().values == {"a.b": 3.0}
    assert history.undo() == knobs.Chosen() and not history.can_undo
    assert history.redo().values == {"a.b": 3.0}
    history.turn("a.b", 1.0, 1.0)
    assert history.now == knobs.Chosen(), "the engine's own value is no choice"
    history.rest()
    assert not history.can_redo


def test_written_file_differs_in_what_was_changed_alone(tmp_path):
    """Comments, origins and notes stay; changed lines say what was there before and where it came from."""
    engine = load_engine("diesel_i6")
    chosen = knobs.Chosen(
        {"damper.ring_inertia": 0.12, "flywheel.polar_inertia": 1.2, knobs.LOAD: 0.5}, (1, 2, 4, 6, 5, 3)
    )
    path = write_engine("diesel_i6", engine, knobs.knobs_of(engine), chosen, tmp_path / "new.toml")
    old, text = (engine_folder() / "diesel_i6.toml").read_text("utf-8"), path.read_text("utf-8")
    lost = [line for line in old.splitlines() if line not in text.splitlines()]
    assert sorted(line.split(" =")[0] for line in lost) == [
        "diametral_inertia", "firing_order", "polar_inertia", "ring_inertia"]  # fmt: skip
    found = load_engine(path)
    assert found == replace(knobs.chosen_engine(engine, knobs.knobs_of(engine), chosen))
    _, value, unit, origin, note = next(one for one in engine_provenance(path) if one[0] == "damper.ring_inertia")
    assert (value, unit, origin) == (0.12, "kg m^2", "chosen")
    assert "0.0975 kg m^2 before (derived: steel of the radii" in note
    head = text.split("\n\n")[0]
    assert "diesel_i6.toml (SHA-256" in head and f"{knobs.FIRING}: 1-5-3-6-2-4 -> 1-2-4-6-5-3" in head


def test_nothing_is_overwritten_or_half_written(tmp_path):
    engine = load_engine("single_petrol")
    turned, chosen = knobs.knobs_of(engine), knobs.Chosen({"pulley.polar_inertia": 0.012})
    path = write_engine("single_petrol", engine, turned, chosen, tmp_path / "new.toml")
    before = path.read_bytes()
    for own, name, said in (
        (chosen, "new.toml", "not overwritten"),
        (chosen, "new.txt", "ends in .toml"),
        (knobs.Chosen({knobs.LOAD: 0.5}), "other.toml", "no value of the engine file is changed; the load is none"),
    ):
        with one_line(said):
            write_engine("single_petrol", engine, turned, own, tmp_path / name)
    assert path.read_bytes() == before
    assert [one.name for one in tmp_path.iterdir()] == ["new.toml"]


def test_engine_in_memory_is_written_whole(tmp_path):
    engine = load_engine("single_petrol").with_({"name": "mine"})
    path = write_engine(
        engine, engine, knobs.knobs_of(engine), knobs.Chosen({"pulley.polar_inertia": 0.012}), tmp_path / "m.toml"
    )
    assert load_engine(path).pulley.polar_inertia == 0.012
    assert tomllib.loads(path.read_text("utf-8"))["name"] == "mine"
