"""The published rotor of Friswell and others: its discs, and whirl speeds of a turning body, seen from outside."""

import numpy as np

from cranktrain.core.reduced_body import attach

SPEED = 4000 * np.pi / 30
LENGTH, DIAMETER, DENSITY = 1.5, 0.05, 7810.0


def with_discs(body):
    """A shaft's body with the two discs at its interfaces ``disc 1`` and ``disc 2``."""
    for name, outer in (("disc 1", 0.28), ("disc 2", 0.35)):
        width, bore = 0.07, DIAMETER
        mass = DENSITY * np.pi / 4 * (outer**2 - bore**2) * width
        polar = mass * (outer**2 + bore**2) / 8
        diametral = 0.5 * polar + mass * width**2 / 12
        body = attach(body, name, mass, np.diag([diametral, diametral, polar]), (0.0, 0.0, 0.0))
    return body


def support(body, stiffness, names=("left", "right")):
    """Stiffness matrix (2, 2) across the axis at the named interfaces, in modes."""
    across = [body.shapes[body.index(name), :2] for name in names]
    return sum(row.T @ stiffness @ row for row in across)


def system(body, speed, stiffness, damping=0.0):
    """First-order matrix of the equations in the turning frame."""
    n = body.n_modes
    rigidity = np.diag(body.omega**2) + speed**2 * (body.stress_stiffness - body.centrifugal) + stiffness
    return np.block([[np.zeros((n, n)), np.eye(n)], [-rigidity, -2 * speed * body.gyroscopic - damping]])


def whirl_speeds(body, speed, stiffness, probe="disc 1"):
    """Whirl speeds, rad/s: the turning frame's ω, shifted by Ω in the sense of the whirl."""
    values, vectors = np.linalg.eig(system(body, speed, stiffness))
    across = body.shapes[body.index(probe), :2] @ vectors[: body.n_modes]
    # x + iy of the real motion has a part e^{+iωt} of size |x + iy| and a part e^{−iωt} of size |x − iy|.
    forward, backward = np.abs(across[0] + 1j * across[1]), np.abs(across[0] - 1j * across[1])
    lateral = np.maximum(forward, backward) > 1e-3 * np.abs(vectors[: body.n_modes]).max(axis=0)
    sense = np.where(forward > backward, 1.0, -1.0)
    return np.sort(np.abs(sense * values.imag + speed)[lateral & (values.imag > 1e-3)])
