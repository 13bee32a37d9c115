"""Runs in a process of their own: equal to those in this one; what dies or hangs costs its run, not its results."""

import ctypes
import faulthandler
import gc
import math
import os
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from odd_units import System
from two_mass_units import Mass, units

from cranktrain.core.errors import InputError, StoreError
from cranktrain.store.hdf5 import read_result
from cranktrain_lab.cli.couple import Couple, _run_into
from cranktrain_lab.coupling.master import Exchange, Master
from cranktrain_lab.coupling.run import Bond, Steps, run
from cranktrain_lab.coupling.supervised import Limits, Watched, run_supervised
from cranktrain_lab.coupling.unit import EndingError, UnitError
from cranktrain_lab.stability.two_mass import TwoMass

STOP, STEP, BREAKS = 1.0, 0.1, 0.5 - 1e-9


class Odd(Mass):
    """A mass that does something odd in the call and at the time that it is told."""

    odd, call = None, "step"

    def initialize(self, time):
        super().initialize(time)
        if self.call == "initialize":
            self.odd()

    def step(self, time, size):
        if self.call == "step" and time >= BREAKS:
            self.odd()
        super().step(time, size)

    def close(self):
        if self.call == "close":
            self.odd()


def ends_badly(kind):
    raise kind("second: termination: out of order")


def crash():
    faulthandler.disable()  # pytest has it tell of this
    ctypes.string_at(0)


def leave():
    os._exit(3)


def hang():
    time.sleep(1000.0)


def remove_the_record():
    (Path(tempfile.gettempdir()) / "points").unlink(missing_ok=True)


def write_over_the_notes():
    """As a unit does that writes beyond its own memory."""
    for one in gc.get_objects():
        if issubclass(type(one), Watched):  # isinstance follows weak references, some of which are dead
            notes = one._notes
            notes.unit, notes.call, notes.points, notes.time = 77, -3, 1 << 60, math.nan
    os._exit(300)


def full_disk():
    raise OSError(28, "No space left on device")


def litter():
    tempfile.mkdtemp(prefix="litter-")
    crash()


def shout():
    os.write(1, b"a unit prints\n")


def system(odd=None, call="step"):
    made, links = units(TwoMass(), "force/displacement")
    if odd is not None:
        made[1].__class__, made[1].odd, made[1].call = Odd, staticmethod(odd), call
    bond = Bond("spring", [(("second", "force"), ("first", "v1"))], [(("first", "force"), ("first", "v1"))])
    read = {"first": ["x1", "v1"], "second": ["x2"]}
    return System({unit.name: unit for unit in made}, links, Exchange("gauss-seidel", "linear"), read, [bond])


def refused():
    raise InputError("units: none of them; name one")


def faulty():
    return 1 / 0


def test_a_run_elsewhere_is_the_run_here():
    made = system()
    master = Master(list(made.units.values()), made.connections, made.exchange, made.outputs)
    master.initialize()
    here, there = run(master, STOP, Steps(STEP), made.bonds), run_supervised(system, STOP, Steps(STEP))
    assert here.names == there.names and here.units == there.units
    for one, other in zip(here[2:4], there[2:4], strict=True):
        assert np.array_equal(one, other)
    assert np.array_equal(here.residuals["spring"], there.residuals["spring"])
    assert (there.steps, there.refused, there.sweeps, there.ended) == (10, 0, 10, "")


@pytest.mark.parametrize(
    ("odd", "call", "said"),
    [(crash, "step", "second, step at 0.5 s: died with SIGSEGV"),
     (leave, "step", "second, step at 0.5 s: ended its process with code 3"),
     (hang, "step", "second, step at 0.5 s: did not return within 2 s"),
     (hang, "initialize", "second, initialization at 0 s: did not return within 2 s")],
)  # fmt: skip
def test_a_unit_that_dies_or_hangs_is_named_and_the_run_is_kept(odd, call, said):
    """More ends of units: ``tests/fmu/test_foreign_units.py``."""
    with pytest.raises(UnitError, match=said) as caught:
        run_supervised(partial(system, odd, call), STOP, Steps(STEP), Limits(2.0, 2.0))
    if call == "step":
        found = caught.value.found
        assert found.times == pytest.approx(np.arange(6) * STEP)
        assert len(found.residuals["spring"]) == found.steps == 5 and "second" in found.ended
    else:
        assert not hasattr(caught.value, "found")


