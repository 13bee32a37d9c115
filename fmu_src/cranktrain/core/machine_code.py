"""Libraries of machine code of the kernels, as they come with the package or lie in the user's cache.

A library holds the kernels of a kind, or of two: those of a run with the films that are solved or read from a table.
For each kind it names the digest of the sources that they were made from, and it ends in a checksum of itself. Where no
library has a kind of the present sources, its kernels are compiled by numba as they are called.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import sys
import warnings
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.cache import cache_folder, private_folder
from cranktrain.core.records import record_image
from cranktrain.core.sources import ROOT, edited_meanwhile

LIBRARIES = ROOT / "fmu" / "native" / "lib"
"""Folder of the libraries that come with the package, one folder a platform."""
SEAL = "sealed.txt"
"""File beside them that gives their digest where the sources cannot: in an FMU, which carries a part of them."""
RESTS_ON = {
    "cranktrain": ("core", "engine", "film", "loads", "dynamics"),
    "films": ("core", "engine", "film"),
    "combustion": ("core", "modules"),
    "valvetrain": ("core", "modules"),
}
"""Kinds of kernels, and the folders of the package that they rest on."""
FILMS = (
    *(f"film/{folder}" for folder in ("elastic", "journal", "lanes", "reynolds", "steady", "table")),
    *(f"film/laws/{law}.py" for law in ("ehd", "rigid_bore")),
    *(f"film/laws/{of_both}.py" for of_both in ("film_solution", "foresight", "in_space", "pressure_peak")),
    *(f"film/contact/{name}.py" for name in ("asperity", "journal", "wear")),
)
"""Folders and files whose kernels solve oil films or read them from tables. A run with other bearings needs none of
them, and no other kernel rests on them."""
WHOLE = "cranktrain+films"
"""Both kinds in one library, as the package has them."""
_STAGES = tuple(f"cranktrain.dynamics.{module}" for module in ("motion.", "time.", "start.settling:", "tangents:"))
SHARES = {"cranktrain": ("stages", "parts")}
"""Kinds whose kernels are emitted in two shares of about equal time: what moves a run on, and what a run is made of and
shows (its model, force laws, outputs). Each is a program of its own; what both call is in both."""
_KIND_OF = {
    "cranktrain.modules.combustion.": "combustion",
    "cranktrain.modules.valve_train.": "valvetrain",
    **{
        "cranktrain." + (path.removesuffix(".py").replace("/", ".") + (":" if path.endswith(".py") else ".")): "films"
        for path in FILMS
    },
}
"""Kinds of the kernels of these modules; all others are the cranktrain's."""
EMITTING = (
    "emit.py",
    "exports.py",
    "make.py",
    "objects.py",
    "platforms.py",
    "typical_run.py",
    "whole_program.py",
    "c/kernels.h",
)
"""Files of cranktrain.fmu.native that machine code depends on."""
OFF = "CRANKTRAIN_NO_MACHINE_CODE"
"""Environment variable that lets numba compile all kernels, whatever libraries there are."""
CHECKSUM = b"CRNKSUM1"
"""What a library's checksum begins with; it stands behind all that a system's loader reads."""


ENTRIES = {"prepare": "prepare", "start": "start", "advance": "advance_run", "observe": "observe_run"}
"""Entries of a run in the order of ``struct ct_kernels``, and their kernels in the module that defines its record."""


class _Table(ctypes.Structure):
    """``struct ct_kernels`` of kernels.h."""

    _fields_ = (
        ("digest", ctypes.c_char_p),
        *((name, ctypes.c_void_p) for name in ENTRIES),
        ("functions", ctypes.POINTER(ctypes.c_void_p)),
        ("n_functions", ctypes.c_uint32),
        ("names", ctypes.c_char_p),
        ("layout", ctypes.c_char_p),
    )


_ENTRY = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_double)


