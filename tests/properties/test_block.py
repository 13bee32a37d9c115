"""The engine block: its solid, its interfaces, its reduction, and what is refused."""

from dataclasses import asdict, replace

import meshio
import numpy as np
import pytest
from bodies import rigid_crank
from one_line import one_line
from scipy.linalg import eigh
from small_block import single
from solids import STEEL, ring
from some import some

from cranktrain.core.reduced_body import rigid, rigid_coordinates
from cranktrain.engine.checks.block import check_block, check_mounts, mount_stiffness
from cranktrain.engine.file import load_engine
from cranktrain.structure.block.bore import block_bore_compliance, bore_loads
from cranktrain.structure.block.mesh import block_interface_names, block_mesh, interface_places, read_block_mesh
from cranktrain.structure.block.modal import block_modes
from cranktrain.structure.block.reduction import block_loads, complete_block, reduced_block, running_block
from cranktrain.structure.block.saddle import DEGREE, WAVES
from cranktrain.structure.block.shape import block_plan, block_shape, cut, edges, hull, inset, outlines
from cranktrain.structure.crank.modal import cranktrain_matrices
from cranktrain.structure.fem.elasticity import finite_elements, sample
from cranktrain.structure.fem.mesh import surface_area


@pytest.fixture(scope="module")
def engine():
    return single()


@pytest.fixture(scope="module")
def plan(engine):
    return block_plan(engine)


@pytest.fixture(scope="module")
def mesh(plan):
    return block_mesh(plan)


@pytest.fixture(scope="module")
def body(engine):
    return reduced_block(engine, checked=True)


def elastic_compliance(body, loads):
    """Elastic motion at each load per unit of each load, balanced by inertia, (loads, loads)."""
    rows = np.stack([body.shapes[body.index(name), component, 6:] for name, component in loads]) / body.omega[6:]
    return rows @ rows.T


def polygon_area(points):
    x, y = np.array(points).T
    return 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))


def test_outlines_of_line_and_v():
    six = block_plan(load_engine("diesel_i6"))
    bank = six.banks[0]
    banks = replace(bank, angle=-np.pi / 4), replace(bank, angle=np.pi / 4)
    leaning = replace(six, block=replace(six.block, foot_height=0.2, side_height=0.05), banks=banks)
    for plan in (six, leaning):
        outer, inner = outlines(plan)
        assert polygon_area(outer) > polygon_area(inner) > 0
        for points in (outer, inner):
            mirrored = sorted((round(-x, 9), round(y, 9)) for x, y in points)
            assert mirrored == sorted((round(x, 9), round(y, 9)) for x, y in points)
        # Walls are as thick as stated all around; below the skirt is open.
        for point in inner:
            gaps = [inward(point, a, b) for a, b in edges(outer)]
            assert min(gap for gap, (a, b) in zip(gaps, edges(outer), strict=True) if a[1] != b[1] or a[1] > 0) >= (
                plan.block.wall_thickness - 1e-12
            )
            assert min(gaps) < plan.block.wall_thickness + 1e-12


def inward(point, a, b):
    """Distance of a point from the edge ab, to its left."""
    across = (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0])
    return across / np.hypot(b[0] - a[0], b[1] - a[1])


def test_polygons():
    square = hull([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0), (1.0, 1.0), (1.0, 0.0)])
    parts = square, inset(square, (0.1, 0.2, 0.1, 0.2)), cut(square, 0.5, above=True), cut(square, 0.5, above=False)
    assert [polygon_area(part) for part in parts] == pytest.approx([4.0, 1.8 * 1.6, 3.0, 1.0])
    assert cut(square, 2.0, above=True) == []


def test_mass_and_inertia_are_the_solids(plan, body):
    """Volume, centre and inertia of the CAD kernel; where curved sides had to be drawn in they miss them by little."""
    shape = block_shape(plan)
    density = plan.block.density
    assert body.mass == pytest.approx(density * shape.mass, rel=3e-4)
    assert body.centre == pytest.approx(np.array(tuple(shape.center)), abs=1e-4)
    # The kernel's tensor is about the centre of mass, of density 1.
    matrix = np.array([[shape.inertia[i, j] for j in range(3)] for i in range(3)])
    about = body.inertia - body.mass * (body.centre @ body.centre * np.eye(3) - np.outer(body.centre, body.centre))
    assert about == pytest.approx(density * matrix, rel=1e-3, abs=2e-4 * np.trace(about))


