"""Sub-model of a throw: its loads are in balance with what they stand for, its cuts follow, rigid motion is free."""

from dataclasses import replace

import numpy as np
import pytest
from test_crank_stress import ONE_THROW

from cranktrain.core.errors import InputError
from cranktrain.results.strength.fatigue import haigh_judgement
from cranktrain.results.strength.fillet_histories import FilletRun, fatigue_name
from cranktrain.structure.crank.shape import pin_centre, stations
from cranktrain.structure.fem.craig_bampton import rigid_motions
from cranktrain.structure.fem.elasticity import component_dofs, finite_elements
from cranktrain.structure.fem.mesh import crankshaft_mesh
from cranktrain.structure.stress.nodal_stress import von_mises
from cranktrain.structure.stress.sub_model import CUTS, LOADS, FilletModes, cut_motion, fillet_modes, throw_loads
from cranktrain.structure.stress.throw_mesh import throw_mesh, throw_places

CRANK = replace(ONE_THROW.crankshaft, mesh_size=0.04)
FINENESS = 0.5
MATERIAL = ONE_THROW.material
PLACE = "pin[1] front fillet"
STRENGTH = ONE_THROW.crank_strength


@pytest.fixture(scope="module")
def model():
    return finite_elements(throw_mesh(CRANK, 1, PLACE, FINENESS), MATERIAL)


@pytest.fixture(scope="module")
def fillet():
    """A fillet's sub-model whose crank moves by its six rigid motions, then stretches along its axis."""
    crank = finite_elements(crankshaft_mesh(CRANK, 1), MATERIAL)
    dofs = component_dofs(crank.basis)
    # The stretch says how large a stress is.
    stretch = np.zeros(crank.basis.N)
    stretch[dofs[2]] = crank.mesh.doflocs[2]
    motions = np.column_stack((rigid_motions(crank), stretch))
    return fillet_modes(CRANK, MATERIAL, (crank.mesh.doflocs, motions[dofs]), 1, PLACE, fineness=FINENESS)


def about(motions, place):
    """Rigid motions (ndof, 6) with rotations about a place."""
    turned = motions.copy()
    turned[:, 3:] -= motions[:, :3] @ np.cross(np.eye(3), place).T
    return turned


def test_loads_have_their_resultants(model):
    """The pin's whole, half of each main's across and about, and the throw's inertia against a unit acceleration."""
    motions = rigid_motions(model)
    loads, halves = throw_loads(model, CRANK, 1)
    assert loads.shape == (model.basis.N, LOADS)
    pin = np.array(pin_centre(CRANK, 1))
    np.testing.assert_allclose(about(motions, pin).T @ loads[:, :6], np.eye(6), atol=1e-8)
    for first, main in ((6, 0), (12, 1)):
        middle = np.array([0.0, 0.0, 0.5 * sum(stations(CRANK).mains[main])])
        resultant = about(motions, middle).T @ loads[:, first : first + 6]
        # Both halves together are the whole: the diagonal is half of it, but for the moments that halves have alone.
        np.testing.assert_allclose(np.diag(resultant), 0.5, atol=1e-3)
        own = slice(6 * main, 6 * main + 6)
        np.testing.assert_allclose(halves[own, own], resultant.T, atol=1e-9)
    inertia = -about(motions, pin).T @ loads[:, 18:24]
    np.testing.assert_allclose(inertia, inertia.T, rtol=1e-9, atol=1e-9)
    assert inertia[0, 0] == pytest.approx(model.mass.sum() / 3.0)
    # ∫ρ X_⊥ is what a rotation about z does to a translation.
    first_moment = np.array([1.0, -1.0]) * (motions[:, 5] @ (model.mass @ motions[:, [1, 0]]))
    np.testing.assert_allclose(loads[:, 24] @ motions[:, :2], first_moment, rtol=1e-9)


def test_a_rigid_motion_of_the_crank_leaves_its_fillets_without_stress(fillet):
    stress = von_mises(fillet.modes.transpose(1, 0, 2)).max(axis=1)
    assert np.all(stress[:6] < 1e-5 * stress[6])
    assert np.abs(fillet.beyond[:6, :3]).max() < 1e-5 * np.abs(fillet.beyond[6]).max()
    assert fillet.name == PLACE and len(fillet.points) > 20


