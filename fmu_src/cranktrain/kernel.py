"""The one jit decorator of the running model, and the rules its kernels keep.

A kernel must also compile ahead of time into a library without Python: the caller owns all memory, no ``np.linalg``,
no exceptions (integer status codes), no ``reshape``, no global mutable state, no parallel loops. Compiling without
numba's run-time (``_nrt=False``) holds kernels to that: one that would allocate does not compile.

Compiled kernels are kept in the user's cache under a digest of this package's sources: numba itself looks only at a
kernel's own file, and would run a stale copy of what that kernel calls. For the same reason they are not kept at all
where the cache cannot be written; numba would then put them beside the sources.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

from numba import config, njit

from cranktrain.cache import cache_folder


def _source_digest() -> str:
    root = Path(__file__).parent
    digest = sha256()
    for path in sorted(p for part in (".", "film", "loads", "dynamics") for p in (root / part).glob("*.py")):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def _kernel_folder() -> str:
    """Folder for the compiled kernels of these sources; empty where it cannot be written."""
    folder = cache_folder() / "kernels" / _source_digest()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return ""
    return str(folder)


_KERNELS = _kernel_folder()
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": False, "boundscheck": False, "_nrt": False}


def kernel(function: Callable[..., Any]) -> Any:
    """Compile ``function`` in the native-safe subset, cached on disk where possible."""
    kept = getattr(config, "CACHE_DIR", "")
    setattr(config, "CACHE_DIR", _KERNELS)  # noqa: B010 - numba makes its settings at run time, unknown to a type checker
    try:
        return njit(cache=bool(_KERNELS), **_OPTIONS)(function)
    finally:
        setattr(config, "CACHE_DIR", kept)  # noqa: B010
