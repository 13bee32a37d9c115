"""Runs of any length: results go to the file as they come, memory stays, and every end leaves what was computed."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest

import cranktrain as ct
from cranktrain.cli.main import main
from cranktrain.dynamics.settled.cycles import Recorder
from cranktrain.dynamics.settled.samples import Samples
from cranktrain.store import result_stream
from cranktrain.store.hdf5 import read_result

LEVELS = ("--crank", "rigid", "--bearings", "held", "--speed", "2000")
RUN = ("simulate", "diesel_i6", *LEVELS, "--step-deg", "10")
PEAKS = """
import resource, sys
from cranktrain.cli.main import main
for cycles in sys.argv[2:]:
    assert main([*{run!r}, "--cycles", cycles, "--output", sys.argv[1]]) == 0
    print("peak", resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def peaks(path, run, *cycles):
    """Largest memory (MB) of a process after each of some runs."""
    command = [sys.executable, "-c", PEAKS.format(run=run), str(path), *map(str, cycles)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return [int(line.split()[1]) / 1024 for line in done.stdout.splitlines() if line.startswith("peak")]


def test_memory_does_not_grow_with_the_number_of_cycles(tmp_path):
    """In memory, 600 cycles of 72 samples of 138 outputs would take 48 MB, twice."""
    short, long = peaks(tmp_path / "run.h5", RUN, 20, 600)
    assert long - short < 20.0
    outputs, attributes = read_result(tmp_path / "run.h5")
    assert {values.size for name, (values, _) in outputs.items() if name != "film_temperature_c"} == {600 * 72 + 1}
    assert attributes["cycles"] == 600 and attributes["ended"] == "finished"
    assert outputs["angle"][0][-1] == pytest.approx(2400.0 * math.pi)


@pytest.mark.slow
def test_ten_thousand_cycles_run_in_300_mb(tmp_path):
    """The kernels are compiled, and kept, by a run before."""
    run = RUN[:-2]
    peaks(tmp_path / "run.h5", run, 1)
    assert peaks(tmp_path / "run.h5", run, 10_000)[0] < 300.0
    (tmp_path / "run.h5").unlink()  # 3 GB


@pytest.mark.parametrize("options", [("--cycles", "9"), ()])
def test_a_file_written_on_the_way_holds_what_a_run_in_memory_does(tmp_path, run_json, options):
    """Exactly so many cycles, more than are held, and a run that goes on until its outputs repeat."""
    path = tmp_path / "run.h5"
    summary = run_json(*RUN, *options, "--output", str(path))
    cycles = 9 if options else None
    run = ct.simulate("diesel_i6", crank="rigid", bearings="held", speed_rpm=2000, step_deg=10, cycles=cycles)
    found, attributes = read_result(path)
    run.save(tmp_path / "memory.h5")
    expected, expected_attributes = read_result(tmp_path / "memory.h5")
    assert found.keys() == expected.keys() and attributes == expected_attributes
    for name, (values, unit) in expected.items():
        assert np.array_equal(found[name][0], values) and found[name][1] == unit, name
    times = ("seconds", "real_time_factor", "result")
    assert {k: v for k, v in summary.items() if k not in times} == json.loads(
        json.dumps({k: v for k, v in run.summary().items() if k not in times})
    )


def test_an_interrupted_run_that_settles_keeps_its_last_cycle(tmp_path, monkeypatch):
    take, cycles = Recorder.take, []

    def interrupted(recorder, rows, first=0, **more):
        cycles.append(first)
        if len(cycles) > 3:
            take(recorder, rows[:20], first, **more)
            raise KeyboardInterrupt
        take(recorder, rows, first, **more)

    monkeypatch.setattr(Recorder, "take", interrupted)
    path = tmp_path / "run.h5"
    assert main([*RUN, "--settle", "1e-8", "--output", str(path)]) == 130
    outputs, attributes = read_result(path)
    assert outputs["time"][0].size == 73 and attributes["cycles"] == 3 and attributes["ended"] == "interrupted"


def test_a_failed_run_leaves_what_was_computed(tmp_path, capsys):
    """A torque that no engine holds stalls it within the first cycles."""
    path = tmp_path / "run.h5"
    options = ("--load-torque-nm", "4000", "--cycles", "48", "--output", str(path), "--json")
    assert main([*RUN, *options]) == 2
    captured = capsys.readouterr()
    error = json.loads(captured.out)["error"]
    outputs, attributes = read_result(path)
    assert "stalls the engine" in error["what"] and f"{path} keeps" in error["remedy"]
    assert attributes["ended"].startswith("failed: the load torque") and outputs["crank.speed"][0].size > 10
    assert abs(outputs["crank.speed"][0][-1]) < 0.5 * outputs["crank.speed"][0][0]


def test_a_disk_that_fills_ends_a_run_which_is_kept(tmp_path, capsys, monkeypatch):
    """Room for all at the start, none after two chunks."""
    looks = iter([1 << 40, 1 << 40, 1 << 40])
    usage = SimpleNamespace(disk_usage=lambda path: SimpleNamespace(free=next(looks, 0)))
    monkeypatch.setattr(result_stream, "shutil", usage)
    path = tmp_path / "run.h5"
    assert main([*RUN, "--cycles", "300", "--output", str(path)]) == 2
    assert "the disk is full" in capsys.readouterr().err
    assert read_result(path)[0]["time"][0].size > 2 * result_stream.CHUNK


def test_a_run_that_the_disk_has_no_room_for_is_refused(tmp_path, capsys, monkeypatch):
    usage = SimpleNamespace(disk_usage=lambda path: SimpleNamespace(free=50_000_000))
    monkeypatch.setattr(result_stream, "shutil", usage)
    assert main([*RUN, "--cycles", "10000", "--output", str(tmp_path / "run.h5")]) == 2
    assert "720001 samples of" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def heeded():
    """Let an interrupt count where a shell runs the tests in the background, which ignores it."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_end_a_run_with_one_line_and_a_whole_file(tmp_path, number, code):
    command = [sys.executable, "-m", "cranktrain.cli.main", *RUN, "--cycles", "10000", "--output", "run.h5"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, cwd=tmp_path, preexec_fn=heeded, **pipes) as process:
        while process.poll() is None and not any(f.stat().st_size > 5_000_000 for f in tmp_path.glob(".cranktrain-*")):
            time.sleep(0.05)
        process.send_signal(number)
        out, err = process.communicate()
    assert process.returncode == code and not out
    assert err.splitlines()[-1].startswith("cranktrain: interrupted after") and "Traceback" not in err
    assert os.listdir(tmp_path) == ["run.h5"]
    outputs, attributes = read_result(tmp_path / "run.h5")
    assert outputs["time"][0].size > result_stream.CHUNK
    assert (outputs["time"][0].size - 1) // 72 == attributes["cycles"]


def test_an_interrupt_on_the_way_to_the_file_loses_no_cycle(tmp_path, monkeypatch, capsys):
    """It comes when a cycle has been taken and before its samples are passed on."""
    axes, calls = Samples.axes, []
    heeded()

    def slow(samples, rows, first):
        calls.append(first)
        if len(calls) == 5:
            signal.raise_signal(signal.SIGINT)
        return axes(samples, rows, first)

    monkeypatch.setattr(Samples, "axes", slow)
    path = tmp_path / "run.h5"
    assert main([*RUN, "--cycles", "300", "--output", str(path)]) == 130
    outputs, attributes = read_result(path)
    assert attributes["cycles"] == 4 and outputs["time"][0].size == 4 * 72 + 1
    assert f"after 4 cycles; {path} keeps 4.00 cycles" in capsys.readouterr().err
    assert np.allclose(np.diff(outputs["angle"][0]), math.radians(10.0))


def test_an_interrupt_while_samples_are_written_waits(tmp_path, monkeypatch, capsys):
    """Every sample that was taken is in the file, none twice, and the message counts them all."""
    write, calls = result_stream.ResultStream._write, []
    heeded()

    def slow(stream):
        calls.append(stream)
        if len(calls) == 1:
            signal.raise_signal(signal.SIGINT)
        write(stream)

    monkeypatch.setattr(result_stream.ResultStream, "_write", slow)
    path = tmp_path / "run.h5"
    assert main([*RUN, "--cycles", "300", "--output", str(path)]) == 130
    outputs, attributes = read_result(path)
    samples = outputs["time"][0].size
    assert samples > result_stream.CHUNK and samples == 72 * attributes["cycles"] + 1
    count = attributes["cycles"]
    assert f"after {count} cycles; {path} keeps {count}.00 cycles" in capsys.readouterr().err
    assert np.allclose(np.diff(outputs["angle"][0]), math.radians(10.0))
