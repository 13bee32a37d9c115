"""Rollers as springs on an elastic ring: limits, symmetry, convergence, and what is kept between runs."""

from dataclasses import replace

import numpy as np
import pytest

import cranktrain.structure.block.roller_ring as ring_module
from cranktrain.core.errors import InputError
from cranktrain.engine.roller_bearing import RollerBearing
from cranktrain.film.laws.roller_contacts import equilibrium, roller_slices, slice_stiffness
from cranktrain.structure.block.roller_ring import (
    DEGREE,
    check_ring,
    elastic_ring_stiffness,
    ring_compliance,
    ring_for,
    ring_mesh,
    ring_model,
    track_compliance,
)

BEARING = RollerBearing(16, 20e-3, 14e-3, 100e-3, 30e-6, 0.00035)
RING = ring_for(BEARING)
TERMS = BEARING.rollers * (DEGREE + 1)
LOADED = equilibrium(BEARING, np.array([15e3, 0.0, 0.0, 0.0]))
SPRINGS = slice_stiffness(BEARING, LOADED.place)
ZETA = roller_slices(BEARING)[0]


def compliance(share=1.0, **changes):
    """Compliance of the ring on a mesh of ``share`` of its usual edge."""
    ring = replace(RING, mesh_size=share * RING.mesh_size, **changes)
    mesh = ring_mesh(ring)
    model = ring_model(ring, mesh)
    return track_compliance(ring, model, model.basis.get_dofs(mesh.boundaries["clamped"]).flatten())


@pytest.fixture(scope="module")
def usual():
    return compliance()


def stiffness(of, springs=SPRINGS):
    return elastic_ring_stiffness(of, ZETA, springs, 0.0)


def test_on_a_rigid_ring_springs_are_the_tangent_of_the_contacts():
    rigid = np.zeros((BEARING.rollers, DEGREE + 1) * 2)
    assert stiffness(rigid) == pytest.approx(LOADED.stiffness, abs=1e-9 * LOADED.stiffness.max())


def test_compliance_is_symmetric_and_positive(usual):
    matrix = usual.reshape(TERMS, TERMS)
    assert np.abs(matrix - matrix.T).max() <= 1e-12 * matrix.max()
    assert np.linalg.eigvalsh(matrix).min() > 0.0


def test_every_roller_finds_the_same_ring(usual):
    own = np.array([usual[j, :, j, :] for j in range(BEARING.rollers)])
    # As good as the mesh resolves them: the mean well, the cubic along the rollers not as well.
    assert np.ptp(own[:, 0, 0]) < 5e-3 * own[0, 0, 0]
    assert np.ptp(own, axis=0).max() < 0.05 * own.max()
    # Even and odd orders along the rollers do not mix.
    assert np.abs(usual[:, 0::2, :, 1::2]).max() < 5e-3 * usual.max()


def test_elastic_ring_is_softer_the_softer_it_is_and_ends_in_the_rigid_one(usual):
    rigid = np.diag(LOADED.stiffness)
    found = np.diag(stiffness(usual))
    assert (found < rigid).all() and (found > 0.5 * rigid).all()
    softer = np.diag(stiffness(2.0 * usual))
    assert (softer < found).all()
    assert np.diag(stiffness(1e-6 * usual)) == pytest.approx(rigid, rel=1e-6)


def test_stiffness_is_symmetric_and_that_of_rollers_in_series_with_their_ring(usual):
    found = stiffness(usual)
    assert found == pytest.approx(found.T, rel=1e-12)
    # One roller alone, by the mean along it: contact and ring in series.
    lone = np.zeros_like(SPRINGS)
    lone[0] = SPRINGS[0].sum() * roller_slices(BEARING)[1]
    radial = elastic_ring_stiffness(np.pad(usual[:, :1, :, :1], ((0, 0), (0, 1)) * 2), ZETA, lone, 0.0)
    assert 1.0 / radial[0, 0] == pytest.approx(1.0 / SPRINGS[0].sum() + usual[0, 0, 0, 0], rel=1e-9)


def test_stiffness_converges_with_the_mesh(usual):
    coarse, fine = (np.diag(stiffness(compliance(share)))[[0, 2]] for share in (1.5, 0.75))
    found = np.diag(stiffness(usual))[[0, 2]]
    assert found == pytest.approx(fine, rel=2e-3)
    assert (np.abs(coarse - fine) > np.abs(found - fine)).all()


def test_compliance_is_kept_for_these_inputs_only(monkeypatch, tmp_path, usual):
    calls = []

    def counted(ring, model, held, first_angle):
        calls.append(ring)
        return usual

    monkeypatch.setenv("CRANKTRAIN_CACHE", str(tmp_path))
    monkeypatch.setattr(ring_module, "ring_mesh", lambda ring: ring_mesh(replace(ring, mesh_size=0.03)))
    monkeypatch.setattr(ring_module, "track_compliance", counted)
    stages = []
    first = ring_compliance(RING, progress=stages.append)
    assert np.array_equal(ring_compliance(RING), first) and len(calls) == 1
    assert len(stages) == 2 and "degrees of freedom" in stages[1]
    ring_compliance(replace(RING, width=1.1 * RING.width))
    ring_compliance(RING, first_angle=0.1)
    assert len(calls) == 3
    for path in tmp_path.rglob("roller-ring-*.npz"):
        path.write_bytes(b"torn")
    ring_compliance(RING)
    ring_compliance(RING, rebuild=True)
    assert len(calls) == 5


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"width": 10e-3}, "width: is less than the rollers' length"),
        ({"ring_diameter": 0.1}, "ring_diameter: leaves no ring"),
        ({"housing_diameter": 0.1}, "housing_diameter: leaves no housing"),
        ({"mesh_size": 1e-4}, "mesh_size: would take millions"),
        ({"track_diameter": -0.1}, "track_diameter: -100 mm is not within 0.01 to 10000 mm"),
        ({"rollers": 2}, "rollers: at least 3"),
    ],
)
def test_what_is_no_ring_is_refused(change, text):
    with pytest.raises(InputError, match=text):
        check_ring(replace(RING, **change))
