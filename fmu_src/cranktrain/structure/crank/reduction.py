"""Reduced solid crankshaft of an engine, by :mod:`cranktrain.structure.fem.reduction`.

The stored body is the bare crankshaft in all its Craig–Bampton modes. Flywheel, clutch, pulley and the outer rings of
roller bearings are rigid parts that are attached afterwards, so changing them needs no new finite-element computation.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import ReducedBody, attach, truncate
from cranktrain.core.threads import one_thread
from cranktrain.core.types import Array, Progress
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Crankshaft, LumpedInertia
from cranktrain.loads.rod_masses import rod_masses
from cranktrain.store.hdf5 import load_body, load_extras
from cranktrain.structure.crank.shape import crank_interfaces, pin_centre, shaping, stations
from cranktrain.structure.fem.own_mesh import check_names, check_places, content_digest, kept_path, mesh_unit

if TYPE_CHECKING:
    from skfem import MeshTet2

    from cranktrain.structure.fem.elasticity import FEModel
    from cranktrain.structure.fem.interfaces import InterfaceSet
    from cranktrain.structure.fem.reduction import Comparison, ReductionTask

# Version of the stored body: raised when changed code makes another body from the same inputs.
RECIPE = 1
# Tolerance of an interface's position, over the main journal's diameter. If the meshed surface lies within it, the
# interface is at its position in the engine file, else at the centroid of the surface.
PLACE_TOLERANCE = 0.1


def reduced_crankshaft(
    engine: Engine,
    mesh_file: str | Path | None = None,
    progress: Progress | None = None,
    rebuild: bool = False,
    checked: bool = False,
) -> ReducedBody:
    """Bare crankshaft of an engine in all Craig–Bampton modes; computed once, then read from the user's cache.

    Raises ``InputError``: dimensions or a mesh that cannot be used; ``StoreError``: a stored file that is corrupt or
    foreign.

    Parameters
    ----------
    engine : only its material, crankshaft, thrust position and table [reduction] matter here
    mesh_file : user's own mesh with named surfaces in place of the parametric crankshaft; or a reduced body, or a
        superelement
    progress : called with the name of each stage before it starts
    rebuild : compute even if a stored body exists
    checked : include errors against the full model and comparisons with other methods, computed if they are missing
    """
    if mesh_file is not None:
        from cranktrain.structure.fem.own_body import is_body

        if is_body(mesh_file):
            return own_crankshaft(engine, mesh_file)
    if not (rebuild or checked) and (kept := kept_crankshaft(engine, mesh_file)) is not None:
        return kept
    from cranktrain.structure.fem.reduction import reduced_structure

    return reduced_structure(reduction_task(engine, mesh_file), progress, rebuild, checked)


def kept_crankshaft(engine: Engine, mesh_file: str | Path | None = None) -> ReducedBody | None:
    """Bare solid crankshaft from the cache, or None if not stored; ``StoreError`` if the stored file is corrupt."""
    path = stored_path(engine, mesh_file)
    return load_body(path, input_digest(engine, mesh_file)) if path.exists() else None


def own_crankshaft(engine: Engine, path: str | Path) -> ReducedBody:
    """Crankshaft from a stored body or a superelement; ``InputError`` if it does not belong to this engine."""
    from cranktrain.structure.fem.own_body import read_body, with_interface

    body = read_body(path)
    if "thrust" not in body.interfaces and (own := f"main[{engine.thrust.main}]") in body.interfaces:
        body = with_interface(body, "thrust", own)
    wanted = crank_interfaces(engine.crankshaft)
    check_names(
        path, wanted, body.interfaces, "interface", " - name the node of each journal, the pulley, the flywheel"
    )
    places = dict(zip(body.interfaces, body.positions, strict=True))
    _check_own(engine, {name: places[name] for name in wanted}, path)
    return body


def reduction_task(engine: Engine, mesh_file: str | Path | None = None) -> ReductionTask:
    """Reduction of the bare crankshaft; ``InputError`` as :func:`reduced_crankshaft`."""
    from cranktrain.structure.fem.craig_bampton import Flexibility, eigenmodes, rigid_motions
    from cranktrain.structure.fem.interfaces import tied_surfaces
    from cranktrain.structure.fem.reduction import ReductionTask

    def compared(model: FEModel, body: ReducedBody, interfaces: InterfaceSet, say: Progress) -> Comparison:
        say("rigidly tied surfaces for comparison")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tie, motions = tied_surfaces(model, interfaces, rigid_motions(model))
        stiffness, mass = (tie.T @ model.stiffness @ tie).tocsc(), (tie.T @ model.mass @ tie).tocsc()
        flexibility = Flexibility.of(stiffness, mass, motions)
        tied = eigenmodes(flexibility.solve, mass, body.records["full_hz"].size)[0] / (2.0 * np.pi)
        return {"tied_raises_first": float(tied[0] / body.records["full_hz"][0] - 1.0)}, {"tied_hz": tied}

    return ReductionTask(
        name="crankshaft",
        path=stored_path(engine, mesh_file),
        digest=input_digest(engine, mesh_file),
        mesh=lambda: _mesh(engine, mesh_file),
        mesh_file=mesh_file,
        material=engine.material,
        interfaces=lambda model: crankshaft_interfaces(model, engine.crankshaft),
        fixed_modes=engine.reduction.fixed_modes,
        consistent_mass=engine.reduction.consistent_mass,
        records=sections,
        compared=compared,
    )


def stored_path(engine: Engine, mesh_file: str | Path | None = None) -> Path:
    """Path of the reduced crankshaft in the user's cache."""
    return kept_path("crankshaft", input_digest(engine, mesh_file))


