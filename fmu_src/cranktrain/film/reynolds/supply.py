"""Boundary conditions of a film's pressure: edges, feeding grooves and holes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cranktrain.core.errors import InputError
from cranktrain.film.reynolds.volumes import Array, Rectangle

EDGES = ("x0", "x1", "z0", "z1")


@dataclass(frozen=True)
class Edges:
    """Boundary conditions at the four edges: a pressure (Pa, a number or one per node), or None for no flow.

    None also represents a plane of symmetry. ``fill`` is the fill of the flow that the surfaces carry in over an edge
    at p = 0, at the first inner face.
    """

    x0: ArrayLike | None = 0.0
    x1: ArrayLike | None = 0.0
    z0: ArrayLike | None = 0.0
    z1: ArrayLike | None = 0.0
    fill: float = 1.0


@dataclass(frozen=True)
class Supply:
    """Groove or hole whose nodes (mask (n_x, n_z)) are full at a pressure (Pa)."""

    name: str
    nodes: NDArray[np.bool_]
    pressure: float


def node_field(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Array:
    """Return ``value`` broadcast to ``shape``; ``InputError`` with its ``name`` if it does not fit."""
    array = np.asarray(value, dtype=float)
    if array.ndim and array.shape != shape:
        raise InputError(f"{name}: shape {array.shape} does not fit the nodes {shape}; give a number or one per node")
    return np.ascontiguousarray(np.broadcast_to(array, shape))


def given_pressures(
    edges: Edges, supplies: Sequence[Supply], grid: Rectangle, cavitation: str
) -> tuple[Array, Array, NDArray[np.int64], list[str]]:
    """Return pressure and deficit at fixed nodes, index of the edge or supply of each node (−1: none), and names."""
    shape = grid.areas.shape
    pressure, deficit = np.zeros(shape), np.zeros(shape)
    owner = np.full(shape, -1, dtype=np.int64)
    names: list[str] = []
    floor = -np.inf if cavitation in ("full", "guembel") else 0.0
    if not 0.0 <= edges.fill <= 1.0:
        raise InputError(f"edges: fill {edges.fill:.4g} of the oil carried in must lie between 0 and 1")
    # Edges across the sliding direction are set last, so corner nodes belong to them.
    for name in ("z0", "z1", "x0", "x1"):
        value = getattr(edges, name)
        if value is None or (name[0] == "x" and grid.periodic):
            continue
        if name[0] == "z" and shape[1] == 1:
            if np.any(np.asarray(value) != 0.0):
                raise InputError(f"edges: an infinitely wide film (n_z = 1) has no edge {name}; leave it out")
            continue
        end = 0 if name[1] == "0" else -1
        where = (end, slice(None)) if name[0] == "x" else (slice(None), end)
        pressure[where] = node_field(f"edges: {name}", value, pressure[where].shape)
        owner[where] = len(names)
        names.append(name)
        deficit[where] = 0.0 if cavitation != "mass-conserving" else np.where(pressure[where] > 0, 0, 1 - edges.fill)
    for supply in supplies:
        if supply.name in names or supply.name in EDGES:
            raise InputError(f"supply '{supply.name}' exists twice; give each groove a name of its own")
        mask = np.asarray(supply.nodes)
        if mask.shape != shape or mask.dtype != bool:
            raise InputError(
                f"supply '{supply.name}': a mask of shape {shape} is needed, got {mask.dtype} {mask.shape}"
            )
        if not mask.any():
            raise InputError(f"supply '{supply.name}' covers no node; refine the grid or move the groove")
        clash = mask & (owner >= 0) & (pressure != supply.pressure)
        if clash.any():
            i, j = (int(k) for k in np.argwhere(clash)[0])
            raise InputError(
                f"supply '{supply.name}' ({supply.pressure:.4g} Pa) overlaps '{names[owner[i, j]]}' "
                f"({pressure[i, j]:.4g} Pa) at node ({i}, {j}); separate them or give them one pressure"
            )
        pressure[mask], deficit[mask], owner[mask] = supply.pressure, 0.0, len(names)
        names.append(supply.name)
    given = owner >= 0
    if given.any() and not (np.isfinite(pressure).all() and pressure[given].min() >= floor):
        i, j = (int(k) for k in np.argwhere(given & ~(pressure >= floor))[0])
        raise InputError(
            f"pressure {pressure[i, j]:.4g} Pa at '{names[owner[i, j]]}' is below the cavitation pressure 0; "
            "count pressures from there or use cavitation 'full'"
        )
    if not given.any() and cavitation in ("full", "guembel"):
        raise InputError("nothing holds the pressure of a full film; give a pressure at an edge or a supply")
    if given.all():
        raise InputError("every node has a given pressure; refine the grid so that some are left to solve")
    return pressure, deficit, owner, names
