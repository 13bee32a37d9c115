"""Meshes of quadratic tetrahedra with named interface surfaces, of a crankshaft's dimensions or a user's file.

The CAD kernel can crash its process on degenerate input, so it meshes in a child process. Mid-side nodes lie on the
curved surface (straight sides change frequencies by about 1 %). If they would invert an element, they are moved towards
the middle of their edge. Meshes whose elements still have a too small Jacobian are refused.
"""

import json
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from skfem import ElementTetP2, FacetBasis, MeshTet1, MeshTet2
from skfem.mapping import MappingIsoparametric
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array, Integers
from cranktrain.engine.checks.crankshaft import check_crankshaft
from cranktrain.engine.parts import Crankshaft
from cranktrain.structure.crank.shape import crank_interfaces, interface_names, stations
from cranktrain.structure.fem.cad_process import run_in_child
from cranktrain.structure.fem.own_mesh import UNITS, check_names, check_one_piece

# Corner pairs of a tetrahedron's six mid-side nodes, in the order of netgen (NETGEN_EDGES), and of VTK, Abaqus and
# Nastran (VTK_EDGES).
NETGEN_EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))
VTK_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))

# Limits of an element's smallest Jacobian over that of the straight element: mid-side nodes are relaxed below
# RELAXED_BELOW, and the mesh is refused below REFUSED_BELOW.
RELAXED_BELOW = 0.1
REFUSED_BELOW = 0.02
# Limit of six times an element's volume over the cube of its longest edge; a regular tetrahedron has 0.71.
FLAT_BELOW = 1e-4
CHILD_SECONDS = 300.0
GRADING = 0.5


def crankshaft_mesh(
    crankshaft: Crankshaft,
    thrust_main: int | None = None,
    fillet_fineness: float = 0.0,
    fillets: Sequence[str] | None = None,
) -> MeshTet2:
    """Mesh of a crankshaft from its dimensions.

    Raises ``InputError``: for impossible dimensions, a crash of the CAD kernel, or elements that stay inverted.

    Parameters
    ----------
    crankshaft : dimensions, m; ``mesh_size`` is the largest edge, fillets get about half of it
    thrust_main : main journal (from 1) with the thrust faces; by default the middle one
    fillet_fineness : radius of fillets over the edge length on them; with 0 this follows from ``mesh_size``
    fillets : names of the fine fillets as by :func:`cranktrain.structure.crank.shape.fillet_ends`; by default all

    Returns
    -------
    Curved quadratic tetrahedra, m, whose ``boundaries`` hold the running surface of each ``main[i]`` and ``pin[i]``,
    ``pulley`` (cylinder of the nose), ``flywheel`` (outer face of the flange) and ``thrust`` (the ring faces at either
    side of the thrust main journal, out to the radius of the web).
    """
    check_crankshaft(crankshaft)
    mains, wanted = len(crankshaft.main_widths), crank_interfaces(crankshaft)
    main = (mains + 1) // 2 if thrust_main is None else thrust_main
    if not 1 <= main <= mains:
        raise InputError(f"thrust.main = {main}: the crankshaft has main journals 1 to {mains}")
    nodes, tets, triangles, labels, names = cad_mesh(
        "cranktrain.structure.fem.mesh:_solid",
        {**asdict(crankshaft), "fillet_fineness": fillet_fineness, "fillets": fillets},
        "crankshaft",
        "fillet or mesh_size",
    )
    surfaces = {name: triangles[labels == k] for k, name in enumerate(names) if name in wanted}
    mesh = quadratic_mesh(nodes, tets, surfaces, NETGEN_EDGES)
    at, inner = stations(crankshaft), 0.5 * crankshaft.main_diameter
    faces = {
        "flywheel": _plane_ring(mesh, at.flange[1], 0.0, np.inf),
        "thrust": np.union1d(*(_plane_ring(mesh, z, inner, crankshaft.web_main_radius) for z in at.mains[main - 1])),
    }
    mesh = mesh.with_boundaries(faces)
    missing = [name for name in wanted if not len(mesh.boundaries.get(name, ()))]
    if missing:
        raise InputError(f"crankshaft: the CAD kernel lost the surfaces {', '.join(missing)}: change fillet or radii")
    return mesh


