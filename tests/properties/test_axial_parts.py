"""Axial motion of the pulley in its parts: they add up, and each is what it is called."""

import math

import numpy as np
import pytest
from bodies import rigid_crank
from standing import rigid_block
from started import at_speed, series

from cranktrain.dynamics.outputs.register import Counts, output_needs
from cranktrain.dynamics.simulation import Parts, Settings
from cranktrain.engine.file import load_engine
from cranktrain.structure.crank.level import crank_body

SIX = load_engine("diesel_i6")
SPEED = 2000 * math.pi / 30
PARTS = ("axial.engine", "axial.bearing", "axial.crank")


def run(body, parts=None, steps=72, **choices):
    """Outputs (k,) by name over some steps of 2.5 degrees."""
    simulation = at_speed(SPEED, SIX, body, Settings(**choices), parts=parts)
    return simulation, series(simulation, math.radians(2.5) / SPEED, steps)


@pytest.fixture(scope="module")
def beam():
    return crank_body(SIX, "beam")


@pytest.fixture(scope="module")
def on_mounts(beam):
    """The elastic crank in a rigid block on its mounts."""
    return run(beam, Parts(block=rigid_block(SIX, beam)), crank="beam", block="flexible")


def whole(outputs):
    return sum(outputs[name] for name in PARTS)


def test_parts_add_up(on_mounts):
    _, outputs = on_mounts
    size = max(np.ptp(outputs[name]) for name in PARTS)
    assert np.abs(whole(outputs) - outputs["pulley.axial"]).max() < 1e-9 * size
    assert min(np.ptp(outputs[name]) for name in PARTS) > 1e-4 * size


def test_the_engines_part_is_the_blocks_motion_at_the_thrust_faces(on_mounts, beam):
    """A rigid block: displacement of its centre of mass and rotation about it."""
    simulation, outputs = on_mounts
    block = simulation.parts.block
    arm = block.positions[block.index("thrust")] - block.centre
    moved = outputs["engine.position.z"] + outputs["engine.rotation.x"] * arm[1] - outputs["engine.rotation.y"] * arm[0]
    assert outputs["axial.engine"] == pytest.approx(moved, abs=1e-9 * np.ptp(moved))
    assert np.array_equal(outputs["axial.bearing"], outputs["thrust.displacement"])


def test_on_ground_the_engine_stands_and_a_rigid_crank_keeps_its_length(beam):
    _, elastic = run(beam, crank="beam")
    assert not np.any(elastic["axial.engine"])
    assert np.abs(whole(elastic) - elastic["pulley.axial"]).max() < 1e-9 * np.ptp(elastic["axial.crank"])
    _, stiff = run(rigid_crank(SIX), crank="rigid")
    assert np.abs(stiff["axial.crank"]).max() < 1e-12
    assert stiff["axial.bearing"] == pytest.approx(stiff["pulley.axial"], abs=1e-15)


def test_loads_across_move_the_pulley_along(beam):
    """Gas loads the pins across and never along: by twist and bending alone it shortens the crank by micrometres."""
    _, fired = run(beam, crank="beam")
    _, motored = run(beam, crank="beam", gas_load=0.0)
    assert np.ptp(fired["axial.crank"] - motored["axial.crank"]) > 5e-6


def test_each_part_needs_the_level_that_moves_it():
    needs = output_needs(Counts(7, 6, 4))
    assert needs["axial.engine"]["block"] == "flexible"
    assert needs["axial.crank"]["crank"] == "beam"
