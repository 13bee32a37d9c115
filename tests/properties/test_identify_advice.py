"""What would narrow a wide interval: the bound of Cramér and Rao falls as the report says once the signal is added."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from identified import model_of, places

from cranktrain.cli.main import main
from cranktrain.core.threads import one_thread
from cranktrain.engine.file import load_engine
from cranktrain_lab.identification.advice import HELPS, advised, half_intervals
from cranktrain_lab.identification.comparison import Comparison
from cranktrain_lab.identification.confidence import Confidence, confidence_of
from cranktrain_lab.identification.data import FREQUENCY, RATIO, Data, Scalar
from cranktrain_lab.identification.estimate import estimate
from cranktrain_lab.identification.further_signals import further_signals
from cranktrain_lab.identification.identify import parameter_row
from cranktrain_lab.identification.ladder import Ask, Climbed, Step, levels_beyond
from cranktrain_lab.identification.model import TorsionalModel
from cranktrain_lab.identification.parameters import Sought

FIRST, SECOND = "damping.torsional_ratios[1]", "damping.torsional_ratios[2]"
SHORT = ("single_petrol", (1.0, 2.0, 2.5), (FIRST, "load"), 1e-5)
LONG = ("v12_petrol", (4.5, 6.0, 7.5), (FIRST, SECOND, "load"), 1e-5)


@pytest.fixture(autouse=True)
def _one_thread():
    with one_thread():
        yield


def measured(name, orders, keys, noise, output="pulley.torsion", scalars=()):
    """Comparison of a model with its own linear orders and the file's values, and its estimate."""
    engine = load_engine(name).without_additions
    engine = replace(engine, damping=replace(engine.damping, torsional_ratios=(0.02, 0.03)))
    data = Data(places(np.linspace(*engine.speeds, 16), orders, output, noise), scalars)
    model = model_of(engine, keys, data, engine.damper is not None)
    return compared(model, model.sought)


def compared(model, sought):
    """Comparison of a model with its own answers at the start, and its estimate."""
    own = model.answers(np.array([one.start for one in sought]))
    strands = (replace(one, values=values) for one, values in zip(model.data.strands, own.strands, strict=True))
    scalars = (replace(one, value=value) for one, value in zip(model.data.scalars, own.scalars.tolist(), strict=True))
    model.data = Data(tuple(strands), tuple(scalars))
    comparison = Comparison(model, model.data, sought)
    return model, comparison, estimate(comparison, 1, start=comparison.start)


def with_data(model, comparison, strands=(), scalars=()):
    """Half of each interval, in u, once signals are added to the data."""
    other = model.beside(Data((*model.data.strands, *strands), (*model.data.scalars, *scalars)))
    _, both, found = compared(other, comparison.sought)
    return halves(both, found)


def halves(comparison, found):
    sure = confidence_of(comparison, found, np.zeros((0, found.inner.size)))
    return half_intervals(comparison.sought, found.inner, sure.covariance, sure.reach)


def advice_of(model, comparison, found, beyond=(), ask=None):
    climbed = Climbed(found, (), beyond)
    sure = confidence_of(comparison, found, climbed.moves)
    return advised(model, comparison, climbed, sure, ask or Ask("linear"))


@pytest.mark.parametrize("case", [SHORT, LONG], ids=["short crank", "long crank"])
def test_an_interval_falls_to_what_is_said_once_the_decay_that_is_named_is_measured(case):
    """Far from its resonance no order knows a mode's damping; its free decay does, and no other number knows more."""
    model, comparison, found = measured(*case)
    number = 1 if case is SHORT else 2
    k = number - 1
    (row,) = advice_of(model, comparison, found)
    assert row["key"] == comparison.sought[k].key
    assert row["half_percent"] == pytest.approx(100.0 * halves(comparison, found)[k], rel=1e-9)
    (best,) = row["add"]
    assert best["states"] == f"[[decay]] number = {number}" and best["half_percent"] < HELPS * row["half_percent"]
    decay = Scalar("decay", RATIO, number, 1.0, 0.05, False)
    assert 100.0 * with_data(model, comparison, scalars=(decay,))[k] == pytest.approx(best["half_percent"], rel=0.02)
    for other in (replace(decay, number=3 - number), *(Scalar("hz", FREQUENCY, n, 1.0, 0.005, False) for n in (1, 2))):
        assert 100.0 * with_data(model, comparison, scalars=(other,))[k] > best["half_percent"], other


