"""Schemes whose cranktrain, of FMI 3.0, calls its master inside a step: what they share, and exchanges there."""

from contextlib import closing
from types import SimpleNamespace

import numpy as np
import pytest
from inside_a_step import COARSE_DEG, Made, error, step_of, system_of, torsion

from cranktrain.core.errors import InputError
from cranktrain_lab.coupling.master import Exchange, Master
from cranktrain_lab.coupling.modules import COMBUSTION
from cranktrain_lab.coupling.run import Steps, run
from cranktrain_lab.coupling.schemes import INSIDE
from cranktrain_lab.coupling.supervised import run_supervised
from cranktrain_lab.coupling.unit import Around, UnitError

SIZE = step_of()


@pytest.fixture(params=list(INSIDE))
def scheme(request):
    return request.param


def test_a_state_that_is_restored_gives_the_same_bits(calling_six, scheme):
    master = system_of(calling_six, scheme).master()

    def gone(count):
        for _ in range(count):
            master.step(master.time + SIZE)
        return master.newest.copy()

    try:
        master.initialize()
        gone(30)
        state = master.keep()
        first = gone(7)
        master.restore(state)
        np.testing.assert_array_equal(gone(7), first)
    finally:
        master.close()


def test_a_run_in_its_own_process_gives_the_same_bits(calling_six, scheme):
    make = Made(calling_six, scheme)
    found = run_supervised(make, 40 * SIZE, Steps(SIZE))
    system = make()
    with closing(system.master()) as master:
        master.initialize()
        here = run(master, found.times[-1], Steps(SIZE), system.bonds)
    np.testing.assert_array_equal(found.values, here.values)


@pytest.mark.parametrize("failure", [UnitError("no burn"), KeyboardInterrupt()])
def test_what_fails_inside_a_step_ends_the_run(calling_six, scheme, failure):
    """The partner is named with the time; an interrupt is not lost in the FMU that is being called."""
    system = system_of(calling_six, scheme)
    asked = SimpleNamespace(steps=0, second=False)

    class Failing(Around):
        def step(self, time, size):
            asked.steps += asked.second
            if asked.steps == 2:
                raise failure
            super().step(time, size)

    units = [Failing(unit) if name == COMBUSTION else unit for name, unit in system.units.items()]
    with closing(Master(units, system.connections, system.exchange, system.outputs)) as master:
        master.initialize()
        master.step(SIZE)
        asked.second = True
        with pytest.raises(type(failure), match="combustion, step from .*: no burn" if str(failure) else None):
            master.step(2.0 * SIZE)
        assert asked.steps == 2


CYCLE = step_of(720.0)
CYCLES = 3


def coupled(engine, scheme, step_deg, cycles=CYCLES, reconstruction="own"):
    """Torsion of the pulley every 1.5 degrees, rad."""
    system = system_of(engine, scheme, step_deg, reconstruction=reconstruction)
    return torsion(system, step_of(step_deg), cycles * CYCLE, step_of())


def test_torsion_at_coarse_steps_has_the_error_of_fine_ones(calling):
    """RMS over the last cycle against steps of 0.125 degrees, relative to the alternating part."""
    engine = calling.without_valves
    exact = coupled(engine, "gauss-seidel", 0.125)
    plain, inside = (
        error(coupled(engine, scheme, COARSE_DEG), exact, round(720.0 / COARSE_DEG))
        for scheme in ("gauss-seidel", "intermediate")
    )
    assert inside < min(1.0e-3, 0.2 * plain)


@pytest.mark.parametrize("reconstruction", ["own", "linear", "hold"])
def test_an_intermediate_update_is_an_exchange_at_its_points(calling_six, reconstruction):
    """A step of 1.5 degrees has two of them, so it is three steps of 0.5 degrees to rounding."""
    six = calling_six.without_valves
    inside = coupled(six, "intermediate", COARSE_DEG, 0.5, reconstruction)
    between = coupled(six, "gauss-seidel", 0.5, 0.5, reconstruction)
    np.testing.assert_allclose(inside, between, rtol=0.0, atol=1e-9 * np.abs(between).max())


class Calling:
    """A unit with updates at given fractions of a step, one list for each step in turn."""

    updates = restorable = True
    name = "calling"

    def __init__(self, fractions):
        self.fractions = list(fractions)
        self.inputs, self.outputs = {}, {}

    def listen(self, call):
        self.call = call

    def step(self, time, size):
        for share in self.fractions.pop(0):
            self.call(time + share * size)

    link = initialize = write = restore = close = keep = lambda self, *values: None
    read = lambda self: np.zeros(0)  # noqa: E731


@pytest.mark.parametrize(
    ("fractions", "said"),
    [
        ([[0.5], [0.5], [0.4]], "an intermediate update at 1.4 s, but 1.5 s was due"),
        ([[0.5], [0.5], [0.5, 0.7]], "an intermediate update at 1.7 s, but 2 s was due"),
        ([[0.5], [0.5], []], "no intermediate update at 1.5 s, where one was due"),
    ],
)
def test_points_that_move_are_an_error(fractions, said):
    master = Master([Calling(fractions)], [], Exchange("intermediate"))
    master.initialize()
    master.step(1.0)
    with pytest.raises(UnitError, match=f"calling: {said}"):
        master.step(2.0)


def test_a_unit_that_cannot_go_back_is_refused():
    unit = Calling([])
    unit.restorable = False
    with pytest.raises(InputError, match="cannot keep and restore its state"):
        Master([unit], [], Exchange("intermediate"))
