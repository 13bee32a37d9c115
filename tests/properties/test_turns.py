"""Units whose C functions compiled code calls: the bits of the master's own calls, the same errors, notes of calls."""

import ctypes

import numpy as np
import pytest
from two_mass_units import units

from cranktrain.coupling.exchanged_values import ExchangedValues, Place
from cranktrain.coupling.kernels.exchange import (
    FMI_2,
    INPUTS,
    NOTE_CALL,
    NOTE_COUNT,
    NOTE_SLOTS,
    NOTE_STOP,
    OUTPUTS,
    STEPPING,
)
from cranktrain.coupling.master import Exchange, Master
from cranktrain.coupling.run import Bond, Steps, run
from cranktrain.coupling.turns import Calls, Direct
from cranktrain.coupling.unit import Around, Port, UnitError
from cranktrain.studies.stability.two_mass import TwoMass

VALUES = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p)
STEP = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int)
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
        addresses = [ctypes.cast(function, ctypes.c_void_p).value for function in self.called]
        given, taken = (ExchangedValues(range(n), [Place(k) for k in range(n)], {}) for n in self.sizes)
        return Direct(Calls(FMI_2, *addresses, 1), given, taken, True, self.fail, self.notes, 0)

    def answer(self, call):
        return self.status if call == self.odd and self.time > 0.5 * STOP else 0

    def set(self, component, references, count, values):
        assert component == 1 and count == self.sizes[0]
        self.write(np.ctypeslib.as_array(ctypes.cast(values, ctypes.POINTER(ctypes.c_double)), (count,)).copy())
        return self.answer(INPUTS)

    def go(self, component, time, size, no_state_before):
        self.time = time
        super().step(time, size)
        return self.answer(STEPPING)

    def get(self, component, references, count, values):
        np.ctypeslib.as_array(ctypes.cast(values, ctypes.POINTER(ctypes.c_double)), (count,))[:] = self.read()
        return self.answer(OUTPUTS)

    def fail(self, failed):
        raise UnitError(f"call {failed.call} said {failed.status}")


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


@pytest.mark.parametrize(
    ("call", "when"),
    [(INPUTS, "second at "), (OUTPUTS, "second at "), (STEPPING, "second, step from ")],
)
@pytest.mark.parametrize("status", [-1, 2, 3])
def test_a_status_that_is_not_good_ends_the_run_with_unit_time_and_call(call, when, status):
    notes = np.zeros(NOTE_SLOTS, dtype=np.int64)

    def wrap(unit):
        return InC(unit, call, status if unit.name == "second" else 0, notes)

    master, bonds = coupled("gauss-seidel", "linear", wrap)
    with pytest.raises(UnitError, match=f"{when}.*: call {call} said {status}"):
        run(master, STOP, Steps(0.05), bonds)
    assert notes[NOTE_CALL] == call and notes[NOTE_COUNT] % 2 == 1


def test_a_warning_is_good():
    master, bonds = coupled("gauss-seidel", "linear", lambda unit: InC(unit, STEPPING, 1))
    assert run(master, STOP, Steps(0.05), bonds).times[-1] == STOP


def test_calls_are_noted_and_a_run_that_is_to_stop_stops_before_the_next_step():
    notes = np.zeros(NOTE_SLOTS, dtype=np.int64)
    master, _ = coupled("gauss-seidel", "hold", lambda unit: InC(unit, notes=notes))
    master.step(0.1)
    assert notes[NOTE_COUNT] == 2 * 2 * 3 and notes[NOTE_CALL] == 0  # two units, three calls, begun and ended
    notes[NOTE_STOP] = 1
    with pytest.raises(KeyboardInterrupt):
        master.step(0.2)


def test_a_value_that_is_no_number_is_told_with_its_time():
    class Gone(InC):
        def get(self, component, references, count, values):
            super().get(component, references, count, values)
            if self.time > 0.5 * STOP and self.name == "second":
                ctypes.cast(values, ctypes.POINTER(ctypes.c_double))[0] = float("nan")
            return 0

    master, bonds = coupled("gauss-seidel", "linear", Gone)
    with pytest.raises(UnitError, match=r"second: .* is nan at 1\.1 s"):
        run(master, STOP, Steps(0.05), bonds)
