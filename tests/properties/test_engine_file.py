"""An engine file is read into SI, and whatever is wrong with it is refused with one line that names the place."""

import json
import math
import re
import warnings
from dataclasses import is_dataclass, replace

import pytest
from some import some

from cranktrain.core.errors import InputError
from cranktrain.engine.checks.crankshaft import check_crankshaft
from cranktrain.engine.file import ORIGINS, engine_path, engine_provenance, load_engine
from cranktrain.engine.model import engine_from_dict, engine_to_dict
from cranktrain.engine.quantities import OFFSETS, UNITS, check_values, kinds

SOURCE = engine_path("diesel_i6").read_text(encoding="utf-8")


def entry(table, key):
    """Span of one entry's line in the shipped file."""
    start = SOURCE.index(f"[{table}]")
    found = re.compile(rf"^{key} = .*$", re.MULTILINE).search(SOURCE, start)
    return found.span()


def edited(tmp_path, table, key, line):
    start, end = entry(table, key)
    path = tmp_path / "own.toml"
    path.write_text(SOURCE[:start] + line + SOURCE[end:], encoding="utf-8")
    return path


def with_value(tmp_path, table, key, value, unit=None):
    start, end = entry(table, key)
    line = re.sub(r"value = (\[.*?\]|[^,}]*[^,} ])", f"value = {value}", SOURCE[start:end], count=1)
    if unit:
        line = re.sub(r'unit = ".*?"', f'unit = "{unit}"', line)
    return edited(tmp_path, table, key, line)


def test_bore_and_stroke_give_the_published_displacement():
    engine = load_engine("diesel_i6")
    stroke = 2.0 * engine.crankshaft.throw
    litres = 1e3 * engine.n_cylinders * math.pi / 4.0 * engine.cylinders.bore**2 * stroke
    assert litres == pytest.approx(6.23, abs=0.01)
    assert engine.crankshaft.throw_angles[1] == pytest.approx(4.0 * math.pi / 3.0)


def test_the_six_fires_every_120_degrees_in_its_order():
    engine = load_engine("diesel_i6")
    angles = [engine.firing_angles[c - 1] for c in engine.cylinders.firing_order]
    assert angles == pytest.approx([i * 2.0 * math.pi / 3.0 for i in range(6)], abs=1e-8)


def test_a_cross_plane_v8_with_shared_pins_fires_every_90_degrees():
    engine = load_engine("diesel_i6")
    quarter = math.pi / 2.0
    v8 = replace(
        engine,
        crankshaft=replace(engine.crankshaft, throw_angles=(0.0, quarter, 3.0 * quarter, 2.0 * quarter)),
        cylinders=replace(
            engine.cylinders,
            firing_order=(1, 5, 4, 2, 6, 3, 7, 8),
            pins=(1, 2, 3, 4, 1, 2, 3, 4),
            bank_angles=4 * (0.0,) + 4 * (quarter,),
        ),
    )
    angles = [v8.firing_angles[c - 1] for c in v8.cylinders.firing_order]
    assert angles == pytest.approx([i * quarter for i in range(8)], abs=1e-8)


def test_every_value_states_where_it_comes_from():
    rows = engine_provenance("diesel_i6")
    assert len(rows) == sum(line.count(" = { value") for line in SOURCE.splitlines() if not line.startswith("#"))
    for key, _, unit, origin, note in rows:
        assert origin in ORIGINS, key
        assert any(unit in units for units in UNITS.values()), key
        assert note or origin in ("chosen", "derived"), key


def test_dictionary_form_survives_json():
    engine = load_engine("diesel_i6")
    assert engine_from_dict(json.loads(json.dumps(engine_to_dict(engine)))) == engine
    data = engine_to_dict(engine)
    del data["rod"]["length"]
    with pytest.raises(InputError, match=r"rod\.length: missing"):
        engine_from_dict(data)


def test_a_unit_of_the_same_dimension_changes_nothing(tmp_path):
    path = with_value(tmp_path, "rod", "length", 0.215, "m")
    assert load_engine(path) == load_engine("diesel_i6")