class Call:
    """A kernel that Python calls with arrays and numbers.

    Parameters
    ----------
    address : of the entry, which reads the image of a record: an array for the results, and the arguments
    results : kinds of the results, ``i``, ``f`` or ``b`` each; more than one make a tuple, in brackets also one
    """

    def __init__(self, address: int, results: str) -> None:
        self._entry = _ENTRY(address)
        kinds = {"i": int, "f": float, "b": bool}
        self._results = [kinds[kind] for kind in results.strip("()")]
        self._single = results in kinds

    def __call__(self, arguments: tuple[Any, ...]) -> Any:
        """Results as numba gives them."""
        out = np.zeros(max(1, len(self._results)))
        image = record_image((out, *arguments))
        self._entry(int(image.ctypes.data), 0.0)
        found = tuple(kind(value) for kind, value in zip(self._results, out.tolist(), strict=False))
        if self._single:
            return found[0]
        return found or None

    def bound(self, arguments: tuple[Any, ...]) -> Callable[[], int]:
        """The kernel, whose result is one integer, with these arguments; their arrays are used in place."""
        out = np.zeros(1)
        image = record_image((out, *arguments))
        entry, address = self._entry, int(image.ctypes.data)
        owned = (image, arguments)

        def call(kept: Any = owned) -> int:
            entry(address, 0.0)
            return int(out[0])

        return call


class Library:
    """Machine code of a kind.

    Parameters
    ----------
    path : of the library
    portable : take the code for all processors, though this one runs a faster

    Attributes
    ----------
    digests : of the sources of each kind
    layout : of the runs that it knows, see :func:`cranktrain.core.records.layout`
    functions : addresses by name, ``package.module:function``, and layout of the arguments
    calls : kernels that Python calls, by name and layout of the arguments
    entries : of a run at an address, by name
    """

    def __init__(self, path: Path, portable: bool = False) -> None:
        self._loaded = ctypes.CDLL(str(path))
        table_of = self._loaded.ct_kernels_table
        table_of.restype = ctypes.POINTER(_Table)
        table = table_of(int(portable)).contents
        self.digests, self.layout = table.digest.decode().split(), table.layout.decode()
        self.functions: dict[tuple[str, str], int] = {}
        self.calls: dict[str, dict[str, Call]] = {}
        for k, line in enumerate(table.names.decode().splitlines()):
            name, arguments, *results = line.split("|")
            address = int(table.functions[k] or 0)
            if results:
                self.calls.setdefault(name, {})[arguments] = Call(address, results[0])
            else:
                self.functions[name, arguments] = address
        # Films alone have no entries.
        given = {name: address for name in ENTRIES if (address := getattr(table, name))}
        self.entries: dict[str, Callable[[int, float], int]] = {name: _ENTRY(at) for name, at in given.items()}


makers: list[Callable[[str], bool]] = []
"""What makes the library of a kind where there is none, of which the last is asked; whether it did."""


@cache
def library(kind: str) -> Library | None:
    """A library with a kind for this machine and these sources; ``None`` where there is none and nobody makes it.

    Warns of one that is damaged.
    """
    if os.environ.get(OFF) or edited_meanwhile(_sources(kind)):
        return None
    found = _found(kind)
    return _found(kind) if found is None and makers and makers[-1](kind) else found


def _found(kind: str) -> Library | None:
    digest = code_digest(kind)
    for path in _places(kind):
        try:
            if is_whole(path, digest):
                return Library(path)
        except DamagedError:
            _warn_of(path, "its checksum differs")
        except (OSError, AttributeError) as error:
            _warn_of(path, str(error))
    return None


def _warn_of(path: Path, why: str) -> None:
    warnings.warn(
        f"{path}: this library of machine code cannot be used ({why}), so that kernels are compiled when they are "
        "first called; remove it and make it anew: python -m cranktrain.fmu.native",
        stacklevel=2,
    )


def function_address(name: str, arguments: str) -> int | None:
    """Address of a kernel for arguments of a layout in the library of its kind; ``None`` where that has none."""
    made = library(kind_of(name))
    return None if made is None else made.functions.get((name, arguments))


