"""Numbers with their unit as texts, in engine, scene, harness and targets files and in tables: the same quantities."""

import math
import re
import tomllib
from dataclasses import fields, is_dataclass

import pytest
from jsonschema import Draft7Validator
from some import some

from cranktrain.core.text_table import read_table
from cranktrain.core.units import UNITS, base_powers, unit_factor
from cranktrain.engine.file import engine_path, load_engine
from cranktrain.engine.torsional_chain import read_chain
from cranktrain.studies.file_schemas import file_schema
from cranktrain.studies.scene import load_scene
from cranktrain_lab.calibration.targets import load_targets
from cranktrain_lab.coupling.unit import DIMENSIONS, Port
from cranktrain_lab.harness.file import load_harness
from cranktrain_lab.harness.measures import between

INCH, LBF = 0.0254, 0.45359237 * 9.80665
SPELLINGS = {
    "kN m/rad": ("torsional stiffness", 1e3), "kNm/rad": ("torsional stiffness", 1e3),
    "kg cm²": ("inertia", 1e-4), "kgcm2": ("inertia", 1e-4), "lbf·in·s²": ("inertia", LBF * INCH),
    "cm": ("length", 1e-2), "in": ("length", INCH), "µm": ("length", 1e-6), "μm": ("length", 1e-6),
    "rpm": ("speed", math.pi / 30.0), "1/min": ("speed", math.pi / 30.0), "°C": ("temperature", 1.0),
    "°F": ("temperature", 5.0 / 9.0), "psi": ("gauge pressure", LBF / INCH**2), "cP": ("viscosity", 1e-3),
    "mPas": ("viscosity", 1e-3), "cSt": ("kinematic viscosity", 1e-6), "N/mm": ("stiffness", 1e3),
}  # fmt: skip
"""Units that engineers write, what they measure, and their size in SI (BIPM, SI brochure; NIST SP 811)."""
ZERO = {"°C": 273.15, "°F": 273.15 - 32.0 * 5.0 / 9.0}
KEYS = {
    "torsional stiffness": ("stiffness", "N m/rad"), "inertia": ("polar_inertia", "kg m^2"), "length": ("length", "mm"),
    "speed": ("temperature_speeds", "rev/min"), "temperature": ("intake_temperature", "degC"),
    "gauge pressure": ("supply_pressure", "bar"), "viscosity": ("vogel_a", "mPa s"),
    "kinematic viscosity": ("walther_viscosities", "mm^2/s"), "stiffness": ("stiffness_x", "N/m"),
}  # fmt: skip
SIX = engine_path("diesel_i6").read_text("utf-8")
ENGINE = load_engine("diesel_i6")


def numbers(part):
    """All numbers of an engine, in order."""
    if is_dataclass(part):
        return [number for entry in fields(part) for number in numbers(getattr(part, entry.name))]
    if isinstance(part, tuple):
        return [number for entry in part for number in numbers(entry)]
    return [part] if isinstance(part, float | int) else []


def entry_of(dimension):
    """Text of an entry of the six, its value as TOML and its unit in SI."""
    key, unit = KEYS[dimension]
    found = re.search(rf'\n{key} = \{{ value = (\[[^\]]*\]|\S+), unit = "{re.escape(unit)}"', SIX)
    return key, found[0], tomllib.loads(f"x = {found[1]}")["x"], unit_factor(unit, dimension)


@pytest.mark.parametrize("unit", SPELLINGS)
def test_an_engine_takes_texts(tmp_path, unit):
    dimension, scale = SPELLINGS[unit]
    key, entry, value, own = entry_of(dimension)

    def text(number):
        return f"{(number * own.scale + own.zero - ZERO.get(unit, 0.0)) / scale!r} {unit}"

    texts = [text(one) for one in value] if isinstance(value, list) else text(value)
    path = tmp_path / "own.toml"
    written = SIX.replace(entry, f"\n{key} = {{ value = {texts!r}".replace("'", '"'), 1)
    path.write_text(written, "utf-8")
    assert numbers(load_engine(path)) == pytest.approx(numbers(ENGINE), rel=1e-12)
    assert Draft7Validator(file_schema("engine")).is_valid(tomllib.loads(written))


SCENE = """engine = "diesel_i6"
outputs = ["pulley.torsion"]
speeds_rpm = [{speed}]
frequency_hz = {frequency}
accuracy = {accuracy}
step_deg = {step}
load = {load}
cutoff_hz = {cutoff}
"""
PLAIN = {"speed": 2100, "frequency": 600, "accuracy": 0.01, "step": 0.5, "load": 0.8, "cutoff": 1200}


def scene(folder, **given):
    path = folder / "scene.toml"
    said = {key: repr(value).replace("'", '"') for key, value in (PLAIN | given).items()}
    path.write_text(SCENE.format(**said), "utf-8")
    return load_scene(path)


