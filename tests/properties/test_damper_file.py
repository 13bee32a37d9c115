"""The table [damper] of an engine file: optional, and refused in one line where it describes no damper."""

import json
import re

import pytest

from cranktrain.core.errors import InputError
from cranktrain.engine.file import engine_path, load_engine
from cranktrain.engine.model import engine_from_dict, engine_to_dict

SOURCE = engine_path("diesel_i6").read_text(encoding="utf-8")
START = SOURCE.index("[damper]")
TABLE = SOURCE[START : SOURCE.index("\n[", START + 1) + 1]


def written(tmp_path, table):
    path = tmp_path / "own.toml"
    path.write_text(SOURCE.replace(TABLE, table), encoding="utf-8")
    return path


def with_value(key, value, unit=None, table=TABLE):
    line = re.search(rf"^{key} = .*$", table, re.MULTILINE).group()
    changed = re.sub(r"value = (\[.*?\]|[^,}]*[^,} ])", f"value = {value}", line, count=1)
    if unit:
        changed = re.sub(r'unit = ".*?"', f'unit = "{unit}"', changed)
    return table.replace(line, changed)


def without(*keys, table=TABLE):
    for key in keys:
        table = re.sub(rf"^{key} = .*\n", "", table, flags=re.MULTILINE)
    return table


def test_an_engine_without_damper_is_whole(tmp_path):
    engine = load_engine(written(tmp_path, ""))
    assert engine.damper is None
    assert engine_from_dict(json.loads(json.dumps(engine_to_dict(engine)))) == engine


def test_the_table_survives_json():
    engine = load_engine("diesel_i6")
    assert engine_from_dict(json.loads(json.dumps(engine_to_dict(engine)))) == engine
    assert engine.damper.power_limit == pytest.approx(5000.0)
    assert engine.damper.temperatures[0] == pytest.approx(273.15 + 65.0)


def test_each_kind_asks_only_for_its_own_keys(tmp_path):
    viscous = ("viscosity", "viscosity_slope", "critical_stress", "flow_exponent", "ring_outer_radius", "axial_gap")
    rubber = with_value("kind", '"rubber"', table=without(*viscous))
    assert load_engine(written(tmp_path, rubber)).damper.kind == "rubber"
    newtonian = with_value("law", '"newtonian"', table=without("critical_stress", "flow_exponent", "stiffness"))
    assert load_engine(written(tmp_path, newtonian)).damper.law == "newtonian"


@pytest.mark.parametrize(
    ("table", "says"),
    [
        (with_value("kind", '"viscose"'), r"damper\.kind: unknown kind 'viscose'; did you mean 'viscous'"),
        (with_value("law", '"shear"'), r"damper\.law: unknown law 'shear'"),
        (with_value("temperatures", "[65, 155]"), r"damper\.temperatures: 155 degC is hotter than .* law is valid"),
        (with_value("temperatures", "[-30, 90]"), r"damper\.temperatures: -30 degC is colder than .* law is valid"),
        (with_value("temperatures", "[90]"), r"damper\.temperatures: 1 temperatures for 2 speeds"),
        (with_value("temperature_speeds", "[2400, 1000]"), r"damper\.temperature_speeds: must increase"),
        (with_value("highest_temperature", -50), r"damper\.highest_temperature: is not above lowest_temperature"),
        (with_value("ambient_temperature", 150), r"damper\.ambient_temperature: is not below the highest"),
        (with_value("frequency", 0), r"damper\.frequency: 0 Hz is not within 0\.1 to 100000 Hz; give the"),
        (with_value("axial_gap", 40), r"damper\.axial_gap: 40 mm is no thin gap beside a ring 45 mm wide"),
        (with_value("ring_inner_radius", 130), r"damper\.ring_inner_radius: 130 mm is not less than ring_outer_radius"),
        (with_value("ring_inertia", 97.5), r"damper\.ring_inertia: .* steel of these radii .* has 0\.09\d+ kg m\^2"),
        (with_value("flow_exponent", 1.2), r"damper\.flow_exponent: 1\.2 is not within 0\.01 to 0\.99"),
        (with_value("viscosity", 97, "mm"), r"damper\.viscosity: unit 'mm' does not measure its viscosity"),
        (without("viscosity"), r"damper\.viscosity: is missing; a viscous damper of law shear-thinning needs it"),
        (without("critical_stress"), r"damper\.critical_stress: is missing"),
        (without("ring_inertia"), r"damper: key 'ring_inertia' is missing"),
        (
            with_value("kind", '"rubber"', table=without("loss_factor")),
            r"damper\.loss_factor: is missing; a rubber damper needs",
        ),
        (TABLE.replace("ring_width", "ring_widht"), r"damper: unknown key 'ring_widht'; did you mean 'ring_width'"),
    ],
)
def test_what_describes_no_damper_is_refused_in_one_line(tmp_path, table, says):
    assert table != TABLE
    with pytest.raises(InputError, match=says) as caught:
        load_engine(written(tmp_path, table))
    assert "\n" not in str(caught.value)