def test_surfaces_have_the_plans_areas(plan, mesh):
    b = plan.block
    housing, band = b.housing_thickness, 0.25 * plan.stroke
    for i, diameter in enumerate(plan.bores, 1):
        assert surface_area(mesh, f"bore[{i}]")[0] == pytest.approx(np.pi * diameter * housing, rel=1e-3)
    for end in ("upper", "lower"):
        assert surface_area(mesh, f"liner[1].{end}")[0] == pytest.approx(np.pi * plan.cylinder_bore * band, rel=1e-3)
    front, rear = plan.ends
    deck = 2 * b.bank_half_width * (rear - front) - 0.25 * np.pi * plan.cylinder_bore**2
    assert surface_area(mesh, "head[1]")[0] == pytest.approx(deck, rel=1e-3)
    main, outside = plan.thrust
    ring = 0.5 * np.pi * (outside**2 - plan.bores[main] ** 2)
    assert surface_area(mesh, "thrust")[0] == pytest.approx(ring, rel=1e-3)
    for k in range(1, 5):
        assert surface_area(mesh, f"mount[{k}]")[0] == pytest.approx(b.pad_size**2, rel=1e-9)


def test_interfaces_lie_where_the_plan_says(engine, plan, body):
    crank = engine.crankshaft
    assert body.interfaces == block_interface_names(2, 1, 4)
    places = dict(zip(body.interfaces, body.positions, strict=True))
    for name, place in interface_places(plan).items():
        assert places[name] == pytest.approx(place, abs=1e-12)
    assert places["bore[2]"] == pytest.approx([0, 0, crank.main_positions[1]])
    # The rings about the piston pin at its dead centres, half a pitch behind the first main.
    for end, sign in (("upper", 1), ("lower", -1)):
        height = engine.rod.length + sign * crank.throw
        assert places[f"liner[1].{end}"] == pytest.approx([0, height, 0.5 * crank.main_positions[1]])
    assert places["mount[3]"] == pytest.approx([engine.mounts.x[2], engine.mounts.y[2], engine.mounts.z[2]])


def test_rigid_modes_are_exact(engine, body):
    for candidate in (body, complete_block(engine, body), running_block(engine, body)):
        assert np.all(candidate.omega[:6] == 0)
        motions = rigid_coordinates(candidate)
        for place, shapes in zip(candidate.positions, candidate.shapes, strict=True):
            expected = np.eye(6)
            expected[:3, 3:] = levers(*place)
            assert shapes[:, :6] == pytest.approx(expected @ motions, abs=1e-9 * np.abs(motions).max())
        # A unit field of acceleration moves the whole mass.
        assert np.linalg.norm(candidate.translation[:, :6], axis=1) ** 2 == pytest.approx(candidate.mass, rel=1e-9)


def test_heads_are_on_the_deck(engine, body):
    block, complete = engine.block, complete_block(engine, body)
    assert complete.mass == pytest.approx(body.mass + block.head_mass)
    moved = complete.mass * complete.centre - body.mass * body.centre
    expected = [0, block.deck_height + block.head_height, 0.5 * engine.crankshaft.main_positions[1]]
    assert moved / block.head_mass == pytest.approx(expected, abs=1e-6)


def test_reduction_matches_the_full_model(body):
    assert body.quality["static_error"] < 1e-9
    assert body.quality["max_relative_error"] < 5e-3
    assert body.quality["rigid_hz"] < 1e-2
    assert body.records["full_hz"].size >= 2


def test_running_block_is_static_under_its_loads(engine, body):
    loads = block_loads(engine)
    complete, running = complete_block(engine, body), running_block(engine, body)
    whole, kept = elastic_compliance(complete, loads), elastic_compliance(running, loads)
    assert kept == pytest.approx(whole, rel=1e-6, abs=1e-9 * np.abs(whole).max())
    below = complete.omega[complete.omega <= 2 * np.pi * engine.block.running_cutoff_hz].size
    assert running.n_modes == below + len(loads)
    assert len(block_loads(engine, tilting=False)) == len(loads) - 2 * len(engine.crankshaft.main_widths)


