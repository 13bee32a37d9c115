"""What the running model shows of its bearings: derivatives, balances, and agreement of all lists of names."""

import math
from dataclasses import replace
from pathlib import Path

import entry
import numpy as np
import pytest
from bodies import free_six, rigid_crank
from plain_model import PlainModel
from some import some
from standing import rigid_block
from started import at_speed, series, shown

from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.outputs.register import Counts, output_names
from cranktrain.dynamics.simulation import Parts, Simulation
from cranktrain.engine.parts import AxialPath
from cranktrain.film.table.database import bearing_settings
from cranktrain.fmu.description import expand, read_interface
from cranktrain.results.files import output_unit
from cranktrain.store.film_tables import film_table

SPEED = 2000 * math.pi / 30
ENGINE = free_six()
BODY = rigid_crank(ENGINE)
MAINS = [f"bearing[{i}]" for i in range(1, 8)]
ENDS = [f"big_end[{i}]" for i in range(1, 7)]
DESCRIPTION = Path(__file__).parents[2] / "modelDescription"


def started(table=None, **choices):
    return at_speed(SPEED, ENGINE, BODY, Settings(crank="rigid", **choices), parts=Parts(table=table))


def to_frame(theta):
    """Turns vectors in space into the crank's frame."""
    return np.array([[math.cos(theta), math.sin(theta)], [-math.sin(theta), math.cos(theta)]])


def forces_in_frame(simulation):
    """Forces on all unknowns of a stage in the crank's frame, evaluated anew, and how they turn into space."""
    return entry.forces_at(simulation), to_frame(entry.frame(simulation)[0])


def read(simulation, name):
    return float(simulation.outputs[simulation.output_names.index(name)])


def to_angle(simulation, degrees):
    """Advance to a crank angle by steps of 2.5°."""
    step = math.radians(2.5) / SPEED
    for k in range(round(degrees / 2.5)):
        simulation.step((k + 1) * step)


@pytest.fixture(scope="module")
def table():
    """Coarse table of the main bearings, as other tests have it."""
    return film_table(bearing_settings(ENGINE.main_bearing, "coarse", tilt=True))[0]


def test_names_are_unique_and_the_interface_lists_them_all():
    names = output_names(Counts(7, 6, 4))
    assert len(set(names)) == len(names)
    counts = {"cylinders": 6, "main_bearings": 7, "mounts": 4}
    outputs = expand([v for v in read_interface(DESCRIPTION).variables if v.causality == "output"], counts)
    assert [v.name for v in outputs] == list(names)
    for variable in outputs:
        if variable.type == "Real":
            assert variable.unit == output_unit(variable.name).replace(" ", ".").replace("^", ""), variable.name
        # a name is a value or a group of values, never both: tools show names as a tree
        assert not any(name.startswith(f"{variable.name}.") for name in names)


@pytest.mark.parametrize("choices", [{}, {"bearings": "reynolds"}])
def test_velocities_are_derivatives_of_places_and_gaps(choices):
    """By outputs on both sides of a crank angle, one tiny step apart."""
    simulation = started(**choices)
    to_angle(simulation, 30)
    h = 1e-7
    runs = []
    for _ in range(3):
        runs.append(shown(simulation))
        simulation.step(simulation.time + h)
    before, now, after = runs

    def slope(name):
        return (after[name] - before[name]) / (2 * h)

    for main in MAINS:
        size = max(math.hypot(now[f"{main}.velocity.x"], now[f"{main}.velocity.y"]), 1e-4)
        for axis in "xy":
            assert slope(f"{main}.position.{axis}") == pytest.approx(now[f"{main}.velocity.{axis}"], abs=1e-3 * size)
        tolerance = 5e-3 * size if choices else 1e-3 * size
        assert slope(f"{main}.film_thickness_min") == pytest.approx(now[f"{main}.gap.rate"], abs=tolerance)
        line = [math.atan2(run[f"{main}.position.y"], run[f"{main}.position.x"]) for run in (before, after)]
        turned = math.remainder(line[1] - line[0], 2 * math.pi) / (2 * h)
        e = math.hypot(now[f"{main}.position.x"], now[f"{main}.position.y"])
        assert turned == pytest.approx(now[f"{main}.speed.gap"], abs=1e-3 * size / e)


