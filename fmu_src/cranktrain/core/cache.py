"""The folder of everything that is computed once and kept: reduced crankshafts, compiled kernels, code of FMUs.

Kernels and code are run as they are found there: they are kept in folders that nobody else may write to, or not at all.

Standard library only, no import of the package: an FMU's slave runs this file before it loads the package.
"""

from __future__ import annotations

import atexit
import errno
import os
import shutil
import stat
import sys
import tempfile
from functools import cache
from pathlib import Path


class NotPrivateError(PermissionError):
    """A folder that others may write to."""


def cache_folder() -> Path:
    """``$CRANKTRAIN_CACHE``, else ``cranktrain`` in the system's place for caches; need not exist, nor be writable.

    Where a user has no home it is a new folder, which goes with the process.
    """
    if chosen := os.environ.get("CRANKTRAIN_CACHE"):
        return Path(chosen)
    try:
        if os.name == "nt":
            return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "cranktrain"
        if sys.platform == "darwin":
            return Path.home() / "Library" / "Caches" / "cranktrain"
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "cranktrain"
    except RuntimeError:  # no home
        return _folder_of_this_process()


@cache
def _folder_of_this_process() -> Path:
    """Folder under a name that nobody can know beforehand."""
    folder = tempfile.mkdtemp(prefix="cranktrain-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def private_folder(*names: str) -> Path:
    """Folder of the cache, made with mode 700 where it is missing; ``OSError`` where it cannot be made.

    ``NotPrivateError`` where it, or one above it in the cache, belongs to somebody else or may be written by others.
    """
    place = cache_folder()
    place.parent.mkdir(parents=True, exist_ok=True)
    for name in ("", *names):
        place = place / name
        place.mkdir(mode=0o700, exist_ok=True)
        found = place.stat()
        if hasattr(os, "geteuid") and (found.st_uid != os.geteuid() or found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)):
            raise NotPrivateError(errno.EACCES, "others may write to it", str(place))
    return place
