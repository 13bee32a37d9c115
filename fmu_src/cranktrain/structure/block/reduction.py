"""The engine block as a reduced body, by :mod:`cranktrain.structure.fem.reduction`.

The stored body is the bare block with its cover in all its Craig–Bampton modes. Heads are rigid masses on the deck and
attached afterwards. The running model keeps the modes up to a cut-off. Residual attachment modes keep its static
response exact under the loads of a block: films on the bores (across and tilting), the thrust bearing, pistons on the
liners and gas on the heads. The block is a stationary body, so its rotation invariants are not used.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from cranktrain.core.reduced_body import Array, ReducedBody, attach, truncate
from cranktrain.core.rigid_slices import inertia_tensor, part_moments
from cranktrain.core.threads import one_thread
from cranktrain.engine.model import Engine
from cranktrain.structure.block import shape
from cranktrain.structure.block.mesh import (
    PLACE_TOLERANCE,
    block_interfaces,
    block_mesh,
    interface_places,
    read_block_mesh,
)
from cranktrain.structure.block.shape import block_plan
from cranktrain.structure.fem.craig_bampton import Flexibility
from cranktrain.structure.fem.elasticity import FEModel, scalar_basis
from cranktrain.structure.fem.own_body import is_body, read_body
from cranktrain.structure.fem.own_mesh import check_names, check_places, content_digest, kept_path, mesh_unit
from cranktrain.structure.fem.reduction import Progress, ReductionTask, reduced_structure

# Version of the stored body: raised when changed code makes another body from the same inputs.
RECIPE = 1
# Keys of the input table [block] that do not change the bare block.
AFTERWARDS = ("head_mass", "head_height", "damping_ratio", "running_cutoff_hz")


def reduced_block(
    engine: Engine,
    mesh_file: str | Path | None = None,
    progress: Progress | None = None,
    rebuild: bool = False,
    beside: Callable[[FEModel, Flexibility, Progress], None] | None = None,
    checked: bool = False,
) -> ReducedBody:
    """Bare block of an engine with its cover, in all Craig–Bampton modes; computed once, then read from the cache.

    Raises ``InputError``: an engine without block or mounts, dimensions or a mesh that cannot be used; ``StoreError``:
    a stored file that is corrupt or foreign.

    Parameters
    ----------
    engine : only its block, positions of mounts, main bearings, cylinders and rod matter here
    mesh_file : user's own mesh with named surfaces in place of the parametric block, see
        :func:`cranktrain.structure.block.mesh.read_block_mesh`; or a reduced body
    progress : called with the name of each stage before it starts
    rebuild : compute even if a stored body exists
    beside : called with the finite elements and their factors if the body is computed, to take further results
    checked : include errors against the full model, computed if they are missing
    """
    if mesh_file is not None and is_body(mesh_file):
        return own_block(engine, mesh_file)
    return reduced_structure(replace(reduction_task(engine, mesh_file), beside=beside), progress, rebuild, checked)


def own_block(engine: Engine, path: str | Path) -> ReducedBody:
    """Bare block from a stored body or a superelement; ``InputError`` if it does not belong to this engine."""
    plan, body = block_plan(engine), read_body(path)
    places = interface_places(plan)
    remedy = " - name a node of each bore, liner, head, mount, the thrust faces and the cover"
    check_names(path, places, body.interfaces, "interface", remedy)
    # Interfaces whose positions are checked: all except heads and cover.
    held = {name: place for name, place in places.items() if name.startswith(("bore", "liner", "thrust", "mount"))}
    found = dict(zip(body.interfaces, body.positions, strict=True))
    check_places(path, found, held, PLACE_TOLERANCE * plan.cylinder_bore)
    return body


def block_model(engine: Engine, mesh_file: str | Path | None = None, progress: Progress | None = None) -> FEModel:
    """Finite elements of the bare block; ``InputError`` as :func:`reduced_block`."""
    return reduction_task(engine, mesh_file).model(progress or (lambda stage: None))


def reduction_task(engine: Engine, mesh_file: str | Path | None = None) -> ReductionTask:
    """Reduction of the bare block; ``InputError`` as :func:`reduced_block`."""
    plan = block_plan(engine)
    return ReductionTask(
        name="block",
        path=stored_path(engine, mesh_file),
        digest=input_digest(engine, mesh_file),
        mesh=lambda: block_mesh(plan) if mesh_file is None else read_block_mesh(mesh_file, plan, mesh_unit(mesh_file)),
        mesh_file=mesh_file,
        material=plan.block.material,
        interfaces=lambda model: block_interfaces(model, plan),
        fixed_modes=plan.block.fixed_modes,
        consistent_mass=engine.reduction.consistent_mass,
    )


def stored_path(engine: Engine, mesh_file: str | Path | None = None) -> Path:
    """Path of the reduced block in the user's cache."""
    return kept_path("block", input_digest(engine, mesh_file))


