"""Averaged interfaces and Craig–Bampton modes of a free block."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csc_matrix
from solids import STEEL, block
from some import some

from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.reduced_body import rigid_coordinates
from cranktrain.structure.fem.craig_bampton import Flexibility, craig_bampton, eigenmodes, rigid_motions
from cranktrain.structure.fem.elasticity import finite_elements, geometric_stiffness, sample
from cranktrain.structure.fem.interfaces import averaged_interfaces, tied_surfaces
from cranktrain.structure.fem.reduction import lumped_mass, static_error

LENGTH = 0.6


@pytest.fixture(scope="module")
def model():
    # Off its axis and off the origin, so that nothing vanishes by symmetry.
    mesh = block((0.05, 0.04, LENGTH), (2, 2, 16), origin=(0.01, -0.02, 0.1))
    near = np.ptp(mesh.p[0]) / 100
    x, z = mesh.p[0].max(), mesh.p[2]
    surfaces = {"front": lambda p: p[2] < z.min() + near, "back": lambda p: p[2] > z.max() - near}
    surfaces["side"] = lambda p: (p[0] > x - near) & (np.abs(p[2] - 0.1) < 0.08)
    return finite_elements(mesh.with_boundaries(surfaces), STEEL)


@pytest.fixture(scope="module")
def interfaces(model):
    return averaged_interfaces(model)


@pytest.fixture(scope="module")
def reduced(model, interfaces):
    return craig_bampton(model, interfaces, fixed_modes=30)


def test_a_rigid_motion_of_the_body_is_that_of_every_interface(model, interfaces):
    at_interfaces = (interfaces.averaging @ rigid_motions(model)).reshape(-1, 6, 6)
    for place, motion in some(zip(interfaces.positions, at_interfaces, strict=True)):
        expected, (x, y, z) = np.eye(6), place
        expected[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
        np.testing.assert_allclose(motion, expected, atol=1e-12)


def test_an_interface_force_is_spread_with_its_resultant(model, interfaces):
    """Wᵀ f does the work of f on every rigid motion: same force, same moment about the reference point."""
    load = interfaces.averaging[:6].T @ np.array([1.0, 2.0, 3.0, 0.4, 0.5, 0.6])
    place = interfaces.positions[0]
    resultant = rigid_motions(model).T @ load
    np.testing.assert_allclose(resultant[:3], [1, 2, 3], rtol=1e-11)
    moment = np.cross(place, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(resultant[3:], moment + np.array([0.4, 0.5, 0.6]), atol=1e-11)


@pytest.mark.parametrize("count", [3, 40, 78])
def test_a_small_body_has_all_its_modes_and_no_more(count):
    """As of an added shaft that is held at both ends: a Lanczos basis of blocks would not fit into its space."""
    draw = np.random.default_rng(1).standard_normal((2, 84, 84))
    stiffness, mass = (one @ one.T + 84.0 * np.eye(84) for one in draw)
    free, flexible = slice(6, 78), np.zeros((84, 84))
    flexible[free, free] = np.linalg.inv(stiffness[free, free])
    if count > 72:
        with pytest.raises(SolverError, match="78 eigenmodes asked of a body that has 72"):
            eigenmodes(lambda load: flexible @ load, csc_matrix(mass), count)
        return
    omega, modes = eigenmodes(lambda load: flexible @ load, csc_matrix(mass), count)
    expected = np.sqrt(eigh(stiffness[free, free], mass[free, free], eigvals_only=True))
    np.testing.assert_allclose(omega, expected[:count], rtol=1e-8)
    np.testing.assert_allclose(modes.T @ mass @ modes, np.eye(count), atol=1e-8)


def test_modes_are_orthonormal_and_the_rigid_ones_exact(model, reduced):
    modes, omega = reduced.modes, reduced.body.omega
    np.testing.assert_allclose(modes.T @ (model.mass @ modes), np.eye(omega.size), atol=1e-9)
    coordinates = rigid_coordinates(reduced.body)
    np.testing.assert_allclose(modes[:, :6], rigid_motions(model) @ coordinates, atol=1e-12)
    assert np.all(coordinates[:5, 5] == pytest.approx(0.0, abs=1e-12))
    stiffness = modes.T @ (model.stiffness @ modes)
    np.testing.assert_allclose(np.diag(stiffness)[6:], omega[6:] ** 2, rtol=1e-8)


def test_reduced_frequencies_are_those_of_the_full_model(model, reduced):
    """Issue: at most 0.5 % with 30 fixed-interface modes, over the band in which the reduction is used."""
    full, _ = eigenmodes(reduced.flexibility.solve, model.mass, 8)
    error = reduced.body.omega[6:14] / full - 1.0
    assert error.min() > -1e-9  # Ritz values bound from above
    assert error.max() < 5e-3


def test_statics_between_interfaces_are_complete(reduced):
    assert static_error(reduced) < 1e-8


def test_equal_input_gives_equal_bytes(model, interfaces, reduced):
    again = craig_bampton(model, interfaces, fixed_modes=30).body
    for name in ("omega", "shapes", "gyroscopic", "centrifugal", "stress_stiffness"):
        assert getattr(again, name).tobytes() == getattr(reduced.body, name).tobytes()


def test_rotation_about_z_is_neutral_for_a_body_out_of_balance(reduced):
    body = reduced.body
    assert np.hypot(*body.centre[:2]) > 0.02  # out of balance by 2 cm
    spin = body.stress_stiffness - body.centrifugal
    assert np.abs(spin[5]).max() < 1e-12 * np.abs(spin).max()
    assert np.abs(spin[:, 5]).max() < 1e-12 * np.abs(spin).max()


def test_rigid_rotations_see_the_moments_of_inertia():
    """As core/reduced_body.py says, K_σ − C = diag(J_z − J_y, J_z − J_x, 0) for principal axes through the origin."""
    mesh = block((0.08, 0.05, 0.12), (2, 2, 3))
    mesh = mesh.with_boundaries({"top": lambda p: p[2] > 0.06 - 1e-9})
    model = finite_elements(mesh, STEEL)
    body = craig_bampton(model, averaged_interfaces(model), fixed_modes=10).body
    raw = np.linalg.inv(rigid_coordinates(body))
    spin = raw.T @ (body.stress_stiffness - body.centrifugal)[:6, :6] @ raw
    jx, jy, jz = np.diag(body.inertia)
    np.testing.assert_allclose(spin[3:, 3:], np.diag([jz - jy, jz - jx, 0.0]), atol=1e-8 * jx)
    np.testing.assert_allclose(np.diag(spin)[:3], [-body.mass, -body.mass, 0.0], atol=1e-9 * body.mass)
    sides = np.array([0.08, 0.05, 0.12]) ** 2
    np.testing.assert_allclose(np.diag(body.inertia), body.mass / 12 * (sides.sum() - sides), rtol=1e-9)


def test_stress_stiffness_without_rigid_replacement_agrees_with_the_rigid_rows():
    """A balanced body: the finite-element K_σ itself gives the work of the turned centrifugal load."""
    model = finite_elements(block((0.08, 0.05, 0.12), (2, 2, 3)), STEEL)
    motions = rigid_motions(model)
    outward = sample(model, lambda x: x * np.array([[1.0], [1.0], [0.0]]))
    free = Flexibility.of(model.stiffness, model.mass, motions)
    stress = geometric_stiffness(model, free.solve((model.mass @ outward)[:, None])[:, 0])
    inertia = np.diag(motions.T @ (model.mass @ motions))[3:]
    x2, y2, _ = 0.5 * inertia.sum() - inertia  # ∫ρ x², ∫ρ y²
    rotations = np.diag(motions[:, 3:].T @ (stress @ motions[:, 3:]))
    np.testing.assert_allclose(rotations, [y2, x2, x2 + y2], rtol=1e-9)


def test_lumped_mass_keeps_the_frequencies_and_the_factors(model, reduced):
    lumped = lumped_mass(model)
    assert lumped.diagonal().min() > 0.0
    assert lumped.sum() == pytest.approx(model.mass.sum(), rel=1e-12)
    hz, _ = eigenmodes(reduced.flexibility.with_mass(lumped).solve, lumped, 3)
    np.testing.assert_allclose(hz, reduced.body.omega[6:9], rtol=0.02)


def test_rigid_ties_stiffen(model, interfaces, reduced):
    with pytest.warns(UserWarning, match="RBE2"):
        tie, motions = tied_surfaces(model, interfaces, rigid_motions(model))
    np.testing.assert_allclose(tie @ motions, rigid_motions(model), atol=1e-12)
    mass = (tie.T @ model.mass @ tie).tocsc()
    omega, _ = eigenmodes(Flexibility.of((tie.T @ model.stiffness @ tie).tocsc(), mass, motions).solve, mass, 3)
    assert np.all(omega > reduced.body.omega[6:9])


def test_a_surface_that_is_not_there_is_named(model):
    with pytest.raises(InputError, match="'fronz'; did you mean 'front'"):
        averaged_interfaces(model, ["fronz"])
