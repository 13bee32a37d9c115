"""When cylinders fire: orders, layouts and statements, against the intervals that such engines have."""

from __future__ import annotations

import math
import re
import warnings
from dataclasses import replace
from pathlib import Path

import pytest

from cranktrain.core.errors import InputError
from cranktrain.engine.file import engine_path, load_engine
from cranktrain.engine.firing import dead_centres, even_order, firing_summary, firing_text, uneven

DATA = Path(__file__).parents[1] / "data" / "engines"
SIX = load_engine("diesel_i6")
V8 = {"banks": [-45] * 4 + [45] * 4, "pins": [1, 2, 3, 4] * 2}
CROSS_PLANE = [1, 5, 4, 2, 6, 3, 7, 8]


def engine(throws, order, banks=None, pins=None, **stated):
    """An engine with throws and banks in degrees."""
    count = len(order)
    given = {
        key: tuple(map(math.radians, angles)) if isinstance(angles, list) else math.radians(angles)
        for key, angles in stated.items()
    }
    cylinders = replace(
        SIX.cylinders, firing_order=tuple(order), pins=tuple(pins or range(1, count + 1)),
        bank_angles=tuple(math.radians(bank) for bank in banks or [0] * count), **given,
    )  # fmt: skip
    return replace(SIX, crankshaft=replace(SIX.crankshaft, throw_angles=tuple(map(math.radians, throws))),
                   cylinders=cylinders)  # fmt: skip


def fired(made):
    return firing_summary(made)["intervals_deg"]


@pytest.mark.parametrize(
    ("made", "intervals"),
    [
        (engine([0, 240, 120], [1, 3, 2]), [240] * 3),
        (engine([0, 180, 180, 0], [1, 3, 4, 2]), [180] * 4),
        (engine([180, 0, 0, 180], [1, 3, 4, 2]), [180] * 4),
        (engine([0, 180, 180, 0], [3, 4, 2, 1]), [180] * 4),
        (engine([0, 216, 72, 288, 144], [1, 2, 3, 4, 5]), [144] * 5),
        (engine([0, 90, 270, 180], CROSS_PLANE, **V8), [90] * 8),
        (engine([-45, 45, 225, 135], CROSS_PLANE, **V8), [90] * 8),
        (engine([0, 180, 180, 0], [1, 8, 3, 6, 4, 5, 2, 7], **V8), [90] * 8),
        (engine([0, 120, 240], [1, 4, 2, 5, 3, 6], [-45] * 3 + [45] * 3, [1, 2, 3] * 2), [90, 150] * 3),
        (engine([0], [1]), [720]),
        (engine([0, 0], [1, 2]), [360, 360]),
        (engine([0, 180], [1, 2]), [180, 540]),
        (engine([0, 180], [1, 2], [-90, 90]), [360, 360]),
        (engine([0], [1, 2], [-22.5, 22.5], [1, 1]), [405, 315]),
        (engine([0], [2, 1], [-22.5, 22.5], [1, 1]), [405, 315]),
        (engine([0, 120, 240, 180, 300, 60], [1, 5, 3, 4, 2, 6], cycle=360.0), [60] * 6),
        (engine([0, 180], [1, 2], cycle=360.0), [180, 180]),
        (engine([0], [1], cycle=360.0), [360]),
        # Sixteen cylinders on eight pins have eight dead centres in 720 degrees: two fire at a time.
        (engine([0, 90, 270, 180, 180, 270, 90, 0], [1, 9, 3, 11, 5, 13, 7, 15, 8, 16, 6, 14, 4, 12, 2, 10],
                [-45] * 8 + [45] * 8, [*range(1, 9)] * 2), [0, 90] * 8),
    ],
)  # fmt: skip
def test_an_order_has_the_intervals_of_such_engines(made, intervals):
    assert fired(made) == pytest.approx(intervals, abs=1e-6)
    assert len(intervals) < 16 or not list(uneven(made))
    for dead, angle in zip(dead_centres(made.crankshaft, made.cylinders, made.rod), made.firing_angles, strict=True):
        assert math.remainder(angle - dead, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-12)


