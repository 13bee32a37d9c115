"""Reader of superelements of other programs, described by a TOML file.

    stiffness = "crank_STIF1.mtx"          # Abaqus *MATRIX OUTPUT, CalculiX .sti, or Matrix Market
    mass = "crank_MASS1.mtx"               # or, for both: matrices = "crank.mtx" of *SUBSTRUCTURE MATRIX OUTPUT
                                           # or Nastran: a punch file with DMIG (.pch), OUTPUT4 (.op4)
    stiffness_matrix = "KAAX"              # its name, where the file has several of K; mass_matrix likewise
    dofs = "crank.dof"                     # for files of row, column, value and OUTPUT4: a line NODE.COMPONENT each row
    nodes = "crank.inp"                    # *NODE lines, or GRID cards (.bdf, .dat, .nas, .pch);
                                           # or a table [nodes] with 1001 = [x, y, z]
    units = "mm-t-s"                       # of all the files; m-kg-s where not given
    [interfaces]
    "main[1]" = 1001                       # a node with six components, or a list of nodes, averaged
    pulley = [11, 12, 13, 14]

Paths are relative to the file. Matrices are symmetric: one triangle, or both. Nodes without coordinates are taken as
modal coordinates.
"""

import re
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from msgspec import Meta, field

from cranktrain.core.argument_checks import whole_number
from cranktrain.core.errors import InputError, shown
from cranktrain.core.typed_file import Table, record
from cranktrain.core.types import Array
from cranktrain.core.user_file import beside, check_file, ending, is_number, read_toml, user_path
from cranktrain.structure.fem.mesh_file import interface_name
from cranktrain.structure.fem.named_matrices import is_named, named_matrix
from cranktrain.structure.fem.superelement import Superelement

Rows = list[tuple[int, int]]
"""Node and component (from 0) of each row."""

UNITS = {"m-kg-s": (1.0, 1.0), "mm-t-s": (1e-3, 1e-3)}
"""Systems of units: length in m and energy in J of one unit."""
LARGEST_FILE, MOST_ROWS, SAMPLE = 1_000_000_000, 6000, 1 << 16
"""Limits of file size (bytes) and of rows, and number of first bytes that decide whether a file is text."""
GRIDS = (".bdf", ".dat", ".nas", ".pch")
"""Endings of files that may hold GRID cards."""
REMEDY = "see docs/how-to/own_elements.md"


_PLACE = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
_NODES = {"type": "array", "items": {"type": "integer"}, "minItems": 1}
_Places = Annotated[
    Any, Meta(extra_json_schema={"anyOf": [{"type": "string"}, {"type": "object", "additionalProperties": _PLACE}]})
]
_Nodes = Annotated[Any, Meta(extra_json_schema={"anyOf": [{"type": "integer"}, _NODES]})]


class SuperelementTable(Table, kw_only=True):
    """Table of a superelement: files of matrices, positions of nodes, and nodes of interfaces."""

    name: str = ""
    matrices: str | None = None
    stiffness: str | None = None
    mass: str | None = None
    stiffness_matrix: str | None = None
    mass_matrix: str | None = None
    dofs: str | None = None
    nodes: _Places = None
    units: Annotated[str, Meta(extra_json_schema={"enum": list(UNITS)})] = "m-kg-s"
    interfaces: dict[str, _Nodes] = field(default_factory=dict)


def is_superelement(path: str | Path) -> bool:
    """True if a file describes a superelement."""
    if ending(path) != ".toml":
        return False
    try:
        return bool({"matrices", "stiffness"} & set(read_toml(path, "superelement", REMEDY)))
    except InputError:
        return False


