"""Foreign units of FMI 2.0 and 3.0 in one system: compiled turns give the values and errors of calls from Python."""

import os
import shutil
from contextlib import closing
from functools import partial

import numpy as np
import pytest
from odd_units import DESCRIBED, System, odd_unit

from cranktrain_lab.coupling.connections import START, Connection
from cranktrain_lab.coupling.fmu3_unit import open_fmu
from cranktrain_lab.coupling.master import Exchange, Master
from cranktrain_lab.coupling.run import Steps, run
from cranktrain_lab.coupling.supervised import Limits, run_supervised
from cranktrain_lab.coupling.unit import Around, UnitError

pytestmark = [pytest.mark.skipif(os.name == "nt" or shutil.which("cc") is None, reason="no C compiler")]
STEP = 0.1
ROW = "row[1]", "row[3]"
SUMS = "sums[1]", "sums[2]", "sums[3]"


def system(fmus, scheme="gauss-seidel", reconstruction="linear"):
    """A ramp of FMI 2.0, whose elements of a row a unit of FMI 3.0 takes, and another one that takes its sums."""
    units = {
        "ramp": open_fmu(fmus["2.0"], "ramp"),
        "first": open_fmu(fmus["3.0"], "first", {"row[2]": 0.25}),
        "second": open_fmu(fmus["3.0"], "second"),
    }
    connections = [
        *(Connection(("ramp", "out"), ("first", name)) for name in ROW),
        Connection(("second", "out"), ("first", "in"), START),
        Connection(("first", "sums[3]"), ("second", "row[2]")),
        Connection(("first", "sums[1]"), ("second", "in")),
    ]
    return System(units, connections, Exchange(scheme, reconstruction), {"second": [*SUMS, "out"], "first": SUMS})


def ran(system, wrap=lambda unit: unit):
    """The run and whether all units took compiled turns, or none."""
    with closing(Master([wrap(unit) for unit in system.units.values()], *system[1:4])) as master:
        master.initialize()
        compiled = set(master._turns.inputs) if master._turns else set()
        assert compiled in (set(), set(system.units))
        return run(master, 1.0, Steps(STEP)), bool(compiled)


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    """Paths by version."""
    return {fmi: odd_unit(tmp_path_factory.mktemp("odd"), fmi) for fmi in DESCRIBED}


@pytest.mark.parametrize("scheme", ["jacobi", "gauss-seidel"])
@pytest.mark.parametrize("reconstruction", ["hold", "linear", "quadratic"])
def test_elements_of_arrays_are_set_and_read_as_from_python(fmus, scheme, reconstruction):
    """Elements that no connection leads to keep their start values: 0.25 in one row, 0.1 and 0.3 in the other."""
    (plain, called), (found, compiled) = (ran(system(fmus, scheme, reconstruction), wrap) for wrap in (Around, same))
    assert compiled and not called
    assert np.array_equal(found.values, plain.values) and np.array_equal(found.times, plain.times)
    first, second = ([found.of(f"{unit}.{name}")[2:] for name in SUMS] for unit in ("first", "second"))
    np.testing.assert_allclose(first[1] - first[0], 0.25)
    np.testing.assert_allclose(first[2] - first[1], first[0])
    np.testing.assert_allclose([second[0], second[2] - second[1]], [[0.1], [0.3]] + 0.0 * second[0])
    assert np.ptp(first[0]) > 0.5 and np.ptp(second[1]) > 0.5


def same(unit):
    return unit


STATUSES = {2: "discard", 3: "error", 4: "fatal", 5: "status 5", -1: "status -1"}


@pytest.mark.parametrize("unit", ["ramp", "first", "second"])
@pytest.mark.parametrize(
    ("mode", "says"),
    [
        *((f"step:status {n}", f", step from 0.5 s to 0.6 s: step: {word}") for n, word in STATUSES.items()),
        *((f"get:status {n}", f" at 0.4 s: its outputs: {word}") for n, word in STATUSES.items()),
        ("step:log long", f", step from 0.5 s to 0.6 s: step: {100 * 'x'}"),
        ("value:nan", "is nan at 0.5 s; units before it are finite"),
        ("value:inf", "is inf at 0.5 s; units before it are finite"),
    ],
)
def test_an_error_is_the_one_line_of_a_call_from_python(fmus, monkeypatch, unit, mode, says):
    """Of the step that begins after 0.45 s, or of the values that are read after that time."""
    assert f"{unit}{says}" in error(fmus, monkeypatch, unit, mode) or mode.startswith("value:")


def error(fmus, monkeypatch, unit, mode):
    """What ends the run where a unit has a mode: the same in both ways, in one line."""
    monkeypatch.setenv("ODD", mode)
    monkeypatch.setenv("ODD_UNIT", unit)
    found = []
    for wrap in (Around, same):
        with pytest.raises(UnitError) as caught:
            ran(system(fmus), wrap)
        found.append(str(caught.value))
    plain, compiled = found
    assert compiled == plain and compiled.startswith(unit) and "\n" not in compiled
    return compiled


NO_MASTER = "which no master here handles; correct the unit"
ENDS = [
    ("set:status 3", "first at 0.5 s: row[1] = 0.55, row[3] = 0.55: error"),
    ("set:status 4", "first at 0.5 s: its inputs: fatal"),
    ("row:refused", "first at 0.5 s: row[1] = 0.55, row[3] = 0.55: error"),
    ("step:early", f"first, step from 0.5 s to 0.6 s: step: it returned early at 0.55 s, {NO_MASTER}"),
    ("step:ended", f"first, step from 0.5 s to 0.6 s: step: it ended the simulation at 0.6 s, {NO_MASTER}"),
    ("step:early and status 3", "first, step from 0.5 s to 0.6 s: step: error"),
]


@pytest.mark.parametrize(("mode", "says"), ENDS)
def test_an_end_that_only_fmi_3_has_is_told_as_from_python(fmus, monkeypatch, mode, says):
    """Elements of a refused array, a step that returns early or ends the simulation; a bad status goes before both."""
    assert error(fmus, monkeypatch, "first", mode) == says


def test_an_event_is_no_error(fmus, monkeypatch):
    """A unit that was instantiated without event mode handles its events itself."""
    monkeypatch.setenv("ODD", "step:event")
    (plain, _), (found, compiled) = (ran(system(fmus), wrap) for wrap in (Around, same))
    assert compiled and np.array_equal(found.values, plain.values) and found.times[-1] == 1.0


def test_a_supervised_run_has_the_same_bits_and_errors(fmus, monkeypatch):
    """The kernel notes calls of both versions; a unit of FMI 3.0 that dies in a turn is named with its call."""
    plain, _ = ran(system(fmus))
    make, limits = partial(system, fmus), Limits(60.0, 10.0)
    found = run_supervised(make, 1.0, Steps(STEP), limits)
    assert np.array_equal(found.values, plain.values) and np.array_equal(found.times, plain.times)
    monkeypatch.setenv("ODD_UNIT", "first")
    for mode, says in (*ENDS[2:4], ("step:signal 11", "first, step at 0.5 s: died with SIGSEGV")):
        monkeypatch.setenv("ODD", mode)
        with pytest.raises(UnitError) as caught:
            run_supervised(make, 1.0, Steps(STEP), limits)
        assert says in str(caught.value), mode
        np.testing.assert_array_equal(caught.value.found.values, plain.values[:6])
