"""Runs of modules as a library without Python runs them: numbers, ``prepare``, ``start``, ``advance_run``; statuses."""

import math
import re
import tomllib
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from refusals import refused_files

from cranktrain.core.errors import InputError, SolverError
from cranktrain.fmu.description import expand, read_interface
from cranktrain.fmu.module_fmu import DESCRIPTION
from cranktrain.modules import crank_angle as crank
from cranktrain.modules.combustion import gas, slots
from cranktrain.modules.combustion.run_record import CYLINDER_FAILED
from cranktrain.modules.combustion.simulation import CombustionSimulation
from cranktrain.modules.module_settings import with_chosen
from cranktrain.modules.register import MODULES, module_files
from cranktrain.modules.statuses import FAILED, REFUSED
from cranktrain.modules.valve_train import slots as train_slots
from cranktrain.modules.valve_train.cam import cam_lift
from cranktrain.modules.valve_train.simulation import ValveTrainSimulation

SIMULATIONS = {"combustion": CombustionSimulation, "valvetrain": ValveTrainSimulation}
OTHERS = tomllib.loads((Path(__file__).parents[1] / "data" / "module_parameters.toml").read_text("utf-8"))
SPEED = 2000.0 * math.pi / 30.0
CASES = [(module, engine) for module in SIMULATIONS for engine in ("i6", "v8")]
CASES.append(("combustion", "four"))  # spark ignition


def parts_of(module):
    """Settings, run record and interface of a module."""
    package = f"cranktrain.modules.{MODULES[module].folder.name}"
    names = {name: import_module(f"{package}.{name}") for name in ("file", "settings", "run_record", "simulation")}
    return SimpleNamespace(**names)


def shipped(module, engine):
    return parts_of(module).file.load(module_files()[f"{module}_{engine}"])


def variables(module, settings):
    interface = read_interface(MODULES[module].folder, DESCRIPTION).of(getattr(settings, "variant", ""))
    return expand(interface.variables, {"cylinders": len(settings.firing_angles)}, vars(settings))


def set_parameters(run, interface, chosen):
    """Write parameters into a run's numbers as an FMU without Python does."""
    for name, value in chosen.items():
        number = interface.choices[name][value] if name in interface.choices else value
        run.numbers[interface.numbers.index(name)] = number


def arrays(record, path=""):
    """Arrays of a nested record by their paths."""
    if isinstance(record, tuple):
        return {k: v for name in record._fields for k, v in arrays(getattr(record, name), f"{path}.{name}").items()}
    return {path[1:]: record}


def same(a, b):
    a, b = arrays(a), arrays(b)
    return [name for name in a if a[name].dtype.names is None and not np.array_equal(a[name], b[name])]


@pytest.mark.parametrize(("module", "engine"), CASES)
def test_the_interface_is_that_of_the_fmu(module, engine):
    """Inputs, outputs, parameters and choices of the run are those of interface.toml; all parameters are tried here."""
    settings = shipped(module, engine)
    parts, known = parts_of(module), variables(module, settings)
    interface, run = parts.simulation.native_interface(settings), parts.settings.make_run(settings)
    for causality in ("input", "output"):
        names, array = (getattr(record, f"{causality}s") for record in (interface, run))
        assert sorted(names) == sorted(v.name for v in known if v.causality == causality)
        assert len(names) == array.size
    for variable in known:
        if variable.causality == "parameter":
            assert variable.setting.startswith("firing_angles[") or variable.setting in OTHERS[module]
            number = run.numbers[interface.numbers.index(variable.setting)]
            if variable.choices:
                values = interface.choices[variable.setting]
                assert sorted(values) == sorted(variable.choices) and values[variable.start] == number
            else:
                assert number == variable.start
    assert len(interface.numbers) == run.numbers.size
    assert set(interface.constant) <= set(arrays(run))


