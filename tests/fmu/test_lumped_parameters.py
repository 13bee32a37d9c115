"""Masses, stiffnesses, clearances, oil and dimensions as parameters: the FMU of another engine file without a build."""

import json
import math
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from coarse_engines import NATIVE, built
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from cranktrain.core.errors import InputError
from cranktrain.dynamics.model.lumped_data import lumped_values
from cranktrain.engine.file import load_engine
from cranktrain.fmu.build import build_fmu
from cranktrain.fmu.carried import carried_levels
from cranktrain.fmu.description import expand
from cranktrain.fmu.engine_fmu import engine_interface, family_counts, full_interface, start_settings, with_starts
from cranktrain.fmu.flat import FlatModel
from cranktrain.fmu.geometry import geometry, start_values, with_geometry
from cranktrain.loads.damper import with_damper_housing
from cranktrain.structure.crank.level import bare_crank, running_crank

RUN = """
parameters = json.loads(sys.argv[2])
unit = Unit(sys.argv[1])
unit.start({"speed": 150.0, **parameters}).run(150)
print(json.dumps({"names": unit.outputs, "bits": unit.bits()}))
"""
CASES = {
    "diesel_i6": ("torsional", {"damper.level": "fitted"}),
    "single_petrol": ("beam", {}),
    "v12_petrol": ("torsional", {"bearing.level": "impedance"}),
    "diesel_v8": ("rigid", {"bearing.level": "roller", "block.level": "ground", "damper.level": "fitted"}),
}
"""Of each engine the crank level that its FMU carries, and the levels of its runs: no finite elements are made."""


@cache
def base(name):
    """The engine with all modes of a crank from formulas or beams."""
    engine = replace(load_engine(name), block=None)
    reduction = replace(engine.reduction, running_cutoff_hz=1e6, torsional_source="ker-wilson")
    return replace(engine, reduction=reduction)


def flat(engine, level, bare):
    fitted = None if engine.damper is None else with_damper_housing(engine)
    damped = {} if fitted is None else {level: running_crank(fitted, level, bare)}
    return FlatModel(engine, {level: running_crank(engine, level, bare)}, damped)


def others(name):
    """Another value of each parameter; of main clearances those that a level follows."""
    factors = {"diametral_inertia": 1.3, "offset": 0.5, "vogel_a": 1.05, "vogel_b": 1.01, "vogel_c": 0.99}
    found = list(lumped_values(base(name)))
    return {one.name: one.value * factors.get(one.row.key, (1.2, 0.8, 1.1)[k % 3]) for k, one in enumerate(found)}


def with_values(engine, values):
    tables = {}
    for name, value in values.items():
        table, key = name.split(".")
        tables.setdefault(table, {})[key] = value
    return replace(engine, **{table: replace(getattr(engine, table), **own) for table, own in tables.items()})


@pytest.fixture(scope="module", params=list(CASES))
def case(request, tmp_path_factory):
    """Name of an engine, its native FMU, and that of the engine with other values."""
    name = request.param
    level, _ = CASES[name]
    bare = bare_crank(base(name), level)
    folder = tmp_path_factory.mktemp(name)
    try:
        own = built(flat(base(name), level, bare), folder / "own", NATIVE)
        other = built(flat(with_values(base(name), others(name)), level, bare), folder / "other", NATIVE)
    except InputError as error:
        pytest.skip(str(error))
    return name, own, other


def outputs(script, fmu, parameters):
    done = json.loads(script("import json\n" + RUN, fmu, json.dumps(parameters)).stdout)
    return done["names"], np.array([float.fromhex(bits) for bits in done["bits"]])


def levels_of(name):
    level, levels = CASES[name]
    return {"crank.level": level, **levels}


def test_parameters_give_what_a_rebuilt_fmu_gives(case, script):
    name, own, other = case
    names, found = outputs(script, own, levels_of(name) | others(name))
    _, wanted = outputs(script, other, levels_of(name))
    _, before = outputs(script, own, levels_of(name))
    counted = np.array([not re.match(r"solver\.", key) for key in names])
    assert not np.allclose(found[counted], before[counted], rtol=1e-3)
    size = np.maximum(np.abs(wanted), np.abs(before))
    far = counted & (np.abs(found - wanted) > 1e-6 * size + 1e-12)
    assert not far.any(), [(names[k], found[k], wanted[k]) for k in np.flatnonzero(far)]


