"""A cube of tetrahedra as meshing programs write it."""

import meshio
import numpy as np
from skfem import MeshTet1, MeshTet2

EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
"""Corners of the mid-side nodes as VTK and Abaqus have them."""
UNIVERSAL = (0, 4, 1, 5, 2, 6, 7, 8, 9, 3)
"""Nodes of Abaqus' order in that of a universal file: base with its middles, then the side edges, then the tip."""


class Cube:
    """Points (n, 3), ten-node tetrahedra (m, 10), and six-node triangles (k, 6) of the faces z = 0 and x = 1."""

    def __init__(self, quadratic=True):
        mesh = MeshTet2.from_mesh(MeshTet1().refined(1))
        corners = mesh.t.T
        middle = {tuple(sorted(edge)): mesh.nvertices + k for k, edge in enumerate(mesh.edges.T.tolist())}

        def mids(nodes, edges):
            return [[middle[tuple(sorted((row[a], row[b])))] for a, b in edges] for row in nodes.tolist()]

        self.points = mesh.doflocs.T
        volume = np.linalg.det(self.points[corners[:, 1:]] - self.points[corners[:, :1]])
        corners = np.where((volume > 0.0)[:, None], corners, corners[:, [0, 2, 1, 3]])
        self.tets = np.column_stack((corners, mids(corners, EDGES)))
        self.faces = {}
        for name, component, value in (("MAIN_1", 2, 0.0), ("pin1", 0, 1.0)):
            on = np.abs(mesh.p[component][mesh.facets] - value).max(axis=0) < 1e-9
            rows = mesh.facets[:, on].T
            self.faces[name] = np.column_stack((rows, mids(rows, ((0, 1), (1, 2), (0, 2)))))
        if not quadratic:
            self.tets = self.tets[:, :4]
            self.faces = {name: rows[:, :3] for name, rows in self.faces.items()}

    def triangles(self, name):
        """Corners of a face's triangles as a set."""
        return {frozenset(row[:3]) for row in self.faces[name].tolist()}


def numbered(rows, first, offset=1):
    return [f"{first + k}, " + ", ".join(str(n + offset) for n in row) for k, row in enumerate(rows.tolist())]


def node_lines(points, first=1):
    return [f"{first + k}, " + ", ".join(f"{x:.16g}" for x in p) for k, p in enumerate(points.tolist())]


def deck(cube, kind="CPS6", surfaces=True):
    """Lines of an input deck: nodes in two blocks, tetrahedra, triangles of a kind."""
    half = len(cube.points) // 2
    solid = "C3D10" if cube.tets.shape[1] == 10 else "C3D4"
    lines = ["*HEADING", "cube, of tetrahedra", "** a comment", "*Node, nset=all", *node_lines(cube.points[:half])]
    lines += ["*NODE", *node_lines(cube.points[half:], half + 1), f"*ELEMENT, TYPE={solid}, ELSET=solid"]
    lines += numbered(cube.tets, 1)
    first = len(cube.tets) + 1
    for name, rows in cube.faces.items() if surfaces else ():
        lines += [f"*Element, type={kind}, elset={name}", *numbered(rows, first)]
        first += len(rows)
    return lines


def universal(cube):
    """Lines of a universal file: units, nodes with FORTRAN's exponents, elements, groups of elements."""
    lines = ["    -1", "   164", "         1Meter (newton)         2", "    -1", "    -1", "  2411"]
    for k, point in enumerate(cube.points.tolist(), 1):
        lines += [f"{k:10d}{1:10d}{1:10d}{11:10d}", "".join(f"{x:25.16E}" for x in point).replace("E", "D")]
    lines += ["    -1", "    -1", "  2412"]

    def element(number, kind, nodes):
        head = "".join(f"{value:10d}" for value in (number, kind, 1, 1, 7, len(nodes)))
        return [head, *("".join(f"{n + 1:10d}" for n in nodes[k : k + 8]) for k in range(0, len(nodes), 8))]

    for k, row in enumerate(cube.tets.tolist(), 1):
        lines += element(k, 118, [row[i] for i in UNIVERSAL])
    first, groups = len(cube.tets) + 1, {}
    for name, rows in cube.faces.items():
        groups[name] = list(range(first, first + len(rows)))
        for number, row in zip(groups[name], rows.tolist(), strict=True):
            lines += element(number, 42, [row[i] for i in (0, 3, 1, 4, 2, 5)])
        first += len(rows)
    lines += ["    -1", "    -1", "  2467"]
    for k, (name, members) in enumerate(groups.items(), 1):
        lines += ["".join(f"{value:10d}" for value in (k, 0, 0, 0, 0, 0, 0, len(members))), name]
        pairs = [(8, number, 0, 0) for number in members]
        lines += ["".join(f"{v:10d}" for pair in pairs[i : i + 2] for v in pair) for i in range(0, len(pairs), 2)]
    return [*lines, "    -1"]


def by_meshio(path, cube, form):
    """File of meshio, with names as HyperMesh's comments where the format is Nastran's."""
    solid, flat = ("tetra10", "triangle6") if cube.tets.shape[1] == 10 else ("tetra", "triangle")
    cells = [(solid, cube.tets), *((flat, rows) for rows in cube.faces.values())]
    tags = [np.full(len(rows), k) for k, (_, rows) in enumerate(cells)]
    if form == "nastran":
        meshio.write(path, meshio.Mesh(cube.points, cells, cell_data={"nastran:ref": tags}), file_format="nastran")
        names = "".join(f'$HMNAME PROP {k:10d}"{name}" 4\n' for k, name in enumerate(cube.faces, 1))
        path.write_text(path.read_text().replace("BEGIN BULK\n", f"BEGIN BULK\n{names}"))
        return path
    fields = {name: np.array([k, 2]) for k, name in enumerate(cube.faces, 1)}
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    found = meshio.Mesh(cube.points, cells, cell_data=data, field_data=fields)
    meshio.write(path, found, file_format="gmsh22", binary=False)
    return path
