"""Sizes of a model, and rows of force laws that an engine has only once, for kernels; Python uses ``dimensions``."""

from cranktrain.core.kernel import inlined_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.topology.slots import MODES, OF_BLOCK, OF_CRANK, PORTS


@inlined_kernel
def crank_modes(model):
    """Number of the crank's modes, which come first among the rotating ones."""
    return int(model.layout[at.CRANK_MODES])


@inlined_kernel
def port_count(model):
    """Number of all ports of a model."""
    return int(model.layout[at.PORTS])


@inlined_kernel
def turning_modes(model):
    """Number of modes of the crank with all that turns with it, which come first."""
    return model.bodies.rows[OF_CRANK, MODES]


@inlined_kernel
def turning_ports(model):
    """Number of ports of the crank with all that turns with it, which come first."""
    return model.bodies.rows[OF_CRANK, PORTS]


@inlined_kernel
def block_modes(model):
    """Number of modes of the block, which come after the rotating ones; 0 on rigid ground."""
    return model.bodies.rows[OF_BLOCK, MODES]


@inlined_kernel
def block_port_count(model):
    """Number of ports of the block, which come after the rotating ones; 0 on rigid ground."""
    return model.bodies.rows[OF_BLOCK, PORTS]


@inlined_kernel
def first_piston(model):
    """Index of the first port of the guided pistons, whose ports are the last of a model."""
    return model.bodies.shapes.shape[0]


@inlined_kernel
def thrust_row(model):
    """Row of the thrust bearing among the connections."""
    return int(model.layout[at.THRUST_ROW])


@inlined_kernel
def collar_port(model):
    """Port of the thrust collar's displacement along its axis."""
    return model.connections[thrust_row(model), at.FIRST]


@inlined_kernel
def joint_row(model):
    """Row of the drive line's axial joint among the connections; −1 without a joint."""
    return int(model.layout[at.JOINT_ROW])


@inlined_kernel
def term_row(model):
    """First row of connections that act by sums of terms, not directly at ports as all connections before them do."""
    return int(model.layout[at.TERM_ROW])


@inlined_kernel
def of_ports(model):
    """True if the components of all connections are ports themselves, not motion relative to other ports."""
    return model.pairs.shape[0] == 0 and model.links.scales.shape[0] == 0


@inlined_kernel
def couples_modes(model):
    """True if rotation couples modes, by gyroscopic or centrifugal terms."""
    return model.layout[at.WHIRLS] > 0.0
