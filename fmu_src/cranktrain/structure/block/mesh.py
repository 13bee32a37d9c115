"""Quadratic tetrahedra of an engine block, from its plan or a file, with the interface surfaces named.

Interfaces: ``bore[i]`` (housing bore of main bearing i), ``liner[i].upper`` and ``liner[i].lower`` (rings of the
liner's running surface at the piston pin's top and bottom dead centre), ``head[i]`` (the deck around cylinder i),
``thrust`` (both faces next to the thrust main's bore), ``mount[k]`` (foot of a pad) and ``cover`` (middle of the bottom
cover). Each interface is averaged (RBE3) and referred to its position in the plan.
"""

import warnings
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import MeshTet2

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.engine.parts import Block
from cranktrain.structure.block.shape import PATCH, Bank, BlockPlan, block_shape
from cranktrain.structure.fem.elasticity import FEModel
from cranktrain.structure.fem.interfaces import InterfaceSet, placed_interfaces
from cranktrain.structure.fem.mesh import cad_solid, named_mesh, surface_area
from cranktrain.structure.fem.own_mesh import check_places

PLACE_TOLERANCE = 0.1
"""Tolerance of an interface's position, over the cylinders' bore: if the centroid of the meshed surface lies within it,
the interface is referred to its position in the plan, else to the centroid."""


def block_interface_names(mains: int, cylinders: int, mounts: int) -> tuple[str, ...]:
    """Names of a block's interfaces: bores, liners, heads, thrust, mounts, cover."""
    bores = [f"bore[{i}]" for i in range(1, mains + 1)]
    liners = [f"liner[{i}].{ring}" for i in range(1, cylinders + 1) for ring in ("upper", "lower")]
    heads = [f"head[{i}]" for i in range(1, cylinders + 1)]
    return (*bores, *liners, *heads, "thrust", *(f"mount[{k}]" for k in range(1, mounts + 1)), "cover")


def interface_places(plan: BlockPlan) -> dict[str, Array]:
    """Position (3,) of each interface of a plan, m, in the order of :func:`block_interface_names`."""
    b = plan.block
    low, high = plan.pin_heights
    places = {f"bore[{i}]": np.array([0.0, 0.0, z]) for i, z in enumerate(plan.mains, 1)}
    for bank in plan.banks:
        for i, z in zip(bank.cylinders, bank.positions, strict=True):
            for name, height in (("upper", high), ("lower", low)):
                places[f"liner[{i}].{name}"] = _in_bank(bank, height, z)
            places[f"head[{i}]"] = _in_bank(bank, b.deck_height, z)
    places["thrust"] = np.array([0.0, 0.0, plan.mains[plan.thrust[0]]])
    places |= {f"mount[{k}]": np.array(place) for k, place in enumerate(plan.mounts, 1)}
    places["cover"] = np.array([0.0, -b.skirt_depth - b.cover_thickness, 0.5 * sum(plan.ends)])
    cylinders = sum(len(bank.cylinders) for bank in plan.banks)
    return {name: places[name] for name in block_interface_names(len(plan.mains), cylinders, len(plan.mounts))}


def _in_bank(bank: Bank, height: float, z: float) -> Array:
    """Point (3,) at a height along a bank, m."""
    return np.array([-height * np.sin(bank.angle), height * np.cos(bank.angle), z])


def block_mesh(plan: BlockPlan) -> MeshTet2:
    """Mesh of a block from its plan: curved quadratic tetrahedra, m, with all interfaces as named boundaries.

    Raises ``InputError``: for a crash of the CAD kernel, elements that stay inverted, or a surface missing from the
    kernel's result.
    """
    remedy = "block.mesh_size or a dimension of [block]"
    mesh = cad_solid("cranktrain.structure.block.mesh:_solid", asdict(plan), "block", remedy)
    mesh = mesh.with_boundaries(_surfaces(plan, mesh))
    if missing := [name for name in interface_places(plan) if not len(mesh.boundaries[name])]:
        raise InputError(f"block: the CAD kernel lost the surfaces {', '.join(missing)}: change dimensions of [block]")
    return mesh


