"""What schemes have in common whose cranktrain, of FMI 3.0, calls its master inside a step."""

from types import SimpleNamespace

import numpy as np
import pytest
from fmus_by_version import torsional_fmu
from inside_a_step import Made, step_of, system_of

from cranktrain.core.errors import InputError
from cranktrain_lab.coupling.master import Master
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
    master = system.master()
    try:
        master.initialize()
        here = run(master, found.times[-1], Steps(SIZE), system.bonds)
    finally:
        master.close()
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
    master = Master(units, system.connections, system.exchange, system.outputs)
    try:
        master.initialize()
        master.step(SIZE)
        asked.second = True
        with pytest.raises(type(failure), match="combustion, step from .*: no burn" if str(failure) else None):
            master.step(2.0 * SIZE)
        assert asked.steps == 2
    finally:
        master.close()


# ------------------------------------------------------------------ what cannot be


@pytest.fixture(scope="module")
def silent(tmp_path_factory):
    """A cranktrain of FMI 2.0, which calls nobody."""
    return torsional_fmu("diesel_i6", tmp_path_factory.mktemp("silent"), "2.0")


def test_a_crank_of_fmi_2_is_refused_in_one_line(calling_six, silent, scheme):
    system = system_of(calling_six._replace(cranktrain=silent), scheme)
    with pytest.raises(InputError, match="cranktrain does not call its master inside a step; take gauss-seidel") as e:
        system.master()
    assert str(e.value).startswith(f"scheme '{scheme}'") and "\n" not in str(e.value)
