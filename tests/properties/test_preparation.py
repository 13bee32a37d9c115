"""From parameters to the first step: preparation and start as kernels, against models built anew and plain formulas."""

import math
from dataclasses import replace
from functools import cache

import entry
import numpy as np
import pytest
from bodies import rigid_crank
from box_block import box_block
from packed import FROM_NUMBERS, arrays

from cranktrain.core.run_entries import RunEntries
from cranktrain.dynamics import run_record
from cranktrain.dynamics.model import numbers as number_slots
from cranktrain.dynamics.model.arrays import Parts, build_model
from cranktrain.dynamics.model.choices import run_numbers
from cranktrain.dynamics.model.preparation import prepare_model
from cranktrain.dynamics.model.settings import Settings, resolved
from cranktrain.dynamics.simulation import Simulation
from cranktrain.dynamics.time import status
from cranktrain.dynamics.time.integrators import INTEGRATORS
from cranktrain.engine.file import load_engine
from cranktrain.film.elastic.bore_compliance import BoreCompliance
from cranktrain.film.table.database import bearing_settings
from cranktrain.fmu.flat import FlatModel
from cranktrain.fmu.running import chosen_levels
from cranktrain.loads.damper import with_damper_housing
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.store.film_tables import film_table

RPM = math.pi / 30
COLD, WARM = 900 * RPM, 2300 * RPM
FLEXIBLE = {"block": "flexible", "pistons": "guided"}
LEVELS = [
    ("diesel_i6", {"bearings": "held"}),
    ("diesel_i6", {"bearings": "linear"}),
    ("diesel_i6", {"bearings": "impedance", "big_ends": "impedance", "damper": "fitted", **FLEXIBLE}),
    ("diesel_i6", {"bearings": "table", "pistons": "guided", "boundary": "torque"}),
    ("diesel_i6", {"bearings": "reynolds", "damper": "fitted"}),
    ("diesel_i6", {"bearings": "ehd"}),
    ("diesel_v8", {"bearings": "linear", "damper": "fitted"}),
    ("diesel_v8", {"bearings": "roller", "big_ends": "impedance", "boundary": "torque", **FLEXIBLE}),
]
"""Every level of bearings, big ends, damper, block, pistons and boundary on an engine that has it."""
OTHER = {
    "gas_load": 0.6, "crankcase_pressure": 1.1e5, "gravity": 3.7, "step": math.radians(1.5), "integrator": "esdirk4",
    "control": "adaptive", "tolerance": 2e-3, "gas_delay": 1.0, "reconstruction": "linear", "oil_temperature": 351.0,
    "damper_temperature": 341.0,
}  # fmt: skip


@cache
def engine_of(name):
    """An engine whose oil thickens under pressure, without an axial path: the formulas of these tests have none."""
    engine = replace(load_engine(name), axial_path=None)
    return replace(engine, oil=replace(engine.oil, pressure_law="roelands", compressibility="dowson-higginson"))


@cache
def parts_of(name):
    engine = engine_of(name)
    if engine.main_bearing is None:
        return Parts(block=box_block(engine))
    # A bore that gives way in two waves around: enough to have shapes.
    shares = np.zeros((2, 7, 3))
    shares[0, 3, 0] = shares[1, 4, 0] = 1.0
    area = math.pi * engine.main_bearing.diameter * engine.main_bearing.width
    bore = BoreCompliance(shares, np.array([2e-10, 1e-10]), np.zeros((2, 4)), np.array([0.6, 1.0]), area)
    table = film_table(bearing_settings(engine.main_bearing, "coarse", tilt=True))[0]
    return Parts(table=table, bore=bore, block=box_block(engine))


def other_engine(name, levels):
    """The engine with another compression ratio and, where no block was made round it, another bore."""
    engine = engine_of(name)
    bore = engine.cylinders.bore * (1.0 if levels.get("block") == "flexible" else 1.03)
    return replace(engine, cylinders=replace(engine.cylinders, bore=bore, compression_ratio=15.5))


