"""Watch: defects are told from orders of torsion alone, healthy engines raise the stated rate of alarms."""

import math
from pathlib import Path

import numpy as np
import pytest
from one_line import one_line
from some import some

import cranktrain as ct
from cranktrain.core.threads import one_thread
from cranktrain.core.units import RPM
from cranktrain.engine.file import load_engine
from cranktrain_lab.watch.defects import MISFIRE, with_misfire
from cranktrain_lab.watch.detector import Finding, Verdict
from cranktrain_lab.watch.recordings import Place, TorsionalAnswers
from cranktrain_lab.watch.scatter import real_rows
from cranktrain_lab.watch.watch import Watch, said

NOISE = math.radians(1e-3)
ORDERS = 0.5 * np.arange(1, 13)


def made(name, speeds_rpm, orders=ORDERS):
    """Watch of a shipped engine with the linear model, and the model."""
    engine = load_engine(name)
    with one_thread():
        answers = TorsionalAnswers(engine, 1.0, engine.damper is not None, "linear", inherit=False)
        return Watch(answers, Place("pulley.torsion", np.array(speeds_rpm) * RPM, orders)), answers


@pytest.fixture(scope="module")
def six():
    return made("diesel_i6", [1400.0, 2200.0])


@pytest.fixture(scope="module")
def four():
    return made("four_petrol", [1500.0, 3000.0, 4500.0])


def noisy(orders, count, rng):
    """Recordings (count, s, o) with noise on every order."""
    shape = (count, *orders.shape)
    return orders + NOISE * (rng.normal(size=shape) + 1j * rng.normal(size=shape))


@pytest.mark.parametrize("engine", ["six", "four"])
def test_every_defect_is_named_where_noise_is_small(engine, request):
    watch, answers = request.getfixturevalue(engine)
    rng = np.random.default_rng(1)
    detector = watch.detector(noisy(watch.own, 8, rng), 1, 0.01)
    for k, defect in some(enumerate(watch.defects)):
        severity = defect.severities[-1]
        if not detector.smallest(k) < 0.5 * severity:
            assert defect.kind == "shaft"  # behind a heavy flywheel
            continue
        true = answers.orders(defect.of(answers.healthy, severity), watch.place)
        verdict = detector.judge(real_rows(noisy(true, 1, rng)[0]))
        best = verdict.findings[0]
        assert verdict.alarm and verdict.explained
        assert best.key == defect.key
        assert best.severity == pytest.approx(severity, rel=0.15)


def test_false_alarms_are_those_stated(four):
    watch, _ = four
    rng = np.random.default_rng(2)
    alarms = trials = 0
    for k in range(12):
        detector = watch.detector(noisy(watch.own, 5, rng), 1, 0.05, k)
        alarms += sum(detector.judge(real_rows(one)).alarm for one in noisy(watch.own, 80, rng))
        trials += 80
    # Alarms of one set of healthy recordings are alike, so the sets are drawn, not the recordings: three deviations.
    expected, spread = 0.05 * trials, 3.0 * math.sqrt(trials * 0.05 * 0.95 * 3.0)
    assert abs(alarms - expected) < spread


def test_load_and_zero_that_scatter_are_no_defect(four):
    watch, answers = four
    rng = np.random.default_rng(3)
    less, more = (one.of(answers.healthy, 0.02) for one in watch.defects if one.kind == "load")
    slope = (answers.orders(more, watch.place) - answers.orders(less, watch.place)) / 0.04

    def recorded(count):
        loads = 0.05 * rng.normal(size=(count, 3, 1))
        turns = np.exp(1j * 0.01 * rng.normal(size=(count, 3, 1)) * ORDERS)
        return noisy(0.0 * slope, count, rng) + (watch.own + loads * slope) * turns

    healthy = recorded(30)
    detector = watch.detector(healthy, 1, 0.01)
    assert math.sqrt(detector.scatter.effects[0]) == pytest.approx(0.05, rel=0.3)
    assert math.sqrt(detector.scatter.effects[1]) == pytest.approx(0.01, rel=0.3)
    assert sum(detector.judge(real_rows(one)).alarm for one in recorded(100)) <= 6


def test_errors_of_the_model_that_both_share_raise_no_alarm(four):
    watch, _ = four
    rng = np.random.default_rng(5)
    true = 1.1 * watch.own * np.exp(0.2j) + np.radians(0.01)
    detector = watch.detector(noisy(true, 10, rng), 1, 0.01)
    assert sum(detector.judge(real_rows(one)).alarm for one in noisy(true, 100, rng)) <= 6


def test_a_change_of_no_listed_kind_is_not_explained(four):
    watch, _ = four
    rng = np.random.default_rng(6)
    odd = watch.own + 300.0 * NOISE * np.exp(2j * math.pi * rng.random(watch.own.shape))
    verdict = watch.detector(noisy(watch.own, 8, rng), 1, 0.01).judge(real_rows(noisy(odd, 1, rng)[0]))
    assert verdict.alarm and not verdict.explained


def test_firing_orders_alone_do_not_tell_the_cylinders_of_a_stiff_crank():
    watch, _ = made("four_petrol", [1500.0], np.array([2.0, 4.0]))
    rng = np.random.default_rng(7)
    detector = watch.detector(noisy(watch.own, 8, rng), 1, 0.01)
    taken = dict(detector.apart(0, 0.05))
    assert all(taken[f"misfire[{k}]"] > 0.2 for k in (2, 3, 4))


def test_a_single_cannot_tell_misfire_from_load():
    watch, _ = made("single_petrol", [2000.0, 3000.0])
    detector = watch.detector(noisy(watch.own, 8, np.random.default_rng(8)), 1, 0.01)
    taken = dict(detector.apart(0, 1.0))
    assert taken["load-"] > 0.4


