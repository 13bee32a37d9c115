"""Gas follows the crank: one physics in every frame, and no spring of the gas on the drive line."""

import math

import entry
import numpy as np
import pytest
from bodies import rigid_crank
from started import at_speed

from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.model.state import LEAD_ANGLE
from cranktrain.dynamics.simulation import Settings, simulate
from cranktrain.engine.file import load_engine
from cranktrain.loads.cylinder_volume import cylinder_volume
from cranktrain.loads.drive_line import RECENTRING_REVOLUTIONS

SPEED = 2000 * math.pi / 30
SHIFT = 0.003  # rad: what the drive line winds up by


def started(**changes):
    """A rigid crank on its axis at 2000 rev/min."""
    engine = load_engine("diesel_i6")
    settings = Settings(crank="torsional", bearings="held", step=math.radians(2.0), newton_tolerance=1e-11, **changes)
    return at_speed(SPEED, engine, rigid_crank(engine), settings)


def moved(simulation, row, amount):
    """Turn the crank, or its speed, by ``amount`` rad or rad/s in its frame."""
    state = simulation.state
    entry.motion(simulation, state)[row, 5] += amount / unit_of(simulation)
    simulation.state = state


def unit_of(simulation):
    """Rotation of the crank by its rigid mode of rotation, rad."""
    return simulation.body.shapes[simulation.body.index("flywheel"), 5, 5]


def series(simulation, cycles, *names):
    """Outputs over cycles, (names, samples)."""
    h = communication_step(SPEED, simulation.settings.step)
    rows = np.empty((cycles * round(4 * math.pi / SPEED / h), simulation.outputs.size))
    assert simulation.series(h, 1, rows) == len(rows)
    return rows[:, [simulation.output_names.index(name) for name in names]].T, h


@pytest.mark.parametrize("kind", ["builtin", "input"])
def test_two_frames_are_one_physics(kind):
    """The same crank counted from a frame that leads by 3 mrad more: same gas, same angle, same torque in the shaft."""
    plain, shifted = started(gas_source=kind), started(gas_source=kind)
    moved(shifted, entry.PLACE, -SHIFT)
    # The frame is drawn back to the crank: that acceleration is not the crank's.
    inverse = SPEED / (2.0 * math.pi * RECENTRING_REVOLUTIONS)
    moved(shifted, entry.ACCELERATION, 4.0 * inverse**2 * SHIFT)
    state = shifted.state
    state[LEAD_ANGLE] += SHIFT
    shifted.state = state
    names = ("crank.angle", "shaft.torque", "cylinder[3].volume", "big_end[2].force.y", "piston[1].side_force")
    (ours, h), (theirs, _) = series(plain, 1, *names), series(shifted, 1, *names)
    assert h < 2e-4
    for angle in (ours[0], theirs[0]):
        angle -= SPEED * h * np.arange(1, angle.size + 1)
    for mine, other in zip(ours, theirs, strict=True):
        assert np.abs(mine - other).max() < 2e-6 * np.ptp(mine)


def test_the_gas_is_no_spring_of_the_drive_line():
    """A small free oscillation has the frequency √(k/J) of shaft and crank; with gas phased to the frame 10 % less."""
    plain, struck = started(), started()
    moved(struck, entry.VELOCITY, 0.05)
    (angle, h), (other, _) = series(plain, 8, "crank.angle"), series(struck, 8, "crank.angle")
    swing = (other - angle)[0]
    start, line = entry.rigid_start(plain.model, SPEED), plain.engine.drive_line
    k, c = line.stiffness, line.damping
    expected = math.sqrt(k / start.inertia - (0.5 * c / start.inertia) ** 2)
    crossings = np.flatnonzero(swing[:-1] * swing[1:] < 0.0)
    exact = crossings + swing[crossings] / (swing[crossings] - swing[crossings + 1])
    found = math.pi / (h * np.diff(exact).mean())
    assert found == pytest.approx(expected, rel=0.01)


def test_the_start_takes_crank_and_rods_at_their_mean_inertia():
    """Pistons go along their cylinders by dy/dθ = V′/A: the mean of its square counts, about half the throw's."""
    engine = load_engine("diesel_i6")
    run = started()
    angles = np.linspace(0.0, 4.0 * math.pi, 720, endpoint=False)
    travel = cylinder_volume(engine, angles)[1] / (0.25 * math.pi * engine.cylinders.bore**2)
    oscillating = engine.cylinders.piston_mass + engine.rod.small_end_mass
    rods = 6 * (engine.rod.big_end_mass * engine.crankshaft.throw**2 + oscillating * float(np.mean(travel**2)))
    found = entry.rigid_start(run.model, SPEED).inertia - 1.0 / unit_of(run) ** 2
    assert found == pytest.approx(rods, rel=0.02)


def test_cycles_repeat_to_rounding():
    """What the Newton iteration remembers from stage to stage must not keep a period of its own."""
    engine = load_engine("diesel_v8")
    run = simulate(engine, rigid_crank(engine), Settings(crank="rigid"), 1800 * math.pi / 30, 24)
    torsion = run.outputs["pulley.torsion"]
    last, before = torsion[-run.per_cycle :], torsion[-2 * run.per_cycle : -run.per_cycle]
    assert np.abs(last - before).max() < 1e-10 * np.ptp(last)
