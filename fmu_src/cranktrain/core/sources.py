"""Digests of sources: a module together with everything that it imports, directly or through others.

A stored result is keyed by such a digest. So a change of a source that the module depends on makes the result invalid,
and a change of any other source does not. Imports are followed by name, in whatever folder a file is.
"""

import os
import re
import time
from collections.abc import Iterable
from functools import cache
from hashlib import sha256
from pathlib import Path

PACKAGE = __name__.partition(".")[0]
"""Name of this package: ``cranktrain``, or in an FMU a name that contains a digest."""
ROOT = Path(__file__).parents[1]
UNFELT = frozenset(
    (ROOT / "core" / name).resolve() for name in ("cache.py", "machine_code.py", "records.py", "sources.py")
)
"""Sources that define where compiled kernels are stored and how Python calls kernels; kernels' code ignores them."""
_BEGAN, _COUNTED = time.time(), time.monotonic()
_QUOTES = 3 * b'"'
_IDLE = re.compile(rb"\n[ \t]*(?:#[^\n]*)?(?=\n)")
"""Comment lines and empty lines."""
_IMPORT = re.compile(rf"(?m)^([ \t]*)(?:from ({PACKAGE}[\w.]*) import (\([^)]*\)|.*)|import ({PACKAGE}[\w.]*))")


def source_digest(file: str | Path, deferred: bool = False) -> str:
    """Digest (16 hexadecimal digits) of a source file and of all sources of the package that it depends on.

    Parameters
    ----------
    file : the module's file, in the package or outside
    deferred : True to follow imports inside functions as well, which do not affect kernels
    """
    return digest_of(rests_on(Path(file), deferred))


def digest_of(files: Iterable[Path]) -> str:
    """Digest (16 hexadecimal digits) of the code in source files; docstrings and comment lines do not count."""
    digest = sha256()
    for path in sorted(files):
        content = code_of(path)
        name = path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else path.name
        digest.update(f"{name}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()[:16]


@cache
def code_of(path: Path) -> bytes:
    """Content of a source of the package without docstrings, comment lines and empty lines.

    Sources of users are returned unchanged, because they may have triple quotes anywhere. A test checks for all sources
    of the package that the code tokens remain.
    """
    content = path.read_bytes()
    first, *rest = content.split(_QUOTES)
    if len(rest) % 2 or not str(path).startswith(str(ROOT.resolve())):
        return content
    parts = [first]  # code and texts by turns
    for text, code in zip(rest[::2], rest[1::2], strict=True):
        if parts[-1].rpartition(b"\n")[2].strip() or code.partition(b"\n")[0].strip():
            parts += [text, code]
        else:
            parts[-1] += code
    return _QUOTES.join(part if k % 2 else _IDLE.sub(b"", part) for k, part in enumerate(parts))


def edited_meanwhile(files: Iterable[Path]) -> bool:
    """True if a source was edited since this process began to load the package, so that the loaded code may be older.

    The system clock may have been set meanwhile, so the interval is taken by the system clock and by the monotonic
    clock; a time stamp in either counts.
    """
    now, elapsed = time.time(), time.monotonic() - _COUNTED
    first, last = min(_BEGAN, now - elapsed), max(_BEGAN + elapsed, now)
    return any(first < file.stat().st_mtime <= last for file in files)


def rests_on(file: Path, deferred: bool = False) -> set[Path]:
    """The source file and all files of the package that it imports, directly or through others."""
    found: set[Path] = set()
    waiting = {file.resolve()}
    while waiting:
        path = waiting.pop()
        found.add(path)
        waiting |= _imported(path, deferred) - found
        if not deferred:
            waiting -= UNFELT
    return found


@cache
def _imported(path: Path, deferred: bool) -> frozenset[Path]:
    """Files of the package that one source file imports directly."""
    found: set[Path] = set()
    for indent, module, names, plain in _IMPORT.findall(path.read_text(encoding="utf-8")):
        if indent and not deferred:
            continue
        top, *parts = (module or plain).split(".")
        root = str(ROOT.resolve()) + top.removeprefix(PACKAGE)
        names = re.findall(r"(\w+)(?: +as +\w+)?", re.sub(r"#.*", "", names))
        # A name in ``from package import name`` may itself be a module of the package.
        for place in [parts[:n] for n in range(len(parts) + 1)] + [[*parts, name] for name in names]:
            stem = os.path.join(root, *place)
            found |= {Path(file) for file in (os.path.join(stem, "__init__.py"), f"{stem}.py") if os.path.isfile(file)}
    return frozenset(found)
