"""Output clocks and event mode of FMI 3.0: a clock ticks where an angle passes its mark; here a mass passes two places.

The mass starts at rest at 0.11 m and swings with little friction about 1 m, so it passes 0.35 m and 0.5 m up and down.
"""

import ctypes
import random
from ctypes import byref, c_bool, c_double, c_size_t, c_uint32, c_void_p

import mock_unit
import pytest
from mock_unit import GUID, REFERENCE
from raw3_unit import Raw3
from raw_unit import DISCARD, ERROR, OK, instances

V = REFERENCE
TIME = len(REFERENCE)
PLACES = (0.5, 0.35)
"""Marks of the two clocks, m: start values of the parameters damping (kg/s as well) and length, taken as an array."""
CLOCKS = TIME + 1, TIME + 2
NEAR = 1e-6
"""Distance behind its mark, m, at which a clock ticks at the latest."""
ARRAYS, MARKS = f"{V['damping']}*2", f"{V['position']} {V['damping']} 1"
FIRST, SECOND = (True, False), (False, True)


@pytest.fixture(scope="module")
def resources(tmp_path_factory):
    """The mock's data with a clock for each place."""
    folder = tmp_path_factory.mktemp("resources")
    (folder / "native.bin").write_bytes(mock_unit.native_bin(arrays=ARRAYS, clocks=MARKS))
    return folder


@pytest.fixture
def unit3(binary, resources):
    """A function that makes instances with event mode and early return."""
    chosen = {"events": True, "early": True}
    yield from instances(lambda folder=resources, **options: Raw3(binary, folder, GUID, **chosen | options))


def set_off(one, events=True):
    """Start at rest, then push for good; behind the event mode of the start."""
    one.set("Float64", [V["speed"]], [0.0]).start()
    if events:
        handled(one)
    return one.set("Float64", [V["force"]], [100.0])


def ticks(one, references=CLOCKS):
    values = (c_bool * len(references))()
    one.must("GetClock", (c_uint32 * len(references))(*references), c_size_t(len(references)), values)
    return tuple(values)


def updated(one):
    flags, time = [c_bool(True) for _ in range(5)], c_double()
    one.must("UpdateDiscreteStates", *map(byref, flags), byref(time))
    assert not any(flag.value for flag in flags)
    return one


def handled(one):
    return updated(one).must("EnterStepMode")


def motion(one):
    return one.get("Float64", V["position"], V["velocity"])


def swung(one, end, step):
    """Time, place and clocks of each event of a run."""
    found, time, k = [], 0.0, 0
    while k * step < end - 1e-9:
        target = (k + 1) * step
        assert one.step(time, target - time) == OK, one.log[-1:]
        event, terminate, early, time = one.told
        assert not terminate and early == (time < target) and (event or not early)
        k += not early
        if event:
            one.must("EnterEventMode")
            found.append((time, motion(one)[0], ticks(one)))
            handled(one)
            assert one.get("Float64", TIME) == [time]
    return found


@pytest.mark.parametrize("step", [1e-4, 1.7e-3, 0.02])
def test_a_clock_ticks_at_its_place_whichever_way_it_is_passed(unit3, step):
    """In the order of the places, upwards and downwards; at the place or less than 1e-6 m behind it."""
    found = swung(set_off(unit3()), 0.88, step)
    assert [clocks for _, _, clocks in found] == [SECOND, FIRST, FIRST, SECOND]
    for sign, (_, place, clocks) in zip((1.0, 1.0, -1.0, -1.0), found, strict=True):
        assert 0.0 <= sign * (place - PLACES[clocks.index(True)]) <= NEAR
    times = [time for time, _, _ in found]
    assert times == sorted(times) and 0.0 < times[0] < 0.2 and 0.7 < times[-1] < 0.88


def test_steps_without_event_mode_are_those_of_an_fmu_without_clocks(unit, unit3):
    """To the bit, and no event is told."""
    one, other = set_off(unit3(events=False), events=False), unit()
    other.set("Real", {V["speed"]: 0.0}).start().set("Real", {V["force"]: 100.0})
    for k in range(300):
        assert one.step(k * 1e-3, 1e-3) == OK and one.told[:3] == (False, False, False)
        other.run(1, k, 1e-3)
    assert motion(one) == other.get("Real", V["position"], V["velocity"])


def test_events_are_told_at_the_end_of_a_step_that_may_not_end_early(unit3):
    """Both clocks then tick at once; the motion is that of steps without events."""
    one, plain = set_off(unit3(early=False)), set_off(unit3(events=False), events=False)
    assert one.step(0.0, 0.15) == OK and plain.step(0.0, 0.15) == OK
    assert one.told == (True, False, False, 0.15) and plain.told == (False, False, False, 0.15)
    assert motion(one) == motion(plain)
    assert ticks(one.must("EnterEventMode")) == (True, True)