@pytest.mark.parametrize(
    "case",
    [
        ("single_petrol", (1.0, 2.0, 2.5), ("pulley.polar_inertia", "load"), 1e-5),
        ("v12_petrol", (1.5, 3.0), ("pulley.polar_inertia", "crank.stiffness", "load"), 1e-5),
    ],
    ids=["short crank", "long crank"],
)
def test_orders_at_the_other_end_narrow_as_is_said(case):
    """As noisy as the file's, and as wrong as these; the twist is then the difference of both and no further signal."""
    model, comparison, found = measured(*case)
    signals = [one for one in further_signals(model, comparison, found.inner) if one.states.startswith("[[orders]]")]
    (signal,), output = signals, "flywheel.torsion"
    assert signal.states == f'[[orders]] output = "{output}"'
    said = np.sqrt(np.diag(np.linalg.inv(found.information + comparison.known + signal.information)))
    beside = (replace(one, name=output, output=output) for one in model.data.strands)
    other = model.beside(Data((*model.data.strands, *beside)))
    _, both, again = compared(other, comparison.sought)
    measured_spread = np.sqrt(np.diag(np.linalg.inv(again.information + both.known)))
    before = np.sqrt(np.diag(np.linalg.inv(found.information + comparison.known)))
    assert measured_spread == pytest.approx(said, rel=0.05) and np.all(said < before)
    after = further_signals(other, both, again.inner)
    assert after and not any(one.states.startswith("[[orders]]") for one in after)


def test_a_file_of_frequencies_alone_is_told_which_orders_would_tell_its_parameters_apart():
    frequency = Scalar("hz", FREQUENCY, 1, 1.0, 0.005, False)
    keys = ("pulley.polar_inertia", "flywheel.polar_inertia", "crank.stiffness")
    model, comparison, found = measured("v12_petrol", (), keys, 0.0, scalars=(frequency,))
    rows = advice_of(model, comparison, found)
    assert [row["key"] for row in rows] == list(keys)
    for row in rows:
        assert row["add"][0]["states"].startswith("[[orders]]")
        assert row["add"][-1]["half_percent"] < 0.3 * row["half_percent"]
        assert row["text"].startswith(f"{row['key']} is known to ±") and "\n" not in row["text"]


def test_a_move_by_a_level_above_is_left_by_a_fit_of_that_level_and_held_by_a_decay():
    """Levels agree on a free decay of the standing crank, so it holds what orders alone would move."""
    model, comparison, found = measured("v12_petrol", (4.5, 6.0, 7.5), (FIRST, "load"), 1e-5)
    assert not advice_of(model, comparison, found)
    moved = Step("beam in time", found.inner + np.array([0.3, 0.2]), 1)
    ratio, load = advice_of(model, comparison, found, (moved,), Ask("linear", above="beam"))
    assert load["add"][0]["states"].startswith("--method time --crank beam, with damping.ratio in place")
    assert load["half_percent"] > 39.0 and load["add"][0]["half_percent"] < 1.0
    assert ratio["half_percent"] > 58.0
    signals = {one.states: one for one in further_signals(model, comparison, found.inner)}
    decay = signals["[[decay]] number = 1"]
    assert decay.agreed and decay.information[0, 0] == pytest.approx(1.0 / 0.05**2, rel=1e-3)


