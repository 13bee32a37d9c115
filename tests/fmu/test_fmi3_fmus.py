"""FMUs of FMI 3.0: their description, the same results as by FMI 2.0, and couplings of both."""

import shutil
from contextlib import closing
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest
from benchmarks._clients import CLIENTS_3, ONE_VALUE_EACH
from benchmarks.clients import ClientError, Job, checked, difference
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu
from fmus_by_version import VERSIONS, torsional_fmu
from some import some

from cranktrain.core.element_names import array_element, name_among
from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.fmu.build import build_fmu
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain_lab.coupling.connections import Connection
from cranktrain_lab.coupling.fmu3_description import whole_numbers
from cranktrain_lab.coupling.fmu3_unit import Fmu3Unit, open_fmu
from cranktrain_lab.coupling.fmu_unit import described
from cranktrain_lab.coupling.master import Exchange, Master
from cranktrain_lab.coupling.modules import COMBUSTION, CRANKTRAIN, VALVETRAIN
from cranktrain_lab.coupling.recording_unit import MeasuredPressures
from cranktrain_lab.coupling.run import Steps, run
from cranktrain_lab.coupling.unit import Around, Port, UnitError
from cranktrain_lab.coupling.virtual_engine import Partners, virtual_engine

SPEED = 2000.0 * np.pi / 30.0
STEP = np.radians(1.5) / SPEED


@pytest.mark.parametrize("module", [COMBUSTION, VALVETRAIN, CRANKTRAIN])
def test_a_description_is_valid_and_its_families_are_arrays(fmus, module):
    path = fmus["3.0"][module]
    assert validate_fmu(str(path)) == []
    about = read_model_description(str(path))
    shapes = {v.name: v.shape for v in about.modelVariables}
    assert about.fmiVersion == "3.0" and not any("[" in name for name in shapes)
    texts = {v.name for v in about.modelVariables if v.type not in ("Float64", "Enumeration")}
    assert texts <= {"solver.integrator"}, "any other text has a list of choices"
    if module == CRANKTRAIN:
        assert shapes["cylinder.pressure"] == (6,) and shapes["bearing.force.x"] == (7,)
        assert shapes["mount.force.z"] == (4,) and shapes["crank.angle"] == ()
        [level] = [v for v in about.modelVariables if v.name == "crank.level"]
        assert level.declaredType.items[int(level.start) - 1].name == "torsional"


@pytest.mark.parametrize("engine", ["diesel_i6", "single_petrol"])
@pytest.mark.parametrize(
    ("columns", "source", "told"),
    [
        (("speed", "cylinder[1].pressure"), None, True),  # as tables for FMI 2.0 have them
        (("speed",), None, True),
        (("speed",), 2, False),  # builtin, by the number that FMPy wants
        ((), None, False),
    ],
)
def test_a_table_of_fmi_2_does_not_leave_the_gas_to_itself_in_silence(tmp_path, engine, columns, source, told):
    path, lines = torsional_fmu(engine, tmp_path, "3.0"), []
    table = np.zeros(3, dtype=[("time", float), *((name, float) for name in columns)])
    table["time"] = 0.0, STEP, 2.0 * STEP
    for name in columns:
        table[name] = SPEED if name == "speed" else 5e6
    starts = {"speed": SPEED} | ({"gas.source": source} if source else {})
    simulate_fmu(
        str(path), stop_time=2.0 * STEP, output_interval=STEP, start_values=starts, output=["crank.angle"],
        input=table if columns else None, logger=lambda *given: lines.append(given[-1].decode()),
    )  # fmt: skip
    count = {"diesel_i6": 6, "single_petrol": 1}[engine]
    assert sum(f"first of {count} elements is 'cylinder.pressure[1]'" in line for line in lines) == int(told)