def input_digest(engine: Engine, mesh_file: str | Path | None = None) -> str:
    """Digest of all inputs of the bare reduced block."""
    plan = asdict(block_plan(engine))
    for key in AFTERWARDS:
        del plan["block"][key]
    shares = [shape.BORE_MESH_SHARE, shape.LINER_MESH_SHARE, shape.COVER_MESH_SHARE]
    recipe = [RECIPE, shape.BAND_SHARE, shape.PATCH, *shares]
    content = {"recipe": recipe, "plan": plan, "consistent_mass": engine.reduction.consistent_mass}
    return content_digest(content, mesh_file)


def complete_block(engine: Engine, body: ReducedBody) -> ReducedBody:
    """Complete block: the bare block with the cylinder heads fixed to its deck."""
    with one_thread():
        for part in heads(engine):
            body = attach(body, *part)
    return body


def heads(engine: Engine) -> list[tuple[str, float, Array, Array]]:
    """Interface, mass (kg), inertia (3, 3) and offset (3,) m of each cylinder head, taken as a solid box."""
    plan, parts = block_plan(engine), []
    b = plan.block
    for bank in plan.banks:
        c, s = np.cos(bank.angle), np.sin(bank.angle)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        for number, place, (front, rear) in zip(bank.cylinders, bank.positions, plan.cells(bank), strict=True):
            squares = np.array([2.0 * b.bank_half_width, 2.0 * b.head_height, rear - front]) ** 2
            inertia = turn @ np.diag(squares.sum() - squares) @ turn.T * (b.head_mass / 12.0)
            offset = turn @ np.array([0.0, b.head_height, 0.5 * (front + rear) - place])
            parts.append((f"head[{number}]", b.head_mass, 0.5 * (inertia + inertia.T), offset))
    return parts


def standing_moments(engine: Engine) -> Array:
    """Mass moments (4, 4) about the origin of all that stands on an engine's mounts, kg, kg m, kg m².

    They are those of the standing body of ``[mounts]`` if the file states it, else of block and heads, from the reduced
    block if it is in the cache, else from the mesh. Raises ``InputError`` as :func:`reduced_block`.
    """
    mounts = engine.mounts
    if mounts is not None and mounts.standing_mass:
        return part_moments(
            mounts.standing_mass, inertia_tensor(mounts.standing_inertia), np.array(mounts.standing_centre)
        )
    if stored_path(engine).exists():
        body = complete_block(engine, reduced_block(engine))
        own = body.inertia - body.mass * (body.centre @ body.centre * np.eye(3) - np.outer(body.centre, body.centre))
        return part_moments(body.mass, own, body.centre)
    plan = block_plan(engine)
    basis = scalar_basis(block_mesh(plan))
    places = np.asarray(basis.global_coordinates().value).reshape(3, -1)
    extended = np.vstack((np.ones(places.shape[1]), places))
    moments = plan.block.density * (extended * np.ravel(basis.dx)) @ extended.T
    positions = interface_places(plan)
    for name, mass, inertia, offset in heads(engine):
        moments = moments + part_moments(mass, inertia, positions[name] + offset)
    return np.asarray(moments)


def block_loads(engine: Engine, tilting: bool = True) -> list[tuple[str, int]]:
    """Interface components (interface, component) at which the running model loads the block.

    These are bores across the axis and, if films are ``tilting``, moments about the two transverse axes; the thrust
    bearing along the axis; liners across and along their bank; heads along their bank.
    """
    plan = block_plan(engine)
    on_bore = (0, 1, 3, 4) if tilting else (0, 1)
    loads = [(f"bore[{i}]", component) for i in range(1, len(plan.mains) + 1) for component in on_bore]
    loads.append(("thrust", 2))
    for bank in plan.banks:
        along = [k for k, share in enumerate((np.sin(bank.angle), np.cos(bank.angle))) if abs(share) > 1e-9]
        for i in bank.cylinders:
            loads += [(f"liner[{i}].{ring}", component) for ring in ("upper", "lower") for component in (0, 1)]
            loads += [(f"head[{i}]", component) for component in along]
    return loads


def running_block(
    engine: Engine,
    body: ReducedBody | None = None,
    loaded: Sequence[tuple[str, int]] | None = None,
    progress: Progress | None = None,
) -> ReducedBody:
    """Block of the running model: with its heads, modes up to the block's cut-off, exact static response to its loads.

    ``body`` is the bare block if available; ``loaded`` defaults to :func:`block_loads`. Raises ``InputError`` as
    :func:`reduced_block` does.
    """
    bare = reduced_block(engine, progress=progress) if body is None else body
    complete = complete_block(engine, bare)
    with one_thread():
        return truncate(complete, block_plan(engine).block.running_cutoff_hz, loaded or block_loads(engine))
