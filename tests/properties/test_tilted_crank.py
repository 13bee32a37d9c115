"""Crank on films that feel tilt, and with big ends on films of their own: tangents, balances, limits."""

import math
from dataclasses import replace
from functools import cache

import bodies
import entry
import numpy as np
import pytest
from bodies import free_six, rigid_crank
from one_line import one_line
from some import some

from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Parts, simulate
from cranktrain.film.elastic.workspace import lane_work
from cranktrain.film.journal.grid import NODE_GRADING
from cranktrain.film.laws.ehd import IN_LOOP, SHAPES
from cranktrain.film.table.database import bearing_settings
from cranktrain.store.film_tables import film_table
from cranktrain.structure.block.saddle import bore_compliance

SPEED = 2000 * math.pi / 30
ENGINE = free_six()
BODY = rigid_crank(ENGINE)
CHOICES = [
    {"bearings": "reynolds"}, {"big_ends": "impedance"}, {"bearings": "reynolds", "big_ends": "impedance"},
    {"bearings": "ehd", "newton_tolerance": 1e-4}, {"big_ends": "table"},
]  # fmt: skip


@cache
def bore():
    return bore_compliance(ENGINE, SHAPES, with_motion=True)


@cache
def pin_films():
    return film_table(bearing_settings(ENGINE.big_end_bearing, tilt=False))[0]


def started(**choices):
    elastic = bore() if choices.get("bearings") == "ehd" else None
    floating = pin_films() if choices.get("big_ends") == "table" else None
    return bodies.started(SPEED, ENGINE, Parts(bore=elastic, big_end_table=floating), **choices)


@pytest.mark.parametrize("choices", CHOICES)
def test_blocks_are_the_derivatives_of_the_forces(choices):
    """At the Newton ports, by central differences with u̇ and ü following u as they do in a stage."""
    simulation = started(**choices)
    if choices.get("bearings") == "reynolds":
        # Nodes at rest: where they follow the journal tangents by place are exact to the order of the grid only.
        record = entry.solved_films(simulation, ENGINE.main_bearing)
        record.grid.settings[NODE_GRADING] = 0.0
        entry.use_films(simulation, record)
    if choices.get("bearings") == "ehd":
        # Solved alone: films in lanes are of single precision, tests/properties/test_film_lanes.py.
        record = entry.film_record(simulation)
        entry.use_films(simulation, record._replace(lanes=lane_work(record.film, 0, singles=True)))
    simulation.step(math.radians(3) / SPEED)
    tangent, sizes = entry.tangents_at(simulation), entry.scales(simulation.model)
    scale = np.abs(tangent).max(axis=1)
    for port, way in some(enumerate(np.eye(sizes.size))):
        # A wider step lets a node of a solved film rupture within; elastic films converge to what 1e-6 sees.
        h = (1e-7 if "reynolds" in choices.values() else 1e-6) * sizes[port]
        slope = (entry.forces_at(simulation, h * way) - entry.forces_at(simulation, -h * way)) / (2 * h)
        # A rod's own moment on its pin and the film's friction go without tangent; rods and films are here.
        assert np.abs(slope - tangent[:, port]).max() <= 2e-4 * np.abs(tangent[:, port]).max(), port
        assert np.all(np.abs(slope - tangent[:, port]) <= 2e-3 * scale), port


def test_big_ends_of_the_table_float_as_those_of_the_impedance_map():
    """The map is of the parabolic film, 0.7 to 1.6 % off the two-dimensional one; loads are what rods make them."""
    parts, runs = Parts(big_end_table=pin_films()), []
    for level in ("impedance", "table"):
        runs.append(simulate(ENGINE, BODY, Settings(crank="rigid", big_ends=level), SPEED, 2, parts=parts).outputs)
    for name, share in (("force.x", 1e-3), ("force.y", 1e-3), ("position.x", 0.02), ("position.y", 0.02)):
        mapped, tabled = (run[f"big_end[3].{name}"][-288:] for run in runs)
        assert np.sqrt(np.mean((mapped - tabled) ** 2)) < share * np.ptp(mapped), name
    assert 0.8 < runs[1]["big_end[3].eccentricity"][-288:].max() < 0.97
    assert runs[1]["big_end[3].oil_flow"][-288:].min() > 0.0


def test_free_big_ends_carry_what_rods_need():
    """Upward forces of all mains have the same mean whatever carries the rods; each load stays what rods make it."""
    rigid, free = (
        simulate(ENGINE, BODY, Settings(crank="rigid", big_ends=level, encoder="flywheel"), SPEED, 4)
        for level in ("rigid", "impedance")
    )

    def upward(run):
        return np.array([run.outputs[f"bearing[{i + 1}].force.y"][-1 - run.per_cycle : -1] for i in range(7)])

    peak = np.abs(upward(rigid)).max()
    assert upward(free).sum(axis=0).mean() == pytest.approx(upward(rigid).sum(axis=0).mean(), abs=2e-4 * peak)
    # Journals give way by their clearance of a throw of 60 mm: 6e-4 of any load.
    assert np.sqrt(np.mean((upward(free) - upward(rigid)) ** 2)) < 1e-3 * peak


def widest(simulation):
    """Largest shape of the elastic bores in the state, m."""
    films = np.array([entry.memory(simulation, f"main[{i + 1}]") for i in range(7)])
    return np.abs(films[:, IN_LOOP.size : IN_LOOP.size + SHAPES]).max()


def test_a_stiffer_bore_moves_less_in_proportion():
    """A softness of 1e-6 leaves a rigid bore: shapes a million times smaller, and films as from one of 1e-9."""
    runs = []
    for softness in (1.0, 1e-6, 1e-9):
        elastic = replace(bore(), compliance=softness * bore().compliance)
        simulation = bodies.started(SPEED, ENGINE, Parts(bore=elastic), bearings="ehd")
        simulation.step(math.radians(2.5) / SPEED)
        runs.append((simulation.outputs.copy(), widest(simulation)))
    names = simulation.output_names
    forces = [names.index(f"bearing[{i + 1}].force.y") for i in range(7)]
    scale = np.abs(runs[2][0][forces]).max()
    assert runs[1][1] < 1e-5 * runs[0][1] and 1e-7 < runs[0][1] < 1e-4
    assert np.abs(runs[1][0][forces] - runs[2][0][forces]).max() < 1e-5 * scale
    assert np.abs(runs[0][0][forces] - runs[2][0][forces]).max() > 1e-4 * scale


@pytest.mark.parametrize(
    ("choices", "says"),
    [({"bearings": "ehd"}, "compliance"), ({"bearings": "table"}, "film-table"),
     ({"big_ends": "table"}, "big-end level 'table' needs")],
)  # fmt: skip
def test_levels_without_what_they_need_are_refused(choices, says):
    with one_line(says):
        bodies.started(SPEED, **choices)
