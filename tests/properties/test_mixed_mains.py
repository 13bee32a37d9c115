"""Roller bearings and plain films in one engine: each main follows its own law."""

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import entry
import numpy as np
import pytest
from bodies import COARSE
from scipy.linalg import eigh
from started import at_speed

import cranktrain as ct
from cranktrain.core.errors import InputError
from cranktrain.core.units import RPM
from cranktrain.dynamics.cycle_run import run_cycles
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import engine_from_dict, engine_to_dict
from cranktrain.engine.parts import RollerBearings
from cranktrain.structure.assembly import assemble
from cranktrain.structure.crank.modal import bearing_stiffness
from cranktrain.structure.crank.reduction import complete_crankshaft, reduced_crankshaft
from cranktrain.studies.roller_stand_ins import running_rollers


def coarse(name):
    """An engine whose crank is meshed coarsely."""
    engine = load_engine(name)
    return replace(engine, crankshaft=replace(engine.crankshaft, mesh_size=COARSE))


SIX = coarse("diesel_i6")
FOUR = Path(__file__).parents[2] / "examples" / "four_with_balancers.toml"


def rollers(track, count, mains=(), size=0.012, **changed):
    """As many equal bearings on journals of ``track``, m."""
    values = {
        "rollers": 20, "roller_diameter": size, "roller_length": 0.02, "pitch_diameter": track + size,
        "clearance": 3e-5, "stiffness": 8e8, "tilt_stiffness": 3e4, "damping": 2e4, "tilt_damping": 2.0,
        "ring_mass": 0.6, "profile": 0.00035,
    }  # fmt: skip
    own = {name: count * (value,) for name, value in (values | changed).items() if name != "law"}
    return RollerBearings(**own, mains=mains, law=changed.get("law", "palmgren"))


def mixed(engine, *mains, **changed):
    """The engine with rollers at some of its mains."""
    made = replace(
        engine, name="mixed", frame=(), body=(), connection=(),
        main_roller=rollers(engine.crankshaft.main_diameter, len(mains), mains, **changed),
    )  # fmt: skip
    check_engine(made)
    return made


@cache
def cycle(engine, rpm=1500.0, **levels):
    """Last cycle of a run until it repeats."""
    made = assemble(engine, Settings(**{"step": math.radians(2.5), "integrator": "esdirk4"} | levels))
    simulation = at_speed(rpm * RPM, engine, made.body, made.settings, parts=made.parts)
    return run_cycles(simulation, None, 1e-3, None, None)


def test_linear_rollers_like_the_linear_films_are_the_same_engine():
    """The limit where both laws say the same: springs alike in all directions that do not feel tilt."""
    spring = {"stiffness": 6e8, "damping": 2e4}
    plain = replace(
        SIX,
        main_bearing=replace(
            SIX.main_bearing, stiffness_x=6e8, stiffness_y=6e8, damping_x=2e4, damping_y=2e4,
            block_stiffness_x=math.inf, block_stiffness_y=math.inf,
        ),
    )  # fmt: skip
    own = mixed(plain, 1, 4, law="linear", tilt_stiffness=1e-6, tilt_damping=0.0, ring_mass=1e-6, **spring)
    # The crank of rollers is condensed under their moments too: 2e-5 of a force.
    one, other = cycle(plain, bearings="linear"), cycle(own, bearings="linear")
    for name in ("pulley.torsion", "bearing[1].force.y", "bearing[3].force.x", "bearing[4].force.y"):
        values = one.outputs[name]
        np.testing.assert_allclose(other.outputs[name], values, atol=5e-5 * np.abs(values).max(), err_msg=name)


@pytest.mark.parametrize(
    "levels", [{}, pytest.param({"block": "flexible"}, marks=pytest.mark.slow), {"bearings": "reynolds"}], ids=str
)
def test_each_main_follows_its_own_law(levels):
    """Rollers at main 1 alone: it has no film and gives way by microns, the films beside it are what they were."""
    run, plain = cycle(mixed(SIX, 1), **levels), cycle(SIX, **levels)
    assert run.settling.repeats == 1
    assert not run.outputs["bearing[1].friction_torque"].any() and not run.outputs["bearing[1].oil_flow"].any()
    for main in (3, 4, 5, 6, 7):
        name = f"bearing[{main}].film_thickness_min"
        assert run.outputs[name].min() > 0.0 and run.outputs[f"bearing[{main}].oil_flow"].min() > 0.0
        # The journal beside main 1 feels it; those farther away hardly do.
        if main > 3:
            force = f"bearing[{main}].force.y"
            size = np.abs(plain.outputs[force]).max()
            assert np.sqrt(np.mean((run.outputs[force] - plain.outputs[force]) ** 2)) < 0.03 * size
    means = [sum(r.outputs[f"bearing[{i}].force.y"][1:].mean() for i in range(1, 8)) for r in (run, plain)]
    # All carry the same load on average: gas on the pistons, and weight but for the ring's.
    assert means[0] == pytest.approx(means[1], rel=2e-3)