@pytest.mark.parametrize("module", [COMBUSTION, VALVETRAIN, CRANKTRAIN])
def test_items_have_the_numbers_of_the_description(fmus, module):
    """At the start, and of every item in turn by the name that a message lists at its place."""
    path = str(fmus["3.0"][module])
    about = read_model_description(path)
    said, folder = [], extract(path)
    unit = FMU3Slave(
        guid=about.instantiationToken, unzipDirectory=folder, modelIdentifier=about.coSimulation.modelIdentifier
    )
    unit.instantiate(logMessage=lambda _, status, category, text: said.append(text.decode()))
    try:
        for variable in some([v for v in about.modelVariables if v.type == "Enumeration"]):
            names = [item.name for item in variable.declaredType.items]
            with pytest.raises(FMICallException):
                unit.setInt64([variable.valueReference], [len(names) + 1])
            assert said[-1].endswith(f"valid: 1 to {len(names)} for {', '.join(names)}")
        unit.enterInitializationMode()
        for variable in some([v for v in about.modelVariables if v.type == "Enumeration"]):
            assert unit.getInt64([variable.valueReference]) == [int(variable.start)], variable.name
    finally:
        unit.freeInstance()
        shutil.rmtree(folder, ignore_errors=True)


@pytest.mark.parametrize("module", [COMBUSTION, VALVETRAIN, CRANKTRAIN])
def test_results_are_those_of_fmi_2_to_the_bit(fmus, module):
    results = []
    for fmi in VERSIONS:
        path = str(fmus[fmi][module])
        choices = {v.name: v for v in read_model_description(path).modelVariables}
        starts = {}
        if "angle.source" in choices:
            items = choices["angle.source"].declaredType
            named = {item.name: int(item.value) for item in items.items} if items else {}
            starts = {"angle.source": named.get("speed", "speed")}
        results.append(simulate_fmu(path, stop_time=60 * STEP, output_interval=STEP, start_values=starts))
    two, three = results
    for name in two.dtype.names:
        array = array_element(name)
        found = three[name] if array is None or name in three.dtype.names else three[array[0]][:, array[1] - 1]
        np.testing.assert_array_equal(found, two[name], err_msg=name)
    assert len(two.dtype.names) > 70


def coupled(fmus, versions, scheme="gauss-seidel", wrap=lambda unit: unit):
    """Some steps of the three units, each of a version, and which of them take compiled turns."""
    paths = [fmus[fmi][name] for fmi, name in zip(versions, (CRANKTRAIN, COMBUSTION, VALVETRAIN), strict=True)]
    return ran(virtual_engine(Partners(*paths[:2], {}, paths[2]), SPEED, scheme, "own"), wrap)


def ran(system, wrap, steps=40):
    """The run and the units that take compiled turns."""
    units = [wrap(unit) for unit in system.units.values()]
    with closing(Master(units, system.connections, system.exchange, system.outputs)) as master:
        master.initialize(0.0)
        compiled = set() if master._turns is None else set(master._turns.inputs)
        return run(master, steps * STEP, Steps(STEP), system.bonds), compiled


def same_bits(found, expected):
    assert set(found.names) == set(expected.names)
    for name in expected.names:
        np.testing.assert_array_equal(found.of(name), expected.of(name), err_msg=name)


@pytest.mark.parametrize("versions", [("3.0", "2.0", "2.0"), ("2.0", "3.0", "3.0"), ("3.0", "3.0", "3.0")])
def test_units_of_both_versions_run_together_to_the_same_bits(fmus, versions):
    expected, all_of_them = coupled(fmus, ("2.0",) * 3)
    found, compiled = coupled(fmus, versions)
    assert compiled == all_of_them == {CRANKTRAIN, COMBUSTION, VALVETRAIN}
    same_bits(found, expected)