def calls_of(name: str) -> dict[str, Call]:
    """What the library of its kind has of a kernel that Python calls, by the layout of the arguments."""
    made = library(kind_of(name))
    return {} if made is None else made.calls.get(name, {})


def kind_of(name: str) -> str:
    """Kind of the kernels of a module, by the module's name in full or by theirs, ``package.module:function``."""
    return next((kind for head, kind in _KIND_OF.items() if name.startswith(head)), "cranktrain")


def shares_of(kind: str) -> tuple[str, ...]:
    """Shares of a kind, in the order of their functions in its library."""
    return SHARES.get(kind, (kind,))


def share_of(name: str) -> str:
    """Share of a kernel by its name."""
    kind = kind_of(name)
    return kind if kind not in SHARES else SHARES[kind][not name.startswith(_STAGES)]


class DamagedError(Exception):
    """A library that is not what was written."""


def is_whole(path: Path, digest: str) -> bool:
    """Whether a library is there and belongs to the sources of a digest; :class:`DamagedError` where it is damaged."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return False
    size = len(CHECKSUM) + hashlib.sha256().digest_size
    if checksum(content[:-size]) != content[-size:]:
        raise DamagedError(str(path))
    return digest.encode() in content


def checksum(content: bytes) -> bytes:
    """What stands behind a library."""
    return CHECKSUM + hashlib.sha256(content).digest()


def _places(kind: str) -> Iterator[Path]:
    folder = this_platform()
    suffix = ".dll" if folder == "win64" else ".so"
    whole = kind in WHOLE.split("+")
    yield LIBRARIES / folder / library_name(WHOLE if whole else kind, suffix)
    for made in (WHOLE, kind) if whole else (kind,):
        parts = "native", folder_of(made), folder
        kept = list(cache_folder().joinpath(*parts).glob(library_name(made, suffix, "*")))
        if kept:
            try:
                place = private_folder(*parts)
            except OSError:
                return
            # Of the same kernels with several states of the C side the newest.
            yield place / max(kept, key=lambda path: path.stat().st_mtime_ns).name


def folder_of(kind: str) -> str:
    """Folder of a library's states in the cache: the digests of its kinds."""
    return "-".join(map(code_digest, kind.split("+")))


def this_platform() -> str:
    """Folder of this machine's libraries, as an FMU names it."""
    if sys.platform == "win32":
        return "win64"
    system = "linux" if sys.platform.startswith("linux") else sys.platform
    if platform.machine() not in ("x86_64", "AMD64"):
        return f"{platform.machine()}-{system}"
    return f"{system}64"


def library_name(kind: str, suffix: str, shim: str = "") -> str:
    """Name of a library's file, that of its first kind, in the cache with the digest of its C side."""
    first = kind.partition("+")[0]
    return f"{first}-{shim}{suffix}" if shim else f"{first}{suffix}"


@cache
def code_digest(kind: str) -> str:
    """Digest (16 hexadecimal digits) of the sources that the machine code of a kind is made from.

    The C side is not among them but for what both know of each other: it is linked in a second.
    """
    seal = LIBRARIES / SEAL
    if seal.is_file():
        return dict(line.split() for line in seal.read_text(encoding="utf-8").splitlines()).get(kind, "")
    digest = hashlib.sha256()
    for path in sorted(_sources(kind)):
        content = path.read_bytes()
        digest.update(f"{path.relative_to(ROOT).as_posix()}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()[:16]


def _sources(kind: str) -> list[Path]:
    native = ROOT / "fmu" / "native"
    # A Python FMU carries none of these, and no library either.
    files = [path for name in EMITTING if (path := native / name).is_file()]
    for folder in RESTS_ON[kind]:
        files += (ROOT / folder).rglob("*.py")
    if kind == "cranktrain":
        apart = tuple(ROOT / path for path in FILMS)
        files = [path for path in files if not any(path.is_relative_to(other) for other in apart)]
    return files
