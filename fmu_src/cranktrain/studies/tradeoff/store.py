"""What was measured, kept in the user's cache: an interrupted study goes on, and planning reads its figures.

Points are lines of JSON, the last one of a key counts; recorded references lie beside them as files of arrays. A key is
a digest of the case, which holds the engine, and of the sources that the measuring rests on.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.cache import cache_folder
from cranktrain.core.reduced_body import Array
from cranktrain.core.sources import source_digest


class PointStore:
    """Measured points and recorded references by key; one that cannot be written keeps them for this process only."""

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder or cache_folder() / "tradeoff"
        self._points: dict[str, dict[str, Any]] = {}
        self._records: dict[str, dict[str, Array]] = {}
        try:
            text = self._file.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError):
            text = ""
        self._torn = bool(text) and not text.endswith("\n")
        for line in text.splitlines():
            try:
                entry = json.loads(line)
                self._points[entry["key"]] = entry
            except (ValueError, KeyError, TypeError):
                continue  # the last line of a process that was killed while it wrote

    @property
    def _file(self) -> Path:
        return self.folder / "points.jsonl"

    def point(self, key: str) -> dict[str, Any] | None:
        """What is kept of a case: ``costs``, ``error``, ``other_errors``, ``status``, ``details``; None if nothing."""
        return self._points.get(key)

    def keep_point(self, key: str, entry: Mapping[str, Any]) -> None:
        """Keep what was measured of a case; replaces what was kept of it before."""
        self._points[key] = {"key": key, **entry}
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with self._file.open("a", encoding="utf-8") as file:
                file.write(("\n" if self._torn else "") + json.dumps(self._points[key]) + "\n")
                self._torn = False
        except OSError:
            pass

    def record(self, key: str) -> dict[str, Array] | None:
        """Arrays kept of a case, or None."""
        if key not in self._records:
            try:
                with np.load(self.folder / f"{key}.npz") as data:
                    self._records[key] = {name: data[name] for name in data.files}
            except (OSError, ValueError, EOFError):
                return None
        return self._records[key]

    def keep_record(self, key: str, arrays: Mapping[str, Array]) -> None:
        """Keep arrays of a case, whole or not at all."""
        self._records[key] = dict(arrays)
        temporary = self.folder / f".{key}.{os.getpid()}.npz"
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            np.savez(temporary, **arrays)  # type: ignore[arg-type]
            os.replace(temporary, self.folder / f"{key}.npz")
        except OSError:
            pass


def digest(*parts: Any) -> str:
    """Digest of dataclasses, mappings and plain values, together with the sources that decide what they give."""
    text = json.dumps([_plain(part) for part in parts], sort_keys=True, default=repr)
    return sha256((sources() + text).encode()).hexdigest()[:32]


@cache
def sources() -> str:
    """Digest of the sources that decide a point: those that the measuring rests on."""
    return source_digest(Path(__file__).with_name("measure.py"), deferred=True)


def _plain(value: Any) -> Any:
    return asdict(value) if is_dataclass(value) and not isinstance(value, type) else value
