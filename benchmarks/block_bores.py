"""Elastic bores of the six: each main bore of its block beside the others, and beside the bearing saddle.

``python benchmarks/block_bores.py``: a film pressure of 120 degrees, half a cosine around and a parabola across,
presses in 24 directions on each bore. Compared is the radial displacement without the bore's motion, as the
``ehd`` film takes it: by the pressure alone (``local``), and with what the load's way through the block adds
(``with_load``). Each is the norm of the difference from the reference bore over the norm of the reference's. Prints one
JSON object.
"""

from __future__ import annotations

import json

import numpy as np
from numpy.typing import NDArray

from cranktrain.engine.file import load_engine
from cranktrain.film.elastic.bore_compliance import LOBE, BoreCompliance
from cranktrain.structure.block.bore import block_bore_compliance
from cranktrain.structure.block.saddle import bore_compliance

Array = NDArray[np.float64]
# Beyond these the displacement under a film does not change in the third digit.
SHAPES = 60
AROUND, ACROSS, DIRECTIONS = 180, 9, 24


def displacement(bore: BoreCompliance, load_too: bool) -> Array:
    """Radial displacement under the film pressure in each direction, (directions, around, across)."""
    angles = 2.0 * np.pi * np.arange(AROUND) / AROUND
    zetas, share = np.polynomial.legendre.leggauss(ACROSS)
    area = bore.area * np.outer(np.full(AROUND, 1.0 / AROUND), 0.5 * share)
    shapes = bore.shapes(angles, zetas)
    weights = bore.weights(angles, zetas) if load_too else shapes
    found = []
    for towards in 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS:
        distance = np.angle(np.exp(1j * (angles - towards)))
        lobe = np.where(np.abs(distance) < 0.5 * LOBE, np.cos(np.pi * distance / LOBE), 0.0)
        pressure = lobe[:, None] * (1.0 - zetas**2)
        amplitudes = bore.compliance * np.einsum("kij,ij->k", weights, pressure * area)
        found.append(np.einsum("k,kij->ij", amplitudes, shapes))
    return np.array(found)


def main() -> None:
    """Print the differences."""
    engine = load_engine("diesel_i6")
    mains = len(engine.crankshaft.main_widths)
    bores = {f"bore[{i}]": block_bore_compliance(engine, SHAPES, i) for i in range(1, mains // 2 + 2)}
    reference = block_bore_compliance(engine, SHAPES)
    bores["saddle"] = bore_compliance(engine, SHAPES)
    figures = {}
    for name, bore in bores.items():
        both = {}
        for kind, load_too in (("local", False), ("with_load", True)):
            ours, wanted = displacement(bore, load_too), displacement(reference, load_too)
            both[kind] = round(float(np.linalg.norm(ours - wanted) / np.linalg.norm(wanted)), 4)
        figures[name] = both
    print(json.dumps({"difference_from_bore": f"bore[{mains // 2}]", "of": figures}, indent=2))


if __name__ == "__main__":
    main()
