"""Values through the native interface: what is set arrives at the kernels, what they compute is read."""

import math
import subprocess
import sys
from ctypes import byref, c_double, c_int, c_size_t, c_uint

import mock_unit
import pytest
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu
from mock_unit import REFERENCE, VARIABLES
from raw_unit import DISCARD, ERROR, OK, WARNING

V = REFERENCE


def trajectory(steps, h=1e-4, **given):
    """Position and velocity of the mock's mass, in the very operations of its kernels."""
    speed, force, rate = given.get("speed", 100.0), given.get("force", 10.0), given.get("rate")
    cubic = 10.0 if given.get("stiff") else 0.0
    c = given.get("damping", 0.5) + 0.01 * speed
    inverse, sign = 1.0 / 2.0, -1.0 if given.get("reversed") else 1.0

    def law(x):
        return 100.0 * (x + cubic * x * x * x) if cubic else 100.0 * x

    x, v, time = 1.1 * force / law(1.0), 0.0, 0.0
    for k in range(steps):
        end = k * h + h
        n = math.ceil((end - time) / 1e-4 * given.get("method", 1.0) * given.get("repeats", 1))
        part = (end - time) / n
        for i in range(n):
            now = force if rate is None else force + rate * part * i
            v += part * inverse * (sign * now - c * v - law(x))
            x += part * v
        time = end
    return [x, v]


def moved(unit):
    return unit.get("Real", V["position"], V["velocity"])


def test_fmpy_validates_and_simulates(mock):
    assert validate_fmu(str(mock)) == []
    values = {"force": 20.0, "spring.level": "stiff", "solver.scheme": 3}
    found = simulate_fmu(str(mock), output_interval=1e-3, stop_time=0.01, start_values=values)
    assert len(found) == 11 and found["observed"].tolist() == list(range(1, 12))
    with pytest.raises(Exception, match=r"fmi2ExitInitializationMode failed with status 3 \(error\)"):
        simulate_fmu(str(mock), stop_time=0.01, start_values={"spring.level": "stiff", "mount.level": "free"})


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"speed": 150.0, "force": -3.0, "damping": 2.0},
        {"stiff": True, "method": 4.0},
        {"repeats": 3, "reversed": True},
        {"rate": 250.0},
    ],
)
def test_what_is_set_reaches_the_kernels(unit, given):
    one = unit()
    one.set("Real", {V[name]: given[name] for name in ("speed", "force", "damping") if name in given})
    one.set("Integer", {V["repeats"]: given.get("repeats", 1)})
    one.set("Boolean", {V["reversed"]: int(given.get("reversed", False))})
    one.set("String", {V["spring.level"]: "stiff" if given.get("stiff") else "soft"})
    one.set("String", {V["solver.method"]: "fine" if given.get("method") else "coarse"})
    one.start()
    for k in range(20):
        if "rate" in given:
            one.must("SetRealInputDerivatives", *one.rates("Set", {V["force"]: given["rate"]}))
        assert one.step(k * 1e-4) == OK
    assert moved(one) == trajectory(20, **given)


def test_every_variable_reads_as_it_starts(unit):
    one = unit().setup()
    one.must("EnterInitializationMode")
    assert one.get("Real", V["speed"], V["damping"], V["length"]) == [100.0, 0.5, 0.35]
    assert one.get("Integer", V["repeats"], V["solver.scheme"]) == [1, 2]
    assert one.get("Boolean", V["reversed"]) == [0]
    strings = one.get("String", V["spring.level"], V["mount.level"], V["solver.method"], V["author"])
    assert strings == [b"soft", b"ground", b"coarse", b"nobody"]
    one.set("Integer", {V["solver.scheme"]: 3, V["repeats"]: 10})
    one.set("String", {V["author"]: "nobody", V["solver.method"]: "fine"})
    assert one.get("Integer", V["repeats"], V["solver.scheme"]) == [10, 3]
    assert one.get("String", V["solver.method"]) == [b"fine"]


