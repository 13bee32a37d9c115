"""Natural frequencies of the cranktrain in its flexible block on mounts, compared with those on rigid ground.

The crank is at θ = 0 in its linear main bearings, which end on the block's bores. The closed thrust bearing has the
stiffness of collar and shells only, because the block has its own compliance. The block with its heads is supported by
the mounts. Pistons act on the crank only through the rods' mean masses. Both bodies keep all their modes.

Modes are paired with those on ground by the shape of the crank, MAC = (aᵀ M b)² / (aᵀ M a · bᵀ M b) with the crank's
mass (rods included): each mode on ground has the partner that makes the sum of all MAC largest.
"""

from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import linear_sum_assignment

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import ReducedBody, rigid
from cranktrain.core.types import Array
from cranktrain.engine.checks.mounts import need_constant_mounts
from cranktrain.engine.model import Engine
from cranktrain.structure.block.reduction import complete_block
from cranktrain.structure.crank import modal as crank_modal
from cranktrain.structure.crank.modal import KINDS, LISTED_HZ, cranktrain_matrices, energy_shares
from cranktrain.structure.crank.reduction import complete_crankshaft

PARTS = (*KINDS, "block")
REACH = 2.0
"""Multiple of the highest listed frequency up to which the block's modes are matched with those on ground."""
RIGID_HZ = 30.0
"""Modes below this frequency (Hz) are rigid motions of the whole engine on its mounts."""


def block_modes(engine: Engine, crankshaft: ReducedBody, block: ReducedBody) -> tuple[Array, Array, Array]:
    """Modes of the cranktrain in its block at rest; the crank is free to rotate.

    Raises ``InputError``: for an engine without mounts.

    Parameters
    ----------
    crankshaft, block : complete bodies, with all attached parts

    Returns
    -------
    (k,) Hz, (n, k) modes of the crank and (m, k) of the block in their modal coordinates, of unit modal mass together
    """
    if engine.mounts is None:
        raise InputError(f"engine '{engine.name}' has no table [mounts]; add it as in engine/data/diesel_i6.toml")
    need_constant_mounts(engine)
    squares, modes = eigh(*cranktrain_matrices(engine, crankshaft, block=block))
    n = crankshaft.n_modes
    # No spring acts on the crank's rotation, so the first mode is the crank's rigid rotation; it is left out.
    return np.sqrt(squares[1:]) / (2.0 * np.pi), modes[:n, 1:], modes[n:, 1:]


def like_modes(ground: Array, mass: Array, hz: Array, crank: Array) -> list[tuple[int, float]]:
    """Index of the partner in ``crank`` of each mode on ``ground``, and the MAC of the two.

    Parameters
    ----------
    ground : (n, g) modes of unit modal mass
    mass : (n, n) mass matrix of the crank with its rods
    hz, crank : (k,) Hz and (n, k) modes in a block, k ≥ g; modes below :data:`RIGID_HZ` are not used
    """
    reach = np.flatnonzero((hz > RIGID_HZ) & (hz <= REACH * LISTED_HZ))
    candidates = crank[:, reach]
    overlap = (ground.T @ mass @ candidates) ** 2 / np.einsum("ik,ij,jk->k", candidates, mass, candidates)
    rows, columns = linear_sum_assignment(overlap, maximize=True)
    return [(int(reach[c]), float(overlap[r, c])) for r, c in zip(rows, columns, strict=True)]


def block_report(engine: Engine, body: ReducedBody, block: ReducedBody) -> dict[str, Any]:
    """Frequencies in the flexible block compared with those on ground, and quality of the block's reduction; JSON-able.

    Parameters
    ----------
    body, block : bare reduced crankshaft and block of the engine

    Returns
    -------
    ``modes`` (hz, shape, shares with the block's part of the kinetic energy), ``mounts_hz`` of the engine as a whole,
    ``ground`` (each mode on ground, its partner in the block, MAC and change in per cent, and its partner in a rigid
    block of the same mass on the same mounts), the named first and second frequencies, ``mass_kg`` of the block with
    its heads, ``free_hz`` of that block, ``reduction``, ``definitions``
    """
    crankshaft = complete_crankshaft(engine, body)
    on_ground, mass = cranktrain_matrices(engine, crankshaft)
    squares, ground = eigh(on_ground, mass)
    ground_hz, ground = np.sqrt(squares[1:]) / (2.0 * np.pi), ground[:, 1:]
    complete = complete_block(engine, block)
    hz, crank, _ = block_modes(engine, crankshaft, complete)
    in_crank = np.einsum("ik,ij,jk->k", crank, mass, crank)
    shares = energy_shares(engine, crankshaft, crank, rods=True)

    listed = (ground_hz > 1.0) & (ground_hz <= LISTED_HZ)
    ground_hz, ground = ground_hz[listed], ground[:, listed]
    partners = like_modes(ground, mass, hz, crank)
    stiff_hz, stiff, _ = block_modes(engine, crankshaft, rigid(complete))
    stiff_partners = like_modes(ground, mass, stiff_hz, stiff)
    kinds = energy_shares(engine, crankshaft, ground, rods=True)
    whole = np.column_stack((in_crank[:, None] * shares, 1.0 - in_crank))
    elastic = hz > RIGID_HZ
    answers = crank_modal.pulley_answers(engine, crankshaft, crank, (2.0 * np.pi * hz) ** 2)
    named = crank_modal.named_frequencies(
        hz[elastic], whole[elastic], answers[elastic], engine.reduction.running_cutoff_hz
    )
    pairs = [
        {
            "ground_hz": float(ground_hz[k]),
            "shape": KINDS[int(np.argmax(kinds[k]))],
            "hz": float(hz[partner]),
            "change_percent": float(100.0 * (hz[partner] / ground_hz[k] - 1.0)),
            "mac": mac,
            "block_share": float(1.0 - in_crank[partner]),
            "rigid_block_hz": float(stiff_hz[stiff_partner]),
            "rigid_block_mac": stiff_mac,
        }
        for k, ((partner, mac), (stiff_partner, stiff_mac)) in enumerate(zip(partners, stiff_partners, strict=True))
    ]
    return {
        "modes": crank_modal.listed_modes(hz, whole, PARTS, RIGID_HZ, crank_modal.listed_to(named.values())),
        "mounts_hz": hz[hz <= RIGID_HZ].tolist(),
        "ground": pairs,
        **named,
        "mass_kg": complete.mass,
        "free_hz": complete.frequencies_hz[6:][complete.frequencies_hz[6:] <= LISTED_HZ].tolist(),
        "reduction": crank_modal.reduction_quality(block),
        "definitions": {
            "modes": "at rest; block with heads on its mounts, linear bearings between journals and bores, thrust "
            "closed with collar and shells alone; rods as mean masses; free to turn, without the connecting shaft",
            "ground": "pairs of modes of the same crank shape on ground and in the block, by modal assurance criterion",
            "shares": "kinetic energy of the crank by kind, and of the block",
        },
    }
