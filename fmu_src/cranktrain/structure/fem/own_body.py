"""A user's own reduced body: a body stored by this program, or a superelement of another program."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.store.bodies import import_body, is_stored_body
from cranktrain.structure.fem.superelement import superelement_body
from cranktrain.structure.fem.superelement_file import is_superelement, read_superelement


def is_body(path: str | Path) -> bool:
    """True if a path is a stored reduced body (.h5, .npz, folder) or describes a superelement (.toml)."""
    return is_stored_body(path) or is_superelement(path)


def read_body(path: str | Path) -> ReducedBody:
    """Read a reduced body or a superelement; ``InputError`` or ``StoreError`` if it cannot be read or used."""
    if is_stored_body(path):
        return import_body(path)
    return superelement_body(read_superelement(path), Path(path).stem)


def with_interface(body: ReducedBody, name: str, at: str) -> ReducedBody:
    """Body with an additional interface ``name`` that coincides and moves with the existing interface ``at``."""
    row = body.index(at)
    return replace(
        body,
        interfaces=(*body.interfaces, name),
        positions=np.concatenate((body.positions, body.positions[row : row + 1])),
        shapes=np.concatenate((body.shapes, body.shapes[row : row + 1])),
    )
