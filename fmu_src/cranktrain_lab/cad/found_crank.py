"""Conversion of a crank found in a solid to dimensions of an engine file and a mesh with named surfaces."""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array, Integers
from cranktrain.engine.checks.crankshaft import check_crankshaft
from cranktrain.engine.parts import Crankshaft
from cranktrain.structure.fem.mesh import NETGEN_EDGES, VTK_EDGES
from cranktrain_lab.cad.recognition import RecognisedCrank
from cranktrain_lab.cad.step_file import step_mesh
from cranktrain_lab.cad.web_outlines import WebShape, web_shapes

MM = 1e-3
DECIMALS = 7
"""Decimals of lengths in m (1e-4 mm), above the noise of the surface's points."""
ANGLE_DECIMALS = 8
LEAST_FILLET = 0.01
"""Fillet as a fraction of the main diameter if the solid has none, because the engine file requires one."""
FIT = 1e-5
"""Distance, m, between journals of solid and dimensions above which the user is warned."""
THRUST_REACH = 1.3
"""Least ratio of the thrust faces' outer radius to the radius of the main journal."""
LEAST_FINENESS = 0.42
"""Element edges per radius of curvature for a solid without fillets; equal to default fillets of engine files."""
CLEAR = 1.001
"""Factor by which a radius exceeds another radius that it must exceed."""


class Dimensions(NamedTuple):
    """Dimensions of an engine file, deviations from the solid, and the webs from which the dimensions follow."""

    crankshaft: Crankshaft
    doubts: tuple[str, ...]
    webs: tuple[WebShape, ...]


def dimensions(found: RecognisedCrank, mesh_size: float) -> Dimensions:
    """Return the crankshaft of an engine file (m, rad) that is nearest to the crank found in the solid.

    A dimension that the file states once is the median of the solid's values. Widths of mains are then changed so that
    every main has its position in the solid. Raises ``InputError`` if the file format cannot describe the crankshaft.
    """
    webs = web_shapes(found)
    doubts = list(found.doubts)
    flying = [web for web, beside in zip(webs, _beside_main(found), strict=True) if not beside]
    cheeks = [web for web, beside in zip(webs, _beside_main(found), strict=True) if beside]
    radius = _median([one.cylinder.radius for one in found.mains])
    fillets = [f for one in (*found.mains, *found.pins) for f in one.fillets if f > 1e-3 * radius]
    fillet = _median(fillets) if fillets else LEAST_FILLET * 2.0 * radius
    if not fillets:
        doubts.append(f"no fillets: the engine file has {fillet:.2f} mm, the mesh none")
    elif np.ptp(fillets) > 0.02:
        doubts.append(f"fillets extend {min(fillets):.2f} to {max(fillets):.2f} mm; the engine file has {fillet:.2f}")
    if np.ptp([web.thickness for web in cheeks]) > 0.02:
        sizes = sorted(web.thickness for web in cheeks)
        doubts.append(f"webs are {sizes[0]:.2f} to {sizes[-1]:.2f} mm thick; the engine file has their median")
    weights = [web for web in cheeks if web.weight_radius > 0.0]
    pin_radius = _median([one.cylinder.radius for one in found.pins])
    least = {"main": CLEAR * (radius + fillet), "pin": CLEAR * (pin_radius + fillet)}
    main_web = max(_median([web.main_radius for web in cheeks]), least["main"])
    weight = max(_median([web.weight_radius for web in weights] or [0.0]), CLEAR * main_web)
    throws = [float(np.hypot(*one.cylinder.axis)) for one in found.pins]
    thickness, pin_width = _median([web.thickness for web in cheeks]), _median([one.width for one in found.pins])
    gap = _median([web.thickness for web in flying]) if flying else 0.0
    first, last = found.mains[0], found.mains[-1]
    nose = found.nose.radius if found.nose else 0.0
    made = Crankshaft(
        throw=_metres(throws[0]),
        throw_angles=tuple(round(math.atan2(-one.cylinder.axis[0], one.cylinder.axis[1]), ANGLE_DECIMALS) + 0.0
                           for one in found.pins),
        main_diameter=_metres(2.0 * radius),
        main_widths=_widths(found, 2.0 * thickness + pin_width, pin_width + gap),
        pin_diameter=_metres(2.0 * pin_radius),
        pin_width=_metres(pin_width),
        web_thickness=_metres(thickness),
        web_main_radius=_metres(main_web),
        web_pin_radius=_metres(max(_median([web.pin_radius for web in cheeks]), least["pin"])),
        counterweight_radius=_metres(weight),
        counterweight_half_width=_metres(max(_median([web.weight_half_width for web in weights] or [0.0]),
                                             least["main"])),
        counterweights=tuple(web.weight_radius > 0.0 for web in webs),
        nose_diameter=_metres(2.0 * min(nose or 0.8 * radius, (radius - fillet) / CLEAR)),
        nose_length=_metres(max(first.start - found.ends[0], 1.5 * fillet)),
        flange_diameter=_metres(2.0 * max(found.flange.radius if found.flange else 0.0, least["main"])),
        flange_length=_metres(max(found.ends[1] - last.end, 0.1 * radius)),
        fillet=_metres(fillet),
        oil_hole_diameter=_metres(0.1 * 2.0 * pin_radius),
        oil_holes=False,
        mesh_size=mesh_size,
        pins_between_mains=() if set(found.bays) == {1} else found.bays,
        flying_web_thickness=_metres(gap),
        pin_throws=() if np.ptp(throws) < 5e-3 else tuple(_metres(throw) for throw in throws),
    )  # fmt: skip
    try:
        check_crankshaft(made)
    except InputError as reason:
        raise InputError(f"{found.solid.path}: no crankshaft of an engine file's form: {reason}") from None
    z = np.array([0.5 * (journal.start + journal.end) for journal in found.pins])
    off = np.abs(MM * z - np.array(made.pin_positions))
    if off.max() >= FIT:
        doubts.append(f"pin {int(off.argmax()) + 1} lies {1e3 * off.max():.2f} mm from where the dimensions have it")
    return Dimensions(made, tuple(doubts), webs)


