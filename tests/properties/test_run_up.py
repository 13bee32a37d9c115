"""Run-ups: steady cycles from neighbours are those of long runs, each speed runs once, and nothing finished is lost."""

import json
import logging
import math
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Future
from types import SimpleNamespace

import numpy as np
import pytest
from bodies import six, whole_six
from hypothesis import given
from hypothesis import strategies as st

from cranktrain.cli.main import main
from cranktrain.core.errors import SolverError, StoreError
from cranktrain.dynamics.cycle_run import output_judge, run_cycles
from cranktrain.dynamics.model.settings import Settings, resolved
from cranktrain.dynamics.outputs.register import output_counts
from cranktrain.dynamics.simulation import Parts, simulate
from cranktrain.engine.file import load_engine
from cranktrain.results.orders.harmonics import order_amplitudes
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.structure.assembly import Assembly, assemble
from cranktrain.studies.run_up.free_decay import largest_decay
from cranktrain.studies.run_up.run_up import speeds_between
from cranktrain.studies.run_up.sequence import next_speed, steady_speeds
from cranktrain.studies.run_up.steady import Job, SteadyRuns

RPM = math.pi / 30.0
LEVELS = ("--crank", "torsional", "--bearings", "held", "--step-deg", "5")
RUN = ("runup", "diesel_i6", *LEVELS, "--from", "1500", "--to", "1700", "--step", "20")


@pytest.fixture(scope="module")
def made():
    return assemble(load_engine("diesel_i6"), Settings(crank="torsional", bearings="held", step=math.radians(5.0)))


def steady(made, settle=1e-4):
    return SteadyRuns(Job(made, None, settle, 24.0, ("pulley.torsion",)))


def test_a_steady_cycle_from_neighbours_is_the_last_of_a_long_run(made):
    runs = steady(made, 1e-6)
    near = [runs.at(rpm * RPM).start for rpm in (1620.0, 1640.0)]
    found = runs.at(1600.0 * RPM, near)
    long = simulate(made.engine, made.body, made.settings, 1600.0 * RPM, 120)
    ahead = float(np.mean((long.outputs["crank.angle"] - long.angle)[-long.per_cycle :]))
    orders, expected = order_amplitudes(long.last_cycle("pulley.torsion")[1][:-1], 24.0)
    expected = expected * np.exp(-1j * orders * ahead)
    difference = found.amplitudes["pulley.torsion"] - expected
    assert np.linalg.norm(difference) < 1e-5 * np.linalg.norm(expected)
    swing = long.last_cycle("pulley.torsion")[1]
    least, _, largest = found.extremes["pulley.torsion"]
    assert np.abs([least - swing.min(), largest - swing.max()]).max() < 1e-5 * np.ptp(swing)


@pytest.mark.parametrize(
    ("rpm", "settle"),
    [(1600.0, 1e-6),
     *(pytest.param(rpm, settle, marks=pytest.mark.slow) for rpm in (1200.0, 2180.0) for settle in (1e-4, 1e-6))],
)  # fmt: skip
def test_every_family_of_outputs_is_that_of_a_long_run(rpm, settle):
    """Solid crank on films, whose torsion and collar settle by what the neighbours taught (benchmarks/long_run.py)."""
    engine, body = whole_six() if rpm > 2000.0 else six()  # without an axial path it has no period there
    runs = steady(Assembly(engine, resolved(Settings(), engine), body, Parts()), settle)
    near = [runs.at((rpm - 40.0) * RPM).start]
    near = [runs.at((rpm - 20.0) * RPM, near).start, *near]
    runs.enter(rpm * RPM, near)
    long, found = run_cycles(runs.simulation, 60, 1e-6, None, None), runs.settled(rpm * RPM, near)
    rows = [np.stack([values[-long.per_cycle :] for values in run.outputs.values()], axis=1) for run in (long, found)]
    judge = output_judge(output_counts(engine), {name: k for k, name in enumerate(long.outputs)})
    assert found.settling.repeats == 1 and long.settling.worst[1] < 0.1 * settle
    assert max(judge.left(*rows).values()) < settle


def test_neighbours_save_cycles(made):
    """The line through two neighbours is a better start than the static equilibrium, and than one of them."""
    runs = steady(made)
    near = [runs.at(rpm * RPM).start for rpm in (1520.0, 1500.0)]
    target = 1540.0 * RPM
    cycles = [runs.at(target, near[:count]).cycles for count in (0, 1, 2)]
    assert cycles[2] < cycles[0] and cycles[2] <= cycles[1]


