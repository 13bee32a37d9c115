"""Identification of one mass in closed form, also beside the constant that pitch errors of a toothed wheel add."""

import math
from dataclasses import replace

import numpy as np
import pytest
from some import some

from cranktrain.core.threads import one_thread
from cranktrain.results.orders.measured import read_measured_orders
from cranktrain_lab.identification.bias import Bias, Residue, _unlikely, covariance, effective_count, estimated_bias
from cranktrain_lab.identification.comparison import Comparison
from cranktrain_lab.identification.confidence import (
    bootstrap,
    confidence_of,
    contradictions,
    directions,
    profiles,
    told_apart,
)
from cranktrain_lab.identification.data import Data, Scalar, Strand
from cranktrain_lab.identification.estimate import estimate
from cranktrain_lab.identification.ladder import Ask, climb
from cranktrain_lab.identification.model import Answers
from cranktrain_lab.identification.parameters import Sought
from cranktrain_lab.identification.residuals import held_out, lack_of_fit, region, residual_rows, runs_probability
from cranktrain_lab.measured.order_table import write_orders
from cranktrain_lab.measured.tracking import Orders


@pytest.fixture(autouse=True)
def _one_thread():
    """As the command does: matrices of forty rows are slower on several threads."""
    with one_thread():
        yield


SPEEDS = np.linspace(60.0, 140.0, 41)
VALUES = [1e4, 6.0, 30.0]
"""True k, c and F."""
LOGS, NOISE = np.log(VALUES), 2e-4


def one_mass(values, speeds=SPEEDS, order=1.0, part=1.0):
    """Order of a mass of 1 kg on a spring and a dashpot under a part of a force of constant amplitude."""
    k, c, force = values
    return force * part / (k - (order * speeds) ** 2 + 1j * order * speeds * c)


def slopes_of(speeds=SPEEDS, order=1.0, part=1.0):
    """Derivatives (n, 3) of an order by ln k, ln c, ln F."""
    (k, c, force), y = VALUES, one_mass(VALUES, speeds, order, part)
    return np.stack((-(y**2) / (force * part) * k, -(y**2) / (force * part) * 1j * order * speeds * c, y), axis=1)


def bound(slopes, noise=NOISE):
    """Cramér and Rao's covariance (Re JᴴJ/σ²)⁻¹."""
    return np.linalg.inv((slopes.conj().T @ slopes).real / noise**2)


class Model:
    """Answers by a function; ``also`` are those of a higher level."""

    def __init__(self, function, strands=1, also=None, scalars=()):
        self.function, self.count, self.also, self.numbers = function, strands, also, scalars
        self.calls = 0

    def answers(self, values):
        self.calls += 1
        found = self.function(values)
        strands = found if isinstance(found, tuple) else (found,) * self.count
        return Answers(strands, np.array([one(values) for one in self.numbers]), ())

    def balanced(self, values):
        return (self.also(values),) * self.count


def sought(**given):
    return tuple(Sought(key, start, low, high, math.inf, "1", 1.0) for key, (start, low, high) in given.items())


THREE = sought(k=(1.05e4, 7e3, 1.5e4), c=(4.0, 1.0, 30.0), F=(25.0, 10.0, 90.0))


def strand(values, name="one", noise=NOISE, held=None, speeds=SPEEDS, phases=True):
    held = np.zeros(speeds.size, dtype=bool) if held is None else held
    return Strand(name, "pulley.torsion", 1.0, speeds, values, np.full(speeds.size, noise), held, phases)


def noisy(rng, values, noise=NOISE):
    return values + noise * (rng.normal(size=values.size) + 1j * rng.normal(size=values.size))


def compared(values, parameters=THREE, model=None, **of_strand):
    return Comparison(model or Model(one_mass), Data((strand(values, **of_strand),)), parameters)


EXACT, BOUND = one_mass(VALUES), bound(slopes_of())


