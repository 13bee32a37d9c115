"""Which call is allowed when, what a step may be, and what the host's callbacks are used for."""

import ctypes
import math
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_void_p

import pytest
from mock_unit import GUID, REFERENCE
from raw_unit import DISCARD, ERROR, LAST_TIME, MODEL_EXCHANGE, OK, PENDING, STATUS, TERMINATED
from some import some

V = REFERENCE
PHASES = ("instantiated", "initializing", "stepped", "failed", "terminated")


def brought(one, phase):
    """Bring a fresh instance into a phase."""
    if phase == "instantiated":
        return one
    one.setup().must("EnterInitializationMode")
    if phase == "initializing":
        return one
    one.must("ExitInitializationMode").run(2)
    if phase == "failed":
        one.set("Real", {V["force"]: 2000.0})
        assert one.step(2e-4) == DISCARD
        one.set("Real", {V["force"]: 10.0})
    if phase == "terminated":
        one.must("Terminate")
    del one.log[:]
    return one


def calls(one):
    """A call of each kind: name, arguments, and the phases in which FMI 2.0.4, section 4.2.4, allows it."""
    place = byref(c_double())
    state = c_void_p()
    real = one.values("Real", {V["position"]: 0.0})
    force = one.values("Real", {V["force"]: 11.0})
    text = one.values("String", {V["author"]: "nobody"})
    every, running = PHASES, ("stepped", "failed", "terminated")
    # "failed" among those of SetReal, SetRealInputDerivatives and DoStep is more than the standard allows.
    return (
        ("SetDebugLogging", (0, c_size_t(0), None), every),
        ("SetupExperiment", (0, 0.0, 0.0, 0, 0.0), ("instantiated",)),
        ("EnterInitializationMode", (), ("instantiated",)),
        ("ExitInitializationMode", (), ("initializing",)),
        ("Terminate", (), ("stepped", "failed")),
        ("Reset", (), every),
        ("GetReal", real, PHASES[1:]),
        ("GetString", text, PHASES[1:]),
        ("SetReal", force, PHASES[:4]),
        ("SetString", text, PHASES[:2]),
        ("SetRealInputDerivatives", one.rates("Set", {V["force"]: 1.0}), PHASES[:4]),
        ("GetRealOutputDerivatives", one.rates("Get", {V["position"]: 0.0}), running),
        ("GetDirectionalDerivative", (*real[:2], *force, real[2]), PHASES[1:]),
        ("GetFMUstate", (byref(state),), every),
        ("FreeFMUstate", (byref(state),), every),
        ("DoStep", (2e-4, 1e-4, 1), ("stepped", "failed")),
        ("CancelStep", (), ()),
        ("GetStatus", (STATUS, byref(c_int())), running),
        ("GetRealStatus", (LAST_TIME, place), running),
        ("GetBooleanStatus", (TERMINATED, byref(c_int())), running),
    )


@pytest.mark.parametrize("phase", PHASES)
def test_calls_are_allowed_as_the_standard_says(unit, phase):
    for k, (name, _, phases) in some(enumerate(calls(unit()))):
        one = brought(unit("a unit"), phase)
        _, arguments, _ = calls(one)[k]
        status = one.call(name, *arguments)
        assert status == (OK if phase in phases else ERROR), name
        if status == ERROR:
            [(_, category, text)] = one.log
            assert category == "logStatusError" and text.startswith("a unit: "), text
            one.must("Reset")
        elif name != "Terminate":
            assert one.log == []
        one.free()


def test_a_call_without_an_instance_is_refused(unit):
    one = unit()
    for name, arguments, _ in some(calls(one)):
        function = getattr(one.library, f"fmi2{name}")
        given = [c_double(a) if isinstance(a, float) else a for a in arguments]
        assert function(None, *given) == ERROR, name
    one.library.fmi2FreeInstance(None)


def test_every_function_of_the_standard_is_there(unit):
    library = unit().library
    library.fmi2GetTypesPlatform.restype = library.fmi2GetVersion.restype = c_char_p
    assert (library.fmi2GetTypesPlatform(), library.fmi2GetVersion()) == (b"default", b"2.0")


