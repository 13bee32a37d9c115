"""Hooks that a stage calls if bodies or connections are added; each is a kernel at its address.

A run without additions compiles none of them, and its stages cost only one comparison more.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cranktrain.core.kernel import law_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.added_bodies import (
    added_answer,
    added_to_ports,
    factor_added,
    load_added,
    move_added_freely,
    recover_added,
)
from cranktrain.dynamics.motion.added_connections import (
    follow_links,
    link_compliance,
    link_forces,
    link_size,
    link_steps,
    turn_terms,
)
from cranktrain.dynamics.motion.added_memory import (
    close_link_stage,
    close_links,
    fastest_link,
    open_link_stage,
    open_links,
)
from cranktrain.dynamics.motion.linear_algebra import factor_sparse_rows, solve_rows
from cranktrain.dynamics.motion.newton_matrix import fill_jacobian
from cranktrain.dynamics.topology import slots as added


@law_kernel
def factor_hook(model, work, level, c_q, c_v, omega, holding):
    """Make S⁻¹, responses and compliances of added bodies. Return 0, or 1 if a matrix S is singular."""
    return factor_added(model, work, level, c_q, c_v, omega, holding)


@law_kernel
def load_hook(model, work, frame, displaced, out):
    """Compute the modal force of frame and gravity on added bodies. Return 0."""
    load_added(model, work, frame, displaced, out)
    return 0


@law_kernel
def compliance_hook(model, work, frame, slot):
    """Write the compliance of added components to ``work.relative``, after the engine's components. Return 0."""
    turn_terms(model, work, frame[at.THETA], frame[at.WHIRL])
    link_compliance(model, work, frame[at.COS], frame[at.SIN], slot, work.relative)
    return 0


@law_kernel
def move_hook(model, work, frame, number, slot, c_q, c_v, omega):
    """Compute the motion of added bodies without forces at their ports. Return 0."""
    move_added_freely(model, work, frame, number, slot, c_q, c_v, omega)
    return 0


@law_kernel
def steps_hook(model, work, step):
    """Compute the change of the added components from a ``step`` (m,) of all ports. Return 0."""
    link_steps(model, work, step, work.added.gaps[added.STEP])
    return 0


@law_kernel
def newton_hook(model, work):
    """Make and factorise the Newton matrix with added connections, from the tangents found last.

    Components of one added body alone are eliminated first, because they do not couple with those of another body. Only
    components of crank and block fill the matrix. Returns 0, or 1 if the matrix is singular.
    """
    for k in range(work.added.blocks.shape[0]):
        for j in range(work.added.blocks.shape[1]):
            work.added.factored[k, j] = work.added.blocks[k, j]
    n = model.scales.shape[0] + model.links.scales.shape[0]
    fill_jacobian(work.relative, model.links.table, work.added.factored, n, work.jacobian)
    order = model.links.order
    whole = work.added.permuted
    for i in range(n):
        row = work.jacobian[int(order[i])]
        for j in range(n):
            whole[i, j] = row[int(order[j])]
    for i in range(n):
        for j in range(n):
            work.jacobian[i, j] = whole[i, j]
    return factor_sparse_rows(work.jacobian, work.jacobian.shape[0])


@law_kernel
def solve_hook(model, work):
    """Solve for the Newton step of all components, in place in ``work.port[U_STEP]`` and in the gaps. Returns 0."""
    own = model.scales.shape[0]
    count = model.links.scales.shape[0]
    step = work.port[at.U_STEP]
    whole = work.added.newton[0]
    for k in range(whole.shape[0]):
        whole[k] = 0.0
    order = model.links.order
    for k in range(own + count):
        j = int(order[k])
        whole[k] = step[j] if j < own else work.added.gaps[added.STEP, j - own]
    solve_rows(work.jacobian, work.jacobian.shape[0], work.added.newton, 0)
    for k in range(own + count):
        j = int(order[k])
        if j < own:
            step[j] = whole[k]
        else:
            work.added.gaps[added.STEP, j - own] = whole[k]
    return 0


@law_kernel
def size_hook(model, work):
    """Compute the sizes of the added components' Newton step. Return 0."""
    link_size(model, work)
    return 0


@law_kernel
def follow_hook(model, work, f):
    """Add the change of the added connections' forces by the step to f (m,). Returns 0."""
    follow_links(model, work, work.added.gaps[added.STEP], f)
    return 0


@law_kernel
def recover_hook(model, work, slot, f, q):
    """Add the response of added bodies to forces at the ports to their motion. Returns 0."""
    recover_added(model, work, slot, f, q)
    return 0


@law_kernel
def ports_hook(model, q, u):
    """Compute the motion of the ports of added bodies from modal motion. Return 0."""
    added_to_ports(model, q, u)
    return 0


@law_kernel
def answer_hook(model, work, slot, f, u):
    """Add the displacements of added bodies by forces at their ports. Returns 0."""
    added_answer(model, work, slot, f, u)
    return 0


@law_kernel
def forces_hook(model, work, frame, pressures, ratio):
    """Evaluate forces and tangents of added connections. Return 0, or the status of a law that failed."""
    return link_forces(model, work, frame, pressures, ratio)


@law_kernel
def open_step_hook(model, work, state):
    """Pass to added connections their memory at the start of a step. Return 0."""
    open_links(model, work, state)
    return 0


@law_kernel
def open_stage_hook(model, work, stage, elapsed, h, gain):
    """Pass the times of a stage to added connections with a memory. Returns 0."""
    open_link_stage(model, work, stage, elapsed, h, gain)
    return 0


@law_kernel
def close_stage_hook(model, work, frame):
    """Solve added connections with a memory at the stage's ports. Returns 0, or the status of a law that failed."""
    return close_link_stage(model, work, frame)


@law_kernel
def close_step_hook(model, work, state):
    """Write the memory of added connections to the state. Returns 0."""
    close_links(model, work, state)
    return 0


@law_kernel
def rate_hook(model, work, state):
    """Write to ``work.added.sizes`` the largest rate at which the gap of an added bearing closes. Return 0."""
    work.added.sizes[added.CLOSING] = fastest_link(model, work, state)
    return 0


def hooks(model: Any, work: Any) -> list[tuple[Any, tuple[Any, ...]]]:
    """Kernel of each hook in the order of the slots, with sample arguments of the right types."""
    x = np.zeros(1)
    return [
        (factor_hook, (model, work, 0, 0.0, 0.0, 0.0, 0.0)),
        (load_hook, (model, work, x, x, x)),
        (compliance_hook, (model, work, x, 0)),
        (move_hook, (model, work, x, 0, 0, 0.0, 0.0, 0.0)),
        (steps_hook, (model, work, x)),
        (newton_hook, (model, work)),
        (solve_hook, (model, work)),
        (size_hook, (model, work)),
        (follow_hook, (model, work, x)),
        (recover_hook, (model, work, 0, x, x)),
        (ports_hook, (model, x, x)),
        (answer_hook, (model, work, 0, x, x)),
        (forces_hook, (model, work, x, x, 0.0)),
        (open_step_hook, (model, work, x)),
        (open_stage_hook, (model, work, 0, 0.0, 0.0, 0.0)),
        (close_stage_hook, (model, work, x)),
        (close_step_hook, (model, work, x)),
        (rate_hook, (model, work, x)),
    ]
