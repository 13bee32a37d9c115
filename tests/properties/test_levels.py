"""Combinations of levels that make no sense are refused in one line that says why, before any long work."""

import math
from contextlib import nullcontext
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from bodies import rigid_crank, six
from one_line import one_line
from refusals import refused_files
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


@pytest.mark.parametrize(("name", "without", "choices", "said"), refused_files()["levels"]["choices"])
def test_refused_with_the_reason(name, without, choices, said):
    engine = replace(load_engine(name), **({without: None} if without else {}))
    with one_line(said):
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
    # A body that bends, taken for a torsional crank, would hang in nothing.
    ({"crank": "torsional"}, {}, r"bends, which one of crank level 'torsional' does not"),
    ({"crank": "rigid"}, {"load_torque": 800.0}, r"a load torque .* boundary 'torque'"),
    ({"crank": "rigid"}, {"damper_balance": True}, r"damper .* 'fitted'"),
    *(({"crank": "rigid", "boundary": "torque"}, {"load_torque": torque}, r"shaft\.load_torque must be finite")
      for torque in (np.nan, np.inf)),
]  # fmt: skip


@pytest.mark.parametrize(("levels", "choices", "says"), IGNORED)
def test_what_a_run_would_ignore_or_lacks_is_refused(levels, choices, says):
    body = six()[1] if levels["crank"] == "torsional" else rigid_crank(SIX)
    with one_line(match=says):
        simulate(SIX, body, Settings(**levels), SPEED, 1, **choices)


@pytest.mark.parametrize("level", [name for name, law in LAWS.items() if "plain" in law.forms])
def test_held_inputs_have_an_integrator_whose_stages_are_all_implicit(level):
    """Inputs that jump between steps are missed by a stage that is the end of the step before."""
    found = resolved(Settings(crank="beam", bearings=level, reconstruction="hold"), SIX)
    assert "explicit" not in INTEGRATORS[found.integrator].title
