"""Changes of bodies with their dimensions, from the difference of two finite-element geometries at the interfaces.

A free dimension needs one more mesh, at the bound farther from the engine's value. Both meshes are condensed
on their interfaces, K = Ψᵀ K Ψ and M = Ψᵀ M Ψ with the constraint modes Ψ (Guyan 1965), and their difference per unit
of the dimension acts at the interfaces of the engine's own reduced body:

    K(p) = diag(ω²) + Φᵀ (p − p₀) ΔK Φ,      M(p) = I + Φᵀ (p − p₀) ΔM Φ

If the dimension moves an interface, both matrices are referred to the motion at the old position by a rigid link.
Otherwise rigid motion would strain the difference. This gives frequency changes to first order, except that
fixed-interface modes keep their frequencies and attached parts their positions. The result of a search is meshed and
fitted again, so it contains no error of the linearisation.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.core.rigid_slices import skew
from cranktrain.core.threads import one_thread
from cranktrain.core.types import Progress
from cranktrain.engine.model import Engine
from cranktrain.store.kept import Kept
from cranktrain.structure.block import reduction as of_block
from cranktrain.structure.crank import reduction as of_crank
from cranktrain.structure.fem.craig_bampton import condensed

CRANK, BLOCK = "crankshaft", "block"


class Change(NamedTuple):
    """Change of a body's stiffness and mass per unit of a dimension, at the m interfaces of the body, (6 m, 6 m)."""

    body: str
    stiffness: Array
    mass: Array


def digests(engine: Engine, flexible: bool) -> dict[str, str]:
    """Return a digest of the data that determine each body's finite elements."""
    found = {CRANK: of_crank.input_digest(engine)}
    return found | ({BLOCK: of_block.input_digest(engine)} if flexible else {})


def changes(engine: Engine, other: Engine, step: float, flexible: bool, say: Progress) -> list[Change]:
    """Return changes of the bodies per unit of a dimension that is ``step`` larger in ``other``; may be empty."""
    before, after = digests(engine, flexible), digests(other, flexible)
    found = []
    for body in before:
        if before[body] != after[body]:
            (k0, m0, at), (k1, m1, there) = (_condensed(body, e, say) for e in (engine, other))
            if k0.shape != k1.shape:
                raise InputError(f"the dimension changes the interfaces of the {body}; leave it out of [parameters]")
            carried = np.eye(k0.shape[0])
            for i, shift in enumerate(there - at):
                carried[6 * i : 6 * i + 3, 6 * i + 3 : 6 * i + 6] = -skew(shift)
            found.append(Change(body, (carried.T @ k1 @ carried - k0) / step, (carried.T @ m1 @ carried - m0) / step))
    return found


def _condensed(body: str, engine: Engine, say: Progress) -> tuple[Array, Array, Array]:
    """Return stiffness and mass of the meshed body at its interfaces, and their positions; cached for the user."""
    kept = Kept("calibration")
    key = f"{body}-with-places-{digests(engine, body == BLOCK)[body]}"
    found: Mapping[str, Array] | None = kept.arrays(key)
    if found is None:
        task = (of_block if body == BLOCK else of_crank).reduction_task(engine)
        model = task.model(lambda stage: say(f"{body}: {stage}"))
        say(f"{body}: condensing on its interfaces")
        with one_thread():
            interfaces = task.interfaces(model)
            stiffness, mass = condensed(model, interfaces)
        found = {"stiffness": np.asarray(stiffness), "mass": np.asarray(mass), "places": interfaces.positions}
        kept.keep_arrays(key, found)
    return found["stiffness"], found["mass"], found["places"]
