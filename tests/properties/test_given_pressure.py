"""Cylinder pressures that a script gives: arrays as a file of the same numbers, functions, and what is refused."""

import math
import pickle
from types import SimpleNamespace

import numpy as np
import pytest

import cranktrain as ct
from cranktrain.core.errors import InputError
from cranktrain.loads.cylinder_volume import cylinder_volume
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.loads.pressure_map import read_gas

ENGINES = ("single_petrol", "v_twin", "four_petrol", "diesel_i6", "v12_petrol")
TORSION = {"crank": "torsional", "bearings": "held", "inherit": False, "cycles": 2, "load": 1.0}


def built_in(engine):
    """Angles (rad) and pressures (Pa) of the built-in trace."""
    trace = GasTrace.from_engine(engine)
    return trace.angles, trace.fired


def given(value, engine, *more):
    """Trace of a value at some speed."""
    return read_gas(value, engine, *more).at(300.0, 1.0)


def straight(angles, pressures):
    """The same as a function."""
    at, values = np.append(angles, 4.0 * math.pi), np.append(pressures, pressures[0])

    def pressure(angle):
        return np.interp(angle, at, values)

    return pressure


def written(path, angles, *columns):
    rows = zip(np.degrees(angles), *columns, strict=True)
    path.write_text("\n".join(",".join(repr(float(one)) for one in row) for row in rows), "utf-8")
    return path


@pytest.mark.parametrize("name", ENGINES)
def test_an_array_is_read_as_a_file_of_its_numbers(name, tmp_path):
    """To the bit, with noise on it, which both smooth."""
    engine = ct.load_engine(name)
    angles, pressures = built_in(engine)
    pressures = pressures * (1.0 + 1e-3 * np.random.default_rng(1).normal(size=pressures.size))
    file = read_gas(written(tmp_path / "p.csv", angles, pressures), engine, "Pa")
    for value in ((angles[::-1], pressures[::-1]), (angles, pressures if engine.n_cylinders > 1 else [pressures])):
        assert np.array_equal(read_gas(value, engine).fired, file.fired)
    np.testing.assert_allclose(read_gas(pressures, engine).fired, file.fired, rtol=1e-9)


@pytest.mark.parametrize("name", ENGINES)
def test_runs_of_a_file_an_array_and_a_function_agree(name, tmp_path):
    engine = ct.load_engine(name)
    angles, pressures = built_in(engine)
    file = written(tmp_path / "p.csv", angles, pressures)
    runs = [
        ct.simulate(engine, speed_rpm=3000, pressure=value, pressure_unit="Pa", **TORSION)
        for value in (str(file), pressures, straight(angles, pressures))
    ]
    for output in ("pulley.torsion", "shaft.torque"):
        first, *others = (np.asarray(run[output]) for run in runs)
        for other, close in zip(others, (1e-8, 1e-6), strict=True):
            assert np.abs(other - first).max() < close * np.std(first), output


def test_a_gas_that_only_compresses_and_expands_does_no_work():
    """p Vⁿ constant: the mean torque of a run is nothing beside its alternating part."""
    engine = ct.load_engine("single_petrol")
    angles, _ = built_in(engine)
    volume, _ = cylinder_volume(engine, angles)

    def adiabatic(angle):
        return 1e5 * (float(volume.max()) / np.interp(angle, angles, volume, period=4.0 * math.pi)) ** 1.35

    run = ct.simulate(engine, speed_rpm=3000, pressure=adiabatic, **{**TORSION, "cycles": 8})
    torque = np.asarray(run["shaft.torque"])[-run.per_cycle :]
    fired = ct.simulate(engine, speed_rpm=3000, **{**TORSION, "cycles": 8})["shaft.torque"][-run.per_cycle :]
    assert np.std(torque) > 1.0
    assert abs(run.gas.imep) < 1e-3 * abs(float(GasTrace.from_engine(engine).imep))
    assert abs(torque.mean()) < 0.02 * fired.mean()


def test_a_function_of_the_speed_is_that_of_each_run():
    engine = ct.load_engine("four_petrol")
    base = straight(*built_in(engine))

    def pressure(angle, speed):
        return base(angle) * speed / 300.0

    gas = read_gas(pressure, engine)
    for speed in (250.0, 300.0, 420.0):
        np.testing.assert_allclose(gas.at(speed, 1.0).fired, [base(x) * speed / 300.0 for x in gas.at(300.0, 1).angles])
    bare, levels = (
        engine.with_(connection=None, body=None, frame=None),
        {key: value for key, value in TORSION.items() if key != "cycles"},
    )
    run_up, one = (
        ct.runup(bare, from_rpm=first, to_rpm=3000, step_rpm=1000, method="linear", pressure=own, **levels)
        for first, own in ((2000, pressure), (3000, lambda angle: pressure(angle, 100.0 * math.pi)))
    )
    assert run_up["pulley.torsion", 2.0][-1] == pytest.approx(one["pulley.torsion", 2.0][-1], rel=1e-9)


