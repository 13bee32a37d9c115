"""Constants that the pitch errors of a toothed wheel add to whole orders: eliminated as unknowns of a linear fit."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.properties.test_identify_statistics import (
    NOISE,
    SPEEDS,
    THREE,
    TRUE,
    Model,
    bound,
    noisy,
    one_mass,
    strand,
)

from cranktrain.results.orders.measured import read_measured_orders
from cranktrain.structure.fem.factor import one_thread
from cranktrain_lab.identification.comparison import Comparison
from cranktrain_lab.identification.confidence import confidence_of, profiles
from cranktrain_lab.identification.data import Data
from cranktrain_lab.identification.estimate import estimate
from cranktrain_lab.identification.residuals import held_out, residual_rows
from cranktrain_lab.measured.order_table import write_orders
from cranktrain_lab.measured.tracking import Orders

TEETH = 10.0 * NOISE * np.exp(0.7j)
"""A pitch error far above the noise."""


@pytest.fixture(autouse=True)
def _one_thread():
    with one_thread():
        yield


def compared(values, wheel=True, **of_strand):
    return Comparison(Model(one_mass), Data((replace(strand(values, **of_strand), wheel=wheel),)), THREE)


def test_the_information_is_that_of_a_fit_that_seeks_the_constant_too():
    """Of the parameters (ln k, ln c, ln F, Re w, Im w) the first three: a block of the inverse, by own derivatives."""
    comparison = compared(one_mass(TRUE.values()) + TEETH)
    found = estimate(comparison)
    k, c, force = TRUE.values()
    y = one_mass(TRUE.values())
    slopes = np.stack((-(y**2) / force * k, -(y**2) / force * 1j * SPEEDS * c, y, y**0, 1j * y**0), axis=1)
    whole = np.linalg.inv((slopes.conj().T @ slopes).real / NOISE**2)
    assert np.linalg.inv(found.information) == pytest.approx(whole[:3, :3], rel=0.02, abs=1e-12)
    assert np.all(np.diag(whole)[:3] > np.diag(bound()))
    assert np.exp(found.inner) == pytest.approx(list(TRUE.values()), rel=1e-5)
    constant = found.pieces[0].constant
    assert constant.number == pytest.approx(TEETH, rel=1e-3)
    spread = constant.spread + constant.slopes @ np.linalg.inv(found.information) @ constant.slopes.T
    assert spread == pytest.approx(whole[3:, 3:], rel=0.02, abs=0.01 * whole[3, 3])


def test_any_constant_leaves_the_estimate_where_it_is():
    values = noisy(np.random.default_rng(3), one_mass(TRUE.values()))
    one, other = (estimate(compared(values + w)) for w in (0.0, 30.0 * TEETH))
    spread = np.sqrt(np.diag(np.linalg.inv(one.information)))
    assert np.all(np.abs(one.inner - other.inner) < 0.01 * spread)  # the search ends within this
    assert np.diag(one.information) == pytest.approx(np.diag(other.information), rel=0.03)


def test_intervals_hold_the_true_values_beside_a_constant_and_errors_are_those_of_the_noise():
    """Eight draws of noise and of the constant's phase, three parameters each: 95 % of 24 are 23."""
    rng, inside, squares = np.random.default_rng(7), {True: 0, False: 0}, {True: 0.0, False: 0.0}
    true = np.log(list(TRUE.values()))
    for _ in range(8):
        values = noisy(rng, one_mass(TRUE.values())) + abs(TEETH) * np.exp(1j * rng.uniform(0.0, math.tau))
        for wheel in inside:
            comparison = compared(values, wheel)
            found = estimate(comparison)
            squares[wheel] += (found.inner - true) ** 2 / 8.0
            ends = profiles(comparison, found, confidence_of(comparison, found, np.zeros((1, 3))))
            inside[wheel] += sum(low <= u <= high for (low, high), u in zip(ends, true, strict=True))
    assert inside[True] >= 22
    assert np.all(squares[True] < 6.0 * np.diag(bound()))  # a constant costs information
    assert squares[False].sum() > 4.0 * squares[True].sum()


def test_amplitudes_alone_lose_the_constant_to_first_order():
    """|y + w| ≈ |y| + Re(w exp(−i arg y)): with |w| a two hundredth of the least |y| its square is left."""
    y = one_mass(TRUE.values())
    small = 0.005 * float(np.abs(y).min()) * np.exp(0.7j)
    away = {}
    for wheel in (True, False):
        comparison = compared(np.abs(y + small).astype(complex), wheel, phases=False, noise=0.01 * abs(small))
        away[wheel] = np.abs(estimate(comparison).inner - np.log(list(TRUE.values()))).max()
    assert away[True] < 0.3 * away[False]


def test_rows_of_the_report_name_the_constant_and_held_out_speeds_are_predicted_with_it():
    held = np.zeros(SPEEDS.size, dtype=bool)
    held[::4] = True
    values = noisy(np.random.default_rng(5), one_mass(TRUE.values())) + TEETH
    comparison = compared(values, held=held)
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