def test_statements_choose_what_the_order_does_not():
    together = engine([0, 0], [1, 2], firing_angles=[0, 0])
    near = engine([0], [1, 2], [-22.5, 22.5], [1, 1], firing_intervals=[45, 675])
    for made, intervals in ((together, [0, 720]), (near, [45, 675])):
        assert fired(made) == pytest.approx(intervals) and not list(uneven(made))
    later = engine([0, 180, 180, 0], [1, 3, 4, 2], firing_angles=[90, 630, 270, 450])
    assert firing_summary(later) == {"order": [1, 3, 4, 2], "intervals_deg": [180.0] * 4}


@pytest.mark.parametrize(
    ("stated", "text"),
    [
        ({"firing_angles": [0, 540, 90, 360]}, r"firing_angles: cylinder 3 would fire 90 deg .* dead centre 180 deg"),
        ({"firing_intervals": [180, 180, 180, 90]}, r"firing_intervals: they sum up to 630 deg, a cycle has 720"),
        ({"firing_intervals": [90, 270, 180, 180]}, r"firing_intervals: cylinder 3 would fire 90 deg"),
    ],
)
def test_statements_that_throws_contradict_are_refused(stated, text):
    with pytest.raises(InputError, match=text):
        engine([0, 180, 180, 0], [1, 3, 4, 2], **stated).firing_angles  # noqa: B018


@pytest.mark.parametrize(
    ("throws", "order", "said"),
    [
        ([0, 240, 120], [1, 2, 3], "120, 120, 480 deg; turned the other way it fires evenly"),
        ([0, 216, 72, 288, 144], [1, 2, 4, 5, 3], "1-2-3-4-5 fires evenly"),
        ([0, 180], [1, 2], "180, 540 deg; state cylinders.firing_intervals if that is intended"),
    ],
)
def test_uneven_orders_are_told_with_what_makes_them_even(throws, order, said):
    (line,) = uneven(engine(throws, order))
    assert said in line and not list(uneven(engine([0, 120, 240], [1, 2, 3])))


def test_an_order_beyond_a_cycle_is_refused_with_an_even_one():
    """A five whose throws are mirrored: the order that is named fires every 144 degrees."""
    mirrored = engine([0, 72, 144, 216, 288], [1, 2, 3, 4, 5])
    with pytest.raises(InputError, match=r"within 720 deg; (\d-\d-\d-\d-\d) would do") as refused:
        mirrored.firing_angles  # noqa: B018
    order = [int(k) for k in re.search(r"; ([\d-]+) would do", str(refused.value)).group(1).split("-")]
    assert order == list(even_order(dead_centres(mirrored.crankshaft, mirrored.cylinders, mirrored.rod), 4.0 * math.pi))
    assert fired(engine([0, 72, 144, 216, 288], order)) == pytest.approx([144] * 5)


def test_throws_counted_from_anywhere_are_the_same_engine(tmp_path):
    """The V8 with its throws counted from throw 1: cylinder 1 fires at crank angle 0, as in the shipped file."""
    text, throws = engine_path("diesel_v8").read_text(encoding="utf-8"), "value = [-45, 45, 225, 135]"
    assert throws in text
    (tmp_path / "own.toml").write_text(text.replace(throws, "value = [0, 90, 270, 180]"), encoding="utf-8")
    own, shipped = load_engine(tmp_path / "own.toml"), load_engine("diesel_v8")
    assert own.crankshaft.throw_angles == pytest.approx(shipped.crankshaft.throw_angles)
    assert own.firing_angles == pytest.approx(shipped.firing_angles) and own.firing_angles[0] == 0.0


INTERVALS = 'firing_intervals = { value = [315, 405], unit = "deg", origin = "chosen" }\nfiring_order'


@pytest.mark.parametrize(("old", "new"), [("[2, 1]", "[1, 2]"), ("[2, 1]", "[2, 1]"), ("firing_order", INTERVALS)])
def test_a_twin_is_the_same_whatever_its_order_names_first_and_a_statement_silences_the_warning(tmp_path, old, new):
    text = (DATA / "vtwin.toml").read_text(encoding="utf-8")
    (tmp_path / "own.toml").write_text(text.replace(old, new), encoding="utf-8")
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        twin = load_engine(tmp_path / "own.toml")
    expected = [] if new == INTERVALS else ["firing_order: fires at uneven intervals, 405, 315 deg"]
    assert len(told) == len(expected) and all(one in str(told[0].message) for one in expected)
    assert [math.degrees(angle) for angle in twin.firing_angles] == pytest.approx([0.0, 405.0])
    assert firing_text(twin) == "Fires 1-2, at intervals of 405, 315 deg"