def test_own_mesh_gives_the_same_surfaces_and_says_what_lacks_or_lies_elsewhere(engine, plan, mesh, tmp_path):
    path, names = tmp_path / "block.msh", list(interface_places(plan))
    spelled = str.maketrans({"[": "_", "]": None, ".": "_"})
    write_mesh(path, mesh, {name: name.translate(spelled).upper() for name in names})
    found = read_block_mesh(path, plan)
    for name in some(names):
        area, centroid = surface_area(mesh, name)
        assert surface_area(found, name)[0] == pytest.approx(area, rel=1e-12)
        assert surface_area(found, name)[1] == pytest.approx(centroid, abs=1e-12)
    longer = replace(engine, crankshaft=replace(engine.crankshaft, pin_width=0.07))
    with one_line("bore[2] lies at (0.0, 0.0, 130.0), the engine file has it at"):
        read_block_mesh(path, block_plan(longer))
    write_mesh(path, mesh, {name: name for name in names if name != "liner[1].lower"})
    with one_line("no surface named liner[1].lower"):
        read_block_mesh(path, plan)


@pytest.mark.slow
def test_own_mesh_reduces_to_the_same_body(engine, plan, mesh, body, tmp_path):
    path = tmp_path / "block.msh"
    write_mesh(path, mesh, {name: name for name in interface_places(plan)})
    own = reduced_block(engine, path)
    assert own.interfaces == body.interfaces and own.digest != body.digest
    assert own.frequencies_hz[6:40] == pytest.approx(body.frequencies_hz[6:40], rel=1e-7)


def write_mesh(path, mesh, names):
    """Gmsh file of a mesh with named surfaces."""
    t, corners = mesh.t, mesh.nvertices
    edge = {tuple(pair): corners + k for k, pair in enumerate(np.sort(mesh.edges, axis=0).T.tolist())}
    sides = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
    middles = [[edge[tuple(sorted(pair))] for pair in t[list(side)].T.tolist()] for side in sides]
    cells = [("tetra10", np.vstack((t, middles)).T)]
    cells += [("triangle", mesh.facets[:, mesh.boundaries[name]].T) for name in names]
    tags = [np.zeros(t.shape[1], dtype=int), *(np.full(len(c[1]), k) for k, c in enumerate(cells[1:], 1))]
    fields = {spelled: np.array([k, 2]) for k, spelled in enumerate(names.values(), 1)}
    data = {"cell_data": {"gmsh:physical": tags, "gmsh:geometrical": tags}, "field_data": fields}
    meshio.Mesh(mesh.doflocs.T, cells, **data).write(path, file_format="gmsh22", binary=False)


@pytest.fixture(scope="module")
def crank(engine):
    pitch = engine.crankshaft.main_positions[1]
    return rigid_crank(engine, mass=20.0, inertia=(0.4, 0.4, 0.2), centre=(0.0, 0.0, 0.5 * pitch), pitch=pitch)


def test_rigid_block_on_rigid_mounts_is_ground(engine, crank, body):
    held = replace(
        engine,
        mounts=replace(engine.mounts, **{key: (1e15,) * 4 for key in asdict(engine.mounts) if key.startswith("stiff")}),
        thrust=replace(engine.thrust, block_stiffness=1e18),
        main_bearing=engine.main_bearing.in_rigid_bores,
    )
    hz, _, _ = block_modes(held, crank, rigid(complete_block(engine, body)))
    stiffness, mass = cranktrain_matrices(held, crank)
    ground = np.sqrt(eigh(stiffness, mass, eigvals_only=True)[1:]) / (2 * np.pi)
    assert hz[: ground.size] == pytest.approx(ground, rel=1e-5)


def levers(x, y, z):
    """Motion of a place by that of the origin: its rows by rotation, (3, 3)."""
    return np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])


def test_engine_moves_on_its_mounts_as_one(engine, crank, body):
    """Stiff bearings: the six lowest modes are those of one rigid engine of all masses on the mounts."""
    complete = complete_block(engine, body)
    stiff = replace(engine.main_bearing, stiffness_x=2.285e8, stiffness_y=4.57e8)
    lightened = replace(engine, main_bearing=stiff, rod=replace(engine.rod, big_end_mass=1e-9, small_end_mass=1e-9),
                        cylinders=replace(engine.cylinders, piston_mass=1e-9))  # fmt: skip
    hz, _, _ = block_modes(lightened, crank, rigid(complete))
    total = complete.mass + crank.mass
    centre = (complete.mass * complete.centre + crank.mass * crank.centre) / total
    # The crank turns freely: about z the block has its own inertia only, and it carries the crank's mass.
    inertia = complete.inertia + crank.inertia
    inertia[2, 2] = complete.inertia[2, 2] + crank.mass * (crank.centre[:2] @ crank.centre[:2])
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = total * np.eye(3), inertia
    mass[:3, 3:] = levers(*(total * centre))
    mass[3:, :3] = mass[:3, 3:].T
    stiffness = np.zeros((6, 6))
    for place, values in zip(engine.mounts.positions, engine.mounts.stiffness, strict=True):
        motion = np.eye(6)
        motion[:3, 3:] = levers(*place)
        stiffness += motion.T @ np.diag(values) @ motion
    expected = np.sqrt(eigh(stiffness, mass, eigvals_only=True)) / (2 * np.pi)
    # Bearings are some thousand times stiffer than the mounts.
    assert hz[:6] == pytest.approx(expected, rel=2e-3)
    assert 3.0 < hz[0] < hz[5] < 30.0


