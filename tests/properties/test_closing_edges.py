"""Runs whose edges nearly touch: grids agree, contact stays below the hardness, the table needs no film solved."""

import math

import entry
import numpy as np
import pytest
from started import at_speed

from cranktrain.dynamics.simulation import Parts, Settings
from cranktrain.engine.file import load_engine
from cranktrain.film.contact.journal import N_OUT, PRESSURE_MAX, bearing_contact, journal_contact
from cranktrain.structure import assembly

ENGINE, SPEED, PER_CYCLE = load_engine("diesel_i6"), 1000.0 * math.pi / 30.0, 288


def started(body, **choices):
    table = assembly.main_table(ENGINE) if choices["bearings"] == "table" else None
    return at_speed(SPEED, ENGINE, body, Settings(**choices), parts=Parts(table=table))


def cycle(simulation, cycles=1):
    """Torsion, forces (over time, 7) and places (over time, 7, 4) of the last cycle."""
    at = {name: k for k, name in enumerate(simulation.output_names)}
    forces = [[at[f"bearing[{i}].force.{axis}"] for i in range(1, 8)] for axis in "xy"]
    begin, torsion, loads, places = simulation.time, [], [], []
    for k in range(cycles * PER_CYCLE):
        simulation.step(begin + (k + 1) * 4.0 * math.pi / SPEED / PER_CYCLE)
        torsion.append(simulation.outputs[at["pulley.torsion"]])
        loads.append(np.hypot(*simulation.outputs[np.array(forces)]))
        places.append([entry.law(simulation, f"main[{i}]").place.copy() for i in range(1, 8)])
    return np.array(torsion)[-PER_CYCLE:], np.array(loads)[-PER_CYCLE:], np.array(places)[-PER_CYCLE:]


@pytest.mark.slow
def test_films_of_the_loop_are_converged_where_edges_touch():
    """The six at 1000 rev/min, whose edges touch: the loop's grid against one twice as fine both ways."""
    body = assembly.running_crank(ENGINE, "solid")
    usual = started(body, bearings="reynolds")
    cycle(usual, 2)
    fine = started(body, bearings="reynolds")
    entry.use_films(fine, entry.solved_films(fine, ENGINE.plain_mains, size=(96, 16)))
    fine.state = usual.state
    (torsion, loads, places), (finer, carried, _) = cycle(usual, 2), cycle(fine, 2)
    assert np.ptp(torsion) == pytest.approx(np.ptp(finer), rel=0.003)
    assert loads.max(axis=0) == pytest.approx(carried.max(axis=0), rel=0.01)
    contact, out = bearing_contact(ENGINE.plain_mains), np.zeros(N_OUT)
    for place in places.reshape(-1, 4):
        journal_contact(*place, 0.0, contact, out)
        assert out[PRESSURE_MAX] < ENGINE.plain_mains.hardness


@pytest.mark.slow
@pytest.mark.parametrize("crank", ["beam", "solid"])
@pytest.mark.parametrize("steps", [{"integrator": "esdirk4", "step": math.radians(2.5)}, {}], ids=["2.5 deg", "usual"])
def test_a_settled_cycle_reads_its_films_from_the_table_and_a_start_most(crank, steps):
    """A start leaves the table in 2.2 % of its films, cycles of 2.5 degrees, which do not repeat, in 0.5 %."""
    simulation = started(assembly.running_crank(ENGINE, crank), bearings="table", crank=crank, **steps)
    cycle(simulation, 2)
    assert not steps or entry.films_solved(simulation) < 0.03 * 7.0 * entry.count(simulation, "iterations")
    cycle(simulation, 8)
    solved, iterations = entry.films_solved(simulation), entry.count(simulation, "iterations")
    cycle(simulation)
    beyond = entry.films_solved(simulation) - solved
    assert beyond <= (0.01 * 7.0 * (entry.count(simulation, "iterations") - iterations) if steps else 0.0)