def body_of(name, levels):
    engine = engine_of(name)
    return rigid_crank(with_damper_housing(engine) if levels.get("damper") == "fitted" else engine)


def model_of(name, levels, speed, temperatures=None, engine=None, gas=None, **chosen):
    engine = engine or engine_of(name)
    settings, gas = Settings(crank="rigid", **levels, **chosen), gas or GasTrace.from_engine(engine)
    return build_model(engine, body_of(name, levels), settings, speed, gas, parts_of(name), temperatures)


@pytest.mark.parametrize(("name", "levels"), LEVELS)
def test_a_model_prepared_again_is_the_one_built_for_these_numbers(name, levels):
    """To the bit, whatever it was prepared for before: nothing of temperature, speed or parameters stays behind."""
    engine = other_engine(name, levels)
    films = np.linspace(360.0, 380.0, len(engine.crankshaft.main_widths))
    cold, own = model_of(name, levels, COLD), model_of(name, levels, WARM, films, engine, **OTHER)
    changed = [key for (key, a), (_, b) in zip(arrays(cold), arrays(own), strict=True) if not np.array_equal(a, b)]
    assert set(changed) >= FROM_NUMBERS
    numbers = run_numbers(Settings(crank="rigid", **levels, **OTHER), engine)
    assert prepare_model(cold, numbers, films, WARM) == status.OK
    for (key, found), (_, wanted) in zip(arrays(cold), arrays(own), strict=True):
        assert np.array_equal(found, wanted), key


@pytest.mark.parametrize(("name", "levels"), LEVELS)
def test_what_settings_leave_open_is_resolved_as_settings_resolve_it(name, levels):
    engine = engine_of(name)
    for chosen in ({}, {"reconstruction": "hold"}, {"integrator": "generalised-alpha"}):
        left = Settings(crank="rigid", **levels, **chosen)
        model = model_of(name, levels, WARM, **chosen)
        before = [array.copy() for _, array in arrays(model)]
        assert run_numbers(left, engine)[number_slots.SET_METHOD] == (-1 if not chosen.get("integrator") else 3)
        assert prepare_model(model, run_numbers(left, engine), np.zeros(len(engine.crankshaft.main_widths)), WARM) == 0
        for (key, found), wanted in zip(arrays(model), before, strict=True):
            assert np.array_equal(found, wanted), key
        assert resolved(left, engine).integrator in INTEGRATORS


@pytest.mark.parametrize(("name", "levels"), LEVELS)
def test_a_run_by_its_record_is_the_simulation(name, levels):
    """Prepared and started twice, for other numbers first: outputs are those of a new simulation, bit by bit."""
    engine, other, parts = engine_of(name), other_engine(name, levels), parts_of(name)
    body, chosen = body_of(name, levels), {key: OTHER[key] for key in ("gas_load", "gravity", "oil_temperature")}
    settings = Settings(crank="rigid", **levels, **chosen)
    run = run_record.make_run(engine, body, Settings(crank="rigid", **levels), GasTrace.from_engine(engine), parts)
    left = number_slots.SET_METHOD, number_slots.SET_NEWTON_TOLERANCE, number_slots.SET_STEP
    assert run.numbers[list(left)].tolist() == [-1.0, 0.0, 0.0]
    entries = RunEntries("cranktrain", run, run_record)
    run.inputs[0] = COLD
    assert entries.prepare() == entries.start(0.0) == entries.advance(1e-4) == status.OK
    run.inputs[0] = WARM
    run.numbers[:] = run_numbers(settings, other)
    assert entries.prepare() == entries.start(2.0) == entries.observe() == status.OK
    simulation = Simulation(other, body, settings, parts=parts)
    simulation.inputs[0] = WARM
    simulation.initialize(2.0)
    assert np.array_equal(run.outputs.values, simulation.outputs)
    for k in range(3):
        assert entries.advance(2.0 + (k + 1) * 1e-4) == status.OK
        simulation.step(2.0 + (k + 1) * 1e-4)
        assert np.array_equal(run.outputs.values, simulation.outputs)
        assert np.array_equal(run.state, simulation.state)


