"""Results of a study's cases in the user's cache: an interrupted study continues, and equal cases run only once.

A key is a digest of all inputs of an entry: the case, which contains the engine, and the sources that computed it.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, is_dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.cache import cache_folder
from cranktrain.core.errors import CranktrainError
from cranktrain.core.reduced_body import Array
from cranktrain.core.sources import source_digest
from cranktrain.store.sound_files import DAMAGED, archive_arrays, json_of
from cranktrain.store.whole_file import whole_file


class Kept:
    """Cache entries by key, one file each, complete or missing; kept in memory only if the cache cannot be written.

    ``folder``: name of a folder in the cache, or a path.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = cache_folder() / folder
        self._known: dict[str, Any] = {}

    def entry(self, key: str) -> Any:
        """Plain value stored under a key, or None if nothing is stored."""
        return self._found(f"{key}.json", lambda path: json_of(path.read_text(encoding="utf-8")))

    def keep(self, key: str, entry: Any) -> None:
        """Store a plain value under a key, replacing an earlier one."""
        self._keep(f"{key}.json", entry, lambda path: path.write_text(json.dumps(entry), encoding="utf-8"))

    def arrays(self, key: str) -> dict[str, Array] | None:
        """Arrays stored under a key, by name, or None if nothing is stored."""
        found: dict[str, Array] | None = self._found(f"{key}.npz", archive_arrays)
        return found

    def keep_arrays(self, key: str, arrays: Mapping[str, Array]) -> None:
        """Store arrays, given by name, under a key."""
        self._keep(f"{key}.npz", arrays, lambda path: np.savez(path, **arrays))  # type: ignore[arg-type]

    def _found(self, name: str, read: Callable[[Path], Any]) -> Any:
        if name not in self._known:
            try:
                self._known[name] = read(self.folder / name)
            except DAMAGED:
                return None
        return self._known[name]

    def _keep(self, name: str, value: Any, write: Callable[[Path], Any]) -> None:
        self._known[name] = value
        try:
            with whole_file(self.folder / name) as path:
                write(path)
        except CranktrainError:
            pass


def digest(source: str | Path, *parts: Any) -> str:
    """Digest of dataclasses, mappings and plain values, and of all sources that the file ``source`` depends on."""
    plain = [asdict(part) if is_dataclass(part) and not isinstance(part, type) else part for part in parts]
    text = json.dumps(plain, sort_keys=True, default=repr)
    return sha256((_sources(source) + text).encode()).hexdigest()[:32]


@cache
def _sources(source: str | Path) -> str:
    return source_digest(source, deferred=True)