def test_the_description_has_the_engine_files_values_and_the_ranges_of_its_checks(case):
    name, own, _ = case
    variables = {v.name: v for v in read_model_description(str(own)).modelVariables}
    assert validate_fmu(str(own)) == []
    for one in lumped_values(base(name)):
        variable = variables[one.name]
        assert float(variable.start) == one.value and (variable.causality, variable.variability) == (
            "parameter",
            "fixed",
        )
        assert (float(variable.min), float(variable.max)) == (one.low, one.high) and variable.unit == one.row.unit


def test_out_of_range_is_one_line_and_the_instance_goes_on(case, script):
    name, own, _ = case
    script(
        """
import json
levels = json.loads(sys.argv[2])
unit = Unit(sys.argv[1])
status, text = unit.refusal(lambda: unit.set_named("flywheel.mass", -3.0))
assert status == 3 and "'flywheel.mass' is -3" in text and "between 1e-06 and 100000" in text, (status, text)
unit.refuses(lambda: unit.set_named("rod.inertia", NAN), "'rod.inertia' is")
unit.start({"speed": 150.0, **levels})
unit.run(3)
unit.refuses(lambda: unit.set_named("flywheel.mass", 30.0), "fixed after initialization")
unit.fmu.reset()
unit.refuses(lambda: unit.start({"speed": 150.0, **levels, "flywheel.polar_inertia": 90.0}), "no rigid part")
""",
        own, json.dumps(levels_of(name)),
    )  # fmt: skip


def test_states_and_resets_carry_them(case, script):
    """A state taken under other values goes on in an instance that was started with the engine's own."""
    name, own, _ = case
    script(
        """
import json
levels, values = json.loads(sys.argv[2]), json.loads(sys.argv[3])
one, two = Unit(sys.argv[1]), Unit(sys.argv[1], "other")
one.start({"speed": 150.0, **levels, **values}).run(40)
kept = one.fmu.serializeFMUstate(one.fmu.getFMUState())
one.run(20, first=40)
two.start({"speed": 150.0, **levels}).run(7)
two.fmu.setFMUState(two.fmu.deSerializeFMUstate(kept))
assert two.get(*values) == list(values.values())
two.run(20, first=40)
assert one.bits() == two.bits()
two.fmu.reset()
plain = Unit(sys.argv[1], "plain").start({"speed": 150.0, **levels}).run(20)
assert two.start({"speed": 150.0, **levels}).run(20).bits() == plain.bits()
""",
        own, json.dumps(levels_of(name)), json.dumps(others(name)),
    )  # fmt: skip


def test_native_and_python_fmu_are_equal_to_the_bit(script, tmp_path):
    name = "single_petrol"
    level, _ = CASES[name]
    model = flat(base(name), level, bare_crank(base(name), level))
    chosen = levels_of(name) | others(name)
    _, native = outputs(script, built(model, tmp_path / "native", NATIVE), chosen)
    _, python = outputs(script, built(model, tmp_path / "python"), chosen)
    assert np.array_equal(native, python)


def test_clearances_that_films_were_made_for_stay(script, tmp_path):
    name = "single_petrol"
    model = flat(base(name), "rigid", bare_crank(base(name), "rigid"))
    script(
        """
unit = Unit(sys.argv[1])
parameters = {"crank.level": "rigid", "bearing.level": "reynolds", "main_bearing.clearance": 31e-6}
unit.refuses(lambda: unit.start(parameters), "were made for their clearance")
""",
        built(model, tmp_path, NATIVE),
    )


def test_a_build_chooses_where_its_fmu_starts(tmp_path):
    """Levels by name, their data carried; what does not exist or go together is one line before any work."""
    engine = load_engine("diesel_i6")
    interface = with_starts(engine_interface(engine), {"crank.level": "torsional", "flywheel.mass": "38"})
    starts = {v.name: v.start for v in interface.variables}
    assert starts["crank.level"] == "torsional" and starts["flywheel.mass"] == 38.0
    settings = start_settings(engine_interface(engine), engine, {"block.level": "flexible"})
    assert settings.block == "flexible" and "flexible" in carried_levels(engine, start=settings)
    for wrong, words in (
        ({"crank.level": "torsonal"}, "did you mean 'torsional'"),
        ({"crank.levels": "rigid"}, "did you mean 'crank.level'"),
        ({"flywheel.mass": "heavy"}, "between 1e-06 and 100000 kg"),
        ({"crank.level": "solid", "bearing.level": "held"}, "locks the axis"),
    ):
        with pytest.raises(InputError, match=re.escape(words)) as caught:
            build_fmu("diesel_i6", tmp_path, starts=wrong)
        assert "\n" not in str(caught.value) and not list(tmp_path.iterdir())


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
