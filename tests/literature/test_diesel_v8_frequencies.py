"""The V8 against the frequencies the reference publishes, through the whole structural chain, and its crankshaft."""

from dataclasses import replace

import numpy as np
import pytest
from published import beside_published
from some import some

from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import load_engine
from cranktrain.engine.parts import LumpedInertia
from cranktrain.results.orders.resonances import peaks
from cranktrain.structure.assembly import assemble
from cranktrain.structure.block.modal import block_report
from cranktrain.structure.block.reduction import reduced_block
from cranktrain.structure.crank.critical_speeds import critical_speeds
from cranktrain.structure.crank.modal import cranktrain_modes, modal_report
from cranktrain.structure.crank.reduction import complete_crankshaft, reduced_crankshaft, running_body, running_loads
from cranktrain.studies.roller_stand_ins import running_rollers
from cranktrain.studies.run_up.run_up import Means, run_up
from cranktrain.studies.run_up.steady import Job

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def engine():
    return load_engine("diesel_v8")


@pytest.fixture(scope="module")
def body(engine):
    return reduced_crankshaft(engine, checked=True)


@pytest.fixture(scope="module")
def report(engine, body):
    return modal_report(engine, body)


def test_cranktrain_torsion_and_critical_speeds_on_ground(engine, body, report):
    assert report["cranktrain"]["first_torsional_hz"] == pytest.approx(296.0, rel=0.03)
    published = np.array(engine.published.critical_speeds) * 30 / np.pi
    assert published == pytest.approx([4440.0, 2220.0, 1480.0])
    found = {entry["order"]: entry["rpm"] for entry in critical_speeds(engine, complete_crankshaft(engine, body))}
    own = [found[order] for order in engine.published.critical_orders]
    np.testing.assert_allclose(own, published, rtol=0.03)


def test_the_published_list_in_the_flexible_block(engine, body):
    in_block = block_report(engine, body, reduced_block(engine))
    found, left = beside_published(engine.published, in_block["modes"])
    for hz, own in found:
        assert own == pytest.approx(hz, rel=0.02)
    assert left == []
    assert in_block["first_torsional_hz"] == pytest.approx(296.0, rel=0.01)


def test_bending_and_axial_motion_on_ground(engine, report):
    """Ground does not move against the crank as the block does, which makes all modes but torsion slower there."""
    found, _ = beside_published(engine.published, report["cranktrain"]["modes"])
    for hz, own in some(found):
        assert own == pytest.approx(hz, rel=0.12)


def test_quality_of_the_reduction(body, report):
    assert report["reduction"]["max_relative_error"] < 5e-3
    assert report["reduction"]["static_stiffness_error"] < 1e-6
    assert report["reduction"]["full_hz"][-1] > 800.0


def test_throws_of_equal_pieces_stand_at_0_90_270_180(engine, body):
    # Their centre of mass lies on the axis, and their unbalances U leave a couple that leans from throw 1 as 3 to 1.
    throw, pitch = engine.crankshaft.throw, np.diff(engine.crankshaft.pin_positions)[0]
    assert np.hypot(*body.centre[:2]) < 1e-4 * throw
    angle = engine.crankshaft.throw_angles[0]
    couple = np.array([-body.inertia[0, 2], -body.inertia[1, 2]])
    along, across = couple @ (-np.sin(angle), np.cos(angle)), couple @ (-np.cos(angle), -np.sin(angle))
    unbalance = -along / (3.0 * pitch)
    # The mesh is round to 1e-3 of what the counterweights balance, some 0.5 kg m.
    assert across == pytest.approx(-unbalance * pitch, abs=1e-3 * 0.5 * pitch)
    # Counterweights take nearly all of each throw's own unbalance, a tenth of what its two rods add.
    rods = 2.0 * engine.rod.big_end_mass * throw
    assert abs(unbalance) < 0.1 * rods


def test_balance_weights_cancel_the_rotating_couple(engine, body):
    # Masses on the pins that turn, and in first order the pistons of a right-angled V, which turn as one mass a pin.
    throw, rod = engine.crankshaft.throw, engine.rod
    turning = 2.0 * rod.big_end_mass + rod.small_end_mass + engine.cylinders.piston_mass
    couple = np.zeros(2)
    for angle, z in zip(engine.crankshaft.throw_angles, engine.crankshaft.pin_positions, strict=True):
        couple += z * turning * throw * np.array([-np.sin(angle), np.cos(angle)])
    complete = complete_crankshaft(engine, body)
    left = couple - complete.inertia[:2, 2]
    # Masses in the file have three digits, and the mesh is nearly round.
    assert np.hypot(*left) < 0.01 * np.hypot(*couple)
    # Nor does a force remain: weights stand against each other.
    assert np.hypot(*complete.centre[:2]) * complete.mass < 1e-3 * turning * throw