@pytest.mark.parametrize(("module", "engine"), CASES)
def test_a_run_prepared_for_other_parameters_is_one_made_for_them(module, engine):
    """Model and run to the bit; arrays that are called constant stay the very same, and there and back leads home."""
    settings, parts = shipped(module, engine), parts_of(module)
    interface, chosen = parts.simulation.native_interface(settings), OTHERS[module]
    run, home = (parts.settings.make_run(settings) for _ in range(2))
    other = parts.settings.make_run(with_chosen(settings, chosen))
    set_parameters(run, interface, chosen)
    assert same(run.model, other.model) and parts.run_record.prepare(run) == 0
    assert same(run.model, other.model) == [] and np.array_equal(run.numbers, other.numbers)
    expected = SIMULATIONS[module](with_chosen(settings, chosen))
    expected.inputs[0] = run.inputs[0] = SPEED
    expected.initialize(0.5)
    assert parts.run_record.start(run, 0.5) == 0
    for k in range(200):
        expected.step(0.5 + 1e-4 * (k + 1))
        assert parts.run_record.advance_run(run, 0.5 + 1e-4 * (k + 1)) == 0
        assert np.array_equal(run.outputs, expected.outputs)
    assert np.array_equal(run.state, expected.state)
    run.outputs[:] = 0.0
    assert parts.run_record.observe_run(run) == 0 and np.array_equal(run.outputs, expected.outputs)
    run.numbers[:] = home.numbers
    assert parts.run_record.prepare(run) == 0 and same(run.model, home.model) == []
    for name in interface.constant:
        assert np.array_equal(arrays(run)[name], arrays(home)[name])


REFUSED_NUMBERS = refused_files()["modules"]["numbers"]


def test_every_status_of_numbers_is_met_here():
    """Two kinds of statuses have their own tests: numbers that are none, and choices that are not known."""
    for module in SIMULATIONS:
        known = parts_of(module).simulation.native_interface(shipped(module, "i6")).statuses
        met = {status_of(module, status) for name, _, status, _ in REFUSED_NUMBERS if name == module}
        assert met == {code for code in known if 20 <= code < 100}


def status_of(module, name):
    preparation = import_module(f"{parts_of(module).settings.__package__}.preparation")
    name, _, more = name.partition("+")
    return getattr(preparation, name) + int(more or 0)


@pytest.mark.parametrize(("module", "chosen", "status", "words"), REFUSED_NUMBERS)
def test_numbers_are_refused_alike_by_status_and_by_error(module, chosen, status, words):
    settings, parts = shipped(module, "i6"), parts_of(module)
    code = status_of(module, status)
    interface, run = parts.simulation.native_interface(settings), parts.settings.make_run(settings)
    before = {name: array.copy() for name, array in arrays(run.model).items()}
    set_parameters(run, interface, chosen)
    assert parts.run_record.prepare(run) == code
    assert all(np.array_equal(before[name], array) for name, array in arrays(run.model).items() if name != "mark")
    kind, text = interface.statuses[code]
    assert kind == REFUSED
    with pytest.raises(InputError, match=re.escape(words)) as refused:
        SIMULATIONS[module](with_chosen(settings, chosen))
    # Native, a text has no values; it says the same beside them.
    said, told = (re.findall("[a-z]+", line) for line in (text, str(refused.value)))
    assert said[0] == told[0] and len(set(said) & set(told)) >= 0.6 * len(set(told))


@pytest.mark.parametrize("module", SIMULATIONS)
def test_numbers_that_are_none_and_choices_that_are_not_known(module):
    settings, parts = shipped(module, "i6"), parts_of(module)
    names = {"inputs_at": "inputs.at", "tolerance": "solver.tolerance"}
    interface = parts.simulation.native_interface(settings, names)
    run = parts.settings.make_run(settings)
    for slot, name in enumerate(interface.numbers):
        kept = run.numbers[slot]
        run.numbers[slot] = math.nan
        code = parts.run_record.prepare(run)
        assert code == crank.NUMBER_NOT_FINITE + slot
        called = f"'{names[name]}'" if name in names else name
        assert interface.statuses[code] == (REFUSED, f"{called} must be a finite number")
        for value in (-1.0, 0.5, 7.0) if name in interface.choices else ():
            run.numbers[slot] = value
            code = parts.run_record.prepare(run)
            assert code == crank.UNKNOWN_CHOICE + slot
            assert interface.statuses[code][1].endswith("valid: " + ", ".join(interface.choices[name]))
        run.numbers[slot] = kept
    for chosen, words in (
        ({"firing_angles": (0.0, math.nan)}, "firing_angles[2] is nan; it must be a finite number"),
        ({"tolerance": math.inf}, "tolerance is inf; it must be a finite number"),
        ({"inputs_at": "middle"}, "inputs_at 'middle' is not known"),
    ):
        with pytest.raises(InputError, match=re.escape(words)):
            SIMULATIONS[module](replace(settings, **chosen))


