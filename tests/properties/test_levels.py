"""Combinations of levels that make no sense are refused in one line that says why, before any long work."""

import math
from contextlib import nullcontext
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from bodies import rigid_crank, six
from one_line import one_line
from some import some

from cranktrain.core.errors import InputError
from cranktrain.dynamics.model.settings import BOUNDARIES, Settings, check_levels, resolved
from cranktrain.dynamics.simulation import simulate
from cranktrain.dynamics.time.integrators import INTEGRATORS
from cranktrain.engine.file import load_engine
from cranktrain.engine.levels import BLOCKS, DAMPERS, PISTONS
from cranktrain.film.laws.register import BIG_END, LAWS, MAINS, bearing_levels

SIX, EIGHT = load_engine("diesel_i6"), load_engine("diesel_v8")
SPEED = 2000 * math.pi / 30

REFUSED = [
    (SIX, {"crank": "torsion"}, r"crank level 'torsion' does not exist; did you mean 'torsional'\?"),
    (SIX, {"control": "adaptiv"}, r"step control 'adaptiv' .* did you mean 'adaptive'\?"),
    (SIX, {"control": "adaptive", "integrator": "bdf2"}, r"'bdf2' has no error estimate, .* use one of .*sdirk4"),
    (SIX, {"control": "adaptive", "tolerance": 0.0}, r"tolerance of adaptive control must be 1e-10 to 1, got 0"),
    (SIX, {"bearings": "held"}, r"locks the axis of a crank that cannot bend, not of crank level 'solid'"),
    (SIX, {"crank": "rigid", "bearings": "held", "block": "flexible"}, r"does not meet a flexible block"),
    (SIX, {"crank": "rigid", "bearings": "held", "big_ends": "impedance"}, r"run in no film"),
    (SIX, {"bearings": "roler"}, r"bearing level 'roler' does not exist; did you mean 'roller'\?"),
    (SIX, {"big_ends": "tabel"}, r"big-end level 'tabel' .* did you mean 'table'\?"),
    (SIX, {"block": "flexibel"}, r"block level 'flexibel' .* did you mean 'flexible'\?"),
    (SIX, {"pistons": "guide"}, r"piston level 'guide' .* did you mean 'guided'\?"),
    (SIX, {"damper": "fited"}, r"damper level 'fited' .* did you mean 'fitted'\?"),
    (SIX, {"boundary": "torqe"}, r"boundary 'torqe' .* did you mean 'torque'\?"),
    (SIX, {"gas_source": "external"}, r"gas source 'external' does not exist"),
    (SIX, {"reconstruction": "cubic"}, r"input reconstruction 'cubic' does not exist"),
    (SIX, {"block": "flexible", "pistons": "rigid"}, r"rigid pistons .* cannot follow a flexible block"),
    (SIX, {"bearings": "roller"}, r"needs \[main_roller\]"),
    *((EIGHT, {"bearings": film}, r"needs oil films, but the mains .* are rollers") for film in
      ("impedance", "table", "reynolds", "ehd", "ehd:fine")),
    (replace(SIX, big_end_bearing=None), {"big_ends": "impedance"}, r"no \[big_end_bearing\]"),
    (replace(SIX, piston_guidance=None), {"pistons": "guided"}, r"no \[piston_guidance\]"),
    (replace(SIX, piston_guidance=None), {"block": "flexible"}, r"no \[piston_guidance\]"),
    (replace(SIX, block=None), {"block": "flexible"}, r"no \[block\]"),
    (replace(SIX, mounts=None), {"block": "flexible"}, r"no \[mounts\]"),
    (replace(SIX, damper=None), {"damper": "fitted"}, r"no \[damper\]"),
]  # fmt: skip


@pytest.mark.parametrize(("engine", "choices", "says"), REFUSED)
def test_refused_with_the_reason(engine, choices, says):
    with one_line(match=says):
        check_levels(resolved(Settings(**choices), engine), engine)


@pytest.mark.parametrize(
    ("engine", "choices", "block", "pistons"),
    [
        (SIX, {}, "ground", "rigid"),
        (EIGHT, {}, "flexible", "guided"),
        (EIGHT, {"crank": "beam", "pistons": "guided"}, "flexible", "guided"),
        (EIGHT, {"bearings": "linear"}, "ground", "rigid"),
        (EIGHT, {"crank": "rigid"}, "ground", "rigid"),
        (EIGHT, {"crank": "torsional"}, "ground", "rigid"),
        (EIGHT, {"pistons": "rigid"}, "ground", "rigid"),
        (EIGHT, {"block": "ground"}, "ground", "rigid"),
        (replace(EIGHT, block=None), {}, "ground", "rigid"),
        (replace(EIGHT, mounts=None), {}, "ground", "rigid"),
        (replace(EIGHT, piston_guidance=None), {}, "ground", "rigid"),
    ],
)
def test_rollers_run_in_a_flexible_block_where_nothing_else_is_chosen(engine, choices, block, pistons):
    """And no choice that makes sense on ground is refused for a block that nobody chose."""
    found = resolved(Settings(**choices), engine)
    check_levels(found, engine)
    assert (found.block, found.pistons) == (block, pistons)


def test_every_other_combination_of_the_six_is_taken():
    mains = set(bearing_levels(*MAINS)) - {"held"}
    names = ("crank", "bearings", "big_ends", "block", "pistons", "damper", "boundary")
    levels = ("rigid", "solid"), mains, bearing_levels(BIG_END), BLOCKS, ("auto", *PISTONS), DAMPERS, BOUNDARIES
    for combination in some(product(*levels)):
        chosen = resolved(Settings(**dict(zip(names, combination, strict=True))), SIX)
        senseless = chosen.bearings == "roller" or (chosen.block == "flexible" and chosen.pistons == "rigid")
        with pytest.raises(InputError) if senseless else nullcontext():
            check_levels(chosen, SIX)


IGNORED = [
    ({"crank": "rigid", "block": "flexible"}, {}, r"needs the reduced block"),
    ({"crank": "rigid"}, {"load_torque": 800.0}, r"a load torque .* boundary 'torque'"),
    ({"crank": "rigid"}, {"damper_balance": True}, r"damper .* 'fitted'"),
    *(({"crank": "rigid", "boundary": "torque"}, {"load_torque": torque}, r"shaft\.load_torque must be finite")
      for torque in (np.nan, np.inf)),
]  # fmt: skip


@pytest.mark.parametrize(("levels", "choices", "says"), IGNORED)
def test_what_a_run_would_ignore_or_lacks_is_refused(levels, choices, says):
    with pytest.raises(InputError, match=says):
        simulate(SIX, rigid_crank(SIX), Settings(**levels), SPEED, 1, **choices)


def test_a_body_that_bends_is_no_torsional_crank():
    """Taken for a torsional crank it would hang in nothing."""
    with pytest.raises(InputError, match=r"bends, which one of crank level 'torsional' does not"):
        simulate(*six(), Settings(crank="torsional"), SPEED, 1)


@pytest.mark.parametrize("level", [name for name, law in LAWS.items() if "plain" in law.forms])
def test_held_inputs_have_an_integrator_whose_stages_are_all_implicit(level):
    """Inputs that jump between steps are missed by a stage that is the end of the step before."""
    found = resolved(Settings(crank="beam", bearings=level, reconstruction="hold"), SIX)
    assert "explicit" not in INTEGRATORS[found.integrator].title
