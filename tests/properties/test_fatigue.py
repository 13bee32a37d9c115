"""Fatigue: rainflow by its standard's example, Haigh's diagram, notch and surface, criteria in their limits."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.engine.limits import CrankStrength
from cranktrain.results.strength.assessment import judged, nominal_histories, rule_rows
from cranktrain.results.strength.critical_plane import findley_constants, findley_judgement, least_circle
from cranktrain.results.strength.fatigue import (
    FilletHistory,
    counted_cycles,
    governing_history,
    haigh_judgement,
    mean_stress_factor,
    mean_stress_sensitivity,
    roughness_factor,
    support_factor,
    surface_strength,
)
from cranktrain.results.strength.figures import PICTURES, limit_line, place_of, save_pictures
from cranktrain.results.strength.iacs_m53 import throw_shape
from cranktrain.results.strength.throw_loads import PinLoads, WebLoads

STEEL = CrankStrength(tensile_strength=900e6, forming="grain-flow", roughness=4e-6)
TURN = np.linspace(0.0, 2.0 * math.pi, 180, endpoint=False)
WAVE = np.sin(TURN)
SIX = load_engine("diesel_i6")
THROWS = [throw_shape(SIX.crankshaft, pin) for pin in range(1, 7)]


def history(xx=0.0, xy=0.0, gradient=500.0):
    tensor = np.zeros((TURN.size, 6))
    tensor[:, 0], tensor[:, 3] = xx, xy
    return FilletHistory("web[1].pin", TURN, tensor, gradient)


def loads(web, pin, main=900.0):
    """Loads of a web in phase, with torques of its pin and main, N m."""
    return WebLoads(web, (web + 1) // 2, 800.0 * WAVE, 2e4 * WAVE, pin * WAVE, main * WAVE)


def test_rainflow_of_the_standard_s_repeating_history():
    """ASTM E1049, simplified rainflow for repeating histories: ranges 3, 4, 7 and 9, one cycle each."""
    found = counted_cycles([-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0])
    assert [(2.0 * cycle.amplitude, cycle.mean) for cycle in found] == [(9.0, 0.5), (7.0, 0.5), (4.0, 1.0), (3.0, -0.5)]
    # Wherever the cycle begins.
    values = np.random.default_rng(3).standard_normal(200)
    found = counted_cycles(values)
    for shift in (1, 50, 133):
        assert counted_cycles(np.roll(values, shift)) == found
    assert 2.0 * found[0].amplitude == pytest.approx(np.ptp(values))


def test_what_is_no_history_or_steel_is_refused_and_rest_has_no_cycle():
    for wrong in ([1.0], [1.0, math.nan], [[1.0, 2.0]]):
        with pytest.raises(InputError, match="two finite values"):
            counted_cycles(wrong)
    with pytest.raises(InputError, match=r"0\.5 to 1 times"):
        findley_constants(300.0, 140.0)
    assert findley_constants(300.0, 150.0) == (0.0, 150.0)
    assert counted_cycles(np.full(5, 3.0)) == []
    assert haigh_judgement(history(np.full(TURN.size, 2e8)), STEEL).safety_factor == math.inf


@pytest.mark.parametrize("sensitivity", [0.0, 0.1, 0.215, 0.5])
def test_haigh_line_is_continuous_and_falls(sensitivity):
    ratios = np.linspace(-3.0, 5.0, 1601)
    factors = np.array([mean_stress_factor(ratio, sensitivity) for ratio in ratios])
    assert mean_stress_factor(0.0, sensitivity) == 1.0 and np.all(np.diff(factors) <= 1e-12)
    assert np.abs(np.diff(factors)).max() <= 0.01 * (1.0 + 4.0 * sensitivity)
    # Pulsating: the strength at R = 0 defines M = σ_A(−1)/σ_A(0) − 1.
    assert 1.0 / mean_stress_factor(1.0, sensitivity) - 1.0 == pytest.approx(sensitivity)


def test_support_and_roughness_in_their_limits():
    assert support_factor(STEEL, 0.0) == 1.0
    for border in (100.0, 1000.0):
        assert support_factor(STEEL, border * (1 + 1e-9)) == pytest.approx(support_factor(STEEL, border * (1 - 1e-9)))
    hard = replace(STEEL, tensile_strength=1200e6)
    assert 1.0 < support_factor(hard, 500.0) < support_factor(STEEL, 500.0)
    assert roughness_factor(replace(STEEL, roughness=1e-6)) == 1.0
    assert roughness_factor(hard) < roughness_factor(STEEL) < 1.0
    assert surface_strength(replace(STEEL, fillet_treatment=1.5), 500.0) == 1.5 * surface_strength(STEEL, 500.0)


def test_tension_and_torsion_in_the_diagram():
    wave = 1e8 * np.sin(TURN)
    strength = surface_strength(STEEL, 500.0)
    # 180 samples miss the crest of a wave by up to 1.5e-4.
    for one, stress in ((history(wave), 1e8), (history(0.0, wave), math.sqrt(3.0) * 1e8), (history(wave, wave), 2e8)):
        assert haigh_judgement(one, STEEL).safety_factor == pytest.approx(strength / stress, rel=2e-4)


def test_mean_stress_lowers_and_pressure_raises_safety():
    m, wave = mean_stress_sensitivity(STEEL), 1e8 * np.sin(TURN)
    plain, pulled, pressed = (haigh_judgement(history(wave + shift), STEEL) for shift in (0.0, 1e8, -1e8))
    assert pulled.safety_factor == pytest.approx(plain.safety_factor / (1.0 + m), rel=1e-3)
    assert pressed.safety_factor == pytest.approx(plain.safety_factor / (1.0 - m), rel=1e-3)
    # Static torsion has no sense of its own.
    twisted = [haigh_judgement(history(0.0, wave + shift), STEEL).safety_factor for shift in (1e8, -1e8)]
    assert twisted[0] == pytest.approx(twisted[1])
    assert twisted[0] < haigh_judgement(history(0.0, wave), STEEL).safety_factor


@pytest.mark.parametrize("judge", [haigh_judgement, findley_judgement])
def test_safety_scales_and_does_not_ask_for_axes(judge):
    one = history(8e7 * np.sin(TURN) + 3e7, 5e7 * np.sin(TURN + 0.4))
    plain = judge(one, STEEL).safety_factor
    assert judge(replace(one, tensor=2.0 * one.tensor), STEEL).safety_factor == pytest.approx(0.5 * plain)
    turn = Rotation.from_euler("xyz", (0.3, 1.1, -0.7)).as_matrix()
    xx, yy, zz, xy, yz, zx = one.tensor.T
    full = np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]).transpose(2, 0, 1)
    full = turn @ full @ turn.T
    tensor = np.stack([full[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))], axis=1)
    # Findley's planes are 5 degrees apart.
    assert judge(replace(one, tensor=tensor), STEEL).safety_factor == pytest.approx(plain, rel=5e-3)


def test_governing_history_is_the_stress_of_a_bar_and_least_circles_are_those_of_known_paths():
    values = 1e8 * np.random.default_rng(5).standard_normal(TURN.size)
    assert governing_history(history(values).tensor) == pytest.approx(values)
    assert np.ptp(governing_history(history(0.0, values).tensor)) == pytest.approx(math.sqrt(3.0) * np.ptp(values))

    ellipse = np.stack([3.0 * np.cos(TURN), 1.0 * np.sin(TURN)], axis=1) + 7.0
    assert least_circle(ellipse) == pytest.approx(3.0, rel=1e-9)
    corners = np.array([[0.0, 0.0], [4.0, 0.0], [2.0, 2.0 * math.sqrt(3.0)]])
    assert least_circle(corners) == pytest.approx(4.0 / math.sqrt(3.0), rel=5e-3)


def test_rim_of_an_oil_bore_meets_the_rule():
    """In phase, the largest amplitude round the rim is the rule's equivalent stress: both are Kirsch's hole."""
    pins = [PinLoads(1, 1500.0 * WAVE, 0.0 * WAVE, 900.0 * WAVE)]
    (row,) = rule_rows(THROWS, STEEL, [], pins)
    rim = [np.abs(one.tensor[:, 0]).max() for one in nominal_histories(THROWS, TURN, [], pins)]
    # 36 places over half the rim miss the worst by 2.5 degrees at most: 0.4 %.
    assert max(rim) == pytest.approx(row.equivalent, rel=5e-3)


def test_fillets_of_a_web_are_the_rule_s_sums():
    web = loads(1, 1000.0, 1200.0)
    pin, main = rule_rows(THROWS, STEEL, [web], [])
    histories = nominal_histories(THROWS, TURN, [web], [])
    for row, one in zip((pin, main), histories, strict=True):
        assert row.name == one.name and 0.5 * np.ptp(one.tensor[:, 0]) == pytest.approx(row.bending)
        assert 0.5 * np.ptp(one.tensor[:, 3]) == pytest.approx(row.shear)
    # Pressed together, a throw pulls at the pin's fillet and presses on the journal's.
    crest = int(WAVE.argmax())
    assert histories[0].tensor[crest, 0] > 0.0 > histories[1].tensor[crest, 0]


def test_each_throw_has_the_factors_of_its_own_radius():
    c, throws, webs = SIX.crankshaft, (0.06, 0.055, 0.06, 0.06, 0.055, 0.06), [loads(1, 900.0), loads(3, 900.0)]
    unequal, shorter = replace(c, pin_throws=throws), replace(c, throw=0.055)
    rows = rule_rows([throw_shape(unequal, pin) for pin in range(1, 7)], STEEL, webs, [])
    assert rows[:2] == rule_rows(THROWS, STEEL, webs[:1], [])
    assert rows[2:] == rule_rows([throw_shape(shorter, pin) for pin in range(1, 7)], STEEL, webs[1:], [])
    assert rows[0].bending != rows[2].bending


def test_pictures_and_their_places(tmp_path):
    webs = [loads(k, 900.0) for k in range(1, 13)]
    pins = [PinLoads(k, 1500.0 * WAVE, 0.0 * WAVE, 900.0 * WAVE) for k in range(1, 7)]
    places = judged(nominal_histories(THROWS, TURN, webs, pins), STEEL, haigh_judgement)
    assert [path.name for path in save_pictures(tmp_path, SIX, STEEL, places, "test")] == list(PICTURES)
    assert all((tmp_path / name).stat().st_size > 10_000 for name in PICTURES)
    assert len(save_pictures(tmp_path, SIX, STEEL, places, "test", haigh=False)) == 1
    assert len({place_of(SIX.crankshaft, one.name) for one in places}) == len(places) == 30
    # The limit goes through the endurable amplitude of the place that it is drawn for.
    one = places[0]
    mean, amplitude = limit_line(one, mean_stress_sensitivity(STEEL))
    along = one.safety_factor * one.mean
    assert np.interp(along, mean, amplitude) == pytest.approx(one.endured, rel=1e-3)
