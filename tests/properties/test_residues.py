"""Residues of modes in motion, and what they name: the mode that the pulley answers with."""

import math

import numpy as np
import pytest

from cranktrain.dynamics.linear import Equations
from cranktrain.engine.file import load_engine
from cranktrain.structure.crank.level import crank_body
from cranktrain.structure.crank.modal import KINDS
from cranktrain.structure.crank.torsional import torsional_in_motion
from cranktrain.structure.in_motion.eigenproblem import ModesInMotion, vibrations
from cranktrain.structure.in_motion.residues import order_forces, unit_torques
from cranktrain.studies.in_motion.report import listed


def test_residues_add_up_to_the_transfer_function():
    """Of matrices without symmetry, as films in the turning frame have them, against the solved equations."""
    rng = np.random.default_rng(3)
    mass = np.eye(4) + 0.2 * rng.normal(size=(4, 4))
    stiffness = np.diag([1e6, 4e6, 9e6, 2e7]) + 1e5 * rng.normal(size=(4, 4))
    damping = 20.0 * rng.normal(size=(4, 4)) + 60.0 * np.eye(4)
    load, row = rng.normal(size=(4, 2)), rng.normal(size=4)
    values, shapes, taken = vibrations(Equations(mass, damping, stiffness), 1.0, load)
    assert values.size == 4
    residues = (row @ shapes)[:, None] * taken
    for s in (1j * 1500.0, -20.0 + 2.2e3j):
        own = row @ np.linalg.solve(s**2 * mass + s * damping + stiffness, load)
        modal = (residues / (s - values[:, None]) + residues.conj() / (s - values.conj()[:, None])).sum(axis=0)
        assert modal == pytest.approx(own, rel=1e-9)


def modes(torsion, damping_ratios, residues, in_shafts=(0.0, 0.0)):
    """Two modes at 465 and 600 Hz; one gas torque, and orders to 6 of which the sixth excites."""
    omega = 2.0 * math.pi * np.array([465.0, 600.0])
    values = omega * (1j - np.array(damping_ratios))
    shares = np.zeros((2, 4))
    shares[:, KINDS.index("torsional")] = torsion
    shares[:, KINDS.index("bending")] = 1.0 - np.array(torsion)
    by_order = np.zeros((2, 12), dtype=complex)
    by_order[:, 11] = residues
    return ModesInMotion(
        400.0, values, np.zeros((1, 2), dtype=complex), shares, np.array(in_shafts),
        np.array(residues, dtype=complex)[:, None], by_order, 3000.0,
    )  # fmt: skip


def test_the_first_torsional_mode_is_that_of_the_peaks_not_of_the_larger_energy():
    found = modes((0.38, 0.55), (0.033, 0.084), (4.1, 5.1))
    assert found.torsional == 0 and found.torsional_hz == pytest.approx(465.0)
    assert modes((0.38, 0.55), (0.084, 0.033), (4.1, 5.1)).torsional == 1
    # A shaft's mode does not count, however much it turns the pulley.
    assert modes((0.38, 0.55), (0.033, 0.084), (4.1, 5.1), (0.9, 0.0)).torsional == 1


def test_shapes_follow_the_torsion_of_the_pulley_within_the_engine_s_speeds():
    found = modes((0.04, 0.3), (0.03, 0.03), (1.0, 0.5))
    reached, both = (400.0, 500.0), (400.0, 700.0)  # order 6 meets the modes at 487 and 628 rad/s
    assert [mode["shape"] for mode in listed(found, both)] == ["torsional", "torsional"]
    assert [mode["shape"] for mode in listed(found, reached)] == ["torsional", "bending"]
    first, second = listed(found, reached)
    assert first["order"] == 6.0 and second["order"] is None and second["pulley_deg"] == 0.0
    assert math.radians(first["pulley_deg"]) == pytest.approx(1.0 / (0.03 * 2.0 * math.pi * 465.0))
    assert [mode["shape"] for mode in listed(modes((0.9, 0.3), (0.03, 0.03), (1.0, 0.5), (0.9, 0.0)), both)] == [
        "drive line", "torsional",
    ]  # fmt: skip


def test_a_peak_belongs_to_the_mode_that_contributes_most_to_its_order():
    found = modes((0.38, 0.55), (0.033, 0.084), (4.0, 5.0))
    assert found.strongest(6.0, 470.0) == 0 and found.strongest(6.0, 590.0) == 1
    assert found.strongest(12.0, 470.0) == -1  # its forces are not known


def test_amplitudes_of_forces_are_those_of_their_series():
    angle = np.arange(720) * 4.0 * math.pi / 720
    force = 3.0 * np.cos(1.5 * angle + 0.4) + 2.0 * np.sin(6.0 * angle)
    found = order_forces(force[:, None])[0]
    assert found[2] == pytest.approx(3.0 * np.exp(0.4j)) and found[11] == pytest.approx(-2.0j)
    assert np.abs(np.delete(found, [2, 11])).max() < 1e-12


def test_unit_torques_turn_a_rigid_crank():
    engine = load_engine("diesel_i6")
    body = crank_body(engine, "rigid")
    turn = body.shapes[body.index("pulley"), 5]
    assert turn @ unit_torques(engine, body) == pytest.approx(turn @ turn * np.ones(6))


def test_journals_that_films_lock_have_the_frequency_of_the_peaks():
    """A four whose run-up peaks at 464 to 467 Hz with a crank of beams too (the larger energy lies above 600 Hz)."""
    engine = load_engine("tests/data/engines/gas_i4.toml")
    assert torsional_in_motion(engine, crank_body(engine, "beam")) < 500.0