def test_a_clock_is_active_until_discrete_states_are_updated(unit3):
    one = unit3().start()
    assert ticks(one) == (False, False), "nothing ticks at the start"
    handled(one).set("Float64", [V["force"]], [100.0])
    first_event(one)
    one.must("EnterEventMode")
    assert ticks(one) == SECOND and ticks(one, CLOCKS[:1]) == (False,) and ticks(one, ()) == ()
    assert ticks(updated(one)) == (False, False)
    one.must("EnterStepMode").must("EnterEventMode")
    assert ticks(one) == (False, False), "an event of the host's own"
    one.set("Float64", [V["force"]], [50.0]).must("EnterStepMode")
    assert one.get("Float64", V["force"]) == [50.0] and one.step(one.told[3], 1e-3) == OK


def first_event(one, time=0.0, step=0.05):
    while True:
        assert one.step(time, step) == OK
        time = one.told[3]
        if one.told[0]:
            return one


def test_a_place_is_found_inside_a_step_that_calls_the_host(unit3):
    """Both with intermediate updates, whose parts end at other times, and without."""
    times = []
    inside = set_off(unit3(update=lambda unit, time: times.append(time)))
    inside.set("Float64", [V["speed"]], [100.0])
    found = swung(inside, 0.5, 5e-3)
    assert [clocks for _, _, clocks in found] == [SECOND, FIRST] and len(times) > 1000
    for _, place, clocks in found:
        assert 0.0 <= place - PLACES[clocks.index(True)] <= NEAR
    late = set_off(unit3(update=lambda unit, time: None, early=False)).set("Float64", [V["speed"]], [100.0])
    assert late.step(0.0, 0.2) == OK and late.told == (True, False, False, 0.2)
    assert ticks(late.must("EnterEventMode")) == (True, True)


def saved(one):
    state, size = c_void_p(), c_size_t()
    one.must("GetFMUState", byref(state)).must("SerializedFMUStateSize", state, byref(size))
    data = (ctypes.c_uint8 * size.value)()
    one.must("SerializeFMUState", state, data, size).must("FreeFMUState", byref(state))
    return data


def restored(one, data):
    state = c_void_p()
    one.must("DeserializeFMUState", data, c_size_t(len(data)), byref(state))
    return one.must("SetFMUState", state).must("FreeFMUState", byref(state))


def test_a_state_holds_an_event_that_waits_and_one_that_is_being_handled(unit3):
    one, other = first_event(set_off(unit3())), unit3()
    waits, time = saved(one), one.told[3]
    handles = saved(one.must("EnterEventMode"))
    assert ticks(restored(other, waits).must("EnterEventMode")) == SECOND
    handled(other)
    assert ticks(restored(other, handles)) == SECOND
    for each in (one, other):
        handled(each)
        assert each.step(time, 1e-3) == OK
    assert motion(one) == motion(other)
    assert "before an event was handled" in restored(one, waits).refused("DoStep", *step_arguments(time))


def step_arguments(time, step=1e-3):
    return float(time), step, True, *(byref(c_bool()) for _ in range(3)), byref(c_double())


def test_a_host_without_event_mode_goes_on_from_a_state_with_an_event(unit3):
    one, plain = first_event(set_off(unit3())), unit3(events=False)
    time = one.told[3]
    for data in (saved(one), saved(one.must("EnterEventMode"))):
        assert restored(plain, data).step(time, 1e-3) == OK and plain.told[0] is False


def test_a_reset_forgets_an_event(unit3):
    one = first_event(set_off(unit3())).must("Reset")
    assert one.start().call("EnterStepMode") == OK and one.step(0.0, 1e-4) == OK


def test_a_step_to_an_event_is_one_that_ends_there_at_once(unit3):
    """Motion and its rates, which follow from the points before, are those of a host that knows the time."""
    one, other = set_off(unit3()), set_off(unit3(events=False), events=False)
    time, events = 0.0, 0
    while time < 0.2:
        assert one.step(time, 0.01) == OK
        event, _, _, end = one.told
        assert other.step(time, end - time) == OK
        assert motion(one) == motion(other) and rates(one) == rates(other)
        if event:
            handled(one.must("EnterEventMode"))
        time, events = end, events + event
    assert events == 2


def rates(one):
    given = one.values("Float64", [V["position"], V["velocity"]], [0.0, 0.0])
    one.must("GetOutputDerivatives", *given[:2], (ctypes.c_int32 * 2)(1, 1), *given[2:])
    return list(given[2])


@pytest.mark.parametrize("name", ["EnterEventMode", "EnterStepMode", "UpdateDiscreteStates", "GetClock"])
def test_event_mode_must_have_been_asked_for(unit3, name):
    text = unit3(events=False).start().refused(name, *[c_size_t(0)] * 6)
    assert text.endswith("but this FMU has no event mode, or was instantiated without")