@pytest.mark.parametrize("form", ["dict", "list", "array", "functions"])
def test_cylinders_have_their_own_pressures(form):
    """One of them motored: a quarter of the work of a four is that of a motored cylinder."""
    engine = ct.load_engine("four_petrol")
    angles, fired = built_in(engine)
    motored = GasTrace.from_engine(engine).motored
    rows = [fired, motored, fired, fired]
    functions = {k: straight(angles, row) for k, row in enumerate(rows, 1)}
    forms = {"dict": dict(enumerate(rows, 1)), "list": rows, "array": np.array(rows), "functions": functions}
    gas = given(forms[form], engine)
    whole, cold = (given(straight(angles, row), engine).imep for row in (fired, motored))
    assert gas.imep == pytest.approx(0.75 * whole + 0.25 * cold, rel=1e-6)
    for own, row in zip(gas.own, rows, strict=True):
        np.testing.assert_allclose(own.fired, row, rtol=1e-4)


def test_a_two_stroke_has_its_cycle_twice():
    engine = ct.load_engine("two_stroke_six")
    angles, fired = built_in(engine)
    half = fired.size // 2
    for value in (fired[:half], straight(angles, fired)):
        np.testing.assert_allclose(given(value, engine).fired, fired, rtol=1e-5)
    with pytest.raises(InputError, match="the cycle does not close; give one whole cycle of 360 deg"):
        read_gas(fired[: half // 2], engine)


def test_units_ends_and_what_an_assembly_or_another_process_takes():
    engine = ct.load_engine("single_petrol")
    angles, fired = built_in(engine)
    plain = read_gas(fired, engine).fired
    pint = pytest.importorskip("pint")
    registry = pint.UnitRegistry()
    quantity = registry.Quantity(1e-5 * fired, "bar")
    for value, unit in ((quantity, None), (1e-5 * fired, "bar"), (np.append(fired, fired[0]), None)):
        np.testing.assert_allclose(given(value, engine, unit).fired, plain, rtol=1e-9)
    pair = registry.Quantity(np.degrees(angles), "deg"), quantity
    np.testing.assert_allclose(given(pair, engine).fired, plain, rtol=1e-9)
    turned = np.roll(fired, 90)  # dead centre at 90 deg of the array
    np.testing.assert_allclose(read_gas(turned, engine, None, 90.0).fired, plain, rtol=1e-6)
    ahead = straight(angles, turned)
    np.testing.assert_allclose(given(ahead, engine, None, 90.0).fired, fired, rtol=1e-9)
    run = ct.simulate(engine, speed_rpm=3000, **TORSION)
    with pytest.raises(InputError, match="measures something else"):
        read_gas(run["shaft.torque"], engine)
    with pytest.raises(InputError, match="cannot go to another process; take workers=1"):
        pickle.dumps(read_gas(lambda angle: 2e6, engine))
    made = ct.assemble(engine, ct.Settings(crank="torsional", bearings="held"), inherit=False)
    one = ct.simulate(made, speed_rpm=3000, cycles=2, load=1.0, pressure=fired)
    np.testing.assert_array_equal(
        one["pulley.torsion"], ct.simulate(engine, speed_rpm=3000, pressure=fired, **TORSION)["pulley.torsion"]
    )


def jagged(angle):
    return 1e6 * (1.0 + angle)


def to(unit):
    """Of a quantity that is no pressure."""
    raise ValueError("Cannot convert from 'meter' to 'pascal'")


SINGLE = ct.load_engine("single_petrol")
FIRED = built_in(SINGLE)[1]
WRONG = [
    (FIRED[::40], "pressure: 18 points are too few"),
    (np.where(np.arange(720) == 3, np.nan, FIRED), r"pressure: value \[3\] is nan; give finite numbers"),
    (FIRED[:300], "the cycle does not close; give one whole cycle of 720 deg"),
    (1e-5 * FIRED, "a peak of .* Pa is no cylinder pressure of an engine"),
    (-FIRED, "pressure: value 0: pressure -.* is negative"),
    ([FIRED, FIRED], r"shape \(2, 720\) is neither one cycle \(n,\) nor one for each of the 1 cylinders"),
    ((np.arange(720.0), FIRED), "angles reach over 719 rad; give radians"),
    ((np.arange(4.0), FIRED), "4 angles for 720 values"),
    ({1: FIRED, 2: FIRED}, "pressure: is for cylinders 1, 2; give 1 to 1"),
    ({2: lambda a: 2e6}, "pressure: is for cylinders 2"),
    ([lambda a: 2e6] * 2, "pressure: 2 functions for 1 cylinders"),
    (object(), "is a object; give an array over one cycle"),
    (5.0, "pressure is 5.0, of type float; give a path, an array or a function"),
    (lambda a: "high", "at 0 deg the function returns 'high'; return one number, Pa"),
    (lambda a: math.nan, "at 0 deg the function returns nan"),
    (lambda a: 1 / 0, "at 0 deg the function raises ZeroDivisionError"),
    (lambda: 2e6, "at 0 deg the function raises TypeError"),
    (lambda a: 1e5, "a peak of 1e.05 Pa is no cylinder pressure"),
    (lambda a: 2e6 * math.cos(a), "Pa at .* deg; absolute pressures are positive"),
    (SimpleNamespace(to=to, magnitude=1.0), "pressure: Cannot convert from 'meter'"),
    (jagged, "so the cycle does not close; take the angle modulo 720 deg"),
]


@pytest.mark.parametrize(("value", "said"), WRONG)
def test_wrong_pressures_are_told_in_one_line(value, said):
    with pytest.raises(InputError, match=said) as caught:
        ct.simulate(SINGLE, speed_rpm=3000, pressure=value, **TORSION)
    assert "\n" not in str(caught.value) and str(caught.value).startswith("pressure")
