"""A coupled run as a result file: every output that was read, as ``unit/variable``, over the time."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from cranktrain.coupling.run import Coupled
from cranktrain.store.hdf5 import write_result


def keep_run(path: Path, run: Coupled, attributes: Mapping[str, str | int | float]) -> None:
    """Write a run; ``StoreError`` where it cannot be written."""
    datasets = {"time": (run.times, "s")}
    for k, (name, unit) in enumerate(zip(run.names, run.units, strict=True)):
        datasets[name.replace(".", "/", 1)] = run.values[:, k], unit
    write_result(path, datasets, attributes)
