"""Torsional modes of the assembled cranktrain over the stiffness of its main bearings.

    python benchmarks/bearing_stiffness.py [ENGINE]

The springs of bearing level linear are multiplied by a factor, the thrust bearing stays. Near a bending mode the
twist is shared between two: frequencies of all modes below 320 Hz with more than a fifth of their energy in torsion.
"""

from __future__ import annotations

import json
import sys

import numpy as np
from scipy.linalg import eigh

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.structure.assembly import running_crank
from cranktrain.structure.crank.modal import KINDS, bearing_stiffness, energy_shares, main_springs, rod_masses

FACTORS = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 5.0, 10.0, 100.0)
HIGHEST_HZ, SHARE = 320.0, 0.2


def torsional_modes(engine: Engine, body: ReducedBody, factor: float) -> list[dict[str, float]]:
    """Modes that twist, with ``factor`` times the springs of the mains."""
    stiffness = np.diag(body.omega**2) + bearing_stiffness(engine, body)
    for i, springs in enumerate(main_springs(engine), 1):
        for component, value in springs.items():
            row = body.shapes[body.index(f"main[{i}]"), component]
            stiffness += (factor - 1.0) * value * np.outer(row, row)
    squares, modes = eigh(stiffness, np.eye(body.n_modes) + rod_masses(engine, body))
    hz = np.sqrt(squares[1:]) / (2.0 * np.pi)
    shares = energy_shares(engine, body, modes[:, 1:], rods=True)[:, KINDS.index("torsional")]
    shown = (hz < HIGHEST_HZ) & (shares > SHARE)
    return [{"hz": float(f), "torsion": float(s)} for f, s in zip(hz[shown], shares[shown], strict=True)]


def main() -> None:
    """Print one JSON object."""
    engine = load_engine(sys.argv[1] if len(sys.argv) > 1 else "diesel_i6")
    body = running_crank(engine, "solid")
    rows = [{"factor": factor, "modes": torsional_modes(engine, body, factor)} for factor in FACTORS]
    print(json.dumps({"engine": engine.name, "rows": rows}, indent=1))


if __name__ == "__main__":
    main()
