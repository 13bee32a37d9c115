"""Decks of Abaqus with parts and an assembly: instances lie where the deck puts them, odd ones are told."""

import numpy as np
import pytest
from mesh_texts import Cube, deck
from scipy.spatial.transform import Rotation

from cranktrain.core.errors import InputError
from cranktrain.structure.fem.mesh_file import read_surfaces_and_tetrahedra
from cranktrain.structure.fem.own_mesh import check_one_piece

CUBE = Cube()
PART = ["*PART, NAME=Cube", *deck(CUBE), "*END PART"]
SHELLS = len(CUBE.faces["MAIN_1"])


def read(folder, lines):
    path = folder / "a.inp"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return read_surfaces_and_tetrahedra(path)


def assembly(*instances, after=(), parts=PART):
    lines = [*parts, "*ASSEMBLY, NAME=all"]
    for k, placed in enumerate(instances, 1):
        lines += [f"*Instance, name=Cube-{k}, part=CUBE", *placed, "*END INSTANCE"]
    return [*lines, *after, "*END ASSEMBLY", "*STEP"]


def corners(points, triangles):
    return np.sort(points[triangles].sum(axis=1), axis=0)


def test_an_instance_is_moved_then_turned(tmp_path):
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


def test_one_part_without_an_assembly_is_read(tmp_path):
    points, tets, surfaces = read(tmp_path, PART)
    assert points[tets] == pytest.approx(CUBE.points[CUBE.tets]) and {"main[1]", "pin[1]"} <= set(surfaces)


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ([*PART, "*PART, NAME=two", "*END PART"], r"holds 2 parts, and no \*INSTANCE that places them"),
        ([*PART, *PART], r"line \d+: part 'Cube' is there already"),
        ([*assembly([]), "*INSTANCE, NAME=x, PART=Cub"], r"instance x is of part 'Cub', .* did you mean 'Cube'"),
        (["*INSTANCE, NAME=x, PART=Cube"], r"instance x is of part 'Cube', which the deck has not; export the parts"),
        (assembly(["1., two, 3."]), r"line \d+: '1., two, 3.'; an instance is placed by numbers"),
        (assembly(["0., 0., 0.", "0., 0., 0., 0., 0., 1."]), r"line \d+: a rotation is two points and an angle, 7"),
        (assembly(["0., 0., 0.", "1., 1., 1., 1., 1., 1., 30."]), r"line \d+: the two points .* are one"),
        (assembly([], after=["*NSET, NSET=a, INSTANCE=Cube-7", "1"]), r"instance 'Cube-7' does not exist; did you m"),
        (assembly([], after=["*ELSET, ELSET=a", "Cube-1.nothing"]), r"set 'Cube-1.nothing' does not exist"),
        (assembly([], after=["*SURFACE, NAME=a", "b, S1"]), r"surface a names the set 'b', which does not exist"),
        (
            assembly([], [], parts=[line for line in PART if not line.startswith("1, 0,")]),
            r"line \d+: element Cube-1.\d+ has node Cube-1.1, which does not exist",
        ),
        ([*PART[:-1], "*NCOPY, CHANGE NUMBER=100", "*END PART"], r"\*NCOPY makes nodes; give a deck that lists"),
    ],
)
def test_an_odd_assembly_is_refused_with_its_reason(tmp_path, lines, says):
    with pytest.raises(InputError, match=says) as caught:
        read(tmp_path, lines)
    assert "a.inp" in str(caught.value) and "\n" not in str(caught.value)
