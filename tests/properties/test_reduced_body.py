"""Rigid parts on a reduced body, truncation with residual modes, and what a reduced body refuses."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from solids import STEEL, block

from cranktrain.core.errors import InputError, StoreError
from cranktrain.core.reduced_body import attach, check, rigid, rigid_coordinates, truncate
from cranktrain.structure.fem.craig_bampton import craig_bampton
from cranktrain.structure.fem.elasticity import finite_elements
from cranktrain.structure.fem.interfaces import averaged_interfaces

INERTIA = np.array([[0.05, 0.004, -0.003], [0.004, 0.06, 0.002], [-0.003, 0.002, 0.04]])
OFFSET = np.array([0.02, -0.03, 0.04])
MASS = 3.0


@cache
def beam():
    mesh = block((0.05, 0.04, 0.5), (1, 1, 8), origin=(0.01, 0.0, 0.1))
    z = mesh.p[2]
    mesh = mesh.with_boundaries({"front": lambda p: p[2] < z.min() + 1e-6, "back": lambda p: p[2] > z.max() - 1e-6})
    model = finite_elements(mesh, STEEL)
    return craig_bampton(model, averaged_interfaces(model), fixed_modes=20).body


@cache
def heavier():
    return attach(beam(), "back", MASS, INERTIA, OFFSET)


def raw(body, name):
    """A matrix of the six rigid motions t_x … r_z through the origin."""
    to_rigid = np.linalg.inv(rigid_coordinates(body))
    return to_rigid.T @ getattr(body, name)[:6, :6] @ to_rigid


def test_damping_by_mass_stays_so_in_any_modes_and_one_ratio_whatever_is_attached():
    """c = α of every mode is α M: the residual modes of a shorter body, orthonormal among the dropped, have it too."""
    damped = replace(beam(), damping=np.full(beam().n_modes, 30.0))
    short = truncate(damped, 2000.0, [("front", 0), ("back", 1)])
    assert short.n_modes < damped.n_modes
    np.testing.assert_allclose(short.damping, 30.0, rtol=1e-9)
    structural = attach(replace(beam(), damping=0.02 * beam().omega), "back", MASS, INERTIA, OFFSET)
    np.testing.assert_allclose(structural.damping[6:], 0.02 * structural.omega[6:], rtol=1e-9)


def modal_compliance(body, loads):
    shapes = np.stack([body.shapes[body.index(name), component] for name, component in loads])
    return (shapes[:, 6:] / body.omega[6:] ** 2) @ shapes[:, 6:].T


def test_mass_centre_and_inertia_of_the_whole_are_those_of_its_parts():
    body, part_centre = heavier(), beam().positions[1] + OFFSET
    assert body.mass == pytest.approx(beam().mass + MASS, rel=1e-14)
    np.testing.assert_allclose(body.centre, (beam().mass * beam().centre + MASS * part_centre) / body.mass, atol=1e-14)
    steiner = MASS * (part_centre @ part_centre * np.eye(3) - np.outer(part_centre, part_centre))
    np.testing.assert_allclose(body.inertia, beam().inertia + INERTIA + steiner, atol=1e-14)


def test_rigid_modes_are_orthonormal_in_the_rigid_mass_matrix():
    """Analytic rigid modes against mass, centre and inertia, before and after a part came on."""
    for body in (beam(), heavier()):
        mass = np.zeros((6, 6))
        mass[:3, :3] = body.mass * np.eye(3)
        x, y, z = body.mass * body.centre
        mass[:3, 3:] = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
        mass[3:, :3] = mass[:3, 3:].T
        mass[3:, 3:] = body.inertia
        coordinates = rigid_coordinates(body)
        np.testing.assert_allclose(coordinates.T @ mass @ coordinates, np.eye(6), atol=1e-10)
        np.testing.assert_allclose(coordinates[:5, 5], 0.0, atol=1e-12)


def test_rigid_terms_are_those_of_the_whole_as_one_rigid_body():
    """G, C and the loads on rigid motions follow from mass, centre and inertia alone (closed forms)."""
    body = heavier()
    second = 0.5 * np.trace(body.inertia) * np.eye(3) - body.inertia  # ∫ρ X Xᵀ
    ez = np.array([0.0, 0.0, 1.0])
    gyroscopic = raw(body, "gyroscopic")
    np.testing.assert_allclose(gyroscopic[:2, :2], body.mass * np.array([[0, -1], [1, 0]]), atol=1e-10)
    # ∫ρ (a×X)·(e_z×(b×X)) = ∫ρ (a×X)·b (e_z·X) − (a×X)·X (e_z·b), the last term zero.
    for i, a in enumerate(np.eye(3)):
        for j, b in enumerate(np.eye(3)):
            assert gyroscopic[3 + i, 3 + j] == pytest.approx(np.cross(b, a) @ second @ ez, abs=1e-10)
    coordinates = rigid_coordinates(body)
    to_raw = np.linalg.inv(coordinates).T
    outward = (to_raw @ body.centrifugal_load[:6])[:3]
    np.testing.assert_allclose(outward, body.mass * body.centre * [1, 1, 0], atol=1e-12)
    assert (to_raw @ body.euler_load[:6])[5] == pytest.approx(body.inertia[2, 2], rel=1e-10)
    np.testing.assert_allclose((to_raw @ body.translation[:, :6].T)[:3], body.mass * np.eye(3), atol=1e-10)


def test_rotation_about_z_stays_neutral_with_an_unbalanced_part():
    body = heavier()
    spin = body.stress_stiffness - body.centrifugal
    assert np.abs(spin[5]).max() < 1e-9
    np.testing.assert_allclose(spin, spin.T, atol=1e-9)


def test_rotations_see_the_principal_moments():
    """On balanced axes K_σ − C is diag(J_z − J_y, J_z − J_x, 0) with the part's moments in it."""
    body = attach(rigid(beam()), "back", MASS, np.diag([0.05, 0.06, 0.04]), -beam().positions[1])
    plain = rigid(beam())
    spin = [raw(b, "stress_stiffness")[3:, 3:] - raw(b, "centrifugal")[3:, 3:] for b in (body, plain)]
    np.testing.assert_allclose(spin[0] - spin[1], np.diag([0.04 - 0.06, 0.04 - 0.05, 0.0]), atol=1e-10)


