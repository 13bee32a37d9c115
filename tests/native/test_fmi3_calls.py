"""The face of FMI 3.0: its calls, arrays, updates inside a step, derivatives; the model is that of FMI 2.0."""

import ctypes
import math
import re
from ctypes import byref, c_size_t, c_uint32, c_void_p

import mock_unit
import pytest
from mock_unit import GUID, REFERENCE, SOURCES
from raw3_unit import C_TYPE, Raw3
from raw_unit import DISCARD, ERROR, OK, instances

V = REFERENCE
MOTION = V["position"]  # with velocity and energy behind it, an array of three
TIME = len(REFERENCE)


@pytest.fixture(scope="module")
def resources(tmp_path_factory):
    """The mock's data with position, velocity and energy as one array."""
    folder = tmp_path_factory.mktemp("resources")
    (folder / "native.bin").write_bytes(mock_unit.native_bin(arrays=f"{MOTION}*3"))
    return folder


@pytest.fixture
def unit3(binary, resources):
    """A function that makes instances by FMI 3.0."""
    yield from instances(lambda folder=resources, **options: Raw3(binary, folder, GUID, **options))


def test_steps_find_what_they_find_by_fmi_2_to_the_bit(unit, unit3):
    one, other = unit().start().run(20), unit3().start().run(20)
    assert other.get("Float64", MOTION, n=3) == one.get("Real", V["position"], V["velocity"], V["energy"])
    assert other.told == (False, False, False, pytest.approx(20e-4, rel=1e-12))


def test_time_and_scalars_and_arrays_are_read_in_one_call(unit3):
    one = unit3().start().run(5)
    read = one.get("Float64", TIME, V["speed"], MOTION, TIME, V["force"], n=7)
    assert read == [5e-4, 100.0, *one.get("Float64", MOTION, n=3), 5e-4, 10.0]
    assert one.get("Float64", *16 * [V["speed"]], TIME) == [*16 * [100.0], 5e-4]


@pytest.mark.parametrize(
    ("references", "n", "words"),
    [
        ([MOTION], 2, "2 values were given for variables of 3"),
        ([MOTION + 1], 1, "value reference 3 is unknown"),
        ([TIME + 1], 1, f"value reference {TIME + 1} is unknown"),
        ([V["observed"]], 1, "is 'observed', no Float64"),
        ([V["speed"]], 2**40, "values were given for variables of 1 elements"),
        ([V["speed"]] * 18, 18, "more than 17 Float64 values at once"),
        ([V["speed"]] * 17, 17, "more than 16 Float64 values at once"),
        ([V["speed"], TIME], 1, "value reference 16 is unknown"),
    ],
)
def test_references_and_counts_that_do_not_fit_are_refused(unit3, references, n, words):
    one = unit3().start()
    given = (
        (c_uint32 * len(references))(*references),
        c_size_t(len(references)),
        (C_TYPE["Float64"] * 200)(),
        c_size_t(n),
    )
    assert re.search(words, one.refused("GetFloat64", *given))


@pytest.mark.parametrize("kind", ["Float64", "Int32", "Int64", "Boolean", "String"])
@pytest.mark.parametrize("n", [2**32, 2**62])
def test_a_count_beyond_all_variables_is_refused_before_references_behind_it_are_read(unit3, kind, n):
    one = unit3().start()
    given = (c_uint32 * 2)(MOTION, TIME), c_size_t(n), (C_TYPE[kind] * 8)(), c_size_t(n)
    assert re.search(r"values at once|unknown|is '", one.refused(f"Get{kind}", *given))


def test_types_are_those_of_fmi_3(unit3):
    one = unit3().set("Int32", [V["repeats"]], [3]).set("Boolean", [V["reversed"]], [True])
    one.set("Int64", [V["solver.scheme"]], [3]).set("String", [V["spring.level"]], ["stiff"])
    one.start()
    assert one.get("Int32", V["repeats"]) == [3] and one.get("Boolean", V["reversed"]) == [True]
    assert one.get("Int64", V["solver.scheme"]) == [3] and one.get("String", V["spring.level"]) == [b"stiff"]
    assert "no Int32" in one.refused("GetInt32", *one.values("Int32", [V["solver.scheme"]], [0]))


def test_an_item_beyond_all_integers_is_none(unit3):
    one = unit3()
    for value in (0, 4, 2**40, -(2**40)):
        assert "valid: 1 to 3" in one.refused("SetInt64", *one.values("Int64", [V["solver.scheme"]], [value]))


def test_every_function_of_the_standard_is_there_and_refuses_without_an_instance(binary):
    library = ctypes.CDLL(str(binary))
    names = set(re.findall(r"\bfmi3Status (fmi3\w+)\(", (SOURCES / "fmi3.h").read_text()))
    assert len(names) == 75 - 5  # getVersion, three instantiations, freeInstance
    for name in names:
        assert getattr(library, name)(None, *[c_size_t(0)] * 9) == ERROR, name
    library.fmi3GetVersion.restype = ctypes.c_char_p
    assert library.fmi3GetVersion() == b"3.0"


ABSENT = (
    "EnterEventMode", "EnterStepMode", "EvaluateDiscreteStates", "UpdateDiscreteStates", "EnterConfigurationMode",
    "ExitConfigurationMode", "EnterContinuousTimeMode", "SetTime", "GetContinuousStates", "GetFloat32", "SetInt8",
    "GetBinary", "SetClock", "GetIntervalDecimal", "SetShiftFraction", "GetVariableDependencies",
    "ActivateModelPartition", "GetNumberOfEventIndicators",
)  # fmt: skip