def test_a_speed_does_not_depend_on_the_side_that_its_neighbours_are_on():
    """Workers finish speeds in any order; a viscous damper's free ring has no mean twist that anything holds."""
    engine = load_engine("diesel_i6")
    settings = Settings(crank="torsional", bearings="held", step=math.radians(5.0), damper="fitted")
    runs = steady(assemble(engine, settings), 1e-6)
    below = [runs.at(rpm * RPM).start for rpm in (1580.0, 1560.0)]
    above = [runs.at(1620.0 * RPM).start]
    found = [runs.at(1600.0 * RPM, near) for near in ([], below, above)]
    assert np.ptp([one.start.shaft_angle for one in found]) < 1e-10 < abs(found[0].start.shaft_angle)
    for name in ("crank.angle", "pulley.torsion", "shaft.torque", "damper.twist"):
        alone, *others = (one.extremes[name] for one in found)
        assert np.abs(np.array(others) - alone).max() < 3e-6 * (alone[2] - alone[0]), name


def test_a_free_decay_is_told_apart_into_its_oscillations():
    t = 4e-4 * np.arange(200)
    exponents = np.array([-37.0 + 2j * math.pi * 248.0, -20.0 + 2j * math.pi * 262.0, -5.0 + 2j * math.pi * 16.0])
    signal = np.real([1.0, 0.4, 3.0] @ np.exp(np.outer(exponents, t)))
    assert largest_decay(signal, t[1]) == pytest.approx(exponents[0], rel=1e-6)
    assert not np.isfinite(largest_decay(0.0 * t, t[1]))


def test_a_model_holds_nothing_of_the_speeds_before(made):
    """Factors, input samples and oil are those of the speed: a used model finds to the bit what a new one does."""
    runs = steady(made)
    near = [runs.at(1000.0 * RPM).start]
    runs.at(2000.0 * RPM)
    used, new = (one.at(1040.0 * RPM, near) for one in (runs, steady(made)))
    assert used.cycles == new.cycles
    assert np.array_equal(used.amplitudes["pulley.torsion"], new.amplitudes["pulley.torsion"])


@given(
    st.lists(st.integers(100, 400), min_size=1, max_size=40, unique=True),
    st.integers(1, 5),
    st.randoms(use_true_random=False),
)
def test_each_speed_runs_once_and_beside_a_finished_one_where_it_can(speeds, count, chance):
    missing, finished, running, cold = sorted(map(float, speeds)), [], [], 0
    total = len(missing)
    while missing or running:
        while missing and len(running) < count:
            speed = next_speed(missing, finished, running)
            everything = sorted([*missing, *finished, *running])
            at = everything.index(speed)
            cold += not set(everything[max(at - 1, 0) : at + 2]) & set(finished)
            missing.remove(speed)
            running.append(speed)
        finished.append(running.pop(chance.randrange(len(running))))
    assert len(finished) == total and sorted(finished) == sorted(map(float, speeds))
    assert cold <= 1 if count == 1 else cold <= total


def test_two_workers_start_far_apart():
    speeds = [float(k) for k in range(100, 181, 10)]
    assert (next_speed(speeds, [], []), next_speed(speeds[1:], [], [100.0])) == (100.0, 180.0)


class OneAtATime:
    """Workers that finish nothing before they are asked; the second speed fails."""

    count, apart, taken = 2, True, 0

    def submit(self, speed, near):
        future = Future()
        self.taken += 1
        if self.taken == 2:
            future.set_exception(SolverError("film of main[1] lost"))
        else:
            future.set_result(SimpleNamespace(start=SimpleNamespace(speed=speed)))
        return future


def test_a_speed_that_fails_leaves_the_others():
    found = list(steady_speeds(OneAtATime(), [100.0, 110.0, 120.0, 130.0], []))
    reasons = [one.reason for one in found if hasattr(one, "reason")]
    assert len(found) == 4 and reasons == ["film of main[1] lost"]


def test_refining_halves_the_steps_round_a_peak_only():
    speeds = np.arange(100.0, 301.0, 10.0)
    sizes = 1.0 / np.abs(1.0 - (speeds / 204.0) ** 2 + 0.06j)
    ones = np.ones(21, dtype=int)
    made = RunUp(speeds, np.array([0.5]), {"pulley.torsion": sizes[:, None] + 0j}, {}, ones, ones, np.zeros(21))
    found = speeds_between(made, 0.02, 10.0)
    assert found and all(170.0 < speed < 240.0 for speed in found)
    assert speeds_between(made, 0.4, 10.0) == []


def told(capsys):
    return json.loads(capsys.readouterr().out)