@pytest.mark.parametrize("choices", [{}, {"bearings": "reynolds"}])
def test_places_speeds_and_films_agree(choices):
    simulation = started(**choices)
    to_angle(simulation, 30)
    bearing, run = ENGINE.main_bearing, shown(simulation)
    for main in MAINS:
        place, angle, now = (
            [run[f"{main}.position.{axis}"] for axis in "xy"],
            run[f"{main}.gap.angle"],
            f"{main}.speed.",
        )
        e, c = math.hypot(*place), bearing.clearance
        assert run[f"{main}.eccentricity"] == pytest.approx(e / c, rel=1e-12)
        # An end is displaced by at least e, at most by e and all of its tilt.
        tilted = 0.5 * bearing.width * run[f"{main}.tilt"] if choices else 0.0
        assert c - e - tilted - 1e-15 <= run[f"{main}.film_thickness_min"] <= c - e + 1e-15
        # The shell is relieved over the outer half of its width: the gap is least there, not always at the end.
        side = abs(run[f"{main}.gap.side"])
        assert 1.0 - bearing.relief_share <= side <= 1.0 if choices else side == 0.0
        assert run[f"{now}relative"] == pytest.approx(run["crank.speed"], rel=0.02)
        assert run[f"{now}effective"] == pytest.approx(run[f"{now}relative"] - 2 * run[f"{now}gap"], rel=1e-12)
        if not choices:
            assert math.cos(angle - math.atan2(*place[::-1])) == pytest.approx(1.0, abs=1e-12)
            assert run[f"{main}.moment.x"] == run[f"{main}.moment.y"] == 0.0


def test_moments_do_the_work_of_the_tilting_forces():
    """For every mode: moment times the mode's rotation of the journal equals port force times the port's motion."""
    simulation = started(bearings="reynolds")
    to_angle(simulation, 30)
    forces, turn = forces_in_frame(simulation)
    largest = 0.0
    for i, main in enumerate(MAINS):
        moment = turn @ [read(simulation, f"{main}.moment.x"), read(simulation, f"{main}.moment.y")]
        journal = f"main[{i + 1}]"
        by_moment = moment @ BODY.shapes[BODY.index(journal), 3:5]
        ends, shapes = (what(simulation.model, journal)[2:] for what in (entry.components, entry.shapes))
        assert by_moment == pytest.approx(forces[ends] @ shapes, rel=1e-9, abs=1e-12)
        largest = max(largest, np.hypot(*moment))
    assert largest > 0.1


def test_load_of_rigid_big_ends_is_that_of_the_plain_model():
    simulation = started()
    to_angle(simulation, 30)
    plain = PlainModel(ENGINE, BODY, Settings(crank="rigid"), SPEED)
    q, v, a = entry.motion(simulation)
    theta, omega, omega_dot = entry.frame(simulation)
    motion = np.einsum("pcn,n->pc", plain.pins, a)
    force, _, _ = plain.rods(theta, omega, omega_dot, q, v, motion, plain.pressures(theta, q))
    turn = to_frame(theta).T
    for c, end in enumerate(ENDS):
        ours = [read(simulation, f"{end}.force.x"), read(simulation, f"{end}.force.y")]
        # the trace is splined once here and once there
        assert ours == pytest.approx(turn @ force[c], rel=1e-6, abs=1e-4 * np.abs(force).max()), end
        for name in ("eccentricity", "film_thickness_min", "pressure_max", "friction_torque", "oil_flow"):
            assert read(simulation, f"{end}.{name}") == 0.0


