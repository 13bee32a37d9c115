"""Sub-model of a throw: its loads are in balance with what they stand for, its cuts follow, rigid motion is free."""

from dataclasses import replace

import numpy as np
import pytest
from test_crank_stress import ONE_THROW

from cranktrain.core.errors import InputError
from cranktrain.structure.crank.shape import pin_centre, stations
from cranktrain.structure.fem.craig_bampton import rigid_motions
from cranktrain.structure.fem.elasticity import component_dofs, finite_elements
from cranktrain.structure.fem.mesh import crankshaft_mesh
from cranktrain.structure.stress.nodal_stress import von_mises
from cranktrain.structure.stress.sub_model import LOADS, cut_motion, fillet_modes, throw_loads
from cranktrain.structure.stress.throw_mesh import throw_mesh

CRANK = replace(ONE_THROW.crankshaft, mesh_size=0.04)
FINENESS = 0.5
MATERIAL = ONE_THROW.material


@pytest.fixture(scope="module")
def model():
    return finite_elements(throw_mesh(CRANK, 1, FINENESS), MATERIAL)


def about(motions, place):
    """Rigid motions (ndof, 6) with rotations about a place."""
    turned = motions.copy()
    turned[:, 3:] -= motions[:, :3] @ np.cross(np.eye(3), place).T
    return turned


def test_loads_have_their_resultants(model):
    """The pin's whole, half of each main's across and about, and the throw's inertia against a unit acceleration."""
    motions = rigid_motions(model)
    loads = throw_loads(model, CRANK, 1)
    assert loads.shape == (model.basis.N, LOADS)
    pin = np.array(pin_centre(CRANK, 1))
    np.testing.assert_allclose(about(motions, pin).T @ loads[:, :6], np.eye(6), atol=1e-8)
    for first, main in ((6, 0), (12, 1)):
        middle = np.array([0.0, 0.0, 0.5 * sum(stations(CRANK).mains[main])])
        resultant = about(motions, middle).T @ loads[:, first : first + 6]
        # Both halves together are the whole: the diagonal is half of it, but for the moments that halves have alone.
        np.testing.assert_allclose(np.diag(resultant), 0.5, atol=1e-3)
    inertia = -about(motions, pin).T @ loads[:, 18:24]
    np.testing.assert_allclose(inertia, inertia.T, rtol=1e-9, atol=1e-9)
    assert inertia[0, 0] == pytest.approx(model.mass.sum() / 3.0)
    # ∫ρ X_⊥ is what a rotation about z does to a translation.
    first_moment = np.array([1.0, -1.0]) * (motions[:, 5] @ (model.mass @ motions[:, [1, 0]]))
    np.testing.assert_allclose(loads[:, 24] @ motions[:, :2], first_moment, rtol=1e-9)


def test_a_rigid_motion_of_the_crank_leaves_its_fillets_without_stress(model):
    crank = finite_elements(crankshaft_mesh(CRANK, 1), MATERIAL)
    dofs = component_dofs(crank.basis)
    # A stretch along the crank beside the six rigid motions says how large a stress is.
    stretch = np.zeros(crank.basis.N)
    stretch[dofs[2]] = crank.mesh.doflocs[2]
    motions = np.column_stack((rigid_motions(crank), stretch))
    found = fillet_modes(CRANK, MATERIAL, (crank.mesh.doflocs, motions[dofs]), 1, fineness=FINENESS)
    stress = von_mises(found.modes[:7].transpose(1, 0, 2)).max(axis=1)
    assert np.all(stress[:6] < 1e-5 * stress[6])
    assert set(found.features) == {
        "pin[1] front fillet", "pin[1] rear fillet", "main[1] rear fillet", "main[2] front fillet",
    }  # fmt: skip


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
