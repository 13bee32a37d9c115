"""A model for other lumped data is the one whose bodies were made for them: array by array, on several engines."""

import re
from dataclasses import replace
from functools import cache

import entry
import numpy as np
import pytest
from box_block import box_block
from packed import NOT_OF_LUMPS, arrays, differences
from some import some

from cranktrain.core.errors import InputError
from cranktrain.dynamics.model.arrays import Parts, build_model
from cranktrain.dynamics.model.choices import run_numbers
from cranktrain.dynamics.model.lumped_data import lumped_numbers, lumped_values
from cranktrain.dynamics.model.preparation import prepare_model
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.time.status import CLEARANCE_FIXED, NO_RIGID_PART, OK
from cranktrain.engine.file import load_engine
from cranktrain.loads.damper import with_damper_housing
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.crank.level import bare_crank, running_crank

SPEED = 200.0
WHOLE_HZ = 1e6
"""Above all modes of a crank of beams: nothing is cut."""
RICH = {"big_ends": "impedance", "damper": "fitted", "boundary": "torque"}
FLEXIBLE = {"block": "flexible", "pistons": "guided"}
CASES = [
    ("diesel_i6", "rigid", {"bearings": "linear"}),
    ("diesel_i6", "rigid", {"bearings": "impedance", **RICH, **FLEXIBLE}),
    ("diesel_i6", "torsional", {"bearings": "held", "boundary": "torque"}),
    ("diesel_i6", "torsional", {"bearings": "impedance", "damper": "fitted"}),
    ("diesel_v8", "rigid", {"bearings": "roller", **RICH, **FLEXIBLE}),
    ("four_petrol", "torsional", {"bearings": "held"}),
    ("single_petrol", "rigid", {"bearings": "impedance", "big_ends": "impedance", "boundary": "torque"}),
    ("v_twin", "rigid", {"bearings": "impedance"}),
    ("four_petrol", "rigid", {"bearings": "linear", "boundary": "torque"}),
    ("v12_petrol", "torsional", {"bearings": "held"}),
    # Not balanced as a whole.
    ("single_petrol", "torsional", {"bearings": "held"}),
    ("v_twin", "torsional", {"bearings": "impedance"}),
    ("generator_four", "rigid", {"bearings": "impedance", "boundary": "torque"}),
]


@cache
def engine_of(name):
    engine = load_engine(name)
    reduction = replace(engine.reduction, running_cutoff_hz=WHOLE_HZ, torsional_source="ker-wilson")
    return replace(engine, reduction=reduction)


def changed(engine, values):
    """The engine with other values, a number of each mount by its name."""
    for name, value in values.items():
        table, key, number = re.fullmatch(r"(\w+)\.(\w+?)(?:\[(\d+)\])?", name).groups()
        part = getattr(engine, table)
        if number is not None:
            value = tuple(value if k == int(number) else one for k, one in enumerate(getattr(part, key), 1))
        engine = replace(engine, **{table: replace(part, **{key: value})})
    return engine


def others(engine):
    """Another value for each lumped value of an engine, all that go together as rigid parts."""
    factors = {"diametral_inertia": 1.3, "offset": 0.5, "vogel_a": 1.05, "vogel_b": 1.01, "vogel_c": 0.99}
    found = list(lumped_values(engine))
    return {one.name: one.value * factors.get(one.row.key, (1.2, 0.8, 1.1)[k % 3]) for k, one in enumerate(found)}


def alone(values):
    """Each value by itself; a smaller diametral inertia than that of a ring is none of a rigid part."""
    for name, value in values.items():
        more = name.replace("polar", "diametral")
        yield {name: value, more: values[more]} if name.endswith("polar_inertia") else {name: value}


def body_of(engine, base, level, levels):
    fitted = with_damper_housing(engine) if levels.get("damper") == "fitted" else engine
    return running_crank(fitted, level, bare_crank(base, level))


def model_of(engine, base, level, levels, data=None):
    parts = Parts(block=box_block(base) if levels.get("block") == "flexible" else None, data=data or {})
    settings = Settings(crank=level, **levels)
    body = body_of(engine, base, level, levels)
    return build_model(engine, body, settings, SPEED, GasTrace.from_engine(engine), parts)


@pytest.mark.parametrize(("name", "level", "levels"), CASES)
def test_lumped_data_make_the_model_that_an_engine_file_with_them_makes(name, level, levels):
    """All at once, on every array of the running model."""
    engine = engine_of(name)
    values = others(engine)
    wanted = model_of(changed(engine, values), engine, level, levels)
    assert differences(model_of(engine, engine, level, levels), wanted)
    assert differences(model_of(engine, engine, level, levels, values), wanted) == {}