def read_mesh(path: str | Path, unit: str = "m") -> MeshTet2:
    """Read a user's own mesh of a crankshaft (Gmsh, Abaqus, Nastran or a universal file).

    The crank axis is z, main journals numbered from the pulley to the flywheel. Surfaces are named by physical groups
    or element sets of triangles, by node sets, or by the names HyperMesh writes as comments into a Nastran file;
    ``MAIN_1``, ``main1`` and ``main[1]`` mean the same. Raises ``InputError`` if the file cannot be read, holds other
    solids than tetrahedra, lacks a surface (one line lists the missing and the found names), or does not lie on the
    axis. ``unit``: unit of the coordinates in the file, ``m``, ``mm`` or ``in``.
    """

    def wanted(found: Iterable[str]) -> tuple[str, ...]:
        numbered = [name[:-1].split("[") for name in found if name.startswith(("main[", "pin["))]
        mains = max((int(number) for kind, number in numbered if kind == "main"), default=2)
        pins = max((int(number) for kind, number in numbered if kind == "pin"), default=mains - 1)
        return interface_names(mains, max(pins, 1))

    parts = "every journal, the pulley seat, the flywheel flange and the thrust faces"
    return named_mesh(path, unit, wanted, "main[", "crankshaft", parts)


def named_mesh(
    path: str | Path,
    unit: str,
    wanted: Callable[[Iterable[str]], Sequence[str]],
    axial: str,
    what: str,
    surfaces_of: str,
) -> MeshTet2:
    """Read a user's own mesh of any body with the required surfaces ``wanted``, a function of the names found.

    ``axial`` is the prefix of the names of surfaces that must follow each other along z. ``what`` (the body) and
    ``surfaces_of`` (its parts) are used in error texts. Raises ``InputError`` as :func:`read_mesh` does.
    """
    from cranktrain.structure.fem.mesh_file import read_surfaces_and_tetrahedra

    if unit not in UNITS:
        raise InputError(f"mesh unit '{unit}' does not exist; valid: {', '.join(UNITS)}")
    nodes, tets, surfaces = read_surfaces_and_tetrahedra(Path(path))
    names = wanted(surfaces)
    check_names(path, names, surfaces, "surface", f": name the surface triangles (or nodes) of {surfaces_of}")
    length = UNITS[unit] * float(np.ptp(nodes, axis=0).max())
    if not 0.02 < length < 20.0:
        units = ", ".join(UNITS)
        raise InputError(
            f"{path}: a {what} {length:.4g} m long, expected are 0.02 to 20 m: state the mesh unit, --mesh-unit {units}"
        )
    check_one_piece(UNITS[unit] * nodes, tets, path)
    mesh = quadratic_mesh(UNITS[unit] * nodes, tets, surfaces, VTK_EDGES)
    if loose := [name for name in names if not len(mesh.boundaries[name])]:
        raise InputError(f"{path}: {', '.join(loose)}: no triangle is a face of a tetrahedron: export both together")
    before = -np.inf
    for name in (n for n in names if n.startswith(axial)):
        x, y, z = surface_area(mesh, name)[1]
        if np.hypot(x, y) > 0.01 * length or z <= before:
            raise InputError(
                f"{path}: {name} lies at ({1e3 * x:.1f}, {1e3 * y:.1f}, {1e3 * z:.1f}) mm: turn the mesh so that z is "
                f"the crank axis, with {axial}i] numbered from the pulley to the flywheel"
            )
        before = z
    return mesh


def quadratic_mesh(
    nodes: Array, tets: Integers, surfaces: Mapping[str, Integers], edges: Iterable[tuple[int, int]]
) -> MeshTet2:
    """Mesh of ten-node tetrahedra with named boundaries; mid-side nodes relaxed where needed.

    Raises ``InputError`` if an element is flat or stays inverted by the curved sides of its neighbours.

    Parameters
    ----------
    nodes : (n, 3) m
    tets : (m, 10) four corners, then the mid-side nodes in the order of ``edges``; or (m, 4), straight
    surfaces : name → (k, 3 or more) triangles, corners first
    """
    corners, renumbered = np.unique(tets[:, :4], return_inverse=True)
    t = renumbered.reshape(len(tets), 4).T
    straight = MeshTet1(np.ascontiguousarray(nodes[corners].T), np.ascontiguousarray(t))
    mesh = MeshTet2.from_mesh(straight)
    if tets.shape[1] == 10:
        positions = mesh.doflocs.copy()
        for k, (a, b) in enumerate(edges):
            edge = _find_columns(mesh.edges, t[[a, b]], len(corners))
            positions[:, len(corners) + edge] = nodes[tets[:, 4 + k]].T
        mesh = replace(mesh, doflocs=positions)
    mesh = _relaxed(mesh)
    new_number = np.full(len(nodes), -1)
    new_number[corners] = np.arange(len(corners))
    boundaries = {}
    for name, triangles in surfaces.items():
        facets = _find_columns(mesh.facets, new_number[triangles[:, :3]].T, len(corners))
        boundaries[name] = np.unique(facets[facets >= 0]).astype(np.int32)
    return mesh.with_boundaries(boundaries)


