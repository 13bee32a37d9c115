"""Superelements in files of Nastran are those of any other file; what cannot be used is named with its reason."""

import numpy as np
import pytest
from one_line import one_line
from superelements import describe, punch, shaft

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.structure.fem.own_body import read_body

op4 = pytest.importorskip("pyyeti.nastran.op4")

FRAME = shaft(4)
STIFFNESS, MASS = FRAME.matrices()
NODES = [101 + k for k in range(len(FRAME.positions))]
PLACES = dict(zip(NODES, FRAME.positions, strict=True))
ENDS = {"a": NODES[0], "b": NODES[-1]}


DOFS = "".join(f"{node}.{c}\n" for node in NODES for c in range(1, 7))
BOTH = {"KAAX": STIFFNESS, "MAAX": MASS}


def grids():
    """GRID cards: one in free field, one in wide fields, the others in narrow ones."""
    (a, p), (b, (x, y, z)), *others = PLACES.items()
    lines = ["GRID,{},,{},{},{}".format(a, *p), f"GRID*   {b:16d}{'':16s}{x:16.9f}{y:16.9f}", f"*       {z:16.9f}"]
    return lines + [f"GRID    {node:8d}{'':8s}" + "".join(f"{x:8.4f}" for x in place) for node, place in others]


def described(folder, **files):
    return describe(folder / "super.toml", PLACES, ENDS, files)


def frequencies(path):
    return read_body(path).frequencies_hz[6:14]


@pytest.fixture(scope="module")
def wanted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plain")
    for name, matrix in (("k", STIFFNESS), ("m", MASS)):
        rows, columns = np.nonzero(np.tril(matrix))
        text = "".join(
            f"{NODES[i // 6]},{i % 6 + 1}, {NODES[j // 6]},{j % 6 + 1}, {matrix[i, j]:.15e}\n"
            for i, j in zip(rows, columns, strict=True)
        )
        (folder / f"{name}.mtx").write_text(text)
    return frequencies(described(folder, stiffness="k.mtx", mass="m.mtx"))


@pytest.mark.parametrize("nodes", ["s.bdf", "s.PCH"])
def test_nodes_are_grids_of_bulk_data_or_of_the_punch_file(tmp_path, wanted, nodes):
    """Each GRID* goes on in a line that begins with *, as columns of a DMIG* do."""
    punch(tmp_path / "s.PCH", BOTH, NODES)
    matrices = (tmp_path / "s.PCH").read_text() if nodes == "s.PCH" else ""
    (tmp_path / nodes).write_text("\n".join(["$TITLE = SHAFT", "BEGIN SUPER=101", *grids(), matrices]))
    path = describe(tmp_path / "super.toml", {}, ENDS, {"matrices": "s.PCH", "nodes": nodes})
    assert frequencies(path) == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize("form", [(True, "dense"), (False, "dense"), (True, "bigmat"), (False, "nonbigmat")])
def test_output4_in_text_and_binary_dense_and_sparse(tmp_path, wanted, form):
    binary, sparse = form
    op4.write(tmp_path / "s.op4", {"kaa": STIFFNESS, "maa": MASS, "baa": 0.0 * MASS}, binary=binary, sparse=sparse)
    (tmp_path / "s.dof").write_text(DOFS)
    assert frequencies(described(tmp_path, matrices="s.op4", dofs="s.dof")) == pytest.approx(wanted, rel=1e-9)


def test_one_of_several_matrices_is_named(tmp_path, wanted):
    punch(tmp_path / "s.pch", {"KAAX": STIFFNESS, "K4AAX": 2.0 * STIFFNESS, "MAAX": MASS}, NODES)
    with pytest.raises(InputError, match=r"it holds several: KAAX, K4AAX; name one by stiffness_matrix ="):
        read_body(described(tmp_path, matrices="s.pch"))
    path = described(tmp_path, matrices="s.pch", stiffness_matrix="k4aax")
    assert frequencies(path) == pytest.approx(np.sqrt(2.0) * wanted, rel=1e-6)


