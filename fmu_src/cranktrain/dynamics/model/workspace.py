"""Memory of a running model that the caller owns."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.build_mark import build_mark
from cranktrain.core.kernel import kernel_address
from cranktrain.core.named import resolve
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.arrays import ModelArrays, dimensions
from cranktrain.dynamics.model.slots import (
    COUNTERS,
    DIFFERENCE_KERNEL,
    FACTOR_SLOTS,
    FRAME_SIZE,
    INPUT_ROWS,
    KEYS,
    MODAL_VECTORS,
    OTHER_INPUTS,
    PORT_VECTORS,
    POWERS,
    STEP_KERNEL,
)
from cranktrain.dynamics.model.state import MAX_STAGES
from cranktrain.dynamics.time.integrators import family


class Factors(NamedTuple):
    """Linear part of a group of bodies with n modes and m ports, for several step sizes."""

    scratch: Array  # (n, n)
    inverse: Array  # (slots, n, n) S⁻¹ transposed
    response: Array  # (slots, m, n) S⁻¹Φᵀ, row per port
    compliance: Array  # (slots, m, m) Φ S⁻¹ Φᵀ, transposed


class Work(NamedTuple):
    """Memory that the caller owns: factors, matrices and vectors of a stage. Results never depend on what it holds."""

    key: Array  # (FACTOR_SLOTS, 2) step and speed that the factors of each slot were made for
    turning: Factors
    block: Factors
    relative: Array  # (n_newton, n_newton) compliance that the Newton ports feel, transposed
    jacobian: Array  # (n_newton, n_newton)
    blocks: Array  # (k, 16) force tangents of each connection, 4 × 4 row-major
    factored: Array  # (k, 16) the tangents that the Newton matrix was made from
    modal: Array  # (MODAL_VECTORS, n)
    port: Array  # (PORT_VECTORS, m)
    stage: Array  # (stages, 3, n) q, v, a of each stage
    known: Array  # (stages, 3, m) the ports' u, u̇, ü at each stage
    scratch: Array  # (64,)
    counters: Array  # (COUNTERS,) steps, stages, Newton iterations, rejected steps, factorisations, worst residual,
    # steps that missed the tolerance
    frames: Array  # (stages, FRAME_SIZE) the frame's motion at each stage
    guides: Array  # (c, 3) side forces of a guided piston's layers and its friction, as a stage last found them
    pressures: Array  # (stages, c) cylinder pressures at each stage
    inputs: Array  # (INPUT_ROWS, c + OTHER_INPUTS) the reconstructed inputs
    powers: Array  # (POWERS,) of gas and friction as last observed, W
    backup: Array  # (2, state) state at the start of a communication step and of a sub-step
    family: NDArray[np.int64]  # (2,) addresses of the integrator's kernels: its step, the difference from its embedded
    # solution
    build: NDArray[np.void]  # (0,) see core.build_mark


def make_work(model: ModelArrays, state_size: int) -> Work:
    """Allocate the workspace of one model; compiles its integrator's kernels."""
    d = dimensions(model)
    n, m = d.modes, d.ports
    z = np.zeros
    work = Work(
        key=z((FACTOR_SLOTS, KEYS)),
        turning=_factors(d.turning_modes, d.turning_ports),
        block=_factors(model.block_ports.shape[1], model.block_ports.shape[0]),
        relative=z((d.newton, d.newton)),
        jacobian=z((d.newton, d.newton)),
        blocks=z((model.connections.shape[0], 16)),
        factored=z((model.connections.shape[0], 16)),
        modal=z((MODAL_VECTORS, n)),
        port=z((PORT_VECTORS, m)),
        stage=z((MAX_STAGES, 3, n)),
        known=z((MAX_STAGES, 3, m)),
        scratch=z(64),
        counters=z(COUNTERS),
        frames=z((MAX_STAGES, FRAME_SIZE)),
        guides=z((d.cylinders, 3)),
        pressures=z((MAX_STAGES, d.cylinders)),
        inputs=z((INPUT_ROWS, d.cylinders + OTHER_INPUTS)),
        powers=z(POWERS),
        backup=z((2, state_size)),
        family=z(2, dtype=np.int64),
        build=build_mark(),
    )
    kernels = family(model.stages)
    work.family[STEP_KERNEL] = kernel_address(resolve(kernels.step), model, work, np.zeros(state_size), 0, 0.0)
    if kernels.difference:
        work.family[DIFFERENCE_KERNEL] = kernel_address(resolve(kernels.difference), model, work, 0.0)
    return work


def _factors(n: int, m: int) -> Factors:
    z = np.zeros
    return Factors(z((n, n)), z((FACTOR_SLOTS, n, n)), z((FACTOR_SLOTS, m, n)), z((FACTOR_SLOTS, m, m)))
