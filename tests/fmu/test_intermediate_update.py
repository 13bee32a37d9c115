"""Pressures set inside a communication step: the cranktrain of FMI 3.0 calls its master at intermediate points."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from fmus_by_version import module_fmu, torsional_fmu

from cranktrain.core.errors import InputError
from cranktrain.coupling.master import Exchange, Master
from cranktrain.coupling.modules import COMBUSTION, CRANKTRAIN
from cranktrain.coupling.run import Steps, run
from cranktrain.coupling.supervised import run_supervised
from cranktrain.coupling.trace_unit import MeasuredPressures
from cranktrain.coupling.unit import Around, UnitError
from cranktrain.coupling.virtual_engine import Partners, virtual_engine
from cranktrain.engine.file import load_engine
from cranktrain.loads.gas_pressure import GasTrace

SPEED = 2000.0 * math.pi / 30.0
CYCLE = 4.0 * math.pi / SPEED
CYCLES = 3
COARSE_DEG = 1.5
COMBUSTIONS = {"diesel_i6": "combustion_i6", "diesel_v8": "combustion_v8"}


@pytest.fixture(scope="module", params=["diesel_i6", "diesel_v8", "single_petrol"])
def pair(request, tmp_path_factory):
    """Cranktrain of FMI 3.0 and its combustion, for the single the pressures of its trace."""
    folder = tmp_path_factory.mktemp(request.param)
    if request.param in COMBUSTIONS:
        gas = module_fmu(COMBUSTIONS[request.param], folder)
    else:
        engine = load_engine(request.param)
        gas = MeasuredPressures(engine, GasTrace.from_engine(engine))
    return torsional_fmu(request.param, folder), gas


@pytest.fixture(scope="module")
def six(tmp_path_factory):
    """Likewise of the six alone."""
    folder = tmp_path_factory.mktemp("six")
    return torsional_fmu("diesel_i6", folder), module_fmu("combustion_i6", folder)


def system_of(pair, scheme, step_deg, reconstruction="own"):
    return virtual_engine(Partners(*pair, {}), SPEED, scheme, reconstruction, math.radians(step_deg) / SPEED)


def coupled(pair, scheme, step_deg, cycles=CYCLES, reconstruction="own"):
    """Torsion of the pulley every 1.5 degrees, rad."""
    system = system_of(pair, scheme, step_deg, reconstruction)
    master = system.master()
    try:
        master.initialize()
        found = run(master, cycles * CYCLE, Steps(math.radians(step_deg) / SPEED), system.bonds)
    finally:
        master.close()
    return found.of(f"{CRANKTRAIN}.pulley.torsion")[:: round(COARSE_DEG / step_deg)]


def test_torsion_at_coarse_steps_has_the_error_of_fine_ones(pair):
    """RMS over the last cycle against steps of 0.125 degrees, relative to the alternating part."""
    last = round(720.0 / COARSE_DEG)
    exact = coupled(pair, "gauss-seidel", 0.125)[-last:]
    plain, inside = (
        float(np.sqrt(np.mean((coupled(pair, scheme, COARSE_DEG)[-last:] - exact) ** 2)) / exact.std())
        for scheme in ("gauss-seidel", "intermediate")
    )
    assert inside < min(1.0e-3, 0.2 * plain)


@pytest.mark.parametrize("reconstruction", ["own", "linear", "hold"])
def test_an_intermediate_update_is_an_exchange_at_its_points(six, reconstruction):
    """A step of 1.5 degrees has two of them, so it is three steps of 0.5 degrees to rounding."""
    inside = coupled(six, "intermediate", COARSE_DEG, 0.5, reconstruction)
    between = coupled(six, "gauss-seidel", 0.5, 0.5, reconstruction)
    np.testing.assert_allclose(inside, between, rtol=0.0, atol=1e-9 * np.abs(between).max())


def test_a_state_that_is_restored_gives_the_same_bits(six):
    master = system_of(six, "intermediate", COARSE_DEG).master()
    size = math.radians(COARSE_DEG) / SPEED

    def gone(count):
        for _ in range(count):
            master.step(master.time + size)
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


def test_a_run_in_its_own_process_gives_the_same_bits(six):
    make = Made(six)
    found = run_supervised(make, 40 * math.radians(COARSE_DEG) / SPEED, Steps(math.radians(COARSE_DEG) / SPEED))
    system = make()
    master = system.master()
    try:
        master.initialize()
        here = run(master, found.times[-1], Steps(math.radians(COARSE_DEG) / SPEED), system.bonds)
    finally:
        master.close()
    np.testing.assert_array_equal(found.values, here.values)


class Made:
    """Makes the coupled six, in a process of its own too."""

    def __init__(self, pair):
        self.pair = pair

    def __call__(self):
        return system_of(self.pair, "intermediate", COARSE_DEG)


# ------------------------------------------------------------------ what cannot be


def test_a_crank_of_fmi_2_is_refused_in_one_line(six, tmp_path):
    pair = torsional_fmu("diesel_i6", tmp_path, "2.0"), six[1]
    with pytest.raises(InputError, match=r"cranktrain does not call its master inside a step; take gauss-seidel") as e:
        system_of(pair, "intermediate", COARSE_DEG).master()
    assert "\n" not in str(e.value)


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


@pytest.mark.parametrize("error", [UnitError("no burn"), KeyboardInterrupt()])
def test_what_fails_inside_a_step_ends_the_run(six, error):
    """The partner is named with the time; an interrupt is not lost in the FMU that is being called."""
    system = system_of(six, "intermediate", COARSE_DEG)
    size, asked = math.radians(COARSE_DEG) / SPEED, SimpleNamespace(steps=0)

    class Failing(Around):
        def step(self, time, size):
            asked.steps += 1
            if asked.steps == 5:
                raise error
            super().step(time, size)

    units = [Failing(system.units[COMBUSTION]), system.units[CRANKTRAIN]]
    master = Master(units, system.connections, system.exchange, system.outputs)
    try:
        master.initialize()
        master.step(size)
        with pytest.raises(type(error), match="combustion, step from .*: no burn" if str(error) else None):
            master.step(2.0 * size)
        assert asked.steps == 5
    finally:
        master.close()
