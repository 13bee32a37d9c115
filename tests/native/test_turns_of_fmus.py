"""Native FMUs under the master: compiled turns, calls from Python and a supervised run give the same bits."""

import math
from functools import partial
from typing import NamedTuple

import numpy as np
import pytest
import real_unit

from cranktrain_lab.coupling.connections import START, Connection
from cranktrain_lab.coupling.fmu3_unit import open_fmu
from cranktrain_lab.coupling.master import Exchange, Master
from cranktrain_lab.coupling.run import Steps, run
from cranktrain_lab.coupling.supervised import run_supervised
from cranktrain_lab.coupling.unit import Around

SPEED = 209.4
STEP = math.radians(1.0) / SPEED
STOP = 240 * STEP


class System(NamedTuple):
    units: dict
    connections: list
    exchange: Exchange
    outputs: dict
    bonds: tuple = ()


def valves(scheme, reconstruction, valvetrain, combustion):
    """A valve train at constant speed, whose lifts a combustion takes."""
    turning = {"crank.speed": SPEED} | real_unit.TURNING
    units = {
        "valvetrain": open_fmu(valvetrain, "valvetrain", turning),
        "combustion": open_fmu(combustion, "combustion", {"lift.source": "input"} | turning),
    }
    lifts = [name for name in units["combustion"].inputs if name.endswith("_lift")]
    connections = [Connection(("valvetrain", name), ("combustion", name), START) for name in lifts]
    pressures = [f"cylinder[{c + 1}].pressure" for c in range(len(lifts) // 2)]
    return System(units, connections, Exchange(scheme, reconstruction), {"combustion": pressures})


@pytest.fixture(scope="module", params=[("2.0", "2.0"), ("3.0", "3.0"), ("2.0", "3.0"), ("3.0", "2.0")])
def fmus(request, tmp_path_factory):
    """Valve train and combustion, each of a version of FMI."""
    folder = tmp_path_factory.mktemp("valves")
    names = zip(("valvetrain_i6", "combustion_i6"), request.param, strict=True)
    return [real_unit.built(name, folder, fmi=fmi) for name, fmi in names]


def ran(system, units):
    master = Master(units, system.connections, system.exchange, system.outputs)
    master.initialize()
    assert all((master._turns is None) == isinstance(unit, Around) for unit in units)
    try:
        return master, run(master, STOP, Steps(STEP))
    finally:
        master.close()


@pytest.mark.parametrize("scheme", ["jacobi", "gauss-seidel", "iterative"])
@pytest.mark.parametrize("reconstruction", ["hold", "quadratic"])
def test_compiled_turns_give_the_bits_of_calls_from_python(fmus, scheme, reconstruction):
    found = []
    for wrap in (Around, lambda unit: unit):
        system = valves(scheme, reconstruction, *fmus)
        found.append(ran(system, [wrap(unit) for unit in system.units.values()])[1])
    plain, compiled = found
    assert np.array_equal(plain.values, compiled.values) and plain.sweeps == compiled.sweeps
    pressures = plain.of("combustion.cylinder[1].pressure")
    assert np.ptp(pressures) > 0.0


def test_a_supervised_run_has_the_same_bits(fmus):
    make = partial(valves, "gauss-seidel", "hold", *fmus)
    system = make()
    _, plain = ran(system, list(system.units.values()))
    found = run_supervised(make, STOP, Steps(STEP))
    assert np.array_equal(found.values, plain.values) and np.array_equal(found.times, plain.times)