def input_digest(engine: Engine, mesh_file: str | Path | None = None) -> str:
    """Digest of all inputs of the bare reduced crankshaft."""
    content = {
        "recipe": RECIPE,
        "material": asdict(engine.material),
        "crankshaft": shaping(engine.crankshaft),
        "thrust": engine.thrust.main,
        "fixed_modes": engine.reduction.fixed_modes,
        "consistent_mass": engine.reduction.consistent_mass,
    }
    return content_digest(content, mesh_file)


def complete_crankshaft(engine: Engine, body: ReducedBody) -> ReducedBody:
    """Bare crankshaft with all rigid parts of the engine that are fixed to it.

    Damping stored in the body is structural. Its ratios hold for the crankshaft with mean rod masses on the pins, which
    are not part of this body, see :func:`cranktrain.dynamics.model.arrays.structural_damping`.
    """
    with one_thread():
        for interface, part in attached_parts(engine):
            inertia = np.diag([part.diametral_inertia, part.diametral_inertia, part.polar_inertia])
            body = attach(body, interface, part.mass, inertia, (0.0, 0.0, part.offset))
        w = engine.balance_weights
        if w is not None:
            for main, mass, r, angle, z in zip(w.mains, w.masses, w.radii, w.angles, w.offsets, strict=True):
                body = attach(body, f"main[{main}]", mass, np.zeros((3, 3)), (-r * np.sin(angle), r * np.cos(angle), z))
    if not body.damping.size:
        return body
    heavier = np.sqrt(1.0 + np.diag(rod_masses(engine, body)))
    return replace(body, damping=np.where(body.omega > 0.0, heavier, 1.0) * body.damping)


def attached_parts(engine: Engine) -> list[tuple[str, LumpedInertia]]:
    """Rigid parts fixed to the crankshaft, each with its interface: pulley, flywheel, clutch, outer rings of rollers.

    An outer ring of a roller bearing moves with its journal but does not rotate, so it is a mass without inertia.
    """
    parts = [("pulley", engine.pulley), ("flywheel", engine.flywheel)]
    if engine.clutch is not None:
        parts.append(("flywheel", engine.clutch))
    if engine.main_roller is not None:
        rings = zip(engine.roller_mains, engine.main_roller.ring_mass, strict=True)
        parts += [(f"main[{i + 1}]", LumpedInertia(mass, 0.0, 0.0, 0.0)) for i, mass in rings]
    return parts


def running_loads(engine: Engine) -> list[tuple[str, int]]:
    """Interface components (interface, component) at which the running model applies forces.

    These are mains and pins across the axis and the thrust bearing along it. Moments about x and y are added where two
    rods share a pin, because they act off its middle, and at roller bearings, because they resist tilt.
    """
    throws = len(engine.crankshaft.throw_angles)
    across = [name for name in crank_interfaces(engine.crankshaft) if name.startswith(("main", "pin"))]
    pins = engine.cylinders.pins
    tilted = [f"main[{i + 1}]" for i in engine.roller_mains]
    tilted += [f"pin[{i}]" for i in range(1, throws + 1) if pins.count(i) > 1]
    loads = [(name, component) for name in across for component in (0, 1)] + [("thrust", 2)]
    return loads + [(name, component) for name in tilted for component in (3, 4)]


def running_body(engine: Engine, body: ReducedBody | None = None, progress: Progress | None = None) -> ReducedBody:
    """Body of the running model: attached parts, modes up to the engine's cut-off, exact static response to its loads.

    ``body`` is the bare crankshaft if available.
    """
    bare = reduced_crankshaft(engine, progress=progress) if body is None else body
    complete = complete_crankshaft(engine, bare)
    with one_thread():
        return truncate(complete, engine.reduction.running_cutoff_hz, running_loads(engine))


def crankshaft_interfaces(model: FEModel, crankshaft: Crankshaft) -> InterfaceSet:
    """Averaged interfaces of a crankshaft, each referred to its nominal position on the axis of its journal."""
    from cranktrain.structure.fem.interfaces import placed_interfaces

    names = crank_interfaces(crankshaft)
    nominal = nominal_places(crankshaft)

    def place(name: str, centroid: Array) -> Array:
        own = nominal.get(name, np.array((0.0, 0.0, centroid[2])))
        return own if np.linalg.norm(own - centroid) < PLACE_TOLERANCE * crankshaft.main_diameter else centroid

    return placed_interfaces(model, names, place)