def test_films_of_floating_big_ends():
    """Their forces are those on the pins, and stay within what the rods' loads differ by from rigid big ends."""
    free, rigid = started(big_ends="impedance"), started()
    to_angle(free, 30)
    to_angle(rigid, 30)
    forces, turn = forces_in_frame(free)
    bearing, ours, stiff = ENGINE.big_end_bearing, shown(free), shown(rigid)
    peak = max(abs(stiff[f"{end}.force.y"]) for end in ENDS)
    for c, end in enumerate(ENDS):
        pin = entry.components(free.model, f"pin[{c + 1}]")[:2]
        force, place = (np.array([ours[f"{end}.{what}.{axis}"] for axis in "xy"]) for what in ("force", "position"))
        assert force == pytest.approx(turn.T @ forces[pin], rel=1e-9)
        assert force == pytest.approx([stiff[f"{end}.force.{axis}"] for axis in "xy"], abs=0.05 * peak)
        eps = ours[f"{end}.eccentricity"]
        assert eps == pytest.approx(np.hypot(*place) / bearing.clearance, rel=1e-12)
        assert ours[f"{end}.film_thickness_min"] == pytest.approx(bearing.clearance * (1.0 - eps), rel=1e-12)
        # The film pushes the pin back towards the middle, and has its largest pressure there.
        assert force @ place < 0.0
        mean = np.hypot(*force) / (bearing.diameter * bearing.width)
        assert mean < ours[f"{end}.pressure_max"] < 30.0 * mean
        # The pin turns in the rod, at about the crank's speed: friction brakes it.
        assert ours[f"{end}.oil_flow"] > 0.0 and ours[f"{end}.friction_torque"] > 0.0


def test_films_outside_the_table_are_counted_and_survive_in_the_state(table):
    # Oil so hot that journals run beyond the table's largest eccentricity.
    simulation = started(table, bearings="table", oil_temperature=440.0)
    counts = []
    for k in range(24):
        simulation.step((k + 1) * math.radians(2.5) / SPEED)
        counts.append(read(simulation, "solver.online_films"))
        asked = 7 * read(simulation, "solver.iterations")
        assert 0 <= counts[-1] <= asked and counts[-1] == int(counts[-1])
    assert max(counts) > 0
    kept, before = simulation.state, simulation.outputs.copy()
    simulation.step(25 * math.radians(2.5) / SPEED)
    simulation.state = kept
    assert np.array_equal(simulation.outputs, before)
    # The films of a step do not depend on what was shown in between.
    simulation.step(25 * math.radians(2.5) / SPEED)
    again = read(simulation, "solver.online_films")
    for _ in range(3):
        simulation.state = kept
    simulation.step(25 * math.radians(2.5) / SPEED)
    assert read(simulation, "solver.online_films") == again
    films = started(bearings="reynolds")
    to_angle(films, 5)
    assert read(films, "solver.online_films") == 0.0


@pytest.fixture(scope="module")
def standing():
    """Run of a whole engine from rest on its mounts, with every output of every level."""
    settings = Settings(crank="rigid", block="flexible", damper="fitted", big_ends="impedance", step=math.radians(0.5))
    path = AxialPath(joint="bolted", mass=15.0, stiffness=1.4e8, damping=5e3, joint_stiffness=2e8)
    engine = replace(ENGINE, axial_path=path)
    simulation = at_speed(SPEED, engine, BODY, settings, parts=Parts(block=rigid_block(engine, BODY)))
    return series(simulation, math.radians(0.5) / SPEED, 299)


@pytest.mark.parametrize("first", ["torque.indicated", "torque.friction", "torque.brake", "solver.substeps"])
def test_outputs_on_demand_are_those_of_a_run_that_shows_all(first):
    """Whichever is read first, and after steps before which nobody had asked for it; to the bit."""
    full = started()
    lazy = Simulation(ENGINE, BODY, Settings(crank="rigid"))
    lazy.on_demand, lazy.inputs[0] = True, SPEED
    lazy.initialize()
    for simulation in (full, lazy):
        to_angle(simulation, 30.0)
    place = lazy.output_names.index(first)
    unread = lazy.output_names.index("bearing[1].force.y")
    assert lazy.read([place]) == [full.outputs[place]]
    if first == "torque.indicated":
        assert lazy.outputs[unread] != full.outputs[unread]
    for simulation in (full, lazy):
        simulation.step(math.radians(32.5) / SPEED)
    assert lazy.read([place]) == [full.outputs[place]]
    everything = range(len(lazy.output_names))
    assert lazy.read(everything) == full.outputs.tolist()


