"""Modes of a torsional system of discs and shafts (:mod:`cranktrain.engine.torsional_chain`), and a crank made of it.

With the independent rotations (rigid gear meshes eliminate the others) as coordinates,

    M θ̈ + C θ̇ + K θ = T,    modes (K − ω² M) φ = 0, φᵀ M φ = 1,    damping c = φᵀ C φ + Σ η k Δφ²/ω

where the last term is the viscous damping with the same energy loss per cycle as the loss factor η of a shaft that
twists by Δφ. The damping c leaves out the coupling between modes by C.

Source: W. Ker Wilson, *Practical Solution of Torsional Vibration Problems*, vol. 1 (1956), geared and branched systems.
"""

from dataclasses import replace
from hashlib import sha256
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import eigh

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import Array, ReducedBody, check
from cranktrain.engine.line_elements import Shaft
from cranktrain.engine.model import Engine
from cranktrain.engine.torsional_chain import GROUND, Chain, coordinates
from cranktrain.structure.crank.torsional import rigid_crank, with_twists

FREE = 1.0e-6
"""Fraction of the highest ω below which a mode counts as a rigid rotation."""
ALIKE = 1.0e-6
"""Relative tolerance within which a crank's nodes must rotate equally in its rigid rotation."""


class ChainMatrices(NamedTuple):
    """Matrices (n, n) for n independent rotations, and the map (discs, n) from these to the rotations of all discs."""

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


def chain_matrices(chain: Chain) -> ChainMatrices:
    """Mass, damping, stiffness and hysteresis (η k of the shafts) matrices in the independent rotations."""
    turns = coordinates(chain)
    full = np.zeros((3, len(chain.discs), len(chain.discs)))
    for shaft in chain.shafts:
        twist = _twist(chain, shaft)
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
    """Undamped modes of a torsional system in order of rising frequency, with the modal damping of each."""
    m = chain_matrices(chain)
    squares, modes = eigh(m.stiffness, m.mass)
    omega = np.sqrt(np.maximum(squares, 0.0))
    omega[omega < FREE * omega[-1]] = 0.0
    taken = np.einsum("ij,ik,kj->j", modes, m.hysteresis, modes) / np.where(omega > 0.0, omega, np.inf)
    return ChainModes(omega, m.discs @ modes, np.einsum("ij,ik,kj->j", modes, m.damping, modes) + taken)


