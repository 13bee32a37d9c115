"""The thrust collar in a running crank: what is shown is what acts, and tilt is felt alike wherever it is felt."""

import math
from dataclasses import replace

import numpy as np
import pytest
from bodies import free_six, rigid_crank
from started import at_speed

from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.arrays import dimensions
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.model.state import offset
from cranktrain.dynamics.motion.equations import port_forces
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, FORCE, film_call
from cranktrain.film.laws.register import LAWS
from cranktrain.film.laws.thrust import thrust_force_tilted, thrust_parameters

SPEED = 2000 * math.pi / 30
SIX = free_six()


@pytest.fixture(scope="module")
def tilting():
    """A rigid crank that is thrown along its axis, so that its collar is off the middle and tilted; by level."""
    body = rigid_crank(SIX)

    def made(bearings, state=None):
        # Outputs of states that steps end at: between these, motion is interpolated and forces follow from it.
        settings = Settings(crank="rigid", bearings=bearings, dense_output="off")
        simulation = at_speed(SPEED, SIX, body, settings)
        thrown, motion = simulation.state, slice(offset(0, body.n_modes), offset(3, body.n_modes))
        thrown[offset(1, body.n_modes) + 2] += 0.01 * math.sqrt(body.mass)
        if state is not None:
            thrown[motion] = state[motion]
        simulation.state = thrown
        return simulation

    return made


@pytest.mark.parametrize("bearings", ["linear", "impedance", "reynolds"])
def test_force_shown_is_the_rate_of_axial_momentum(tilting, bearings):
    """Nothing else acts along the axis: rods and bearings act across it, and gravity does."""
    simulation = tilting(bearings)
    force, momentum = [], []
    n = simulation.body.n_modes
    for k in range(1, 41):
        simulation.step(k * math.radians(1.0) / SPEED)
        force.append(simulation.outputs[simulation.output_names.index("thrust.force")])
        momentum.append(simulation.body.translation[2] @ simulation.state[offset(2, n) : offset(3, n)])
    force = np.array(force)
    assert np.abs(force - momentum).max() < 1e-6 * np.abs(force).max()
    assert np.abs(force).max() > 100.0


def test_tilt_is_part_of_the_force_that_is_shown(tilting):
    simulation = tilting("reynolds")
    simulation.step(math.radians(20.0) / SPEED)
    k = dimensions(simulation.model).thrust
    connection = simulation.model.connections[k]
    place, velocity = simulation.model.laws.place[k], simulation.model.laws.velocity[k]
    ports = connection[at.FIRST : at.FIRST + 3].astype(int)
    assert place[:3] == pytest.approx(simulation.work.port[at.RELATIVE, ports])
    parameters, out = thrust_parameters(SIX.thrust, simulation.model.bearings[0, -1]), np.zeros(21)
    thrust_force_tilted(place[0], 0.0, 0.0, velocity[0], 0.0, 0.0, SPEED, parameters, out)
    shown = simulation.outputs[simulation.output_names.index("thrust.force")]
    assert abs(shown / out[0] - 1.0) > 1e-4


def test_collar_is_as_stiff_in_tilt_on_films_without_tilt(tilting, monkeypatch):
    """Force, moments and tangents of the collar at one state, by the level of the journals' films."""
    monkeypatch.setitem(LAWS, "impedance", replace(LAWS["impedance"], square_collar=False))
    blocks = []
    state = None
    for level in ("impedance", "reynolds"):
        simulation = tilting(level, state)
        state = simulation.state
        model, work = simulation.model, simulation.work
        work.port[at.U : at.UDD + 1] = work.port[at.STATE_U : at.STATE_UDD + 1]
        assert port_forces(model, work, work.frames[0].copy(), work.pressures[0].copy(), 1e-9, 3e-5) == 0
        out = np.zeros_like(model.laws.out)
        film_call(model.laws, FORCE, dimensions(model).thrust, out, out)
        blocks.append(out[:BY_VELOCITY])
    assert blocks[0] == pytest.approx(blocks[1], rel=1e-12)
    about_x, about_y = blocks[0][[BY_PLACE + 5, BY_PLACE + 10]]
    assert max(about_x, about_y) < 0.0
