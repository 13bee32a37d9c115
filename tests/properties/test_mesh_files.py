"""Mesh files say the same in every form, and broken ones are refused with their reason and line, exit code 2.

Instances of an assembly lie where a deck of Abaqus puts them.
"""

import re

import numpy as np
import pytest
from mesh_texts import Cube, by_meshio, deck, node_lines, numbered, universal
from one_line import one_line
from refusals import refused_files
from scipy.spatial.transform import Rotation

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.structure.fem.mesh_file import interface_name, read_surfaces_and_tetrahedra
from cranktrain.structure.fem.own_mesh import check_one_piece, content_digest

CUBE = Cube()
NAMES = {"MAIN_1": "main[1]", "pin1": "pin[1]"}
FIRST = len(CUBE.tets) + 1
ABAQUS_FACES = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))


def written(path, lines):
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def same_as_the_cube(path):
    points, tets, surfaces = read_surfaces_and_tetrahedra(path)
    assert points[tets[:, :4]].mean(axis=1) == pytest.approx(CUBE.points[CUBE.tets[:, :4]].mean(axis=1), abs=1e-12)
    for k, (a, b) in enumerate(((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))):
        middle = 0.5 * (points[tets[:, a]] + points[tets[:, b]])
        assert points[tets[:, 4 + k]] == pytest.approx(middle, abs=1e-12)
    for name, own in NAMES.items():
        corners = np.sort(points[surfaces[own]].sum(axis=1), axis=0)
        wanted = np.sort(CUBE.points[CUBE.faces[name][:, :3]].sum(axis=1), axis=0)
        assert corners == pytest.approx(wanted, abs=1e-12), name


@pytest.mark.parametrize("kind", ["CPS6", "S6", "M3D6", "STRI65", "CPE6", "SFM3D6", "CPS6M", "DS6"])
def test_triangles_of_second_order_name_surfaces_in_a_deck_with_two_blocks_of_nodes(tmp_path, kind):
    same_as_the_cube(written(tmp_path / "cube.INP", deck(CUBE, kind)))


def sides(name):
    """Elements of a face's triangles by the side that the triangle is, S1 to S4."""
    found = {}
    for triangle in CUBE.faces[name][:, :3].tolist():
        row, nodes = next((k, row) for k, row in enumerate(CUBE.tets.tolist(), 1) if set(triangle) <= set(row[:4]))
        side = next(k for k, face in enumerate(ABAQUS_FACES, 1) if {nodes[c] for c in face} == set(triangle))
        found.setdefault(f"S{side}", []).append(row)
    return found


def test_a_surface_of_elements_alone_is_their_free_faces(tmp_path):
    lines = [*deck(CUBE, surfaces=False), "*SURFACE, NAME=skin", "solid,"]
    points, _, surfaces = read_surfaces_and_tetrahedra(written(tmp_path / "cube.inp", lines))
    corners = points[surfaces["skin"]]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2.0
    assert area.sum() == pytest.approx(6.0, rel=1e-12)


@pytest.mark.parametrize("form", ["faces", "sets", "nodes", "shells"])
def test_surfaces_of_a_deck_are_faces_sets_of_faces_nodes_or_shells(tmp_path, form):
    lines = deck(CUBE, surfaces=form == "shells")
    for name, rows in CUBE.faces.items():
        if form == "faces":
            lines.append(f"*SURFACE, NAME={name}, TYPE=ELEMENT")
            lines += [f"{row}, {side}" for side, members in sides(name).items() for row in members]
        elif form == "sets":
            for side, members in sides(name).items():
                lines += [f"*ELSET, ELSET=_{name}_{side}", *(f"{row}," for row in members)]
            lines += [f"*SURFACE, TYPE=ELEMENT, NAME={name}", *(f"_{name}_{side}, {side}" for side in sides(name))]
        elif form == "nodes":
            nodes = sorted(int(node) + 1 for node in np.unique(rows))
            lines += [f"*NSET, NSET=n_{name}", *map(str, nodes), f"*SURFACE, TYPE=NODE, NAME={name}", f"n_{name},"]
    if form == "shells":
        lines = [line.replace("elset=MAIN_1", "elset=shell_1") for line in lines]
        lines += ["*SURFACE, NAME=MAIN_1", "shell_1, SPOS"]
    same_as_the_cube(written(tmp_path / "cube.inp", lines))


