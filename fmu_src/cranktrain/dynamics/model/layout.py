"""Sizes of a model, and rows of force laws that an engine has only once, for kernels; Python uses ``dimensions``."""

from __future__ import annotations

from cranktrain.core.kernel import inlined_kernel
from cranktrain.dynamics.model import slots as at


@inlined_kernel
def crank_modes(model):
    """Number of the crank's modes, which come first among the rotating ones."""
    return int(model.layout[at.CRANK_MODES])


@inlined_kernel
def port_count(model):
    """Number of all ports of a model."""
    return int(model.layout[at.PORTS])


@inlined_kernel
def first_piston(model):
    """Index of the first port of the guided pistons, whose ports are the last of a model."""
    return model.ports.shape[0] + model.block_ports.shape[0] + model.bodies.shapes.shape[0]


@inlined_kernel
def thrust_row(model):
    """Row of the thrust bearing among the connections."""
    return int(model.layout[at.THRUST_ROW])


@inlined_kernel
def collar_port(model):
    """Port of the thrust collar's displacement along its axis."""
    return int(model.connections[thrust_row(model), at.FIRST])


@inlined_kernel
def joint_row(model):
    """Row of the drive line's axial joint among the connections; −1 without a joint."""
    return int(model.layout[at.JOINT_ROW])


@inlined_kernel
def damper_row(model):
    """Row of the damper among the connections; −1 without a damper."""
    return int(model.layout[at.DAMPER_ROW])


@inlined_kernel
def has_additions(model):
    """True if the model has added bodies or connections."""
    return model.layout[at.ADDED] > 0.0


@inlined_kernel
def couples_modes(model):
    """True if rotation couples modes, by gyroscopic or centrifugal terms."""
    return model.layout[at.WHIRLS] > 0.0
