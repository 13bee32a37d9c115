"""Sizes of a model, and rows of the laws that an engine has once, for kernels; Python asks ``dimensions``."""

from __future__ import annotations

from cranktrain.core.kernel import inlined_kernel
from cranktrain.dynamics.model import slots as at


@inlined_kernel
def crank_modes(model):
    """Modes of the crank, the first of those that turn."""
    return int(model.layout[at.CRANK_MODES])


@inlined_kernel
def port_count(model):
    """Ports in all."""
    return int(model.layout[at.PORTS])


@inlined_kernel
def first_piston(model):
    """First port of guided pistons, which come last."""
    return model.ports.shape[0] + model.block_ports.shape[0] + model.bodies.shapes.shape[0]


@inlined_kernel
def thrust_row(model):
    """Row of the thrust bearing."""
    return int(model.layout[at.THRUST_ROW])


@inlined_kernel
def collar_port(model):
    """Displacement of the thrust bearing's collar along its axis."""
    return int(model.connections[thrust_row(model), at.FIRST])


@inlined_kernel
def joint_row(model):
    """Row of the drive line's axial joint, −1: none."""
    return int(model.layout[at.JOINT_ROW])


@inlined_kernel
def damper_row(model):
    """Row of the damper, −1: none."""
    return int(model.layout[at.DAMPER_ROW])


@inlined_kernel
def has_additions(model):
    """Whether bodies or connections are added."""
    return model.layout[at.ADDED] > 0.0


@inlined_kernel
def couples_modes(model):
    """Whether turning couples modes."""
    return model.layout[at.WHIRLS] > 0.0
