"""Mounts with internal states in the running model: bodies and connections that an engine file could state as well.

Each branch of a mount is a body of its mass at the mount. A spring joins it to the block's mount along the branch's
axis, a damper to the ground. Springs to the ground hold its other directions, which nothing loads. Moved fluid has no
weight, so that a steady force carries the body; it is the weight at :data:`Settings.gravity`.
"""

from dataclasses import replace
from typing import Any

from cranktrain.core.errors import InputError
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine import connections as laws
from cranktrain.engine.additions import BodyTable, ConnectionTable
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.engine.mount_dynamics import AXES
from cranktrain_lab.mounts.body import rigid_engine
from cranktrain_lab.mounts.stiffness import BAD, DIRECTIONS, Branch, support_of, with_states

QUICK = 6.0e4
"""Rate c_b/m_b, 1/s, of the small mass that a branch without mass gets: 10 % of its damper's force at 1000 Hz."""
HELD = 600.0
"""Natural frequency, rad/s, of a body in the directions in which it is held."""
SIZE = 0.05
"""Radius of gyration of a body, m; bodies do not turn, because forces act in their centres."""


def running_engine(engine: Engine) -> tuple[Engine, float]:
    """Engine whose mounts over frequency are constants, bodies and connections, and the error of the fits to tables.

    Raises ``InputError`` as :func:`support_of`, and for a table that no passive mount has.
    """
    support, error = with_states(support_of(engine, rigid_engine(engine).centre))
    refuse_bad_fit(error)
    assert engine.mounts is not None  # support_of has refused such an engine
    values: dict[str, Any] = {}
    for noun, all_of in (("stiffness", support.stiffness), ("damping", support.damping)):
        for k, axis in enumerate(AXES):
            values[f"{noun}_{axis}"] = tuple(map(float, all_of[k::DIRECTIONS]))
    bodies, connections = [], []
    for number, branch in enumerate(support.branches, start=1):
        body, own = _parts(engine.mounts.positions, branch, f"mount_branch_{number}")
        bodies.append(body)
        connections += own
    made = replace(
        engine, mounts=replace(engine.mounts, **values), mount_dynamics=(),
        body=(*engine.body, *bodies), connection=(*engine.connection, *connections),
    )  # fmt: skip
    return load_engine(made), error


def refuse_bad_fit(error: float) -> None:
    """Raise ``InputError`` if the fit of a table misses it by more than :data:`BAD`."""
    if error > BAD:
        raise InputError(
            f"mount_dynamics: the best stable mount differs from a table by {100.0 * error:.0f} %, so that it cannot "
            "run in time; check its frequencies, and that stiffness rises where the loss factor is high"
        )


def _parts(
    places: tuple[tuple[float, float, float], ...], branch: Branch, name: str
) -> tuple[BodyTable, list[ConnectionTable]]:
    """Body of a branch, and its connections: spring to the block, damper and holding springs to the ground, weight."""
    mount, axis = divmod(branch.row, DIRECTIONS)
    mass = branch.mass or branch.damping / QUICK
    place = places[mount]
    body = BodyTable(
        name=name, mass=mass, inertia=3 * (mass * SIZE**2,), centre=place, interfaces=("centre",),
        x=(place[0],), y=(place[1],), z=(place[2],),
    )  # fmt: skip
    centre = f"{name}.centre"
    along = [float(k == axis) for k in range(3)]
    held = laws.Spring(
        stiffness=tuple((1.0 - one) * mass * HELD**2 for one in along),
        damping=tuple(one * branch.damping + (1.0 - one) * 0.2 * mass * HELD for one in along),
        turning_stiffness=3 * (mass * (SIZE * HELD) ** 2,),
        turning_damping=3 * (0.2 * mass * SIZE**2 * HELD,),
    )
    pull = laws.Spring(stiffness=tuple(one * branch.stiffness for one in along))
    weight = laws.Load(force=(0.0, mass * Settings().gravity, 0.0))
    return body, [
        ConnectionTable(f"{name}_spring", "spring", (f"block.mount[{mount + 1}]", centre), spring=pull),
        ConnectionTable(f"{name}_damper", "spring", (centre, "ground"), spring=held),
        ConnectionTable(f"{name}_weight", "load", (centre, "ground"), load=weight),
    ]