def _median(values: list[float]) -> float:
    return float(np.median(values))


def _metres(value: float) -> float:
    return round(MM * value, DECIMALS)


def _beside_main(found: RecognisedCrank) -> list[bool]:
    """Return True for each web that joins a main journal, and False for flying webs between two pins."""
    return [k in (0, count) for count in found.bays for k in range(count + 1)]


def _widths(found: RecognisedCrank, one: float, pitch: float) -> tuple[float, ...]:
    """Return main widths (m), nearest to the found widths, for the found positions; ``one``: webs and pin, mm."""
    own = np.array([journal.width for journal in found.mains])
    places = np.array([0.5 * (journal.start + journal.end) for journal in found.mains])
    bays = np.array([one + (count - 1) * pitch for count in found.bays])
    halves = 0.5 * (np.eye(len(bays), len(own)) + np.eye(len(bays), len(own), 1))
    widths = own + np.linalg.pinv(halves) @ (np.diff(places) - bays - halves @ own)
    return tuple(_metres(float(width)) for width in widths)


def write_crank_mesh(path: Path, found: RecognisedCrank, crankshaft: Crankshaft, thrust_main: int) -> tuple[int, int]:
    """Write a mesh of the solid (Gmsh 2.2, m) with named surfaces in the crank's frame. Return node and element counts.

    The largest edge and the edges on fillets are those of the parametric crank.
    """
    import meshio

    fineness = max(LEAST_FINENESS, 1.8 * crankshaft.fillet / crankshaft.mesh_size)
    edge = crankshaft.mesh_size / MM
    nodes, tets, triangles, faces = step_mesh(found.solid, found.turn, found.shift, edge, fineness)
    nodes = MM * nodes
    named = _surfaces(found, crankshaft, thrust_main, nodes, triangles, faces)
    if missing := [name for name, chosen in named.items() if not len(chosen)]:
        raise InputError(
            f"{found.solid.path}: no surface for {', '.join(missing)}; name surfaces in a mesh of your own"
        )
    order = [0, 1, 2, 3, *(4 + NETGEN_EDGES.index((min(edge), max(edge))) for edge in VTK_EDGES)]
    cells = [("tetra10", tets[:, order]), *(("triangle", chosen) for chosen in named.values())]
    tags = [np.full(len(block), number) for number, (_, block) in enumerate(cells)]
    fields = {name: np.array([number, 2]) for number, name in enumerate(named, 1)}
    mesh = meshio.Mesh(nodes, cells, cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags}, field_data=fields)
    meshio.write(path, mesh, file_format="gmsh22", binary=True)
    return len(nodes), len(tets)


def _surfaces(
    found: RecognisedCrank, crankshaft: Crankshaft, thrust_main: int, nodes: Array, triangles: Integers, faces: Integers
) -> dict[str, Integers]:
    """Return the k surface triangles (k, 3) of each interface of the crank."""
    chosen = {f"main[{k}]": one.cylinder.faces for k, one in enumerate(found.mains, 1)}
    chosen |= {f"pin[{k}]": one.cylinder.faces for k, one in enumerate(found.pins, 1)}
    named = {name: triangles[np.isin(faces, own)] for name, own in chosen.items()}
    corners = nodes[triangles]
    middle = np.hypot(*corners[:, :, :2].mean(axis=1).T)
    plane = found.faces.plane[faces]

    def ring(z: float, inner: float, outer: float) -> NDArray[np.bool_]:
        flat = np.abs(corners[:, :, 2] - MM * z).max(axis=1) < 1e-3 * crankshaft.main_diameter
        return np.asarray(plane & flat & (middle > inner) & (middle < outer))

    if found.nose is not None:
        named["pulley"] = triangles[np.isin(faces, found.nose.faces)]
    else:
        named["pulley"] = triangles[ring(found.ends[0], 0.0, np.inf)]
    # The flywheel's face is the largest rearward face behind the last main.
    middles = np.array([points[:, 2].mean() if len(points) else -np.inf for points in found.faces.corners])
    behind = middles > found.mains[-1].end - 1e-3 * found.mains[-1].cylinder.radius
    looking = found.faces.plane & (found.faces.normal[:, 2] > 0.999) & behind
    largest = int(np.argmax(np.where(looking, found.faces.area, -1.0)))
    named["flywheel"] = triangles[ring(float(middles[largest]), 0.0, np.inf)]
    own, radius = found.mains[thrust_main - 1], 0.5 * crankshaft.main_diameter
    reach = max(crankshaft.web_main_radius, THRUST_REACH * radius)
    sides = [ring(z, radius, reach) for z in (own.start, own.end)]
    named["thrust"] = triangles[sides[0] | sides[1]]
    return named
