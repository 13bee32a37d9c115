"""The parametric crankshaft and meshes from files: dimensions, surfaces, and what is refused."""

import subprocess
import sys
from dataclasses import replace
from functools import cache
from math import cos, pi, radians, sin, sqrt

import meshio
import numpy as np
import pytest
from one_line import one_line
from solids import STEEL, block, frequencies, round_bar

from cranktrain.engine.file import load_engine
from cranktrain.engine.parts import Crankshaft
from cranktrain.structure.crank.shape import interface_names, pin_centre, stations
from cranktrain.structure.fem import mesh as mesh_module
from cranktrain.structure.fem.elasticity import finite_elements, scalar_basis
from cranktrain.structure.fem.mesh import (
    VTK_EDGES,
    crankshaft_mesh,
    quadratic_mesh,
    read_mesh,
    relative_jacobian,
    surface_area,
)

SINGLE = Crankshaft(
    throw=0.04, throw_angles=(radians(30.0),), main_diameter=0.06, main_widths=(0.04, 0.036), pin_diameter=0.05,
    pin_width=0.04, web_thickness=0.02, web_main_radius=0.045, web_pin_radius=0.036, counterweight_radius=0.08,
    counterweight_half_width=0.05, counterweights=(True, True), nose_diameter=0.04, nose_length=0.04,
    flange_diameter=0.1, flange_length=0.015, fillet=0.004, oil_hole_diameter=0.006, oil_holes=False, mesh_size=0.018,
)  # fmt: skip
EIGHT = replace(load_engine("diesel_v8").crankshaft, mesh_size=0.03)
"""A cross-plane crankshaft of five mains."""


meshed = cache(crankshaft_mesh)


@pytest.fixture(scope="module")
def single():
    return meshed(SINGLE)


def web_volume(c: Crankshaft) -> float:
    """Hull of two circles, and the counterweight less what the hull covers of it (η ≤ 0, where it is a half disc)."""
    main, pin, r, b = c.web_main_radius, c.web_pin_radius, c.counterweight_radius, c.counterweight_half_width
    lean = np.arcsin((main - pin) / c.throw)
    hull = (pi / 2 + lean) * main**2 + (pi / 2 - lean) * pin**2 + c.throw * cos(lean) * (main + pin)
    counterweight = b * sqrt(r**2 - b**2) + r**2 * np.arcsin(b / r)
    return c.web_thickness * (hull + counterweight - pi / 2 * main**2)


def fillet_volume(radius: float, fillet: float) -> float:
    """Ring between a journal, a plane and a quarter circle (Pappus), whose centroid is f (10 − 3π)/(12 − 3π) high."""
    return 2 * pi * (radius + fillet * (10 - 3 * pi) / (12 - 3 * pi)) * (1 - pi / 4) * fillet**2


@pytest.mark.parametrize("c", [SINGLE, EIGHT], ids=["single", "v8"])
def test_volume_is_that_of_the_pieces(c):
    """What is left is the difference of curved quadratic sides to circles; each pin is where it is said to be."""
    throws = len(c.throw_angles)
    main, pin, nose, flange = (d / 2 for d in (c.main_diameter, c.pin_diameter, c.nose_diameter, c.flange_diameter))
    volume = pi * (main**2 * sum(c.main_widths) + throws * pin**2 * c.pin_width)
    volume += pi * (nose**2 * c.nose_length + flange**2 * c.flange_length) + 2 * throws * web_volume(c)
    volume += (2 * throws + 1) * fillet_volume(main, c.fillet) + 2 * throws * fillet_volume(pin, c.fillet)
    mesh = meshed(c)
    assert scalar_basis(mesh).dx.sum() == pytest.approx(volume + fillet_volume(nose, c.fillet), rel=1e-3)
    assert set(mesh.boundaries) == set(interface_names(throws + 1, throws))
    for k in range(1, throws + 1):
        assert surface_area(mesh, f"pin[{k}]")[1] == pytest.approx(pin_centre(c, k), abs=5e-4)


