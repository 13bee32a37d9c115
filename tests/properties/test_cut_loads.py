"""Loads in the crank: closed forms of one throw, balance of a run, and the torque that a shaft's springs carry."""

from dataclasses import replace

import numpy as np
import pytest
from bodies import free_six
from some import some

from cranktrain.core.reduced_body import rigid
from cranktrain.dynamics.settled.judging import Settling
from cranktrain.dynamics.simulation import Settings, Simulation, fitted_engine
from cranktrain.engine.file import load_engine
from cranktrain.results.strength import cut_loads as cuts
from cranktrain.results.strength.recorded_cycle import RecordedCycle, recorded_cycle
from cranktrain.results.strength.throw_loads import single_throws, supported, throw_axes, whole_crank
from cranktrain.structure.assembly import assemble
from cranktrain.structure.crank.reduction import complete_crankshaft
from cranktrain.structure.crank.torsional import rigid_crank, shaft_nodes

SIX = free_six()
TIGHT = 1e-11  # Newton's tolerance: what a run solves its equations to is what they are off balance


def recorded(engine, settings, speed, settle=0.5):
    made = assemble(engine, settings, inherit=False)
    simulation = Simulation(engine, made.body, made.settings, None, made.parts)
    simulation.inputs[0] = speed
    return recorded_cycle(simulation, fitted_engine(engine, made.settings), settle)


@pytest.fixture(scope="module")
def beam():
    """The six on films at 2000 rev/min, its clutch disengaged; whether it has settled matters to no balance."""
    settings = Settings(crank="beam", newton_tolerance=TIGHT, axial_force=-2500.0)
    return recorded(load_engine("diesel_i6"), settings, 209.4)


def point_load(place, force):
    return cuts.PointLoads(np.array([place[2]]), np.array([[place]]), np.array([[force]]), np.zeros((1, 1, 3)))


@pytest.mark.parametrize("share", [0.5, 0.2])
def test_a_throw_on_simple_supports(share):
    """A rod's force F at a of the span L: L (1 − a) a F under it, F (1 − a) and F a at the supports."""
    c = SIX.crankshaft
    radial, across = throw_axes(c, 2)
    front, rear = c.main_positions[1], c.main_positions[2]
    z = front + share * (rear - front)
    pressed = point_load(c.throw * radial + z * cuts.AXIS, -1000.0 * radial + 400.0 * across)
    loads = supported(pressed, front, rear)
    force, moment = loads.cut(z, z * cuts.AXIS)
    assert np.allclose(loads.resultant(np.ones(3, dtype=bool), np.zeros(3))[0], 0.0, atol=1e-9)
    assert force[0] @ radial == pytest.approx(1000.0 * (1.0 - share))
    assert -moment[0] @ across == pytest.approx(1000.0 * share * (1.0 - share) * (rear - front))
    assert moment[0] @ radial == pytest.approx(-400.0 * share * (1.0 - share) * (rear - front))


def test_webs_and_pin_of_a_throw_pressed_together():
    """P on the middle of a pin: P/2 in each web, P a/2 in its middle, P L/4 in the pin; both webs alike."""
    c = SIX.crankshaft
    pin, force = 3, 1000.0
    radial, across = throw_axes(c, pin)
    z = c.pin_positions[pin - 1]
    webs, pins = single_throws(c, point_load(c.throw * radial + z * cuts.AXIS, -force * radial + 300.0 * across))
    front, rear = webs[2 * pin - 2 : 2 * pin]
    span = c.main_positions[pin] - c.main_positions[pin - 1]
    arm = 0.5 * (span - c.pin_width - c.web_thickness)
    for web in (front, rear):
        assert web.bending[0] == pytest.approx(0.5 * force * arm)
        assert web.radial[0] == pytest.approx(0.5 * force)
    assert pins[pin - 1].bending[0] == pytest.approx(0.25 * force * span)
    # The torque 300 r is held behind the throw: none in front of it, all of it behind, half of it about the pin.
    assert front.journal_torque[0] == pytest.approx(0.0, abs=1e-9)
    assert rear.journal_torque[0] == pytest.approx(300.0 * c.throw)
    assert front.pin_torque[0] == pytest.approx(150.0 * c.throw)
    assert rear.pin_torque[0] == pytest.approx(150.0 * c.throw)
    others = [web for web in webs if web not in (front, rear)]
    assert all(abs(web.bending[0]) < 1e-9 for web in others)


