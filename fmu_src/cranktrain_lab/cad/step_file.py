"""Solid of a STEP file read by netgen's CAD kernel: surface with numbered faces, and mesh.

The kernel converts every unit of a STEP file to mm. It runs in a separate process, because a broken file can crash it.
"""

import json
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array, Integers
from cranktrain.core.user_file import check_file
from cranktrain.structure.fem.cad_process import run_in_child
from cranktrain.structure.fem.mesh import cad_mesh
from cranktrain.structure.fem.own_mesh import UNITS

FINENESS, GRADING = 1.5, 0.7
"""Mesh settings of the surface for recognition: edges per radius of curvature, and growth of edges."""
EDGES_ALONG = 30
"""Ratio of the solid's length to the largest edge of the surface mesh for recognition."""
READ_SECONDS = 300.0
MESH_GRADING = 0.5
RETRIES = ((1.0, 0.4), (1.5, 0.3))
"""Edges per radius of curvature and growth in further attempts if meshing fails (small bores need finer edges)."""
LEAST_LENGTH, LARGEST_LENGTH = 30.0, 25000.0
"""Limits of the length of crankshafts, mm."""


class StepSolid(NamedTuple):
    """Surface of a solid, mm.

    Attributes
    ----------
    nodes : (n, 3) mm, on the surface
    triangles : (k, 3) node indices, with outward normals
    faces : (k,) number of each triangle's face in the file, from 0
    volume : mm³
    """

    path: Path
    nodes: Array
    triangles: Integers
    faces: Integers
    volume: float
    scale: float = 1.0
    """Factor from coordinates of the CAD kernel to the nodes, if the user has corrected the file's unit."""


def read_step(path: str | Path, unit: str | None = None) -> StepSolid:
    """Read the single solid of a STEP file; ``unit`` overrides the file's unit if it is wrong.

    Raises ``InputError`` for a missing, truncated or other file, for no solid or several, or for a surface that is not
    closed. The message states what was found.
    """
    source = Path(path).expanduser()
    if unit is not None and unit not in UNITS:
        raise InputError(f"--cad-unit '{unit}' does not exist; valid: {', '.join(UNITS)}")
    _check_text(source)
    with tempfile.TemporaryDirectory(prefix="cranktrain-step-") as folder:
        copy, target = Path(folder) / "crank.step", Path(folder) / "surface.npz"
        shutil.copyfile(source, copy)
        code = f"from {__name__} import surface_child; surface_child()"
        ended = run_in_child(code, str(copy), target, READ_SECONDS)
        if ended is not None:
            raise InputError(f"{path}: the CAD kernel cannot read or mesh the solid ({ended}); repair it in CAD")
        with np.load(target) as data:
            if refused := str(data["refused"]):
                raise InputError(f"{path}: {refused}")
            solid = StepSolid(source, data["nodes"], data["triangles"], data["faces"], float(data["volume"]))
    # Refuse a surface with open edges.
    edges = np.sort(np.concatenate([solid.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))]), axis=1)
    once, count = np.unique(edges, axis=0, return_counts=True)
    if (count == 1).any():
        x, y, z = solid.nodes[once[count == 1][0]].mean(axis=0)
        raise InputError(
            f"{solid.path}: the solid's surface is open at ({x:.1f}, {y:.1f}, {z:.1f}) mm: close it in CAD, or sew its "
            "faces to a solid"
        )
    length = float(np.ptp(solid.nodes, axis=0).max())
    # A given unit applies to the numbers of the file, which the kernel has converted from the file's own unit.
    factor = 1.0 if unit is None else 1e3 * UNITS[unit] / stated_unit(source)
    if not LEAST_LENGTH <= factor * length <= LARGEST_LENGTH:
        raise InputError(
            f"{path}: the solid is {factor * length:.4g} mm long, crankshafts are {LEAST_LENGTH:g} to "
            f"{LARGEST_LENGTH:g} mm: state the unit of its coordinates, --cad-unit {', '.join(UNITS)}"
        )
    return solid._replace(nodes=factor * solid.nodes, volume=factor**3 * solid.volume, scale=factor)


def stated_unit(path: Path) -> float:
    """Return the unit of length that a STEP file states, mm."""
    text = " ".join(path.read_text(errors="replace").split())
    converted = re.search(r"CONVERSION_BASED_UNIT ?\( ?'(?:INCH|IN)'", text, re.IGNORECASE)
    if converted:
        return 25.4
    prefix = re.search(r"LENGTH_UNIT\(\)[^;]*?SI_UNIT ?\( ?(\$|\.\w+\.) ?, ?\.METRE\.", text)
    return {"$": 1e3, ".CENTI.": 10.0, ".MILLI.": 1.0, ".MICRO.": 1e-3}.get(prefix[1] if prefix else "", 1.0)


