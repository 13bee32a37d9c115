"""Dimensions as parameters: read by partners, settable where no body was made for them, refused elsewhere."""

import json
import math

import pytest

from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.fmu.description import expand
from cranktrain.fmu.engine_fmu import family_counts, full_interface
from cranktrain.fmu.geometry import geometry, start_values, with_geometry

NAMES = {"stroke": "geometry.stroke", "bore": "geometry.bore"}


def test_values_of_the_engine_change_nothing(engine):
    own = geometry(engine)
    own |= {f"firing_angles[{i + 1}]": angle for i, angle in enumerate(own.pop("firing_angles"))}
    written = {name: float(f"{value:.12g}") for name, value in own.items()}
    assert with_geometry(engine, {**written, "crank": "rigid"}, NAMES) == (engine, {"crank": "rigid"})


@pytest.mark.parametrize("name", ["stroke", "rod_length", "pin_offset", "firing_angles[3]"])
def test_what_a_body_was_made_for_is_refused_in_one_line(engine, name):
    with pytest.raises(InputError, match=r"crank and rods of this FMU were made for .*build_fmu.py$") as refused:
        with_geometry(engine, {name: 0.1234}, NAMES)
    assert NAMES.get(name, name) in str(refused.value) and "\n" not in str(refused.value)


def test_a_flexible_block_keeps_its_bore(engine):
    assert with_geometry(engine, {"bore": 0.11, "block": "ground"}, NAMES)[0].cylinders.bore == 0.11
    with pytest.raises(InputError, match=r"'geometry.bore' is 0.11, but the flexible block .* made for 0.105"):
        with_geometry(engine, {"bore": 0.11, "block": "flexible"}, NAMES)
    assert with_geometry(engine, {"bore": 0.11}, NAMES)[0].cylinders.bore == 0.11
    with pytest.raises(InputError, match=r"'geometry.bore' is 0.11, but the flexible block .* made for 0.12[;,]"):
        with_geometry(load_engine("diesel_v8"), {"bore": 0.11, "block": "auto"}, NAMES)


def test_a_family_that_is_expanded_again_keeps_its_starts(engine):
    """As the interface of a scene is, whose variables stand one by one."""
    counts, starts = family_counts(engine), start_values(engine)
    once = expand(full_interface().variables, counts, starts)
    assert expand(once, counts, starts) == once
    assert [v.start for v in once if v.name.endswith(".firing_angle")] == list(engine.firing_angles)


def test_bore_and_compression_ratio_act(engine, fmu, script):
    """Volume is that over the piston's place; and the torque its rate times the pressure, over the frame's speed."""
    done = script(
        """
import json
levels = {"crank.level": "rigid", "bearing.level": "linear", "gas.source": "input"}
read = [f"cylinder[2].{name}" for name in ("volume", "volume_rate", "piston_position")] + ["torque.indicated"]
found = []
for values in ({}, {"geometry.bore": 0.11}, {"geometry.compression_ratio": 15.0}):
    found.append(Unit(sys.argv[1]).start({**levels, **values, "cylinder[2].pressure": 5e6}).get(*read, "frame.speed"))
print(json.dumps(found))
unit = Unit(sys.argv[1])
unit.set_named("geometry.stroke", 0.13)
status, text = unit.refusal(lambda: unit.start(levels))
assert "'geometry.stroke' is 0.13, but crank and rods of this FMU were made for 0.12" in text, text
assert unit.get("geometry.rod_length")[0] > 0.1
""",
        fmu,
    )
    own, rod, throw = geometry(engine), engine.rod.length, engine.crankshaft.throw
    top, bottom = (math.sqrt((rod + sign * throw) ** 2 - own["pin_offset"] ** 2) for sign in (1.0, -1.0))
    sizes = [(own["bore"], own["compression_ratio"]), (0.11, own["compression_ratio"]), (own["bore"], 15.0)]
    for found, (bore, ratio) in zip(json.loads(done.stdout), sizes, strict=True):
        volume, rate, place, torque, speed = found
        area = 0.25 * math.pi * bore**2
        assert volume == pytest.approx(area * (place + (top - bottom) / (ratio - 1.0)), rel=1e-9)
        assert torque == pytest.approx((5e6 - 101325.0) * rate / speed, rel=1e-6) and abs(torque) > 100.0
