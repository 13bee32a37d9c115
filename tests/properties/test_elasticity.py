"""Properties of the finite-element matrices and of their factors."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse
from skfem import Basis, BilinearForm, ElementTetP2
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity
from solids import STEEL, block, frequencies, round_bar

from cranktrain.structure.fem.dissection import bisection, nested_dissection, vertex_cover
from cranktrain.structure.fem.elasticity import QUADRATURE_ORDER, finite_elements, lumped_volume, sample, scalar_basis
from cranktrain.structure.fem.factor import Cholesky, factorise

SIDES = (0.05, 0.08, 0.12)


@pytest.fixture(scope="module")
def model():
    return finite_elements(block(SIDES, (3, 3, 4)), STEEL)


@pytest.fixture(scope="module")
def curved():
    return finite_elements(round_bar(0.02, 0.06, 1, 3), STEEL)


def rigid_motions(model, centre=(0.0, 0.0, 0.0)):
    """Six rigid-body motions about ``centre``, (ndof, 6)."""
    e = np.eye(3)
    shifted = np.asarray(centre)[:, None]
    fields = [lambda x, k=k: e[k][:, None] + 0 * x for k in range(3)]
    fields += [lambda x, k=k: np.cross(e[k], (x - shifted).T).T for k in range(3)]
    return np.column_stack([sample(model, field) for field in fields])


def test_matrices_equal_the_vector_form(curved):
    """Of another library, to rounding: so they pass the patch test and know rigid motions."""
    basis = Basis(curved.mesh, curved.basis.elem, intorder=QUADRATURE_ORDER)
    stiffness = linear_elasticity(*lame_parameters(STEEL.youngs_modulus, STEEL.poisson_ratio)).assemble(basis)
    mass = BilinearForm(lambda u, v, w: STEEL.density * dot(u, v)).assemble(basis)
    assert abs(curved.stiffness - stiffness).max() < 1e-12 * abs(stiffness).max()
    assert abs(curved.mass - mass).max() < 1e-12 * abs(mass).max()


@pytest.mark.parametrize("consistent", [True, False])
def test_mass_is_exact_and_definite(consistent):
    radius, length = 0.02, 0.06
    body = finite_elements(round_bar(radius, length, 2, 4), STEEL, consistent_mass=consistent)
    motions = rigid_motions(body)
    rigid = motions.T @ body.mass @ motions
    volume = scalar_basis(body.mesh).dx.sum()
    assert np.diag(rigid)[:3] == pytest.approx([STEEL.density * volume] * 3, rel=1e-12)
    # The surface of quadratic elements misses the circle by (π/n)⁴/40 or so: n = 16 chords.
    assert volume == pytest.approx(np.pi * radius**2 * length, rel=1e-4)
    assert body.mass.diagonal().min() > 0
    if not consistent:
        assert body.mass.nnz == body.basis.N


def test_lumped_volume_of_each_element_stays_its_own():
    """Hinton, Rock and Zienkiewicz: 1/36 at corners and 4/27 at mid-sides of a straight ten-node tetrahedron."""
    plain = block(SIDES, (2, 2, 2))
    straight = Basis(plain, ElementTetP2(), intorder=5, elements=[0])
    shares = lumped_volume(straight)[straight.element_dofs[:, 0]] / straight.dx.sum()
    np.testing.assert_allclose(shares, [1 / 36] * 4 + [4 / 27] * 6, rtol=1e-12)
    swept = replace(plain, doflocs=plain.doflocs + 8.0 * np.roll(plain.doflocs, 1, axis=0) ** 2)

    def lumped(elements):
        return lumped_volume(Basis(swept, ElementTetP2(), intorder=5, elements=elements))

    every = np.arange(plain.t.shape[1])
    np.testing.assert_allclose(lumped(every), sum(lumped(every[k : k + 1]) for k in every), rtol=1e-12)


def test_cholesky_solves(curved):
    matrix = (curved.stiffness + 1e6 * curved.mass).tocsc()
    rhs = np.random.default_rng(3).standard_normal((matrix.shape[0], 5))
    factor = factorise(matrix)
    assert isinstance(factor, Cholesky)
    x = factor.solve(rhs)
    assert np.abs(matrix @ x - rhs).max() < 1e-14 * abs(matrix).max() * np.abs(x).max()
    assert np.array_equal(factor.solve(rhs[:, 0]), factor.solve(rhs[:, :1])[:, 0])
    known = factorise(matrix, curved.positions).solve(rhs)
    assert np.abs(known - x).max() < 1e-9 * np.abs(x).max()


def test_indefinite_matrices_are_solved_too(curved):
    hz, _ = frequencies(curved.stiffness, curved.mass, 8, 1000.0)
    matrix = (curved.stiffness - (2 * np.pi * 0.5 * hz[6:].mean()) ** 2 * curved.mass).tocsc()
    factor = factorise(matrix)
    rhs = np.ones(matrix.shape[0])
    assert not isinstance(factor, Cholesky)
    assert np.abs(matrix @ factor.solve(rhs) - rhs).max() < 1e-6


@settings(deadline=None, max_examples=30)
@given(n=st.integers(2, 60), density=st.floats(0.0, 0.3), seed=st.integers(0, 1000))
def test_cholesky_of_any_sparse_definite_matrix(n, density, seed):
    random = np.random.default_rng(seed)
    a = sparse.random_array((n, n), density=density, rng=random)
    matrix = (a @ a.T + sparse.eye_array(n)).tocsc()
    rhs = random.standard_normal((n, 2))
    assert Cholesky(matrix).solve(rhs) == pytest.approx(np.linalg.solve(matrix.toarray(), rhs), rel=1e-8, abs=1e-10)


@settings(deadline=None, max_examples=30)
@given(n=st.integers(1, 80), leaf=st.integers(1, 12), seed=st.integers(0, 1000), placed=st.booleans())
def test_dissection_orders_every_node_once_and_separates(n, leaf, seed, placed):
    places = np.random.default_rng(seed).standard_normal((n, 3)) if placed else None
    a = sparse.random_array((n, n), density=0.06, rng=np.random.default_rng(seed))
    graph = sparse.csr_matrix(a + a.T + sparse.eye_array(n))
    groups, parents = nested_dissection(graph, leaf, places)
    assert np.array_equal(np.sort(np.concatenate(groups)), np.arange(n))
    group_of = np.empty(n, dtype=int)
    for k, group in enumerate(groups):
        group_of[group] = k
    ancestors = []
    for k, parent in enumerate(parents):
        assert parent == -1 or parent > k
        chain = {k}
        while parents[max(chain)] >= 0:
            chain.add(parents[max(chain)])
        ancestors.append(chain)
    # Two nodes with an edge lie on one path to the root: no fill between separated parts.
    for i, j in zip(*graph.nonzero(), strict=True):
        low, high = sorted((group_of[i], group_of[j]))
        assert high in ancestors[low]


def test_a_fine_ring_in_a_coarse_body_is_cut_across():
    """120 stations of 16 nodes each round a ring, ten at a time beside one of 12 coarse nodes that all touch."""
    stations, section, hubs = 120, 16, 12
    around = sparse.diags_array([1.0, 1.0], offsets=[1, -1], shape=(stations, stations)).tolil()
    around[0, -1] = around[-1, 0] = 1.0
    square = sparse.diags_array([1.0, 1.0], offsets=[1, -1], shape=(4, 4))
    inside = sparse.kron(square, np.eye(4)) + sparse.kron(np.eye(4), square)
    ring = sparse.kron(around, np.eye(section)) + sparse.kron(np.eye(stations), inside)
    beside = sparse.csr_matrix(np.kron(np.eye(hubs), np.ones((stations * section // hubs, 1))))
    graph = sparse.csr_matrix(sparse.block_array([[ring, beside], [beside.T, np.ones((hubs, hubs))]]))
    turn = 2.0 * np.pi * (np.arange(stations * section) // section) / stations
    middle = 2.0 * np.pi * (np.arange(hubs) + 0.5) / hubs
    places = np.stack([np.cos(np.r_[turn, middle]), np.sin(np.r_[turn, middle]), np.zeros(graph.shape[0])], axis=1)
    across = 2 * section + hubs
    assert (bisection(graph, places) == 2).sum() <= across < (bisection(graph) == 2).sum()


def test_vertex_cover_is_least():
    """König: as many as the largest matching; here a star and a path."""
    rows, columns = vertex_cover(sparse.csr_matrix(np.ones((1, 7))))
    assert rows.sum() == 1 and columns.sum() == 0
    path = np.eye(4) + np.eye(4, k=1)
    rows, columns = vertex_cover(sparse.csr_matrix(path))
    assert rows.sum() + columns.sum() == 4 and np.all((path == 0) | rows[:, None] | columns[None, :])


def test_a_model_keeps_no_data_of_its_integration_points(model):
    """Its basis has the numbers and places of the unknowns, but is evaluated at one point an element."""
    full = Basis(model.mesh, model.basis.elem, intorder=QUADRATURE_ORDER)
    assert model.basis.dx.shape[1] == 1 < full.dx.shape[1]
    assert np.array_equal(model.basis.doflocs, full.doflocs)
    assert np.array_equal(model.basis.element_dofs, full.element_dofs)
    assert scalar_basis(model.mesh).dx.sum() == pytest.approx(full.dx.sum(), rel=1e-12)