class _SurfaceMapping(MappingIsoparametric):
    """Mapping of facets that stores the element coordinates of points, for which Newton's method may not converge."""

    def G(self, X: Array, find: Any = None) -> Array:
        """Positions of points ``X`` (2, q) of the reference triangle on the facets ``find``."""
        self._asked = X, find
        return np.asarray(super().G(X, find))

    def invF(self, x: Array, tind: Any = None, **options: Any) -> Array:
        """Reference coordinates (3, facets, q), in elements ``tind``, of the points of the last call of :meth:`G`."""
        points, facets = self._asked
        corners = self.mesh.facets[:, facets]
        local = np.argmax(self.mesh.t[:, None, tind] == corners, axis=0)
        shares = np.vstack((1.0 - points.sum(axis=0), points))
        return np.einsum("ckf,kq->cfq", np.asarray(RefTet.p)[:, local], shares)


def surface_basis(mesh: MeshTet2, element: Any, name: str, order: int) -> FacetBasis:
    """Basis on a named boundary, with a quadrature of the given order."""
    mapping = _SurfaceMapping(mesh, mesh.elem(), mesh.bndelem)
    return FacetBasis(mesh, element, mapping, facets=mesh.boundaries[name], intorder=order)


def surface_area(mesh: MeshTet2, name: str) -> tuple[float, Array]:
    """Area (m²) and centroid (3,), m, of a named boundary, on the curved elements."""
    basis = surface_basis(mesh, ElementTetP2(), name, 6)
    area = float(basis.dx.sum())
    where = np.asarray(basis.global_coordinates())
    return area, np.einsum("ceq,eq->c", where, basis.dx) / area


def relative_jacobian(mesh: MeshTet2) -> Array:
    """Smallest Jacobian (m,) of each element at its nodes and quadrature points, over that of the straight element."""
    points = np.hstack((np.asarray(ElementTetP2.doflocs).T, get_quadrature(RefTet, 5)[0]))
    slopes = np.array([[g + 0 * points[0] for g in ElementTetP2().lbasis(points, i)[1]] for i in range(10)])
    x = mesh.doflocs[:, mesh.dofs.element_dofs]
    determinant = np.linalg.det(np.einsum("cim,idq->mqcd", x, slopes))
    return np.asarray((determinant / _straight_jacobian(mesh)[:, None]).min(axis=1))


def _straight_jacobian(mesh: MeshTet2) -> Array:
    """Six times the signed volume spanned by the corners, (m,) m³."""
    x = mesh.p[:, mesh.t]
    return np.linalg.det((x[:, 1:] - x[:, :1]).transpose(2, 0, 1))


def _relaxed(mesh: MeshTet2) -> MeshTet2:
    """Move mid-side nodes of inverted elements towards the middle of their edges until all Jacobians suffice."""
    ends = mesh.p[:, mesh.edges]
    length = np.linalg.norm(mesh.p[:, mesh.edges[0]] - mesh.p[:, mesh.edges[1]], axis=0)
    flat = np.abs(_straight_jacobian(mesh)) < FLAT_BELOW * np.asarray(length[mesh.t2e].max(axis=0)) ** 3
    if flat.any():
        x, y, z = 1e3 * mesh.p[:, mesh.t[:, np.flatnonzero(flat)[0]]].mean(axis=1)
        raise InputError(
            f"mesh: {flat.sum()} of {flat.size} elements are flat, the first at ({x:.1f}, {y:.1f}, {z:.1f}) mm: "
            "remesh, or change mesh_size"
        )
    for keep in (0.5, 0.5, 0.5, 0.0, 0.0, 0.0):
        bad = relative_jacobian(mesh) < RELAXED_BELOW
        if not bad.any():
            return mesh
        edges = np.unique(mesh.t2e[:, bad])
        positions = mesh.doflocs.copy()
        middle = ends[:, :, edges].mean(axis=1)
        at = mesh.nvertices + edges
        positions[:, at] = middle + keep * (positions[:, at] - middle)
        mesh = replace(mesh, doflocs=positions)
    quality = relative_jacobian(mesh)
    worst = int(np.argmin(quality))
    if quality[worst] < REFUSED_BELOW:
        x, y, z = 1e3 * mesh.p[:, mesh.t[:, worst]].mean(axis=1)
        raise InputError(
            f"mesh: {np.sum(quality < REFUSED_BELOW)} elements stay inverted, the worst at ({x:.1f}, {y:.1f}, {z:.1f}) "
            "mm: use a smaller mesh_size or a larger fillet"
        )
    return mesh