def test_surfaces_have_their_area_and_place(single):
    c, at = SINGLE, stations(SINGLE)
    assert set(single.boundaries) == set(interface_names(2, 1))
    x, y, z = pin_centre(c, 1)
    assert (x, y) == pytest.approx((-c.throw * sin(radians(30)), c.throw * cos(radians(30))))
    running = pi * c.main_diameter
    expected = {
        "main[1]": (running * (c.main_widths[0] - c.fillet), (0, 0, -c.fillet / 2)),
        "main[2]": (running * (c.main_widths[1] - 2 * c.fillet), (0, 0, sum(at.mains[1]) / 2)),
        "pin[1]": (pi * c.pin_diameter * (c.pin_width - 2 * c.fillet), (x, y, z)),
        "pulley": (pi * c.nose_diameter * (c.nose_length - c.fillet), (0, 0, (sum(at.nose) - c.fillet) / 2)),
        "flywheel": (pi * c.flange_diameter**2 / 4, (0, 0, at.flange[1])),
    }
    for name, (area, place) in expected.items():
        found, centre = surface_area(single, name)
        assert found == pytest.approx(area, rel=5e-3), name
        assert centre == pytest.approx(place, abs=2e-4), name


@pytest.mark.parametrize(("c", "asked", "main"), [(SINGLE, None, 1), (SINGLE, 2, 2), (EIGHT, None, 3)])
def test_thrust_faces_lie_beside_their_journal(c, asked, main):
    """By default beside the middle one."""
    mesh = meshed(c) if asked is None else crankshaft_mesh(c, thrust_main=asked)
    corners = mesh.p[:, mesh.facets[:, mesh.boundaries["thrust"]]]
    places = np.unique(np.round(corners[2], 9))
    assert np.abs(places[:, None] - stations(c).mains[main - 1]).min(axis=1).max() < 1e-9
    assert places.size == (1 if main == 1 else 2), "the front main has one face beside it"
    assert np.hypot(*corners[:2]).min() > 0.999 * (c.main_diameter / 2 + c.fillet)


def test_elements_are_sound_and_the_body_hangs_together(single):
    assert relative_jacobian(single).min() > mesh_module.REFUSED_BELOW
    model = finite_elements(single, STEEL)
    hz, _ = frequencies(model.stiffness, model.mass, 7, 500.0)
    assert hz[5] < 1e-2 < 1e3 < hz[6]


def test_meshing_repeats_itself(single):
    again = crankshaft_mesh(SINGLE)
    assert np.array_equal(again.doflocs, single.doflocs) and np.array_equal(again.t, single.t)


def test_oil_holes_take_away_their_bore(single):
    bored = crankshaft_mesh(replace(SINGLE, oil_holes=True))
    lost = scalar_basis(single).dx.sum() - scalar_basis(bored).dx.sum()
    # From the middle of main journal 1, which is z = 0, to the middle of the pin.
    run = pin_centre(SINGLE, 1)[2]
    length = np.hypot(SINGLE.throw + (SINGLE.main_diameter + SINGLE.pin_diameter) / 2, run)
    bore = pi / 4 * SINGLE.oil_hole_diameter**2 * length
    # Its ends are cut by curved journals: a hole's diameter of length at most.
    assert lost == pytest.approx(bore, abs=pi / 4 * SINGLE.oil_hole_diameter**3)


@pytest.mark.parametrize(("key", "value"), [
    ("web_pin_radius", 0.02), ("fillet", 0.03), ("main_widths", (0.04, -0.01)), ("counterweight_radius", 0.03),
    ("counterweights", (True,)), ("throw", float("nan")),
])  # fmt: skip
def test_impossible_dimensions_are_refused_in_one_line(key, value):
    with one_line(key):
        crankshaft_mesh(replace(SINGLE, **{key: value}))


def test_a_crash_of_the_cad_kernel_is_one_line(monkeypatch):
    def crash(command, **options):
        command = [sys.executable, "-c", "import os; os.kill(os.getpid(), 11)"]
        return run(command, **options)

    run = subprocess.run
    monkeypatch.setattr("cranktrain.structure.fem.cad_process.subprocess.run", crash)
    with one_line("CAD kernel failed (signal 11"):
        crankshaft_mesh(SINGLE)


def test_inverted_sides_are_relaxed_and_flat_elements_refused():
    solid = block((1, 1, 1), (1, 1, 1))
    tets = np.vstack((solid.t, solid.nvertices + solid.t2e)).T
    nodes = solid.doflocs.T.copy()
    nodes[tets[0, 4]] += 0.8 * (nodes[tets[0, 3]] - nodes[tets[0, 0]])
    mesh = quadratic_mesh(nodes, tets, {}, VTK_EDGES)
    assert relative_jacobian(mesh).min() >= mesh_module.REFUSED_BELOW
    nodes = solid.doflocs.T.copy()
    nodes[tets[0, 0]] = nodes[tets[0, 1:4]].mean(axis=0)
    with one_line("flat"):
        quadratic_mesh(nodes, tets, {}, VTK_EDGES)


