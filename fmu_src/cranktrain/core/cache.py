"""The folder of everything that is computed once and kept: reduced crankshafts, compiled kernels, code of FMUs.

Standard library only, no import of the package: an FMU's slave runs this file before it loads the package.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path


def cache_folder() -> Path:
    """``$CRANKTRAIN_CACHE``, else ``cranktrain`` in the system's place for caches; need not exist, nor be writable."""
    if chosen := os.environ.get("CRANKTRAIN_CACHE"):
        return Path(chosen)
    try:
        if os.name == "nt":
            return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "cranktrain"
        if sys.platform == "darwin":
            return Path.home() / "Library" / "Caches" / "cranktrain"
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "cranktrain"
    except RuntimeError:  # no home
        return Path(tempfile.gettempdir()) / "cranktrain"