STEPS = [
    (3e-4, 0.0, "communication step of 0.0 s at time 0.0003 s; it must be positive, in seconds"),
    (3e-4, -1e-4, "communication step of -0.0001 s"),
    (3e-4, math.nan, "communication step of nan s"),
    (3e-4, 1e4, "communication step of 10000 s at t = 0.0003 s is too long; at most 1 s"),
    (3e-4, math.inf, "communication step of inf s"),
    (1.0, 1e-4, "the master steps from 1.0 s but the model stands at 0.0003"),
    (0.0, 1e-4, "the master steps from 0.0 s but the model stands at 0.0003"),
    (math.nan, 1e-4, "the master steps from nan s"),
    (3e-4, 0.2, "a step to 0.2003 s leads beyond the stop time of 0.1 s"),
]


@pytest.mark.parametrize(("time", "step", "words"), STEPS)
def test_steps_that_cannot_be_are_refused(unit, time, step, words):
    one, other = unit().start(stop=0.1).run(3), unit().start().run(4)
    assert one.refused("DoStep", time, step, 1).startswith(f"unit: {words}")
    one.run(1, first=3)
    assert one.get("Real", V["position"]) == other.get("Real", V["position"])


def test_the_last_step_may_end_at_the_stop_time_but_for_rounding(unit):
    one = unit().start(stop=1e-3).run(9)
    assert one.step(9e-4, 1e-4 * (1 + 1e-9)) == OK
    assert "beyond the stop time" in one.refused("DoStep", 1e-3, 1e-4, 1)


@pytest.mark.parametrize(
    ("start", "stop", "words"),
    [
        (math.nan, None, "the start time is nan; it must be a finite time in seconds"),
        (math.inf, None, "the start time is inf"),
        (1e300, None, "the start time is 1e+300; it must be a finite time in seconds, at most 1e+06"),
        (-1e7, None, "the start time is -10000000.0"),
        (1.0, 0.5, "the stop time is 0.5; it must not lie before the start"),
        (1.0, math.nan, "the stop time is nan"),
    ],
)
def test_an_experiment_without_sense_is_refused(unit, start, stop, words):
    one = unit()
    arguments = 0, 0.0, float(start), int(stop is not None), float(stop or 0.0)
    assert one.refused("SetupExperiment", *arguments).startswith(f"unit: {words}")
    one.start(2.0)
    assert one.real_status() == (OK, 2.0)


def test_no_step_leads_to_where_times_lack_digits(unit):
    one = unit().start(1e6)
    assert one.step(1e6, 0.5) == OK
    assert "a step to 1000001.25 s; times beyond 1e+06 s are too large" in one.refused("DoStep", 1e6 + 0.5, 0.75, 1)


def test_slivers_of_time_change_nothing_and_the_next_step_makes_up_for_them(unit):
    one, plain = unit().start(), unit().start().run(10)
    for k in range(10):
        for sliver in (1e-12, 1.7e-18, 1e-300):
            assert one.step(k * 1e-4 + 1e-9, sliver) == OK
        assert one.step(k * 1e-4 + 1e-9, 1e-4 - 1e-9) == OK
    assert one.one("Real", V["position"]) == pytest.approx(plain.one("Real", V["position"]), rel=1e-6)
    before = one.one("Real", V["position"]), one.real_status()
    assert one.step(1e-3 - 1e-10, 1e-11) == OK  # the master lags: nothing is left of the step
    assert (one.one("Real", V["position"]), one.real_status()) == before


def test_what_status_can_be_told(unit):
    one = unit().start(0.5)
    assert one.step(0.5) == OK
    assert one.real_status() == (OK, 0.5001)
    ended = c_int(7)
    one.must("GetBooleanStatus", TERMINATED, byref(ended))
    assert ended.value == 0
    for name, kind in (
        ("Status", PENDING),
        ("RealStatus", STATUS),
        ("IntegerStatus", STATUS),
        ("StringStatus", PENDING),
    ):
        assert one.call(f"Get{name}", kind, byref(c_double())) == DISCARD
        assert one.call(f"Get{name}", kind, None) == ERROR


def test_what_goes_wrong_is_logged_and_events_if_wanted(unit):
    quiet, speaking = unit(), unit(logging=True)
    for one in (quiet, speaking):
        one.start()
        one.refused("EnterInitializationMode")
    assert [line[1] for line in quiet.log] == ["logStatusError"]
    assert [line[1] for line in speaking.log] == ["logEvents", "logStatusError"]


