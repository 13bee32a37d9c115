"""Damping that a torsional crank takes over: how its cranktrain decays, and its resonance beside the level above."""

import math
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.inherited_damping import resonances
from scipy.linalg import eigh

from cranktrain.core.reduced_body import truncate
from cranktrain.dynamics.model.arrays import structural_damping
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import load_engine
from cranktrain.engine.levels import CRANKS
from cranktrain.structure.assembly import assemble
from cranktrain.structure.crank.level import crank_body
from cranktrain.structure.crank.modal import cranktrain_matrices, cranktrain_modes, torsional_frequencies
from cranktrain.structure.in_motion.inherited_damping import equivalent_damping, resonance_speed
from cranktrain.studies.torsion.damped_modes import damped_modes

SIX = load_engine("diesel_i6")
SIX = replace(SIX, reduction=replace(SIX.reduction, torsional_source="ker-wilson"))


def test_the_cranktrain_decays_as_the_level_above_and_a_body_keeps_its_own_damping():
    """They are taken at the resonance of the lowest firing order that lies within the speeds of the oil's table."""
    for hz, order in ((100.0, 3.0), (238.0, 6.0)):
        assert resonance_speed(SIX, hz) * 30.0 / math.pi == pytest.approx(hz * 60.0 / order)
    assert CRANKS["torsional"].inherits == "beam"
    body = crank_body(SIX, "torsional")
    ratios = np.array([0.08, 0.05])
    damping = equivalent_damping(SIX, body, ratios)
    own = structural_damping(SIX, body)
    assert (damping >= own).all() and damping[8:] == pytest.approx(own[8:])
    stiffness, mass = (matrix[5:, 5:] for matrix in cranktrain_matrices(SIX, body))
    modes = damped_modes(stiffness, np.diag(damping[5:]), mass)
    assert modes.damping_ratios[:2] == pytest.approx(ratios, rel=0.05)
    # A body's own damping stays with it.
    damped = replace(body, damping=np.linspace(0.0, 90.0, body.n_modes))
    assert structural_damping(SIX, damped) is damped.damping
    assert truncate(damped, float(damped.frequencies_hz[7]) + 1.0).damping == pytest.approx(damped.damping[:8])
    assert assemble(SIX, Settings(crank="torsional"), inherit=False).body.damping.size == 0


@pytest.mark.parametrize("name", ["diesel_i6", "diesel_v8"])
def test_a_crank_that_bends_names_the_second_torsional_mode_of_one_that_does_not(name):
    """Bending divides the V8's second mode among neighbours; the third one, below 1000 Hz as well, stays whole."""
    engine = load_engine(name)
    engine = replace(engine, reduction=replace(engine.reduction, torsional_source="ker-wilson"))
    beam = torsional_frequencies(*cranktrain_modes(engine, crank_body(engine, "beam")))
    stiffness, mass = (matrix[5:, 5:] for matrix in cranktrain_matrices(engine, crank_body(engine, "torsional")))
    twists = np.sqrt(eigh(stiffness, mass, eigvals_only=True)[1:]) / (2.0 * math.pi)
    # Films' springs and bending raise the V8's first mode by 8.1 %; the nearest twist has the number of the name.
    assert [int(np.argmin(np.abs(np.log(hz / twists)))) for hz in beam] == [0, 1]
    assert beam[1] == pytest.approx(twists[1], rel=0.08)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["diesel_i6", "diesel_v8"])
def test_torsion_at_resonance_is_that_of_the_level_above(name):
    """Each level at its own resonance: films move that of the level above, which locked journals cannot know."""
    found = resonances(name)
    assert all(found[case]["within"] for case in ("beam", "torsional", "without"))
    assert found["torsional"]["deg"] == pytest.approx(found["beam"]["deg"], rel=0.2)
    assert found["without"]["deg"] > 1.5 * found["beam"]["deg"]
