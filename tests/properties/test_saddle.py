"""The saddle's compliance: symmetric, positive, free of the bore's motion, converged, kept between runs."""

from dataclasses import replace

import numpy as np
import pytest
from bodies import free_six

import cranktrain.structure.block.saddle as saddle_module
from cranktrain.core.errors import InputError
from cranktrain.film.elastic.bore_compliance import patterns, reduced_compliance
from cranktrain.structure.block.saddle import bore_compliance, pattern_compliance, saddle_for, saddle_mesh
from cranktrain.structure.fem.elasticity import finite_elements

ENGINE = free_six()
PLAN = saddle_for(ENGINE.main_bearing)
AREA = np.pi * PLAN.film_diameter * PLAN.film_width
WAVES, DEGREE = 6, 2
LOCAL = (2 * WAVES + 1) * (DEGREE + 1) - 4
ANGLES = 2 * np.pi * np.arange(48) / 48
ZETAS, ACROSS = np.polynomial.legendre.leggauss(6)
MEAN = np.full(48, 1 / 48)[:, None] * 0.5 * ACROSS


def patternwise(mesh_size):
    mesh = saddle_mesh(replace(PLAN, mesh_size=mesh_size))
    model = finite_elements(mesh, PLAN.material)
    held = model.basis.get_dofs(mesh.boundaries["clamped"]).flatten()
    return pattern_compliance(model, held, PLAN.film_diameter, PLAN.film_width, WAVES, DEGREE)


@pytest.fixture(scope="module")
def coarse():
    return patternwise(0.3 * PLAN.film_diameter)


@pytest.fixture(scope="module")
def usual():
    return patternwise(PLAN.mesh_size)


def motions():
    ones = np.ones_like(ZETAS)
    return [np.outer(trig(ANGLES), line) for line in (ones, ZETAS) for trig in (np.cos, np.sin)]


def film_pressure(seed):
    """Some smooth pressure in the patterns' span, on the grid, Pa."""
    around, along = patterns(ANGLES, ZETAS, WAVES, DEGREE)
    shares = 1e6 * np.random.default_rng(seed).standard_normal((2 * WAVES + 1, DEGREE + 1))
    return shares, np.einsum("ml,mi,lj->ij", shares, around, along)


def test_compliance_is_symmetric_and_positive(usual):
    matrix = usual.reshape(usual.shape[0] * usual.shape[1], -1)
    assert np.abs(matrix - matrix.T).max() <= 1e-12 * np.abs(matrix).max()
    assert np.linalg.eigvalsh(matrix).min() > 0.0
    compliance = reduced_compliance(usual, AREA, LOCAL).compliance
    assert (compliance > 0.0).all() and (np.diff(compliance) <= 0.0).all()


def test_shapes_are_orthonormal_and_hold_no_motion_of_the_bore(usual):
    shapes = reduced_compliance(usual, AREA, 12).shapes(ANGLES, ZETAS)
    assert np.einsum("kij,lij,ij->kl", shapes, shapes, MEAN) == pytest.approx(np.eye(12), abs=1e-12)
    for motion in motions():
        assert np.abs(np.einsum("kij,ij,ij->k", shapes, motion, MEAN)).max() < 1e-12


@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_all_shapes_with_their_weights_give_the_whole_widening_but_the_motion(usual, seed, moves):
    """With the motion among the shapes the whole widening; these are then their own weights."""
    shares, pressure = film_pressure(seed)
    around, along = patterns(ANGLES, ZETAS, WAVES, DEGREE)
    whole = np.einsum("abml,ml,ai,bj->ij", usual, shares, around, along) / AREA
    for motion in () if moves else motions():
        whole = whole - motion * np.sum(MEAN * whole * motion) / np.sum(MEAN * motion**2)
    bore = reduced_compliance(usual, AREA, LOCAL + 4 * moves, with_motion=moves)
    weights, shapes = bore.weights(ANGLES, ZETAS), bore.shapes(ANGLES, ZETAS)
    assert not moves or weights == pytest.approx(shapes, abs=1e-15)
    amplitude = bore.compliance * AREA * np.einsum("kij,ij,ij->k", weights, pressure, MEAN)
    found = np.einsum("k,kij->ij", amplitude, shapes)
    assert found == pytest.approx(whole, rel=1e-9, abs=1e-9 * np.abs(whole).max())


def test_shapes_keep_the_saddles_two_planes_of_symmetry(usual):
    # Left and right, front and back are alike but for the mesh: each shape is even or odd.
    shapes = reduced_compliance(usual, AREA, 8).shapes(ANGLES, ZETAS)
    left = shapes[:, (24 - np.arange(48)) % 48]
    for mirrored in (left, shapes[:, :, ::-1]):
        parity = np.einsum("kij,kij,ij->k", shapes, mirrored, MEAN)
        assert np.abs(parity) == pytest.approx(1.0, abs=2e-3)


def test_mesh_is_fine_enough(coarse, usual):
    # Displacements of a conforming mesh are too small; a finer one adds little to them.
    first, second = (reduced_compliance(c, AREA, 8).compliance for c in (coarse, usual))
    assert (second > first).all()
    assert second == pytest.approx(first, rel=0.05)


@pytest.mark.slow
def test_compliance_converges_with_the_mesh(coarse, usual):
    fine = reduced_compliance(patternwise(0.6 * PLAN.mesh_size), AREA, 8).compliance
    errors = [np.abs(reduced_compliance(c, AREA, 8).compliance / fine - 1).max() for c in (coarse, usual)]
    assert errors[1] < errors[0] and errors[1] < 0.01


def test_captured_share_rises_to_one(usual):
    captured = reduced_compliance(usual, AREA, LOCAL).captured
    assert (np.diff(captured) >= -1e-14).all()
    assert captured[-1] == pytest.approx(1.0, abs=1e-12)
    # What eight shapes leave is mostly the parabola across the width.
    assert captured[7] > 0.95


def test_finite_elements_run_once(monkeypatch, tmp_path, usual):
    monkeypatch.setenv("CRANKTRAIN_CACHE", str(tmp_path))
    runs = []
    monkeypatch.setattr(saddle_module, "saddle_mesh", lambda plan: saddle_mesh(replace(plan, mesh_size=0.05)))
    monkeypatch.setattr(saddle_module, "pattern_compliance", lambda *_: runs.append(1) or usual)
    first = bore_compliance(ENGINE, 6)
    assert np.array_equal(bore_compliance(ENGINE, 9).compliance[:6], first.compliance)
    assert len(runs) == 1
    (kept,) = tmp_path.iterdir()
    kept.write_bytes(kept.read_bytes()[:200])
    assert np.array_equal(bore_compliance(ENGINE, 6).compliance, first.compliance)
    assert len(runs) == 2 and [p.name for p in tmp_path.iterdir()] == [kept.name]
    bore_compliance(replace(ENGINE, main_bearing=replace(ENGINE.main_bearing, width=0.031)), 6)
    assert len(runs) == 3


def test_more_shapes_than_patterns_are_refused(usual):
    with pytest.raises(InputError, match=f"1 to {LOCAL}"):
        reduced_compliance(usual, AREA, LOCAL + 1)