def test_values_are_found_with_the_covariance_of_cramer_and_rao():
    """Also by amplitudes, and from a start beyond the peak, where least squares alone end elsewhere."""
    found = estimate(compared(EXACT))
    assert np.exp(found.inner) == pytest.approx(VALUES, rel=1e-5)
    assert np.linalg.inv(found.information) == pytest.approx(BOUND, rel=0.02, abs=1e-12)
    far = sought(k=(7.2e3, 5e3, 2e4), c=(1.5, 1.0, 30.0), F=(80.0, 10.0, 90.0))
    assert np.exp(estimate(compared(EXACT, far), seed=3).inner) == pytest.approx(VALUES, rel=1e-4)
    values = np.abs(noisy(np.random.default_rng(3), EXACT)).astype(complex)
    assert np.exp(estimate(compared(values, phases=False)).inner) == pytest.approx(VALUES, rel=0.05)


@pytest.mark.parametrize("prior", [None, 1e-5])
def test_the_bootstrap_scatters_as_the_covariance(prior):
    """A prior on the stiffness worth three times the data: draws of the data alone would scatter half as much."""
    parameters = tuple(replace(one, prior=prior) if prior and one.key == "k" else one for one in THREE)
    comparison = compared(noisy(np.random.default_rng(5), EXACT), parameters)
    found = estimate(comparison)
    assert not prior or comparison.prior[0, 0] > 3.0 * found.information[0, 0]
    drawn = bootstrap(comparison, found, 400, 1)
    ratio = drawn.std(axis=0) / np.sqrt(np.diag(np.linalg.inv(found.information + comparison.known)))
    assert np.all((ratio > 0.6) & (ratio < 1.6))


PARTS = {1.0: 1.0, 1.5: 0.5, 2.0: 0.3}
"""Parts of the force of three orders of the same mass; the force is common to them, as the load of an engine is."""


@pytest.mark.parametrize("size", [0.28, 0.0])
def test_orders_that_fit_badly_by_slow_changes_over_the_speed_leave_the_force_in_its_interval(size):
    """At least 85 % of forty intervals hold (38 are expected); without error they are within 15 % of Cramér and Rao's.

    Each of three orders is wrong by 28 % on a wave of half to two times the measured speeds.
    """
    speeds, inside, wide, draws = np.linspace(50.0, 110.0, 24), 0, [], 40
    parameters = sought(k=(1.02e4, 7e3, 1.5e4), c=(5.0, 1.0, 30.0), F=(27.0, 3.0, 300.0))
    model = Model(lambda values: tuple(one_mass(values, speeds, *one) for one in PARTS.items()))
    for draw in range(draws):
        rng = np.random.default_rng([draw, 77])
        strands = []
        for order, true in zip(PARTS, model.function(VALUES), strict=True):
            length, phase = rng.uniform(15.0, 40.0), rng.uniform(0.0, 7.0)
            wrong = 1.0 + size * math.sqrt(2.0) * np.sin((speeds - 50.0) / length + phase)
            values = noisy(rng, true * wrong, 1e-4)
            strands.append(replace(strand(values, noise=math.nan, speeds=speeds), order=order))
        comparison = Comparison(model, Data(tuple(strands)), parameters)
        found = estimate(comparison, start=comparison.start)
        sure = confidence_of(comparison, found, np.zeros((0, 3)))
        inside += abs(found.inner[2] - LOGS[2]) <= sure.reach * sure.deviations[2]
        wide.append(sure.deviations)
    assert inside >= 0.85 * draws
    if not size:
        slopes = np.concatenate([slopes_of(speeds, *one) for one in PARTS.items()])
        assert np.mean(wide, axis=0) == pytest.approx(np.sqrt(np.diag(bound(slopes, 1e-4))), rel=0.15)


def residue(rng, count, size, told, noise=math.nan):
    """Residuals of an order with a bias, drawn by its covariance."""
    speeds, sizes, unknown = np.linspace(0.0, 200.0, count), np.full(count, size), np.full(count, math.nan)
    factor = np.linalg.cholesky(covariance(speeds, sizes, np.full(count, noise), told))
    return Residue(speeds, sizes, unknown, factor @ rng.normal(size=(count, 2)), np.zeros((count, 2, 1)))