def read_block_mesh(path: str | Path, plan: BlockPlan, unit: str = "m") -> MeshTet2:
    """Read a user's own block (Gmsh, Abaqus, Nastran) that has the plan's interfaces as named surfaces.

    The crank axis is z, z = 0 in the middle of the first main bore; ``BORE_1``, ``bore1`` and ``bore[1]`` mean the
    same, and so do ``LINER_1_UPPER`` and ``liner[1].upper``. Raises ``InputError`` as
    :func:`cranktrain.structure.fem.mesh.read_mesh` does, and for a main bore or liner at another position than in the
    engine file. Mounts at another position only give a warning.
    """
    names = tuple(interface_places(plan))

    def wanted(found: Iterable[str]) -> tuple[str, ...]:
        return names

    parts = "every main bore, liner (upper and lower ring), head, mount, the thrust faces and the cover"
    mesh = named_mesh(path, unit, wanted, "bore[", "block", parts)
    places = {name: np.asarray(place) for name, place in interface_places(plan).items()}
    found = {name: surface_area(mesh, name)[1] for name in places}
    bores, liners, mounts = (
        {name: place for name, place in places.items() if name.startswith(kind)} for kind in ("bore", "liner", "mount")
    )
    check_places(path, found, bores, PLACE_TOLERANCE * plan.cylinder_bore)
    check_places(path, found, liners, 0.5 * plan.cylinder_bore)
    try:
        check_places(path, found, mounts, 0.5 * plan.cylinder_bore)
    except InputError as doubt:
        warnings.warn(str(doubt), stacklevel=2)
    return mesh


def block_interfaces(model: FEModel, plan: BlockPlan) -> InterfaceSet:
    """Averaged interfaces of a block, each referred to its position in the plan if its meshed surface lies there."""
    places = interface_places(plan)

    def place(name: str, centroid: Array) -> Array:
        # The surface under a head ends at the block's end, so its centroid may lie off the cylinder's axis.
        near = np.linalg.norm(places[name] - centroid) < PLACE_TOLERANCE * plan.cylinder_bore
        return places[name] if near or name.startswith("head") else centroid

    return placed_interfaces(model, places, place)


def _surfaces(plan: BlockPlan, mesh: MeshTet2) -> dict[str, NDArray[np.integer[Any]]]:
    """Boundary facets of each interface, selected by the positions of their corners."""
    b = plan.block
    skin = mesh.boundary_facets()
    x, y, z = mesh.p[:, mesh.facets[:, skin]]
    small = 1e-6 * plan.cylinder_bore
    half = 0.5 * b.housing_thickness
    radius = np.hypot(x, y)

    def within(values: Array, low: float, high: float) -> NDArray[np.bool_]:
        return np.all((values > low - small) & (values < high + small), axis=0)

    def at(values: Array, value: float) -> NDArray[np.bool_]:
        return within(values, value, value)

    chosen = {
        f"bore[{i}]": at(radius, 0.5 * diameter) & within(z, place - half, place + half)
        for i, (diameter, place) in enumerate(zip(plan.bores, plan.mains, strict=True), 1)
    }
    for bank in plan.banks:
        across = x * np.cos(bank.angle) + y * np.sin(bank.angle)
        along = y * np.cos(bank.angle) - x * np.sin(bank.angle)
        for i, place, cell in zip(bank.cylinders, bank.positions, plan.cells(bank), strict=True):
            running = at(np.hypot(across, z - place), 0.5 * plan.cylinder_bore)
            for name, (low, high) in zip(("lower", "upper"), plan.bands(), strict=True):
                chosen[f"liner[{i}].{name}"] = running & within(along, low, high)
            chosen[f"head[{i}]"] = at(along, b.deck_height) & within(z, *cell)
    main, outside = plan.thrust
    faces = at(np.abs(z - plan.mains[main]), half)
    chosen["thrust"] = faces & within(radius, 0.5 * plan.bores[main], 0.5 * outside)
    for k, (mx, my, mz) in enumerate(plan.mounts, 1):
        foot = within(x - mx, -0.5 * b.pad_size, 0.5 * b.pad_size) & within(z - mz, -0.5 * b.pad_size, 0.5 * b.pad_size)
        chosen[f"mount[{k}]"] = at(y, my) & foot
    patch = within(x, -0.5 * PATCH, 0.5 * PATCH) & within(z - 0.5 * sum(plan.ends), -0.5 * PATCH, 0.5 * PATCH)
    chosen["cover"] = at(y, -b.skirt_depth - b.cover_thickness) & patch
    return {name: skin[chosen[name]].astype(np.int32) for name in interface_places(plan)}


def _solid(values: dict[str, Any]) -> tuple[Any, float, float]:
    """Solid, largest edge and fineness for the mesher; runs in its child process."""
    block, banks = Block(**values.pop("block")), values.pop("banks")
    others = {key: _tuples(entry) for key, entry in values.items()}
    plan = BlockPlan(block=block, banks=tuple(Bank(**bank) for bank in banks), **others)
    return block_shape(plan), block.mesh_size, 1.0


def _tuples(value: Any) -> Any:
    """Copy of nested lists with each list, at every depth, converted to a tuple."""
    return tuple(_tuples(entry) for entry in value) if isinstance(value, list) else value
