"""A shaft, and its superelement as finite-element programs write it."""

from itertools import pairwise

import numpy as np

from cranktrain.structure.fem.frame import Frame, circular

E, G, DENSITY, LENGTH, DIAMETER = 2.1e11, 8.1e10, 7850.0, 1.0, 0.012


def shaft(elements):
    """Free shaft along z; nodes are numbered from 1."""
    frame = Frame(E, G)
    nodes = [frame.node((0.0, 0.0, z)) for z in np.linspace(0.0, LENGTH, elements + 1)]
    for pair in pairwise(nodes):
        frame.beam(*pair, circular(DIAMETER, DENSITY, 0.3))
    return frame


def user_element(path, nodes, matrices):
    """Text of *SUBSTRUCTURE MATRIX OUTPUT: components from 1 for all nodes, columns down to the diagonal."""
    lines = [f"*USER ELEMENT, NODES= {len(nodes)}, LINEAR", "** ELEMENT NODES"]
    lines += ["** " + ", ".join(map(str, nodes[k : k + 10])) for k in range(0, len(nodes), 10)]
    lines += ["1, 2, 3, 4, 5, 6"]
    for kind, matrix in matrices.items():
        lines.append(f"*MATRIX,TYPE={kind}")
        for k, column in enumerate(matrix.T):
            texts = [f"{value: .14E}" for value in column[: k + 1]]
            lines += [" , ".join(texts[i : i + 4]) + "," for i in range(0, k + 1, 4)]
    path.write_text("\n".join(lines) + "\n")


def matrix_input(path, nodes, matrix):
    """Lines NODE, COMPONENT, NODE, COMPONENT, VALUE of the lower triangle, without zeros."""
    rows, columns = np.nonzero(np.tril(matrix))
    path.write_text(
        "".join(
            f"{nodes[i // 6]},{i % 6 + 1}, {nodes[j // 6]},{j % 6 + 1}, {matrix[i, j]:.15e}\n"
            for i, j in zip(rows, columns, strict=True)
        )
    )


def rows_and_columns(path, matrix):
    """Lines ROW COLUMN VALUE of the upper triangle, with FORTRAN's exponents."""
    rows, columns = np.nonzero(np.triu(matrix))
    lines = (f"{i + 1} {j + 1} {matrix[i, j]:.15E}\n" for i, j in zip(rows, columns, strict=True))
    path.write_text("".join(lines).replace("E", "D"))


def punch(path, matrices, nodes=(1, 2, 3, 4, 5)):
    """A punch file: symmetric DMIG, lower triangle by columns, in fields of 16 with FORTRAN's exponents."""
    lines = ["$TITLE = SHAFT", "$SUBCASE 1"]
    for name, matrix in matrices.items():
        lines.append(f"DMIG    {name:8s}{0:8d}{6:8d}{2:8d}{0:8d}{'':8s}{len(matrix):8d}")
        for j, column in enumerate(matrix.T):
            lines.append(f"DMIG*   {name:8s}{'':8s}{nodes[j // 6]:16d}{j % 6 + 1:16d}")
            for i in range(j, len(matrix)):
                if column[i]:
                    value = f"{column[i]:.9E}".replace("E", "D")
                    lines.append(f"*       {nodes[i // 6]:16d}{i % 6 + 1:16d}{value:>16s}")
    path.write_text("\n".join(lines) + "\n")


def describe(path, places, interfaces, files, units="m-kg-s"):
    lines = [f'{key} = "{name}"' for key, name in {**files, "units": units}.items()]
    lines += ["[interfaces]", *(f'"{name}" = {node}' for name, node in interfaces.items())]
    if places:
        lines += ["[nodes]", *(f"{node} = {np.asarray(place).tolist()}" for node, place in places.items())]
    path.write_text("\n".join(lines) + "\n")
    return path


def write_superelement(folder, frame, interfaces, matrices=None):
    stiffness, mass = frame.matrices() if matrices is None else matrices
    nodes = list(range(1, len(frame.positions) + 1))
    user_element(folder / "super.mtx", nodes, {"STIFFNESS": stiffness, "MASS": mass})
    places = dict(zip(nodes, frame.positions, strict=True))
    return describe(folder / "super.toml", places, interfaces, {"matrices": "super.mtx"})