def nominal_places(crankshaft: Crankshaft) -> dict[str, Array]:
    """Middle (3,), m, of each main journal and pin, from the dimensions."""
    at = stations(crankshaft)
    places = {f"main[{i}]": (0.0, 0.0, sum(span) / 2) for i, span in enumerate(at.mains, 1)}
    places |= {f"pin[{i}]": pin_centre(crankshaft, i) for i in range(1, len(at.pins) + 1)}
    return {name: np.array(place) for name, place in places.items()}


def _mesh(engine: Engine, mesh_file: str | Path | None) -> MeshTet2:
    """Mesh made from the dimensions, or the user's own mesh."""
    from cranktrain.structure.fem.mesh import crankshaft_mesh, read_mesh, surface_area

    if mesh_file is None:
        return crankshaft_mesh(engine.crankshaft, engine.thrust.main)
    mesh = read_mesh(mesh_file, mesh_unit(mesh_file))
    wanted = crank_interfaces(engine.crankshaft)
    remedy = " - name the facets of each journal, the pulley, the flywheel and the thrust faces"
    check_names(mesh_file, wanted, mesh.boundaries or {}, "surface", remedy)
    _check_own(engine, {name: surface_area(mesh, name)[1] for name in wanted}, mesh_file)
    return mesh


def _check_own(engine: Engine, found: Mapping[str, Array], mesh_file: str | Path) -> None:
    """Refuse a user's mesh if interface positions ``found`` (3,) differ from the engine file; ``InputError``."""
    places = nominal_places(engine.crankshaft)
    check_places(mesh_file, found, places, PLACE_TOLERANCE * engine.crankshaft.main_diameter)
    mains = {name: place[2] for name, place in places.items() if name.startswith("main")}
    front, rear = min(mains.values()), max(mains.values())
    own, side = f"main[{engine.thrust.main}]", min(mains, key=lambda name: abs(mains[name] - found["thrust"][2]))
    for name, right, where in (
        ("pulley", found["pulley"][2] < front, f"in front of main[1] at z = {1e3 * front:.1f}"),
        ("flywheel", found["flywheel"][2] > rear, f"behind the last main at z = {1e3 * rear:.1f}"),
        ("thrust", side == own, f"at {own}, as thrust.main says, not at {side}"),
    ):
        if not right:
            text = f"{name} lies at z = {1e3 * found[name][2]:.1f} mm and is expected {where}"
            raise InputError(f"{mesh_file}: {text}: name the surfaces anew, or use the engine file that it belongs to")


def sections(model: FEModel, body: ReducedBody) -> dict[str, Array]:
    """Mass and inertia of the body's slices around the interfaces on its axis, for kinetic energy by kind of motion.

    Returns
    -------
    ``section_interface`` row of the interface, in the order of z; ``section_mass`` kg; ``section_polar`` and
    ``section_diametral`` inertia about z and about the axes across through the interface, kg m²; each (s,)
    """
    from cranktrain.structure.fem.elasticity import scalar_basis

    on_axis = [
        row
        for row, name in enumerate(body.interfaces)
        if name != "thrust" and np.hypot(*body.positions[row, :2]) < 1e-3 * np.abs(body.positions).max()
    ]
    rows = np.array(sorted(on_axis, key=lambda row: body.positions[row, 2]))
    z = body.positions[rows, 2]
    elements = scalar_basis(model.mesh)
    points = np.asarray(elements.global_coordinates()).reshape(3, -1)
    weights = model.material.density * elements.dx.ravel()
    slices = np.searchsorted(0.5 * (z[1:] + z[:-1]), points[2])
    radial = points[0] ** 2 + points[1] ** 2

    def gather(values: Array) -> Array:
        return np.asarray(np.bincount(slices, weights * values, rows.size), dtype=np.float64)

    return {
        "section_interface": rows.astype(float),
        "section_mass": gather(np.ones_like(radial)),
        "section_polar": gather(radial),
        "section_diametral": gather(0.5 * radial + (points[2] - z[slices]) ** 2),
    }


def crank_surface(engine: Engine, mesh_file: str | Path | None) -> tuple[Array, NDArray[np.int32], NDArray[np.float32]]:
    """Surface of the stored crankshaft and its displacement in the first modes, for pictures.

    Raises ``StoreError`` if the stored crankshaft is missing or belongs to other inputs.

    Returns
    -------
    points (p, 3) m, triangles (t, 3), displacement (m, p, 3) per unit coordinate of the first m modes of the bare body
    """
    path = stored_path(engine, mesh_file)
    load_body(path, input_digest(engine, mesh_file))
    surface = load_extras(path)
    return surface["surface_points"], surface["surface_triangles"], surface["surface_modes"]