def test_outputs_of_all_types(unit):
    one = unit().start()
    assert one.get("Boolean", V["moving"]) == [0]
    assert one.get("Real", V["energy"]) == [8.0]  # the mass rests; what is left is an entry of the shared table
    one.run(1)
    assert one.get("Boolean", V["moving"]) == [1]
    assert one.get("Integer", V["observed"]) == [2]


def test_outputs_are_observed_from_the_first_question_on(unit):
    """Nobody reads the second family: it is not computed. Then each step computes it once."""
    one = unit().start().run(5)
    one.get("Real", V["position"])
    assert one.get("Integer", V["observed"]) == [1]
    one.get("Real", V["energy"])
    assert one.run(3, first=5).get("Integer", V["observed"]) == [4]


def test_reading_in_initialization_mode_finds_the_start(unit):
    one = unit(logging=True).setup()
    one.must("EnterInitializationMode")
    first = one.one("Real", V["position"])
    one.set("Real", {V["force"]: 30.0})
    assert one.one("Real", V["position"]) == pytest.approx(3.0 * first)
    assert one.one("Real", V["force"]) == 30.0
    one.must("ExitInitializationMode")
    assert one.one("Real", V["position"]) == pytest.approx(3.0 * first)
    assert [text for _, _, text in one.log] == ["unit: initialized at 0 s"] * 2


def test_outputs_follow_inputs_only_from_the_next_step(unit):
    one = unit().start().run(3)
    before = moved(one)
    one.set("Real", {V["force"]: 50.0, V["speed"]: 10.0})
    assert moved(one) == before
    assert moved(one.run(1, first=3)) != before


def test_a_refused_call_sets_none_of_its_values(unit):
    one = unit().start()
    one.refused_set("Real", {V["force"]: 50.0, V["speed"]: math.nan})
    assert one.one("Real", V["force"]) == 10.0


BEFORE = [
    ("Real", "damping", -1.0, "'damping' is -1.0 at time 0 s; it must be a finite number, at least 0"),
    ("Real", "length", math.inf, "'length' is inf at time 0 s; it must be a finite number"),
    ("Integer", "repeats", 11, "'repeats' is 11.0 at time 0 s; it must be a finite number, between 1 and 10"),
    ("Integer", "solver.scheme", 4, "'solver.scheme' is 4; valid: 1 to 3 for first, second, third"),
    ("Integer", "solver.scheme", 0, "'solver.scheme' is 0; valid: 1 to 3 for first, second, third"),
    ("String", "spring.level", "soft ", "'spring.level' is 'soft '; valid: soft, stiff"),
    ("String", "author", "me", "'author' is 'me'; valid: nobody"),
]
AFTER = [
    ("Real", "speed", math.nan, "'speed' is nan at time 0.0003 s; it must be a finite number, between 0 and 2000"),
    ("Real", "speed", -1.0, "'speed' is -1.0 at"),
    ("Real", "speed", 1e6, "'speed' is 1000000.0 at"),
    ("Real", "force", -math.inf, "'force' is -inf at time 0.0003 s; it must be a finite number"),
    ("Real", "position", 0.5, "'position' is an output and cannot be set"),
    ("Real", "damping", 0.5, "parameter 'damping' is fixed after initialization; reset the instance, then set it"),
    ("String", "author", "nobody", "parameter 'author' is fixed after initialization"),
    ("Real", "repeats", 1.0, "value reference 8 is 'repeats', no Real; see modelDescription.xml"),
    ("Boolean", "speed", 1, "value reference 0 is 'speed', no Boolean; see modelDescription.xml"),
    ("String", "speed", "1", "value reference 0 is 'speed', no String; see modelDescription.xml"),
]


@pytest.mark.parametrize(("kind", "name", "value", "words"), BEFORE + AFTER)
def test_a_refused_value_is_explained_and_changes_nothing(unit, kind, name, value, words):
    one = unit("crank 100%")
    if (kind, name, value, words) in AFTER:
        one.start().run(3)
    text = one.refused_set(kind, {V[name]: value})
    assert text.startswith("crank 100%: " + words), text
    if (kind, name, value, words) in BEFORE:
        one.start().run(3)
    assert moved(one) == trajectory(3)


