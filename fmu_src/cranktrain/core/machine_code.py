"""Libraries of machine code of the kernels, as they come with the package or lie in the user's cache.

A library belongs to one state of the sources, which its digest names. Where there is none of the present state, kernels
are compiled by numba as they are called.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import sys
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

from cranktrain.core.cache import private_folder
from cranktrain.core.sources import ROOT

LIBRARIES = ROOT / "fmu" / "native" / "lib"
"""Folder of the libraries that come with the package, one folder a platform."""
SEAL = "sealed.txt"
"""File beside them that gives their digest where the sources cannot: in an FMU, which carries a part of them."""
RESTS_ON = {
    "cranktrain": ("core", "engine", "film", "loads", "dynamics"),
    "combustion": ("core", "modules"),
    "valvetrain": ("core", "modules"),
}
"""Kinds of libraries, and the folders of the package that their kernels rest on."""
OFF = "CRANKTRAIN_NO_MACHINE_CODE"
"""Environment variable that lets numba compile all kernels, whatever libraries there are."""


class _Table(ctypes.Structure):
    """``struct ct_kernels`` of kernels.h."""

    _fields_ = (
        ("digest", ctypes.c_char_p),
        *((name, ctypes.c_void_p) for name in ("prepare", "start", "advance", "observe")),
        ("functions", ctypes.POINTER(ctypes.c_void_p)),
        ("n_functions", ctypes.c_uint32),
        ("names", ctypes.POINTER(ctypes.c_char_p)),
        ("layout", ctypes.c_char_p),
    )


class Library:
    """Machine code of a kind.

    Attributes
    ----------
    digest : of its sources
    layout : of the runs that it knows, see :func:`cranktrain.core.records.layout`
    functions : addresses by name, ``package.module:function``
    entries : of a run at an address, by name
    """

    def __init__(self, path: Path) -> None:
        self._loaded = ctypes.CDLL(str(path))
        table_of = self._loaded.ct_kernels_table
        table_of.restype = ctypes.POINTER(_Table)
        table = table_of().contents
        self.digest, self.layout = table.digest.decode(), table.layout.decode()
        self.functions: dict[str, int] = {
            table.names[k].decode(): int(table.functions[k] or 0) for k in range(table.n_functions)
        }
        kind = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_double)
        self.entries: dict[str, Callable[[int, float], int]] = {
            name: kind(getattr(table, name)) for name in ("prepare", "start", "advance", "observe")
        }


@cache
def library(kind: str) -> Library | None:
    """The library of a kind for this machine and these sources; ``None`` where there is none."""
    if os.environ.get(OFF):
        return None
    for path in _places(kind):
        try:
            loaded = Library(path)
        except (OSError, AttributeError):
            continue
        if loaded.digest == code_digest(kind):
            return loaded
    return None


def _places(kind: str) -> Iterator[Path]:
    folder = this_platform()
    name = library_name(kind, ".dll" if folder == "win64" else ".so")
    yield LIBRARIES / folder / name
    try:
        yield private_folder("native", code_digest(kind), folder) / name
    except OSError:
        return


def this_platform() -> str:
    """Folder of this machine's libraries, as an FMU names it."""
    if sys.platform == "win32":
        return "win64"
    return "linux64" if platform.machine() in ("x86_64", "AMD64") else f"{platform.machine()}-{sys.platform}"


def library_name(kind: str, suffix: str) -> str:
    """Name of a library's file."""
    return f"{kind}{suffix}"


@cache
def code_digest(kind: str) -> str:
    """Digest (16 hexadecimal digits) of the sources that a library of a kind is made from."""
    seal = LIBRARIES / SEAL
    if seal.is_file():
        return dict(line.split() for line in seal.read_text(encoding="utf-8").splitlines())[kind]
    native = ROOT / "fmu" / "native"
    files = [*native.glob("*.py"), *(native / "c").glob("*.[ch]")]
    for folder in RESTS_ON[kind]:
        files += (ROOT / folder).rglob("*.py")
    digest = hashlib.sha256()
    for path in sorted(files):
        content = path.read_bytes()
        digest.update(f"{path.relative_to(ROOT).as_posix()}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()[:16]