def test_the_restricted_likelihood_finds_noise_length_and_the_bias_of_each_order():
    """Then a large order wrong by 1 % beside a small one wrong by 30 %, noise far below both."""
    rng, told = np.random.default_rng(3), Bias(0.01, 0.05, 15.0)
    found = estimated_bias([residue(rng, 120, 1.0, told) for _ in range(4)], np.eye(1))
    assert found.noise == pytest.approx(told.noise, rel=0.2)
    assert found.relative == pytest.approx(told.relative, rel=0.3)
    assert found.length == pytest.approx(told.length, rel=0.4)
    rng, orders = np.random.default_rng(4), ((1.0, 0.01), (0.05, 0.3))
    parts = [residue(rng, 60, size, Bias(1e-4, relative, 15.0), 1e-4) for size, relative in orders]
    found = estimated_bias(parts, np.eye(1))
    assert [found.of(k).relative for k in range(2)] == pytest.approx([0.01, 0.3], rel=0.4)


def test_derivatives_of_the_restricted_likelihood_are_its_differences():
    rng = np.random.default_rng(1)
    parts = [
        Residue(np.sort(rng.uniform(50.0, 200.0, 9)), rng.uniform(0.1, 1.0, 9), noise, rng.normal(size=(9, 2)),
                rng.normal(size=(9, 2, 3)))
        for noise in (np.full(9, math.nan), np.where(np.arange(9) < 4, 0.1, math.nan))
    ]  # fmt: skip
    at = np.array([-1.0, 3.0, -2.0, -1.0, -2.5])
    own = _unlikely(at, parts, np.eye(3))[1]
    for k, step in some(enumerate(1e-5 * np.eye(5))):
        ends = [_unlikely(at + side * step, parts, np.eye(3))[0] for side in (1.0, -1.0)]
        assert own[k] == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=1e-5)


def test_independent_values_count_one_by_one_and_equal_ones_once():
    assert effective_count(np.eye(7)) == pytest.approx(7.0)
    assert effective_count(np.ones((7, 7))) == pytest.approx(1.0)


def test_a_product_is_known_and_its_factors_are_not():
    two = (THREE[0], *sought(a=(3.0, 0.5, 20.0), b=(2.0, 0.5, 20.0)), THREE[2])
    comparison = compared(EXACT, two, Model(lambda v: one_mass((v[0], v[1] * v[2], v[3]))))
    found = estimate(comparison)
    (line,) = told_apart(found.information, comparison.known, [one.key for one in two])
    assert "a and b cannot be told apart" in line.replace("b and a", "a and b") and "any factor" in line
    assert "a^1 · b^1" in line.replace("b^1 · a^1", "a^1 · b^1")
    values = np.exp(found.inner)
    assert values[1] * values[2] == pytest.approx(VALUES[1], rel=1e-3)


def test_a_direction_counts_as_undetermined_where_its_information_is_rounding():
    rotation = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    found = directions(rotation @ np.diag([4e6, 4e-4, 4e-8]) @ rotation.T)
    assert [one.deviation for one in found] == pytest.approx([math.inf, 50.0, 0.5e-3], rel=1e-3)
    assert abs(found[1].parts @ rotation[:, 1]) == pytest.approx(1.0)
    assert [one.deviation for one in directions(np.zeros((2, 2)))] == [math.inf, math.inf]


@pytest.mark.parametrize(("known", "says"), [(1.0, "a and c cannot be told apart"), (2000.0, "a is not determined")])
def test_a_parameter_is_entangled_if_the_others_knowledge_would_make_it_three_times_surer(known, says):
    """One direction of two is unknown, and c has 0.2 of it. Priors leave c 20 times, or once, its own deviation."""
    u = np.array([-0.2, math.sqrt(0.96)])
    (line,) = told_apart(1e4 * np.outer(u, u), known * np.eye(2), ["a", "c"])
    assert says in line


def test_sets_that_want_different_values_contradict_each_other_in_numbers():
    """Two orders of stiffnesses 5 % apart; and a frequency beside an order of the true stiffness, or of another one."""
    rng = np.random.default_rng(8)
    one, other, same = (noisy(rng, one_mass((k, 6.0, 30.0))) for k in (1e4, 1.05e4, 1e4))

    def told(strands, *numbers):
        model = Model(one_mass, len(strands), scalars=len(numbers) * (hz,))
        comparison = Comparison(model, Data(strands, numbers), THREE)
        return contradictions(comparison, estimate(comparison))

    def hz(values):
        return math.sqrt(values[0]) / (2.0 * math.pi)

    (found,) = told((strand(one, "first"), strand(other, "second")))
    assert (found.first, found.second, THREE[found.parameter].key) == ("first", "second", "k")
    assert found.probability < 1e-4 and found.wants[0] < found.wants[1]
    assert not told((strand(one, "a"), strand(same, "b")))
    (found,) = told((strand(one),), Scalar("bench", "frequency", 1, 1.05 * hz((1e4,)), 0.005, False))
    assert {found.first, found.second} == {"one", "bench"} and found.freedom == 1
    assert found.distance == pytest.approx((math.log(1.05) / 0.005) ** 2, rel=0.1)