@pytest.mark.parametrize(
    ("scheme", "versions"),
    [
        *((scheme, ("3.0",) * 3) for scheme in ("jacobi", "gauss-seidel", "iterative", "intermediate")),
        ("iterative", ("3.0", "2.0", "3.0")), ("intermediate", ("3.0", "3.0", "2.0")),
    ],
)  # fmt: skip
def test_compiled_turns_give_the_bits_of_calls_from_python(fmus, scheme, versions):
    """Also of a cranktrain that calls its master inside a step: its exchange there is compiled, its step is not."""
    plain, none = coupled(fmus, versions, scheme, Around)
    found, compiled = coupled(fmus, versions, scheme)
    assert compiled == {CRANKTRAIN, COMBUSTION, VALVETRAIN} and none == set()
    same_bits(found, plain)
    assert np.ptp(found.of("cranktrain.pulley.torsion")) > 0.0


@pytest.mark.parametrize("scheme", ["gauss-seidel", "intermediate"])
def test_a_single_cylinder_takes_its_trace_with_the_same_bits(tmp_path, scheme):
    """Its array of pressures has one element; its partner is a unit in Python."""
    engine = load_engine("single_petrol")
    path = torsional_fmu(engine.name, tmp_path, "3.0")
    found = []
    for wrap in (Around, lambda unit: unit):
        gas = MeasuredPressures(engine, GasTrace.from_engine(engine))
        found.append(ran(virtual_engine(Partners(path, gas, {}), SPEED, scheme, "own"), wrap))
    (plain, none), (direct, compiled) = found
    assert compiled == {CRANKTRAIN} and none == set()
    same_bits(direct, plain)


class Pressures:
    """Pressures of 1 bar, but for one cylinder at the end of the sixth step."""

    name, restorable, inputs = "gas", False, MappingProxyType({})
    link = initialize = write = close = lambda self, *values: None

    def __init__(self, odd):
        self.outputs = {f"cylinder[{c + 1}].pressure": Port() for c in range(6)}
        self.odd, self.steps = odd, 0

    def step(self, time, size):
        self.steps += 1

    def read(self):
        found = np.full(6, 1e5)
        found[2] = self.odd if self.steps == 6 else 1e5
        return found


@pytest.mark.parametrize(
    ("odd", "says"),
    [
        (
            -1e5,
            r"^cranktrain at 0\.000625 s: .*cylinder\[3\]\.pressure = -100000.*must be a finite number, at least 0$",
        ),
        (1e300, r"^cranktrain, step from 0\.000625 s to 0\.00075 s: step: .*the forces at the ports found no balance"),
    ],
)
def test_what_a_crank_refuses_in_a_turn_is_told_as_from_python(fmus, odd, says):
    """An element of its array in its own words, or the step."""
    told = {}
    for fmi, wrap in [("3.0", Around), *((fmi, lambda unit: unit) for fmi in VERSIONS)]:
        crank = open_fmu(fmus[fmi][CRANKTRAIN], CRANKTRAIN, {"speed": SPEED, "gas.source": "input"})
        crank.inputs = {name: replace(port, low=-np.inf) for name, port in crank.inputs.items()}
        gas = Pressures(odd)
        links = [Connection(("gas", name), (CRANKTRAIN, name), "newest") for name in gas.outputs]
        with closing(Master([gas, wrap(crank)], links, Exchange(), {CRANKTRAIN: ["pulley.torsion"]})) as master:
            master.initialize(0.0)
            assert (master._turns is None) == (wrap is Around)
            with pytest.raises(UnitError, match=says) as caught:
                run(master, 40 * STEP, Steps(STEP))
            told[fmi, wrap is Around] = str(caught.value)
    assert told["3.0", True] == told["3.0", False]


