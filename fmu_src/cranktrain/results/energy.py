"""Energy balance of the last cycle of a run: work of the gas, and its distribution over load and losses.

The gas does the work ∮ (p − p_c) dV on pistons and heads. In a periodic motion this work goes to the dynamometer and
the valve train, or is dissipated: in films by shear (friction torque times the speed of journal against bore) and by
squeeze (film force times the rate of the gap), in structures, mounts and shafts by their damping. Each part is the
integral of a power of the running model's own force laws at the samples of the cycle. The trapezoidal rule is used; for
smooth powers over a whole period its error vanishes faster than any power of the step. In a cycle that is not exactly
periodic, the energy of bodies and shafts changes. The change of their kinetic and elastic energy is a separate row; the
energy in springs of films and skirts is neglected. The residual measures how exactly a run solved its equations.
"""

from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at


class Share(NamedTuple):
    """Part of the gas work: key in a summary, text in a table, and index of the part's power in ``Work.powers``."""

    key: str
    words: str
    slot: int


SHARES = (
    Share("dynamometer", "work to the dynamometer", at.DYNAMOMETER_POWER),
    Share("valve_train", "work to the valve train", at.VALVE_POWER),
    Share("mains_shear", "main bearings, friction", at.MAINS_SHEAR),
    Share("mains_squeeze", "main bearings, radial and tilting motion", at.MAINS_SQUEEZE),
    Share("thrust_bearing", "thrust bearing", at.THRUST_LOSS),
    Share("big_ends_shear", "big ends, friction", at.BIG_ENDS_SHEAR),
    Share("big_ends_squeeze", "big ends, radial motion", at.BIG_ENDS_SQUEEZE),
    Share("liners_friction", "pistons along liners, friction", at.LINERS_LOSS),
    Share("skirts", "pistons across liners, damping", at.SKIRTS_LOSS),
    Share("damper", "torsional damper", at.DAMPER_LOSS),
    Share("crank_structure", "crankshaft, structural damping", at.CRANK_LOSS),
    Share("block_structure", "block, structural damping", at.BLOCK_LOSS),
    Share("mounts", "engine mounts", at.MOUNTS_LOSS),
    Share("shafts", "drive line and a crank's table, damping of shafts and discs", at.SHAFTS_LOSS),
    Share("axial_joint", "axial joint, friction and damping", at.AXIAL_JOINT_LOSS),
    Share("connections", "added connections", at.LINKS_LOSS),
    Share("added_bodies", "added bodies, structural damping", at.BODIES_LOSS),
    Share("axial_force", "work against the axial force", at.AXIAL_FORCE_WORK),
)
"""All parts of the gas work. A new loss needs an account, a slot of ``Work.powers``, and a row here."""


def energy_balance(powers: Array, step: float) -> dict[str, Any]:
    """Energies (J) of a cycle from powers (n + 1, POWERS), W, at time steps of ``step`` (s), both ends included.

    ``stored_j`` is the energy gained by bodies and shafts, ``residual_j`` the residual of the balance.
    """
    works = np.asarray(np.trapezoid(powers, dx=step, axis=0))
    gas = float(works[at.GAS_WORK])
    losses = {share.key: float(works[share.slot]) for share in SHARES}
    stored = float(powers[-1, at.STORED] - powers[0, at.STORED])
    residual = gas - sum(losses.values()) - stored
    return {
        "gas_work_j": gas,
        "losses_j": losses,
        "stored_j": stored,
        "residual_j": residual,
        "residual_of_gas_work": residual / gas if gas != 0.0 else None,
    }