def test_what_cannot_be_prepared_is_refused_and_changes_nothing():
    name, levels = LEVELS[2]
    engine = engine_of(name)
    model, good = model_of(name, levels, WARM), run_numbers(Settings(crank="rigid", **levels), engine_of(name))
    before = [array.copy() for _, array in arrays(model)]
    bdf2 = float(list(INTEGRATORS).index("bdf2"))
    films = np.zeros(len(engine.crankshaft.main_widths))
    for changes, expected in (
        ({number_slots.SET_STEP: 0.5 * number_slots.LEAST_STEP}, status.STEP_RANGE),
        ({number_slots.SET_STEP: -0.01}, status.STEP_RANGE),
        ({number_slots.SET_STEP: math.inf}, status.STEP_RANGE),
        ({number_slots.SET_GAS_DELAY: 2.5}, status.DELAY_RANGE),
        ({number_slots.SET_GAS_DELAY: math.nan}, status.DELAY_RANGE),
        ({number_slots.SET_WORK_LIMIT: -1.0}, status.LIMIT_RANGE),
        ({number_slots.SET_WORK_LIMIT: math.nan}, status.LIMIT_RANGE),
        ({number_slots.SET_METHOD: 99.0}, status.UNKNOWN_METHOD),
        ({number_slots.SET_METHOD: bdf2, number_slots.SET_ADAPTIVE: 1.0}, status.NOT_EMBEDDED),
        ({number_slots.SET_TOLERANCE: 2.0, number_slots.SET_ADAPTIVE: 1.0}, status.TOLERANCE_RANGE),
        ({number_slots.SET_BORE: 0.9 * good[number_slots.SET_BORE]}, status.BORE_FIXED),
        ({number_slots.SET_OIL_TEMPERATURE: 100.0}, status.OIL_RANGE),
        ({number_slots.SET_DAMPER_TEMPERATURE: 500.0}, status.DAMPER_RANGE),
    ):
        numbers = good.copy()
        for slot, number in changes.items():
            numbers[slot] = number
        assert prepare_model(model, numbers, films, WARM) == expected, changes
        for (key, found), wanted in zip(arrays(model), before, strict=True):
            assert np.array_equal(found, wanted), key
    assert prepare_model(model, good, np.full_like(films, 100.0), WARM) == status.OIL_RANGE
    # Of a model with elastic films, whose peaks a method loses.
    lost = good.copy()
    lost[number_slots.SET_METHOD] = bdf2
    entry.lose_peaks(model, "bdf2", True)
    assert prepare_model(model, lost, films, WARM) == status.PEAKS_LOST
    entry.lose_peaks(model, "bdf2", False)
    texts = status.statuses(("speed", "cylinder[1].pressure"))
    assert all(texts[code][0] == status.REFUSED and texts[code][1] for code in status.REFUSALS)
    assert texts[status.INPUT_NEGATIVE + 1] == (status.REFUSED, "cylinder[1].pressure must not be negative")


def test_a_trace_that_is_given_stays():
    """It cannot be made anew for another bore; the built-in one can."""
    name, levels = "diesel_i6", {"bearings": "linear"}
    given = replace(GasTrace.from_engine(engine_of(name)), source="measured")
    model, films = model_of(name, levels, WARM, gas=given), np.zeros(7)
    numbers = run_numbers(Settings(crank="rigid", **levels), engine_of(name))
    assert prepare_model(model, numbers, films, WARM) == status.OK
    for slot in (number_slots.SET_BORE, number_slots.SET_COMPRESSION):
        numbers[slot] *= 1.0 + 1e-12  # as a text would write it
        assert prepare_model(model, numbers, films, WARM) == status.OK
        numbers[slot] *= 1.01
        assert prepare_model(model, numbers, films, WARM) == status.TRACE_FIXED
        numbers[slot] /= 1.01


