"""Natural frequencies of a table of discs and shafts, as ``cranktrain modal`` prints them."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from cranktrain.engine.torsional_chain import Chain
from cranktrain.results.columns import NOTHING
from cranktrain.results.tables import Table
from cranktrain.structure.crank.chain import chain_modes


def chain_report(chain: Chain) -> dict[str, Any]:
    """Modes in order of frequency: Hz, damping ratio (None for rigid modes), rotations over the largest; JSON-able."""
    found = chain_modes(chain)
    modes = []
    for omega, shape, damping in zip(found.omega, found.shapes.T, found.damping, strict=True):
        largest = float(shape[np.abs(shape).argmax()])
        modes.append(
            {
                "hz": float(omega) / (2.0 * math.pi),
                "damping_ratio": float(damping / (2.0 * omega)) if omega > 0.0 else None,
                "rotations": dict(zip(chain.names, (shape / largest).tolist(), strict=True)),
            }
        )
    return {"modes": modes, "definition": "undamped modes of the table; rotations over the largest"}


def chain_table(report: Mapping[str, Any]) -> Table:
    """Table of modes with one row per disc and one column per mode."""
    modes = report["modes"]
    ratios = [mode["damping_ratio"] for mode in modes]
    rows = [("damping / %", *(NOTHING if ratio is None else f"{100.0 * ratio:.3g}" for ratio in ratios))]
    rows += [(name, *(f"{mode['rotations'][name]:.4f}" for mode in modes)) for name in modes[0]["rotations"]]
    return Table("Torsional modes of the table", ("Hz", *(f"{mode['hz']:.3f}" for mode in modes)), tuple(rows))