def test_parts_are_attached_and_a_clutch_is_a_part_of_the_flywheel(engine, body):
    """Outer rings do not turn with the crank: on the axis they add nothing to its polar inertia."""
    complete = complete_crankshaft(engine, body)
    weights = engine.balance_weights
    parts = engine.flywheel.mass + engine.clutch.mass + engine.pulley.mass + sum(engine.main_roller.ring_mass)
    assert complete.mass - body.mass == pytest.approx(parts + sum(weights.masses))
    polar = sum(mass * r**2 for mass, r in zip(weights.masses, weights.radii, strict=True))
    polar += engine.flywheel.polar_inertia + engine.clutch.polar_inertia + engine.pulley.polar_inertia
    # Outer rings do not turn with the crank: on the axis they add nothing to its polar inertia.
    assert complete.inertia[2, 2] - body.inertia[2, 2] == pytest.approx(polar)
    f, c = engine.flywheel, engine.clutch
    mass = f.mass + c.mass
    offset = (f.mass * f.offset + c.mass * c.offset) / mass
    diametral = f.diametral_inertia + f.mass * (f.offset - offset) ** 2
    diametral += c.diametral_inertia + c.mass * (c.offset - offset) ** 2
    one = LumpedInertia(mass, f.polar_inertia + c.polar_inertia, diametral, offset)
    together = replace(engine, flywheel=one, clutch=None)
    hz = [cranktrain_modes(e, complete_crankshaft(e, body))[0][:20] for e in (engine, together)]
    np.testing.assert_allclose(hz[0], hz[1], rtol=1e-9)


def test_rods_beside_the_middle_of_their_pin_add_their_tilting_inertia(engine, body):
    complete = complete_crankshaft(engine, body)
    beside = cranktrain_modes(engine, complete)[0][:12]
    middle = replace(engine, cylinders=replace(engine.cylinders, rod_offsets=()))
    together = cranktrain_modes(middle, complete)[0][:12]
    # Two equal rods at ±d: the same mass at the middle and m d² each about it, which can only lower frequencies.
    assert np.all(beside <= together * (1.0 + 1e-12))
    assert np.all(beside > together * (1.0 - 5e-3)) and beside[1] < together[1] * (1.0 - 1e-7)


def test_running_body_keeps_low_modes_and_the_statics_of_its_loads(engine, body):
    loads = running_loads(engine)
    assert ("pin[1]", 3) in loads and ("pin[4]", 4) in loads and ("main[5]", 3) in loads
    complete, running = complete_crankshaft(engine, body), running_body(engine, body)
    low = complete.frequencies_hz[6:16]
    np.testing.assert_allclose(running.frequencies_hz[6:16], low, rtol=1e-9)

    def compliance(some):
        rows = np.array([some.shapes[some.index(name), component, 6:] for name, component in loads]) / some.omega[6:]
        return rows @ rows.T

    exact, kept = compliance(complete), compliance(running)
    size = np.sqrt(np.diag(exact))
    np.testing.assert_allclose(kept / np.outer(size, size), exact / np.outer(size, size), atol=1e-7)


@pytest.fixture(scope="module")
def at_2220(engine):
    return running_rollers(engine, 2220.0)


def test_stand_ins_are_those_of_the_rollers_as_they_run(engine, at_2220):
    assert at_2220["periodic"] and at_2220["block"] == "flexible"
    for entry in at_2220["mains"]:
        for key, value in entry["stand_in"].items():
            assert entry["engine_file"][key] == pytest.approx(value, rel=0.02)


@pytest.mark.parametrize(("order", "rpm"), [(8, 2220.0), (12, 1480.0)])
def test_orders_peak_at_the_published_speeds_in_a_run_in_the_block(engine, tmp_path, order, rpm):
    published = dict(zip(engine.published.critical_orders, engine.published.critical_speeds, strict=True))
    assert published[order] == pytest.approx(rpm * np.pi / 30)
    made = assemble(engine, Settings())
    assert made.settings.block == "flexible" and made.settings.bearings == "roller"
    speeds = np.arange(rpm - 60.0, rpm + 61.0, 20.0) * np.pi / 30
    found = run_up(Job(made, None, 1e-4, 24.0, ("pulley.torsion",)), speeds, tmp_path / "run_up.h5", Means(1), {})
    assert np.all(found.run_up.repeats >= 1)
    peak = next(peak for peak in peaks(found.run_up) if peak.order == order)
    assert peak.speed == pytest.approx(published[order], rel=0.01)
