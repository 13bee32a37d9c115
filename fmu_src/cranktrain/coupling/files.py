"""A coupled run as a result file: every output that was read, as ``unit/variable``, over the time."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from cranktrain.coupling.master import Master
from cranktrain.coupling.run import Coupled
from cranktrain.store.hdf5 import write_result


def units_of(master: Master) -> dict[str, str]:
    """Unit of each output that is read, by ``unit.variable``."""
    return {name: port.unit for name, port in master.ports.items()}


def keep_run(path: Path, run: Coupled, units: Mapping[str, str], attributes: Mapping[str, str | int | float]) -> None:
    """Write a run; ``StoreError`` where it cannot be written."""
    datasets = {"time": (run.times, "s")}
    for k, name in enumerate(run.names):
        datasets[name.replace(".", "/", 1)] = run.values[:, k], units[name]
    write_result(path, datasets, attributes)
