"""Elastic shapes of a main bore in a flexible engine block, whose modes already include the bore's rigid motion.

The block is unsupported, so the inertia of the whole block balances a film's resultant. The housing takes the film's
pressure through the shell at the same angle, p R dφ = p_h R_h dφ. The compliance on patterns ψ_i of pressure is C_ij =
f_iᵀ G f_j with the block's inertia-relief flexibility G.

One bore is used for all mains. Under a film's pressure the compliances of the six's mains agree within 2 %, those at
the ends within 8 %; with the deformation by the load path through the block they differ by 10 to 17 %. The saddle of
usual proportions (:mod:`cranktrain.structure.block.saddle`) has another geometry and differs by 37 %:
``benchmarks/block_bores.py``.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.threads import one_thread
from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.film.elastic.bore_compliance import BoreCompliance, patterns, reduced_compliance
from cranktrain.structure.block.reduction import block_model, input_digest
from cranktrain.structure.block.saddle import DEGREE, FACET_ORDER, WAVES
from cranktrain.structure.fem.craig_bampton import Flexibility, rigid_motions
from cranktrain.structure.fem.elasticity import FEModel
from cranktrain.structure.fem.mesh import surface_basis
from cranktrain.structure.fem.reduction import Progress
from cranktrain.structure.fem.surface_compliance import kept_compliance, radial_loads

# Version of the stored compliance: raised when changed code gives another compliance for the same block.
RECIPE = 1


def block_bore_compliance(
    engine: Engine,
    count: int = 8,
    main: int | None = None,
    mesh_file: str | Path | None = None,
    progress: Progress | None = None,
) -> BoreCompliance:
    """Elastic shapes of a main bore in the block, without the bore's rigid motion; kept in the user's cache.

    Raises ``InputError``: an engine without block or plain main bearings, a main bearing that does not exist, or a
    count that the patterns cannot give.

    Parameters
    ----------
    count : shapes to keep, the softest first
    main : number of the main bearing, from 1. The default is the bearing before the middle: it is not at an end and
        carries no thrust faces on engines that have them in the middle
    mesh_file : user's own mesh of the block
    """
    film, row = engine.plain_mains, _row(engine, main)
    say = progress or (lambda stage: None)

    def computed() -> Array:
        model = block_model(engine, mesh_file, say)
        say("factorising the stiffness")
        with one_thread():
            return _patternwise(
                engine, row, model, Flexibility.of(model.stiffness, model.mass, rigid_motions(model)), say
            )

    patternwise = kept_compliance("bore", _inputs(engine, row, mesh_file), computed)
    return reduced_compliance(patternwise, np.pi * film.diameter * film.width, count)


def bore_beside(
    engine: Engine, mesh_file: str | Path | None = None
) -> Callable[[FEModel, Flexibility, Progress], None]:
    """Callback for the block's reduction: it also stores the bore's compliance, from the same factorised stiffness."""

    def keep(model: FEModel, free: Flexibility, say: Progress) -> None:
        row = _row(engine, None)
        kept_compliance("bore", _inputs(engine, row, mesh_file), lambda: _patternwise(engine, row, model, free, say))

    return keep


def _row(engine: Engine, main: int | None) -> int:
    """Row (from 0) of main bearing ``main`` (numbered from 1); ``InputError`` if there is no such bearing."""
    mains = len(engine.crankshaft.main_positions)
    row = (mains // 2 if main is None else main) - 1
    if not 0 <= row < mains:
        raise InputError(f"block: bore {main} is not one of 1..{mains}")
    return row


def _inputs(engine: Engine, row: int, mesh_file: str | Path | None) -> list[Any]:
    """Inputs that determine the compliance of a bore, for its digest."""
    film = engine.plain_mains
    return [RECIPE, WAVES, DEGREE, FACET_ORDER, row, film.diameter, film.width, input_digest(engine, mesh_file)]


def _patternwise(engine: Engine, row: int, model: FEModel, free: Flexibility, say: Progress) -> Array:
    """Compliance (waves, degrees, waves, degrees) of a bore on patterns of pressure, m/Pa of the film's area."""
    film, middle = engine.plain_mains, engine.crankshaft.main_positions[row]
    say(f"elastic shapes of bore {row + 1}")
    loads = bore_loads(model, f"bore[{row + 1}]", middle, film.diameter, film.width)
    compliance = loads.T @ free.solve(loads)
    shape = (2 * WAVES + 1, DEGREE + 1)
    return np.asarray((0.5 * (compliance + compliance.T)).reshape(*shape, *shape))


def bore_loads(model: FEModel, name: str, middle: float, film_diameter: float, film_width: float) -> Array:
    """Load vectors of unit pressure in each pattern on the film in the middle of a wider bore, (ndof, patterns) m².

    The film's edge lies within elements. Quadrature points beyond the edge carry no load, and the weights of the others
    are scaled to the whole area of the film.
    """
    facets = surface_basis(model.mesh, model.basis.elem, name, FACET_ORDER)
    x, y, z = np.asarray(facets.global_coordinates())
    zeta = 2.0 * (z - middle) / film_width
    around, along = patterns(np.arctan2(y, x), np.clip(zeta, -1.0, 1.0), WAVES, DEGREE)
    weight = np.where(np.abs(zeta) <= 1.0, facets.dx * (0.5 * film_diameter / np.hypot(x, y)), 0.0)
    weight *= np.pi * film_diameter * film_width / weight.sum()
    pressure = np.einsum("mfq,lfq,fq->mlfq", around, along, weight).reshape(-1, *weight.shape)
    return radial_loads(model, facets, pressure)
