"""Units whose C functions compiled code calls: the bits of the master's own calls, the same errors, notes of calls.

Functions of FMI 3.0, arrays and events: ``tests/fmu/test_turns_of_foreign_units.py``.
"""

import ctypes

import numpy as np
import pytest
from two_mass_units import units

from cranktrain.core import unit_turns
from cranktrain_lab.coupling.exchanged_values import ExchangedValues, Place
from cranktrain_lab.coupling.master import Exchange, Master
from cranktrain_lab.coupling.run import Bond, Steps, run
from cranktrain_lab.coupling.turns import Calls, Direct
from cranktrain_lab.coupling.unit import Around, Port, UnitError
from cranktrain_lab.stability.two_mass import TwoMass

pytestmark = pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")  # of what C calls
POINTER = ctypes.c_void_p
VALUES = ctypes.CFUNCTYPE(ctypes.c_int, POINTER, POINTER, ctypes.c_size_t, POINTER)
STEP = ctypes.CFUNCTYPE(ctypes.c_int, POINTER, ctypes.c_double, ctypes.c_double, ctypes.c_int)
VALUES_3 = ctypes.CFUNCTYPE(ctypes.c_int, POINTER, POINTER, ctypes.c_size_t, POINTER, ctypes.c_size_t)
STEP_3 = ctypes.CFUNCTYPE(
    ctypes.c_int, POINTER, ctypes.c_double, ctypes.c_double, ctypes.c_bool,
    *(ctypes.POINTER(ctypes.c_bool),) * 3, ctypes.POINTER(ctypes.c_double),
)  # fmt: skip
STOP = 2.0


class InC(Around):
    """A mass that is called through C functions, of which one may answer with a status from some time on."""

    def __init__(self, unit, call=None, status=0, notes=None):
        super().__init__(unit)
        self.inputs = {name: Port(low=-0.02, high=0.02) for name in unit.inputs}  # no feeds: it is a unit of its steps
        self.odd, self.status, self.notes, self.time = call, status, notes, 0.0

    def link(self, inputs, outputs):
        super().link(inputs, outputs)
        self.sizes = len(inputs), len(outputs)

    def direct(self):
        self.called = VALUES(self.set), STEP(self.go), VALUES(self.get)
        return self.by(unit_turns.FMI_2)

    def by(self, version):
        addresses = [ctypes.cast(function, ctypes.c_void_p).value for function in self.called]
        given, taken = (ExchangedValues(range(n), [Place(k) for k in range(n)], {}) for n in self.sizes)
        return Direct(Calls(version, *addresses, 1), given, taken, True, self.fail, self.notes, 0)

    def answer(self, call):
        return self.status if call == self.odd and self.time > 0.5 * STOP else 0

    def set(self, component, references, count, values):
        assert component == 1 and count == self.sizes[0]
        self.write(np.ctypeslib.as_array(ctypes.cast(values, ctypes.POINTER(ctypes.c_double)), (count,)).copy())
        return self.answer(unit_turns.INPUTS)

    def go(self, component, time, size, no_state_before):
        self.time = time
        super().step(time, size)
        return self.answer(unit_turns.STEPPING)

    def get(self, component, references, count, values):
        np.ctypeslib.as_array(ctypes.cast(values, ctypes.POINTER(ctypes.c_double)), (count,))[:] = self.read()
        return self.answer(unit_turns.OUTPUTS)

    def fail(self, failed):
        raise UnitError(f"call {failed.call} said {failed.status}")


class Eventful(InC):
    """By functions of FMI 3.0; after half of the run it tells of an event, its flags are those of a new step."""

    def direct(self):
        given, taken = (VALUES_3(lambda *told, own=own: own(*told[:-1])) for own in (self.set, self.get))
        self.called = given, STEP_3(self.tell), taken
        return self.by(unit_turns.FMI_3)

    def tell(self, component, time, size, no_state_before, event, ended, early, reached):
        assert no_state_before and not (event[0] or ended[0] or early[0])
        event[0], reached[0] = time > 0.5 * STOP, time + 0.25 * size
        return self.go(component, time, size, no_state_before)


