"""Checks of stiffness over frequency of mounts, ``[[mount_dynamics]]``."""

from itertools import pairwise

from cranktrain.core.argument_checks import given_name
from cranktrain.core.errors import InputError, nearest
from cranktrain.engine.model import Engine
from cranktrain.engine.mount_dynamics import AXES, MountDynamics
from cranktrain.engine.quantities import check_values, need


def check_mount_dynamics(engine: Engine) -> None:
    """Raise ``InputError``, one line, for tables that contradict themselves, each other or the engine's mounts."""
    taken: dict[tuple[int, str], MountDynamics] = {}
    count = 0 if engine.mounts is None else len(engine.mounts.x)
    for number, one in enumerate(engine.mount_dynamics):
        where = f"mount_dynamics '{one.name}'"
        given_name(one.name, "mount_dynamics")
        need(
            where, "name", one.name not in [other.name for other in engine.mount_dynamics[:number]], "is taken already"
        )
        need(where, "mounts", count > 0, "the engine has no [mounts]; add that table")
        check_values(one, where)
        _check_values(one, where)
        for axis in one.axes:
            need(where, "axes", axis in AXES, f"no axis '{axis}'; {nearest(axis, AXES)}")
        for mount in one.mounts:
            need(where, "mounts", mount <= count, f"no mount {mount}; the engine has 1 to {count}")
            for axis in one.axes:
                other = taken.setdefault((mount, axis), one)
                alone = other is one or not (other.frequencies or one.frequencies)
                text = f"mount {mount} has '{other.name}' along {axis}; a table is the whole stiffness, leave one out"
                need(where, "mounts", alone, text)


def need_constant_mounts(engine: Engine) -> None:
    """Raise ``InputError`` for mounts over frequency, which a flexible block takes as bodies and connections alone."""
    if engine.mount_dynamics:
        raise InputError(
            f"engine '{engine.name}' has mounts over frequency, [[mount_dynamics]]; for a flexible block take the "
            "engine file that cranktrain mounts --output FILE.toml writes, with bodies and connections in their place"
        )


def _check_values(one: MountDynamics, where: str) -> None:
    need(where, "axes", len(one.axes) > 0, f"is empty; give some of {', '.join(AXES)}")
    need(where, "mounts", len(one.mounts) > 0, "is empty; give numbers of mounts, from 1")
    if one.fluid_stiffness:
        need(where, "frequencies", not one.frequencies, "a table does not go with fluid; leave one of them out")
        need(where, "fluid_damping", one.fluid_damping > 0.0, "is 0, so that the fluid would never come to rest")
        return
    rising = all(0.0 < low < high for low, high in pairwise(one.frequencies))
    need(where, "frequencies", len(one.frequencies) > 1 and rising, "needs two values or more, rising from above 0")
    for key in ("stiffness", "loss_factors"):
        found = len(getattr(one, key))
        need(where, key, found == len(one.frequencies), f"{found} values for {len(one.frequencies)} frequencies")