def test_no_level_leaves_an_output_out(standing):
    """What a level has is not 0; what depends on films with pressure maps is shown by the impedance film too."""
    # A rigid crank keeps its length; the irregularity is that of a full cycle, which this run has not had; gas.work is
    # that of pressures which a partner gives.
    silent = {"irregularity", "work", "moment.x", "moment.y", "side", "online_films", "substeps", "limited", "crank"}
    for name, values in some(standing.items()):
        assert np.isfinite(values).all(), name
        if name.rsplit(".", 1)[-1] not in silent and not name.endswith(("moment.x", "moment.y")):
            assert np.abs(values).max() > 0.0, name


def test_the_covers_acceleration_is_that_of_its_motion():
    block, h = rigid_block(ENGINE, BODY), math.radians(0.5) / SPEED
    settings = Settings(crank="rigid", bearings="linear", block="flexible", step=h * SPEED, newton_tolerance=1e-11)
    out = series(at_speed(SPEED, ENGINE, BODY, settings, parts=Parts(block=block)), h, 299)
    cover = block.positions[block.index("cover")]
    # Rigid: the cover goes with the block's centre and its rotations.
    rise = out["engine.position.y"] + (cover[0] - block.centre[0]) * out["engine.rotation.z"]
    rise = rise - (cover[2] - block.centre[2]) * out["engine.rotation.x"]
    second = (-rise[4:] + 16 * rise[3:-1] - 30 * rise[2:-2] + 16 * rise[1:-3] - rise[:-4]) / (12 * h * h)
    shown = out["cover.acceleration"][2:-2]
    # 1e-4 m differenced twice over 4e-5 s is rounded at 1e-11 m/s²; a step's own error is larger.
    assert shown == pytest.approx(second, abs=1e-3 * np.abs(shown).max())


def test_mounts_share_the_weight_of_the_engine_at_rest():
    block = rigid_block(ENGINE, BODY)
    settings = Settings(crank="rigid", bearings="linear", block="flexible", gas_source="input")
    simulation = at_speed(0.0, ENGINE, BODY, settings, parts=Parts(block=block))
    rod = ENGINE.rod
    rods = 6 * (rod.big_end_mass + rod.small_end_mass + ENGINE.cylinders.piston_mass)
    weight = 9.80665 * (block.mass + BODY.mass + rods)
    series(simulation, 0.005, 399)
    shares = np.array([[read(simulation, f"mount[{i}].force.{axis}") for axis in "xyz"] for i in range(1, 5)])
    assert shares.sum(axis=0) == pytest.approx([0.0, weight, 0.0], abs=2e-4 * weight)
    # Moments about the axes of the whole weight.
    moment = sum(np.cross(place, f) for place, f in zip(ENGINE.mounts.positions, shares, strict=True))
    moment += [sum(read(simulation, f"mount[{i}].moment.{axis}") for i in range(1, 5)) for axis in "xyz"]
    pins = BODY.positions[[BODY.index(f"pin[{i}]") for i in range(1, 7)], 2].mean()
    z = block.mass * block.centre[2] + BODY.mass * BODY.centre[2] + rods * pins
    assert moment[0] == pytest.approx(-9.80665 * z, rel=1e-3)
    assert moment[2] == pytest.approx(9.80665 * block.mass * block.centre[0], abs=1e-3 * weight)
    # The engine hangs where it does at rest: that is where its motion is counted from.
    for axis in "xyz":
        assert abs(read(simulation, f"engine.position.{axis}")) < 2e-5
