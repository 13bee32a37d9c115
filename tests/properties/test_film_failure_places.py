"""Where films fail first, in the running model: standstill, start from speed 0, reversed load, contact at ε → 1."""

import math

import numpy as np
import pytest
from rotor_on_films import C, rotor

from cranktrain.dynamics.model import slots as at
from cranktrain.film.laws.parameters import VISCOSITY

LEVELS = ("impedance", "reynolds")


def watched(simulation, name):
    return simulation.outputs[simulation.output_names.index(f"bearing[1].{name}")]


@pytest.mark.parametrize("level", LEVELS)
def test_a_shaft_that_stands_sinks_by_squeeze_and_lands_on_its_asperities(level):
    simulation = rotor(20.0, 5000.0, speed=0.0, bearings=level, newton_tolerance=1e-8)
    place, time, step = [watched(simulation, "eccentricity")], 0.0, 1e-3
    for _ in range(180):
        time += step
        simulation.step(time)
        step = min(1.05 * step, 0.5)
        place.append(watched(simulation, "eccentricity"))
        assert np.isfinite(simulation.outputs).all()
        assert watched(simulation, "force.y") == pytest.approx(5000.0, rel=1e-3)
    # It only sinks; a film would let it sink for ever, so that what holds it at last is contact.
    assert (np.diff(place) > -1e-5).all()
    assert place[-1] > place[0] + 1e-3
    assert place[-1] - place[-20] < 1e-5
    assert 0.95 < place[-1] < 1.0


@pytest.mark.parametrize("level", LEVELS)
def test_a_start_from_speed_0_ends_where_a_start_at_speed_does(level):
    simulation = rotor(20.0, 500.0, speed=0.0, bearings=level)
    for k in range(1, 50):
        simulation.step(k * 1e-3)
    rest = watched(simulation, "eccentricity")
    for k in range(50, 800):
        simulation.inputs[0] = min(100.0, (k - 50) * 0.4)
        simulation.step(k * 1e-3)
        assert np.isfinite(simulation.outputs).all()
        assert watched(simulation, "eccentricity") < 1.02
    running = rotor(20.0, 500.0, speed=100.0, bearings=level)
    for k in range(1, 400):
        running.step(k * 1e-3)
    assert watched(simulation, "eccentricity") == pytest.approx(watched(running, "eccentricity"), rel=2e-3)
    assert watched(simulation, "eccentricity") < rest - 0.1
    # The film has taken over: shear of a filled gap (and half of e × F, below a hundredth of it), no sliding contact.
    eps = watched(simulation, "eccentricity")
    shear = 2.0 * math.pi * simulation.model.bearings[0, VISCOSITY] * 100.0 * 0.04**4 / C / math.sqrt(1.0 - eps * eps)
    assert abs(watched(simulation, "friction_torque")) == pytest.approx(shear, rel=0.02)


@pytest.mark.parametrize("level", LEVELS)
def test_a_load_that_reverses_crosses_the_clearance_and_comes_back(level):
    simulation = rotor(2.0, 50.0, speed=100.0, bearings=level)
    step = math.radians(2.5) / 100.0
    forces, films = [], []
    for k in range(1, 721):
        simulation.inputs[1] = at.AMBIENT * (1.0 + 2.0 * math.sin(0.1 * math.pi * k))  # from -1 to +1.8 kN on the pin
        simulation.inputs[1] = max(simulation.inputs[1], 0.0)
        simulation.step(k * step)
        forces.append(watched(simulation, "force.y"))
        films.append(watched(simulation, "film_thickness_min"))
        assert np.isfinite(simulation.outputs).all()
    assert min(forces) < -100.0
    assert max(forces) > 100.0
    assert min(films) > 0.0
    assert max(films) < C


@pytest.mark.parametrize("level", LEVELS)
def test_overload_lands_on_contact_and_the_film_carries_again(level):
    simulation = rotor(20.0, 500.0, speed=100.0, bearings=level)
    step = math.radians(2.5) / 100.0
    for k in range(1, 61):
        simulation.inputs[1] = at.AMBIENT + 1.6e7 * math.sin(math.pi * k / 60.0) ** 2  # 139 kN at the most
        simulation.step(k * step)
        assert np.isfinite(simulation.outputs).all()
    deepest = watched(simulation, "eccentricity")
    for k in range(61, 500):
        simulation.inputs[1] = at.AMBIENT
        simulation.step(k * step)
        deepest = max(deepest, watched(simulation, "eccentricity"))
    assert watched(simulation, "eccentricity") < 0.9
    assert watched(simulation, "force.y") == pytest.approx(500.0, rel=0.05)