def shaft_file(path, quadratic=True, leave_out=(), scale=1.0):
    """A round bar with the surfaces of a crankshaft of one throw, written by meshio."""
    bar = round_bar(0.02, 0.1, 1, 10)
    tets = np.vstack((bar.t, bar.nvertices + bar.t2e)).T if quadratic else bar.t.T
    points = scale * (bar.doflocs if quadratic else bar.p).T
    facets = bar.boundary_facets()
    z = bar.p[2, bar.facets[:, facets]].mean(axis=0)
    spans = {"pulley": (0.0, 0.02), "MAIN_1": (0.02, 0.04), "pin-1": (0.04, 0.06), "main2": (0.06, 0.08)}
    spans |= {"flywheel": (0.08, 0.09), "Thrust": (0.09, 0.1)}
    chosen = {n: facets[(z > a + 1e-9) & (z < b - 1e-9)] for n, (a, b) in spans.items() if n not in leave_out}
    triangles = [bar.facets[:, f].T for f in chosen.values()]
    if quadratic:
        middles = {tuple(e): bar.nvertices + i for i, e in enumerate(np.sort(bar.edges, axis=0).T)}
        pairs = ((0, 1), (1, 2), (0, 2))
        triangles = [
            np.array([[*t, *(middles[tuple(sorted(t[list(p)]))] for p in pairs)] for t in patch]) for patch in triangles
        ]
    kinds = ("tetra10", "triangle6") if quadratic else ("tetra", "triangle")
    cells = [(kinds[0], tets)] + [(kinds[1], patch) for patch in triangles]
    tags = [np.full(len(block), k) for k, (_, block) in enumerate(cells)]
    fields = {name: np.array([k, 2]) for k, name in enumerate(chosen, start=1)}
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    mesh = meshio.Mesh(points, cells, cell_data=data, field_data=fields)
    meshio.write(path, mesh, file_format="gmsh22", binary=False)
    spelled = {"MAIN_1": "main[1]", "main2": "main[2]", "pin-1": "pin[1]", "Thrust": "thrust"}
    return bar, {spelled.get(n, n): f for n, f in chosen.items()}


def test_a_mesh_of_the_user(tmp_path):
    """Volume and surfaces of a curved bar; linear tetrahedra are warned of."""
    for quadratic in (True, False):
        bar, chosen = shaft_file(tmp_path / "bar.msh", quadratic)
        if quadratic:
            mesh, reference = read_mesh(tmp_path / "bar.msh"), bar
        else:
            with pytest.warns(UserWarning, match="linear tetrahedra"):
                mesh, reference = read_mesh(tmp_path / "bar.msh"), bar.from_mesh(bar)
        assert set(interface_names(2, 1)) <= set(mesh.boundaries)
        close = 1e-9 if quadratic else 0.2
        assert scalar_basis(mesh).dx.sum() == pytest.approx(scalar_basis(bar).dx.sum(), rel=close)
        for name, facets in chosen.items():
            assert len(mesh.boundaries[name]) == len(facets)
            area, centre = surface_area(mesh, name)
            wanted, place = surface_area(reference.with_boundaries({name: facets}), name)
            assert centre == pytest.approx(place, abs=1e-3) and area == pytest.approx(wanted, rel=0.5 * close)


def test_files_that_hold_no_such_mesh_are_refused_in_one_line(tmp_path):
    """Millimetres are stated; surfaces that lack are listed; z is the axis."""
    shaft_file(tmp_path / "mm.msh", scale=1e3)
    assert np.ptp(read_mesh(tmp_path / "mm.msh", unit="mm").p[2]) == pytest.approx(0.1)
    shaft_file(tmp_path / "lacks.msh", leave_out=("pulley", "pin-1"))
    shaft_file(tmp_path / "bar.msh")
    found = meshio.read(tmp_path / "bar.msh")
    turned = meshio.Mesh(
        found.points[:, [2, 1, 0]], found.cells, cell_data=found.cell_data, field_data=found.field_data
    )
    meshio.write(tmp_path / "turned.msh", turned, file_format="gmsh22", binary=False)
    (tmp_path / "broken.msh").write_text("not a mesh\n")
    (tmp_path / "shaft.step").write_text("")
    for name, said in (
        ("mm.msh", "state the mesh unit"),
        ("lacks.msh", "no surface named pin[1], pulley; found flywheel, main[1]"),
        ("turned.msh", "z is the crank axis"),
        ("broken.msh", "not readable"),
        ("none.inp", "no such"),
        ("shaft.step", "CAD, no mesh"),
    ):
        with one_line(said):
            read_mesh(tmp_path / name)
