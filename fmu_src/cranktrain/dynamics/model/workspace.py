"""Memory of a running model that the caller owns."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.arrays import ModelArrays, dimensions
from cranktrain.dynamics.model.slots import FACTOR_SLOTS, FRAME_SIZE
from cranktrain.dynamics.model.state import MAX_STAGES


class Factors(NamedTuple):
    """Linear part of a group of bodies with n modes and m ports, for several step sizes."""

    scratch: Array  # (n, n)
    inverse: Array  # (levels, n, n) S⁻¹ transposed
    response: Array  # (levels, m, n) S⁻¹Φᵀ, row per port
    compliance: Array  # (levels, m, m) Φ S⁻¹ Φᵀ, transposed


class Work(NamedTuple):
    """Memory that the caller owns: factors, matrices and vectors of a stage. Results never depend on what it holds."""

    key: Array  # (levels, 2) step and speed that the factors of each level below were made for
    turning: Factors
    block: Factors
    relative: Array  # (n_newton, n_newton) compliance that the Newton ports feel, transposed
    jacobian: Array  # (n_newton, n_newton)
    blocks: Array  # (k, 16) force tangents of each connection, 4 × 4 row-major
    held: Array  # (k, 16) the tangents that the Newton matrix was made from
    modal: Array  # (12, n) vectors
    port: Array  # (17, m) vectors
    stage: Array  # (stages, 3, n) q, v, a of each stage
    known: Array  # (stages, 3, m) the ports' u, u̇, ü at each stage
    scratch: Array  # (64,)
    counters: Array  # (7,) steps, stages, Newton iterations, rejected steps, factorisations, worst residual, steps that
    # missed the tolerance
    frames: Array  # (stages, 10) the frame's motion at each stage
    guides: Array  # (c, 3) side forces of a guided piston's layers and its friction, as a stage last found them
    pressures: Array  # (stages, c) cylinder pressures at each stage
    inputs: Array  # (2, 2 + c) value and rate of the reconstructed inputs
    backup: Array  # (2, state) state at the start of a communication step and of a sub-step


def make_work(model: ModelArrays, state_size: int) -> Work:
    """Allocate the workspace of one model."""
    d = dimensions(model)
    n, m = d.modes, d.ports
    z = np.zeros
    return Work(
        key=z((FACTOR_SLOTS, 2)),
        turning=_factors(d.turning_modes, d.turning_ports),
        block=_factors(model.block_ports.shape[1], model.block_ports.shape[0]),
        relative=z((d.newton, d.newton)),
        jacobian=z((d.newton, d.newton)),
        blocks=z((model.connections.shape[0], 16)),
        held=z((model.connections.shape[0], 16)),
        modal=z((12, n)),
        port=z((17, m)),
        stage=z((MAX_STAGES, 3, n)),
        known=z((MAX_STAGES, 3, m)),
        scratch=z(64),
        counters=z(7),
        frames=z((MAX_STAGES, FRAME_SIZE)),
        guides=z((d.cylinders, 3)),
        pressures=z((MAX_STAGES, d.cylinders)),
        inputs=z((2, 2 + d.cylinders)),
        backup=z((2, state_size)),
    )


def _factors(n: int, m: int) -> Factors:
    z = np.zeros
    return Factors(z((n, n)), z((FACTOR_SLOTS, n, n)), z((FACTOR_SLOTS, m, n)), z((FACTOR_SLOTS, m, m)))