def test_files_of_a_deck_are_followed_and_change_the_digest(tmp_path):
    """Nodes in files that include others, elements in one named by its keyword."""
    folder = tmp_path / "sub"
    folder.mkdir()
    half, rest = len(CUBE.points) // 2, deck(CUBE)
    start = next(k for k, line in enumerate(rest) if line.startswith("*ELEMENT")) + 1
    written(folder / "nodes ü.inp", ["*NODE", *node_lines(CUBE.points[:half]), "*INCLUDE, INPUT=more.inp"])
    written(folder / "more.inp", ["*NODE, INPUT=n.txt"])
    written(folder / "n.txt", ["** nodes", *node_lines(CUBE.points[half:], half + 1)])
    written(tmp_path / "t.txt", rest[start : start + len(CUBE.tets)])
    elements = "*ELEMENT, TYPE=C3D10, INPUT=t.txt"
    lines = ['*Include, input="sub/nodes ü.inp"', elements, *rest[start + len(CUBE.tets) :]]
    path = written(tmp_path / "cube.inp", lines)
    same_as_the_cube(path)
    digests = [content_digest({}, path)]
    for changed in (folder / "more.inp", folder / "n.txt", tmp_path / "t.txt"):
        changed.write_text(changed.read_text() + "** changed\n")
        digests.append(content_digest({}, path))
    assert len(set(digests)) == 4


def test_elements_may_go_on_in_the_next_line_and_sets_may_be_generated(tmp_path):
    lines = deck(CUBE)
    start = next(k for k, line in enumerate(lines) if line.startswith("*ELEMENT"))
    for k in range(start + 1, start + 1 + len(CUBE.tets)):
        texts = lines[k].split(", ")
        lines[k] = ", ".join(texts[:5]) + ",\n" + ", ".join(texts[5:])
    count = len(CUBE.faces["MAIN_1"])
    lines = [line.replace(", elset=MAIN_1", "") for line in lines]
    lines += ["*ELSET, ELSET=MAIN_1,", "GENERATE", f"{FIRST}, {FIRST + count - 1}, 1"]
    same_as_the_cube(written(tmp_path / "cube.inp", lines))


def test_universal_gmsh_and_nastran_files_say_the_same(tmp_path):
    same_as_the_cube(written(tmp_path / "cube.unv", universal(CUBE)))
    same_as_the_cube(by_meshio(tmp_path / "cube.msh", CUBE, "gmsh"))
    same_as_the_cube(by_meshio(tmp_path / "cube.bdf", CUBE, "nastran"))


def test_a_universal_file_may_name_nodes(tmp_path):
    lines = universal(CUBE)
    at = next(k for k, line in enumerate(lines) if line.strip() == "2467") + 1
    lines = lines[:at]
    for k, (name, rows) in enumerate(CUBE.faces.items(), 1):
        nodes = [int(node) + 1 for node in np.unique(rows)]
        lines += ["".join(f"{value:10d}" for value in (k, 0, 0, 0, 0, 0, 0, len(nodes))), name]
        lines += [f"{7:10d}{node:10d}{0:10d}{0:10d}" for node in nodes]
    same_as_the_cube(written(tmp_path / "cube.unv", [*lines, "    -1"]))


PART = ["*PART, NAME=Cube", *deck(CUBE), "*END PART"]
SHELLS = len(CUBE.faces["MAIN_1"])


def read(folder, lines):
    return read_surfaces_and_tetrahedra(written(folder / "a.inp", lines))


def assembly(*instances, after=(), parts=PART):
    lines = [*parts, "*ASSEMBLY, NAME=all"]
    for k, placed in enumerate(instances, 1):
        lines += [f"*Instance, name=Cube-{k}, part=CUBE", *placed, "*END INSTANCE"]
    return [*lines, *after, "*END ASSEMBLY", "*STEP"]


WRITERS = {
    "inp": lambda: deck(CUBE), "unv": lambda: universal(CUBE), "assembly.inp": lambda: assembly([]),
}  # fmt: skip


@pytest.mark.parametrize(("kind", "pattern", "new", "says"), refused_files()["mesh"]["changes"])
def test_an_odd_file_is_refused_with_its_reason(tmp_path, kind, pattern, new, says):
    path = tmp_path / f"odd.{kind}"
    if kind in WRITERS:
        written(path, WRITERS[kind]())
    else:
        by_meshio(path, CUBE, {"msh": "gmsh", "bdf": "nastran"}[kind])
    text = path.read_text()
    assert re.search(pattern, text, re.MULTILINE)
    path.write_text(re.sub(pattern, new, text, count=1, flags=re.MULTILINE))
    with one_line(str(path), match=says) as caught:
        read_surfaces_and_tetrahedra(path)
    assert "export it again" not in str(caught.value)


