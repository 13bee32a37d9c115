"""Crankshaft bodies at each fidelity level, in the same form for every level.

:data:`cranktrain.engine.levels.CRANKS` lists the levels; :data:`MAKERS` has two functions for each, one for the bare
crankshaft and one for the running model's. All carry the same flywheel, pulley and further parts, and all are cut at
the engine's cut-off.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.reduced_body import ReducedBody, rigid, truncate
from cranktrain.core.types import Progress
from cranktrain.engine.levels import crank_level
from cranktrain.engine.model import Engine
from cranktrain.structure.crank.reduction import complete_crankshaft, reduced_crankshaft, running_body, running_loads
from cranktrain.structure.crank.torsional import rigid_crank, torsional_body, twist_only


def bare_crank(
    engine: Engine, level: str, solid: ReducedBody | None = None, progress: Progress | None = None
) -> ReducedBody:
    """Bare crankshaft at a fidelity level.

    Raises ``InputError`` for a level that does not exist.

    Parameters
    ----------
    solid : bare solid body if available; a level that needs it reads it from the cache or makes it otherwise
    progress : called with the name of each stage before it starts
    """
    row = crank_level(level)
    if solid is None and row.needs_solid(engine):
        solid = reduced_crankshaft(engine, progress=progress)
    return MAKERS[level].bare(engine, solid, progress)


def crank_body(engine: Engine, level: str) -> ReducedBody:
    """Crankshaft of the running model at a level: all parts attached, modes up to the engine's cut-off.

    Modes above the cut-off respond statically to the forces of the level: forces on the pins for a torsional crank,
    those of :func:`cranktrain.structure.crank.reduction.running_loads` for the others. Errors are those of
    :func:`bare_crank`.
    """
    return running_crank(engine, level, bare_crank(engine, level))


def running_crank(engine: Engine, level: str, bare: ReducedBody) -> ReducedBody:
    """Crankshaft of the running model at a crank level, from the bare crankshaft; raises like :func:`bare_crank`."""
    return MAKERS[crank_level(level).name].running(engine, bare)


def complete_crank(engine: Engine, level: str, bare: ReducedBody) -> ReducedBody:
    """Crankshaft at a level with all parts attached, in all its modes; ``bare`` is the bare crankshaft.

    A crank that only twists keeps its axis in place, as in the running model.
    """
    row, complete = crank_level(level), complete_crankshaft(engine, bare)
    return twist_only(complete) if row.elastic and not row.bends else complete


def running_torsional(engine: Engine, bare: ReducedBody) -> ReducedBody:
    """Crankshaft of level ``torsional`` with all attached parts, in torsional modes up to the engine's cut-off."""
    complete = complete_crank(engine, "torsional", bare)
    cut = engine.reduction.running_cutoff_hz
    above = complete.frequencies_hz > cut
    # Torsion moves the pins only along their circles, so only forces on pins need static correction above the cut-off.
    felt = [
        (name, component)
        for name, component in running_loads(engine)
        if np.any(np.abs(complete.shapes[complete.index(name), component, above]) > 1e-9)
    ]
    return truncate(complete, cut, felt)


class Maker(NamedTuple):
    """Functions that make the bare and the running body of one crank level.

    Attributes
    ----------
    bare : (engine, bare solid body, or None unless the level needs it, progress or None) ↦ bare crankshaft; level
        ``rigid`` has the mass of the solid body if given, else from dimensions, as level ``beam`` has
    running : (engine, bare crankshaft) ↦ body of the running model with all attached parts
    """

    bare: Callable[[Engine, Any, Progress | None], ReducedBody]
    running: Callable[[Engine, ReducedBody], ReducedBody]


def _beam(engine: Engine, solid: ReducedBody | None, progress: Progress | None) -> ReducedBody:
    from cranktrain.structure.crank.beam import beam_body

    return beam_body(engine, progress)


MAKERS = {
    "rigid": Maker(
        lambda engine, solid, _: rigid_crank(engine) if solid is None else rigid(solid),
        lambda engine, bare: rigid(complete_crankshaft(engine, bare)),
    ),
    "torsional": Maker(lambda engine, solid, _: torsional_body(engine, solid=solid), running_torsional),
    "beam": Maker(_beam, running_body),
    "solid": Maker(lambda _, solid, __: solid, running_body),
}
"""Maker of each crank level, by its name."""