def test_what_no_block_can_be_made_of_is_refused(engine):
    six = load_engine("diesel_i6")
    close = replace(six, cylinders=replace(six.cylinders, bank_angles=tuple(np.radians([-20.0, 20.0] * 3))))
    with one_line("block.bank_half_width: ", "lets neighbouring banks overlap"):
        check_block(close, six.block)
    # Half of the end's housing and what the crank has up to the first or last pin's middle: 9 + 20 + 21 + 24 mm.
    thin, widths = replace(six.block, housing_thickness=0.018, bulkhead_thickness=0.01), six.crankshaft.main_widths
    for unequal in ((0.06, *widths[1:]), (*widths[:-1], 0.06)):
        with one_line("block.housing_thickness: ", "cut the first or last liner: 74 mm from the block's end"):
            check_block(replace(six, crankshaft=replace(six.crankshaft, main_widths=unequal)), thin)
    for table in ("block", "mounts"):
        with one_line(f"no table [{table}]; add it as in engine/data/diesel_i6.toml"):
            reduced_block(replace(six, **{table: None}))
    none = (0.0,) * 4
    for change, way in (({"y": none, "stiffness_rz": none}, "z (roll)"),
                        ({"z": (0.3,) * 4, "stiffness_ry": none}, "y")):  # fmt: skip
        with one_line(f"leave the engine free to move about {way}"):
            check_mounts(replace(six.mounts, x=none, **change))
    with one_line("no room"):
        inset(hull([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]), (1.1, 1.1, 1.1, 1.1))
    with one_line("bore 3 is not one of 1..2"):
        block_bore_compliance(engine, 6, main=3)


def test_mount_stiffness_of_two_springs():
    mounts = load_engine("diesel_i6").mounts
    stiffness = mount_stiffness(mounts)
    assert stiffness[1, 1] == pytest.approx(sum(mounts.stiffness_y))
    roll = np.dot(mounts.stiffness_y, np.square(mounts.x)) + sum(mounts.stiffness_rz)
    assert stiffness[5, 5] == pytest.approx(roll)


def test_bore_takes_the_films_whole_pressure_in_its_middle():
    """On a bore half as wide again as its film and off z = 0: constant pressure widens it with the film's own area."""
    inner, length, middle = 0.045, 0.045, 0.3
    model = finite_elements(ring(inner, 0.07, length, 48, 2, 6).translated((0.0, 0.0, middle)), STEEL)
    film_diameter, film_width = 0.085, 0.03
    loads = bore_loads(model, "bore", middle, film_diameter, film_width)
    widening = sample(model, lambda x: x * np.array([[1.0], [1.0], [0.0]]) / np.hypot(x[0], x[1]))
    moved = sample(model, lambda x: 0 * x + np.array([[1.0], [0.0], [0.0]]))
    area = np.pi * film_diameter * film_width
    shaped = loads.reshape(model.basis.N, 2 * WAVES + 1, DEGREE + 1)
    assert widening @ shaped[:, 0, 0] == pytest.approx(area, rel=1e-3)
    # √2 cos φ pushes along x with √2 cos² φ on average ½; a pattern odd across the film with nothing.
    assert moved @ shaped[:, 1, 0] == pytest.approx(area / np.sqrt(2), rel=1e-3)
    assert moved @ shaped[:, 1, 1] == pytest.approx(0.0, abs=1e-3 * area)


def test_shapes_of_a_blocks_bore_hold_no_motion(engine):
    bore = block_bore_compliance(engine, 6, main=2)
    assert np.all(np.diff(bore.compliance) <= 0) and bore.compliance[-1] > 0
    assert np.all(bore.coefficients[:, 1:3, :2] == 0.0)
    assert bore.area == pytest.approx(np.pi * engine.main_bearing.diameter * engine.main_bearing.width)
