"""Bad input of ``cranktrain measured``: each ends with code 2 and one line that says what, with numbers."""

import math

import numpy as np
import pytest
import scipy.io
from pulse_signals import channel, motion, sine_signal
from refusals import refused_files

from cranktrain.cli.main import main
from cranktrain_lab.measured.rotation import rotation
from cranktrain_lab.measured.wheel import Wheel


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


@pytest.mark.parametrize(("call", "said"), refused_files()["recording"]["calls"])
def test_bad_input_is_told_in_one_line_with_numbers(call, said, recording, capsys, monkeypatch):
    monkeypatch.chdir(recording)
    options = call.split() + (["--output", "out.csv"] if "--orders" in call else [])
    assert main(["measured", "run.mat", *options]) == 2
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
