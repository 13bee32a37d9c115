"""The V8's engine file: layout, what its mains are, and what cannot be, refused in one line."""

import math
import re
from dataclasses import replace

import pytest

from cranktrain.core.errors import InputError
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.file import ORIGINS, engine_path, engine_provenance, load_engine
from cranktrain.engine.model import engine_from_dict, engine_to_dict
from cranktrain.engine.parts import LumpedInertia
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.crank.shape import pin_centre

SOURCE = engine_path("diesel_v8").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def engine():
    return load_engine("diesel_v8")


def changed(tmp_path, *edits):
    """Engine file in which each (table, key) has another value."""
    text = SOURCE
    for table, key, value in edits:
        start = text.index(f"[{table}]")
        found = re.compile(rf"^{key} = {{ value = (\[.*?\]|[^,}}]*[^,}} ])", re.MULTILINE).search(text, start)
        text = text[: found.start(1)] + value + text[found.end(1) :]
    path = tmp_path / "own.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_bore_and_stroke_give_the_published_displacement(engine):
    litres = 1e3 * engine.n_cylinders * math.pi / 4.0 * engine.cylinders.bore**2 * 2.0 * engine.crankshaft.throw
    assert litres == pytest.approx(12.67, abs=0.01)


def test_it_fires_every_90_degrees_from_cylinder_1_at_crank_angle_0(engine):
    angles = [engine.firing_angles[c - 1] for c in engine.cylinders.firing_order]
    assert engine.cylinders.firing_order[0] == 1
    assert angles == pytest.approx([i * math.pi / 2.0 for i in range(8)], abs=1e-8)


def test_the_block_stands_upright_and_throws_are_cross_plane(engine):
    banks, throws = engine.cylinders.bank_angles, engine.crankshaft.throw_angles
    assert banks[:4] == pytest.approx([-math.pi / 4] * 4) and banks[4:] == pytest.approx([math.pi / 4] * 4)
    seen = [math.degrees(angle - throws[0]) % 360.0 for angle in throws]
    assert seen == pytest.approx([0.0, 90.0, 270.0, 180.0])
    # Throw 1 points along the bank of cylinder 1 at crank angle 0, to the +x side of the vertical.
    x, y, _ = pin_centre(engine.crankshaft, 1)
    assert (x, y) == pytest.approx((engine.crankshaft.throw / math.sqrt(2.0),) * 2)


def test_rods_of_a_pin_lie_side_by_side_between_its_fillets(engine):
    assert engine.big_end_bearing is not None
    width, crank = engine.big_end_bearing.width, engine.crankshaft
    for first in range(4):
        a, b = engine.rod_offsets[first], engine.rod_offsets[first + 4]
        assert engine.cylinders.pins[first] == engine.cylinders.pins[first + 4]
        assert b - a >= width and max(abs(a), abs(b)) + width / 2 <= crank.pin_width / 2 - crank.fillet + 1e-12


def test_peak_pressure_is_that_of_such_engines():
    assert 12e6 < GasTrace.from_engine(load_engine("diesel_v8")).peak < 14e6


def test_every_value_states_where_it_comes_from():
    rows = engine_provenance("diesel_v8")
    assert len(rows) == sum(line.count(" = { value") for line in SOURCE.splitlines() if not line.startswith("#"))
    assert {origin for _, _, _, origin, _ in rows} <= set(ORIGINS)


def test_it_travels_as_plain_data(engine):
    assert engine_from_dict(engine_to_dict(engine)) == engine


def test_plain_mains_are_asked_for_in_one_line(engine):
    with pytest.raises(InputError, match=r"'diesel_v8' has no \[main_bearing\].*bearing level 'roller'") as caught:
        engine.plain_mains  # noqa: B018
    assert "\n" not in str(caught.value)
    assert load_engine("diesel_i6").plain_mains.diameter == pytest.approx(0.080)


def test_mains_are_plain_or_rollers(engine):
    six = load_engine("diesel_i6")
    with pytest.raises(InputError, match=r"^main_bearing: is given together with \[main_roller\]; keep one of the two"):
        check_engine(replace(six, main_roller=engine.main_roller))
    with pytest.raises(InputError, match=r"^main_bearing: is missing; the mains are plain bearings .* or roller"):
        check_engine(replace(engine, main_roller=None))


