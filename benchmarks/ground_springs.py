"""How well springs can stand for a flexible block: its bores and thrust faces as each mode in the block loads them.

    python -m benchmarks.ground_springs diesel_i6

In a mode of the cranktrain in its block a bearing of stiffness k, stretched by s, loads its bore by F = k s, and the
bore moves by u. What a spring to ground would have to give way by is that u: over all bores along one direction, and
over all modes with amplitudes of unit modal mass, the frequencies of a diagonal stand-in K are right to first order on
average where

    1/K = Σ F·u/ω² / Σ F·F/ω².

That holds the block's compliance and its recoil. Where the block's mass moves the bores against their load F·u is
negative, and no spring does it: a bore at rest is then the nearest. Printed are 1/K of each mode and of all, and the
frequencies in the block, on ground as the engine file has it, on bores at rest, and with the best K, negative or not.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.structure.block.modal import block_modes
from cranktrain.structure.block.reduction import complete_block, reduced_block
from cranktrain.structure.crank import modal
from cranktrain.structure.crank.reduction import complete_crankshaft, reduced_crankshaft

BAND = (150.0, 1.2)
"""Modes that count: from so many Hz to so many times the highest published frequency of the cranktrain."""
DIRECTIONS = ("x", "y", "thrust")


def works(engine: Engine, crank: ReducedBody, block: ReducedBody, modes: tuple[NDArray, NDArray]) -> NDArray:
    """F·u and F·F of each mode (k, 3, 2) at the bores along x and y, and at the thrust faces."""
    places = [
        (component, value, f"main[{i}]", f"bore[{i}]")
        for i, springs in enumerate(modal.main_springs(engine, on_ground=False), 1)
        for component, value in springs.items()
        if component < 2
    ]
    places.append((2, engine.thrust.closed, "thrust", "thrust"))
    found = np.zeros((modes[0].shape[1], 3, 2))
    for component, value, journal, bore in places:
        moved = block.shapes[block.index(bore), component] @ modes[1]
        force = value * (crank.shapes[crank.index(journal), component] @ modes[0] - moved)
        found[:, component] += np.stack((force * moved, force * force), axis=-1)
    return found


def on_ground(engine: Engine, compliance: NDArray) -> Engine:
    """Engine whose bearings stand on springs of compliance (3,), m/N, whatever its sign; 0 is at rest."""
    contact = 1.0 / (1.0 / engine.thrust.closed + compliance[2])
    thrust = replace(engine.thrust, contact_stiffness=contact, closed_stiffness=contact, block_stiffness=math.inf)
    if engine.main_roller is not None:
        whole = [1.0 / (1.0 / k + compliance[:2].mean()) for k in engine.main_roller.stiffness]
        return replace(engine, thrust=thrust, main_roller=replace(engine.main_roller, stiffness=tuple(whole)))
    film = engine.plain_mains
    x, y = (1.0 / (1.0 / k + c) for k, c in zip((film.stiffness_x, film.stiffness_y), compliance[:2], strict=True))
    return replace(engine, thrust=thrust, main_bearing=replace(film.in_rigid_bores, stiffness_x=x, stiffness_y=y))


def main() -> int:
    """Print the table of one engine."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("engine")
    engine = load_engine(parser.parse_args().engine)
    crank = complete_crankshaft(engine, reduced_crankshaft(engine, progress=print))
    block = complete_block(engine, reduced_block(engine, progress=print))
    hz, *shapes = block_modes(engine, crank, block)
    high = BAND[1] * max(engine.published.cranktrain_hz)
    shares = modal.energy_shares(engine, crank, shapes[0], rods=True)
    held = np.einsum("ik,ij,jk->k", shapes[0], np.eye(crank.n_modes) + modal.rod_masses(engine, crank), shapes[0])
    chosen = (hz > BAND[0]) & (hz < high) & (held > 0.5)
    work = works(engine, crank, block, (shapes[0][:, chosen], shapes[1][:, chosen]))
    work /= (2.0 * math.pi * hz[chosen, None, None]) ** 2
    print(f"{'Hz':>7} {'shape':>10}" + "".join(f"{'1/K ' + name + ', m/GN':>20}{'weight':>8}" for name in DIRECTIONS))
    weights = work[:, :, 1] / work[:, :, 1].sum(axis=0)
    for f, share, one, weight in zip(hz[chosen], shares[chosen], work, weights, strict=True):
        cells = zip(1e9 * one[:, 0] / one[:, 1], weight, strict=True)
        print(f"{f:7.1f} {modal.KINDS[int(np.argmax(share))]:>10}" + "".join(f"{c:20.3f}{w:8.3f}" for c, w in cells))
    best = work[:, :, 0].sum(axis=0) / work[:, :, 1].sum(axis=0)
    print(f"{'all':>7} {'':>10}" + "".join(f"{1e9 * c:20.3f}{'':8}" for c in best))
    cases = {
        "as the file has it": engine,
        "bores at rest, thrust best": on_ground(engine, np.array([0.0, 0.0, best[2]])),
        "best springs": on_ground(engine, best),
    }
    print(f"{'in the block':>28}" + "".join(f"{f:8.1f}" for f in hz[chosen]))
    for name, one in cases.items():
        own, kinds, answers = modal.cranktrain_modes(one, crank)
        listed = own[(own > BAND[0]) & (own < high)]
        print(f"{name:>28}" + "".join(f"{f:8.1f}" for f in listed), "Hz, torsion", end=" ")
        print(", ".join(f"{f:.1f}" for f in modal.torsional_frequencies(own, kinds, answers)))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
