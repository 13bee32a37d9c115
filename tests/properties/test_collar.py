"""The thrust collar in a running crank: what is shown is what acts, and tilt is felt alike wherever it is felt."""

import math

import entry
import numpy as np
import pytest
from bodies import free_six, rigid_crank
from started import at_speed

from cranktrain.dynamics.model.settings import Settings
from cranktrain.film.laws.thrust import thrust_force_tilted, thrust_parameters

SPEED = 2000 * math.pi / 30
SIX = free_six()


def tilting(bearings):
    """A rigid crank that is thrown along its axis, so that its collar is off the middle and tilted."""
    # Outputs of states that steps end at: between these, motion is interpolated and forces follow from it.
    simulation = at_speed(SPEED, SIX, rigid_crank(SIX), Settings(crank="rigid", bearings=bearings, dense_output="off"))
    thrown = simulation.state
    entry.motion(simulation, thrown)[1, 2] += 0.01 * math.sqrt(simulation.body.mass)
    simulation.state = thrown
    return simulation


@pytest.mark.parametrize("bearings", ["linear", "impedance", "reynolds"])
def test_force_shown_is_the_rate_of_axial_momentum(bearings):
    """Nothing else acts along the axis: rods and bearings act across it, and gravity does."""
    simulation = tilting(bearings)
    force, momentum = [], []
    for k in range(1, 41):
        simulation.step(k * math.radians(1.0) / SPEED)
        force.append(simulation.outputs[simulation.output_names.index("thrust.force")])
        momentum.append(simulation.body.translation[2] @ entry.motion(simulation)[2])
    force = np.array(force)
    assert np.abs(force - momentum).max() < 1e-6 * np.abs(force).max()
    assert np.abs(force).max() > 100.0


def test_tilt_is_part_of_the_force_that_is_shown():
    simulation = tilting("reynolds")
    simulation.step(math.radians(20.0) / SPEED)
    collar = entry.law(simulation, "thrust")
    place, velocity = collar.place, collar.velocity
    # The collar stands where the crank's modes take it: along its axis, and about x and y of the frame.
    moved = simulation.body.shapes[simulation.body.index("thrust"), 2:5] @ entry.motion(simulation)[0]
    assert place[:3] == pytest.approx(moved, rel=1e-12)
    parameters, out = thrust_parameters(SIX.thrust, entry.film_parameters(simulation)[-1]), np.zeros(21)
    thrust_force_tilted(place[0], 0.0, 0.0, velocity[0], 0.0, 0.0, SPEED, parameters, out)
    shown = simulation.outputs[simulation.output_names.index("thrust.force")]
    assert abs(shown / out[0] - 1.0) > 1e-4