def test_unknown_references_missing_arrays_and_absurd_counts_are_refused(unit):
    one = unit().start()
    reference, value, order = (c_uint * 1)(0), (c_double * 1)(), (c_int * 1)(1)
    unknown = (c_uint * 1)(2**32 - 1)
    for kind in ("Real", "Integer", "Boolean", "String"):
        for call in (f"Get{kind}", f"Set{kind}"):
            assert f"value reference 4294967295 is unknown, no {kind}" in one.refused(call, unknown, c_size_t(1), value)
            assert "without an array" in one.refused(call, None, c_size_t(1), value)
            assert "without an array" in one.refused(call, reference, c_size_t(1), None)
            for many in (len(VARIABLES) + 1, 2**32, 2**63, 2**64 - 1):
                assert "the FMU has 16 variables" in one.refused(call, reference, c_size_t(many), value)
            one.must(call, None, c_size_t(0), None)
    assert "without an array" in one.refused("SetRealInputDerivatives", None, c_size_t(1), order, value)
    assert "without their orders" in one.refused("SetRealInputDerivatives", reference, c_size_t(1), None, value)
    one.refused("GetRealOutputDerivatives", reference, c_size_t(2**60), order, value)
    few = c_size_t(1)
    one.refused("GetDirectionalDerivative", None, few, reference, few, value, value)
    one.refused("GetDirectionalDerivative", reference, few, reference, c_size_t(2**63), value, value)
    assert "without an array" in one.refused("SetString", *one.values("String", {V["author"]: "x"})[:2], None)
    assert moved(one.run(3)) == trajectory(3)


def test_a_string_that_is_nowhere_is_refused(unit):
    one = unit()
    references, n, values = one.values("String", {V["author"]: "nobody"})
    values[0] = None
    assert "'author' is ''" in one.refused("SetString", references, n, values)


def test_parameters_that_the_data_were_made_for_stay(unit):
    one = unit()
    one.set("Real", {V["length"]: 0.35 * (1 + 1e-12)})
    one.start()
    one.must("Reset")
    one.set("Real", {V["length"]: 0.4})
    one.setup().must("EnterInitializationMode")
    assert one.refused("ExitInitializationMode") == (
        "unit: 'length' is 0.4, but the data of this FMU were made for 0.35; keep that value, or build the FMU of "
        "an engine file with the new one, with build_fmu.py"
    )
    one.set("Real", {V["length"]: 0.35})
    one.must("ExitInitializationMode")


@pytest.mark.parametrize(
    ("kind", "name", "value", "words"),
    [
        ("String", "mount.level", "free", "a stiff spring needs mount.level ground; choose it"),
        ("Real", "force", 501.0, "no static equilibrium; push less"),
        ("Real", "damping", 91.0, "damping is above 90; lower it"),
    ],
)
def test_a_start_that_fails_can_be_mended(unit, kind, name, value, words):
    one = unit()
    one.set("String", {V["spring.level"]: "stiff"})
    one.set(kind, {V[name]: value})
    one.setup().must("EnterInitializationMode")
    assert one.refused("ExitInitializationMode") == f"unit: {words}"
    reference, out = (c_uint * 1)(V["position"]), c_double()
    assert one.refused("GetReal", reference, c_size_t(1), byref(out)) == f"unit: {words}"
    one.set(kind, {V[name]: {"free": "ground", 501.0: 10.0, 91.0: 0.5}[value]})
    one.must("ExitInitializationMode")
    assert moved(one.run(3)) == trajectory(3, stiff=True)


def test_a_derivative_of_an_input_holds_for_one_step(unit):
    one = unit().start()
    one.must("SetRealInputDerivatives", *one.rates("Set", {V["force"]: 1e5}))
    one.run(1, step=1e-3)
    with_rate = moved(one)
    assert with_rate == trajectory(1, h=1e-3, rate=1e5)
    state = one.state()
    one.run(1, first=1, step=1e-3)
    held = moved(one)
    one.must("SetFMUstate", state)
    one.must("SetRealInputDerivatives", *one.rates("Set", {V["force"]: 0.0}))
    assert moved(one.run(1, first=1, step=1e-3)) == held
    one.must("FreeFMUstate", byref(state))