def test_a_run_balances(beam):
    """The reduced body's inertia and all that acts on it are each other's opposites, to 1e-6 of the peak in it."""
    loads = cuts.crank_loads(beam)
    found = [loads.cut(z, z * cuts.AXIS) for z in np.linspace(loads.z.min(), loads.z.max(), 60)]
    force, moment = (max(np.abs(cut[k]).max() for cut in found) for k in range(2))
    missed = np.abs(cuts.imbalance(beam)).max(axis=0)
    assert missed[:3].max() < 1e-6 * force
    assert missed[3:].max() < 1e-6 * moment
    assert cuts.unbalanced_share(beam) < 1e-6
    for left, whole in zip(loads.cut(np.inf, np.zeros(3)), (loads.forces, loads.moments), strict=True):
        assert np.abs(left).max() < 1e-9 * np.abs(whole).max()  # at the free end


def test_pieces_lack_little_of_the_elastic_body(beam):
    """Their inertia is the body's within a hundredth of the largest load."""
    found = cuts.mass_loads(beam, cuts.crank_masses(beam.engine))
    force, moment = found.resultant(np.ones(found.z.size, dtype=bool), np.zeros(3))
    lacking = np.abs(cuts.body_inertia(beam) - np.concatenate([force, moment], axis=1)).max(axis=0)
    assert lacking[:3].max() < 0.01 * np.abs(cuts.interface_loads(beam).forces).max()
    assert lacking[5] < 0.01 * max(np.abs(web.journal_torque).max() for web in whole_crank(SIX.crankshaft, found)[0])


@pytest.mark.parametrize("name", ["diesel_i6", "diesel_v8"])
def test_pieces_of_a_rigid_crank_are_that_body(name):
    """Any small motion of a rigid crank, turning unevenly: inertia and weight piece by piece are the whole's."""
    engine = load_engine(name)
    body = rigid(complete_crankshaft(engine, rigid_crank(engine)))
    draw = np.random.default_rng(1)
    tiny = 1e-8  # linear in the motion: its squares vanish
    cycle = RecordedCycle(
        engine, body, True, 9.81, draw.uniform(0.0, 6.0, 5), draw.uniform(100.0, 200.0, 5),
        draw.uniform(-50.0, 50.0, 5), *(tiny * scale * draw.standard_normal((5, 6)) for scale in (1.0, 1e3, 1e6)),
        np.zeros(6), {}, Settling(0, 0, 1e-3),
    )  # fmt: skip
    found = cuts.mass_loads(cycle, cuts.crank_masses(engine))
    force, moment = found.resultant(np.ones(found.z.size, dtype=bool), np.zeros(3))
    whole = cuts.body_inertia(cycle)
    assert force == pytest.approx(whole[:, :3], abs=1e-6 * np.abs(whole[:, :3]).max())
    assert moment == pytest.approx(whole[:, 3:], abs=1e-6 * np.abs(whole[:, 3:]).max())


def test_torque_is_what_the_shaft_carries():
    """Torque of cuts, averaged over the span of each spring of a torsional crank, is stiffness times twist."""
    reduction = replace(SIX.reduction, torsional_source="ker-wilson", running_cutoff_hz=1e5)
    engine = replace(SIX, damping=replace(SIX.damping, ratio=1e-6), reduction=reduction)
    cycle = recorded(engine, Settings(crank="torsional", newton_tolerance=TIGHT), 240.0)
    loads, names = cuts.crank_loads(cycle), shaft_nodes(engine)
    z = [cycle.body.positions[cycle.body.index(name), 2] for name in names]
    about_axis = (loads.moments + np.cross(loads.places, loads.forces))[..., 2]
    for i, stiffness in some(enumerate(cycle.body.records["shaft_stiffness"])):
        twist = cycle.motion(names[i + 1])[:, 5] - cycle.motion(names[i])[:, 5]
        # A load at z is in front of the share of the span that lies behind it.
        share = np.clip((z[i + 1] - loads.z) / (z[i + 1] - z[i]), 0.0, 1.0)
        torque = about_axis @ share
        assert -stiffness * twist == pytest.approx(torque, abs=3e-3 * np.abs(torque).max())
