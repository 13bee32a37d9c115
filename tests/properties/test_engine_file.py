"""An engine file is read into SI, and whatever is wrong with it is refused with one line that names the place."""

import json
import math
import warnings
from dataclasses import is_dataclass, replace

import pytest
from engine_texts import EIGHT, SIX, read, with_line, with_value
from one_line import one_line
from some import some

from cranktrain.core.errors import InputError
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.file import ORIGINS, engine_provenance, load_engine
from cranktrain.engine.model import engine_from_dict, engine_to_dict
from cranktrain.engine.parts import LumpedInertia
from cranktrain.engine.quantities import OFFSETS, UNITS, OneOf, check_values, kinds

ENGINES = {"diesel_i6": SIX, "diesel_v8": EIGHT}


@pytest.mark.parametrize(("name", "published"), [("diesel_i6", 6.23), ("diesel_v8", 12.67)])
def test_bore_and_stroke_give_the_published_displacement(name, published):
    engine = load_engine(name)
    stroke = 2.0 * engine.crankshaft.throw
    litres = 1e3 * engine.n_cylinders * math.pi / 4.0 * engine.cylinders.bore**2 * stroke
    assert litres == pytest.approx(published, abs=0.01)


@pytest.mark.parametrize("name", ENGINES)
def test_every_value_states_where_it_comes_from(name):
    rows = engine_provenance(name)
    lines = ENGINES[name].splitlines()
    assert len(rows) == sum(line.count(" = { value") for line in lines if not line.startswith("#"))
    for key, _, unit, origin, note in rows:
        assert origin in ORIGINS, key
        assert any(unit in units for units in UNITS.values()), key
        assert note or origin in ("chosen", "derived"), key


@pytest.mark.parametrize("name", ENGINES)
def test_dictionary_form_survives_json(name):
    engine = load_engine(name)
    assert engine_from_dict(json.loads(json.dumps(engine_to_dict(engine)))) == engine
    data = engine_to_dict(engine)
    del data["rod"]["length"]
    with one_line("rod.length: missing"):
        engine_from_dict(data)


def test_a_unit_of_the_same_dimension_changes_nothing(tmp_path):
    assert read(tmp_path, with_value(SIX, "rod.length", 0.215, "m")) == load_engine("diesel_i6")


@pytest.mark.parametrize(("value", "said"), [
    ("1" + 400 * "0", "… is not a finite number"),
    ("0x" + 4000 * "f", "rod.length: a value too long to show is not a finite number"),
    (5000 * "1", "not a TOML file: Exceeds the limit"),
    (3000 * "[" + 3000 * "]", "not a TOML file: brackets are nested too deeply"),
])  # fmt: skip
def test_what_is_too_long_is_refused_in_a_short_line(tmp_path, value, said):
    with one_line("own.toml: ", said) as caught:
        read(tmp_path, with_value(SIX, "rod.length", value))
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize("name", ENGINES)
def test_every_number_has_a_finite_range_and_every_name_a_list(name):
    """What leaves either is refused with one line: a number with the range and its unit, a name with the nearest."""
    engine = load_engine(name)
    for table, part in some(vars(engine).items()):
        if not is_dataclass(part):
            continue
        for key, (plain, many, rule) in some(kinds(part.__class__).items()):
            if isinstance(rule, OneOf):
                with one_line(f"{table}.{key}: unknown {rule.noun} '{rule.names[0]}x'; did you mean '{rule.names[0]}'"):
                    check_values(replace(part, **{key: rule.names[0] + "x"}), table)
            if plain is not float:
                continue
            unit = rule.unit or next(iter(UNITS[rule.dimension]))
            scale, shift = UNITS[rule.dimension][unit], OFFSETS.get(unit, 0.0)
            assert -math.inf < rule.low < rule.high < math.inf, (table, key)
            for end, other in ((rule.low, rule.high), (rule.high, rule.low)):
                inside = (end * (1.0 - 1e-6) + other * 1e-6) * scale + shift
                outside = (end * 1.01 - other * 0.01) * scale + shift
                check_values(replace(part, **{key: (inside,) if many else inside}), table)
                with one_line(f"{table}.{key}", " is not within ", "" if unit == "1" else f" {unit}"):
                    check_values(replace(part, **{key: (outside,) if many else outside}), table)


@pytest.mark.parametrize("entry", [
    "cylinders.piston_mass", "rod.big_end_mass", "rod.small_end_mass", "flywheel.mass", "pulley.mass", "damper.mass",
    "block.head_mass", "rod.inertia",
])  # fmt: skip
def test_grams_for_kilograms_are_doubted_and_the_shipped_engines_are_not(tmp_path, entry):
    table, key = entry.split(".")
    value = getattr(getattr(load_engine("diesel_i6"), table), key)
    for factor in (1000.0, 1e-3):
        with pytest.warns(UserWarning, match=rf"^diesel_i6: {table}\.{key}: .* usual .*; check its unit$"):
            read(tmp_path, with_value(SIX, entry, factor * value))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_engine("diesel_i6"), load_engine("diesel_v8")


