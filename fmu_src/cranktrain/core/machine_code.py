"""Libraries of machine code of the kernels, shipped with the package or made in the user's cache.

A library holds the kernels of one kind or of two, such as those of a run together with those of fluid films. It names
the digest of the sources of each kind and ends in a checksum of itself. If no library has a kind for the present
sources, numba compiles its kernels when they are first called.
"""

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
from cranktrain.core.sources import ROOT, digest_of, edited_meanwhile

LIBRARIES = ROOT / "fmu" / "native" / "lib"
"""Folder of the libraries that come with the package, with one subfolder per platform."""
SEAL = "sealed.txt"
"""File next to the libraries with their digests, for FMUs, which contain only a part of the sources."""
RESTS_ON = {
    "cranktrain": ("core", "engine", "film", "loads", "dynamics"),
    "films": ("core", "engine", "film"),
    "combustion": ("core", "modules"),
    "valvetrain": ("core", "modules"),
}
"""Kinds of kernels, and for each kind the folders of the package that its kernels depend on."""
FILMS = (
    *(f"film/{folder}" for folder in ("elastic", "journal", "lanes", "reynolds", "steady", "table")),
    *(f"film/laws/{law}.py" for law in ("ehd", "rigid_bore")),
    *(f"film/laws/{of_both}.py" for of_both in ("film_solution", "foresight", "in_space", "pressure_peak")),
    *(f"film/contact/{name}.py" for name in ("asperity", "journal", "wear")),
)
"""Folders and files whose kernels solve fluid films or read them from tables. A run with other bearings needs none of
them, and no other kernel depends on them."""
WHOLE = "cranktrain+films"
"""Library of both kinds, as it is shipped with the package."""
_STAGES = tuple(f"cranktrain.dynamics.{module}" for module in ("motion.", "time.", "start.settling:", "tangents:"))
SHARES = {"cranktrain": ("stages", "parts")}
"""Kinds whose kernels are compiled as two programs that take about equal time. The first advances a run; the second has
its model, force laws and outputs. A kernel that both call is contained in both."""
_KIND_OF = {
    "cranktrain.modules.combustion.": "combustion",
    "cranktrain.modules.valve_train.": "valvetrain",
    **{
        "cranktrain." + (path.removesuffix(".py").replace("/", ".") + (":" if path.endswith(".py") else ".")): "films"
        for path in FILMS
    },
}
"""Kind of the kernels of modules whose names begin so; all other kernels are of kind ``cranktrain``."""
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
"""Environment variable that ignores all libraries, so that numba compiles all kernels."""
CHECKSUM = b"CRNKSUM1"
"""First bytes of a library's checksum, which follows after the part that the system's loader reads."""


ENTRIES = {"prepare": "prepare", "start": "start", "advance": "advance_run", "observe": "observe_run"}
"""Entries of a run in the order of ``struct ct_kernels``, and the kernel of each in the module of the run's record."""


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
    address : address of the entry, which reads the image of a record: an array for the results, then the arguments
    results : kind of each result, ``i``, ``f`` or ``b``; several results, or one in brackets, are returned as a tuple
    """

    def __init__(self, address: int, results: str) -> None:
        self._entry = _ENTRY(address)
        kinds = {"i": int, "f": float, "b": bool}
        self._results = [kinds[kind] for kind in results.strip("()")]
        self._single = results in kinds

    def __call__(self, arguments: tuple[Any, ...]) -> Any:
        """Call the kernel and return its results in the form that numba returns."""
        out = np.zeros(max(1, len(self._results)))
        image = record_image((out, *arguments))
        self._entry(int(image.ctypes.data), 0.0)
        found = tuple(kind(value) for kind, value in zip(self._results, out.tolist(), strict=False))
        if self._single:
            return found[0]
        return found or None

    def bound(self, arguments: tuple[Any, ...]) -> Callable[[], int]:
        """Call of the kernel with fixed arguments, whose arrays are used in place; its one result is an integer."""
        out = np.zeros(1)
        image = record_image((out, *arguments))
        entry, address = self._entry, int(image.ctypes.data)
        owned = (image, arguments)

        def call(kept: Any = owned) -> int:
            entry(address, 0.0)
            return int(out[0])

        return call


class Library:
    """A loaded library of machine code.

    Parameters
    ----------
    path : file of the library
    portable : True to use the code for all processors even if this processor can run faster code

    Attributes
    ----------
    digests : digest of the sources of each kind
    layout : layout of the runs that the library can run, see :func:`cranktrain.core.records.layout`
    functions : addresses by name, ``package.module:function``, and layout of the arguments
    calls : kernels callable from Python, by name and layout of the arguments
    entries : functions of a run at an address, by name
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
        # A library that contains only films has no entries of a run.
        given = {name: address for name in ENTRIES if (address := getattr(table, name))}
        self.entries: dict[str, Callable[[int, float], int]] = {name: _ENTRY(at) for name, at in given.items()}