def chain_body(engine: Engine, chain: Chain) -> ReducedBody:
    """Bare crankshaft of level ``torsional`` from a table in place of the engine's dimensions.

    Discs ``pulley``, ``flywheel``, ``pin[1]`` … and ``main[1]`` … are positions on the crank; other discs are branches.
    Rods and gas act at the pins. A pin without a disc of its name rotates with the one disc that shafts join to both
    neighbouring mains, if there is one, else its rotation is interpolated between these mains. The rotation of a main
    without a disc is interpolated between its neighbours. Inertias of the table are those of the crankshaft alone;
    flywheel, pulley, rods and pistons come from the engine file. Mass and moments of inertia across the axis follow
    from the dimensions.

    The body keeps the shafts and damped discs of the table as ``twists`` with their laws, because hysteretic damping
    depends on the frequencies of the complete system (:mod:`cranktrain.dynamics.model.hysteresis`).

    Raises ``InputError``: a disc of the crank that is missing or unknown, a crank connected to ground or that cannot
    rotate as one body, or a nonlinear shaft.
    """
    # The modes of a crank have one stiffness, so a nonlinear shaft is refused.
    for shaft in chain.shafts:
        has = {"stiffness over torque": shaft.torques, "stiffness over frequency": shaft.frequencies,
               "friction": shaft.friction}  # fmt: skip
        for what in (what for what, given in has.items() if given):
            raise InputError(
                f"chain of engine '{engine.name}': shaft {' to '.join(shaft.between)} has {what}, but the shafts of a "
                "crank are linear; give it one stiffness, or put such a shaft into the drive line"
            )
    base = rigid_crank(engine)
    nodes = _places(engine, chain, base)
    modes = chain_modes(chain)
    at = [chain.names.index(disc) for disc in nodes.values()]
    rigid = modes.shapes[at, 0]
    if np.count_nonzero(modes.omega == 0.0) != 1 or np.ptp(rigid) > ALIKE * np.abs(rigid).max():
        raise InputError(
            f"chain of engine '{engine.name}' cannot rotate freely as one crank; leave out ground, and gears between "
            "its main journals and pins"
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
    body = replace(body, name=f"{engine.name} crankshaft, from a table", digest=digest, **_shafts(chain, modes, body))
    check(body)
    return body


def _places(engine: Engine, chain: Chain, base: ReducedBody) -> dict[str, str]:
    """Disc of each interface of the crank ``base``, along z; ``InputError`` if a disc is missing or unknown."""
    where = f"chain of engine '{engine.name}'"
    known = [name for name in base.interfaces if name != "thrust"]
    for name in chain.names:
        if name not in known and name.startswith(("pin[", "main[")):
            raise InputError(f"{where}: engine has no '{name}'; {nearest(name, known)}")
    for name in ("pulley", "flywheel"):
        if name not in chain.names:
            raise InputError(f"{where} has no disc '{name}'; {nearest(name, chain.names)}")
    found = {name: name for name in known if name in chain.names}
    for cylinder, pin in enumerate(engine.cylinders.pins, 1):
        before = engine.crankshaft.main_before[pin - 1]
        beside = [f"main[{main}]" for main in (before, before + 1)]
        lacking = [name for name in beside if name not in chain.names]
        if f"pin[{pin}]" in found:
            continue
        if not lacking:
            found |= {f"pin[{pin}]": throw for throw in _throw(chain, beside)}
            continue
        if len(lacking) == 1:
            raise InputError(
                f"{where} has no disc '{lacking[0]}' beside the pin of cylinder {cylinder}; add it, or a disc "
                f"'pin[{pin}]'"
            )
        raise InputError(
            f"{where} has no disc 'pin[{pin}]' for cylinder {cylinder}; add it, or the discs '{beside[0]}' and "
            f"'{beside[1]}' between which this pin turns"
        )
    return dict(sorted(found.items(), key=lambda pair: float(base.positions[base.index(pair[0]), 2])))


def _throw(chain: Chain, mains: list[str]) -> list[str]:
    """Name of the only disc that shafts join to both ``mains`` of a throw; an empty list if none or several do."""
    beside = [{end for shaft in chain.shafts if main in shaft.between for end in shaft.between} for main in mains]
    found = sorted((beside[0] & beside[1]) - {*mains, GROUND})
    return found if len(found) == 1 else []


def _shafts(chain: Chain, modes: ChainModes, body: ReducedBody) -> dict[str, Any]:
    """Fields ``shafts``, ``twists``, ``shaft_laws`` of a crank's ``body``, from the chain's shafts and dampers."""
    rows = [
        (
            f"{shaft.between[0]} to {shaft.between[1]}",
            _twist(chain, shaft),
            (shaft.stiffness, shaft.damping, shaft.loss_factor),
        )
        for shaft in chain.shafts
        if shaft.stiffness > 0.0
    ]
    rows += [
        (f"disc {disc.name}", turned, (0.0, disc.damping, 0.0))
        for turned, disc in zip(np.eye(len(chain.discs)), chain.discs, strict=True)
        if disc.damping > 0.0
    ]
    names = [name for name, *_ in rows]
    rotations = np.zeros((len(chain.discs), body.n_modes))
    # The chain's rigid rotation gets the scale and sign that the body's rigid rotation has at the pulley.
    pulley = body.index("pulley")
    rotations[:, 5] = modes.shapes[:, 0] * (body.shapes[pulley, 5, 5] / modes.shapes[chain.names.index("pulley"), 0])
    rotations[:, 6:] = modes.shapes[:, 1:]
    return {
        # Shafts between the same two discs get a number to make their names unique.
        "shafts": tuple(
            f"{name}, {names[:k].count(name) + 1}" if names.count(name) > 1 else name for k, name in enumerate(names)
        ),
        "twists": np.array([twist for _, twist, _ in rows]) @ rotations,
        "shaft_laws": np.array([law for *_, law in rows]),
    }


def _twist(chain: Chain, shaft: Shaft) -> Array:
    """Coefficients (discs,) by which the rotations of all discs sum to the twist of a shaft."""
    twist = np.zeros(len(chain.discs))
    for end, sign in zip(shaft.between, (shaft.ratio, -1.0), strict=True):
        if end != GROUND:
            twist[chain.names.index(end)] += sign
    return twist
