"""Oil whirl in the running model: it sets in where stiffness and damping say, whatever integrates the motion.

A rigid rotor on two equal bearings under gravity. Speed and load stay; the mass (with gravity in inverse) moves the
rotor through its threshold ω_s √(c m/W), so 1 % of mass is 0.5 % of threshold.

Films fail first at standstill, at a start from speed 0, under reversed load and in contact at ε → 1.
"""

import math
from dataclasses import replace
from functools import cache

import entry
import numpy as np
import pytest
from bodies import rigid_crank

from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.engine.file import load_engine
from cranktrain.film.laws.impedance import MapFilm, impedance_map, journal_force
from cranktrain.film.laws.parameters import CLEARANCE, CONTACT_HEIGHT, CONTACT_LOAD, FACTOR, KAPPA2, VISCOSITY
from cranktrain.film.steady.bearing import Journal, SteadyBearing, bearing_grid, whirl_threshold

SPEED, C, NOTHING = 200.0, 4e-5, 1e-7


@cache
def machine():
    engine = load_engine("diesel_i6")
    return replace(
        engine,
        main_bearing=replace(engine.main_bearing, diameter=0.08, width=0.04, clearance=C, relief_depth=0.0),
        crankshaft=replace(engine.crankshaft, throw_angles=(0.0,), main_widths=(0.04, 0.04)),
        cylinders=replace(
            engine.cylinders, pins=(1,), bank_angles=(0.0,), firing_order=(1,), piston_mass=NOTHING
        ),
        rod=replace(engine.rod, big_end_mass=NOTHING, small_end_mass=NOTHING, inertia=NOTHING),
        thrust=replace(engine.thrust, main=1),
    )  # fmt: skip


def rotor(mass, load, speed=SPEED, **choices):
    """Simulation on its films, shaft at ``speed`` (rad/s); ``mass`` (kg) and ``load`` (N) for each of both bearings."""
    body = rigid_crank(machine(), mass=2.0 * mass, inertia=(0.3, 0.3, 0.5), centre=(0.0, 0.0, 0.064))
    settings = Settings(crank="rigid", gas_source="input", gravity=load / mass, **choices)
    simulation = Simulation(machine(), body, settings)
    simulation.inputs[0] = speed
    simulation.initialize()
    return simulation


def lift(simulation, height):
    """Raise both journals by a part of the clearance."""
    shape, state = np.vstack([entry.shapes(simulation.model, f"main[{i}]")[1] for i in (1, 2)]), simulation.state
    entry.motion(simulation, state)[0] += np.linalg.pinv(shape) @ np.full(2, height * C)
    simulation.state = state


