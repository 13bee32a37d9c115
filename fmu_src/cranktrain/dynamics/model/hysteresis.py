"""Viscous damping that replaces loss factors of shafts in the running model.

A shaft of stiffness k and loss factor η that twists by ψ carries the torque k (1 + iη) ψ at every frequency, so its
loss per cycle, π η k |ψ|², does not depend on frequency. In time the shafts s with twists ψ_s = r_sᵀ q are replaced by
the viscous damping

    C = Σ_s η_s k_s p_s p_sᵀ,   p_s = Σ_j (r_sᵀ φ_j)/√ω_j M φ_j

with the elastic modes φ_j (φ_jᵀ M φ_j = 1) of all rotating bodies: crank, flywheel, pulley, mean rods, drive line and
the ring of a damper that has a spring. Each mode then has φ_jᵀ C φ_j = Σ η k (r_sᵀ φ_j)²/ω_j, the damping of the
hysteresis at its own frequency, and two modes are coupled as hysteresis couples them at √(ω_i ω_j). Rotation as a whole
is not damped. This replacement has an error: a mode that is forced at a frequency ω other than its own loses ω/ω_j
times as much energy per cycle as by hysteresis. At a resonance only the other modes, which respond as springs, have it.

Loss factors must not become modal damping of a crankshaft alone, because parts attached later lower its frequencies.

Source: S. H. Crandall, J. Sound Vib. 11 (1970) 3, the role of damping in vibration theory.
"""

import numpy as np

from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.engine.model import Engine
from cranktrain.loads.damper import SPRING, damper_constants
from cranktrain.loads.rod_masses import rod_masses
from cranktrain.loads.torsional_line import DAMPING, LAW, STIFFNESS, TorsionalLine

OF_SHAFT, OF_DAMPING, OF_LOSS = range(3)
"""Columns of a body's ``shaft_laws``: stiffness, viscous damping and loss factor of each shaft."""
FREE = 1.0e-6
"""Fraction of the highest natural frequency below which a mode counts as rigid."""


def viscous_rows(body: ReducedBody) -> tuple[Array, Array]:
    """Twists (s, n) and damping rows (s, LAW) of the viscous shafts and discs in a crank's table of elements."""
    found = np.flatnonzero(body.shaft_laws[:, OF_DAMPING])
    laws = np.zeros((found.size, LAW))
    laws[:, DAMPING] = body.shaft_laws[found, OF_DAMPING]
    return body.twists[found].reshape(found.size, body.n_modes), laws


def hysteresis_rows(engine: Engine, body: ReducedBody, line: TorsionalLine, line_twists: Array) -> tuple[Array, Array]:
    """Twists p_s (s, n) and damping rows (s, LAW) of the viscous damping that replaces loss factors in the time domain.

    Parameters
    ----------
    body : all rotating bodies as one
    line_twists : (rows, n) twists of the drive line's rows in the modes of ``body``
    """
    # Twists (s, n) and η k (s,), N m/rad, of the s shafts with a loss factor η in the crank and its drive line.
    own = body.shaft_laws[:, OF_SHAFT] * body.shaft_laws[:, OF_LOSS]
    crank, shafts = np.flatnonzero(own), np.flatnonzero(line.hysteresis)
    twists = np.vstack((body.twists[crank].reshape(crank.size, body.n_modes), line_twists[shafts]))
    hysteresis = np.concatenate((own[crank], line.hysteresis[shafts]))
    laws = np.zeros((hysteresis.size, LAW))
    if not hysteresis.size:
        return twists, laws
    laws[:, DAMPING] = hysteresis
    stiffness = np.diag(body.omega**2) + line_twists.T @ (line.laws[:, STIFFNESS, None] * line_twists)
    if "ring" in body.interfaces and engine.damper is not None:
        twist = body.shapes[body.index("pulley"), 5] - body.shapes[body.index("ring"), 5]
        stiffness += damper_constants(engine.damper)[SPRING] * np.outer(twist, twist)
    mass = np.eye(body.n_modes) + rod_masses(engine, body)
    root = np.linalg.inv(np.linalg.cholesky(mass))
    squares, shapes = np.linalg.eigh(root @ stiffness @ root.T)
    elastic = squares > FREE**2 * squares[-1]
    modes, omega = root.T @ shapes[:, elastic], np.sqrt(squares[elastic])
    return (twists @ modes / np.sqrt(omega)) @ (mass @ modes).T, laws