def test_a_clutch_that_no_body_can_be_is_refused(engine):
    clutch = LumpedInertia(18.0, 0.5, 0.2, 0.06)
    with pytest.raises(InputError, match=r"^clutch\.polar_inertia: is more than twice diametral_inertia"):
        check_engine(replace(engine, clutch=clutch))


ORDER = r"own\.toml: cylinders\.firing_order: "
OFFSETS = r"own\.toml: cylinders\.rod_offsets: "


@pytest.mark.parametrize(
    ("edits", "says"),
    [
        (
            [("cylinders", "firing_order", "[1, 5, 4, 2, 6, 3, 7, 7]")],
            ORDER + r"cylinder 7 fires twice, cylinder 8 of 1\.\.8 never fires; put 8 in place of one 7$",
        ),
        (
            [("cylinders", "firing_order", "[1, 5, 4, 2, 6, 3, 7]")],
            ORDER + r"cylinder 8 of 1\.\.8 never fires; each fires once$",
        ),
        (
            [("cylinders", "firing_order", "[1, 5, 4, 2, 6, 3, 7, 8, 5]")],
            ORDER + r"cylinder 5 fires twice; each fires once$",
        ),
        (
            [("cylinders", "firing_order", "[1, 5, 4, 2, 6, 3, 7, 9]")],
            ORDER + r"cylinder 8 of 1\.\.8 never fires; put 8 in place of the 9$",
        ),
        (
            [("cylinders", "firing_order", "[1, 5, 4, 2, 6, 3, 7, 8, 9]")],
            ORDER + r"cylinder 9 has no pin; cylinders\.pins knows 1\.\.8$",
        ),
        (
            [("cylinders", "firing_order", "[1, 5, 2, 4, 6, 3, 7, 8]")],
            ORDER + r"the throws do not reach dead centre .* within 720 deg; 1-5-4-2-6-3-7-8 would do",
        ),
        (
            [("crankshaft", "pin_width", "56")],
            r"own\.toml: crankshaft\.pin_width: pin 1 is 56 mm wide, but rods 1 and 5 of 29 mm each need 58 mm; "
            r"widen it or lessen big_end_bearing\.width to 28 mm$",
        ),
        (
            [("big_end_bearing", "width", "36")],
            r"own\.toml: crankshaft\.pin_width: pin 1 is 70 mm wide, but rods 1 and 5 of 36 mm each need 72 mm; ",
        ),
        (
            [("cylinders", "rod_offsets", "[-14, -15.25, -15.25, -15.25, 14, 15.25, 15.25, 15.25]")],
            OFFSETS + r"rods 1 and 5 overlap on pin 1: 28 mm apart, their big ends 29 mm wide; set them at least 29 mm",
        ),
        (
            [("cylinders", "rod_offsets", "[-15.25, -15.25, -15.25, -15.25, 15.25, 25, 15.25, 15.25]")],
            OFFSETS + r"rod 6 at 25 mm with its big end of 29 mm reaches beyond pin 2; keep within 20\.5 mm",
        ),
        (
            [("cylinders", "rod_offsets", "[-15.25, -15.25, -15.25, -152.5, 15.25, 15.25, 15.25, 15.25]")],
            OFFSETS + r"rod 4 at -152\.5 mm lies beside its pin, which ends 35 mm from its middle",
        ),
        (
            [("cylinders", "rod_offsets", "[-15.25, 15.25]")],
            OFFSETS + r"2 offsets for 8 cylinders; give one for each, or none$",
        ),
        (
            [("balance_weights", "mains", "[1, 6]")],
            r"own\.toml: balance_weights\.mains: 6 is not one of the main journals 1\.\.5$",
        ),
        (
            [("balance_weights", "radii", "[107]")],
            r"own\.toml: balance_weights\.radii: 1 values for 2 in mains; give one for each$",
        ),
        ([("cylinders", "rod_offsets", "[]")], OFFSETS + r"rods 1 and 5 overlap on pin 1: 0 mm apart"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(tmp_path, edits, says):
    with pytest.raises(InputError, match=says) as caught:
        load_engine(changed(tmp_path, *edits))
    assert "\n" not in str(caught.value)
