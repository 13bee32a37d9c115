"""Sub-models of an engine's throws, solved once and stored next to the reduced crankshaft."""

from collections.abc import Callable
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from cranktrain.core.errors import InputError, StoreError
from cranktrain.engine.model import Engine
from cranktrain.store.hdf5 import load_body
from cranktrain.store.whole_file import whole_file
from cranktrain.structure.crank.reduction import reduction_task
from cranktrain.structure.fem.elasticity import component_dofs
from cranktrain.structure.fem.reduction import SAME, Progress, ReductionTask
from cranktrain.structure.stress.stress_modes import ShapedCrank
from cranktrain.structure.stress.sub_model import FilletModes, fillet_modes
from cranktrain.structure.stress.throw_mesh import place_fineness, throw_places

RECIPE = 2
"""Version of the stored stresses: raised when changed code gives other stresses for the same mode shapes."""


def throw_fillets(engine: Engine, throw: int, shaped: Callable[[], ShapedCrank], say: Progress) -> list[FilletModes]:
    """Sub-models of the fillets and the oil bore of a throw (numbered from 1), read from the user's cache or computed.

    Each one is stored as soon as it is solved. Raises ``InputError`` for a throw that does not exist, and as
    :func:`cranktrain.structure.stress.sub_model.fillet_modes` does. ``shaped``: function that makes the crankshaft with
    its shapes, called only if needed.
    """
    count = len(engine.crankshaft.throw_angles)
    if not 1 <= throw <= count:
        raise InputError(f"throw {throw} does not exist; engine '{engine.name}' has throws 1 to {count}")
    if max(engine.crankshaft.bays) > 1:
        raise InputError(
            f"engine '{engine.name}': fine sub-models are of one pin between two mains, and "
            "crankshaft.pins_between_mains has more; leave them out"
        )
    task = reduction_task(engine)
    found = []
    for place in throw_places(engine.crankshaft, throw):
        label = "".join(c if c.isalnum() else "-" for c in place)
        path = task.path.with_name(f"{task.path.stem}-throw{throw}-{label}-{place_fineness(place):g}.npz")
        kept = _read(path, task)
        if kept is None:
            crank = shaped()
            coarse = (crank.model.mesh.doflocs, crank.reduced.modes[component_dofs(crank.model.basis)])
            kept = fillet_modes(engine.crankshaft, engine.material, coarse, throw, place, say)
            with whole_file(path) as temporary, temporary.open("wb") as file:
                np.savez(file, recipe=RECIPE, shapes=crank.reduced.body.shapes, **vars(kept))
        found.append(kept)
    return found


def _read(path: Path, task: ReductionTask) -> FilletModes | None:
    """Stored sub-model of a throw for the body in the cache, or None if none was stored."""
    try:
        shapes = load_body(task.path, task.digest).shapes
        with np.load(path) as file:
            found = file["shapes"]
            if int(file["recipe"]) != RECIPE or found.shape != shapes.shape:
                return None
            if not np.allclose(found, shapes, rtol=SAME, atol=SAME * np.abs(shapes).max()):
                return None
            return FilletModes(str(file["name"]), int(file["throw"]), file["modes"], file["beyond"], file["points"])
    except (OSError, ValueError, KeyError, EOFError, BadZipFile, StoreError):
        return None