@pytest.mark.parametrize(
    ("table", "key", "value", "unit", "says"),
    [
        ("crankshaft", "web_pin_radius", 30, None, r"crankshaft\.web_pin_radius: the pin lies outside its web"),
        ("main_bearing", "clearance", -40, None, r"main_bearing\.clearance: -40 um is not within .*; it is the radial"),
        ("main_bearing", "clearance", 40, "mm", r"main_bearing\.clearance: .*radial clearance"),
        ("rod", "length", 55, None, r"rod\.length: 55 mm is shorter than throw"),
        ("rod", "length", 215, "kg", r"rod\.length: unit 'kg' does not measure its length; use one of: m, mm, um"),
        ("rod", "length", "nan", None, r"rod\.length: nan is not a finite number"),
        ("rod", "length", "[215]", None, r"rod\.length: a single value is wanted"),
        ("oil", "vogel_b", 1000, "degC", r"oil\.vogel_b: unit 'degC' does not measure its temperature difference"),
        ("cylinders", "firing_order", "[1, 5, 3, 6, 2, 2]", None, r"firing_order: cylinder 2 fires twice"),
        ("cylinders", "firing_order", "[1, 5, 3, 6, 2, 7]", None, r"firing_order: cylinder 4 of 1\.\.6 never fires"),
        (
            "cylinders",
            "firing_order",
            "[1, 2, 3, 4, 5, 6]",
            None,
            r"firing_order: cylinders 3 and 4 would fire together",
        ),
        ("cylinders", "pins", "[1, 2, 3, 4, 5]", None, r"cylinders\.pins: 5 pins for 6 cylinders"),
        ("cylinders", "pins", "[1, 2, 3, 4, 5, 8]", None, r"cylinders\.pins: .* not one of 1\.\.6"),
        ("crankshaft", "main_widths", "[40, 38, 38]", None, r"main_widths: 3 widths for 6 throws"),
        ("crankshaft", "throw_angles", "[0, 240]", None, r"main_widths: 7 widths for 2 throws"),
        ("crankshaft", "oil_holes", 1, None, r"oil_holes: 1 is not true or false"),
        (
            "crankshaft",
            "web_main_radius",
            40,
            None,
            r"crankshaft\.web_main_radius: the main journal lies outside the web",
        ),
        ("crankshaft", "main_widths", "[]", None, r"main_widths: 0 widths for 6 throws"),
        ("crankshaft", "mesh_size", 18, "um", r"mesh_size: 0\.018 mm would take millions of elements"),
        (
            "crankshaft",
            "nose_length",
            75,
            "m",
            r"nose_length: 7\.5e\+04 mm is not within 0\.01 to 10000 mm; check its unit",
        ),
        ("thrust", "main", 9, None, r"thrust\.main: 9 is not one of the main journals 1\.\.7"),
        ("thrust", "main", 1.5, None, r"thrust\.main: 1\.5 is not a whole number"),
        ("flywheel", "polar_inertia", 2.4, None, r"flywheel\.polar_inertia: is more than twice"),
        ("damping", "kind", '"raleigh"', None, r"damping\.kind: unknown kind 'raleigh'; did you mean 'rayleigh'\?"),
        ("combustion", "exhaust_opens", 40, None, r"combustion\.exhaust_opens: must lie after the end of combustion"),
        ("main_bearing", "groove", '"round"', None, r"main_bearing\.groove: unknown groove 'round'; valid: none"),
        ("main_bearing", "roughness", 40, None, r"main_bearing\.roughness: six of 40 um bridge the clearance, 40 um"),
        (
            "main_bearing",
            "boundary_friction",
            10,
            None,
            r"main_bearing\.boundary_friction: 10 is not within 0 to 0\.99; lubricated surfaces have",
        ),
        (
            "main_bearing",
            "contact_modulus",
            0,
            None,
            r"main_bearing\.contact_modulus: 0 GPa is not within 0\.001 to 10000",
        ),
        (
            "big_end_bearing",
            "diameter",
            80,
            None,
            r"big_end_bearing\.diameter: 80 mm does not fit the crank pin, 73\.5",
        ),
        ("big_end_bearing", "width", 49, None, r"big_end_bearing\.width: 49 mm is wider than the narrowest crank pin"),
        ("oil", "law", '"vogl"', None, r"oil\.law: unknown law 'vogl'; did you mean 'vogel'\?"),
        ("oil", "walther_viscosities", "[110]", None, r"oil\.walther_viscosities: 1 viscosities at 2 walther_temp"),
        ("oil", "walther_viscosities", "[14, 110]", None, r"oil\.walther_viscosities: .* viscosities decrease"),
        ("oil", "walther_viscosities", "[110, 14]", "mPa s", r"unit 'mPa s' does not measure its kinematic viscosity"),
        (
            "oil",
            "compressibility",
            '"dowson"',
            None,
            r"oil\.compressibility: unknown law .* did you mean 'dowson-hig.*",
        ),
        ("oil", "pressure_law", '"barrus"', None, r"oil\.pressure_law: unknown law .* did you mean 'barus'\?"),
        (
            "oil",
            "heat_share",
            1.5,
            None,
            r"oil\.heat_share: 1\.5 is not within 0\.001 to 1; it is a part of the friction power",
        ),
        ("oil", "temperatures", "[80]", None, r"oil\.temperatures: 1 temperatures for 2 speeds"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(tmp_path, table, key, value, unit, says):
    path = with_value(tmp_path, table, key, value, unit)
    with pytest.raises(InputError, match=says) as caught:
        load_engine(path)
    text = str(caught.value)
    assert text.startswith("own.toml: ") and "\n" not in text


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("rod_length = 3", r"rod: unknown key 'rod_length'; did you mean 'length'\?"),
        ("", r"rod: key 'length' is missing"),
        ("length = 215", r"rod\.length: write it as"),
        ('length = { value = 215, unit = "mm" }', r"rod\.length: origin 'None' is not known; valid: chosen"),
        ('length = { value = 215, unit = "mm", origin = "calibrated" }', r"rod\.length: .* needs a note"),
        ('length = { value = 1, unit = "mm", origin = "chosen", nte = "" }', r"unknown entry 'nte'; did you mean"),
        ("length = {", r"not a TOML file"),
    ],
)
def test_broken_entries_are_named(tmp_path, line, says):
    with pytest.raises(InputError, match=says):
        load_engine(edited(tmp_path, "rod", "length", line))


@pytest.mark.parametrize("name", ["diesel_i6", "diesel_v8"])
def test_every_number_has_a_finite_range_and_leaves_it_with_one_line(name):
    engine = load_engine(name)
    for table, part in some(vars(engine).items()):
        if not is_dataclass(part):
            continue
        for key, (plain, many, rule) in some(kinds(part.__class__).items()):
            if plain is not float:
                continue
            unit = rule.unit or next(iter(UNITS[rule.dimension]))
            scale, shift = UNITS[rule.dimension][unit], OFFSETS.get(unit, 0.0)
            assert -math.inf < rule.low < rule.high < math.inf, (table, key)
            for end, other in ((rule.low, rule.high), (rule.high, rule.low)):
                inside = (end * (1.0 - 1e-6) + other * 1e-6) * scale + shift
                outside = (end * 1.01 - other * 0.01) * scale + shift
                check_values(replace(part, **{key: (inside,) if many else inside}), table)
                with pytest.raises(InputError, match=rf"^{table}\.{key}.* is not within .* to ") as caught:
                    check_values(replace(part, **{key: (outside,) if many else outside}), table)
                assert "\n" not in str(caught.value) and (unit == "1" or f" {unit}" in str(caught.value))


NONSENSE = [
    ("material", "density", 1e9, None, r"density: 1e\+09 kg/m\^3 is not within 100 to 25000 kg/m\^3"),
    ("cylinders", "compression_ratio", 1e30, None, r"compression_ratio: 1e\+30 is not within 1\.5 to 60"),
    ("main_bearing", "diameter", 1e6, "um", r"diameter: 1000 mm does not fit the main journal"),
    ("crankshaft", "main_diameter", 85, "m", r"main_diameter: 8\.5e\+04 mm is not within 1 to 5000 mm"),
    ("oil", "vogel_b", 103194, None, r"oil\.vogel_b: 1\.032e\+05 K is not within"),
    ("oil", "vogel_b", 10319.4, None, r"oil\.law: vogel gives .* mPa s at 80 degC, not 0\.01 to 100000"),
    ("oil", "temperatures", "[80, 1050]", None, r"temperatures\[2\]: 1050 degC is not within -80 to 300 degC"),
    ("rod", "length", "1" + 400 * "0", None, r"length: 10+…? is not a finite number"),
    ("rod", "length", "0x" + 4000 * "f", None, r"length: a value too long to show is not a finite number"),
    ("rod", "length", 5000 * "1", None, r"not a TOML file: Exceeds the limit"),
    ("rod", "length", 3000 * "[" + 3000 * "]", None, r"not a TOML file: brackets are nested too deeply"),
    ("rod", "length", 1e-300, None, r"length: 1e-300 mm is not within"),
    ("rod", "length", "[]", None, r"length: a single value is wanted, got \[\]"),
    ("oil", "temperatures", "[]", None, r"temperatures: 0 temperatures for 2 speeds"),
    ("main_bearing", "groove", r'"a\\nb"', None, r"unknown groove 'a\\nb'"),
]


@pytest.mark.parametrize(("table", "key", "value", "unit", "says"), NONSENSE)
def test_nonsense_is_refused_in_one_line(tmp_path, table, key, value, unit, says):
    with pytest.raises(InputError, match=says) as caught:
        load_engine(with_value(tmp_path, table, key, value, unit))
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 300


@pytest.mark.parametrize(
    ("table", "key"),
    [("cylinders", "piston_mass"), ("rod", "big_end_mass"), ("rod", "small_end_mass"), ("flywheel", "mass"),
     ("pulley", "mass"), ("damper", "mass"), ("block", "head_mass"), ("rod", "inertia")],
)  # fmt: skip
def test_grams_for_kilograms_are_doubted_and_the_shipped_engines_are_not(tmp_path, table, key):
    value = getattr(getattr(load_engine("diesel_i6"), table), key)
    for factor in (1000.0, 1e-3):
        with pytest.warns(UserWarning, match=rf"^diesel_i6: {table}\.{key}: .* usual .*; check its unit$"):
            load_engine(with_value(tmp_path, table, key, factor * value))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_engine("diesel_i6"), load_engine("diesel_v8")


def test_what_is_no_file_is_refused_in_one_line(tmp_path):
    for name in ("x" * 300 + ".toml", "\0.toml", str(tmp_path) + "/.toml", "/dev/zero.toml"):
        with pytest.raises(InputError, match=r"no such engine file|cannot be read|not a valid file name"):
            load_engine(name)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(bytes(range(256)))
    with pytest.raises(InputError, match="not text in UTF-8"):
        load_engine(binary)


def test_unknown_engine_and_table_name_the_nearest(tmp_path):
    with pytest.raises(InputError, match=r"unknown engine 'diesel_i7': did you mean 'diesel_i6'\?"):
        load_engine("diesel_i7")
    with pytest.raises(InputError, match=r"no such engine file"):
        load_engine(tmp_path / "none.toml")
    path = tmp_path / "own.toml"
    path.write_text(SOURCE.replace("[flywheel]", "[fly_wheel]"), encoding="utf-8")
    with pytest.raises(InputError, match=r"unknown table 'fly_wheel'; did you mean 'flywheel'\?"):
        load_engine(path)


def test_the_shipped_crankshaft_passes_its_own_check():
    check_crankshaft(load_engine("diesel_i6").crankshaft)


NEW = {
    "main_bearing": (
        "groove",
        "roughness",
        "asperity_factor",
        "asperity_ratio",
        "contact_modulus",
        "boundary_friction",
        "boundary_shear",
    ),
    "oil": (
        "law",
        "walther_temperatures",
        "walther_viscosities",
        "pressure_law",
        "pressure_viscosity",
        "compressibility",
        "heat_capacity",
        "heat_share",
    ),
}


def test_a_file_without_the_optional_keys_stays_valid(tmp_path):
    start = SOURCE.index("[big_end_bearing]")
    old = SOURCE[:start] + SOURCE[SOURCE.index("[thrust]") :]
    for table, keys in NEW.items():
        head, body = old.split(f"[{table}]\n")
        for key in keys:
            body = re.sub(rf"^{key} = .*\n", "", body, count=1, flags=re.MULTILINE)
        old = f"{head}[{table}]\n{body}"
    path = tmp_path / "own.toml"
    path.write_text(old, encoding="utf-8")
    engine, shipped = load_engine(path), load_engine("diesel_i6")
    assert engine.big_end_bearing is None
    # What the shipped file states and its defaults are the same surfaces.
    assert engine.main_bearing == shipped.main_bearing
    assert engine.oil.law == "vogel" and engine.oil.pressure_law == "none" and engine.oil.walther_viscosities == ()
    assert engine_from_dict(json.loads(json.dumps(engine_to_dict(engine)))) == engine
    # A flat model that knows nothing of them is read likewise.
    data = engine_to_dict(engine)
    del data["big_end_bearing"], data["main_bearing"]["roughness"]
    assert engine_from_dict(data) == engine


def test_each_law_of_viscosity_asks_for_its_own_keys(tmp_path):
    path = edited(tmp_path, "oil", "vogel_b", "")
    with pytest.raises(InputError, match=r"oil\.vogel_b: is missing; law vogel needs"):
        load_engine(path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace('law = { value = "vogel"', 'law = { value = "walther"'), encoding="utf-8")
    oil = load_engine(path).oil
    assert oil.law == "walther" and oil.walther_viscosities == pytest.approx((117.6e-6, 16.82e-6))