def test_notes_that_a_unit_writes_over_cost_no_fault_of_the_program():
    """What is known of its end is told, and the points that the file holds are kept."""
    with pytest.raises(UnitError, match="a unit, a call at nan s: ended its process with code 44") as caught:
        run_supervised(partial(system, write_over_the_notes), STOP, Steps(STEP))
    assert caught.value.found.times[:6] == pytest.approx(np.arange(6) * STEP)


def test_a_record_that_a_unit_removes_is_told():
    with pytest.raises(UnitError, match="the record of the run is gone; a unit removed it"):
        run_supervised(partial(system, remove_the_record), STOP, Steps(STEP))


def test_a_full_temporary_folder_costs_one_line_and_keeps_the_run(monkeypatch):
    with pytest.raises(StoreError, match=r"temporary folder .*No space left on device\); free some space") as caught:
        run_supervised(partial(system, full_disk), STOP, Steps(STEP))
    assert caught.value.found.steps == 5
    monkeypatch.setattr(tempfile, "tempdir", "/nowhere/at/all")
    with pytest.raises(StoreError, match="temporary folder /nowhere/at/all: the run cannot go on"):
        run_supervised(system, STOP, Steps(STEP))


def test_nothing_is_left_of_a_process_that_died(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with pytest.raises(UnitError):
        run_supervised(partial(system, litter), STOP, Steps(STEP))
    assert not list(tmp_path.iterdir())


def test_a_unit_that_cannot_end_is_told_beside_its_complete_run():
    says = "second, its end at 1 s: died with SIGSEGV; the run itself is complete"
    with pytest.raises(EndingError, match=says) as caught:
        run_supervised(partial(system, crash, "close"), STOP, Steps(STEP))
    assert caught.value.found.steps == 10 and caught.value.found.ended == ""


@pytest.mark.parametrize("fatal", [False, True])
def test_coupling_warns_of_a_unit_that_ends_badly_and_fails_where_its_error_is_fatal(tmp_path, fatal):
    """Either way the file has all of the run."""
    end = partial(ends_badly, UnitError if fatal else EndingError)
    speed = 4.0 * math.pi / STOP
    ask = Couple(
        speed_rpm=speed * 30.0 / math.pi, cycles=1, step_deg=math.degrees(STEP * speed), output=str(tmp_path / "run.h5")
    )  # fmt: skip
    says = "second: termination: out of order; the run itself is complete"
    told = pytest.raises(UnitError, match=says) if fatal else pytest.warns(UserWarning, match=says)
    with told:
        assert _run_into("e", partial(system, end, "close"), speed, ask).steps == 10
    assert read_result(tmp_path / "run.h5")[0]["time"][0][-1] == pytest.approx(STOP)


def test_what_units_print_is_kept_from_standard_output(capfd):
    run_supervised(partial(system, shout), STOP, Steps(STEP))
    printed = capfd.readouterr()
    assert printed.out == "" and printed.err.count("a unit prints") == 5


def test_errors_of_making_come_through():
    with pytest.raises(InputError, match="none of them; name one"):
        run_supervised(refused, STOP, Steps(STEP))
    with pytest.raises(RuntimeError, match="ZeroDivisionError"):
        run_supervised(faulty, STOP, Steps(STEP))
    with pytest.raises(InputError, match="must be above zero"):
        Limits(step=0.0)


INTERRUPTED = """
import itertools, os, signal, sys, time
from functools import partial
sys.path[:0] = {path!r}
import test_supervision as t

calls = itertools.count()

def slow():
    time.sleep(0.02)
    if next(calls) == 10:  # so that how long a busy machine takes to start plays no part
        os.kill(os.getppid(), signal.SIGINT)

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job is started with it ignored
    try:
        t.run_supervised(partial(t.system, slow), 1e6, t.Steps(t.STEP))
    except KeyboardInterrupt as error:
        print(error.found.steps > 6, error.found.ended)
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_an_interrupt_ends_the_process_and_keeps_the_run(tmp_path):
    script = tmp_path / "interrupted.py"
    folders = [str(Path(__file__).parent), str(Path(__file__).parents[1])]
    script.write_text(INTERRUPTED.format(path=folders))
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=120)
    assert done.stdout.split() == ["True", "interrupted"], done.stderr
