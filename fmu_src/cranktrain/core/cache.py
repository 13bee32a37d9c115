"""Cache folder for results that are computed once and kept: reduced crankshafts, compiled kernels, code of FMUs.

Kernels and code in the cache are executed, so they are kept only in folders that nobody else may write to.

This file uses the standard library only and imports nothing of the package, because an FMU's slave runs it before it
loads the package.
"""

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
    """Error for a cache folder that other users may write to."""


def cache_folder() -> Path:
    """Cache folder: ``$CRANKTRAIN_CACHE``, else ``cranktrain`` in the system's folder for caches.

    The folder need not exist nor be writable. A user without a home gets a new folder that is deleted with the process.
    """
    if chosen := os.environ.get("CRANKTRAIN_CACHE"):
        return Path(chosen)
    try:
        if os.name == "nt":
            return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "cranktrain"
        if sys.platform == "darwin":
            return Path.home() / "Library" / "Caches" / "cranktrain"
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "cranktrain"
    except RuntimeError:  # the user has no home folder
        return _folder_of_this_process()


@cache
def _folder_of_this_process() -> Path:
    """Temporary folder with an unpredictable name, deleted when the process ends."""
    folder = tempfile.mkdtemp(prefix="cranktrain-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def private_folder(*names: str) -> Path:
    """Subfolder of the cache, created with mode 700 if it is missing; ``OSError`` if it cannot be created.

    ``NotPrivateError`` if the folder or a parent inside the cache belongs to another user or is writable by others.
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
