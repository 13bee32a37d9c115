"""The crank of a running model at any level of detail: one body, whatever made it.

``solid`` comes from finite elements, ``beam`` from :mod:`cranktrain.structure.crank.beam`, ``torsional`` from
:mod:`cranktrain.structure.crank.torsional`; ``rigid`` is the solid one without its elastic modes where that is at hand,
else made from dimensions. All carry the same flywheel, pulley and further parts, and all are cut at the engine's
cut-off.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import ReducedBody, rigid, truncate
from cranktrain.engine.model import Engine
from cranktrain.levels import CRANKS
from cranktrain.structure.crank.beam import beam_body
from cranktrain.structure.crank.reduction import complete_crankshaft, reduced_crankshaft, running_body, running_loads
from cranktrain.structure.crank.torsional import rigid_crank, torsional_body, twist_only

Progress = Callable[[str], None]


def needs_solid(engine: Engine, level: str) -> bool:
    """Whether a level is made of the solid crankshaft, which takes a minute where it is not in the cache."""
    return level == "solid" or (level == "torsional" and engine.reduction.torsional_source.startswith("solid"))


def bare_crank(
    engine: Engine, level: str, solid: ReducedBody | None = None, progress: Progress | None = None
) -> ReducedBody:
    """Bare crankshaft at a level: ``rigid``, ``torsional``, ``beam`` or ``solid``.

    Parameters
    ----------
    solid : the bare solid body where at hand; else it is read from the cache, or made, where the level needs it
    progress : told each stage before it starts

    Raises
    ------
    InputError
        a level that does not exist
    """
    if level not in CRANKS:
        raise InputError(f"crank level '{level}' does not exist; {nearest(level, CRANKS)}")
    if solid is None and needs_solid(engine, level):
        solid = reduced_crankshaft(engine, progress=progress)
    if level == "beam":
        return beam_body(engine, progress)
    if level == "torsional":
        return torsional_body(engine, solid=solid)
    if level == "rigid":
        return rigid_crank(engine) if solid is None else rigid(solid)
    if solid is None:
        raise InputError("crank level 'solid' needs the reduced crankshaft; make it by `cranktrain reduce`")
    return solid


def crank_body(
    engine: Engine, level: str, solid: ReducedBody | None = None, progress: Progress | None = None
) -> ReducedBody:
    """Crankshaft of the running model at a level: with all parts attached, cut at the engine's cut-off.

    Modes above the cut-off answer statically to the forces that the level carries: a torsional crank to those on its
    pins, the others as :func:`cranktrain.structure.crank.reduction.running_loads` says. Parameters and errors as of
    :func:`bare_crank`.
    """
    bare = bare_crank(engine, level, solid, progress)
    if level == "rigid":
        return rigid(complete_crankshaft(engine, bare))
    if level != "torsional":
        return running_body(engine, bare)
    complete = twist_only(complete_crankshaft(engine, bare))
    cut = engine.reduction.running_cutoff_hz
    above = complete.frequencies_hz > cut
    # A twist moves pins along their circles only: other forces lose nothing with the modes above the cut.
    felt = [
        (name, component)
        for name, component in running_loads(engine)
        if np.any(np.abs(complete.shapes[complete.index(name), component, above]) > 1e-9)
    ]
    return truncate(complete, cut, felt)
