"""Engines of the library: firing and balance by closed form."""

import math
import warnings

import numpy as np
import pytest
from docs.engine_library import ROWS, text_of
from started import at_speed, shown

from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import engine_folder, load_engine
from cranktrain.engine.firing import firing_summary
from cranktrain.results.free_forces import free_forces
from cranktrain.structure.assembly import running_crank
from cranktrain.structure.crank.sections import crank_pieces, piece_moments

INTERVALS = {
    "single_petrol": [720.0], "v_twin": [450.0, 270.0], "three_petrol": [240.0] * 3, "four_petrol": [180.0] * 4,
    "five_petrol": [144.0] * 5, "v6_split": [120.0] * 6, "v8_cross": [90.0] * 8, "v12_petrol": [60.0] * 12,
    "generator_four": [180.0] * 4, "two_stroke_six": [60.0] * 6, "diesel_i6": [120.0] * 6, "diesel_v8": [90.0] * 8,
}  # fmt: skip
SPEED = 50.0


def test_every_engine_is_listed_here():
    assert set(INTERVALS) == {*ROWS, "two_stroke_six", "diesel_i6", "diesel_v8"}


@pytest.mark.parametrize("name", ROWS)
def test_files_are_those_that_the_rows_make(name):
    assert (engine_folder() / f"{name}.toml").read_text(encoding="utf-8") == text_of(ROWS[name])


@pytest.mark.parametrize("name", INTERVALS)
def test_firing_is_that_of_the_layout(name):
    """Cylinders fire in their order from crank angle 0 of the first on."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        engine = load_engine(name)
    assert firing_summary(engine)["intervals_deg"] == pytest.approx(INTERVALS[name], abs=1e-6)
    angles = np.degrees([engine.firing_angles[c - 1] for c in engine.cylinders.firing_order])
    assert angles == pytest.approx(np.cumsum([0.0, *INTERVALS[name][:-1]]), abs=1e-6)


def free_orders(engine):
    """Closed form: amplitudes (2 orders, force and moment, x and y) of what oscillates and turns, N and N m.

    Pistons by the series of the slider-crank, cos θ + (λ + λ³/4 + 15 λ⁵/128) cos 2θ; big ends, pins and counterweights
    as masses that turn.
    """
    rod, throws = engine.rod, np.array(engine.throws)
    ratio = throws / rod.length
    second = ratio + ratio**3 / 4.0 + 15.0 * ratio**5 / 128.0
    oscillating = rod.small_end_mass + engine.cylinders.piston_mass
    banks, firing = np.array(engine.cylinders.bank_angles), np.array(engine.firing_angles)
    along = np.stack((-np.sin(banks), np.cos(banks)), axis=1)
    z = np.array(engine.cylinder_positions)
    moments = np.sum([piece_moments(piece) for piece in crank_pieces(engine)], axis=0)
    pins = [engine.crankshaft.throw_angles[pin - 1] for pin in engine.cylinders.pins]
    turning = throws * rod.big_end_mass * np.exp(1j * np.array(pins)) * 1j
    found = np.zeros((2, 2, 2), dtype=complex)
    for place, weight in enumerate((np.ones(z.size), z)):
        mass = oscillating * throws * SPEED**2 * weight
        found[0, place] = -(mass * np.exp(-1j * firing)) @ along
        found[1, place] = -(mass * second * np.exp(-2j * firing)) @ along
        own = moments[0, 1:3] if place == 0 else moments[3, 1:3]
        # A mass at (x, y) that turns by θ presses inwards with −m ω² (x + iy) e^{iθ}.
        whole = -(SPEED**2) * (complex(own[0], own[1]) + (turning * weight).sum())
        found[0, place] += np.array([whole, -1j * whole])
    return found


@pytest.mark.parametrize("name", [name for name in INTERVALS if name != "diesel_v8"])  # it has balance weights
def test_the_free_forces_that_a_run_tells_are_those_of_the_closed_form(name):
    """Orders 1 and 2 by component, N and N m; moments about the middle of the mains."""
    engine = load_engine(name).without_additions
    told = free_forces(engine, SPEED)
    wanted = -free_orders(engine)
    wanted[:, 1] -= told["about_z_m"] * wanted[:, 0]
    one = (engine.rod.small_end_mass + engine.cylinders.piston_mass) * max(engine.throws) * SPEED**2
    length = engine.crankshaft.main_positions[-1]
    rows = {row["order"]: row for row in told["orders"]}
    none = dict.fromkeys(("force_x_n", "force_y_n", "moment_x_nm", "moment_y_nm", "force_n"), 0.0)
    for order in (1, 2):
        row, (force, moment) = rows.get(order, none), np.abs(wanted[order - 1])
        np.testing.assert_allclose([row["force_x_n"], row["force_y_n"]], force, atol=1e-3 * one)
        np.testing.assert_allclose([row["moment_y_nm"], row["moment_x_nm"]], moment, atol=1e-3 * one * length)
        turn = np.exp(1j * np.linspace(0.0, 2.0 * math.pi, 3601))
        path = np.linalg.norm(np.outer(turn, wanted[order - 1, 0]).real, axis=1)
        assert row["force_n"] == pytest.approx(path.max(), abs=1e-3 * one)
    assert told["left_out"] == []


def test_free_forces_of_the_usual_layouts_are_those_of_the_textbooks():
    """Four in line: order 2 of all pistons adds up; six in line and twelve: balanced to order 5; all grow with Ω²."""
    four = load_engine("generator_four")
    ratio = four.throws[0] / four.rod.length
    second = ratio + ratio**3 / 4.0 + 15.0 * ratio**5 / 128.0 + 35.0 * ratio**7 / 512.0
    of_one = (four.rod.small_end_mass + four.cylinders.piston_mass) * four.throws[0]
    for speed in (SPEED, 2.0 * SPEED):
        [order2] = [row for row in free_forces(four, speed)["orders"] if row["order"] == 2]
        assert order2["force_n"] == pytest.approx(4.0 * of_one * speed**2 * second, rel=1e-4)
        assert order2["force_x_n"] == 0.0 and order2["moment_nm"] < 1e-9 * order2["force_n"]
    for name in ("diesel_i6", "v12_petrol"):
        assert min(row["order"] for row in free_forces(load_engine(name), SPEED)["orders"]) == 6


def test_balancer_shafts_take_the_second_order_of_a_four_off():
    """By the second order that their note gives: four cylinders less two shafts of m e (2 Ω)²; both turn oppositely."""
    engine = load_engine("four_petrol")
    with_shafts, alone = (
        {row["order"]: row["force_n"] for row in free_forces(one, SPEED)["orders"]}
        for one in (engine, engine.without_additions)
    )
    arm = math.dist(engine.body[0].centre[:2], engine.frame[0].axis)
    shafts = 2.0 * engine.body[0].mass * arm * (2.0 * SPEED) ** 2
    assert with_shafts[2] == pytest.approx(alone[2] - shafts, rel=1e-6)
    assert with_shafts[2] < 0.03 * alone[2] and with_shafts[4] == pytest.approx(alone[4])


def test_big_ends_of_a_large_engine_start_in_their_films():
    """Gas turns a large crank far while its start is sought: its big ends then stood forty clearances off."""
    engine = load_engine("two_stroke_six")
    settings = Settings(crank="rigid", block="ground", bearings="linear", pistons="rigid", big_ends="impedance")
    simulation = at_speed(10.0, engine, running_crank(engine, "rigid"), settings)
    named = shown(simulation)
    assert max(named[f"big_end[{k}].eccentricity"] for k in range(1, 7)) < 1.0
    simulation.step(1e-3)