def test_films_are_the_same_wherever_the_rollers_stand():
    """The map of a film belongs to the plain bearing, not to the first main of the engine."""
    least = [
        min(cycle(mixed(SIX, main)).outputs[f"bearing[{k}].film_thickness_min"].min() for k in (3, 4, 5))
        for main in (1, 7)
    ]
    assert least[0] == pytest.approx(least[1], rel=0.05)


def test_elastic_films_remember_behind_rollers_that_do_not():
    """Memory in the state has no place for rollers; a restored state goes on bit by bit."""
    own = mixed(SIX, 1, 5)
    made = assemble(own, Settings(bearings="ehd"))
    one, other = (at_speed(1500.0 * RPM, own, made.body, made.settings, parts=made.parts) for _ in range(2))
    kept = [entry.memory(one, f"main[{i + 1}]").size for i in range(7)]
    assert kept[0] == kept[4] == 0 < kept[1] and sum(kept) == 5 * kept[1]
    step = 4.0 * math.pi / one.inputs[0] / 288
    for k in range(6):
        one.step((k + 1) * step)
    other.state = one.state
    for k in range(6, 10):
        one.step((k + 1) * step)
        other.step((k + 1) * step)
    assert np.array_equal(one.outputs, other.outputs)


@pytest.mark.parametrize(("mains", "rpm"), [((1,), 3000.0), ((1, 5), 4000.0), ((3,), 1500.0)])
def test_a_four_runs_on_both(mains, rpm):
    run = cycle(mixed(coarse(FOUR), *mains, size=0.01), rpm)
    assert run.settling.repeats == 1
    for main in range(1, 6):
        assert bool(run.outputs[f"bearing[{main}].oil_flow"].any()) == (main not in mains)


def test_modes_and_stand_ins_belong_to_the_mains_that_have_rollers():
    """A stiffer main raises the frequencies in place; stand-ins are reported by the number of the main."""
    first = []
    for engine in (SIX, mixed(SIX, 2, law="linear", stiffness=5e9, ring_mass=1e-6)):
        crank = complete_crankshaft(engine, reduced_crankshaft(SIX))
        stiffness = np.diag(crank.omega**2) + bearing_stiffness(engine, crank)
        first.append(np.sqrt(eigh(stiffness, eigvals_only=True)[1:12]))
    assert (first[1] > first[0] * (1.0 - 1e-6)).all() and first[1][2] > 1.001 * first[0][2]
    found = running_rollers(mixed(SIX, 2, 6), 1500.0)
    assert [entry["main"] for entry in found["mains"]] == [2, 6]


def test_a_summary_names_no_roller_as_an_edge_that_closes():
    run = ct.simulate(mixed(SIX, 1), speed_rpm=1500, crank="rigid", bearings="reynolds", cycles=1)
    summary = run.summary()
    assert summary["bearings"][0]["min_film_um"] == 0.0 < min(row["min_film_um"] for row in summary["bearings"][1:])
    assert "main[1]" not in summary["closing_edges"]


def test_the_heat_balance_warms_films_alone(recwarn):
    """Rollers stay at the oil's temperature and bound nothing."""
    run, inlet = cycle(mixed(SIX, 1), film_temperature="heat-balance"), cycle(mixed(SIX, 1))
    assert run.film_temperatures[0] == inlet.film_temperatures[0]
    assert (run.film_temperatures[1:] > inlet.film_temperatures[1:] + 5.0).all()
    assert not [warning for warning in recwarn if "main[1]" in str(warning.message)]


def test_an_engine_file_says_which_mains(tmp_path):
    own = mixed(SIX, 1, 3)
    again = engine_from_dict(engine_to_dict(own))
    assert again == own and again.roller_mains == (0, 2) and again.plain_numbers == (1, 3, 4, 5, 6)
    assert replace(SIX, main_bearing=None, main_roller=rollers(0.08, 7)).roller_mains == tuple(range(7))


BAD = [
    ({"main_roller": rollers(0.08, 7)}, "keep one of the two, or name the mains"),
    ({"main_roller": rollers(0.08, 1, (8,))}, "main_roller.mains: 8 is not one of the main journals 1..7"),
    ({"main_roller": rollers(0.08, 2, (3, 1))}, "does not rise"),
    ({"main_roller": rollers(0.08, 2, (1,))}, "2 values for 1 mains"),
    ({"main_bearing": None, "main_roller": rollers(0.08, 1, (1,))}, "is missing for mains 2, 3, 4, 5, 6, 7"),
]


@pytest.mark.parametrize(("changes", "text"), BAD, ids=[text for _, text in BAD])
def test_what_does_not_fit_is_one_line(changes, text):
    with pytest.raises(InputError) as refused:
        check_engine(replace(SIX, **changes))
    assert text in str(refused.value).replace("[", "").replace("]", "") and "\n" not in str(refused.value)


def test_rollers_alone_are_no_level_of_mixed_mains():
    with pytest.raises(InputError, match="some mains of engine 'mixed' are plain"):
        assemble(mixed(SIX, 1), Settings(bearings="roller"))