def test_parts_add_up_in_any_order():
    one = attach(attach(beam(), "back", 1.0, INERTIA / 3, OFFSET), "front", 2.0, INERTIA, -OFFSET)
    other = attach(attach(beam(), "front", 2.0, INERTIA, -OFFSET), "back", 1.0, INERTIA / 3, OFFSET)
    np.testing.assert_allclose(one.omega[6:], other.omega[6:], rtol=1e-8)
    np.testing.assert_allclose(raw(one, "stress_stiffness"), raw(other, "stress_stiffness"), atol=1e-9)


def test_a_part_leaves_the_static_compliance_between_balanced_loads():
    loads = [("front", 0), ("back", 0)]
    pull = np.array([1.0, -1.0])
    # Equal and opposite forces along z need no inertia relief to balance: mass does not enter.
    along = [("front", 2), ("back", 2)]
    assert pull @ modal_compliance(heavier(), along) @ pull == pytest.approx(
        pull @ modal_compliance(beam(), along) @ pull, rel=1e-8
    )
    assert pull @ modal_compliance(heavier(), loads) @ pull > 0


def test_truncation_keeps_the_statics_at_loaded_interfaces_and_the_modes_below_the_cut_off():
    """The basis of what is kept leads back to the first body."""
    body, loads = heavier(), [("front", 0), ("front", 1), ("back", 4)]
    short, kept = truncate(body, 2000.0, loads), body.omega[body.frequencies_hz <= 2000.0]
    assert short.n_modes < body.n_modes / 2
    np.testing.assert_allclose(modal_compliance(short, loads), modal_compliance(body, loads), rtol=1e-8)
    bare = truncate(body, 2000.0)
    assert abs(modal_compliance(bare, loads) / modal_compliance(body, loads) - 1).max() > 1e-3
    np.testing.assert_allclose(short.omega[: kept.size], kept)
    assert np.all(short.frequencies_hz[kept.size :] > 2000.0)
    weights = np.linalg.lstsq(body.basis, short.basis, rcond=None)[0]
    np.testing.assert_allclose(weights.T @ weights, np.eye(short.n_modes), atol=1e-9)
    np.testing.assert_allclose(beam().shapes @ short.basis, short.shapes, atol=1e-10)


def test_the_rigid_body_has_six_modes_and_the_same_rigid_terms():
    body = rigid(heavier())
    assert body.n_modes == 6
    np.testing.assert_allclose(raw(body, "centrifugal"), raw(heavier(), "centrifugal"))
    assert body.digest != heavier().digest


@pytest.mark.parametrize(
    ("interface", "mass", "inertia", "says"),
    [
        ("bakc", 1.0, np.eye(3), "no interface 'bakc'; did you mean 'back'"),
        ("back", -1.0, np.eye(3), "mass must not be negative"),
        ("back", 1.0, np.diag([1.0, 1.0, 3.0]), "no moment may exceed"),
        ("back", float("nan"), np.eye(3), "no rigid body"),
    ],
)
def test_impossible_parts_are_refused(interface, mass, inertia, says):
    with pytest.raises(InputError, match=says):
        attach(beam(), interface, mass, inertia, (0, 0, 0))


def test_an_unknown_load_and_a_broken_body_are_refused():
    with pytest.raises(InputError, match="component 6"):
        truncate(beam(), 100.0, [("front", 6)])
    with pytest.raises(StoreError, match="'omega'"):
        check(replace(beam(), omega=np.full(beam().n_modes, np.nan)))
    with pytest.raises(StoreError, match="'shapes'"):
        check(replace(beam(), shapes=beam().shapes[:, :5]))
