"""Options for equipment of a new engine."""

from typing import NamedTuple

from cranktrain.core.errors import InputError, nearest

DAMPERS = ("rubber", "viscous")
FLYWHEELS = ("solid", "dual-mass")


class Equipment(NamedTuple):
    """Optional equipment: kind of ``damper`` or None, dual-mass flywheel, mounts with a block."""

    damper: str | None = None
    dual_mass: bool = False
    mounts: bool = False


BARE = Equipment()


def equipment(damper: str | None, flywheel: str, mounts: bool) -> Equipment:
    """Make the equipment from these options; ``InputError`` for an unknown word."""
    for option, word, words in (("damper", damper, DAMPERS), ("flywheel", flywheel, FLYWHEELS)):
        if word is not None and word not in words:
            raise InputError(f"--{option} '{word}' is not known; {nearest(word, words)}")
    return Equipment(damper, flywheel == FLYWHEELS[1], mounts)