def test_names_of_surfaces_in_the_ways_of_meshing_programs():
    names = {"LINER_2_UPPER": "liner[2].upper", "Bore 07": "bore[7]", "'Pin[3]' ": "pin[3]", "Web1": "web1"}
    assert [interface_name(name) for name in names] == list(names.values())


def test_bulk_data_alone_are_read(tmp_path):
    path = by_meshio(tmp_path / "bulk.nas", CUBE, "nastran")
    text = path.read_text()
    path.write_text(text[text.index("BEGIN BULK\n") + 11 :].replace("ENDDATA", ""))
    same_as_the_cube(path)


def cards(form):
    """Bulk data of the cube in one form of fields, with names in comments."""
    lines = [f'$HMNAME COMP {k} "{name}"' for k, name in enumerate(CUBE.faces, 2)]

    def own(word, fields):
        per = 4 if form == "wide" else 8
        for k in range(0, len(fields), per):
            row = list(map(str, fields[k : k + per]))
            if form == "free":
                yield ",".join([word if k == 0 else "+", *row]) + " $ note"
            elif form == "wide":
                yield f"{f'{word}*'.lower() if k == 0 else '*':8s}" + "".join(f"{text:<16}" for text in row)
            else:
                yield f"{word if k == 0 else '':8s}" + "".join(f"{text:>8}" for text in row)

    for k, point in enumerate(CUBE.points.tolist(), 1):
        lines += own("GRID", [k, "", *(f"{x:.4f}".replace("0.5000", "5.0000-1") for x in point)])
    number = 1
    for row in CUBE.tets.tolist():
        lines += own("CTETRA", [number, 1, *(node + 1 for node in row)])
        number += 1
    for k, rows in enumerate(CUBE.faces.values(), 2):
        for row in rows.tolist():
            lines += own("CTRIA6", [number, k, *(node + 1 for node in row)])
            number += 1
    return lines


@pytest.mark.parametrize("form", ["narrow", "wide", "free"])
def test_bulk_data_in_each_form_of_fields(tmp_path, form):
    same_as_the_cube(written(tmp_path / "cube.BDF", ["SOL 103", "CEND", "begin bulk", *cards(form), "ENDDATA"]))


def test_included_bulk_data_are_followed_and_change_the_digest(tmp_path):
    """The name of a file may stand in several lines; nodes here, elements there."""
    (tmp_path / "sub ü").mkdir()
    lines = cards("narrow")
    nodes = [line for line in lines if line.startswith("GRID")]
    rest = [line for line in lines if not line.startswith("GRID")]
    written(tmp_path / "sub ü" / "nodes.bdf", ["$ nodes", *nodes[:9], "include 'more.dat'", "ENDDATA"])
    written(tmp_path / "sub ü" / "more.dat", nodes[9:])
    begin = ["SOL 103", "BEGIN BULK", "INCLUDE 'sub ü/", "nodes.bdf'"]
    path = written(tmp_path / "cube.fem", [*begin, *rest, "ENDDATA"])
    same_as_the_cube(path)
    before = content_digest({}, path)
    more = tmp_path / "sub ü" / "more.dat"
    more.write_text(more.read_text() + "$ changed\n")
    assert content_digest({}, path) != before
    more.write_text(more.read_text() + "GRID,9001,,0.,x,0.\n")
    with pytest.raises(InputError, match=rf"more\.dat, line {len(nodes) - 9 + 2}: GRID 9001 at"):
        read_surfaces_and_tetrahedra(path)