def test_calls_in_a_wrong_mode_are_refused(unit3):
    one, clock = unit3(), ((c_uint32 * 1)(CLOCKS[0]), c_size_t(1), (c_bool * 1)())
    nothing = [c_size_t(0)] * 6
    assert "getClock on an instance that is only instantiated" in one.refused("GetClock", *clock)
    one.start()
    assert "before an event was handled" in one.refused("DoStep", *step_arguments(0.0))
    assert "enterEventMode on an instance that is in event mode" in one.refused("EnterEventMode")
    assert "without a place" in one.refused("UpdateDiscreteStates", *nothing)
    handled(one)
    for name, given in (("GetClock", clock), ("EnterStepMode", ()), ("UpdateDiscreteStates", nothing)):
        assert "is initialized; it must be" in one.refused(name, *given)
    first_event(one.set("Float64", [V["force"]], [100.0]))
    assert "call enterEventMode" in one.refused("DoStep", *step_arguments(one.told[3]))
    one.must("EnterEventMode").must("Terminate")
    assert "is terminated" in one.refused("EnterEventMode")
    assert "no input clocks" in one.refused("SetClock", *nothing)


@pytest.mark.parametrize("reference", [TIME, CLOCKS[-1] + 1, V["position"], 2**32 - 1])
def test_what_is_no_clock_has_no_ticks(unit3, reference):
    one = unit3().start()
    values = (c_bool * 1)()
    assert "no Clock" in one.refused("GetClock", (c_uint32 * 1)(reference), c_size_t(1), values)
    for given in ((None, c_size_t(1), values), ((c_uint32 * 1)(CLOCKS[0]), c_size_t(1), None)):
        assert "without their references" in one.refused("GetClock", *given)
    assert "no Float64" in one.refused("GetFloat64", *one.values("Float64", [CLOCKS[0]], [0.0]))


def test_a_step_without_a_solution_has_no_event(unit3):
    one = set_off(unit3())
    one.set("Float64", [V["force"]], [2000.0])
    assert one.step(0.0, 0.2) == DISCARD and one.told[0] is False
    assert one.set("Float64", [V["force"]], [100.0]).step(0.0, 0.2) == OK and one.told[0] is True


@pytest.mark.parametrize(
    "clocks", ["", "2", "2 5", "2 5 0", "2 5 3", "99 5 1", "2 99 1", "7 5 1", "2 6 1", "2 7 1", "2 5 1 1", "x"]
)
def test_clocks_that_cannot_be_are_refused(unit3, tmp_path, clocks):
    (tmp_path / "native.bin").write_bytes(mock_unit.native_bin(arrays=ARRAYS, clocks=clocks))
    one = unit3(folder=tmp_path)
    assert one.component is None and "native.bin has clocks that cannot be" in one.log[0][2]


def fuzzed(unit3, count, seed):
    """Calls in any order; then a run as of a fresh instance."""
    draw = random.Random(seed)
    one = unit3(update=lambda unit, time: draw.choice([None, None, time]))
    last, state, counts = 0.0, c_void_p(), [0, 0, 0, 0]
    lives = ("EnterEventMode", "EnterStepMode", "ExitInitializationMode", "Terminate", "Reset")
    for _ in range(count):
        place = draw.randrange(12)
        if place < 5:
            status = one.step(draw.choice([last, last, last, 0.0]), draw.choice([1e-3, 0.03, 1e-12, -1.0]))
            last = one.told[3]
        elif place == 5:
            status = one.call(
                "GetClock",
                (c_uint32 * 3)(*CLOCKS, draw.randrange(TIME + 4)),
                c_size_t(draw.choice([2, 3])),
                (c_bool * 3)(),
            )
        elif place == 6:
            status = one.call("UpdateDiscreteStates", *(byref(c_bool()) for _ in range(5)), byref(c_double()))
        elif place == 7:
            status = one.call("EnterInitializationMode", False, 0.0, 0.0, False, 0.0)
        elif place == 8:
            status = one.call(draw.choice(["GetFMUState", "FreeFMUState"]), byref(state))
        elif place == 9:
            status = one.call("SetFMUState", state)
        elif place == 10:
            status = one.call(
                "SetFloat64", *one.values("Float64", [V["force"]], [draw.choice([10.0, 100.0, 300.0, -50.0])])
            )
        else:
            status = one.call(draw.choice(lives[:3] if draw.random() < 0.9 else lives))
        assert status in (OK, DISCARD, ERROR)
        counts[status] += 1
    one.call("FreeFMUState", byref(state))
    one.inside = lambda unit, time: None
    fresh = unit3(update=lambda unit, time: None)
    assert swung(set_off(one.must("Reset")), 0.4, 0.01) == swung(set_off(fresh), 0.4, 0.01)
    assert all(text.startswith("unit: ") and "\n" not in text for _, _, text in one.log)
    assert min(counts[OK], counts[ERROR]) > count // 20


def test_calls_at_random_do_no_harm(unit3):
    fuzzed(unit3, 5_000, 19)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_many_calls_at_random_do_no_harm(unit3, seed):
    fuzzed(unit3, 250_000, seed)
