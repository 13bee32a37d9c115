"""Panels file of ``cranktrain noise --panels``: panels of an own reduced block, and thicknesses of panels.

    [panels.sump]
    interfaces = ["sump[1]", "sump[2]"]    # of the reduced block: each moves as one piece
    areas = [42000, 38000]                 # mm^2
    normals = [[0, -1, 0], [0, -1, 0]]     # outwards, axes of the engine; one for all interfaces, or one each
    thickness = 8                          # mm, for the critical frequency

A reduced block holds the motion of its interfaces only, so its surface consists of pieces around interfaces that the
superelement has beside those of the engine. Of a meshed block the file states thicknesses only.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
from msgspec import field

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.typed_file import Table, between, record
from cranktrain.core.user_file import read_toml
from cranktrain.engine.parts import Material
from cranktrain_lab.noise.radiation import critical_frequency
from cranktrain_lab.noise.result import Panels

_Area = Annotated[float, between(1.0, 1e9, "mm^2", "area")]


class PanelTable(Table, kw_only=True):
    """Table of a panel: its interfaces with their areas and outward normals, and its thickness."""

    interfaces: list[str] = field(default_factory=list)
    areas: list[_Area] = field(default_factory=list)
    normals: list[list[float]] = field(default_factory=list)
    thickness: Annotated[float, between(0.1, 1000.0, "mm", "length")] | None = None


class PanelsTable(Table, kw_only=True):
    """Whole panels file."""

    panels: dict[str, PanelTable]


def read_panels(path: str | Path) -> dict[str, PanelTable]:
    """Panels of a file by name; ``InputError`` is one line with file, table and key."""
    document = read_toml(path, "panels file", "give its path")
    try:
        found = record(PanelsTable, document).panels
        for name, one in found.items():
            counts = len(one.interfaces), len(one.areas), len(one.normals)
            if counts[1] != counts[0] or counts[2] not in (0 if not counts[0] else 1, counts[0]):
                raise InputError(
                    f"panels.{name}: {counts[0]} interfaces, {counts[1]} areas and {counts[2]} normals; give an area "
                    "for each interface, and a normal for each or one for all"
                )
            if any(len(normal) != 3 or not any(normal) for normal in one.normals):
                raise InputError(f"panels.{name}.normals: a normal is three numbers, not all 0, e.g. [0, -1, 0]")
    except InputError as error:
        raise InputError(f"{Path(path).name}: {error}") from None
    return found


def with_thicknesses(panels: Panels, tables: Mapping[str, PanelTable], material: Material) -> Panels:
    """Panels of a meshed block with the thicknesses of a file; ``InputError`` for a panel that does not exist."""
    critical = panels.critical.copy()
    for name, one in tables.items():
        (row,) = panels.chosen(name)
        if one.interfaces:
            raise InputError(
                f"panels.{name}.interfaces: panels of a meshed block are its surfaces; state thickness only"
            )
        if one.thickness is not None:
            critical[row] = critical_frequency(1e-3 * one.thickness, material)
    return replace(panels, critical=critical)


def body_panels(block: ReducedBody, tables: Mapping[str, PanelTable], material: Material, wall: float) -> Panels:
    """Panels of a reduced block; ``InputError`` for an interface that it lacks.

    Parameters
    ----------
    block : block of the running model
    wall : thickness of panels without one, m
    """
    area, sides, critical, products, points, normal = [], [], [], [], [], []
    for name, one in tables.items():
        if not one.interfaces:
            raise InputError(f"panels.{name}: a reduced block has no surfaces of its own; state interfaces and areas")
        for interface in one.interfaces:
            if interface not in block.interfaces:
                known = nearest(interface, block.interfaces)
                raise InputError(f"panels.{name}.interfaces: the block has no '{interface}'; {known}")
        rows = [block.index(interface) for interface in one.interfaces]
        areas = 1e-6 * np.array(one.areas)
        directions = np.array(one.normals, dtype=float)
        directions = np.broadcast_to(directions / np.linalg.norm(directions, axis=1, keepdims=True), (len(rows), 3))
        moved = np.einsum("ic,icm->im", directions, block.shapes[rows, :3])
        area.append(areas.sum())
        longest = max(float(np.ptp(block.positions[rows], axis=0).max()), float(np.sqrt(areas.sum())))
        sides.append((longest, areas.sum() / longest))
        critical.append(critical_frequency(wall if one.thickness is None else 1e-3 * one.thickness, material))
        products.append(np.einsum("i,im,in->mn", areas, moved, moved))
        points.append(block.positions[rows])
        normal.append(moved)
    return Panels(
        tuple(tables), np.array(area), np.array(sides), np.array(critical), np.array(products), np.vstack(points),
        np.empty((0, 3), dtype=np.int32), np.vstack(normal).T.astype(np.float32),
    )  # fmt: skip
