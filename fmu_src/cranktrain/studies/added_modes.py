"""Modes of the crank at rest together with the bodies and connections that an engine's file adds."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.dynamics.topology.arrays import on_ground
from cranktrain.dynamics.topology.tables import whole_topology
from cranktrain.dynamics.topology.values import CRANK, Connection
from cranktrain.engine.connections import Film, Roller, Thrust
from cranktrain.engine.model import Engine
from cranktrain.film.laws.thrust import closed_stiffness
from cranktrain.results.tables import Table
from cranktrain.structure.additions import read_added
from cranktrain.structure.block.reduction import complete_block
from cranktrain.structure.crank.modal import KINDS, LISTED_HZ, cranktrain_matrices, energy_shares
from cranktrain.structure.crank.reduction import complete_crankshaft
from cranktrain.structure.in_motion.topology_modes import CrankAtRest, topology_modes

SHOWN = 0.05
"""Fraction of a mode's energy from which a body is named in the table."""


def additions_report(engine: Engine, body: ReducedBody, block: ReducedBody | None = None) -> dict[str, Any]:
    """Modes of crank and additions in a ``block`` on its mounts, or on a block at rest; JSON-able.

    ``body`` and ``block`` are the engine's bare ones. Mains and added bearings are their linear stand-in springs, gear
    flanks without backlash are closed, and each pin carries the big end and half the oscillating mass. A mode's
    ``shares`` of energy are those of the crank by kind of motion, of the block, and of each added body. The drive line
    is left out.
    """
    engine = replace(engine, drive_line_chain=None)  # no part of the crank at rest
    plain = engine.without_additions
    crank, housing = complete_crankshaft(plain, body), None if block is None else complete_block(plain, block)
    topology = whole_topology(engine, crank, housing, read_added(engine))
    topology = on_ground(topology) if block is None else topology
    at_rest = CrankAtRest(crank, *cranktrain_matrices(plain, crank, topology.cylinders, housing), housing)
    topology = replace(topology, connections=tuple(map(on_springs, topology.connections)))
    modes = topology_modes(topology, at_rest)
    own = energy_shares(plain, crank, modes.shapes[: crank.n_modes], rods=True)
    listed = []
    for k, hz in enumerate(modes.frequencies_hz):
        if 1.0 < hz <= LISTED_HZ:
            shares = dict(zip(KINDS, (modes.shares[CRANK][k] * own[k]).tolist(), strict=True))
            shares |= {name: float(share[k]) for name, share in modes.shares.items() if name != CRANK}
            listed.append({"hz": float(hz), "shape": max(shares, key=lambda name: shares[name]), "shares": shares})
    return {
        "modes": listed,
        "definition": f"at rest at crank angle 0 {'on a block at rest' if block is None else 'in the block'}; mains "
        "and added bearings as springs, rods on their pins, gears without backlash closed, with backlash free",
    }


def on_springs(connection: Connection) -> Connection:
    """Connection in the model at rest: linear stand-in springs for films and rollers, a closed axial bearing."""
    data = connection.data
    if isinstance(data, Film):
        return replace(connection, data=replace(data, level="linear"))
    if isinstance(data, Roller):
        return replace(connection, data=replace(data, contact="linear"))
    if isinstance(data, Thrust):
        along = {"stiffness": (0.0, 0.0, closed_stiffness(data.bearing))}
        return replace(connection, law="spring", data=along)
    return connection


def additions_table(report: Mapping[str, Any]) -> Table:
    """Table of the modes as texts."""
    rows = tuple(
        (
            f"{mode['hz']:.1f}", mode["shape"],
            ", ".join(
                f"{name} {100.0 * share:.0f}"
                for name, share in sorted(mode["shares"].items(), key=lambda item: -item[1])
                if share >= SHOWN
            ),
        )
        for mode in report["modes"]
    )  # fmt: skip
    return Table("Crank and added bodies at rest", ("Hz", "shape", "shares of energy / %"), rows)