def test_what_is_no_file_is_refused_in_one_line(tmp_path):
    for name in ("x" * 300 + ".toml", "\0.toml", str(tmp_path) + "/.toml", "/dev/zero.toml", tmp_path / "none.toml"):
        with pytest.raises(InputError, match=r"no such engine file|cannot be read|not a valid file name"):
            load_engine(name)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(bytes(range(256)))
    with one_line("not text in UTF-8"):
        load_engine(binary)
    with one_line("unknown engine 'diesel_i7': did you mean 'diesel_i6'?"):
        load_engine("diesel_i7")
    with one_line("unknown table 'fly_wheel'; did you mean 'flywheel'?"):
        read(tmp_path, SIX.replace("[flywheel]", "[fly_wheel]"))


NEW = {
    "main_bearing": "groove roughness asperity_factor asperity_ratio contact_modulus boundary_friction boundary_shear",
    "oil": "law walther_temperatures walther_viscosities pressure_law pressure_viscosity compressibility "
           "heat_capacity heat_share",
}  # fmt: skip


def test_a_file_without_the_optional_keys_stays_valid(tmp_path):
    start = SIX.index("[big_end_bearing]")
    old = SIX[:start] + SIX[SIX.index("[thrust]") :]
    for table, keys in NEW.items():
        for key in keys.split():
            old = with_line(old, f"{table}.{key}", "")
    engine, shipped = read(tmp_path, old), load_engine("diesel_i6")
    assert engine.big_end_bearing is None
    # What the shipped file states and its defaults are the same surfaces.
    assert engine.main_bearing == shipped.main_bearing
    assert engine.oil.law == "vogel" and engine.oil.pressure_law == "none" and engine.oil.walther_viscosities == ()
    assert engine_from_dict(json.loads(json.dumps(engine_to_dict(engine)))) == engine
    # A flat model that knows nothing of them is read likewise.
    data = engine_to_dict(engine)
    del data["big_end_bearing"], data["main_bearing"]["roughness"]
    assert engine_from_dict(data) == engine


def test_walthers_law_asks_for_no_key_of_vogels(tmp_path):
    text = with_value(with_line(SIX, "oil.vogel_b", ""), "oil.law", '"walther"')
    oil = read(tmp_path, text).oil
    assert oil.law == "walther" and oil.walther_viscosities == pytest.approx((117.6e-6, 16.82e-6))


def without(*keys):
    """The six's text without entries of its damper."""
    text = SIX
    for key in keys:
        text = with_line(text, f"damper.{key}", "")
    return text


def test_a_damper_is_optional_and_each_kind_asks_only_for_its_own_keys(tmp_path):
    start = SIX.index("[damper]")
    engine = read(tmp_path, SIX[:start] + SIX[SIX.index("\n[", start + 1) + 1 :])
    assert engine.damper is None
    assert engine_from_dict(json.loads(json.dumps(engine_to_dict(engine)))) == engine
    own = load_engine("diesel_i6").damper
    assert own.power_limit == pytest.approx(5000.0) and own.temperatures[0] == pytest.approx(273.15 + 65.0)
    viscous = ("viscosity", "viscosity_slope", "critical_stress", "flow_exponent", "ring_outer_radius", "axial_gap")
    assert read(tmp_path, with_value(without(*viscous), "damper.kind", '"rubber"')).damper.kind == "rubber"
    newtonian = with_value(without("critical_stress", "flow_exponent", "stiffness"), "damper.law", '"newtonian"')
    assert read(tmp_path, newtonian).damper.law == "newtonian"
    with one_line("damper.loss_factor: is missing; a rubber damper needs"):
        read(tmp_path, with_value(without("loss_factor"), "damper.kind", '"rubber"'))


def test_mains_are_plain_or_rollers_and_plain_ones_are_asked_for_in_one_line():
    six, eight = load_engine("diesel_i6"), load_engine("diesel_v8")
    assert six.plain_mains.diameter == pytest.approx(0.080)
    for call, said in (
        (lambda: eight.plain_mains, "'diesel_v8' has no [main_bearing]"),
        (lambda: check_engine(replace(six, main_roller=eight.main_roller)), "main_bearing: is given together with"),
        (lambda: check_engine(replace(eight, main_roller=None)), "main_bearing: is missing; the mains are plain"),
        (lambda: check_engine(replace(eight, clutch=LumpedInertia(18.0, 0.5, 0.2, 0.06))), "clutch.polar_inertia: is"),
    ):
        with one_line(said):
            call()


def test_rods_of_a_pin_lie_side_by_side_between_its_fillets():
    engine = load_engine("diesel_v8")
    width, crank = engine.big_end_bearing.width, engine.crankshaft
    for first in range(4):
        a, b = engine.rod_offsets[first], engine.rod_offsets[first + 4]
        assert engine.cylinders.pins[first] == engine.cylinders.pins[first + 4]
        assert b - a >= width and max(abs(a), abs(b)) + width / 2 <= crank.pin_width / 2 - crank.fillet + 1e-12
