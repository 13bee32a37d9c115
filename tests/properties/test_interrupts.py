"""Interrupts and terminations: exit codes 130 and 143, one line, and a run-up that gets on however often it ends."""

import json
import math
import os
import signal
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from cranktrain.cli import engines
from cranktrain.cli.console import Interrupted
from cranktrain.cli.main import main
from cranktrain.core.units import RPM
from cranktrain.dynamics.cycle_run import run_cycles
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.settled.judging import Settling
from cranktrain.engine.file import load_engine
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.store import whole_file as files
from cranktrain.store.journal import journal_place
from cranktrain.structure.assembly import assemble
from cranktrain.studies.run_up import steady, workers
from cranktrain.studies.run_up.run_up import Means, run_up
from cranktrain.studies.run_up.starts import drop_starts, keep_start, kept_starts
from cranktrain.studies.run_up.steady import Job, SteadyRuns

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
LINE = "cranktrain: interrupted; nothing was written, and what earlier runs wrote is kept\n"
SENDS = """
import os, runpy, signal, sys

class Sends:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), {number})
        return None

class Late:
    def __del__(self):
        os.kill(os.getpid(), {number})

signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job is started with it ignored
sys.meta_path.insert(0, Sends())
if {module!r} == "late":
    sys.modules["late"] = Late()  # removed when the interpreter is taken down
sys.orig_argv = [sys.executable, "-m", "cranktrain"]
sys.argv = ["cranktrain", {verb!r}, *{arguments}, "--json"]
runpy.run_module("cranktrain", run_name="__main__", alter_sys=True)
"""
"""The command, to which a signal is sent when it loads a module, or as its interpreter goes."""

NUMBERS = pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])


def ran(folder, script):
    """A Python process of its own."""
    command = [sys.executable, "-c", script]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, timeout=300, check=False)


def as_command(folder, number, module, verb, *arguments):
    return ran(folder, SENDS.format(module=module, number=int(number), verb=verb, arguments=arguments))


@NUMBERS
@pytest.mark.parametrize(
    ("verb", "module"),
    [*(("modal", name) for name in ("rich.console", "numpy._core.multiarray", "numpy.linalg", "numpy.random.mtrand",
                                    "scipy.sparse.linalg")),
     *(("engines", name) for name in ("cranktrain.cli.main", "argparse", "cranktrain.core.errors"))],
)  # fmt: skip
def test_while_libraries_and_the_command_are_loaded_it_is_one_line(tmp_path, verb, module, number):
    """The first second: some libraries make another error of it, or swallow it."""
    done = as_command(tmp_path, number, module, verb, *(["diesel_i6"] if verb == "modal" else []))
    assert (done.returncode, done.stderr) == (128 + number, LINE)
    assert json.loads(done.stdout)["error"]["what"] == "interrupted"


def raised(error):
    def ending(*given, **named):
        raise error

    return ending