REFUSED_STEPS = [
    (crank.NOT_AHEAD, {}, 0.0, "a step from 0.0001 s to 0 s; it must go forward, by 1 s at most"),
    (crank.NOT_AHEAD, {}, 2.0, "a step from 0.0001 s to 2 s; it must go forward"),
    (crank.JUMPS, {1: 3.0}, 2e-4, "crank.angle is 171.9 deg at 0.0001 s, 169 deg off from where crank.speed has led"),
    (crank.BACKWARDS, {0: -1.0}, 2e-4, "crank.speed is -1 rad/s; reverse running is not modelled"),
    (crank.INPUT_NOT_FINITE + 1, {1: math.nan}, 2e-4, "crank.angle is nan; it must be a finite number"),
]
REFUSED_PRESSURES = [
    (crank.INPUT_NOT_POSITIVE + 2, {2: -1e5}, 2e-4, "intake.pressure is -100000; it is absolute and above 0"),
    (crank.INPUT_NOT_POSITIVE + 5, {5: 0.0}, 2e-4, "exhaust.temperature is 0; it is absolute and above 0"),
    (crank.INPUT_NOT_FINITE + 6, {6: math.inf}, 2e-4, "cylinder[1].fuel_mass is inf; it must be a finite number"),
]


@pytest.mark.parametrize(
    ("module", "case"),
    [*((module, case) for module in SIMULATIONS for case in REFUSED_STEPS),
     *(("combustion", case) for case in REFUSED_PRESSURES)],
)  # fmt: skip
def test_steps_are_refused_alike_by_status_and_by_error(module, case):
    """State and outputs stay, in the run and in the simulation; a start refuses the same inputs."""
    code, inputs, t_end, words = case
    simulation = SIMULATIONS[module](shipped(module, "i6"))
    simulation.inputs[:2] = SPEED, 0.01
    simulation.initialize()
    simulation.inputs[1] += SPEED * 1e-4
    simulation.step(1e-4)
    parts, run = parts_of(module), simulation._run
    before, shown = simulation.state, simulation.outputs.copy()
    for place, value in inputs.items():
        simulation.inputs[place] = value
    assert parts.run_record.advance_run(run, t_end) == code
    kind, text = parts.simulation.native_interface(simulation.settings).statuses[code]
    assert kind == REFUSED and text.partition(" ")[0] == words.partition(" ")[0]
    with pytest.raises(InputError, match=re.escape(words)):
        simulation.step(t_end)
    if code in (crank.BACKWARDS,) or code >= crank.INPUT_NOT_FINITE:
        assert parts.run_record.start(run, 0.0) == code
        with pytest.raises(InputError, match=re.escape(words)):
            simulation.initialize()
    assert np.array_equal(simulation.state, before) and np.array_equal(simulation.outputs, shown)


POISON = {
    "combustion": (
        lambda run: run.bases[3] + slots.ENERGY, -1e9, CYLINDER_FAILED + 4,
        "cylinder 4 fails: its gas has no temperature",
        r"the step from 0 s fails in cylinder 4 at .*; check pressures",
    ),
    "valvetrain": (
        lambda run: train_slots.N_HEAD + train_slots.V, 1e200, 1, "camshaft and valves find no balance",
        "the step from 0 s fails: camshaft and valves find no balance",
    ),
}  # fmt: skip
"""A place of the state and a value that belongs to no temperature or balance; status, its words, those of the error."""