@pytest.mark.parametrize("name", ABSENT)
def test_what_the_unit_has_not_is_refused_by_name(unit3, name):
    text = unit3().refused(name, *[c_size_t(0)] * 8)
    assert text.startswith(f"unit: {name[0].lower()}{name[1:]}, but this FMU has no ")


def test_event_mode_is_refused_at_the_instantiation(unit3):
    one = unit3(events=True)
    assert one.component is None and "no event mode" in one.log[0][2]


@pytest.mark.parametrize("arrays", ["2*", "2*0", "2*15", "99*1", "2*3,5*1", "2*3 3*2", "7*2", "1*2", "x", "-1*2"])
def test_arrays_that_cannot_be_are_refused(unit3, tmp_path, arrays):
    (tmp_path / "native.bin").write_bytes(mock_unit.native_bin(arrays=arrays))
    one = unit3(folder=tmp_path)
    assert one.component is None and "native.bin has an array" in one.log[0][2]


@pytest.mark.parametrize("gas", ["1", "16 15", "1 16", "1 0", "3 15", "1 15 x"])
def test_pressures_that_cannot_be_are_refused(unit3, tmp_path, gas):
    """An input, the first of an array, and the enumeration that says where pressures come from."""
    (tmp_path / "native.bin").write_bytes(mock_unit.native_bin(arrays=f"{MOTION}*3", gas=gas))
    one = unit3(folder=tmp_path)
    assert one.component is None and "native.bin has pressures that cannot be" in one.log[0][2]


@pytest.mark.parametrize(
    ("scheme", "given", "told"),
    [(1, [], 0), (1, ["speed"], 1), (1, ["speed", "force"], 0), (1, ["force"], 0), (2, ["speed"], 0)],
)
def test_pressures_that_do_not_come_are_missed_once(unit3, tmp_path, scheme, given, told):
    """If the run is driven by other inputs, and the source (here the first scheme) is left to the unit."""
    about = {"gas": f"{V['force']} {V['solver.scheme']}", "arrays": f"{MOTION}*3 {V['force']}*1"}
    (tmp_path / "native.bin").write_bytes(mock_unit.native_bin(**about))
    one = unit3(folder=tmp_path).set("Int64", [V["solver.scheme"]], [scheme]).set("Float64", [V["speed"]], [90.0])
    one.start().run(1)
    for name in given:
        one.set("Float64", [V[name]], [50.0])
    one.run(2, first=1)
    assert sum("no pressures are set" in text for _, _, text in one.log) == told


def test_a_host_is_called_every_half_degree(unit3):
    """A speed of 100 rad/s and a step of 2e-4 s are 1.15 degrees: three parts."""
    times = []
    one = unit3(update=lambda unit, time: times.append(time)).start()
    one.run(1, step=2e-4)
    assert times == pytest.approx([2e-4 / 3, 4e-4 / 3], rel=1e-12)


def test_inputs_set_inside_a_step_are_those_of_shorter_steps(unit3):
    """To the bit, as by steps at whose ends the host sets what it set inside."""

    def force(time):
        return 10.0 + 1e4 * time

    def update(unit, time):
        assert unit.get("Float64", TIME) == [time]
        unit.set("Float64", [V["force"]], [force(time)])

    inside, between = unit3(update=update).start(), unit3().start()
    for k in range(10):
        time = k * 1e-4
        for one in (inside, between):
            one.set("Float64", [V["force"]], [force(time)])
        assert inside.step(time, 1e-4) == OK
        assert between.step(time, 0.5e-4) == OK
        between.set("Float64", [V["force"]], [force(time + 1e-4 * 0.5)])
        assert between.step(time + 1e-4 * 0.5, (time + 1e-4) - (time + 1e-4 * 0.5)) == OK
    assert inside.get("Float64", MOTION, n=3) == between.get("Float64", MOTION, n=3)


def test_a_step_ends_early_where_a_host_wants_it(unit3):
    one = unit3(update=lambda unit, time: time, early=True).start()
    assert one.step(0.0, 3e-4) == OK
    assert one.told[2] is True and 0.0 < one.told[3] < 3e-4
    assert one.step(one.told[3], 1e-5) == OK
    held = unit3(update=lambda unit, time: time).start()
    assert held.step(0.0, 3e-4) == OK and held.told[2:] == (False, 3e-4)


def test_nothing_but_values_may_be_called_inside_a_step(unit3):
    said = []

    def update(unit, time):
        state = c_void_p()
        calls = (("Reset",), ("Terminate",), ("GetFMUState", byref(state)), ("ExitInitializationMode",))
        said.extend(unit.refused(*call) for call in calls)
        unit.library.fmi3FreeInstance(c_void_p(unit.component))

    one = unit3(update=update).start().run(3)
    assert len(said) >= 4 and all("inside an intermediate update" in text for text in said)
    assert one.get("Float64", TIME) == [pytest.approx(3e-4)]


def test_a_step_without_a_solution_tells_how_far_it_came(unit3):
    one = unit3().start().run(3)
    one.set("Float64", [V["force"]], [2000.0])
    assert one.step(3e-4) == DISCARD
    assert one.told == (False, False, False, pytest.approx(3e-4))
    assert one.set("Float64", [V["force"]], [10.0]).step(3e-4) == OK


def test_directional_and_adjoint_derivatives_are_rows_and_columns_of_one_matrix(unit3):
    one = unit3().start().run(10)
    inputs = [V["force"], V["speed"]]
    columns = [one.derivative("Directional", [MOTION], [known], [1.0], 3) for known in inputs]
    weights = [2.0, -3.0, 0.5]
    expected = [math.fsum(w * value for w, value in zip(weights, column, strict=True)) for column in columns]
    assert one.derivative("Adjoint", [MOTION], inputs, weights, 2) == pytest.approx(expected, rel=1e-12)
    assert expected[0] != 0.0
