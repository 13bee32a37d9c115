"""Rotors in the turning frame against published whirl speeds and closed forms."""

from functools import cache

import numpy as np
import pytest
from expected import cases
from rotors import DENSITY, DIAMETER, LENGTH, SPEED, support, system, whirl_speeds, with_discs
from scipy.linalg import expm
from solids import round_bar
from some import some

from cranktrain.core.reduced_body import attach, rigid, rigid_coordinates, truncate
from cranktrain.engine.parts import Material
from cranktrain.structure.fem.craig_bampton import craig_bampton
from cranktrain.structure.fem.elasticity import finite_elements
from cranktrain.structure.fem.interfaces import averaged_interfaces

CASES = cases("rotor")
RADIUS = 0.5 * DIAMETER
TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


@cache
def bare_shaft():
    """Shaft of the published rotor with interfaces at its ends and around the places of the discs."""
    near = 1e-6
    mesh = round_bar(RADIUS, LENGTH, 2, 60)

    def ring(middle):
        return lambda x: (np.hypot(x[0], x[1]) > 0.8 * RADIUS) & (np.abs(x[2] - middle) < 0.025)

    ends = {"left": lambda x: x[2] < near, "right": lambda x: x[2] > LENGTH - near}
    mesh = mesh.with_boundaries({**ends, "disc 1": ring(0.5), "disc 2": ring(1.0)})
    steel = Material(youngs_modulus=211e9, poisson_ratio=211e9 / (2 * 81.2e9) - 1, density=DENSITY)
    model = finite_elements(mesh, steel)
    places = {name: np.array([0, 0, z]) for name, z in (("left", 0), ("right", 1.5), ("disc 1", 0.5), ("disc 2", 1.0))}
    return craig_bampton(model, averaged_interfaces(model, positions=places), fixed_modes=30).body


@cache
def rotor():
    return with_discs(bare_shaft())


@pytest.mark.parametrize(("speed", "column"), [(0.0, "rpm0"), (SPEED, "rpm4000")])
def test_isotropic_rotor_whirls_as_published(speed, column):
    """Friswell et al. 5.9.1, lumped discs on a reduced solid shaft: within 1 % (the case's own tolerance)."""
    found = whirl_speeds(rotor(), speed, support(rotor(), 1e6 * np.eye(2)))
    np.testing.assert_allclose(found[:6], CASES["friswell_5.9.1"]["expected"][column], rtol=0.01)


def test_anisotropic_rotor_whirls_as_published():
    """Friswell et al. 5.9.2: bearings that differ across turn in the frame; Floquet over one revolution."""
    body = truncate(rotor(), 1000.0, [(name, c) for name in ("left", "right") for c in (0, 1)])
    n, steps = body.n_modes, 256
    step = 2 * np.pi / SPEED / steps
    state, path = np.eye(2 * n), [np.eye(2 * n)]
    for k in range(steps):
        angle = SPEED * step * (k + 0.5)
        back = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        springs = back @ np.diag([1e6, 8e5]) @ back.T
        state = expm(step * system(body, SPEED, support(body, springs))) @ state
        path.append(state)
    multipliers, vectors = np.linalg.eig(state)
    exponents = np.log(multipliers) / (steps * step)
    angles = SPEED * step * np.arange(steps)
    row = body.shapes[body.index("disc 1"), :2]
    found = []
    for exponent, vector in zip(exponents, vectors.T, strict=True):
        turning = np.stack([row @ (p @ vector)[:n] for p in path[:-1]], axis=1)
        outside = turning[0] * np.cos(angles) - turning[1] * np.sin(angles)
        upward = turning[0] * np.sin(angles) + turning[1] * np.cos(angles)
        for motion in (outside, upward):
            lines = np.abs(np.fft.fft(motion * np.exp(-exponent * step * np.arange(steps))))
            harmonic = np.fft.fftfreq(steps, 1 / steps)[np.argmax(lines)]
            found.append(abs(exponent.imag + harmonic * SPEED))
    for expected in some(CASES["friswell_5.9.2"]["expected"]["rpm4000"]):
        assert np.min(np.abs(np.array(found) / expected - 1)) < 0.01


def test_torsion_does_not_feel_the_speed():
    """Issue: torsional frequencies of a free shaft do not depend on Ω (1e-4)."""
    body = rotor()
    torsion = [k for k in range(6, body.n_modes) if _torsional(body, k)][:3]
    for speed in (100.0, 250.0, 500.0):
        values = np.abs(np.linalg.eigvals(system(body, speed, np.zeros_like(body.gyroscopic))).imag)
        for k in some(torsion):
            assert np.min(np.abs(values / body.omega[k] - 1)) < 1e-4


def _torsional(body, k):
    motion = np.abs(body.shapes[:, :, k]).max(axis=0)
    return motion[5] * RADIUS > 10 * motion[:3].max()


def test_a_lumped_disc_gets_its_textbook_terms():
    """Turning frame, about its centre: Coriolis (2 J_d − J_p) Ω, stiffness (J_p − J_d) Ω² (core/reduced_body.py)."""
    mass, diametral, polar = 30.0, 0.6, 1.1
    bare = rigid(bare_shaft())
    disc = attach(bare, "left", mass, np.diag([diametral, diametral, polar]), (0.0, 0.0, 0.0))

    def raw(body, matrix):
        to_rigid = np.linalg.inv(rigid_coordinates(body))
        return to_rigid.T @ matrix @ to_rigid

    added = {
        name: raw(disc, getattr(disc, name)) - raw(bare, getattr(bare, name))
        for name in ("gyroscopic", "centrifugal", "stress_stiffness")
    }
    spin = added["stress_stiffness"] - added["centrifugal"]
    np.testing.assert_allclose(spin[3:, 3:], np.diag([1, 1, 0]) * (polar - diametral), atol=1e-9)
    np.testing.assert_allclose(spin[:3, :3], np.diag([-mass, -mass, 0]), atol=1e-9)
    coriolis = 2 * added["gyroscopic"]
    np.testing.assert_allclose(coriolis[3:5, 3:5], -(2 * diametral - polar) * TURN.T, atol=1e-9)
    np.testing.assert_allclose(coriolis[:2, :2], 2 * mass * TURN, atol=1e-9)
