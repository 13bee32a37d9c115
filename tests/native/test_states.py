"""FMU states of the native interface: back and on to the bit, across instances, refused where they are not ours."""

from ctypes import byref, c_size_t, c_void_p

import numpy as np
import pytest
from mock_unit import REFERENCE
from raw_unit import DISCARD, ERROR, OK, summed

V = REFERENCE
LEVELS = ({}, {"spring.level": "stiff"}, {"mount.level": "free"})


def fresh(unit, levels, speed=100.0):
    one = unit()
    one.set("String", {V[name]: text for name, text in levels.items()})
    one.set("Real", {V["speed"]: speed})
    return one


def bits(one):
    return [value.hex() for value in one.get("Real", V["position"], V["velocity"], V["energy"], V["speed"])]


@pytest.mark.parametrize("levels", LEVELS)
def test_a_state_goes_back_and_on_to_the_bit(unit, levels):
    one = fresh(unit, levels).start().run(10)
    state, before = one.state(), bits(one)
    later = bits(one.run(10, first=10))
    one.must("SetFMUstate", state)
    assert bits(one) == before
    assert bits(one.run(10, first=10)) == later
    one.must("FreeFMUstate", byref(state))
    assert not state


@pytest.mark.parametrize("levels", LEVELS)
@pytest.mark.parametrize("there", LEVELS)
def test_a_state_brings_its_levels_and_what_the_start_has_set(unit, levels, there):
    """Friction is that of the speed at the start, also in an instance that began otherwise."""
    one = fresh(unit, levels, speed=150.0).start().run(5)
    one.set("Real", {V["speed"]: 30.0})
    data = one.run(5, first=5).serialized(one.state())
    later = bits(one.run(10, first=10))
    others = (fresh(unit, there, speed=40.0), *(fresh(unit, there, speed=v).start().run(3) for v in (40.0, 158.0)))
    for other in others:  # 158 and 40 are on either side of 150, also as bytes
        status, state = other.deserialize(data)
        assert status == OK
        other.must("SetFMUstate", state)
        assert other.get("String", *(V[name] for name in levels)) == [text.encode() for text in levels.values()]
        assert bits(other.run(10, first=10)) == later


def test_equal_states_have_equal_bytes(unit):
    first, second = (one.serialized(one.state()) for one in (unit().start().run(3), unit().start().run(3)))
    assert first == second
    one = unit().start().run(3)
    state = one.state()
    again = c_void_p(state.value)
    one.run(2, first=3).must("GetFMUstate", byref(again))
    assert again.value == state.value and one.serialized(again) != first


def test_a_state_holds_the_phase(unit):
    one = unit()
    instantiated = one.state()
    one.setup(0.25).must("EnterInitializationMode")
    initializing = one.state()
    one.must("ExitInitializationMode").run(0)
    assert one.step(0.25) == OK
    stepped = one.state()
    one.must("Terminate")
    terminated = one.state()
    one.must("SetFMUstate", stepped)
    assert one.step(0.2501) == OK
    one.must("SetFMUstate", initializing).must("ExitInitializationMode")
    assert one.real_status() == (OK, 0.25)
    one.must("SetFMUstate", terminated)
    assert one.step(0.2501) == ERROR
    one.must("SetFMUstate", instantiated).start(1.0)
    assert one.real_status() == (OK, 1.0)


def test_a_derivative_that_is_set_belongs_to_the_state(unit):
    one = unit().start().run(3)
    one.must("SetRealInputDerivatives", *one.rates("Set", {V["force"]: 1e6}))
    state = one.state()
    later = bits(one.run(1, first=3, step=1e-4))
    one.must("SetFMUstate", state)
    assert bits(one.run(1, first=3)) == later


def test_a_failed_step_can_be_tried_again_from_a_state(unit):
    one = unit().start().run(3)
    state = one.state()
    one.set("Real", {V["force"]: 2000.0})
    assert one.step(3e-4) == DISCARD
    one.must("SetFMUstate", state)
    assert bits(one.run(1, first=3)) == bits(unit().start().run(4))


def test_a_state_that_cannot_start_leaves_the_instance_as_it_was(unit):
    """Its parameters lead to no start: this takes a state that no instance gave, its checksum made to fit."""
    one = unit().start().run(3)
    words = np.frombuffer(one.serialized(one.state()), dtype="<u8").copy()
    places = np.flatnonzero(words == np.float64(0.5).view(np.uint64))  # the damping
    assert len(places) == 1
    words[places] = np.float64(91.0).view(np.uint64)
    other = unit().start().run(5)
    before = bits(other)
    status, state = other.deserialize(summed(words))
    assert status == OK
    assert other.refused("SetFMUstate", state) == "unit: damping is above 90; lower it"
    assert bits(other) == before
    assert bits(other.run(1, first=5)) == bits(unit().start().run(6))