def coupled(scheme, reconstruction, wrap):
    """A run of two masses, the second, whose outputs feed nothing at once, wrapped."""
    made, links = units(TwoMass(), "displacement/displacement")
    master = Master([wrap(unit) for unit in made], links, Exchange(scheme, reconstruction))
    master.initialize()
    bond = Bond("shared", [(("first", "v1"), ("second", "x1"))], [(("second", "v2"), ("first", "x2"))])
    return master, [bond]


@pytest.mark.parametrize("scheme", ["jacobi", "gauss-seidel", "iterative"])
@pytest.mark.parametrize("reconstruction", ["hold", "linear", "quadratic"])
@pytest.mark.parametrize("error", [None, 1e-3])
def test_compiled_turns_give_the_bits_of_the_masters_own(scheme, reconstruction, error):
    """Also if one of two units is called by the master itself; bounds of inputs are reached."""

    class Plain(InC):
        direct = None

    def first_only(unit):
        return InC(unit) if unit.name == "first" else Plain(unit)

    found = []
    for wrap in (Plain, InC, first_only):
        master, bonds = coupled(scheme, reconstruction, wrap)
        assert (master._turns is None) == (wrap is Plain)
        steps = Steps(0.05) if error is None else Steps(0.05, error, 0.005, 0.2)
        found.append(run(master, STOP, steps, bonds))
    plain, *others = found
    for other in others:
        assert np.array_equal(other.values, plain.values) and np.array_equal(other.times, plain.times)
        assert np.array_equal(other.residuals["shared"], plain.residuals["shared"])
        assert (other.steps, other.refused, other.sweeps) == (plain.steps, plain.refused, plain.sweeps)


@pytest.mark.parametrize("call", [unit_turns.INPUTS, unit_turns.OUTPUTS, unit_turns.STEPPING])
@pytest.mark.parametrize("status", [-1, 2, 3])
def test_a_status_that_is_not_good_ends_the_run_with_unit_time_and_call(call, status):
    notes = np.zeros(unit_turns.NOTE_SLOTS, dtype=np.int64)

    def wrap(unit):
        return InC(unit, call=call, status=status if unit.name == "second" else 0, notes=notes)

    master, bonds = coupled("gauss-seidel", "linear", wrap)
    when = "second, step from " if call == unit_turns.STEPPING else "second at "
    with pytest.raises(UnitError, match=f"{when}.*: call {call} said {status}"):
        run(master, STOP, Steps(0.05), bonds)
    assert notes[unit_turns.NOTE_CALL] == call and notes[unit_turns.NOTE_COUNT] % 2 == 1


@pytest.mark.parametrize("wrap", [Eventful, lambda unit: InC(unit, unit_turns.STEPPING, 1)])
def test_an_event_alone_ends_nothing(wrap):
    """Nor does a warning."""
    master, bonds = coupled("gauss-seidel", "linear", wrap)
    assert run(master, STOP, Steps(0.05), bonds).times[-1] == STOP


def test_calls_are_noted_and_a_run_that_is_to_stop_stops_before_the_next_step():
    notes = np.zeros(unit_turns.NOTE_SLOTS, dtype=np.int64)
    master, _ = coupled("gauss-seidel", "hold", lambda unit: InC(unit, notes=notes))
    master.step(0.1)
    # Two units, three calls, begun and ended.
    assert notes[unit_turns.NOTE_COUNT] == 2 * 2 * 3 and notes[unit_turns.NOTE_CALL] == 0
    notes[unit_turns.NOTE_STOP] = 1
    with pytest.raises(KeyboardInterrupt):
        master.step(0.2)


def test_a_mean_of_fewer_points_forgets_those_before():
    """Weights are those of the new value, then of earlier points, newest first, and of no more than are given."""
    master, _ = coupled("gauss-seidel", "quadratic", InC)
    for time in (0.1, 0.2, 0.3, 0.4):
        master.step(time)
    turns = master._turns
    known, samples = turns.arguments[8:10]
    n = samples.shape[1]
    for first, *others in ((0.5, 0.3, 0.2), (1.5, -0.5), (1.0,)):
        turns.weigh([first, *others])
        turns.take(unit_turns.MEAN, 0, 2, 0.4, 0.1)
        wanted = first * known[n : 2 * n] + sum(weight * samples[k] for k, weight in enumerate(others))
        assert known[:n] == pytest.approx(wanted, rel=1e-12)
