"""Storage of computed maps, so that an interrupted run continues with the missing maps.

A stored map is valid only for the code that made it. Its digest covers all imports of its module, and the shipped
engines.
"""

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
"""Function to call with a map's name, the stage of its computation and the completed fraction."""

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
    """Yield each map, read from the store or computed and stored, with the computing time in s (0: read).

    Parameters
    ----------
    names : keys of ``MAPS``
    quick : coarse maps
    rebuild : True to compute stored maps again
    workers : number of processes, by default the number of processors; 1: only this process
    """
    kept, missing = Kept("stability"), []
    # Keys belong to the sources at the start, which may change during the computation.
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
    """Return the digest of all sources that a map's computation uses, and of the shipped engines."""
    engines = [(path.name, path.read_text(encoding="utf-8")) for path in sorted(engine_folder().glob("*.toml"))]
    return digest(Path(__file__).with_name(f"{name}.py"), engines)


def _compute(name: str, quick: bool, tell: Tell) -> tuple[float, dict[str, Any]]:
    start = time.perf_counter()
    record = as_record(MAPS[name](quick, lambda stage, share: tell(name, stage, min(share, UNDER_WAY))))
    return time.perf_counter() - start, record