makers: list[Callable[[str], bool]] = []
"""Functions that make a missing library of a kind and return True on success; only the last function is called."""


@cache
def library(kind: str) -> Library | None:
    """Library with a kind of kernels for this machine and these sources; ``None`` if none exists or can be made.

    Warns of a damaged library.
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
    """Address of a kernel for an argument layout in the library of its kind; ``None`` if the kernel is missing."""
    made = library(kind_of(name))
    return None if made is None else made.functions.get((name, arguments))


def calls_of(name: str) -> dict[str, Call]:
    """Entries of a kernel in its kind's library that Python can call, by argument layout."""
    if not name.startswith("cranktrain."):  # of the laboratory or of a user: in no library, and in need of none
        return {}
    made = library(kind_of(name))
    return {} if made is None else made.calls.get(name, {})


def kind_of(name: str) -> str:
    """Kind of a kernel or a module, from its full name, ``package.module:function`` or ``package.module``."""
    return next((kind for head, kind in _KIND_OF.items() if name.startswith(head)), "cranktrain")


def shares_of(kind: str) -> tuple[str, ...]:
    """Parts in which a kind of kernels is compiled, in the order of their functions in the library."""
    return SHARES.get(kind, (kind,))


def share_of(name: str) -> str:
    """Part of a kind of kernels in which the kernel of this name is compiled."""
    kind = kind_of(name)
    return kind if kind not in SHARES else SHARES[kind][not name.startswith(_STAGES)]


class DamagedError(Exception):
    """Error for a library whose checksum does not fit its content."""


def is_whole(path: Path, digest: str) -> bool:
    """True if a library exists and contains the kind with this digest; :class:`DamagedError` for a wrong checksum."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return False
    size = len(CHECKSUM) + hashlib.sha256().digest_size
    if checksum(content[:-size]) != content[-size:]:
        raise DamagedError(str(path))
    return digest.encode() in content


def checksum(content: bytes) -> bytes:
    """Checksum that is appended to a library."""
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
            # Libraries of the same kernels may differ in their C side; the newest is taken.
            yield place / max(kept, key=lambda path: path.stat().st_mtime_ns).name


def folder_of(kind: str) -> str:
    """Name of the cache folder for a library, made of the digests of its kinds of kernels."""
    return "-".join(map(code_digest, kind.split("+")))


def this_platform() -> str:
    """Folder name of this machine's platform, as FMUs use it."""
    if sys.platform == "win32":
        return "win64"
    system = "linux" if sys.platform.startswith("linux") else sys.platform
    if platform.machine() not in ("x86_64", "AMD64"):
        return f"{platform.machine()}-{system}"
    return f"{system}64"


def library_name(kind: str, suffix: str, shim: str = "") -> str:
    """File name of a library, after its first kind; in the cache also after ``shim``, the digest of its C side."""
    first = kind.partition("+")[0]
    return f"{first}-{shim}{suffix}" if shim else f"{first}{suffix}"


@cache
def code_digest(kind: str) -> str:
    """Digest (16 hexadecimal digits) of the sources from which the machine code of a kind is made.

    The C side is not included, except for the header that both share, because linking it anew takes a second.
    """
    seal = LIBRARIES / SEAL
    if seal.is_file():
        return dict(line.split() for line in seal.read_text(encoding="utf-8").splitlines()).get(kind, "")
    return digest_of(_sources(kind))


def _sources(kind: str) -> list[Path]:
    native = ROOT / "fmu" / "native"
    # An FMU that runs in Python contains none of these files, and no library.
    files = [path for name in EMITTING if (path := native / name).is_file()]
    for folder in RESTS_ON[kind]:
        files += (ROOT / folder).rglob("*.py")
    if kind == "cranktrain":
        apart = tuple(ROOT / path for path in FILMS)
        files = [path for path in files if not any(path.is_relative_to(other) for other in apart)]
    return files