def test_derivatives_of_inputs_are_checked(unit):
    one = unit().start()
    call = "SetRealInputDerivatives"
    assert "derivative of order 2 of 'force'" in one.refused(call, *one.rates("Set", {V["force"]: 1.0}, order=2))
    assert "'position' is no input" in one.refused(call, *one.rates("Set", {V["position"]: 1.0}))
    assert "derivative of 'force' is nan" in one.refused(call, *one.rates("Set", {V["force"]: math.nan}))
    assert "no Real" in one.refused(call, *one.rates("Set", {V["repeats"]: 1.0}))
    assert moved(one.run(3)) == trajectory(3)


def test_coarse_steps_are_warned_of_once(unit):
    one = unit()
    one.set("Real", {V["speed"]: 200.0})
    one.start().run(3, step=5e-4)
    [(status, category, text)] = one.log
    assert (status, category) == (WARNING, "logStatusWarning")
    assert text.startswith("unit: a communication step of 0.0005 s is 5.7 degrees of crank angle")
    assert "fmpy: --output-interval 8.7e-05" in text
    assert unit().start().run(3).log == []


@pytest.mark.parametrize(("place", "told"), [("1", 1), ("999", 0)])
def test_a_step_that_was_cut_short_is_told_once(unit, tmp_path, place, told):
    """Where the file says at which place of the state that shows; here it is the mass's, which moves in every step."""
    (tmp_path / "native.bin").write_bytes(mock_unit.native_bin(limited=place, told="took longer than usual"))
    one = unit(resources=tmp_path).start()
    assert one.log == []
    one.run(3)
    assert len(one.log) == told
    for status, category, text in one.log:
        assert (status, category) == (WARNING, "logStatusWarning")
        assert text == "unit: the step from 0 s took longer than usual"


def test_a_failed_step_is_discarded_and_the_instance_goes_on(unit):
    one = unit().start().run(3)
    before = moved(one)
    one.set("Real", {V["force"]: 2000.0})
    assert one.step(3e-4) == DISCARD
    assert one.log == [(DISCARD, "logStatusDiscard", "unit: step failed at t = 0.0003 s: the spring broke; push less")]
    assert one.real_status() == (OK, pytest.approx(3e-4, rel=1e-12))
    status = c_int(77)
    one.must("GetStatus", 0, byref(status))
    assert status.value == DISCARD
    assert moved(one) == before
    one.set("Real", {V["force"]: 10.0})
    assert moved(one.run(1, first=3)) == trajectory(4)
    one.must("GetStatus", 0, byref(status))
    assert status.value == OK


def test_a_step_that_the_kernels_refuse_is_an_error(unit):
    one = unit().start().run(3)
    one.set("Real", {V["force"]: -2000.0})
    assert one.refused("DoStep", 3e-4, 1e-4, 1) == "unit: the force pulls 100% too much at 0.0003 s"
    one.set("Real", {V["force"]: 666.0})  # a status that nobody has written of
    assert one.step(3e-4) == DISCARD and "no solution" in one.log[-1][2]
    one.set("Real", {V["force"]: 10.0})
    assert moved(one.run(1, first=3)) == trajectory(4)
    assert one.call("CancelStep") == ERROR


AFTERWARDS = """
import gc
from pathlib import Path
from fmpy import simulate_fmu
from cranktrain_lab.coupling.fmu_unit import FmuUnit
unit = FmuUnit(Path({path!r}), "one", {{"spring.level": "stiff", "mount.level": "free"}})
try:
    unit.link(["force"], ["position"])
    unit.initialize(0.0)
except Exception as error:
    print(error)
del unit
gc.collect()
try:
    simulate_fmu({path!r}, stop_time=0.01, start_values={{"spring.level": "stiff", "mount.level": "free"}})
except Exception as error:
    print(error)
"""


def test_fmpy_logs_after_a_coupled_unit_is_gone(mock):
    """FMPy's proxy goes on calling the logger of the unit that was coupled last."""
    done = subprocess.run([sys.executable, "-c", AFTERWARDS.format(path=str(mock))], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    coupled, driven = done.stdout.splitlines()
    assert "a stiff spring needs mount.level ground; choose it" in coupled
    assert "status 3" in driven