def test_foreign_and_damaged_states_are_refused(unit):
    one = unit().start().run(3)
    whole, before = one.serialized(one.state()), bits(one)
    assert summed(np.frombuffer(whole, dtype="<u8")) == whole
    for data, words in (
        (b"", "not one of cranktrain"),
        (b"x" * 500, "not one of cranktrain"),
        (whole[:8] + b"{0" + whole[10:], "comes from another build"),
        (whole[:-8], "damaged"),
        (whole[:-9] + bytes([whole[-9] ^ 1]) + whole[-8:], "damaged"),
        (whole[:200], "damaged"),
    ):
        status, state = one.deserialize(data)
        assert status == ERROR and not state and words in one.log[-1][2], (len(data), one.log[-1:])
    assert bits(one) == before
    one.run(1, first=3)


def test_states_with_fitting_checksums_and_senseless_values_are_refused_or_harmless(unit):
    """Any word of a state may be anything; what is taken can be stepped from, or is refused then."""
    one = unit().start().run(3)
    words = np.frombuffer(one.serialized(one.state()), dtype="<u8")
    odd = [0, 1, 2**32, 2**64 - 1, *np.array([np.nan, np.inf, -1.0, 0.5, 1e300]).view(np.uint64).tolist()]
    points = 4 * 3 * 8  # what is in the points is the kernels' own: state, inputs and rates, each padded to 64 bytes
    for place in range(len(words) - points):
        for value in odd:
            changed = words.copy()
            changed[place] = value
            status, state = one.deserialize(summed(changed))
            if status == OK:
                one.call("SetFMUstate", state)
                one.step(3e-4)
                one.must("FreeFMUstate", byref(state))
    one.must("Reset")
    assert bits(one.start().run(4)) == bits(unit().start().run(4))


# Places, bytes, in a state: of the values, of rates and start values of the two inputs, and of the state in the present
# point, behind its time.
VALUES, RATES, STARTS, POINT = 136, 136 + 8 * len(V), 136 + 8 * len(V) + 16, 8 * (1 - 4 * 3 * 8)
DAMAGED = (
    *((92, phase) for phase in (0, 5, 64)),
    *((place, 3) for place in (96, 100, 104, 108)),  # variant, numbers in a point and of past points, the last of these
)
SENSELESS = (
    *((place, time) for place in (112, 128) for time in (1.01e15, -1.01e15)),  # start, end of the step
    (120, np.nan),  # stop
    *((place, speed) for place in (VALUES + 8 * V["speed"], STARTS) for speed in (2000.5, np.nan)),
    (VALUES + 8 * V["damping"], -1.0),
    *((VALUES + 8 * V["spring.level"], level) for level in (-0.5, 0.5, 2.0)),  # of two
    (VALUES + 8 * V["author"], 1.0),
    (RATES, np.inf),
    *((POINT, number) for number in (np.nan, np.inf, -2.0e15)),
)


@pytest.mark.parametrize(("place", "odd"), [*DAMAGED, *SENSELESS])
def test_numbers_that_no_instance_takes_are_refused_in_states_too(unit, place, odd):
    """Also where the checksum fits: bounds of values are those of setting the variable."""
    one = unit().start().run(3)
    changed = np.frombuffer(one.serialized(one.state()), dtype="u1").copy()
    number = np.array([odd], dtype="<u4" if (place, odd) in DAMAGED else "<f8").view("u1")
    changed[place:][: number.size] = number
    status, _ = one.deserialize(summed(changed.view("<u8")))
    assert status == ERROR and ("damaged" if number.size == 4 else "not one of a run") in one.log[-1][2]


def test_calls_without_a_state_are_refused(unit):
    one = unit().start()
    state = one.state()
    size = c_size_t()
    for name, arguments in (
        ("GetFMUstate", (None,)),
        ("SetFMUstate", (None,)),
        ("SerializedFMUstateSize", (None, byref(size))),
        ("SerializedFMUstateSize", (state, None)),
        ("SerializeFMUstate", (None, b"x" * 9, c_size_t(9))),
        ("SerializeFMUstate", (state, None, c_size_t(9))),
        ("DeSerializeFMUstate", (None, c_size_t(9), byref(c_void_p()))),
        ("DeSerializeFMUstate", (b"x" * 9, c_size_t(9), None)),
    ):
        assert "no FMU state" in one.refused(name, *arguments), name
    assert "a serialized FMU state takes" in one.refused("SerializeFMUstate", state, b"x" * 9, c_size_t(9))
    one.must("FreeFMUstate", None).must("FreeFMUstate", byref(c_void_p()))
    one.must("FreeFMUstate", byref(state))


def test_reset_starts_anew(unit):
    one = unit().start()
    first = bits(one.run(20))
    one.set("Real", {V["speed"]: 10.0})
    one.run(20, first=20).must("Reset")
    assert bits(one.start().run(20)) == first