def read_superelement(path: str | Path) -> Superelement:
    """Read a superelement from its TOML file; ``InputError`` if this file or a file named there cannot be used."""
    source = user_path(path)
    read = record(SuperelementTable, read_toml(source, "superelement", REMEDY), str(source))
    if read.units not in UNITS:
        raise InputError(f"{source}: units {shown(read.units)} do not exist; valid: {', '.join(UNITS)}")
    length, energy = UNITS[read.units]
    named = {key: getattr(read, key) for key in ("matrices", "stiffness", "mass", "dofs", "nodes")}
    files = {key: beside(source, name) for key, name in named.items() if isinstance(name, str)}
    names = {"stiffness": read.stiffness_matrix, "mass": read.mass_matrix}
    rows, stiffness, mass = _both(source, files, names)
    places = _places(source, read.nodes, files.get("nodes"), length)
    known = {node for node, _ in rows}
    places = {node: place for node, place in places.items() if node in known}
    wrong = [row for row in rows if row[0] in places and row[1] not in range(6)]
    if wrong or len(set(rows)) < len(rows):
        node, component = wrong[0] if wrong else next(row for row in rows if rows.count(row) > 1)
        told = "is no motion in space" if wrong else "is there twice"
        raise InputError(f"{source}: node {node} component {component + 1} {told}; retain components 1 to 6 once")
    scale = np.array([length if node in places and component < 3 else 1.0 for node, component in rows])
    factor = energy / np.outer(scale, scale)
    digest = sha256(source.read_bytes())
    for one in files.values():
        digest.update(one.read_bytes())
    if not read.interfaces:
        raise InputError(f'{source}: no [interfaces]; name the node, or nodes, of each: "main[1]" = 1001')
    found = {}
    for name, given in read.interfaces.items():
        nodes = given if isinstance(given, list) else [given]
        if not nodes or not all(isinstance(node, int) for node in nodes):
            raise InputError(f"{source}: interface '{name}' = {shown(given)}; expected is a node's number, or a list")
        if missing := [node for node in nodes if node not in places]:
            raise InputError(f"{source}: interface '{name}': node {missing[0]} is not retained, or has no coordinates")
        found[interface_name(name)] = tuple(nodes)
    return Superelement(
        source=source.name,
        stiffness=factor * stiffness,
        mass=factor * mass,
        nodes=np.array([node for node, _ in rows]),
        components=np.array([component for _, component in rows]),
        places=places,
        interfaces=found,
        digest=digest.hexdigest(),
    )


def _both(source: Path, files: dict[str, Path], names: dict[str, str | None]) -> tuple[Rows, Array, Array]:
    """Rows, stiffness and mass in the unit of the files; ``names`` select matrices in files with several."""
    if "matrices" in files and is_named(files["matrices"]):
        others = {own: path for own, path in files.items() if own != "matrices"}
        return _both(source, others | dict.fromkeys(names, files["matrices"]), names)
    if "matrices" in files:
        rows, found = _user_element(files["matrices"])
    elif {"stiffness", "mass"} <= set(files):
        dofs = files.get("dofs")
        entries = {
            kind: _named_entries(files[kind], kind, names[kind], dofs)
            if is_named(files[kind])
            else _entries(files[kind], dofs)
            for kind in ("stiffness", "mass")
        }
        rows = sorted({row for one in entries.values() for pair in one for row in pair})
        found = {kind: _assembled(files[kind], one, rows) for kind, one in entries.items()}
    else:
        raise InputError(f"{source}: no matrices; give stiffness = and mass =, or matrices = for both; {REMEDY}")
    if missing := {"stiffness", "mass"} - set(found):
        raise InputError(f"{files['matrices']}: no {missing.pop()} matrix; write it with MASS=YES, STIFFNESS=YES")
    return rows, found["stiffness"], found["mass"]


def _named_entries(
    path: Path, kind: str, name: str | None, dofs: Path | None
) -> dict[tuple[tuple[int, int], tuple[int, int]], float]:
    """Entries of a named matrix; the file ``dofs`` gives the rows of an OUTPUT4 matrix."""
    matrix = named_matrix(path, kind, name)
    rows = matrix.rows
    if rows is None:
        if dofs is None:
            raise InputError(f"{path}: gives rows by number; add dofs = with a line NODE.COMPONENT each row; {REMEDY}")
        rows = _row_names(dofs, path, len(matrix.values))
    i, j = np.nonzero(matrix.values)
    # Zeros are put on the diagonal, so that rows without entries are kept.
    entries = {(row, row): 0.0 for row in rows}
    return entries | {
        (rows[a], rows[b]): value
        for a, b, value in zip(i.tolist(), j.tolist(), matrix.values[i, j].tolist(), strict=True)
    }


def _row_names(dofs: Path, path: Path, count: int) -> Rows:
    """Node and component (from 0) of each row, from the file of degrees of freedom."""
    named = [line.strip().partition(".") for line in _text(dofs).split()]
    rows = [(whole_number(node), whole_number(component)) for node, _, component in named]
    whole = [(node, component - 1) for node, component in rows if node is not None and component is not None]
    if len(whole) != len(named) or len(whole) < count:
        raise InputError(f"{dofs}: does not name the {count} rows of {path.name} as NODE.COMPONENT")
    return whole


def _text(path: Path) -> str:
    """Text of a file of numbers; ``InputError`` if it is too large or not text."""
    check_file(path, f"{path}", f"condense the body further; {REMEDY}", LARGEST_FILE)
    try:
        with path.open("rb") as file:
            if b"\0" in file.read(SAMPLE):
                raise InputError(f"{path}: holds bytes that are no text; give a matrix that was written as text")
        return path.read_text(encoding="latin-1")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); {REMEDY}") from None


