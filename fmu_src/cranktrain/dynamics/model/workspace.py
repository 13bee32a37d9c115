"""Workspace of a running model, which the caller owns."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.build_mark import build_mark
from cranktrain.core.kernel import kernel_addresses, record
from cranktrain.core.memory import zeros
from cranktrain.core.named import resolve
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.records import ModelArrays, dimensions
from cranktrain.dynamics.model.state import MAX_STAGES
from cranktrain.dynamics.time.integrators import FAMILIES
from cranktrain.dynamics.time.table import FAMILY, HEAD
from cranktrain.dynamics.topology import slots as top
from cranktrain.dynamics.topology.records import Linear, LinkWork
from cranktrain.film.laws.films import NUMBERS, SIZE


@record
class StartRoom(NamedTuple):
    """Scratch of a run's start, see dynamics.start.mean_motion; n_b modes of the block."""

    mean: Array  # (START_MEAN,) estimate of the motion at the start, see dynamics.model.slots
    circle: Array  # (2, START_SAMPLES) cosines and sines
    torque: Array  # (START_SAMPLES,) torque on a rigid crank over a cycle, N m
    spectrum: Array  # (2, START_HARMONICS) spectrum of the torque, real and imaginary parts
    numbers: Array  # (NUMBERS,) arguments of force laws
    law: Array  # (SIZE,) result of a force law
    block: Array  # (START_ROWS, n_b) vectors of the block, see dynamics.model.slots
    matrix: Array  # (12, 12) of the block as a rigid body, complex numbers as pairs
    vectors: Array  # (2, 12)
    joined: Array  # (·, 6) equations of the crank's rigid motion with the block


@record
class Work(NamedTuple):
    """Workspace with factors, matrices and vectors of a stage. Results never depend on its earlier content."""

    key: Array  # (FACTOR_SLOTS, 2) step and speed that the factors of each slot were made for
    linear: Linear
    links: LinkWork
    relative: Array  # (n, n) compliance of the relative motion of all connections, transposed
    turned: Array  # (c, 2) motion of each pin by rotation of the crank beyond its shape, m/rad, see motion.turned_pins
    turned_compliance: Array  # (n, n) compliance ``relative`` for a crank that has turned, transposed
    jacobian: Array  # (n_newton, n_newton), padded to a multiple of four for vectors of four
    blocks: Array  # (k, 16) force tangents of each connection, 4 × 4 row-major
    factored: Array  # (k, 16) force tangents from which the Newton matrix was made
    modal: Array  # (MODAL_VECTORS, n) vectors over all modes, see dynamics.model.slots
    port: Array  # (PORT_VECTORS, m) vectors over all ports, see dynamics.model.slots
    stage: Array  # (stages, 3, n) q, v, a of each stage
    known: Array  # (stages, 3, m) the ports' u, u̇, ü at each stage
    scratch: Array  # (64,)
    counters: Array  # (COUNTERS,) counts of steps, stages, iterations and others, see dynamics.model.slots
    frames: Array  # (stages + 1, FRAME_SIZE) the frame's motion at each stage; the last row: at the state
    gas: Array  # (c, GAS) see dynamics.model.slots
    found: Array  # (k, SIZE) result of each connection's law at the state, see film.laws.films
    told: Array  # (k, TOLD_SPEEDS) speeds that the law was told there, see dynamics.model.slots
    pressures: Array  # (stages, 2c) cylinder pressures at each stage, then given pressures as functions of time
    inputs: Array  # (INPUT_ROWS, i) the reconstructed inputs
    input_rates: Array  # (i,) rates (1/s) of inputs that a driver gives for the next communication step, else NaN
    # Row 0 of ``staged``: number of given stages, number of stages, internal step (rad).
    # Further rows of ``staged``, one for each stage: its time as a fraction of a step, and its inputs.
    staged: Array  # (1 + MAX_STAGES, 1 + i) inputs at the stages of the next communication step
    powers: Array  # (POWERS,) powers of gas, losses and dynamometer as last observed, W, and the energy stored, J
    # Rows of ``backup``: state at the start of a communication step, at the start of a part of a sub-step, and before a
    # step under way is ended at a communication point.
    backup: Array  # (3, state) copies of the state
    # Columns of ``family``: kernel of a step, and kernel of its difference from the embedded solution; 0 if not used.
    family: NDArray[np.int64]  # (families, 2) addresses of the integrators' kernels, by family
    start: StartRoom
    build: NDArray[np.void]  # (0,) see core.build_mark