def _plane_ring(mesh: MeshTet2, z: float, inner: float, outer: float) -> Integers:
    """Boundary facets in the plane z whose middle lies between two radii about the crank axis."""
    facets = mesh.boundary_facets()
    corners = mesh.p[:, mesh.facets[:, facets]]
    middle = np.hypot(*corners[:2].mean(axis=1))
    in_plane = np.abs(corners[2] - z).max(axis=0) < 1e-6
    return facets[in_plane & (middle > inner) & (middle < outer)].astype(np.int32)


def _find_columns(table: Integers, columns: Integers, n: int) -> Integers:
    """Index of each column, in any order of its entries, in ``table`` (numbers below n); −1 if it is missing."""

    def keys(array: Integers) -> Integers:
        return np.asarray(np.ravel_multi_index(tuple(np.sort(array, axis=0)), (n,) * len(array), mode="wrap"))

    order = np.argsort(keys(table))
    sorted_keys, wanted = keys(table)[order], keys(columns)
    place = np.minimum(np.searchsorted(sorted_keys, wanted), len(order) - 1)
    found = (sorted_keys[place] == wanted) & (columns >= 0).all(axis=0)
    return np.where(found, order[place], -1)


def cad_mesh(
    entry: str, values: Mapping[str, Any], what: str, remedy: str
) -> tuple[Array, Integers, Integers, Integers, list[str]]:
    """Mesh made by the CAD kernel in a child process; errors of the child become one line.

    Raises ``InputError`` for a crash of the CAD kernel or a mesher that exceeds its time.

    Parameters
    ----------
    entry : ``module:function`` of ``values`` (converted by JSON) that returns a shape of netgen's CAD kernel, the
        largest edge (m), the number of element sides per radius of curvature and per edge, and optionally, in place of
        ``GRADING``, the growth of edges away from short ones, 0 to 1
    what, remedy : name of the body and advice in an error's text

    Returns
    -------
    nodes (n, 3) m, tets (m, 10), triangles (k, 3) with labels (k,) into the names of the faces, numbered from 0
    """
    with tempfile.TemporaryDirectory(prefix="cranktrain-mesh-") as folder:
        target = Path(folder) / "mesh.npz"
        ended = run_in_child(f"import {__name__} as mesh; mesh.child({entry!r})", values, target, CHILD_SECONDS)
        if ended is not None and ended.startswith("took"):
            raise InputError(f"{what}: meshing {ended}: change {remedy}")
        if ended is not None:
            raise InputError(f"{what}: the CAD kernel failed ({ended}): change {remedy} a little")
        with np.load(target) as data:
            names = [str(s) for s in data["names"]]
            return data["nodes"], data["tets"], data["triangles"], data["labels"], names


def cad_solid(entry: str, values: Mapping[str, Any], what: str, remedy: str) -> MeshTet2:
    """Quadratic mesh of a solid made by :func:`cad_mesh`, without named boundaries."""
    nodes, tets, *_ = cad_mesh(entry, values, what, remedy)
    return quadratic_mesh(nodes, tets, {}, NETGEN_EDGES)


def child(entry: str) -> None:
    """Main function of the child process: read values from stdin, write the mesh to the file of the first argument."""
    from netgen.occ import OCCGeometry

    module, function = entry.split(":")
    shape, maxh, fineness, *grading = getattr(import_module(module), function)(json.load(sys.stdin))
    mesh = OCCGeometry(shape).GenerateMesh(
        maxh=maxh,
        grading=grading[0] if grading else GRADING,
        curvaturesafety=fineness,
        segmentsperedge=fineness,
        parallel_meshing=False,
    )
    mesh.SecondOrder()
    solid, skin = mesh.Elements3D().NumPy(), mesh.Elements2D().NumPy()
    names = [mesh.GetBCName(k) for k in range(int(skin["index"].max()))]
    np.savez(
        sys.argv[1],
        nodes=mesh.Coordinates(),
        tets=solid["nodes"] - 1,
        triangles=skin["nodes"][:, :3] - 1,
        labels=skin["index"] - 1,
        names=names,
    )


def _solid(values: dict[str, Any]) -> tuple[Any, float, float]:
    """Solid, largest edge and fineness for the mesher; runs in its child process."""
    from cranktrain.structure.crank.shape import crankshaft_shape

    fineness, fillets = values.pop("fillet_fineness"), values.pop("fillets")
    sizes: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in values.items()}
    crankshaft = Crankshaft(**sizes)
    # With the default sizes fillets get half the largest edge, one curved side per quarter circle of 4.5 mm.
    return (
        crankshaft_shape(crankshaft, fineness, fillets),
        crankshaft.mesh_size,
        1.8 * crankshaft.fillet / crankshaft.mesh_size,
    )
