"""Reader of named matrices of Nastran (DMIG of a punch file, OUTPUT4) with pyyeti; files of Ansys are refused.

pyNastran also reads both, but its present release requires NumPy 1, and the last release without this bound writes
binary OUTPUT4 files that no other program can read.
"""

import re
import warnings
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.types import Array
from cranktrain.core.user_file import LONGEST_LINE, check_file, file_exists

PUNCH, OUTPUT4 = ".pch", ".op4"
NASTRAN = (PUNCH, OUTPUT4)
ANSYS = (".sub", ".full")
ANSYS_LINES = "*DMAT,K,D,IMPORT,SUB,{},STIFF and *EXPORT,K,DMIG,k.pch write a DMIG that is read, likewise M from MASS"
"""Ansys commands that write the matrices of a superelement in a readable form, with the nodes of their rows."""
HEADER = re.compile(r"^DMIG\*?[ ,]+([A-Za-z]\w*)[ ,]+0[ ,]", re.MULTILINE)
CARD = re.compile(r"[A-Z][A-Z0-9]{1,7}")
"""Pattern of the names of Nastran's cards; a message quotes only words that match."""
FIRST_LETTER = {"stiffness": "K", "mass": "M"}
REAL = ("1", "2")
"""Type codes of a real DMIG in single and double precision."""


class NamedMatrix(NamedTuple):
    """A square matrix (n, n) with node and component (from 0) of each row; rows are None if the file lacks them."""

    values: Array
    rows: list[tuple[int, int]] | None


def is_named(path: Path) -> bool:
    """True if a file's ending is that of named Nastran matrices, or of Ansys matrices, which are refused later."""
    return path.suffix.lower() in (*NASTRAN, *ANSYS)


def held_in(path: Path) -> str:
    """Text for an error: what a matrix file contains, as far as it is readable."""
    if path.suffix.lower() != PUNCH or not file_exists(path):
        return "matrices"
    names = HEADER.findall(path.read_text(encoding="latin-1"))
    return f"DMIG {', '.join(names)}" if names else "no DMIG"


def named_matrix(path: Path, kind: str, name: str | None) -> NamedMatrix:
    """Stiffness or mass matrix of a file: the matrix named ``name``, or the only matrix whose name begins with K or M.

    Raises ``InputError`` for a file that is broken, lacks the matrix, or has several candidates.
    """
    found = _read(path)
    key = f"{kind}_matrix"
    if name is not None:
        wanted = next((own for own in found if own.lower() == name.lower()), None)
        if wanted is None:
            raise InputError(f"{path}: no matrix {shown(name)}; {nearest(name.upper(), sorted(found))}")
        return found[wanted]
    fitting = [own for own in found if own.upper().startswith(FIRST_LETTER[kind])]
    if len(fitting) != 1:
        which = f"several: {', '.join(fitting)}" if fitting else f"none, but {', '.join(sorted(found)) or 'nothing'}"
        raise InputError(
            f"{path}: of {kind} matrices (names with {FIRST_LETTER[kind]}) it holds {which}; name one by {key} ="
        )
    return found[fitting[0]]


def _read(path: Path) -> dict[str, NamedMatrix]:
    ending = path.suffix.lower()
    check_file(path, f"{path}", "condense the body further")
    if not file_exists(path):
        raise InputError(f"{path}: no such file; put it beside the superelement's .toml")
    if ending == ".sub":
        raise InputError(
            f"{path}: binary matrices of an Ansys superelement, which no library outside Ansys reads; in Ansys, "
            f"{ANSYS_LINES.format(path.name)}"
        )
    if ending == ".full":
        raise InputError(
            f"{path}: Ansys' matrices of all nodes, which are not condensed; condense the body (ANTYPE,SUBSTR and "
            f"SEOPT,{path.stem},2), then {ANSYS_LINES.format(f'{path.stem}.sub')}"
        )
    if find_spec("pyyeti") is None:
        raise InputError(f"{path}: needs pyyeti to be read; pip install cranktrain[matrices]")
    if ending == PUNCH:
        _check_punch(path)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        try:
            found = _dmig(path) if ending == PUNCH else _output4(path)
        except InputError:
            raise
        # A broken file can cause any exception in the reader.
        except Exception as reason:
            said = " ".join(str(reason).split()) or type(reason).__name__
            what = "Nastran punch file" if ending == PUNCH else "Nastran OUTPUT4 file, text or binary"
            raise InputError(f"{path}: not readable as a {what} ({said})") from None
    for name, matrix in found.items():
        if matrix.values.shape[0] != matrix.values.shape[1] or not np.isfinite(matrix.values).all():
            raise InputError(f"{path}: matrix {name} of {matrix.values.shape} is not square, or not finite")
    return found


def _output4(path: Path) -> dict[str, NamedMatrix]:
    from pyyeti.nastran import op4

    names, matrices, _, types = op4.load(str(path), into="list")
    found = {}
    for name, matrix, kind in zip(names, matrices, types, strict=True):
        if kind > 2:
            raise InputError(f"{path}: matrix {name.upper()} is complex; write stiffness and mass as real matrices")
        dense: Any = matrix.toarray() if hasattr(matrix, "toarray") else matrix
        found[name.upper()] = NamedMatrix(np.asarray(dense, dtype=np.float64), None)
    return found


def _dmig(path: Path) -> dict[str, NamedMatrix]:
    from pyyeti.nastran import bulk

    found = {}
    for name, frame in bulk.rddmig(str(path)).items():
        own = [(int(node), int(component)) for node, component in frame.index]
        columns = [(int(node), int(component)) for node, component in frame.columns]
        every = sorted(set(own) | set(columns))
        full = frame.reindex(index=every, columns=every, fill_value=0.0).to_numpy(dtype=np.float64)
        found[name.upper()] = NamedMatrix(full, [(node, component - 1) for node, component in every])
    return found


def _check_punch(path: Path) -> None:
    """Refuse a punch file without DMIG or with an invalid number; ``InputError`` with the line."""
    text = path.read_text(encoding="latin-1")
    if "\0" in text[:LONGEST_LINE]:
        raise InputError(f"{path}: holds bytes that are no text; export the punch file again")
    if not HEADER.search(text):
        words = (re.split(r"[*,\s]", line, maxsplit=1)[0] for line in text.splitlines() if line[:1].isalpha())
        cards = sorted({word for word in words if CARD.fullmatch(word)})[:5]
        raise InputError(f"{path}: no DMIG; it holds {', '.join(cards) or 'no cards'}: write it by EXTSEOUT(DMIGPCH)")
    card = ""  # name of the present card; a line that begins with * continues it
    for number, line in enumerate(text.splitlines(), 1):
        where = f"{path}, line {number}"
        if line[:1].isalpha():
            card = re.split(r"[*,\s]", line, maxsplit=1)[0].upper()
        if line.startswith("DMIG") and re.match(r"DMIG\*?[ ,]+\w+[ ,]+0[ ,]", line):
            kind = line.split()[4:5] if "," not in line else [line.split(",")[4].strip()]
            if kind and kind[0] not in REAL:
                raise InputError(f"{where}: a complex DMIG; write stiffness and mass as real matrices")
        elif line.startswith("*") and card == "DMIG":
            fields = [line[8:24], line[24:40], line[40:72]]
            try:
                int(fields[0]), int(fields[1]), float(fields[2].strip().upper().replace("D", "E"))
            except ValueError:
                raise InputError(
                    f"{where}: {shown(line.strip())}; a DMIG's line has node, component and value"
                ) from None