def _numbers(path: Path, lines: list[str]) -> Array:
    """All numbers of some lines, separated by commas or blanks; FORTRAN's exponent D is accepted."""
    text = " ".join(lines[:1] if lines and not _is_numeric(lines[0]) else lines).replace(",", " ")
    try:
        found = np.array(text.upper().replace("D", "E").split(), dtype=np.float64)
    except ValueError:
        wrong = next(k for k, line in enumerate(lines, 1) if not _is_numeric(line))
        raise InputError(
            f"{path}: line {wrong} of its values is not a number; export the file again, or name another"
        ) from None
    if not np.isfinite(found).all():
        raise InputError(f"{path}: holds numbers that are not finite; export the file again")
    return found


def _is_numeric(line: str) -> bool:
    """True if a line contains only numbers."""
    try:
        np.array(line.replace(",", " ").upper().replace("D", "E").split(), dtype=np.float64)
    except ValueError:
        return False
    return True


def _user_element(path: Path) -> tuple[Rows, dict[str, Array]]:
    """Rows and matrices of a ``*USER ELEMENT, LINEAR``, written by ``*SUBSTRUCTURE MATRIX OUTPUT``."""
    blocks: dict[str, list[str]] = {"nodes": [], "components": []}
    section = ""
    for line in _text(path).splitlines():
        plain = line.upper().replace(" ", "")
        if plain.startswith("**"):  # comments list the nodes
            if plain.startswith("**ELEMENTNODES"):
                section = "nodes"
            elif section == "nodes" and plain.strip("*,").replace(",", "").isdigit():
                blocks["nodes"].append(line.lstrip("*"))
        elif plain.startswith("*"):
            section = plain.partition("TYPE=")[2].partition(",")[0].lower() if plain.startswith("*MATRIX,") else ""
        elif plain:
            blocks.setdefault("components" if section == "nodes" else section, []).append(line)
    nodes = _numbers(path, blocks.pop("nodes")).astype(int).tolist()
    each: dict[int, list[int]] = {}
    for k, line in enumerate(blocks.pop("components")):
        first, *rest = _numbers(path, [line]).astype(int).tolist()
        each[0 if k == 0 else first - 1] = [first, *rest] if k == 0 else rest
    rows: Rows = []
    current: list[int] = []
    for position, node in enumerate(nodes):
        current = each.get(position, current)
        rows += [(node, component - 1) for component in current]
    if not rows:
        raise InputError(f"{path}: no *USER ELEMENT with nodes and components; write it by *SUBSTRUCTURE MATRIX OUTPUT")
    if not 6 < len(rows) <= MOST_ROWS:
        raise InputError(f"{path}: {len(rows)} components; a superelement has 7 to {MOST_ROWS}: condense the body")
    kinds = [kind for kind in ("stiffness", "mass") if kind in blocks]
    return rows, {kind: _triangle(path, kind, _numbers(path, blocks[kind]), len(rows)) for kind in kinds}


def _triangle(path: Path, kind: str, values: Array, n: int) -> Array:
    """Symmetric matrix (n, n) from the values of its upper triangle by columns, or from all its values."""
    if values.size == n * n:
        return _symmetric(path, values.reshape(n, n).T)
    if values.size != n * (n + 1) // 2:
        raise InputError(
            f"{path}: {kind} has {values.size} values, its {n} components need {n * (n + 1) // 2}; export it again"
        )
    matrix = np.zeros((n, n))
    matrix[np.tril_indices(n)] = values
    return matrix + np.tril(matrix, -1).T


def _symmetric(path: Path, matrix: Array) -> Array:
    """Symmetric part of a matrix; ``InputError`` if the matrix is not symmetric."""
    if np.abs(matrix - matrix.T).max() > 1e-6 * np.abs(matrix).max():
        raise InputError(f"{path}: the matrix is not symmetric; condense without friction and gyroscopic terms")
    return np.asarray(0.5 * (matrix + matrix.T))


def _entries(path: Path, dofs: Path | None) -> dict[tuple[tuple[int, int], tuple[int, int]], float]:
    """Entries of a matrix by row and column, each given as node and component."""
    text = _text(path)
    if re.match(r"%%MatrixMarket\s+matrix\s+array", text, re.IGNORECASE):
        text = _coordinates(path)
    lines = [line for line in text.splitlines() if line.strip() and line.lstrip()[0] not in "*%"]
    lines = lines[1:] if text.startswith("%%MatrixMarket") else lines  # its first line without % holds sizes
    table = _numbers(path, lines)
    width = len(_numbers(path, lines[-1:])) if lines else 0
    if width not in (3, 5) or table.size % width:
        raise InputError(f"{path}: lines of NODE, COMPONENT, NODE, COMPONENT, VALUE or ROW, COLUMN, VALUE are expected")
    table = table.reshape(-1, width)
    where = table[:, :-1].astype(int)
    if width == 5:
        pairs = [((a, b - 1), (c, d - 1)) for a, b, c, d in where.tolist()]
    else:
        if dofs is None:
            raise InputError(f"{path}: gives rows by number; add dofs = with a line NODE.COMPONENT each row; {REMEDY}")
        rows = _row_names(dofs, path, int(where.max(initial=0)))
        if where.min(initial=1) < 1:
            raise InputError(f"{path}: row or column {where.min()}; they are counted from 1")
        pairs = [(rows[i - 1], rows[j - 1]) for i, j in where.tolist()]
    return dict(zip(pairs, table[:, -1].tolist(), strict=True))


