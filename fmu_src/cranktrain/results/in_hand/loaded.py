"""Result files read again."""

from __future__ import annotations

from pathlib import Path

from cranktrain.core.errors import InputError
from cranktrain.core.user_file import user_path
from cranktrain.results.files import StoredRun
from cranktrain.results.in_hand.over_speed import OrdersOverSpeed
from cranktrain.results.in_hand.time_series import TimeSeries
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.store.hdf5 import is_run_up


class LoadedRun(TimeSeries, StoredRun):
    """A run as its result file has it, with what a finished run offers."""

    __repr__ = TimeSeries.__repr__


def load_run(path: str | Path) -> LoadedRun | OrdersOverSpeed:
    """Read a result file of ``simulate``, or of ``runup``.

    Raises
    ------
    InputError
        no path
    StoreError
        a file that is missing, cut short, damaged, or of another kind
    """
    if not isinstance(path, str | Path):
        raise InputError(f"load_run: {path!r} is no path; give that of a result file, such as 'diesel_i6_2000rpm.h5'")
    target = user_path(path)
    if is_run_up(target):
        return OrdersOverSpeed.of(RunUp.load(target))
    stored = StoredRun.load(target)
    return LoadedRun(stored.time, stored.angle, stored.outputs, stored.attributes)