def test_the_higher_level_is_fitted_by_a_few_of_its_answers():
    """The linear level lacks the 6 % of the truth's force over the speed; the correction gives its values exactly."""

    def bent(values):
        return one_mass(values) * (1.0 + 0.06 * np.sin((SPEEDS - 60.0) / 12.0))

    model = Model(one_mass, also=bent)
    found = climb(model, compared(noisy(np.random.default_rng(6), bent(VALUES)), model=model), Ask())
    assert found.steps[-1].answers <= 5
    assert np.all(np.abs(found.estimate.inner - LOGS) < 3.0 * np.sqrt(np.diag(BOUND)))


def test_without_the_correction_the_next_level_widens_the_interval():
    """A level that is 5 % too low in force: its residuals are noise, and only the next level tells."""
    model = Model(one_mass, also=lambda v: 0.95 * one_mass(v))
    comparison = compared(noisy(np.random.default_rng(9), 0.95 * EXACT), model=model)
    found = climb(model, comparison, Ask("linear"))
    sure = confidence_of(comparison, found.estimate, found.moves)
    assert found.moves[0, 2] == pytest.approx(0.05, rel=0.1)
    assert abs(found.estimate.inner[2] - math.log(30.0)) < sure.reach * sure.deviations[2]


def test_an_interrupted_search_keeps_the_best_so_far():
    def stops(values):
        if model.calls == 40:
            raise KeyboardInterrupt
        return one_mass(values)

    model, own = Model(stops), [EXACT]
    found, fresh = estimate(compared(*own, model=model)), compared(*own)
    fresh.weigh(fresh.first_biases(own), own)
    assert found.interrupted
    assert np.sum(fresh.residuals(found.inner) ** 2) < np.sum(fresh.residuals(fresh.start) ** 2)


def test_runs_of_one_sign_and_repeated_speeds_tell_a_wrong_model_from_noise():
    smooth = np.sin(np.linspace(0.0, 6.0, 60))[:, None]
    assert runs_probability(smooth, np.arange(60.0)) < 1e-6
    assert runs_probability(np.random.default_rng(1).normal(size=(60, 2)), np.arange(60.0)) > 0.01
    rng, speeds = np.random.default_rng(1), np.repeat(np.arange(20.0), 4)
    noise = rng.normal(size=(80, 2))
    assert lack_of_fit(noise, speeds) > 0.01
    assert lack_of_fit(noise + 3.0 * np.sin(0.3 * speeds)[:, None], speeds) < 1e-6
    assert lack_of_fit(noise[:20], np.arange(20.0)) is None


@pytest.mark.parametrize("parts", [1, 2])
def test_the_region_of_a_predicted_point_holds_95_percent_of_draws(parts):
    """Real and imaginary part together: intervals of 95 % of each hold both in 90 % of the draws."""
    rng, root = np.random.default_rng(3), np.array([[1.0, 0.0], [0.7, 0.4]])[:parts, :parts]
    draws = rng.normal(size=(40000, parts)) @ root.T
    squares = np.einsum("bi,ij,bj->b", draws, np.linalg.inv(root @ root.T), draws)
    assert np.mean(squares <= region(parts, 1e6) ** 2) == pytest.approx(0.95, abs=0.004)


TEETH = 10.0 * NOISE * np.exp(0.7j)
"""A pitch error far above the noise."""


def with_constant(values, wheel=True, **of_strand):
    return Comparison(Model(one_mass), Data((replace(strand(values, **of_strand), wheel=wheel),)), THREE)


