"""A torsional system from a table: discs, shafts between them, gears, branches and ground.

    [[disc]]                          [[shaft]]
    name = "flywheel"                 between = ["main[7]", "flywheel"]
    inertia = 0.87      # kg m2       stiffness = 1.9e6    # N m/rad
    damping = 0.0       # N m s/rad   damping = 2.0        # N m s/rad
                                      loss_factor = 0.0
                                      ratio = 1.0

A disc's ``damping`` is absolute, a shaft's is relative. ``ratio`` is that of a gear at the shaft's first end: the shaft
twists by ratio θ₁ − θ₂ and loads disc 1 by ratio times its torque. Without ``stiffness`` it is a rigid mesh,
θ₂ = ratio θ₁, and disc 2 is no coordinate of its own. ``"ground"`` in place of a disc is at rest. With the remaining
rotations, one a coordinate,

    M θ̈ + C θ̇ + K θ = T,    modes (K − ω² M) φ = 0, φᵀ M φ = 1,    damping c = φᵀ C φ + Σ η k Δφ²/ω

where the last term is the loss factor η of a shaft that twists by Δφ: as much energy a cycle as hysteresis takes.
What C couples between modes is left out of c.

Source: W. Ker Wilson, *Practical Solution of Torsional Vibration Problems*, vol. 1 (1956), geared and branched systems.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from scipy.linalg import eigh

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.reduced_body import Array, ReducedBody, check
from cranktrain.core.user_file import is_number, read_toml
from cranktrain.engine import quantities as q
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import kinds
from cranktrain.structure.crank.torsional import rigid_crank, shaft_nodes, with_twists

GROUND = "ground"
MOST_ROWS = 1000
FREE = 1.0e-6
"""ω over the highest below which a mode is a rigid rotation."""
ALIKE = 1.0e-6
"""Share by which rotations of a crank's nodes may differ as it turns as a whole."""


@dataclass(frozen=True)
class Disc:
    """One row of discs: kg m², N m s/rad."""

    name: str
    inertia: q.Inertia
    damping: q.TorsionalDamping = 0.0


@dataclass(frozen=True)
class Shaft:
    """One row of shafts: N m/rad, N m s/rad; without stiffness a rigid mesh of gears."""

    between: tuple[str, str]
    stiffness: q.TorsionalStiffness = 0.0
    damping: q.TorsionalDamping = 0.0
    loss_factor: Annotated[float, q.Quantity("1", 0.0, 10.0)] = 0.0
    ratio: Annotated[float, q.Quantity("1", -1000.0, 1000.0)] = 1.0