@pytest.fixture
def interruptible():
    """SIGINT as at a terminal: what a shell starts in the background ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
@NUMBERS
@pytest.mark.parametrize(
    ("ending", "said"),
    [
        (lambda: {"interrupted": True, "passed": False}, ""),
        (raised(KeyboardInterrupt()), "cranktrain: interrupted; nothing was written"),
        (raised(Interrupted("interrupted; x.h5 keeps 3 speeds")), "cranktrain: interrupted; x.h5 keeps 3 speeds"),
        (raised(ImportError("numpy: cannot be initialized")), "cranktrain: interrupted; nothing was written"),
    ],
)
def test_the_exit_code_is_that_of_the_signal(monkeypatch, capsys, number, ending, said):
    def run(options):
        try:
            signal.raise_signal(number)
        except KeyboardInterrupt:
            return ending()
        raise AssertionError

    monkeypatch.setattr(engines, "answer", run, raising=False)
    monkeypatch.setattr(files, "WRITTEN", [])
    before = signal.getsignal(signal.SIGINT)
    assert main(["engines", "--json"]) == 128 + number
    assert capsys.readouterr().err.startswith(said) and signal.getsignal(signal.SIGINT) is before


def test_files_that_were_written_before_are_named_and_memory_is_no_fault_of_the_program(monkeypatch, capsys, tmp_path):
    def run(options):
        with files.whole_file(tmp_path / "first.txt") as place:
            place.write_text("x")
        raise KeyboardInterrupt

    monkeypatch.setattr(engines, "answer", run, raising=False)
    monkeypatch.setattr(files, "WRITTEN", [])
    assert main(["engines"]) == 130
    assert "written before: " in (said := capsys.readouterr().err) and "first.txt" in said
    monkeypatch.setattr(engines, "answer", raised(MemoryError("Unable to allocate 73. TiB")), raising=False)
    assert main(["engines"]) == 2
    assert "the memory is not enough (Unable to allocate 73. TiB)" in capsys.readouterr().err


def job(crank, bearings):
    step = math.radians(5.0 if crank == "torsional" else 2.5)
    made = assemble(load_engine("diesel_i6"), Settings(crank=crank, bearings=bearings, step=step))
    return Job(made, None, 1e-4, 12.0, ("pulley.torsion",))


@pytest.mark.parametrize(("crank", "bearings"), [("torsional", "held"), ("rigid", "impedance")])
def test_a_run_up_that_is_interrupted_at_every_second_speed_is_the_whole_one(tmp_path, monkeypatch, crank, bearings):
    """Each attempt keeps the one speed that it finished, and goes on from the motions of those before."""
    asked, means = job(crank, bearings), Means(workers=1)
    speeds = [RPM * rpm for rpm in (1500.0, 1520.0, 1540.0, 1560.0, 1580.0)]
    monkeypatch.setattr(workers._here, "job", None, raising=False)
    whole = run_up(asked, speeds, tmp_path / "whole.h5", means, {}).run_up
    at, calls = SteadyRuns.at, []

    def interrupted(self, speed, near=()):
        calls.append(speed)
        if len(calls) > 1:
            raise KeyboardInterrupt
        return at(self, speed, near)

    path = tmp_path / "often.h5"
    monkeypatch.setattr(SteadyRuns, "at", interrupted)
    for count in range(1, len(speeds)):
        calls.clear()
        monkeypatch.setattr(workers._here, "job", None)
        with pytest.raises(KeyboardInterrupt):
            run_up(asked, speeds, path, means, {})
        assert RunUp.load(path).speeds.size == count
    calls.clear()
    often = run_up(replace(asked), speeds, path, means, {}).run_up
    assert np.array_equal(often.speeds, whole.speeds) and np.array_equal(often.cycles, whole.cycles)
    for ours, theirs in ((often.amplitudes, whole.amplitudes), (often.extremes, whole.extremes)):
        for name, values in theirs.items():
            assert np.abs(ours[name] - values).max() <= 1e-9 * max(np.abs(values).max(), 1e-12), name
    assert not journal_place(path.with_name(f"{path.name}.starts")).exists()


@pytest.mark.parametrize("neighbours", [0, 1])
def test_a_speed_that_is_interrupted_is_not_begun_anew_nor_kept_as_finished(monkeypatch, neighbours):
    """A run that is cut short has cycles, but none that repeats: with a start from neighbours it began once more."""
    runs = SteadyRuns(job("torsional", "held"))
    near = [runs.at(1500.0 * RPM).start][:neighbours]
    taken = []

    def cut_short(*arguments, **named):
        taken.append(run_cycles(*arguments, **named))
        return replace(taken[-1], settling=Settling(2, 0, 1e-4), complete=False)

    monkeypatch.setattr(steady, "run_cycles", cut_short)
    with pytest.raises(KeyboardInterrupt):
        runs.at(1520.0 * RPM, near)
    assert len(taken) == 1


def test_the_motions_of_finished_speeds_come_back_as_they_were(tmp_path):
    """What else a start has is in the run-up above, which goes on from it."""
    start = SteadyRuns(job("torsional", "held")).at(1500.0 * RPM).start
    for one in (start, start._replace(temperatures=np.array([350.0]), learned=None)):
        keep_start(tmp_path / "up.h5", "tie", one)
    first, second = kept_starts(tmp_path / "up.h5", "tie")
    assert np.array_equal(first.motion.place, start.motion.place) and first.temperatures is None
    assert (first.speed, first.shaft_angle, first.periodic) == (start.speed, start.shaft_angle, start.periodic)
    assert second.temperatures.tolist() == [350.0] and second.learned is None
    assert kept_starts(tmp_path / "up.h5", "another") == []
    drop_starts(tmp_path / "up.h5")
    assert kept_starts(tmp_path / "up.h5", "tie") == [] and not list(tmp_path.iterdir())


def test_an_interrupt_before_the_first_speed_says_what_an_older_file_keeps(tmp_path, monkeypatch, capsys):
    command = ["runup", "diesel_i6", "--crank", "torsional", "--bearings", "held", "--step-deg", "5", "--from", "1500"]
    command += ["--to", "1520", "--workers", "1", "--output", str(tmp_path / "up.h5")]
    assert main(command) == 0
    capsys.readouterr()

    monkeypatch.setattr("cranktrain.cli.runup.assembled", raised(KeyboardInterrupt()))
    assert main(command) == 130
    assert "up.h5 keeps 2 speeds; run the same command again" in capsys.readouterr().err
    assert main([*command, "--anew"]) == 130
    assert "run the command without --anew again" in capsys.readouterr().err


@NUMBERS
def test_once_the_verb_has_ended_its_exit_code_stands(tmp_path, number):
    """Python gives signals back to the system while it takes its modules down."""
    done = as_command(tmp_path, number, "late", "engines")
    assert (done.returncode, done.stderr) == (0, "") and len(json.loads(done.stdout)["engines"]) > 5


@NUMBERS
def test_a_signal_within_a_text_that_is_executed_ends_as_any_other(tmp_path, number):
    """Python kills a process at its end whose KeyboardInterrupt once left such a text, as a dataclass is made from."""
    script = f"""
import signal, sys
from cranktrain.cli import engines
from cranktrain.cli.main import main
signal.signal(signal.SIGINT, signal.default_int_handler)
engines.answer = lambda options: exec("signal.raise_signal({int(number)})")
sys.exit(main(["engines"]))
"""
    done = ran(tmp_path, script)
    assert (done.returncode, done.stderr) == (128 + number, LINE)


def test_a_second_signal_while_the_first_is_told_changes_nothing(tmp_path):
    """A terminal's user presses twice."""
    script = """
import os, signal, sys
from cranktrain.cli import main
from cranktrain.cli.signals import outside
signal.signal(signal.SIGINT, outside)
told = main.interrupted
main.interrupted = lambda stop: (signal.raise_signal(signal.SIGINT), told(stop))[1]
from cranktrain.cli import engines
engines.answer = lambda options: signal.raise_signal(signal.SIGINT)
sys.exit(main.main(["engines"]))
"""
    done = ran(tmp_path, script)
    assert done.returncode == 130 and len(done.stderr.splitlines()) == 1, done.stderr