def test_an_element_is_found_wherever_its_number_stands(fmus):
    units = [open_fmu(fmus[fmi][CRANKTRAIN], "crank") for fmi in VERSIONS]
    for unit in units:
        for name in ("cylinder[2].pressure", "cylinder.pressure[2]"):
            assert unit.inputs[name].unit == "Pa" and name in unit.inputs and unit.start(name) == 101325.0
        assert "cylinder.pressure[7]" not in unit.inputs and "cylinder.pressure" not in unit.inputs
    assert list(units[0].inputs) == list(units[1].inputs)
    assert name_among("a.b[3].c", {"a[3].b.c"}) == "a[3].b.c" and name_among("a[1][2]", {"a"}) == "a[1][2]"


def test_enumerations_are_given_by_their_items(fmus):
    path = fmus["3.0"][CRANKTRAIN]
    assert isinstance(open_fmu(path, "crank", {"crank.level": "torsional", "cylinder.firing_angle[2]": 4.0}), Fmu3Unit)
    with pytest.raises(InputError, match=r"'torsonal' is none of its items; did you mean 'torsional'"):
        open_fmu(path, "crank", {"crank.level": "torsonal"})
    with pytest.raises(InputError, match=r"crank.level = 1.5 is no whole number"):
        open_fmu(path, "crank", {"crank.level": 1.5})
    assert whole_numbers("Int8") == (-128, 127) and whole_numbers("UInt16") == (0, 65535)
    assert whole_numbers("Enumeration") == whole_numbers("Int64") == (-(1 << 63), (1 << 63) - 1)


def test_a_pressure_that_is_refused_is_named(fmus):
    with closing(open_fmu(fmus["3.0"][CRANKTRAIN], "crank")) as unit:
        unit.link(["cylinder[2].pressure"], ["pulley.torsion"])
        unit.initialize(0.0)
        with pytest.raises(Exception, match=r"cylinder.pressure\[2\]' is -1"):
            unit.write(np.array([-1.0]))


@pytest.mark.slow
@pytest.mark.parametrize("module", [COMBUSTION, VALVETRAIN, CRANKTRAIN])
def test_the_toolbox_finds_nothing_wrong(fmus, module):
    """``fmutool -check``."""
    assert checked(fmus["3.0"][module]) == []


@pytest.mark.slow
@pytest.mark.parametrize("module", [COMBUSTION, VALVETRAIN, CRANKTRAIN])
@pytest.mark.parametrize("name", list(CLIENTS_3))
def test_a_client_finds_what_fmpy_finds(fmus, module, name):
    """A hundred steps, of scalars where the client reads no arrays; times that are added up differ in last digits."""
    client = CLIENTS_3[name]
    assert difference(client, Job(fmus["3.0"][module], arrays=client.arrays)) < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("name", list(ONE_VALUE_EACH))
def test_one_value_of_an_array_is_refused(fmus, name):
    with pytest.raises(ClientError, match=r"fmi3GetFloat64|Float64 not supported"):
        difference(ONE_VALUE_EACH[name], Job(fmus["3.0"][VALVETRAIN], arrays=False))


def test_fmi_3_is_native_and_no_other_version_is_built(tmp_path):
    with pytest.raises(InputError, match=r"a Python FMU is of FMI 2\.0"):
        build_fmu("combustion_i6", tmp_path, platforms=(), fmi="3.0")
    with pytest.raises(InputError, match=r"FMI '1\.0' is no version that FMUs are built for; take 2\.0 or 3\.0"):
        build_fmu("combustion_i6", tmp_path, fmi="1.0")
    assert list(tmp_path.iterdir()) == []


def test_an_fmu_of_fmi_3_without_co_simulation_is_refused(fmus, tmp_path):
    about = tmp_path / "modelDescription.xml"
    text = (
        '<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="3.0" modelName="m" '
        'instantiationToken="t"><ModelExchange modelIdentifier="m"/><ModelVariables><Float64 name="time" '
        'valueReference="0" causality="independent" variability="continuous"/></ModelVariables><ModelStructure/>'
        "</fmiModelDescription>"
    )
    about.write_text(text)
    with pytest.raises(InputError, match=r"FMI 3\.0, without co-simulation"):
        described(about)