def step_mesh(
    solid: StepSolid, turn: Array, shift: Array, largest_edge: float, fineness: float
) -> tuple[Array, Integers, Integers, Integers]:
    """Mesh the solid. Return nodes (n, 3) mm, tets (m, 10), triangles (k, 3) and the face (k,) of each triangle.

    Parameters
    ----------
    turn, shift : rotation (3, 3) and shift (3,) mm to apply first, because the mesher's grid is aligned to the axes and
        gives an inclined long solid a coarser mesh
    largest_edge : largest edge, mm
    fineness : edges per radius of curvature
    """
    from scipy.spatial.transform import Rotation

    vector = Rotation.from_matrix(turn).as_rotvec()
    angle = float(np.linalg.norm(vector))
    axis = vector / angle if angle > 0.0 else np.array([0.0, 0.0, 1.0])
    with tempfile.TemporaryDirectory(prefix="cranktrain-step-") as folder:
        copy = Path(folder) / "crank.step"
        shutil.copyfile(solid.path, copy)
        for sides, grading in ((fineness, MESH_GRADING), *RETRIES):
            values = {
                "path": str(copy),
                "largest_edge": largest_edge / solid.scale,
                "fineness": max(sides, fineness),
                "grading": grading,
                "turn": [*axis.tolist(), angle],
                "shift": (shift / solid.scale).tolist(),
            }
            try:
                nodes, tets, triangles, labels, names = cad_mesh(
                    f"{__name__}:_solid", values, str(solid.path), "--mesh-size-mm"
                )
                break
            except InputError:
                if grading == RETRIES[-1][1]:
                    raise
    return solid.scale * nodes, tets, triangles, np.array([int(name) for name in names])[labels]


def _check_text(path: Path) -> None:
    """Raise ``InputError`` for a file that is not a complete STEP file."""
    check_file(path, f"{path}", "give a STEP file of the crankshaft")
    try:
        with path.open("rb") as file:
            head = file.read(4096)
            file.seek(max(0, path.stat().st_size - 4096))
            tail = file.read()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give a STEP file of the crankshaft") from None
    if b"ISO-10303-21" not in head:
        what = "is empty" if not head else "does not begin with ISO-10303-21"
        raise InputError(f"{path}: no STEP file: it {what}; export the crankshaft as STEP (AP203, AP214 or AP242)")
    if b"END-ISO-10303-21" not in tail:
        raise InputError(f"{path}: cut short: a STEP file ends with END-ISO-10303-21; copy or export it again")


def _read_shape(path: str) -> Any:
    """Return the shape of a file (in the child process); ``ValueError`` states the contents if not one solid."""
    from netgen.occ import OCCGeometry

    try:
        shape = OCCGeometry(path).shape
    # netgen's exception derives directly from Exception.
    except Exception as reason:
        text = Path(path).read_text(errors="replace")
        kinds = ("MANIFOLD_SOLID_BREP", "SHELL_BASED_SURFACE_MODEL", "GEOMETRIC_CURVE_SET", "TESSELLATED_SOLID")
        found = [f"{len(re.findall(kind + r'[(_]', text))} {kind}" for kind in kinds if kind in text]
        held = f"it names {', '.join(found)}" if found else "it names no solid"
        raise ValueError(f"the CAD kernel finds no shape in it ({reason}); {held}: export it as a solid") from None
    solids = list(shape.solids)
    if len(solids) != 1:
        if not solids:
            faces, shells = len(list(shape.faces)), len(list(shape.shells))
            held = f"no solid, but {shells} open shells with {faces} faces" if faces else "no solid and no faces"
            raise ValueError(f"holds {held}: export the crankshaft as one solid")
        volumes = ", ".join(f"{1e-3 * volume:.4g}" for volume in sorted((s.mass for s in solids), reverse=True)[:5])
        raise ValueError(
            f"holds {len(solids)} solids, the largest of {volumes} cm^3: export the crankshaft alone, as one solid"
        )
    solid = solids[0]
    for number, face in enumerate(solid.faces):
        face.name = str(number)
    return solid


def surface_child() -> None:
    """Main function of the child process: read the file named on stdin, write its surface to the first argument."""
    from netgen.meshing import MeshingStep
    from netgen.occ import OCCGeometry

    try:
        shape = _read_shape(json.load(sys.stdin))
    except ValueError as refused:
        np.savez(sys.argv[1], refused=str(refused))
        return
    low, high = shape.bounding_box
    length = max(b - a for a, b in zip(tuple(low), tuple(high), strict=True))
    mesh = OCCGeometry(shape).GenerateMesh(
        maxh=length / EDGES_ALONG,
        grading=GRADING,
        curvaturesafety=FINENESS,
        segmentsperedge=1.0,
        parallel_meshing=False,
        perfstepsend=MeshingStep.MESHSURFACE,
    )
    skin = mesh.Elements2D().NumPy()
    numbers = np.array([int(mesh.GetBCName(k)) for k in range(int(skin["index"].max()))])
    np.savez(
        sys.argv[1],
        refused="",
        nodes=mesh.Coordinates(),
        triangles=skin["nodes"][:, :3] - 1,
        faces=numbers[skin["index"] - 1],
        volume=shape.mass,
    )


def _solid(values: Mapping[str, Any]) -> tuple[Any, float, float, float]:
    """Return shape, largest edge, fineness and grading (in the child process that meshes)."""
    from netgen.occ import Axis, Pnt, Vec, gp_Dir

    shape = _read_shape(os.fspath(values["path"]))
    *axis, angle = values["turn"]
    if angle:
        shape = shape.Rotate(Axis(Pnt(0, 0, 0), gp_Dir(*axis)), np.degrees(angle))
    shape = shape.Move(Vec(*values["shift"]))
    for number, face in enumerate(shape.faces):
        face.name = str(number)
    return shape, values["largest_edge"], values["fineness"], values["grading"]
