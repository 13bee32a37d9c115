"""A user's own mesh is one piece and lies where its engine file has it, or is refused with what would mend it."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest

from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.structure.crank.reduction import input_digest, nominal_places, reduction_task
from cranktrain.structure.fem.mesh import crankshaft_mesh
from cranktrain.structure.fem.own_mesh import MeshFile, check_one_piece, check_places

SIX = load_engine("diesel_i6")
PLACES = nominal_places(SIX.crankshaft)
ONE = replace(
    SIX.crankshaft, throw_angles=(0.0,), main_widths=(0.04, 0.04), counterweights=(True, True), mesh_size=0.04
)
ENGINE = replace(SIX, crankshaft=ONE, thrust=replace(SIX.thrust, main=1))
UP = np.array([0.0, 0.0, 0.1])


@pytest.fixture(scope="module")
def crank():
    return crankshaft_mesh(ONE, 1)


def written(path, mesh, move=lambda points: points, names=None, drop=None, twice=0):
    """Gmsh file of a mesh that was moved, renamed, robbed of elements, or has the first ones twice."""
    tets = mesh.t.T if drop is None else mesh.t.T[~drop]
    tets = np.vstack((tets, tets[:twice]))
    blocks = {name: mesh.facets[:, facets].T for name, facets in mesh.boundaries.items()}
    named = {(names or {}).get(name, name): triangles for name, triangles in blocks.items()}
    cells = [("tetra", tets), *(("triangle", triangles) for triangles in named.values())]
    tags = [np.full(len(block), k) for k, (_, block) in enumerate(cells)]
    found = meshio.Mesh(
        move(mesh.p.T), cells, cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={name: np.array([k, 2]) for k, name in enumerate(named, start=1)},
    )  # fmt: skip
    meshio.write(path, found, file_format="gmsh22", binary=False)
    return path


def turned(points):
    return points @ np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def middle(mesh):
    """Elements in the middle of the pin: without them the crank is two pieces."""
    z = mesh.p[2, mesh.t].mean(axis=0)
    return np.abs(z - nominal_places(ONE)["pin[1]"][2]) < 0.02


@pytest.mark.filterwarnings("ignore:.*linear tetrahedra:UserWarning")
@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"move": turned}, r"pin\[1\] lies at .*, the engine file has it at .* mm: turn the mesh by -?90 deg about z"),
        ({"move": lambda x: x + UP}, r"main\[\d\] lies at .*: shift the mesh by \(.*, .*, -\d+\.\d\) mm"),
        ({"move": lambda x: 1e3 * x}, r"a crankshaft .* m long, .* --mesh-unit m, mm, in"),
        ({"move": lambda x: x / 0.0254}, r"coordinates 39\.\d+ times as large as expected; .*--mesh-unit"),
        ({"move": lambda x: x[:, [2, 1, 0]]}, "turn the mesh so that z is the crank axis"),
        ({"names": {"pulley": "flywheel", "flywheel": "pulley"}}, r"pulley lies at z = .* is expected in front"),
        ({"twice": 5}, "faces belong to more than two elements"),
        ({"drop": middle}, r"the solid is \d+ pieces, .* expected is one"),
        ({"move": lambda x: np.where(np.arange(len(x))[:, None] == 7, np.nan, x)}, "no finite place|not readable"),
    ],
)
def test_a_mesh_that_is_not_this_engines_crank_is_refused_in_one_line(crank, tmp_path, change, says):
    change = {key: value(crank) if key == "drop" else value for key, value in change.items()}
    path = written(tmp_path / "crank.msh", crank, **change)
    with pytest.raises(InputError, match=says) as caught:
        reduction_task(ENGINE, path).mesh()
    assert str(caught.value).startswith(str(path)) and "\n" not in str(caught.value)


@pytest.mark.filterwarnings("ignore:.*linear tetrahedra:UserWarning")
def test_a_mesh_in_its_own_unit_is_the_same_mesh(crank, tmp_path):
    own = reduction_task(ENGINE, written(tmp_path / "m.msh", crank)).mesh()
    for unit, factor in (("mm", 1e3), ("in", 1.0 / 0.0254)):
        path = written(tmp_path / f"{unit}.msh", crank, move=lambda x, factor=factor: factor * x)
        other = reduction_task(ENGINE, MeshFile(path, unit)).mesh()
        assert other.p == pytest.approx(own.p, abs=1e-9)
        assert input_digest(ENGINE, MeshFile(path, unit)) != input_digest(ENGINE, path)
    with pytest.raises(InputError, match=r"mesh unit 'cm' does not exist; .*mm"):
        MeshFile("crank.msh", "cm")


@pytest.mark.parametrize(
    ("move", "says"),
    [
        (lambda x: {**x, "pin[2]": x["pin[5]"], "pin[5]": x["pin[2]"]}, r"anew: pin\[2\] is where pin\[5\] belongs"),
        (lambda x: {**x, "pin[3]": x["pin[3]"] + [0.0, 0.05, 0.0]}, "use the engine file that it belongs to"),
    ],
)
def test_places_say_what_would_mend_them(move, says):
    with pytest.raises(InputError, match=says):
        check_places("own.msh", move(PLACES), PLACES, 0.0085)
    check_places("own.msh", {name: place + 0.004 for name, place in PLACES.items()}, PLACES, 0.0085)


def test_one_piece_is_what_shares_nodes():
    near, far = np.vstack((np.zeros(3), np.eye(3), np.ones(3))), 9.0 - np.vstack((np.zeros(3), np.eye(3)))
    nodes, joined = np.vstack((near, far)), np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
    check_one_piece(nodes, joined, "own.msh")
    with pytest.raises(InputError, match=r"2 pieces, the largest with 2 of 3 elements, another around \(8750"):
        check_one_piece(nodes, np.vstack((joined, [[5, 6, 7, 8]])), "own.msh")


def running(number):
    """Whether a process runs; one that waits to be collected does not."""
    try:
        os.kill(number, 0)
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_the_mesher_ends_with_the_process_that_asked_for_it():
    """Killed without a chance to clean up."""
    work = "import os, time; from cranktrain.structure.fem.cad_process import die_with; die_with(os.getppid()); "
    child = f"{work}print(os.getpid(), flush=True); time.sleep(600)"
    parent = subprocess.Popen(
        [sys.executable, "-c", f"import subprocess, sys; subprocess.run([sys.executable, '-c', {child!r}])"],
        stdout=subprocess.PIPE,
    )
    number = int(parent.stdout.readline())
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    for _ in range(600):
        if not running(number):
            return
        time.sleep(0.05)
    os.kill(number, signal.SIGKILL)
    pytest.fail("the child runs on")
