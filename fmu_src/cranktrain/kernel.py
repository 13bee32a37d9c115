"""The one jit decorator of the running model, and the rules its kernels keep.

A kernel must also compile ahead of time into a library without Python: the caller owns all memory, no ``np.linalg``,
no exceptions (integer status codes), no ``reshape``, no global mutable state, no parallel loops.

Compiled kernels are kept in the user's cache under a digest of this package's sources: numba itself looks only at a
kernel's own file, and would run a stale copy of what that kernel calls.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

from numba import config, njit


def cache_folder() -> Path:
    """Folder of this product's caches: ``$CRANKTRAIN_CACHE``, or ``cranktrain`` in the user's cache folder."""
    folder = os.environ.get("CRANKTRAIN_CACHE")
    if folder:
        return Path(folder)
    user = os.environ.get("LOCALAPPDATA") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(user) / "cranktrain"


def _source_digest() -> str:
    root = Path(__file__).parent
    digest = sha256()
    for path in sorted(p for part in (".", "film", "loads", "dynamics") for p in (root / part).glob("*.py")):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]


_KERNELS = str(cache_folder() / "kernels" / _source_digest())


def kernel(function: Callable[..., Any]) -> Any:
    """Compile ``function`` in the native-safe subset, cached on disk."""
    kept = config.CACHE_DIR
    config.CACHE_DIR = _KERNELS
    try:
        return njit(cache=True, error_model="numpy", fastmath=False, boundscheck=False)(function)
    finally:
        config.CACHE_DIR = kept
