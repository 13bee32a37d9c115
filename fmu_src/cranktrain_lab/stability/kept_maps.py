"""Maps computed once and kept: an interrupted run goes on with those that are missing.

A kept map belongs to the code that made it: its digest covers all that its module imports, and the shipped engines.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from cranktrain.engine.file import engine_folder
from cranktrain.store.kept import Kept, digest
from cranktrain.store.side_by_side import side_by_side
from cranktrain_lab.stability import MAPS
from cranktrain_lab.stability.stability_map import StabilityMap, as_record, from_record

Tell = Callable[[str, str, float], None]
"""Told the map, its stage and the share of it that is done."""

UNDER_WAY = 0.999
"""Largest fraction that the progress of a map may report, because a map is done only when it is stored."""


def maps(
    names: Sequence[str],
    quick: bool,
    *,
    rebuild: bool = False,
    workers: int | None = None,
    progress: Tell | None = None,
) -> Iterator[tuple[StabilityMap, float]]:
    """Each map by name, read where it is kept, else computed and kept, with the seconds it took (0: read).

    Parameters
    ----------
    names : keys of ``MAPS``
    quick : coarse maps
    rebuild : compute even those that are kept
    workers : processes; as many as processors where not given, none beside this one for 1
    """
    kept, missing = Kept("stability"), []
    # Keys of the sources that the maps are computed from, should these change meanwhile.
    keys = {name: f"{name}-{'quick' if quick else 'full'}-{map_digest(name)}" for name in names}
    for name in names:
        record = None if rebuild else kept.entry(keys[name])
        if record is None:
            missing.append((name, quick))
        else:
            yield from_record(name, record), 0.0
    for (name, _), (seconds, record) in side_by_side(_compute, missing, workers, progress or (lambda *_: None)):
        kept.keep(keys[name], record)
        yield from_record(name, record), seconds


def map_digest(name: str) -> str:
    """Digest of all that a map can depend on: the sources that its computation rests on, and the shipped engines."""
    engines = [(path.name, path.read_text(encoding="utf-8")) for path in sorted(engine_folder().glob("*.toml"))]
    return digest(Path(__file__).with_name(f"{name}.py"), engines)


def _compute(name: str, quick: bool, tell: Tell) -> tuple[float, dict[str, Any]]:
    start = time.perf_counter()
    record = as_record(MAPS[name](quick, lambda stage, share: tell(name, stage, min(share, UNDER_WAY))))
    return time.perf_counter() - start, record