def make_work(model: ModelArrays, state_size: int, integrators: bool = False, input_rates: Array | None = None) -> Work:
    """Allocate the workspace of one model. Compile the kernels of its integrator, or of all if ``integrators`` is True.

    ``input_rates`` is an array that the driver of the run writes in place.
    """
    d = dimensions(model)
    n, fours = d.modes, -4 * (-d.newton // 4)
    m = max(d.ports, fours)
    inputs = at.OTHER_INPUTS + at.CYLINDER_INPUTS * d.cylinders
    z, slots, links = zeros, at.FACTOR_SLOTS, model.links
    (rows, width), ports = model.bodies.gyroscopic.shape, model.bodies.shapes.shape[0]
    work = Work(
        key=z((at.FACTOR_SLOTS, at.KEYS)),
        linear=Linear(
            z((width, width)),
            z((slots, rows, width)),
            z((slots, ports, width)),
            z((slots, ports, model.bodies.transposed.shape[1])),
        ),
        links=LinkWork(
            z((len(links.frames), top.MOVED)),
            z((len(links.terms), 2)),
            z((top.GAPS, len(links.scales))),
            z(m),
            z((len(model.bodies.rows), 2)),
            z((1, fours)),
            np.full(top.SIZES, np.nan),
        ),
        relative=z((d.newton, d.newton)),
        turned=z((d.cylinders, 2)),
        turned_compliance=z((d.newton, d.newton)),
        jacobian=z((fours, fours)),
        blocks=z((model.connections.shape[0], 16)),
        factored=z((model.connections.shape[0], 16)),
        modal=z((at.MODAL_VECTORS, n)),
        port=z((at.PORT_VECTORS, m)),
        stage=z((MAX_STAGES, 3, n)),
        known=z((MAX_STAGES, 3, m)),
        scratch=z(64),
        counters=z(at.COUNTERS),
        frames=z((MAX_STAGES + 1, at.FRAME_SIZE)),
        gas=z((d.cylinders, at.GAS)),
        found=z((model.connections.shape[0], SIZE)),
        told=z((model.connections.shape[0], at.TOLD_SPEEDS)),
        pressures=z((MAX_STAGES, 2 * d.cylinders)),
        inputs=z((at.INPUT_ROWS, inputs)),
        input_rates=np.full(inputs, np.nan) if input_rates is None else input_rates,
        staged=z((1 + MAX_STAGES, 1 + inputs)),
        powers=z(at.POWERS),
        backup=z((3, state_size)),
        family=np.zeros((len(FAMILIES), 2), dtype=np.int64),
        start=start_room(model),
        build=build_mark(),
    )
    own = int(model.stages[HEAD, FAMILY])
    rows = {row: kernels for row, kernels in enumerate(FAMILIES.values()) if integrators or row == own}
    steps = [resolve(kernels.step) for kernels in rows.values()]
    work.family[list(rows), at.STEP_KERNEL] = kernel_addresses(steps, model, work, np.zeros(state_size), 0, 0.0)
    differing = {row: resolve(kernels.difference) for row, kernels in rows.items() if kernels.difference}
    work.family[list(differing), at.DIFFERENCE_KERNEL] = kernel_addresses(differing.values(), model, work, 0.0)
    return work


def start_room(model: ModelArrays) -> StartRoom:
    """Allocate the scratch for finding the start of a run of one model."""
    z = np.zeros
    joined = 2 * len(model.pairs) + len(model.axial)
    return StartRoom(
        z(at.START_MEAN), z((2, at.START_SAMPLES)), z(at.START_SAMPLES), z((2, at.START_HARMONICS)), z(NUMBERS),
        z(SIZE), z((at.START_ROWS, model.block_ports.shape[1])), z((12, 12)), z((2, 12)), z((joined + 5, 6)),
    )  # fmt: skip