def test_a_misfire_of_full_severity_leaves_the_motored_pressure(six):
    watch, answers = six
    gas = with_misfire(answers.engine, answers.healthy.gas, 2, 1.0)
    assert gas.own[2].fired == pytest.approx(gas.own[2].motored)
    assert gas.own[1].fired == pytest.approx(answers.healthy.gas.fired)
    assert gas.imep == pytest.approx(np.mean([one.imep for one in gas.own]))
    assert sum(one.kind == MISFIRE for one in watch.defects) == 6


def write(path, place, orders, phases=True):
    """Write complex orders (s, o), rad, as a file of measured orders."""
    lines = ["speed_rpm,order,amplitude,unit" + ",phase_deg" * phases]
    for k, speed in enumerate(place.speeds):
        for o, order in enumerate(place.orders):
            size, phase = np.degrees(np.abs(orders[k, o])), np.degrees(np.angle(orders[k, o]))
            lines.append(f"{speed / RPM:.3f},{order},{size:.8g},deg" + f",{phase:.6g}" * phases)
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return str(path)


@pytest.fixture(scope="module")
def files(four, tmp_path_factory):
    """Healthy recordings, one of a misfire of cylinder 3, and one without phases."""
    watch, answers = four
    folder, rng = tmp_path_factory.mktemp("recordings"), np.random.default_rng(9)
    misfire = answers.healthy._replace(gas=with_misfire(answers.engine, answers.healthy.gas, 2, 1.0))
    lost = answers.orders(misfire, watch.place)
    healthy = [write(folder / f"healthy{k}.csv", watch.place, own) for k, own in enumerate(noisy(watch.own, 4, rng))]
    return (
        healthy, write(folder / "misfire.csv", watch.place, noisy(lost, 1, rng)[0]),
        write(folder / "amplitudes.csv", watch.place, watch.own, phases=False), folder,
    )  # fmt: skip


def ask(measured, healthy, engine="four_petrol", **more):
    return ct.watch(engine, measured, healthy=healthy, method="linear", inherit=False, **more)


def test_a_misfire_is_found_from_files(files):
    healthy, misfire, _, _ = files
    found = ask(misfire, healthy)
    assert found["alarm"] and found["found"] == "misfire[3]"
    assert "misfire of cylinder 3" in " ".join(found["said"])
    quiet = ask(healthy[3], healthy[:3])
    assert quiet["found"] is None


def test_speeds_that_differ_a_little_are_brought_to_one_point(files, four):
    healthy, _, _, folder = files
    watch, answers = four
    moved = watch.place._replace(speeds=1.01 * watch.place.speeds)
    rng = np.random.default_rng(10)
    path = write(folder / "moved.csv", moved, noisy(answers.orders(answers.healthy, moved), 1, rng)[0])
    assert not ask(path, healthy, false_alarms=0.001)["alarm"]


def test_what_cannot_be_watched_is_refused_with_numbers(files, four):
    healthy, misfire, amplitudes, folder = files
    watch, _ = four
    fast, other = (write(folder / name, watch.place._replace(speeds=watch.place.speeds * times), watch.own)
                   for name, times in (("fast.csv", 3.0), ("other.csv", 1.1)))  # fmt: skip
    for told, measured, given, more in (
        ("2 healthy recordings are given; 3 or more", misfire, healthy[:2], {}),
        ("order 0.5 has no phase at 3 of 3 speeds; amplitudes alone do not tell", amplitudes, healthy, {}),
        ("engine 'single_petrol' explains ... % of the healthy", misfire, healthy, {"engine": "single_petrol"}),
        ("has no order 7.5 of pulley.torsion", misfire, healthy, {"orders": "7.5"}),
        ("fast.csv: 2 of 3 speeds, 4500 to 13500 rev/min, lie outside", fast, healthy, {}),
        ("order 0.5 was not recorded at 1650 rev/min", other, healthy, {}),
    ):
        with one_line(told):
            ask(measured, given, **more)


@pytest.mark.parametrize(
    ("likely", "told"),
    [((0.99, 0.01), "This is no defect: less load, severity 0.21, probability 99 %."),
     ((0.54, 0.46), "Likeliest: less load, which is no defect, severity 0.21, probability 54 %.")],
)  # fmt: skip
def test_a_defect_that_is_nearly_as_likely_is_not_ruled_out(likely, told):
    """Of a single a misfire is the same as less load: the sentence must not say that there is no defect."""
    named = ("less load", True, likely[0]), ("misfire of cylinder 1", False, likely[1])
    rows = [dict(zip(("defect", "harmless", "probability"), one, strict=True)) | {"severity": 0.21} for one in named]
    verdict = Verdict(True, 1e-3, (Finding("load-", 90.0, 0.21, likely[0], 0.5),))
    lines = said(verdict, rows)
    assert told in lines
    assert any("Not told apart from: misfire of cylinder 1" in line for line in lines) == (likely[1] > 0.1)


def test_a_recording_that_is_given_twice_is_refused(files):
    """Its scatter would be none: the smallest misfire that is found would be a billionth."""
    healthy, misfire, _, folder = files
    copy = folder / "copy.csv"
    copy.write_text(Path(healthy[0]).read_text("utf-8"), "utf-8")
    for given in (healthy[:1] * 3, [*healthy, str(copy)]):
        with one_line("holds the same orders as healthy0.csv; a recording counts once"):
            ask(misfire, given)
    with one_line("misfire.csv: holds the same orders as misfire.csv"):
        ask([misfire, misfire], healthy)
    assert ask(misfire, healthy, orders="2,4,2,2")["orders"] == [2.0, 4.0]  # an order that is named twice counts once