def test_dense_matrix_market_as_ansys_exports_it(tmp_path, wanted):
    from scipy.io import mmwrite

    for name, matrix in (("k", STIFFNESS), ("m", MASS)):
        mmwrite(tmp_path / f"{name}.mtx", matrix, precision=16)
    (tmp_path / "s.dof").write_text(DOFS)
    found = frequencies(described(tmp_path, stiffness="k.mtx", mass="m.mtx", dofs="s.dof"))
    assert found == pytest.approx(wanted, rel=1e-9)


def test_a_punch_file_with_both_matrices_is_read(tmp_path, wanted):
    punch(tmp_path / "s.pch", BOTH, NODES)
    path = described(tmp_path, matrices="s.pch")
    assert frequencies(path) == pytest.approx(wanted, rel=1e-6)
    (tmp_path / "s.pch").unlink()
    with one_line("no such file; put it beside the superelement"):
        read_body(path)


@pytest.mark.parametrize("size", [0, 7, 200])
def test_output4_cut_short_is_refused(tmp_path, size):
    for binary in (True, False):
        op4.write(tmp_path / "s.op4", {"kaa": STIFFNESS, "maa": MASS}, binary=binary)
        whole = (tmp_path / "s.op4").read_bytes()
        (tmp_path / "s.op4").write_bytes(whole[:size])
        (tmp_path / "s.dof").write_text(DOFS)
        with pytest.raises(InputError, match=r"s\.op4: (not readable as a Nastran OUTPUT4|of \w+ matrices)"):
            read_body(described(tmp_path, matrices="s.op4", dofs="s.dof"))


def test_output4_needs_the_degrees_of_freedom(tmp_path):
    op4.write(tmp_path / "s.op4", {"kaa": STIFFNESS, "maa": MASS})
    with pytest.raises(InputError, match=r"gives rows by number; add dofs = with a line NODE.COMPONENT each row"):
        read_body(described(tmp_path, matrices="s.op4"))
    (tmp_path / "s.dof").write_text("1.1\n1.2\n")
    with pytest.raises(InputError, match=r"s\.dof: does not name the 30 rows of s\.op4"):
        read_body(described(tmp_path, matrices="s.op4", dofs="s.dof"))


@pytest.mark.parametrize(
    ("name", "says"),
    [
        (
            "crank.sub",
            "an Ansys superelement, which no library outside Ansys reads; in Ansys, *DMAT,K,D,IMPORT,SUB,crank",
        ),
        ("Crank.SUB", "in Ansys, *DMAT,K,D,IMPORT,SUB,Crank"),
        ("crank.full", "Ansys' matrices of all nodes, which are not condensed; condense the body (ANTYPE,SUBSTR"),
    ],
)
def test_files_of_ansys_are_refused_by_name_on_the_command_line(tmp_path, capsys, name, says):
    (tmp_path / name).write_bytes(b"\0" * 100)
    path = described(tmp_path, matrices=name)
    assert main(["reduce", "diesel_i6", "--body", str(path)]) == 2
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert says in said and "*EXPORT,K,DMIG,k.pch write a DMIG that is read" in said
    (tmp_path / name).unlink()
    with pytest.raises(InputError, match=rf"{name}: no such file"):
        read_body(path)


def test_stiffness_and_mass_in_a_dmig_each_as_ansys_exports_them(tmp_path, wanted):
    """Names as in APDL, K and M; rows are the nodes of the superelement."""
    punch(tmp_path / "k.pch", {"K": STIFFNESS}, NODES)
    punch(tmp_path / "m.pch", {"M": MASS}, NODES)
    found = frequencies(described(tmp_path, stiffness="k.pch", mass="m.pch"))
    assert found == pytest.approx(wanted, rel=1e-6)


def test_without_pyyeti_one_line_says_what_to_install(tmp_path, monkeypatch):
    punch(tmp_path / "s.pch", BOTH, NODES)
    monkeypatch.setattr("cranktrain.structure.fem.named_matrices.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"needs pyyeti to be read; pip install cranktrain\[matrices\]"):
        read_body(described(tmp_path, matrices="s.pch"))


def test_a_matrix_of_two_components_is_too_small(tmp_path):
    punch(tmp_path / "s.pch", {"KAAX": STIFFNESS[:2, :2]}, NODES)
    with pytest.raises(InputError, match=r"s\.pch: 2 components; a superelement has 7 to 6000: condense the body"):
        read_body(described(tmp_path, stiffness="s.pch", mass="s.pch", mass_matrix="KAAX"))
