"""Modes of the crank at rest together with the bodies and connections that an engine's file adds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.dynamics.topology.arrays import on_ground
from cranktrain.dynamics.topology.modes import CrankAtRest, topology_modes
from cranktrain.dynamics.topology.tables import whole_topology
from cranktrain.dynamics.topology.values import CRANK, Connection
from cranktrain.engine.connections import Film, Roller, Thrust
from cranktrain.engine.model import Engine
from cranktrain.film.laws.thrust import closed_stiffness
from cranktrain.results.tables import Table
from cranktrain.structure.additions import read_added
from cranktrain.structure.crank.modal import KINDS, LISTED_HZ, cranktrain_matrices, energy_shares
from cranktrain.structure.crank.reduction import complete_crankshaft

SHOWN = 0.05
"""Fraction of a mode's energy from which a body is named in the table."""


def additions_report(engine: Engine, body: ReducedBody) -> dict[str, Any]:
    """Modes of crank and additions on a block at rest; JSON-able.

    ``body`` is the engine's bare crankshaft. Mains and added bearings are their linear stand-in springs, gear flanks
    without backlash are closed, and each pin carries the big end and half the oscillating mass. A mode's ``shares`` of
    energy are those of the crank by kind of motion, and of each added body. The drive line is left out.
    """
    engine = replace(engine, drive_line_chain=None)  # no part of the crank at rest
    crank = complete_crankshaft(engine.without_additions, body)
    topology = on_ground(whole_topology(engine, crank, None, read_added(engine)))
    matrices = cranktrain_matrices(engine.without_additions, crank, topology.cylinders)
    at_rest = CrankAtRest(crank, *matrices)
    topology = replace(topology, connections=tuple(map(_on_springs, topology.connections)))
    modes = topology_modes(topology, at_rest)
    own = energy_shares(engine.without_additions, crank, modes.shapes[: crank.n_modes], rods=True)
    listed = []
    for k, hz in enumerate(modes.frequencies_hz):
        if 1.0 < hz <= LISTED_HZ:
            shares = dict(zip(KINDS, (modes.shares[CRANK][k] * own[k]).tolist(), strict=True))
            shares |= {one.name: float(modes.shares[one.name][k]) for one in topology.bodies}
            listed.append({"hz": float(hz), "shape": max(shares, key=lambda name: shares[name]), "shares": shares})
    return {
        "modes": listed,
        "definition": "at rest at crank angle 0 on a block at rest; mains and added bearings as springs, rods on their "
        "pins, gears without backlash closed, with backlash free",
    }


def _on_springs(connection: Connection) -> Connection:
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
