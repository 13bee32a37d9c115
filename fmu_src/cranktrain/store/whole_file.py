"""Files that are written completely or not at all, and replace only files of their own kind.

A file is written under a temporary name next to its target, flushed to the disk, then renamed. A folder, a link, a
device or a file of another kind is never replaced. Temporary files of a killed process are removed at the next write
into the folder. A temporary file is locked while its process lives; the system releases the lock when the process ends
for any reason.
"""

import os
import platform
import re
import stat
import tempfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from cranktrain.core.cache import cache_folder, private_folder
from cranktrain.core.errors import InputError, StoreError

try:
    import fcntl
except ImportError:  # Windows has no fcntl, so temporary files of a killed process stay
    fcntl = None  # type: ignore[assignment]

HEAD = 4096
"""Number of bytes at the start of a file in which the mark of its kind is searched."""
PREFIX = f".cranktrain-{zlib.crc32(platform.node().encode()):08x}-"
"""Beginning of the names of this machine's temporary files."""
TEMPORARY = re.compile(r"\.cranktrain-[0-9a-f]{8}-[a-z0-9_]{8}(\..*)?")
"""Pattern of the names of any machine's temporary files."""
WRITTEN: list[Path] = []
"""Files that this process wrote outside the cache, listed when it is interrupted."""
DAY = 86400.0
"""Age, s, from which another machine's temporary file is removed, as locks may be invisible in shared folders."""


@dataclass(frozen=True)
class Kind:
    """A kind of file: its name for messages, and a function that is True for an existing file of this kind."""

    name: str
    includes: Callable[[Path], bool]


def marked(name: str, mark: str) -> Kind:
    """Kind of the files that contain ``mark`` within their first ``HEAD`` bytes."""

    def includes(path: Path) -> bool:
        with path.open("rb") as file:
            return mark.encode() in file.read(HEAD)

    return Kind(name, includes)


@contextmanager
def whole_file(path: str | Path, kind: Kind | None = None) -> Iterator[Path]:
    """Path of a temporary file that replaces ``path`` when the block ends; after an error it is removed.

    The folder is made if it is missing. ``kind`` is the kind of file that may be replaced, see :func:`check_place`.
    Raises ``InputError`` for a path that must not be replaced, ``StoreError`` if it cannot be written.
    """
    target = Path(path)
    check_place(target, kind)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with _temporary(target) as temporary:
            _remove_left(target.parent, temporary)
            yield temporary
            with temporary.open("r+b") as file:
                os.fsync(file.fileno())
            temporary.chmod(0o644)
            check_place(target, kind)  # checked again, because writing may have taken an hour
            temporary.replace(target)
            if target not in WRITTEN and not target.absolute().is_relative_to(cache_folder().absolute()):
                WRITTEN.append(target)
    except OSError as error:
        raise StoreError(f"{path}: cannot be written ({error.strerror or error}); choose another place") from None


@contextmanager
def _temporary(target: Path) -> Iterator[Path]:
    """Path of a temporary file next to ``target``, locked during the block and then removed."""
    handle, temporary = _locked(target)
    try:
        yield temporary
    finally:
        temporary.unlink(missing_ok=True)
        if fcntl is not None:
            os.close(handle)


def _locked(target: Path) -> tuple[int, Path]:
    """New file next to ``target``: its descriptor, which holds the lock, and its path."""
    while True:
        handle, name = tempfile.mkstemp(prefix=PREFIX, suffix=target.suffix, dir=target.parent)
        temporary = Path(name)
        if fcntl is None:
            os.close(handle)  # closed here, because Windows cannot move an open file
            return handle, temporary
        with suppress(OSError):  # on a file system without locks no other process can lock it either
            fcntl.flock(handle, fcntl.LOCK_SH)  # shared, because HDF5 readers also take a shared lock
        if temporary.exists():
            return handle, temporary
        os.close(handle)  # another process removed the new file before it was locked


def _remove_left(folder: Path, own: Path) -> None:
    """Remove temporary files left by killed processes; the new file ``own`` gives the present time of the file system.

    Time stamps of the folder are compared, because this machine's clock may differ from the folder's or have been set.
    """
    if fcntl is None:
        return
    with suppress(OSError):
        now = own.stat().st_mtime
        for place in folder.iterdir():
            if TEMPORARY.fullmatch(place.name) and place != own:
                with suppress(OSError):  # a file may belong to another user, be in use, or be removed already
                    _remove_unlocked(place, now)


def _remove_unlocked(place: Path, now: float) -> None:
    """Remove a temporary file; ``OSError`` if a process holds its lock."""
    handle = os.open(place, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        found = os.fstat(handle)
        known = place.name.startswith(PREFIX) or now - found.st_mtime > DAY
        if known and stat.S_ISREG(found.st_mode):
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            place.unlink()
    finally:
        os.close(handle)


def check_kept(path: Path) -> None:
    """Raise ``StoreError``, before any work, if a path in the user's cache cannot be written."""
    try:
        private_folder()
        check_place(path)
    except OSError as error:
        reason = f"{error.filename}: {error.strerror}"
    except InputError as error:
        reason = str(error).partition(";")[0]
    else:
        return
    raise StoreError(f"{reason}; it is the cache: set CRANKTRAIN_CACHE to a folder of your own")


def check_place(path: str | Path, kind: Kind | None = None) -> None:
    """Raise ``InputError``, before any work, for a path at which a file must not or cannot be written.

    An existing file there must be regular, and empty or of the given kind. If ``kind`` is None, as for our own folders,
    it may be of any kind.
    """
    target = Path(path)
    try:
        found = target.lstat()
    except (FileNotFoundError, NotADirectoryError):
        found = None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        text = str(target) if len(str(target)) <= 120 else f"{str(target)[:60]}…{str(target)[-20:]}"
        raise InputError(f"{text}: no file can have this name ({reason}); choose another") from None
    if found is not None:
        _check_replaced(target, found, kind)
    folder = next(place for place in target.absolute().parents if place.exists())
    if not folder.is_dir() or not os.access(folder, os.W_OK) or not _takes_files(folder):
        raise InputError(f"{target}: {folder} is not a writable folder; choose another place")


def _takes_files(folder: Path) -> bool:
    """True if a file can be made in a folder; an administrator may write everywhere, but not into ``/proc``."""
    try:
        tempfile.TemporaryFile(dir=folder, prefix=PREFIX).close()
    except OSError:
        return False
    return True


def _check_replaced(target: Path, found: os.stat_result, kind: Kind | None) -> None:
    """Raise ``InputError`` if the existing path is not a regular file, or is of another kind."""
    if stat.S_ISDIR(found.st_mode):
        raise InputError(f"{target}: is a folder; name a file, e.g. {target / 'result'}")
    if stat.S_ISLNK(found.st_mode):
        raise InputError(f"{target}: is a link, which is not replaced; name the file itself")
    if not stat.S_ISREG(found.st_mode):
        raise InputError(f"{target}: is a device, not a file; name a file")
    if kind is None or found.st_size == 0:
        return
    try:
        same = kind.includes(target)
    except Exception:  # an existing file that the kind's reader cannot read is not of this kind
        same = False
    if not same:
        raise InputError(f"{target}: exists and is no {kind.name}; choose another name, or delete it")