def test_four_node_tetrahedra_with_their_triangles(tmp_path):
    cube = Cube(quadratic=False)
    lines = deck(cube, "S3")
    with pytest.warns(UserWarning, match="linear tetrahedra"):
        _, tets, surfaces = read_surfaces_and_tetrahedra(written(tmp_path / "cube.inp", lines))
    assert tets.shape == cube.tets.shape
    assert {frozenset(row) for row in surfaces["main[1]"].tolist()} == cube.triangles("MAIN_1")
    assert numbered(cube.tets[:1], 1) == [lines[lines.index("*ELEMENT, TYPE=C3D4, ELSET=solid") + 1]]


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("crank.pch", "a Nastran punch file holds DMIG KAAX, no mesh: name it in a superelement's .toml"),
        ("crank.op4", "a Nastran OUTPUT4 file holds matrices, no mesh"),
        ("crank.sub", "an Ansys superelement file holds matrices, no mesh"),
        ("crank.step", "CAD, no mesh: 'cranktrain new NAME --cad crank.step' meshes it"),
        ("crank.stl", "mesh format '.stl' is not known: use .msh, .inp, .unv"),
    ],
)
def test_what_is_no_mesh_is_named_on_the_command_line(tmp_path, capsys, name, says):
    path = tmp_path / name
    path.write_text("DMIG    KAAX           0       6       1       0                      12\n")
    assert main(["reduce", "diesel_i6", "--mesh", str(path)]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert says in said[-1] and said[-1].startswith("cranktrain: ")


def corners(points, triangles):
    return np.sort(points[triangles].sum(axis=1), axis=0)


def test_a_part_alone_and_an_instance_that_is_moved_then_turned(tmp_path):
    same_as_the_cube(written(tmp_path / "part.inp", PART))
    points, tets, surfaces = read(tmp_path, assembly(["1., 2., ", "0.5, 0., 1., 0.5, 3., 5., 40."]))
    axis = np.array([0.0, 3.0, 4.0]) / 5.0
    turn = Rotation.from_rotvec(np.radians(40.0) * axis)
    begin = np.array([0.5, 0.0, 1.0])
    wanted = begin + turn.apply(CUBE.points + np.array([1.0, 2.0, 0.0]) - begin)
    assert points[tets] == pytest.approx(wanted[CUBE.tets], abs=1e-12)
    for name, own in (("MAIN_1", "main[1]"), ("pin1", "pin[1]")):
        assert corners(points, surfaces[own]) == pytest.approx(corners(wanted, CUBE.faces[name][:, :3]), abs=1e-12)


@pytest.mark.parametrize("tied", [True, False])
def test_numbers_repeat_among_instances_and_a_tie_makes_them_one_piece(tmp_path, tied):
    """Two cubes side by side; the triangles in common are those of x = 1, of one and x = 0 of the other."""
    tie = ["*TIE, NAME=t", "a, b"] if tied else []
    points, tets, surfaces = read(tmp_path, assembly([], ["1., 0., 0."], after=tie))
    assert len(tets) == 2 * len(CUBE.tets) and len(surfaces["main[1]"]) == 2 * SHELLS
    straight = points[tets[:, 1:4]] - points[tets[:, :1]]
    assert np.abs(np.linalg.det(straight)).sum() / 6.0 == pytest.approx(2.0, rel=1e-12)
    assert np.ptp(points, axis=0) == pytest.approx([2.0, 1.0, 1.0])
    if tied:
        check_one_piece(points, tets, "a.inp")
    else:
        with pytest.raises(InputError, match=r"the solid is 2 pieces, .* another around \(.*\) mm"):
            check_one_piece(points, tets, "a.inp")


def test_sets_of_the_assembly_name_their_instance(tmp_path):
    first = len(CUBE.tets) + 1
    after = [
        f"*Elset, elset=Pin_1, instance=cube-2, generate\n{first}, {first + SHELLS - 1}, 1",
        "*ELSET, ELSET=_main_2, INTERNAL, INSTANCE=Cube-1\nMAIN_1",
        "*SURFACE, NAME=Main_2\n_main_2, SPOS",
        f"*ELSET, ELSET=pin_3\nCube-2.{first}",
        "*SURFACE, NAME=main_3\nCube-2.pin1, SNEG",
    ]
    plain = ["*PART, NAME=Cube", *(line.replace("pin1", "web").replace("MAIN_1", "face") for line in deck(CUBE))]
    plain = [*plain, "*END PART"]
    after = [line.replace("Cube-2.pin1", "Cube-2.web").replace("\nMAIN_1", "\nface") for line in after]
    points, _, surfaces = read(tmp_path, assembly([], ["5., 0., 0."], after=after, parts=plain))
    below, side = (corners(CUBE.points, CUBE.faces[name][:, :3]) for name in ("MAIN_1", "pin1"))
    away = 3.0 * np.array([5.0, 0.0, 0.0])  # corners are summed
    assert corners(points, surfaces["pin[1]"]) == pytest.approx(below + away)
    assert corners(points, surfaces["main[2]"]) == pytest.approx(below)
    assert len(surfaces["pin[3]"]) == 1 and points[surfaces["pin[3]"]][..., 0].min() >= 5.0
    assert corners(points, surfaces["main[3]"]) == pytest.approx(side + away)
