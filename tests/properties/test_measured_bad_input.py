"""Bad input of ``cranktrain measured``: each ends with code 2 and one line that says what, with numbers."""

import math

import numpy as np
import pytest
import scipy.io
from pulse_signals import channel, motion, sine_signal

from cranktrain.cli.main import main
from cranktrain_lab.measured.rotation import rotation
from cranktrain_lab.measured.wheel import Wheel

PULLEY = ["--rotation", "pulley"]
CASES = {
    "an unknown channel": (["--rotation", "puley"], "channel 'puley' is not in run.mat; did you mean 'pulley'?"),
    "an unknown channel of many": (["--channels", "pulley,tachoo"], "channel 'tachoo' is not in run.mat"),
    "two tachos that disagree": ([*PULLEY, "--second", "rear", "--second-teeth", "120"], "a ratio of 1.0300"),
    "an index that disagrees": ([*PULLEY, "--index", "four"], "counts 15.0 teeth from index to index of four, not 60"),
    "a second place at rest": (
        [*PULLEY, "--second", "still", "--second-teeth", "60"], "does not vary, 0 pulses in 300000",
    ),
    "a second place without teeth": ([*PULLEY, "--second", "rear"], "needs its teeth a revolution"),
    "too few pulses for an order": (
        [*PULLEY, "--orders", "0.5-40"], "too few points for order 40; they resolve orders up to",
    ),
    "a pulse a revolution for orders": (
        ["--rotation", "one", "--teeth", "1", "--orders", "0.5"], "resolve orders up to 0",
    ),
    "an order that is no half": ([*PULLEY, "--orders", "2.2"], "order 2.2 is not a multiple of 0.5"),
    "cycles too many": ([*PULLEY, "--orders", "6", "--cycles", "64"], "cycles are recorded; a fit spans 64"),
    "too few revolutions": (["--rotation", "p1", "--teeth", "60"], "pulses are 1.1 revolutions of 60 pulses"),
    "aliasing of an order": ([*PULLEY, "--orders", "6", "--of", "slow/acc"], "100 Hz resolve order 1.6 at 149"),
    "aliasing of pulses": (["--rotation", "fast", "--teeth", "900"], "s, below the 4 that are needed"),
    "a shaft that stands still": (["--rotation", "still", "--teeth", "60"], "the shaft stands still"),
    "a shaft that hardly turns": (
        ["crawl.mat", "--rotation", "crawl", "--teeth", "60"], "turns at 0.5 rev/min, it stands still",
    ),
    "a speed beyond all engines": (["--rotation", "rear", "--teeth", "2"], "above 50000 rev/min; check the pulses"),
    "noise for pulses": (["--rotation", "noise", "--teeth", "60"], "these are no pulses of a wheel of 60 teeth"),
    "a gap that is not there": ([*PULLEY, "--teeth", "36", "--missing", "1"], "no gap of 1 missing teeth among"),
    "teeth learned too briefly": (
        [*PULLEY, "--learn-teeth", "1,1.1"], "learned from 8 revolutions or more; there are 1",
    ),
    "cycles too few": ([*PULLEY, "--orders", "3", "--cycles", "2"], "2 cycles do not tell half orders"),
    "a filter too narrow": (
        [*PULLEY, "--orders", "3", "--bandwidth-hz", "0.05"], "too short for a bandwidth of 0.05 Hz, which needs 80 s",
    ),
    "a pressure without its unit": ([*PULLEY, "--pressure", "p1", "--engine", "diesel_i6"], "states no unit; give one"),
    "a pressure of another engine": (
        [*PULLEY, "--pressure", "p1", "--unit", "bar", "--engine", "diesel_i6"], "the trace is of another engine",
    ),
    "more pressures than cylinders": (
        [*PULLEY, "--pressure", ",".join(7 * ["p1"]), "--unit", "bar", "--engine", "diesel_i6"],
        "7 pressures for the 6 cylinders of diesel_i6",
    ),
    "a pressure in volts": ([*PULLEY, "--pressure", "p1", "--unit", "V", "--engine", "diesel_i6"], "channel p1: "),
    "an engine that is not there": (["--pressure", "p1", "--engine", "diesel_i66"], "did you mean 'diesel_i6'?"),
}  # fmt: skip


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A recording with a 60-2 wheel on the pulley and channels that fit nothing; a slow one in a structure."""
    rate, folder = 5e4, tmp_path_factory.mktemp("bad")
    t, _, theta = motion(rate, 6.0, (1000, 1500), {3.0: (0.5, 0.0)})
    scipy.io.savemat(folder / "run.mat", {
        "time": t, "pulley": sine_signal(theta, 60, 2), "rear": sine_signal(1.03 * theta, 120),
        "one": sine_signal(theta, 1), "four": sine_signal(theta, 4), "fast": sine_signal(theta, 900),
        "still": np.full(t.size, 1.2), "noise": np.random.default_rng(0).normal(size=t.size),
        "p1": 1.0 + 30.0 * np.exp(-((((theta % (4.0 * math.pi)) - 6.0) / 0.3) ** 2)),
        "slow": {"acc": np.sin(t[::500]), "time": t[::500]},
    })  # fmt: skip
    slow = np.arange(60_000) / 100.0
    scipy.io.savemat(folder / "crawl.mat", {"crawl": sine_signal(math.pi / 60.0 * slow, 60), "fs": 100.0})
    return folder


@pytest.mark.parametrize("case", CASES)
def test_bad_input_is_told_in_one_line_with_numbers(case, recording, capsys, monkeypatch):
    options, said = CASES[case]
    monkeypatch.chdir(recording)
    assert main(["measured", "run.mat", *options, "--output", "out.csv"] if "--orders" in options else
                ["measured", "run.mat", *options]) == 2  # fmt: skip
    lines = [line for line in capsys.readouterr().err.splitlines() if not line.startswith("cranktrain: remark: ")]
    assert len(lines) == 1 and said in lines[0], lines
    assert not (recording / "out.csv").exists()


def test_a_wheel_with_three_gaps_is_bridged_not_refused():
    """36-2-2-2 teeth lack a sixth of their pulses and turn as an even wheel of 36 does."""
    t, _, theta = motion(5e4, 6.0, (1000, 1500), {})
    s = theta * (36.0 / math.tau)
    wave = np.where(np.isin(np.floor(s + 0.5) % 36, (16, 17, 19, 20, 34, 35)), -0.9, np.sin(math.tau * s))
    turning = rotation(channel(wave, 5e4), Wheel(36))
    assert turning.numbered.lost > 600 and turning.speed_range[1] == pytest.approx(1500.0 * math.pi / 30.0, rel=0.01)
    assert np.ptp(turning.angle) == pytest.approx(np.ptp(np.interp(turning.times, t, theta)), abs=1e-4)