@dataclass(frozen=True)
class Chain:
    """The table."""

    discs: tuple[Disc, ...]
    shafts: tuple[Shaft, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the discs, in order."""
        return tuple(disc.name for disc in self.discs)


class ChainMatrices(NamedTuple):
    """Matrices (n, n) of the coordinates, and the discs' rotations (discs, n) in them."""

    mass: Array
    damping: Array
    stiffness: Array
    hysteresis: Array
    discs: Array


class ChainModes(NamedTuple):
    """Modes: ω (n,) rad/s, 0 for rigid rotations; rotations (discs, n) of unit modal mass; damping c (n,) 1/s."""

    omega: Array
    shapes: Array
    damping: Array


def is_chain(path: str | Path) -> bool:
    """Whether a file is a table of discs."""
    try:
        return Path(path).suffix == ".toml" and "disc" in read_toml(path, "chain", "")
    except InputError:
        return False


def read_chain(path: str | Path) -> Chain:
    """The table in a TOML file; ``InputError`` where it cannot be read, or describes no system."""
    content = read_toml(path, "table of discs and shafts", "give a table of [[disc]] and [[shaft]]")
    for key in content:
        if key not in ("disc", "shaft"):
            raise InputError(f"{path}: '{key}' is no part of a chain; {nearest(key, ('disc', 'shaft'))}")
    for part in ("disc", "shaft"):
        if not isinstance(content.get(part, []), list):
            raise InputError(f"{path}: {part} is no list of tables; write [[{part}]] before each row")
        if len(content.get(part, [])) > MOST_ROWS:
            raise InputError(f"{path}: {len(content[part])} rows of {part}; a chain has at most {MOST_ROWS}")
    discs = tuple(Disc(**_row(path, "disc", k, row, Disc)) for k, row in enumerate(content.get("disc", []), 1))
    shafts = tuple(Shaft(**_row(path, "shaft", k, row, Shaft)) for k, row in enumerate(content.get("shaft", []), 1))
    chain = Chain(discs, shafts)
    _check(path, chain)
    return chain


def _row(path: str | Path, part: str, number: int, row: Any, kind: type) -> dict[str, Any]:
    """Values of one row, checked one by one."""
    where, valid = f"{path}: {part} {number}", tuple(field.name for field in fields(kind))
    values: dict[str, Any] = {}
    if not isinstance(row, Mapping):
        raise InputError(f"{where}: {shown(row)} is no table; write [[{part}]] before its keys")
    for key, value in row.items():
        if key not in valid:
            raise InputError(f"{where}: '{key}' does not exist; {nearest(key, valid)}")
        if key == "name":
            if not isinstance(value, str) or not value or value == GROUND:
                raise InputError(f"{where}: name {shown(value)} names no disc; give a text other than '{GROUND}'")
        elif key == "between":
            if not (isinstance(value, list) and len(value) == 2 and value[0] != value[1]):
                raise InputError(f'{where}: between = {shown(value)} names no two discs; write between = ["a", "b"]')
            value = tuple(value)
        else:
            if not is_number(value):
                raise InputError(f"{where}: {key} = {shown(value)} is no number")
            if wrong := kinds(kind)[key][2].wrong(value):
                raise InputError(f"{where}: {key}: {wrong}")
            if key == "ratio" and value == 0.0:
                raise InputError(f"{where}: ratio = 0 turns nothing; give the speed of disc 2 over that of disc 1")
            value = float(value)
        values[key] = value
    for key in ("name", "inertia") if kind is Disc else ("between",):
        if key not in values:
            raise InputError(f"{where}: '{key}' is missing; add it")
    return values


def _check(path: str | Path, chain: Chain) -> None:
    """Refuse discs of one name, ends that are no discs, gears that hold each other, and discs that nothing joins."""
    if not chain.discs:
        raise InputError(f"{path}: has no disc; add [[disc]] rows")
    for name in chain.names:
        if chain.names.count(name) > 1:
            raise InputError(f"{path}: disc '{name}' is there {chain.names.count(name)} times; name each once")
    for k, shaft in enumerate(chain.shafts, 1):
        for end in shaft.between:
            if end != GROUND and end not in chain.names:
                raise InputError(f"{path}: shaft {k}: '{end}' is no disc; {nearest(str(end), (*chain.names, GROUND))}")
        if shaft.stiffness == 0.0 and (shaft.loss_factor > 0.0 or shaft.damping > 0.0 or GROUND in shaft.between):
            raise InputError(f"{path}: shaft {k}: a rigid mesh joins two discs and has no damping; give it a stiffness")
    reached, before = {chain.names[0]}, 0
    while len(reached) > before:
        before = len(reached)
        for shaft in chain.shafts:
            if reached & set(shaft.between):
                reached |= set(shaft.between)
    lost = [name for name in chain.names if name not in reached]
    if lost:
        raise InputError(f"{path}: no shaft joins disc '{lost[0]}' to '{chain.names[0]}'; add one")
    _coordinates(chain, path)


def _coordinates(chain: Chain, path: str | Path = "chain") -> Array:
    """Rotations (discs, n) of the discs by the coordinates that rigid meshes leave."""
    # Every disc turns by a factor times the leader of its group.
    leader, factor = list(range(len(chain.discs))), np.ones(len(chain.discs))
    for k, shaft in enumerate(chain.shafts, 1):
        if shaft.stiffness > 0.0:
            continue
        one, two = (chain.names.index(end) for end in shaft.between)
        if leader[one] == leader[two]:
            raise InputError(f"{path}: shaft {k}: rigid meshes form a ring; leave one out, or give one a stiffness")
        scale = shaft.ratio * factor[one] / factor[two]
        for disc in [disc for disc, of in enumerate(leader) if of == leader[two]]:
            factor[disc] *= scale
            leader[disc] = leader[one]
    kept = sorted(set(leader))
    return np.asarray(factor[:, None] * (np.array(leader)[:, None] == np.array(kept)[None, :]))


def chain_matrices(chain: Chain) -> ChainMatrices:
    """Mass, damping, stiffness, and η k of the shafts, in the coordinates that rigid meshes leave."""
    turns = _coordinates(chain)
    full = np.zeros((3, len(chain.discs), len(chain.discs)))
    for shaft in chain.shafts:
        twist = np.zeros(len(chain.discs))
        for end, sign in zip(shaft.between, (shaft.ratio, -1.0), strict=True):
            if end != GROUND:
                twist[chain.names.index(end)] += sign
        square = np.outer(twist, twist)
        for matrix, value in zip(
            full, (shaft.damping, shaft.stiffness, shaft.loss_factor * shaft.stiffness), strict=True
        ):
            matrix += value * square
    full[0] += np.diag([disc.damping for disc in chain.discs])
    mass = turns.T @ np.diag([disc.inertia for disc in chain.discs]) @ turns
    damping, stiffness, hysteresis = (turns.T @ matrix @ turns for matrix in full)
    return ChainMatrices(mass, damping, stiffness, hysteresis, turns)


def chain_modes(chain: Chain) -> ChainModes:
    """Undamped modes by rising frequency, with the damping of each."""
    m = chain_matrices(chain)
    squares, modes = eigh(m.stiffness, m.mass)
    omega = np.sqrt(np.maximum(squares, 0.0))
    omega[omega < FREE * omega[-1]] = 0.0
    taken = np.einsum("ij,ik,kj->j", modes, m.hysteresis, modes) / np.where(omega > 0.0, omega, np.inf)
    return ChainModes(omega, m.discs @ modes, np.einsum("ij,ik,kj->j", modes, m.damping, modes) + taken)


def chain_body(engine: Engine, chain: Chain) -> ReducedBody:
    """Bare crankshaft of level ``torsional`` from a table in place of the engine's dimensions.

    Discs named ``pulley``, ``main[1]`` … and ``flywheel`` are the shaft's nodes; others are branches. Inertias are
    those of the crankshaft alone: flywheel, pulley, rods and pistons come from the engine file. Mass and moments of
    inertia across the axis follow from the dimensions. Raises ``InputError``: a node that is missing, a crank that
    ground holds, or that does not turn as one.
    """
    base, nodes = rigid_crank(engine), shaft_nodes(engine)
    for name in nodes:
        if name not in chain.names:
            raise InputError(f"chain of engine '{engine.name}' has no disc '{name}'; {nearest(name, chain.names)}")
    modes = chain_modes(chain)
    at = [chain.names.index(name) for name in nodes]
    rigid = modes.shapes[at, 0]
    if np.count_nonzero(modes.omega == 0.0) != 1 or np.ptp(rigid) > ALIKE * np.abs(rigid).max():
        raise InputError(
            f"chain of engine '{engine.name}' does not turn freely as one crank; leave ground out, and gears between "
            "its main journals"
        )
    turned = np.sqrt(base.inertia[2, 2]) * abs(float(rigid[0]))
    base = replace(base, shapes=base.shapes.copy(), euler_load=base.euler_load.copy(), inertia=base.inertia.copy())
    base.shapes[:, :, 5] *= turned
    base.euler_load[5] /= turned
    base.inertia[2, 2] /= turned**2
    z = np.array([base.positions[base.index(name), 2] for name in nodes])
    turns = np.stack([np.interp(base.positions[:, 2], z, shape[at]) for shape in modes.shapes[:, 1:].T], axis=1)
    digest = sha256(repr((base.digest, chain)).encode()).hexdigest()
    body = with_twists(base, modes.omega[1:], turns)
    body = replace(body, name=f"{engine.name} crankshaft, from a table", digest=digest)
    if np.any(modes.damping > 0.0):
        body = replace(body, damping=np.concatenate((np.zeros(5), modes.damping)))
    check(body)
    return body
