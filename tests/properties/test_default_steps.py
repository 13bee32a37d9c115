"""Steps and integrators that runs take by themselves: by level, rows between steps, and what the step leaves."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from bodies import series
from started import at_speed

from cranktrain.dynamics.cycle_run import communication_step, row_step
from cranktrain.dynamics.model.settings import RECORDED, ROW, Settings, resolved, step_each_row
from cranktrain.dynamics.simulation import simulate
from cranktrain.engine.file import load_engine
from cranktrain.film.laws.register import LAWS
from cranktrain.structure.assembly import assemble

RPM = math.pi / 30.0
ENGINES = {"single_petrol": 4000.0, "diesel_i6": 2000.0, "v12_petrol": 4000.0}


@cache
def levels_of(engine, crank, bearings):
    return assemble(load_engine(engine), Settings(block="ground", crank=crank, bearings=bearings), inherit=False)


def started(assembly, speed, **choices):
    return at_speed(speed, assembly.engine, assembly.body, replace(assembly.settings, **choices), parts=assembly.parts)


def cycle(assembly, speed, cycles=4, **choices):
    """Outputs (240,) of the last cycle by name, 3 degrees apart."""
    found = series(started(assembly, speed, **choices), 240 * cycles, 240)
    return {name: rows[-240:] for name, rows in found.items()}


def test_a_step_that_is_given_rules():
    engine = load_engine("diesel_i6")
    for name in LAWS:
        if "plain" not in LAWS[name].forms:
            continue
        crank = "torsional" if name == "held" else "beam"
        usual = resolved(Settings(crank=crank, bearings=name), engine)
        assert usual.step == pytest.approx(math.radians(LAWS[name].step_deg))
        assert name != "ehd" or usual.step <= min(RECORDED, ROW) + 1e-12  # films that remember are stepped to each row
        given = resolved(Settings(crank=crank, bearings=name, step=0.01, integrator="sdirk3"), engine)
        assert (given.step, given.integrator) == (0.01, "sdirk3")
        held = resolved(Settings(crank=crank, bearings=name, reconstruction="hold"), engine)
        assert not held.integrator.startswith("esdirk")  # their first stage is of the inputs before


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("crank, bearings", [("torsional", "held"), ("beam", "linear"), ("beam", "impedance")])
def test_the_usual_step_leaves_little(engine, crank, bearings):
    """A tenth of what these levels on ground lack at least: 5 % in torsion, 60 % in axial motion of the six."""
    assembly, speed = levels_of(engine, crank, bearings), ENGINES[engine] * RPM
    found = cycle(assembly, speed)
    best = cycle(assembly, speed, step=math.radians(0.5), integrator="esdirk4")
    largest = {"pulley.torsion": 5.0e-3, "pulley.axial": 6.0e-2, "shaft.torque": 5.0e-3}
    for name, most in largest.items():
        swing = np.std(best[name])
        if name == "pulley.axial" and crank == "torsional":
            continue
        assert np.sqrt(np.mean((found[name] - best[name]) ** 2)) < most * swing, name


@pytest.mark.parametrize("engine", ENGINES)
def test_rows_lie_within_steps_and_no_further_apart_than_three_degrees(engine):
    assembly, speed = levels_of(engine, "beam", "linear"), ENGINES[engine] * RPM
    run = simulate(engine=assembly.engine, body=assembly.body, settings=assembly.settings, speed=speed, cycles=2)
    assert run.per_cycle == 288 and run.counters["steps"] == 2 * 144
    assert run.time.size == 2 * 288 + 1 and run.step * speed == pytest.approx(math.radians(2.5))
    assert run.powers.shape[0] == 289
    coarse = replace(assembly.settings, dense_output="off")
    plain = simulate(engine=assembly.engine, body=assembly.body, settings=coarse, speed=speed, cycles=2)
    assert plain.per_cycle == 144
    for name in ("pulley.torsion", "shaft.torque", "crank.angle"):
        assert np.array_equal(run.outputs[name][::2], plain.outputs[name])


@pytest.mark.parametrize("degrees, dense, expected", [
    (6.0, "on", 3.0), (6.0, "off", 6.0), (5.0, "on", 5.0), (2.5, "on", 2.5), (7.0, "on", 720.0 / 103),
])  # fmt: skip
def test_rows_divide_the_usual_step_and_no_other(degrees, dense, expected):
    """A step that a user chooses is the distance of rows, too."""
    assembly, speed = levels_of("single_petrol", "torsional", "held"), 300.0
    simulation = started(assembly, speed, step=math.radians(degrees), dense_output=dense)
    assert math.degrees(row_step(simulation) * speed) == pytest.approx(expected)
    assert row_step(simulation) <= communication_step(speed, simulation.settings.step) * (1 + 1e-12)
    assert ROW >= RECORDED
    each = step_each_row(simulation.settings)
    assert each.step == min(math.radians(degrees), RECORDED)