@pytest.mark.parametrize("module", POISON)
def test_a_step_that_fails_is_named_and_the_state_stays(module):
    place, value, code, text, words = POISON[module]
    simulation, parts = SIMULATIONS[module](shipped(module, "i6")), parts_of(module)
    simulation.inputs[0] = SPEED
    simulation.initialize()
    state = simulation.state
    state[place(simulation)] = value
    simulation.state = state
    before = simulation.outputs.copy()
    assert parts.run_record.advance_run(simulation._run, 1e-4) == code
    kind, told = parts.simulation.native_interface(simulation.settings).statuses[code]
    assert kind == FAILED and told.startswith(text)
    with pytest.raises(SolverError, match=words):
        simulation.step(1e-4)
    assert np.array_equal(simulation.state, state) and np.array_equal(simulation.outputs, before)


@pytest.mark.parametrize(
    ("module", "place", "value", "words"),
    [("combustion", 2, 1e300, "the start fails in cylinder 1"),
     ("valvetrain", 0, 1e9, "the start fails: camshaft and valves")],
)  # fmt: skip
def test_a_start_that_fails_leaves_model_and_state(module, place, value, words):
    """Its cycles are run with the built-in lifts; the choices are the run's own again behind them, failed or not."""
    chosen = {"angle_source": "input", "inputs_at": "end"} | (
        {"lift_source": "input"} if module == "combustion" else {}
    )
    simulation = SIMULATIONS[module](replace(shipped(module, "i6"), **chosen))
    simulation.inputs[0] = SPEED
    simulation.initialize()
    before, choices = simulation.state, simulation._model.choices.copy()
    assert choices.tolist() == len(chosen) * [1]
    simulation.inputs[place] = value
    with pytest.raises(SolverError, match=words):
        simulation.initialize()
    assert np.array_equal(simulation.state, before) and np.array_equal(simulation._model.choices, choices)


@pytest.mark.parametrize("kind", train_slots.KINDS)
def test_a_cam_is_the_solution_of_its_four_conditions(kind):
    """Lift, slope, curvature and third derivative at the ramp's end, against LAPACK; the steepest slope by NumPy."""
    settings = shipped("valvetrain", "i6")
    model = parts_of("valvetrain").settings.build_model(settings)
    cam, at = model.cams[train_slots.KINDS.index(kind)], train_slots
    powers = 2.0 + (settings.power - 2.0) * np.arange(4)
    rows = [powers**0, powers, powers * (powers - 1.0), powers * (powers - 1.0) * (powers - 2.0)]
    held = (settings.lash + settings.spring_preload / settings.stiffness) / settings.ratio
    speed = held / (0.75 * settings.ramp)
    found = np.linalg.solve(rows, [held - cam[at.LIFT], -speed * cam[at.HALF], 0.0, 0.0])
    assert cam[at.C_1 :] == pytest.approx(found, rel=1e-13)
    slopes = [abs(cam_lift(c, psi)[1]) for c in model.cams for psi in np.linspace(-c[at.HALF], 0.0, 2001)]
    fastest = 0.5 * settings.rated_speed * settings.ratio * max(slopes)
    assert model.numbers[at.VELOCITY] == fastest


def test_scales_of_a_charge():
    """Mass, energy and port of the intake's gas in the swept volume, from the table's rows for air."""
    settings = shipped("combustion", "i6")
    numbers = parts_of("combustion").settings.build_model(settings).numbers
    table = gas.gas_table(settings.hydrogen_per_carbon)
    swept = 0.25 * math.pi * settings.bore**2 * settings.stroke  # of a pin without offset
    mass = settings.intake_pressure * swept / (table[0, gas.R_GAS] * settings.intake_temperature)
    assert settings.pin_offset == 0.0 and settings.intake_share == 0.0
    assert numbers[slots.MASS_SCALE] == pytest.approx(mass, rel=1e-12)
    energy = mass * abs(gas.internal_energy(table, 0.0, 1000.0))
    assert numbers[slots.ENERGY_SCALE] == pytest.approx(energy, rel=1e-12)
    port = 0.5 * settings.exhaust_pressure * swept / (table[0, gas.R_GAS] * settings.exhaust_temperature)
    assert numbers[slots.PORT_MASS] == pytest.approx(port, rel=1e-12)