def test_oil_too_thin_for_its_law_is_refused():
    name, levels = "diesel_i6", {"bearings": "ehd"}
    engine = engine_of(name)
    model, numbers = model_of(name, levels, WARM), run_numbers(Settings(crank="rigid", **levels), engine_of(name))
    numbers[number_slots.SET_VOGEL_A] *= 1e-3
    assert prepare_model(model, numbers, np.zeros(len(engine.crankshaft.main_widths)), WARM) == status.THIN_OIL


def test_a_driver_is_told_of_inputs_and_steps_that_no_run_has():
    engine, levels = engine_of("diesel_i6"), {"bearings": "linear"}
    settings = Settings(crank="rigid", **levels)
    run = run_record.make_run(engine, body_of("diesel_i6", levels), settings, GasTrace.from_engine(engine), Parts())
    run.inputs[0] = WARM
    entries = RunEntries("cranktrain", run, run_record)
    assert entries.prepare() == entries.start(0.0) == status.OK
    before = run.state.copy()
    for place, value, expected in (
        (0, -1.0, status.INPUT_NEGATIVE),
        (0, math.nan, status.INPUT_NOT_FINITE),
        (6, -1.0, status.INPUT_NEGATIVE + 6),
        (9, math.inf, status.INPUT_NOT_FINITE + 9),
    ):
        kept = run.inputs[place]
        run.inputs[place] = value
        assert entries.advance(1e-4) == entries.start(0.0) == expected
        run.inputs[place] = kept
    for t_end in (0.0, -1.0, 1.5, math.nan):
        assert entries.advance(t_end) == status.NOT_AHEAD
    assert np.array_equal(run.state, before)
    run.inputs[7:9] = -1.0  # torques have a sign
    assert entries.advance(1e-4) == status.OK


def plain_start(model, engine, body, speed):
    """Start of a rigid crank by numpy: wind-up, torque, rotation, rate, inertia; spectrum and frequencies.

    Floating big ends are bodies of their own, whose mass the estimate leaves to them.
    """
    torque = entry.rigid_torque(model, speed, 720)
    k, c = engine.drive_line.stiffness, engine.drive_line.damping
    inertia = 1.0 / body.shapes[body.index("pulley"), 5, 5] ** 2
    for rod, throw in zip(engine.rods, engine.throws, strict=True):
        inertia += 0.5 * (rod.small_end_mass + engine.cylinders.piston_mass) * throw**2
    spectrum = np.fft.rfft(torque - torque.mean()) / torque.size
    omega = 0.5 * speed * np.arange(spectrum.size)
    motion = spectrum / (k - inertia * omega**2 + 1j * c * omega)
    rotation, rate = 2.0 * motion.sum().real, 2.0 * (1j * omega * motion).sum().real
    return (torque.mean() / k, torque.mean(), rotation, rate, inertia), spectrum[1:], omega[1:]


def plain_leaning(engine, block, torque, spectrum, omega):
    """Motion of the block that leans and rocks as a rigid body, (n_b,) each, by numpy."""
    at = [block.index(f"bore[{i + 1}]") for i in range(len(engine.crankshaft.main_widths))]
    load = -block.shapes[at, 5].mean(axis=0)
    held = [block.shapes[block.index(f"mount[{i + 1}]")] for i in range(len(engine.mounts.x))]
    stiffness, damping = (
        sum(shape.T @ np.diag(values) @ shape for shape, values in zip(held, of_mounts, strict=True))
        for of_mounts in (engine.mounts.stiffness, engine.mounts.damping)
    )
    place, rate = np.zeros((2, block.n_modes))
    k, c = stiffness[:6, :6], damping[:6, :6]
    place[:6] = np.linalg.solve(k, torque * load[:6])
    for part, w in zip(spectrum[: entry.ORDERS], omega[: entry.ORDERS], strict=True):
        motion = np.linalg.solve(k + 1j * w * c - w**2 * np.eye(6), 2.0 * part * load[:6])
        place[:6] += motion.real
        rate[:6] += (1j * w * motion).real
    return place, rate


