"""Modes with a damper: two masses in closed form, and the limits of the ring let go and held."""

import math
from dataclasses import replace

import numpy as np
import pytest
from bodies import COARSE, free_six

from cranktrain.structure.crank.modal import cranktrain_modes
from cranktrain.structure.crank.reduction import complete_crankshaft, reduced_crankshaft
from cranktrain.studies.torsion.damped_modes import damped_modes, damper_report, with_ring
from cranktrain.studies.torsion.damper_optimum import crank_optimum, houdaille_optimum


@pytest.fixture(scope="module")
def six():
    engine = free_six()
    engine = replace(engine, crankshaft=replace(engine.crankshaft, mesh_size=COARSE))
    return engine, reduced_crankshaft(engine)


def newtonian(engine, viscosity=None, **changes):
    """The engine with a Newtonian damper."""
    damper = replace(engine.damper, law="newtonian", **changes)
    return replace(engine, damper=replace(damper, viscosity=viscosity or damper.viscosity))


@pytest.mark.parametrize("damping", [0.05, 0.4, 2.0])
def test_two_masses_satisfy_their_characteristic_equation(damping):
    """Hub on a spring, ring by a damper: λ (J λ + c)(I λ² + K) + c J λ³ = 0 with I = K = 1, after the zero root."""
    ring = 0.6
    modes = damped_modes(*with_ring(np.eye(1), np.eye(1), np.ones(1), ring, 0.0, damping))
    roots = np.roots([ring, damping * (1.0 + ring), ring, damping])
    # Frequencies of order one lie below 1 Hz and are left out: the same system, a thousand times as fast.
    assert modes.values.size == 0
    fast = damped_modes(*with_ring(1e6 * np.eye(1), np.eye(1), np.ones(1), ring, 0.0, 1e3 * damping))
    swinging = roots[roots.imag > 0.0]
    assert fast.values == pytest.approx(1e3 * swinging, rel=1e-9)
    assert fast.damping_ratios == pytest.approx(-swinging.real / np.abs(swinging), rel=1e-9)


def test_ring_let_go_and_ring_held(six):
    engine, body = six
    free = newtonian(engine, 1e-6)
    held = newtonian(engine, 1e9)
    for other, limit in ((free, "ring_free_hz"), (held, "ring_locked_hz")):
        first = damper_report(other, body)["first_torsional"]
        assert first["hz"] == pytest.approx(first[limit], rel=1e-6)
        assert 0.0 < first["damping_ratio"] < 1e-5
    between = damper_report(newtonian(engine), body)["first_torsional"]
    assert between["ring_locked_hz"] < between["hz"] < between["ring_free_hz"]
    assert between["damping_ratio"] > 0.05


def test_the_limits_are_those_of_the_plain_cranktrain(six):
    """Ring let go: pulley and housing. Ring held: its polar inertia with them."""
    engine, body = six
    d, pulley = engine.damper, engine.pulley
    first = damper_report(engine, body)["first_torsional"]
    for extra, limit in ((0.0, "ring_free_hz"), (d.ring_inertia, "ring_locked_hz")):
        diametral = pulley.diametral_inertia + 0.5 * (d.housing_inertia + d.ring_inertia)
        polar = pulley.polar_inertia + d.housing_inertia + extra
        part = replace(pulley, mass=pulley.mass + d.mass, polar_inertia=polar, diametral_inertia=diametral)
        other = replace(engine, pulley=part, damper=None)
        hz, *_ = cranktrain_modes(other, complete_crankshaft(other, body))
        assert np.abs(hz / first[limit] - 1.0).min() < 1e-9


def test_a_spring_stiffens_where_a_fluid_only_damps(six):
    engine, body = six
    stiff = damper_report(replace(engine, damper=replace(engine.damper, law="complex-modulus")), body)
    assert stiff["stiffness_nm_per_rad"] > 0.0
    assert stiff["linearised_at_hz"] == pytest.approx(stiff["first_torsional"]["hz"])
    assert stiff["first_torsional"]["hz"] > stiff["first_torsional"]["ring_free_hz"]
    assert all(mode["damping_ratio"] > 0.0 for mode in stiff["modes"])
    assert [mode["hz"] for mode in stiff["modes"]] == sorted(mode["hz"] for mode in stiff["modes"])


def test_the_first_mode_of_the_six_takes_nearly_houdailles_damping(six):
    """In stiff bearings and an open collar no other mode shares its peak; their flexibility counts a few per cent."""
    engine, body = six
    springs = dict.fromkeys(("stiffness_x", "stiffness_y"), 1e9)
    stiff = dict.fromkeys(("block_stiffness_x", "block_stiffness_y"), 1e12)
    open_collar = replace(engine.thrust, closed_stiffness=1e3)
    engine = replace(engine, main_bearing=replace(engine.main_bearing, **springs, **stiff), thrust=open_collar)
    found = crank_optimum(engine, body)
    two = houdaille_optimum(found.inertia_ratio)
    assert found.optimum.damping_ratio == pytest.approx(two.damping_ratio, rel=0.05)
    assert 0.85 * two.amplification < found.optimum.amplification < two.amplification
    assert found.damping == pytest.approx(found.optimum.damping_ratio * 4.0 * math.pi * found.hz * found.inertia)