def test_the_verb_runs_and_goes_on_from_its_file(tmp_path, capsys):
    path = str(tmp_path / "run-up.h5")
    assert main([*RUN, "--workers", "1", "--output", path, "--json"]) == 0
    said = told(capsys)
    assert said["speeds"] == pytest.approx([1500.0 + 20.0 * k for k in range(11)])
    assert said["workers"] == 1 and said["resumed"] == 0 and said["axial_orders_um"] == {}
    assert max(said["settling_left"]) <= 1e-4 and sum(said["cycles"]) < 4.5 * 11
    nine = said["torsion_orders_deg"]["9"]
    (peak,) = [peak for peak in said["peaks"] if peak["order"] == 9.0]
    assert peak["amplitude"] == pytest.approx(max(nine), rel=0.02)
    # The peak of a torsional crank lies at its linear critical speed.
    assert peak["rpm"] == pytest.approx(60.0 / 9.0 * peak["mode_hz"], rel=0.01)
    # So does the mode of the running crank, whose journals are locked on their axis.
    assert peak["mode_in_motion_hz"] == pytest.approx(peak["mode_hz"], rel=0.005)
    assert abs(peak["off_in_motion_percent"]) < 1.0
    assert main([*RUN, "--to", "1740", "--workers", "1", "--output", path, "--json"]) == 0
    longer = told(capsys)
    assert longer["resumed"] == 11 and len(longer["speeds"]) == 13
    # The mode in motion is of speeds that ran now.
    assert [peak["mode_in_motion_hz"] for peak in longer["peaks"] if peak["order"] == 9.0] == [None]
    assert longer["torsion_orders_deg"]["9"][:11] == nine
    assert main([*RUN, "--load", "0.5", "--workers", "1", "--output", path, "--json"]) == 2
    refused = told(capsys)["error"]
    assert refused["what"].startswith("holds another run-up") and "--anew" in refused["remedy"]
    assert RunUp.load(path).speeds.size == 13


@pytest.fixture(scope="module")
def one_speed(tmp_path_factory):
    """Content of the file of a run-up of one speed, and its command without the file."""
    path = tmp_path_factory.mktemp("one") / "run-up.h5"
    command = [*RUN, "--to", "1500", "--workers", "1", "--json"]
    assert main([*command, "--output", str(path)]) == 0
    return path.read_bytes(), command


@pytest.mark.parametrize("share", [0.0005, 0.005, 0.1, 0.5, 0.999])
def test_a_file_cut_short_is_refused_and_stays(one_speed, share, tmp_path, capsys):
    whole, command = one_speed
    path = tmp_path / "run-up.h5"
    content = whole[: int(share * len(whole))]
    path.write_bytes(content)
    capsys.readouterr()
    for options in ((), ("--anew",)):
        assert main([*command, *options, "--output", str(path)]) == 2
        refused = told(capsys)["error"]
        assert "cut short" in refused["what"] and "copy it again" in refused["remedy"]
    with pytest.raises(StoreError, match=r"cut short.*; copy it again from a complete one, or delete it and run"):
        RunUp.load(path)
    assert path.read_bytes() == content