@pytest.mark.parametrize(("name", "level", "levels"), [CASES[1], CASES[2], CASES[6]])
def test_each_of_them_does_so_by_itself(name, level, levels):
    engine = engine_of(name)
    values = {key: value for key, value in others(engine).items() if not re.search(r"\[[2-9]\]", key)}
    for one in some(alone(values)):
        wanted = model_of(changed(engine, one), engine, level, levels)
        assert differences(model_of(engine, engine, level, levels, one), wanted) == {}, one


def test_a_crank_that_bends_has_the_modes_of_its_new_masses():
    """Of beams, all modes kept, in films with a damper."""
    engine = load_engine("single_petrol")
    engine = replace(engine, reduction=replace(engine.reduction, running_cutoff_hz=WHOLE_HZ))
    values = {key: value for key, value in others(engine).items() if key.startswith(("flywheel", "pulley"))}
    levels = {"bearings": "impedance"}
    wanted = model_of(changed(engine, values), engine, "beam", levels)
    found = model_of(engine, engine, "beam", levels, values)
    assert differences(found, wanted) == {}
    crank = entry.modes(found, "crank").stop
    turning = entry.matrices(found, 1.0)[0] - entry.matrices(found)[0]
    assert np.abs(turning[:crank, :crank] + turning[:crank, :crank].T).max() < 2e-12


def test_a_crank_that_was_cut_takes_other_masses_in_its_own_modes():
    """Ritz: no mode of the cut crank lies below that of the whole one, and the first ones lie within 0.1 %."""
    engine = load_engine("diesel_i6")
    values = {"flywheel.mass": 40.0, "flywheel.polar_inertia": 0.8, "pulley.mass": 12.0, "pulley.polar_inertia": 0.06}
    levels = {"bearings": "impedance"}
    found = model_of(engine, engine, "beam", levels, values)
    whole = replace(engine, reduction=replace(engine.reduction, running_cutoff_hz=WHOLE_HZ))
    wanted = model_of(changed(whole, values), engine, "beam", levels)
    crank = entry.modes(found, "crank").stop
    assert crank < entry.modes(wanted, "crank").stop
    ours, theirs = (entry.own_frequencies(model)[6:crank] for model in (found, wanted))
    assert np.all(ours > theirs * (1.0 - 1e-9)) and np.all(ours[:10] < 1.001 * theirs[:10])


HEAVY_RIM = {"flywheel.polar_inertia": 2.1 * engine_of("diesel_i6").flywheel.diametral_inertia}


@pytest.mark.parametrize(
    ("levels", "cases"),
    [
        ({"bearings": "impedance", **RICH, **FLEXIBLE}, ((others(engine_of("diesel_i6")), OK, False), ({}, OK, True))),
        ({"bearings": "reynolds"}, (({"main_bearing.clearance": 50e-6}, CLEARANCE_FIXED, True),
                                    (HEAVY_RIM, NO_RIGID_PART, True))),
    ],
)  # fmt: skip
def test_preparing_again_leaves_nothing_behind_and_what_is_refused_changes_nothing(levels, cases):
    """To the bit: back to the engine's values, the model is that which was built."""
    engine, settings = engine_of("diesel_i6"), Settings(crank="rigid", **levels)
    model = model_of(engine, engine, "rigid", levels)
    before = {name: array.copy() for name, array in arrays(model, NOT_OF_LUMPS)}
    for data, status, same in some(cases):
        assert prepare_model(model, run_numbers(settings, engine, data), np.zeros(7), SPEED) == status
        assert same == all(np.array_equal(array, before[name]) for name, array in arrays(model, NOT_OF_LUMPS))


def test_names_and_ranges_are_those_of_the_engine_file():
    engine = engine_of("diesel_i6")
    assert all(one.low <= one.value <= one.high for one in lumped_values(engine))
    with pytest.raises(InputError, match=r"no value 'flywheel.mas' to change; did you mean 'flywheel.mass'"):
        lumped_numbers(engine, {"flywheel.mas": 1.0})
    with pytest.raises(InputError, match=r"'flywheel.mass' is -1; it must be a finite number, between 1e-06 and"):
        lumped_numbers(engine, {"flywheel.mass": -1.0})
    assert {one.name for one in lumped_values(engine)}.isdisjoint({"damper.stiffness", "clutch.mass"})
