"""Orders that excite torsion: vector sums of the cylinders' torques by their own formula, and which orders count."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from benchmarks._forced_torsion import gas_forces

from cranktrain.cli.main import main
from cranktrain.engine.file import load_engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.crank.critical_speeds import REACH, excitations, exciting_orders
from cranktrain.structure.crank.level import crank_body
from cranktrain.studies.design.layouts import layout
from cranktrain.studies.design.rules import first_design
from cranktrain.studies.design.sizes import HANDBOOK, sizes

DATA = Path(__file__).parents[1] / "data" / "engines"


def twisting(name):
    """An engine and its torsional crank, made by formula."""
    engine = load_engine(name)
    engine = replace(engine, reduction=replace(engine.reduction, torsional_source="ker-wilson"))
    return engine, crank_body(engine, "torsional")


def test_excitation_is_the_vector_sum_of_the_torques_harmonics():
    """T(θ) = p A r (sin θ + λ sin θ cos θ/√(1 − λ² sin² θ)); e_n = |T_n| |Σ φ_c exp(−i n θ_c)|, above inertia."""
    engine, body = twisting("diesel_i6")
    shape = np.zeros(body.n_modes)
    shape[6] = 1.0  # the first elastic mode of the free crank
    orders, found = excitations(engine, body, shape)
    angle = np.arange(720) * 4.0 * math.pi / 720
    gas = gas_forces(engine, engine.best_speed, angle, GasTrace.from_engine(engine), 1.0)[:, 0]
    throw, slope = engine.crankshaft.throws[0], engine.crankshaft.throws[0] / engine.rod.length
    lever = np.sin(angle) * (1.0 + slope * np.cos(angle) / np.sqrt(1.0 - (slope * np.sin(angle)) ** 2))
    harmonics = np.abs(np.fft.rfft(gas * throw * lever)) * 2.0 / 720
    turns = np.array([body.shapes[body.index(f"pin[{pin}]"), 5] @ shape for pin in engine.cylinders.pins])
    phases = np.exp(-1j * np.outer(orders, engine.firing_angles))
    own = harmonics[1 : orders.size + 1] * np.abs(phases @ turns)
    above = (orders >= 4.5) & (orders <= 12.0)
    assert found[above] == pytest.approx(own[above], rel=0.03, abs=0.01 * own[above].max())


def test_a_crank_that_turns_as_a_whole_is_excited_by_multiples_of_its_firings():
    engine, body = twisting("diesel_i6")
    rigid = np.zeros(body.n_modes)
    rigid[5] = 1.0
    orders, found = excitations(engine, body, rigid)
    firing = orders % engine.firings == 0.0
    assert found[~firing].max() < 1e-9 * found.max()
    assert found[firing][:4].min() > 1e-3 * found.max()


@pytest.mark.parametrize(("name", "wanted"), [
    ("diesel_i6", {6.0, 6.5, 7.5, 9.0, 12.0}), (DATA / "gas_i4.toml", {4.0, 6.0, 8.0}),
    ("diesel_v8", {4.0, 8.0, 12.0}),
])  # fmt: skip
def test_the_orders_of_the_peaks_are_listed(name, wanted):
    engine = load_engine(name)
    found = exciting_orders(engine, crank_body(engine, "beam"))
    assert wanted <= {one.order for one in found}
    own = [one for one in found if one.order not in engine.published.critical_orders]
    assert all(engine.speeds[0] <= one.speed <= REACH * engine.speeds[1] for one in own)


def test_the_strongest_orders_of_a_v12_are_no_multiples_of_its_firings():
    engine = first_design("twelve", sizes(layout("v12"), 0.086, 0.080, "petrol", practice=HANDBOOK)).engine
    found = sorted(exciting_orders(engine, crank_body(engine, "beam")), key=lambda one: -one.share)
    assert engine.firings == 6.0
    assert {one.order for one in found[:3]} == {3.5, 4.5, 6.0} and found[3].share < 0.5


def test_a_two_stroke_has_whole_orders_only():
    engine = load_engine("two_stroke_six")
    found = exciting_orders(engine, crank_body(engine, "beam"))
    assert found and all(one.order == round(one.order) for one in found)


def test_campbell_lists_torsional_crossings_first_and_names_the_engine(capsys):
    assert main(["campbell", "diesel_i6", "--crank", "beam"]) == 0
    before, torsional, _ = re.split("orders meet (?:torsional|other) modes", capsys.readouterr().out)
    assert before.endswith("diesel_i6: ") and "bending" not in torsional
    assert all(f" {order} " in torsional for order in ("6", "6.5", "7.5", "9", "12"))