def growth(simulation, kick, turns=40):
    """Growth of a whirl per turn of the journal, from the velocity ``kick`` over ωc on; and its size at the end."""
    shape, state = np.vstack([entry.shapes(simulation.model, f"main[{i}]")[:2] for i in (1, 2)]), simulation.state
    entry.motion(simulation, state)[1] += np.linalg.pinv(shape) @ np.array([1.0, 0, 1, 0]) * (kick * C * SPEED)
    simulation.state = state
    step = simulation.settings.step
    turn = round(2.0 * math.pi / step)
    start, path = simulation.time, np.empty(turns * turn, dtype=complex)
    for k in range(path.size):
        simulation.step(start + (k + 1) * step / SPEED)
        u = shape @ entry.motion(simulation)[0]
        path[k] = complex(u[0], u[1]) * np.exp(1j * simulation.outputs[0]) / C
    # It beats once in two turns; the strongly damped other motions have died after a third.
    away = np.abs(path - path[-turn * (turns // 2) :].mean())[path.size // 3 :]
    envelope = np.array([part.max() for part in np.array_split(away, 8)])
    return np.polyfit(np.arange(8) * turns / 12.0, np.log(envelope), 1)[0], envelope[-1]


@cache
def critical_mass(load):
    """Mass per bearing at the threshold of the model's own film, from the law's tangents at its equilibrium."""
    simulation = rotor(20.0, load)
    law, out, place = entry.film_parameters(simulation), np.zeros(16), np.array([0.5, 0.4]) * C
    film = MapFilm(*law[[CLEARANCE, FACTOR, CONTACT_HEIGHT, CONTACT_LOAD]].tolist(), impedance_map(law[KAPPA2]))
    for _ in range(100):
        journal_force(*place, 0.0, 0.0, 0.5 * SPEED, film, out)
        move = -np.linalg.solve(out[2:6].reshape(2, 2), out[:2] + np.array([load, 0.0]))
        place = place + move * min(1.0, 0.1 * C / max(np.hypot(*move), 1e-12))
    assert np.abs(out[:2] + np.array([load, 0.0])).max() < 1e-6 * load
    k, c = -out[2:6].reshape(2, 2), -out[6:10].reshape(2, 2)
    return whirl_threshold(k, c, load, C, SPEED)[0] ** 2 * load / (C * SPEED**2)


@pytest.mark.parametrize("load", [300.0, 2500.0])
@pytest.mark.parametrize(
    ("integrator", "step"), [("sdirk4", 2.5), ("sdirk4", 0.5), ("sdirk3", 2.5), ("generalised-alpha", 1.0)]
)
def test_whirl_sets_in_at_the_threshold_of_the_coefficients(integrator, step, load):
    # The default integrator with its default step among them: it neither damps the whirl away nor makes it.
    mass, choices = critical_mass(load), {"integrator": integrator, "step": math.radians(step)}
    below, above = (growth(rotor(f * mass, load, **choices), 2e-3, turns=30)[0] for f in (0.99, 1.01))
    assert below < -2e-3 and above > 2e-3
    # Between them the growth is linear: at the threshold it vanishes to a thirtieth of a per cent of speed.
    assert abs(below + above) < 0.07 * (above - below)


@pytest.mark.parametrize("load", [600.0, 2500.0])
def test_film_solved_in_the_loop_whirls_at_the_threshold_of_the_fine_grid(load):
    # An orbit of some 2 % of the clearance: one far below the grid's own steps would see single nodes rupture, which
    # move the onset by 1.4 % on this coarse grid.
    viscosity = entry.film_parameters(rotor(20.0, load, bearings="reynolds"))[VISCOSITY]
    journal = Journal(diameter=0.08, width=0.04, clearance=C, viscosity=viscosity, speed=SPEED)
    fine = SteadyBearing(bearing_grid("none", n_phi=256, n_z=24)).state(journal, load)
    mass = fine.whirl_threshold**2 * load / (C * SPEED**2)
    below, above = (growth(rotor(f * mass, load, bearings="reynolds"), 2e-2, turns=24)[0] for f in (0.99, 1.01))
    assert below < 0.0 < above


def test_a_whirl_that_grows_ends_in_an_orbit_inside_the_clearance():
    # Far above the threshold: the journal sweeps round at half the speed and the film still carries.
    mass = 4.0 * critical_mass(300.0)
    simulation = rotor(mass, 300.0)
    growth(simulation, 0.05, turns=40)
    name = simulation.output_names.index("bearing[1].eccentricity")
    step, largest = simulation.settings.step / SPEED, 0.0
    start = simulation.time
    for k in range(288):
        simulation.step(start + (k + 1) * step)
        assert np.isfinite(simulation.outputs).all()
        largest = max(largest, simulation.outputs[name])
    assert 0.5 < largest < 1.0


LEVELS = ("impedance", "reynolds")


def watched(simulation, name):
    return simulation.outputs[simulation.output_names.index(f"bearing[1].{name}")]


@pytest.mark.parametrize("level", LEVELS)
def test_a_shaft_that_stands_sinks_by_squeeze_and_lands_on_its_asperities(level):
    # A thin film's damping makes a force of the tolerance over the step.
    simulation = rotor(20.0, 5000.0, speed=0.0, bearings=level, newton_tolerance=1e-10)
    lift(simulation, 0.02)
    for k in range(1, 51):  # until the film carries it again
        simulation.step(k * 1e-4)
    place, time, step = [watched(simulation, "eccentricity")], 5e-3, 1e-3
    for _ in range(180):
        time += step
        simulation.step(time)
        step = min(1.05 * step, 0.5)
        place.append(watched(simulation, "eccentricity"))
        assert np.isfinite(simulation.outputs).all()
        assert watched(simulation, "force.y") == pytest.approx(5000.0, rel=1e-3)
    # It only sinks; a film would let it sink for ever, so that what holds it at last is contact.
    assert (np.diff(place) > -1e-5).all() and place[-1] > place[0] + 1e-3
    assert place[-1] - place[-20] < 1e-5 and 0.95 < place[-1] < 1.0


@pytest.mark.parametrize("level", LEVELS)
def test_a_start_from_speed_0_ends_where_a_start_at_speed_does(level):
    simulation = rotor(20.0, 500.0, speed=0.0, bearings=level)
    for k in range(1, 50):
        simulation.step(k * 1e-3)
    rest = watched(simulation, "eccentricity")
    for k in range(50, 800):
        simulation.inputs[0] = min(100.0, (k - 50) * 0.4)
        simulation.step(k * 1e-3)
        assert np.isfinite(simulation.outputs).all() and watched(simulation, "eccentricity") < 1.02
    running = rotor(20.0, 500.0, speed=100.0, bearings=level)
    for k in range(1, 400):
        running.step(k * 1e-3)
    assert watched(simulation, "eccentricity") == pytest.approx(watched(running, "eccentricity"), rel=2e-3)
    assert watched(simulation, "eccentricity") < rest - 0.1
    # The film has taken over: shear of a filled gap (and half of e × F, below a hundredth of it), no sliding contact.
    eps = watched(simulation, "eccentricity")
    viscosity = entry.film_parameters(simulation)[VISCOSITY]
    shear = 2.0 * math.pi * viscosity * 100.0 * 0.04**4 / C / math.sqrt(1.0 - eps * eps)
    assert abs(watched(simulation, "friction_torque")) == pytest.approx(shear, rel=0.02)


@pytest.mark.parametrize("level", LEVELS)
def test_a_load_that_reverses_crosses_the_clearance_and_comes_back(level):
    simulation = rotor(2.0, 50.0, speed=100.0, bearings=level)
    step = math.radians(2.5) / 100.0
    forces, films = [], []
    for k in range(1, 721):
        # From -1 to +1.8 kN on the pin.
        simulation.inputs[1] = entry.AMBIENT * max(0.0, 1.0 + 2.0 * math.sin(0.1 * math.pi * k))
        simulation.step(k * step)
        forces.append(watched(simulation, "force.y"))
        films.append(watched(simulation, "film_thickness_min"))
        assert np.isfinite(simulation.outputs).all()
    assert min(forces) < -100.0 and max(forces) > 100.0
    assert min(films) > 0.0 and max(films) < C


@pytest.mark.parametrize("level", LEVELS)
def test_overload_lands_on_contact_and_the_film_carries_again(level):
    simulation = rotor(20.0, 500.0, speed=100.0, bearings=level)
    step = math.radians(2.5) / 100.0
    for k in range(1, 61):
        simulation.inputs[1] = entry.AMBIENT + 1.6e7 * math.sin(math.pi * k / 60.0) ** 2  # 139 kN at the most
        simulation.step(k * step)
        assert np.isfinite(simulation.outputs).all()
    deepest = watched(simulation, "eccentricity")
    for k in range(61, 500):
        simulation.inputs[1] = entry.AMBIENT
        simulation.step(k * step)
        deepest = max(deepest, watched(simulation, "eccentricity"))
    assert watched(simulation, "eccentricity") < 0.9
    assert watched(simulation, "force.y") == pytest.approx(500.0, rel=0.05)