@pytest.mark.parametrize(
    ("chosen", "heard"),
    [
        ((), ["logStatusWarning", "logStatusDiscard", "logStatusError"]),
        (("logAll",), ["logStatusWarning", "logStatusDiscard", "logStatusError"]),
        (("logStatusDiscard",), ["logStatusDiscard"]),
        (("logStatusError", "logStatusWarning"), ["logStatusWarning", "logStatusError"]),
        (("logEvents",), []),
    ],
)
def test_the_host_chooses_what_it_hears(unit, chosen, heard):
    one = unit().start()
    names = (c_char_p * len(chosen))(*(name.encode() for name in chosen))
    one.must("SetDebugLogging", 1, c_size_t(len(chosen)), names)
    assert one.step(0.0, 1e-2) == OK
    one.set("Real", {V["force"]: 2000.0})
    assert one.step(1e-2) == DISCARD
    assert one.call("ExitInitializationMode") == ERROR
    assert [line[1] for line in one.log] == heard


def test_unknown_categories_are_refused(unit):
    one = unit()
    names = (c_char_p * 2)(b"logAll", b"logNothing")
    assert "no log category 'logNothing'; valid: logEvents" in one.refused("SetDebugLogging", 1, c_size_t(2), names)
    assert "without the names" in one.refused("SetDebugLogging", 1, c_size_t(2), None)
    names[1] = None
    assert "no log category ''" in one.refused("SetDebugLogging", 1, c_size_t(2), names)


class Heap:
    """Memory for an instance: counted, and from the ``last``-th piece on refused."""

    def __init__(self, last=math.inf):
        self.library = ctypes.CDLL(None)
        self.library.calloc.restype = c_void_p
        self.pieces, self.given, self.last = set(), 0, last

    def allocate(self, count, size):
        if self.given >= self.last:
            return None
        self.given += 1
        piece = self.library.calloc(c_size_t(count), c_size_t(size))
        ctypes.memset(piece, 0xA5, count * size)  # a host that does not keep to the zeros that the standard demands
        self.pieces.add(piece)
        return piece

    def release(self, piece):
        self.pieces.remove(piece)
        self.library.free(c_void_p(piece))


def life(one):
    """A life with a state in it; how it ended."""
    state = c_void_p()
    for call in (
        ("SetupExperiment", 0, 0.0, 0.0, 0, 0.0), ("EnterInitializationMode",), ("ExitInitializationMode",),
        ("GetFMUstate", byref(state)), ("DoStep", 0.0, 1e-4, 1), ("Reset",), ("SetFMUstate", state),
        ("DoStep", 0.0, 1e-4, 1), ("FreeFMUstate", byref(state)),
    ):  # fmt: skip
        if one.call(*call) != OK:
            if state:
                one.must("FreeFMUstate", byref(state))
            return ERROR
    return OK


def test_all_memory_comes_from_the_host_and_goes_back(unit):
    heap = Heap()
    one = unit(memory=(heap.allocate, heap.release))
    assert life(one) == OK
    one.free()
    assert heap.given > 6 and heap.pieces == set()


def test_a_state_taken_again_gets_new_memory_only_where_it_has_grown(unit):
    heap, state = Heap(), c_void_p()
    one = unit(memory=(heap.allocate, heap.release)).must("GetFMUstate", byref(state)).start().run(2)
    before = heap.given
    for _ in range(2):
        one.must("GetFMUstate", byref(state))
        assert heap.given == before + 1
    one.must("FreeFMUstate", byref(state))


def test_no_piece_of_memory_may_lack(unit):
    """Wherever memory ends, the host hears of it, and nothing is lost of what it gave."""
    whole = Heap()
    life(unit(memory=(whole.allocate, whole.release)))
    for last in some(range(whole.given)):
        heap = Heap(last)
        one = unit(memory=(heap.allocate, heap.release))
        assert one.component is None or life(one) == ERROR
        assert "no memory" in one.log[-1][2], last
        if one.component is not None:
            one.free()
        assert heap.pieces == set()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"kind": MODEL_EXCHANGE}, "this FMU is for co-simulation, not for model exchange"),
        ({"name": ""}, "an instance without a name"),
        ({"name": None}, "an instance without a name"),
        ({"guid": None}, "no GUID"),
        ({"guid": GUID.upper()}, "is not this FMU's, {8c4e810f-3df3-4a00-8276-176fa3c9f9e0}"),
        ({"guid": "x" * 5000}, "is not this FMU's"),
        ({"resources": None}, "no fmuResourceLocation"),
    ],
)
def test_instances_that_cannot_be_are_refused(unit, options, words):
    one = unit(**options)
    [(status, category, text)] = one.log
    assert one.component is None and (status, category) == (ERROR, "logStatusError") and words in text