def begun(path, speeds, *options):
    """A run-up in a process of its own that has told of so many speeds, and what it says then."""
    command = [sys.executable, "-m", "cranktrain.cli.main", *RUN, "--to", "2000", "--workers", "2", *options]
    process = subprocess.Popen(
        [*command, "--output", str(path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    next(line for line in process.stderr if f" {speeds} of 26 speeds" in line)
    return process


def test_killed_midway_it_loses_no_finished_speed(tmp_path, capsys):
    path = tmp_path / "run-up.h5"
    process = begun(path, 6)
    process.kill()
    process.communicate()
    kept = RunUp.load(path)
    assert 6 <= kept.speeds.size < 26
    assert main([*RUN, "--to", "2000", "--workers", "1", "--output", str(path), "--json"]) == 0
    said = told(capsys)
    assert said["resumed"] == kept.speeds.size and len(said["speeds"]) == 26
    whole = RunUp.load(path)
    at = np.searchsorted(whole.speeds, kept.speeds - 1e-9)
    assert np.array_equal(whole.torsion[at], kept.torsion)


def test_a_lost_worker_is_one_line_and_the_work_is_kept(tmp_path):
    path = tmp_path / "run-up.h5"
    process = begun(path, 3, "--json")
    children = subprocess.run(["pgrep", "-P", str(process.pid)], capture_output=True, text=True, check=True)
    os.kill(int(children.stdout.split()[0]), signal.SIGKILL)
    said, _ = process.communicate()
    error = json.loads(said)["error"]
    assert process.returncode == 2 and "a worker process ended" in error["what"]
    assert f"keeps {RunUp.load(path).speeds.size} speeds" in error["what"] and "continue from there" in error["remedy"]


def test_a_ramp_shows_what_steady_cycles_do(made, tmp_path, capsys):
    """Slowly through the peak of order 9; what is left is that a resonance takes its time, later than the speed."""
    path = str(tmp_path / "ramp.h5")
    span = ("--from", "1540", "--to", "1620")
    assert main([*RUN, *span, "--ramp", "25", "--highest-order", "12", "--output", path, "--json"]) == 0
    swept = told(capsys)
    ramp = RunUp.load(path).order(9.0)
    runs = steady(made)
    cycles = np.array([runs.at(rpm * RPM).amplitudes["pulley.torsion"][17] for rpm in swept["speeds"]])
    assert swept["cycles"] == [0] * 5 and swept["workers"] == 1
    assert np.abs(ramp - cycles).max() < 0.05 * np.abs(cycles).max()
    assert np.abs(np.abs(ramp).max() / np.abs(cycles).max() - 1.0) < 0.01


def test_the_frequency_domain_has_the_same_peaks(tmp_path, capsys):
    path, pictures = str(tmp_path / "steady.h5"), tmp_path / "pictures"
    assert main([*RUN, "--method", "harmonic-balance", "--output", path, "--plots", str(pictures), "--json"]) == 0
    balanced = told(capsys)
    assert {"torsion_orders.png", "campbell.png"} <= {place.name for place in pictures.iterdir()}
    assert set(balanced["plots"]) == {str(place) for place in pictures.iterdir()}
    assert main([*RUN, "--workers", "1", "--output", path, "--json"]) == 2  # its file is of another run-up
    capsys.readouterr()
    assert main([*RUN, "--workers", "1", "--anew", "--output", path, "--json"]) == 0
    in_time = told(capsys)
    for order in ("6", "9"):
        one, other = (np.array(said["torsion_orders_deg"][order]) for said in (balanced, in_time))
        assert np.abs(one - other).max() < 0.01 * other.max()
    assert main([*RUN, "--method", "linear", "--output", path, "--json"]) == 2
    assert "holds steady cycles" in told(capsys)["error"]["what"]


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(2, threads_per_worker=1, dashboard_address=None, silence_logs=logging.ERROR) as made:
        yield made


@pytest.mark.slow
def test_a_cluster_finds_the_same_even_when_a_worker_is_killed(tmp_path, cluster, capsys):
    here, there = tmp_path / "here.h5", tmp_path / "there.h5"
    assert main([*RUN, "--workers", "1", "--output", str(here), "--json"]) == 0
    capsys.readouterr()
    once_there(there, lambda: os.kill(cluster.workers[0].pid, signal.SIGKILL))
    assert main([*RUN, "--scheduler", cluster.scheduler_address, "--output", str(there), "--json"]) == 0
    assert told(capsys)["workers"] == 2
    one, other = RunUp.load(here), RunUp.load(there)
    assert np.array_equal(one.speeds, other.speeds)
    assert np.abs(one.torsion - other.torsion).max() < 1e-3 * np.abs(one.torsion).max()


@pytest.mark.slow
def test_a_cluster_without_workers_is_one_line_and_the_work_is_kept(tmp_path, cluster, capsys):
    path = tmp_path / "run-up.h5"
    command = [*RUN, "--to", "6000", "--scheduler", cluster.scheduler_address, "--output", str(path), "--json"]
    once_there(path, lambda: cluster.scale(0))
    assert main(command) == 2
    refused = told(capsys)["error"]
    assert "no workers left" in refused["what"] and "continue from there" in refused["remedy"]
    assert RunUp.load(path).speeds.size > 0
    assert main(command) == 2
    assert "the cluster has no workers" in told(capsys)["error"]["what"]


def test_a_scheduler_that_does_not_answer_is_one_line(tmp_path, capsys):
    pytest.importorskip("distributed")
    path = tmp_path / "run-up.h5"
    assert main([*RUN, "--scheduler", "tcp://127.0.0.1:1", "--output", str(path), "--json"]) == 2
    assert "no Dask scheduler answers" in told(capsys)["error"]["what"] and not path.exists()


def once_there(path, act):
    """Act, beside the test, once a file is there."""

    def wait():
        while not path.is_file():
            time.sleep(0.02)
        act()

    threading.Thread(target=wait, daemon=True).start()
