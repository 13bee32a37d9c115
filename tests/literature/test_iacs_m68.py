"""IACS UR M68 (Rev. 2, 2015) by hand: permissible stress of an intermediate and of a propeller shaft, barred range.

Intermediate shaft, d = 360 mm, σ_B = 600 N/mm²: c_D = 0.35 + 0.93 · 360^−0.2 = 0.6366, (600 + 160)/18 = 42.22. At
λ = 0.4: τ_C = 42.22 · 1.0 · 0.6366 · (3 − 0.32) = 72.0, τ_T = 1.7 τ_C = 122.4 N/mm². At λ = 1: τ_C = 42.22 · 0.6366 ·
1.38 = 37.1. Propeller shaft, d = 430 mm, σ_B = 700 counts as 600: c_D = 0.6265, τ_C(0.4) = 42.22 · 0.55 · 0.6265 · 2.68
= 39.0, τ_T = 1.7 · 39.0/√0.55 = 89.4.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from one_line import one_line

from cranktrain.engine.file import load_engine
from cranktrain.engine.torsional_chain import Shaft
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.results.strength.iacs_m68 import permissible_stress, section_modulus, shaft_stresses, stress_table

STRAIGHT = Shaft(("a", "b"), 1e7, diameter=0.36, strength=6e8)
PROPELLER = Shaft(("a", "b"), 1e7, diameter=0.43, strength=7e8, section="propeller")
SHIP = load_engine("two_stroke_six")


def test_limits_by_hand():
    """By hand, see above; a bore weakens the section."""
    continuous, transient = permissible_stress(STRAIGHT, np.array([0.4, 1.0, 1.1]))
    assert 1e-6 * continuous[:2] == pytest.approx([72.0, 37.1], abs=0.05)
    assert 1e-6 * transient[0] == pytest.approx(122.4, abs=0.1)
    assert np.isnan(continuous[2])
    assert np.isnan(transient[1:]).all()
    continuous, transient = permissible_stress(PROPELLER, np.array([0.4]))
    assert 1e-6 * continuous[0] == pytest.approx(39.0, abs=0.05)
    assert 1e-6 * transient[0] == pytest.approx(89.4, abs=0.1)
    bored = replace(STRAIGHT, bore=0.18)
    assert section_modulus(STRAIGHT) == pytest.approx(math.pi * 0.36**3 / 16.0)
    assert section_modulus(bored) == pytest.approx(section_modulus(STRAIGHT) * (1.0 - 0.5**4))


def run_up(torques):
    """Speeds of 42 and 105 rev/min at which each shaft's torque swings by plus and minus these, N m."""
    speeds = np.array([42.0, 105.0]) * math.pi / 30.0
    line = SHIP.drive_line_chain
    names = [f"shaft[{one} to {two}].torque" for one, two in zip(line.starts, line.ends, strict=True)]
    swings = np.array(torques)
    extremes = np.stack((4e5 - swings, np.full(2, 4e5), 4e5 + swings), axis=1)
    return RunUp(
        speeds, np.array([6.0]), dict.fromkeys(names, np.zeros((2, 1), dtype=complex)), dict.fromkeys(names, extremes),
        np.zeros(2, dtype=int), np.ones(2, dtype=int), np.zeros(2),
    )  # fmt: skip


def test_the_barred_range_of_the_rule():
    """λ_c = 0.4: from 16/17.6 to 17.6/16 of 42 rev/min, 38.2 to 46.2."""
    modulus = section_modulus(SHIP.drive_line_chain.chain.shafts[1])
    thrust, straight, propeller = shaft_stresses(SHIP, run_up([1e8 * modulus, 1e6 * modulus]))
    assert straight["stress_mpa"] == pytest.approx([100.0, 1.0])
    assert straight["barred_rpm"] == pytest.approx([42.0 * 16.0 / 17.6, 42.0 * 17.6 / 16.0])
    assert straight["verdict"] == "barred range"
    assert thrust["verdict"] == "within the limit"
    assert propeller["verdict"] == "barred range"
    assert [row[-2] for row in stress_table([thrust, straight]).rows] == ["–", "38.2 to 46.2"]
    over = shaft_stresses(SHIP, run_up([1.5e8 * modulus, 1e6 * modulus]))[1]
    assert over["verdict"] == "over the transient limit"
    rated = shaft_stresses(SHIP, run_up([1e6 * modulus, 6e7 * modulus]))[1]
    assert rated["verdict"].startswith("over the limit above 0.8 of the rated speed")


def test_what_the_rule_needs_is_asked_for():
    weak = replace(SHIP, drive_line_chain=replace(SHIP.drive_line_chain, strengths=()))
    for engine, said in (
        (replace(SHIP, load=None), "has no [load], whose speed is the rated one"),
        (weak, "shaft 1 (flywheel to thrust) has a diameter and no strength"),
    ):
        with one_line(said):
            shaft_stresses(engine, run_up([1.0, 1.0]))