def test_what_lies_beyond_the_cuts_balances_loads_and_inertia(fillet):
    """With the other halves of the mains added, a load on a main is held as a whole; so is a rod's."""
    front, rear = (0.5 * sum(span) for span in stations(CRANK).mains)
    about_origin = np.zeros((CUTS, 6))
    for first, z in ((0, front), (6, rear)):
        about_origin[first : first + 6] = np.eye(6)
        about_origin[first, 4], about_origin[first + 1, 3] = z, -z
    held = fillet.beyond @ about_origin
    x, y, z = pin_centre(CRANK, 1)
    fx, fy, fz = [1, 0, 0, 0, z, -y], [0, 1, 0, -z, 0, x], [0, 0, 1, y, -x, 0]
    np.testing.assert_allclose(held[7:10], -np.array([fx, fy, fz], dtype=float), atol=1e-6)
    np.testing.assert_allclose(held[13:25], 0.0, atol=1e-6)
    assert np.abs(held[-CUTS:]).max() < 1e-6 * np.abs(fillet.beyond[-CUTS:]).max()


def test_by_resultants_the_cuts_carry_them(fillet):
    """Any wrenches in balance with the drive are met, and a motion as a whole changes nothing."""
    rng = np.random.default_rng(3)
    drive = np.zeros((1, len(fillet.beyond) - CUTS))
    drive[0, 7:13] = rng.standard_normal(6) * 1e4
    found = rng.standard_normal((1, CUTS)) * 1e-6
    wrench = drive @ fillet.beyond[:-CUTS] + found @ fillet.beyond[-CUTS:]
    moved = fillet.by_resultants(drive, wrench)
    carried = drive @ fillet.beyond[:-CUTS] + moved @ fillet.beyond[-CUTS:]
    np.testing.assert_allclose(carried, wrench, atol=1e-6 * np.abs(wrench).max())
    stress = [np.tensordot(s, fillet.modes[-CUTS:].astype(float), axes=1) for s in (found, moved)]
    assert np.abs(stress[1] - stress[0]).max() < 1e-4 * np.abs(stress[0]).max()


def test_a_throw_has_four_fillets_and_the_bore_of_its_pin():
    named = [fatigue_name(name) for pin in (1, 6) for name in throw_places(ONE_THROW.crankshaft, pin)]
    assert named == [
        "web[1].main", "web[1].pin", "web[2].pin", "web[2].main", "pin[1].oil_bore",
        "web[11].main", "web[11].pin", "web[12].pin", "web[12].main", "pin[6].oil_bore",
    ]  # fmt: skip


def test_fatigue_looks_where_the_range_is_greatest_too():
    """A place that is pulled steadily has the peak, one that is pulled to and fro the damage."""
    wave = np.sin(np.linspace(0.0, 2.0 * np.pi, 72, endpoint=False))
    modes = np.zeros((2, 6, 12), dtype=np.float32)
    modes[0, 0] = 1e6
    modes[0, 0, :2], modes[1, 0, 1] = (300e6, 0.0), 250e6  # the first place steady, the second alternating
    drive = np.column_stack((np.ones(wave.size), wave))
    fine = FilletModes(PLACE, 1, modes, np.zeros((2, CUTS)), np.zeros((12, 3)))
    run = FilletRun(fine, np.zeros(wave.size), drive, drive)
    assert run.peak.von_mises == pytest.approx(300e6)
    histories = run.histories(CRANK)
    worst = min((haigh_judgement(one, STRENGTH) for one in histories), key=lambda one: one.safety_factor)
    assert worst.name == "web[1].pin"
    assert (worst.amplitude, worst.mean) == pytest.approx((250e6, 0.0), abs=1e3)


def test_cuts_follow_a_cubic_field_to_the_digit(model):
    """What the crank's nodes near a cut move by as a cubic of their place, the nodes on it do."""
    places = np.random.default_rng(2).uniform(-0.045, 0.045, (3, 4000))
    z = [0.5 * sum(span) for span in stations(CRANK).mains]
    places[2] = np.repeat(z, 2000) + 0.3 * places[2]

    def field(x):
        return np.stack((x[0] ** 3, x[1] * x[2] ** 2, x[0] * x[1] * x[2] + x[2]))[:, :, None]

    nodes, moved = cut_motion(model.mesh, CRANK, 1, (places, field(places)))
    np.testing.assert_allclose(moved, field(model.mesh.doflocs[:, nodes]), atol=1e-12)
    assert set(np.round(model.mesh.doflocs[2, nodes], 9)) == set(np.round(z, 9))


def test_a_mesh_without_nodes_near_a_cut_is_refused(model):
    few = np.random.default_rng(1).standard_normal((3, 10))
    with pytest.raises(InputError, match="smaller mesh_size"):
        cut_motion(model.mesh, CRANK, 1, (few, np.zeros((3, 10, 1))))