def test_a_decay_leaves_of_a_move_the_share_that_orders_have_in_the_information():
    """Of one parameter, with information a of the orders and b of the decay: d a / (a + b)."""
    model, comparison, found = measured("v12_petrol", (4.5, 6.0, 7.5), (FIRST,), 5e-4)
    move = 0.3
    moved = Step("beam in time", found.inner + move, 1)
    (row,) = advice_of(model, comparison, found, (moved,), Ask("linear", above="beam"))
    a, b = float(found.information[0, 0] + comparison.known[0, 0]), 1.0 / 0.05**2
    before, after = 1.0 / a + move**2, 1.0 / (a + b) + (move * a / (a + b)) ** 2
    decay = row["add"][0]
    assert decay["states"] == "[[decay]] number = 1" and 0.1 * b < a < b
    assert decay["half_percent"] / row["half_percent"] == pytest.approx(math.sqrt(after / before), rel=1e-2)


def test_numbers_beside_orders_hold_the_estimate_against_the_level_above(monkeypatch):
    """Orders of a level whose mode is damped by half as much again; a decay known to 0.02 % stays where it was."""
    moves = []
    for deviation in (None, 2e-4):
        decay = () if deviation is None else (Scalar("decay", RATIO, 1, 1.0, deviation, False),)
        model, comparison, found = measured("v12_petrol", (4.5, 6.0, 7.5), (FIRST, "load"), 1e-5, scalars=decay)

        def in_time(self, values, *given, **named):
            return self.answers(values * [1.5, 1.0]).strands

        monkeypatch.setattr(TorsionalModel, "in_time", in_time)
        monkeypatch.setattr(TorsionalModel, "balanced", lambda self, values: self.answers(values).strands)
        steps = levels_beyond(model, None, comparison, found, Ask("linear", above="beam"))
        moves.append(abs(steps[-1].inner[0] - found.inner[0]))
    assert moves[0] == pytest.approx(math.log(1.5), rel=0.05) and moves[1] < 0.3 * moves[0]


def test_an_angle_about_zero_has_no_relative_interval_or_deviation_and_one_far_from_it_has():
    """Percent of nothing say nothing: the encoder's zero of a search that has just begun."""
    zero = Sought("zero.pulley", 0.0, -0.5, 0.5, math.inf, "deg", math.radians(1.0), in_file=False)
    sure = Confidence(np.array([[1e-4]]), 1e6)
    rows = [parameter_row(zero, 0, np.array([zero.inner(u)]), sure, None, None, np.zeros(1)) for u in (0.0, 1e-3, 0.4)]
    assert [row["deviation_percent"] for row in rows[:2]] == [None, None]
    assert rows[2]["deviation_percent"] == pytest.approx(100.0 * 0.01 / 0.4)
    assert half_intervals([zero], np.array([0.001]), sure.covariance, sure.reach) == [0.0]
    far = half_intervals([zero], np.array([zero.inner(0.4)]), sure.covariance, sure.reach)
    assert far == pytest.approx([1.96 * 0.01 / 0.4], rel=1e-3)


def test_the_command_prints_one_sentence_for_each_wide_parameter(tmp_path, capsys):
    """Of a frequency alone neither inertia nor stiffness is known; the start of a line names what would tell them."""
    data = Data((), (Scalar("hz", FREQUENCY, 1, 1.0, 0.005, False),))
    (hz,) = model_of(load_engine("single_petrol"), ["load"], data).numbers(np.ones(1))
    path, keys = tmp_path / "measured.toml", '"pulley.polar_inertia" = {}\n"crank.stiffness" = {}\n'
    path.write_text(f"[parameters]\n{keys}[[frequencies]]\nhz = {hz:.2f}\n", "utf-8")
    assert main(["identify", "single_petrol", str(path), "--bootstrap", "0", "--no-profile"]) == 0
    told = capsys.readouterr().out
    assert re.search(r"pulley.polar_inertia and crank.stiffness|crank.stiffness and pulley.polar_inertia", told)
    lines = [line for line in told.splitlines() if line.startswith("Narrower: ")]
    assert [line.split()[1] for line in lines] == ["pulley.polar_inertia", "crank.stiffness"]
    assert all("would narrow this to ±" in line for line in lines)
