"""A published six of discs and shafts with loss factors (tests/data/mwm): torques of its shafts, twist of its pulley.

Sums over the orders 0.5 to 12 of the vibratory torques that Mendes, Meirelles and Zampieri state (Proc. IMechE K 222
(2008), doi 10.1243/14644193JMBD126), and those of an own model at 2150 rev/min, are in ``expected.json``.
"""

import json
import math

import numpy as np
import pytest
from expected import DATA

from cranktrain.cli.main import main
from cranktrain.results.run_up.run_up import RunUp

MWM = DATA / "mwm"
EXPECTED = json.loads((MWM / "expected.json").read_text("utf-8"))
FLYWHEEL, PULLEY = 2.075, 0.017
"""Inertias of engine file and table, kg m²."""
RESONANCE = 2150


def run_up(folder, table, rule, low, high):
    """Sums of orders (s, 2) of the torques cylinder 6 to flywheel and pulley to gear, N m; the run-up."""
    path = folder / "run_up.h5"
    steady = ["--method", rule] if rule else ["--workers", "1", "--outputs", "flywheel.torsion"]
    code = main([
        "runup", str(MWM / "mwm.toml"), "--crank", "torsional", "--mesh", str(MWM / table), "--no-inherit", *steady,
        "--from", str(low), "--to", str(high), "--step", "50", "--highest-order", "12", "--output", str(path),
        "--pressure", str(MWM / "pressure"), "--pressure-unit", "MPa",
    ])  # fmt: skip
    assert code == 0
    found = RunUp.load(path)
    if rule:
        [last] = [name for name in found.amplitudes if name.endswith("to flywheel].torque")]
        torques = [found.amplitudes[last], found.amplitudes["shaft[pulley to gear].torque"]]
    else:
        # The discs at the ends feel their shafts alone, but for the soft shaft of the dynamometer.
        squares = (found.speeds[:, None] * found.orders) ** 2
        torques = [FLYWHEEL * squares * found.amplitudes["flywheel.torsion"],
                   PULLEY * squares * found.amplitudes["pulley.torsion"]]  # fmt: skip
    return np.stack([np.abs(torque).sum(axis=1) for torque in torques], axis=1), found


def published(speeds):
    return np.array([EXPECTED["rpm"][f"{speed * 30.0 / math.pi:.0f}"] for speed in speeds])


def at_resonance(torques, found, tolerance):
    """Whether the torques at 2150 rev/min lie in the range of both references, wider by a share of them."""
    row = torques[int(np.argmin(np.abs(found.speeds * 30.0 / math.pi - RESONANCE)))]
    own = [EXPECTED["own_model_2150"][name] for name in ("cyl6-flywheel", "pulley-gear")]
    for value, *ends in zip(row, EXPECTED["rpm"][str(RESONANCE)], own, strict=True):
        assert (1.0 - tolerance) * min(ends) < value < (1.0 + tolerance) * max(ends)


@pytest.mark.parametrize("table", ["chain.csv", "pins.csv"])
def test_torques_of_a_published_six_in_the_frequency_domain(tmp_path, table):
    """Discs at pins, or between massless mains: within 9 % at every speed, 5 % in the mean, 3 % at resonance."""
    torques, found = run_up(tmp_path, table, "linear", 1000, 2500)
    known = np.isin(np.rint(found.speeds * 30.0 / math.pi), [float(rpm) for rpm in EXPECTED["rpm"]])
    errors = np.abs(torques[known] / published(found.speeds[known]) - 1.0)
    assert errors.max() < 0.09
    assert errors.mean() < 0.05
    at_resonance(torques, found, 0.03)
    order_6 = np.abs(found.torsion[np.argmin(np.abs(found.speeds * 30.0 / math.pi - RESONANCE)), 11])
    assert math.degrees(order_6) == pytest.approx(EXPECTED["own_model_2150"]["order_6_pulley_deg"], rel=0.01)


@pytest.mark.parametrize("table", ["chain.csv", "pins.csv"])
def test_torques_of_a_published_six_by_harmonic_balance(tmp_path, table):
    at_resonance(*run_up(tmp_path, table, "harmonic-balance", RESONANCE, RESONANCE + 50), 0.05)


def test_torques_of_a_published_six_in_time(tmp_path):
    at_resonance(*run_up(tmp_path, "chain.csv", "", RESONANCE, RESONANCE), 0.05)
