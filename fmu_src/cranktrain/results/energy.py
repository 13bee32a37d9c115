"""Energy balance of the last cycle of a run: work of the gas, and where it goes.

The gas does the work ∮ (p − p_c) dV on pistons and heads. In a periodic motion all of it goes to the dynamometer and
the valve train, or turns into heat: in films by shear (friction torque times the speed of journal against bore) and by
squeeze (film force times the rate of the gap), in structures, mounts and shafts by their damping. Each part is the
integral of a power of the running model's own force laws at the samples of the cycle. The trapezoidal rule is used; for
smooth powers over a whole period its error vanishes faster than any power of the step. In a cycle that is not exactly
periodic, the energy of bodies and shafts changes. The change of their kinetic and elastic energy is a separate row; the
energy in springs of films and skirts is neglected. The residual measures how exactly a run solved its equations.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.slots import (
    ADDED_LOSS,
    AXIAL_FORCE_WORK,
    AXIAL_JOINT_LOSS,
    BIG_ENDS_SHEAR,
    BIG_ENDS_SQUEEZE,
    BLOCK_LOSS,
    CRANK_LOSS,
    DAMPER_LOSS,
    DYNAMOMETER_POWER,
    GAS_WORK,
    LINERS_LOSS,
    LINKS_LOSS,
    MAINS_SHEAR,
    MAINS_SQUEEZE,
    MOUNTS_LOSS,
    SHAFTS_LOSS,
    SKIRTS_LOSS,
    STORED,
    THRUST_LOSS,
    VALVE_POWER,
)


class Share(NamedTuple):
    """Part of the gas work: key of a summary, words, and its power's place in ``Work.powers``."""

    key: str
    words: str
    slot: int


SHARES = (
    Share("dynamometer", "work to the dynamometer", DYNAMOMETER_POWER),
    Share("valve_train", "work to the valve train", VALVE_POWER),
    Share("mains_shear", "main bearings, friction", MAINS_SHEAR),
    Share("mains_squeeze", "main bearings, radial and tilting motion", MAINS_SQUEEZE),
    Share("thrust_bearing", "thrust bearing", THRUST_LOSS),
    Share("big_ends_shear", "big ends, friction", BIG_ENDS_SHEAR),
    Share("big_ends_squeeze", "big ends, radial motion", BIG_ENDS_SQUEEZE),
    Share("liners_friction", "pistons along liners, friction", LINERS_LOSS),
    Share("skirts", "pistons across liners, damping", SKIRTS_LOSS),
    Share("damper", "torsional damper", DAMPER_LOSS),
    Share("crank_structure", "crankshaft, structural damping", CRANK_LOSS),
    Share("block_structure", "block, structural damping", BLOCK_LOSS),
    Share("mounts", "engine mounts", MOUNTS_LOSS),
    Share("shafts", "drive line, damping of shafts and discs", SHAFTS_LOSS),
    Share("axial_joint", "axial joint, friction and damping", AXIAL_JOINT_LOSS),
    Share("connections", "added connections", LINKS_LOSS),
    Share("added_bodies", "added bodies, structural damping", ADDED_LOSS),
    Share("axial_force", "work against the axial force", AXIAL_FORCE_WORK),
)
"""All energy losses: a loss is an entry of ``Work.powers``, which an observer fills, and a row here."""


def energy_balance(powers: Array, step: float) -> dict[str, Any]:
    """Energies (J) of a cycle from powers (n + 1, POWERS), W, at samples ``step`` (s) apart, both ends included.

    ``stored_j`` is the energy gained by bodies and shafts, ``residual_j`` the gas work that is not accounted for.
    """
    works = np.asarray(np.trapezoid(powers, dx=step, axis=0))
    gas = float(works[GAS_WORK])
    losses = {share.key: float(works[share.slot]) for share in SHARES}
    stored = float(powers[-1, STORED] - powers[0, STORED])
    residual = gas - sum(losses.values()) - stored
    return {
        "gas_work_j": gas,
        "losses_j": losses,
        "stored_j": stored,
        "residual_j": residual,
        "residual_of_gas_work": residual / gas if gas != 0.0 else None,
    }