def _coordinates(path: Path) -> str:
    """Text of rows, columns and values from a dense Matrix Market file, which Ansys exports."""
    from scipy.io import mminfo, mmread

    try:
        high, wide, *_ = mminfo(path)
        if max(high, wide) > MOST_ROWS:
            raise ValueError(f"it states {high} × {wide}; a superelement has at most {MOST_ROWS} components")
        dense = np.asarray(mmread(path))
    except (ValueError, OverflowError) as reason:
        raise InputError(f"{path}: not readable as Matrix Market ({reason})") from None
    i, j = np.nonzero(dense)
    rows = zip((i + 1).tolist(), (j + 1).tolist(), dense[i, j].tolist(), strict=True)
    return "\n".join(["%%MatrixMarket", "sizes", *(f"{a} {b} {value!r}" for a, b, value in rows)])


def _assembled(path: Path, entries: dict[tuple[Any, Any], float], rows: Rows) -> Array:
    """Symmetric matrix (n, n) from its entries; they may be those of one triangle or of both."""
    if not 6 < len(rows) <= MOST_ROWS:
        raise InputError(f"{path}: {len(rows)} components; a superelement has 7 to {MOST_ROWS}: condense the body")
    index = {row: k for k, row in enumerate(rows)}
    matrix = np.zeros((len(rows), len(rows)))
    for (row, column), value in entries.items():
        matrix[index[row], index[column]] = value
        if (column, row) not in entries:
            matrix[index[column], index[row]] = value
    return _symmetric(path, matrix)


def _places(source: Path, table: Any, file: Path | None, length: float) -> dict[int, Array]:
    """Position (3,), m, of each node from a table, or from the ``*NODE`` lines of a file."""
    places: dict[int, Array] = {}
    if file is not None and file.suffix.lower() in GRIDS:
        places = {node: length * place for node, place in _grids(file).items()}
    elif file is not None:
        reading = True
        for line in _text(file).splitlines():
            if line.startswith("*"):
                head = line.upper().replace(" ", "").partition(",")[0]
                reading = reading if line.startswith("**") else head == "*NODE"
            elif reading and line.strip():
                values = _numbers(file, [line])
                if values.size < 4:
                    raise InputError(f"{file}: a node's line has {values.size} values; expected is NODE, X, Y, Z")
                places[int(values[0])] = length * values[1:4]
    elif isinstance(table, dict):
        for node, place in table.items():
            number = whole_number(node)
            if number is None or not (isinstance(place, list) and len(place) == 3 and all(map(is_number, place))):
                raise InputError(f"{source}: node {shown(node)} = {shown(place)}; expected is NUMBER = [x, y, z]")
            places[number] = length * np.array(place, dtype=np.float64)
    if not places:
        raise InputError(f"{source}: no coordinates; give nodes = with a file of *NODE lines, or a table [nodes]")
    return places


def _grids(file: Path) -> dict[int, Array]:
    """Position of each GRID of a Nastran file, in its unit; ``InputError`` for a GRID not in basic coordinates."""
    found = {}
    lines = _text(file).splitlines()
    for number, line in enumerate(lines, 1):
        if not line.upper().startswith("GRID"):
            continue
        wide = line[4:5] == "*"
        if "," in line:
            texts = [text.strip() for text in line.split(",")][1:]
        else:
            width = 16 if wide else 8
            texts = [line[8 + width * k : 8 + width * (k + 1)].strip() for k in range(5)]
        if wide:
            rest = lines[number : number + 1] or [""]
            texts = [*texts[:4], rest[0][8:24].strip()]
        values = [re.sub(r"(?<=[\d.])([+-]\d+)$", r"E\1", text.upper().replace("D", "E")) for text in texts[2:5]]
        try:
            node, place = int(texts[0]), np.array([float(value or 0.0) for value in values])
        except ValueError:
            raise InputError(f"{file}, line {number}: {shown(line.strip())} is no GRID") from None
        if texts[1] not in ("", "0") or place.size != 3:
            raise InputError(f"{file}, line {number}: GRID {node} is not in basic coordinates; export it so")
        found[node] = place
    return found