def test_the_information_is_that_of_a_fit_that_seeks_the_constant_too():
    """Of the parameters (ln k, ln c, ln F, Re w, Im w) the first three: a block of the inverse, by own derivatives."""
    found = estimate(with_constant(EXACT + TEETH))
    whole = bound(np.hstack((slopes_of(), np.tile([1.0, 1j], (SPEEDS.size, 1)))))
    assert np.linalg.inv(found.information) == pytest.approx(whole[:3, :3], rel=0.02, abs=1e-12)
    assert np.all(np.diag(whole)[:3] > np.diag(BOUND))
    assert np.exp(found.inner) == pytest.approx(VALUES, rel=1e-5)
    constant = found.pieces[0].constant
    assert constant.number == pytest.approx(TEETH, rel=1e-3)
    spread = constant.spread + constant.slopes @ np.linalg.inv(found.information) @ constant.slopes.T
    assert spread == pytest.approx(whole[3:, 3:], rel=0.02, abs=0.01 * whole[3, 3])


def test_intervals_hold_the_true_values_beside_a_constant_and_errors_are_those_of_the_noise():
    """Eight draws of noise and of the constant's phase, three parameters each: 95 % of 24 are 23."""
    rng, inside, squares = np.random.default_rng(7), {True: 0, False: 0}, {True: 0.0, False: 0.0}
    for _ in range(8):
        values = noisy(rng, EXACT) + abs(TEETH) * np.exp(1j * rng.uniform(0.0, math.tau))
        for wheel in inside:
            comparison = with_constant(values, wheel)
            found = estimate(comparison)
            squares[wheel] += (found.inner - LOGS) ** 2 / 8.0
            ends = profiles(comparison, found, confidence_of(comparison, found, np.zeros((1, 3))))
            inside[wheel] += sum(low <= u <= high for (low, high), u in zip(ends, LOGS, strict=True))
    assert inside[True] >= 22
    assert np.all(squares[True] < 6.0 * np.diag(BOUND))  # a constant costs information
    assert squares[False].sum() > 4.0 * squares[True].sum()


def test_amplitudes_alone_lose_the_constant_to_first_order():
    """|y + w| ≈ |y| + Re(w exp(−i arg y)): with |w| a two hundredth of the least |y| its square is left."""
    small = 0.005 * float(np.abs(EXACT).min()) * np.exp(0.7j)
    given = {"values": np.abs(EXACT + small).astype(complex), "phases": False, "noise": 0.01 * abs(small)}
    away = [np.abs(estimate(with_constant(wheel=wheel, **given)).inner - LOGS).max() for wheel in (True, False)]
    assert away[0] < 0.3 * away[1]


def test_rows_of_the_report_name_the_constant_and_held_out_speeds_are_predicted_with_it():
    held = np.zeros(SPEEDS.size, dtype=bool)
    held[::4] = True
    values = noisy(np.random.default_rng(5), EXACT) + TEETH
    comparison = with_constant(values, held=held)
    found = estimate(comparison)
    sure = confidence_of(comparison, found, np.zeros((1, 3)))
    (row,) = residual_rows(comparison, found, sure)
    assert not row["systematic"] and row["over_noise"] == pytest.approx(1.0, rel=0.3)
    assert row["constant_deg"] == pytest.approx(math.degrees(abs(TEETH)), abs=row["constant_band_deg"])
    assert row["constant_phase_deg"] == pytest.approx(math.degrees(0.7), abs=20.0)
    rows = held_out(comparison, found, sure)
    assert sum(one["inside"] for one in rows) >= len(rows) - 2


def test_the_table_of_measured_orders_says_which_wheel_measured_them(tmp_path):
    shape = (5, 1)
    found = Orders(np.linspace(100.0, 200.0, 5), np.array([2.0]), np.full(shape, 1e-3 + 0j), np.full(shape, 1e-5),
                   np.ones(shape), np.ones(5, dtype=int), 4, "pulley", "rad")  # fmt: skip
    for wheel, stated in (("60-2", {"pulley.torsion": "60-2"}), ("", {})):
        path = write_orders(tmp_path / "orders.csv", [found], ("pulley.torsion",), wheel=wheel)
        assert read_measured_orders(path).wheels == stated
    path = tmp_path / "own.csv"
    path.write_text("speed_rpm,order,amplitude,unit\n1000,2,0.1,deg\n", "utf-8")
    assert read_measured_orders(path).wheels is None