def test_a_scene_takes_texts(tmp_path):
    plain = scene(tmp_path)
    texts = [("speed", "35 rev/s"), ("speed", "2100 rpm"), ("speed", "2100 1/min"), ("frequency", "0.6 kHz"),
             ("accuracy", "1 %"), ("step", f"{math.pi / 360!r} rad"), ("load", "80 %"),
             ("cutoff", "1.2e3 1/s")]  # fmt: skip
    for key, value in texts:
        other = scene(tmp_path, **{key: value})
        for name in ("speeds", "frequency", "accuracy", "step", "load", "cutoff"):
            assert getattr(other, name) == pytest.approx(getattr(plain, name), rel=1e-12), (key, name)
    document = tomllib.loads((tmp_path / "scene.toml").read_text("utf-8"))
    assert Draft7Validator(file_schema("scene")).is_valid(document)


HARNESS = 'engine = "diesel_i6"\nvalvetrain = false\nspeed_rpm = "2000 1/min"\ncycles = 2\nstep_deg = "17.5 mrad"\n'


def harness(folder, text):
    path = folder / "harness.toml"
    path.write_text(f'{HARNESS}[[scenario]]\nname = "a"\n{text}', "utf-8")
    return load_harness(path)


@pytest.mark.parametrize("unit", SPELLINGS)
def test_a_harness_takes_texts(tmp_path, unit):
    """A value in a text is the value with its unit, in the unit of any variable of its dimension."""
    dimension, scale = SPELLINGS[unit]
    powers = base_powers(next(iter(UNITS[dimension])))
    port = Port("other", 2.0, 0.0, tuple(powers.get(name, 0) for name in DIMENSIONS))
    read = harness(tmp_path, f'step = [{{ input = "cranktrain.x", at_s = "10 ms", value = "20 {unit}" }}]')
    (change,) = read.scenarios[0].changes
    factor, shift = between(change.unit, port, "x")
    assert change.begin == pytest.approx(0.01)
    assert 2.0 * (factor * change.value + shift) == pytest.approx(20.0 * scale + ZERO.get(unit, 0.0), rel=1e-12)
    assert read.speed == pytest.approx(2000.0 * math.pi / 30.0)
    assert read.scenarios[0].way.steps.size == pytest.approx(0.0175 / read.speed)


def test_bounds_of_a_harness_may_have_units_of_their_own(tmp_path):
    """All in the unit of the first, or in that of the key; a tolerance has no zero."""
    text = """assert = [
        { output = "combustion.t", what = "final", expected = "20 °C", absolute = "9 °F" },
        { output = "combustion.p", what = "mean", least = "1 bar", most = "200 kPa" },
        { output = "combustion.p", what = "mean", least = "1 bar", most = 3e5, unit = "Pa" },
        { output = "combustion.p", what = "mean", expected = "1 bar", tolerance = "2 %" }]"""
    temperature, both, mixed, relative = (one for one in harness(tmp_path, text).scenarios[0].assertions)
    assert (temperature.unit, temperature.bounds.expected) == ("°C", 20.0)
    assert temperature.bounds.absolute == pytest.approx(5.0)
    assert (both.unit, both.bounds.least, both.bounds.most) == ("bar", 1.0, pytest.approx(2.0))
    assert (mixed.unit, mixed.bounds.least, mixed.bounds.most) == ("Pa", pytest.approx(1e5), 3e5)
    assert relative.bounds.relative == pytest.approx(0.02)


def test_targets_take_texts(tmp_path):
    path = tmp_path / "a.targets.toml"
    path.write_text(
        '[targets.first]\nshape = "torsional"\nhz = "0.155 kHz"\ntolerance = "2 %"\nsource = "a book"\n'
        '[parameters."rod.length"]\nlow = "8 in"\nhigh = "25 cm"\n', "utf-8"
    )  # fmt: skip
    found = load_targets(path, ENGINE)
    assert found.targets[0].hz == pytest.approx(155.0) and found.targets[0].tolerance == pytest.approx(0.02)
    (parameter,) = found.parameters
    assert (parameter.low, parameter.high) == (pytest.approx(8.0 * INCH), pytest.approx(0.25))


@pytest.mark.parametrize("unit", SPELLINGS)
@pytest.mark.parametrize("form", ["x [{}]", "x ({})", "x;{}"])
def test_tables_take_the_same_spellings(tmp_path, unit, form):
    dimension, scale = SPELLINGS[unit]
    path = tmp_path / "t.csv"
    head = f"t;x\ns;{unit}" if form == "x;{}" else f"t [s];{form.format(unit)}"
    path.write_text(f"{head}\n0;1\n1;2\n", "utf-8")
    found = read_table(path, "table", "give one").units[1]
    assert unit_factor(found, dimension)[:2] == (pytest.approx(scale, rel=1e-12), pytest.approx(ZERO.get(unit, 0.0)))


def test_a_drive_line_in_other_units_is_the_same(tmp_path):
    plain, other = tmp_path / "plain.csv", tmp_path / "other.csv"
    plain.write_text("disc,inertia,stiffness\na,0.5,2e5\nb,0.25,\n")
    inertia = [one / (LBF * INCH) for one in (0.5, 0.25)]
    other.write_text(
        f"disc;inertia [lbf·in·s²];stiffness [kN m/rad]\na;{inertia[0]!r};200\nb;{inertia[1]!r};\n", "utf-8"
    )
    for one, two in some(zip(numbers(read_chain(plain)), numbers(read_chain(other)), strict=True)):
        assert one == pytest.approx(two, rel=1e-12)