def plain_carried(model, engine, crank, block, moved):
    """Motion of all modes that go along with the block's, (n_b,), by numpy."""
    q, mains = np.zeros(entry.mode_count(model)), len(engine.crankshaft.main_widths)
    q[entry.modes(model, "block")] = moved
    joined = [f"main[{i + 1}]" for i in range(mains)] + ["thrust"]
    turning, standing = (np.vstack([entry.shapes(model, name, side) for name in joined]) for side in ("crank", "block"))
    q[:5] = np.linalg.lstsq(turning[:, :5], standing @ moved, rcond=None)[0]
    mass, guidance = engine.cylinders.piston_mass, engine.piston_guidance
    for c, rod in enumerate(engine.rods):
        pin, aside = crank.shapes[crank.index(f"pin[{engine.cylinders.pins[c]}]")], engine.rod_offsets[c]
        follows = np.array([pin[0] + aside * pin[4], pin[1] - aside * pin[3]])[:, :5] @ q[:5]
        q[entry.modes(model, f"rod[{c + 1}]")] = math.sqrt(rod.big_end_mass) * follows
        across = np.array([math.cos(engine.cylinders.bank_angles[c]), math.sin(engine.cylinders.bank_angles[c])])
        rings = [block.shapes[block.index(f"liner[{c + 1}].{end}"), :2] for end in ("upper", "lower")]
        # Pin and piston as one rigid body, by displacement across at the pin and rotation.
        lever = mass * guidance.mass_height
        inertia = guidance.tilt_inertia + mass * guidance.mass_height**2
        matrix = np.array([[rod.small_end_mass + mass, -lever], [-lever, inertia]])
        own = np.linalg.cholesky(matrix).T @ [0.5 * across @ (rings[0] + rings[1]) @ moved, 0.0]
        q[entry.modes(model, f"piston[{c + 1}]")] = own
    return q


@pytest.mark.parametrize("name", ["diesel_i6", "diesel_v8"])
def test_the_start_is_that_of_plain_formulas(name):
    """Direct sums and small systems of the kernels against numpy's transform, solver and least squares."""
    levels = {"big_ends": "impedance", **FLEXIBLE}
    model, engine, block = model_of(name, levels, WARM), engine_of(name), parts_of(name).block
    crank = body_of(name, levels)
    expected, spectrum, omega = plain_start(model, engine, crank, WARM)
    assert np.allclose(entry.rigid_start(model, WARM), expected, rtol=1e-12, atol=0.0)
    for found, moved in zip(
        entry.leaning(model, WARM), plain_leaning(engine, block, expected[1], spectrum, omega), strict=True
    ):
        wanted = plain_carried(model, engine, crank, block, moved)
        assert np.abs(found - wanted).max() < 1e-12 * np.abs(found).max()
    unit = np.eye(block.n_modes)[3]
    assert np.abs(entry.carried(model, unit) - plain_carried(model, engine, crank, block, unit)).max() < 1e-12


def test_levels_of_an_fmu_leave_open_what_its_parameters_may_choose():
    """Else a Newton tolerance would be that of another integrator than the one that is chosen with the parameters."""
    engine = engine_of("diesel_i6")
    model = FlatModel(engine, {"rigid": rigid_crank(engine)}, {})
    chosen = chosen_levels(model, {"crank": "rigid", "bearings": "impedance"}, {})
    numbers = run_numbers(chosen.settings, chosen.engine)
    assert numbers[number_slots.SET_METHOD] == -1 and numbers[number_slots.SET_NEWTON_TOLERANCE] == 0.0
