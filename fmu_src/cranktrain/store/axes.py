"""Axes of stored arrays as HDF5 dimension scales, by which netCDF readers (xarray, h5netcdf) know them.

An axis is a dataset of one dimension beside what it belongs to, or in a group above: time, speeds, orders. Those that
only number or name places (main bearings, least and largest) are made here and bear no unit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Axes = Callable[[str], tuple[str, ...]]
"""Names of an array's axes by its own name, ``/`` and all."""
NUMBERS = {"main_bearing"}
"""Axes that count from 1."""
LABELS = {"extreme": ("least", "mean", "largest")}
"""Axes of named places."""
COORDINATE = "angle"
"""What runs along the time too."""


def of_result(name: str) -> tuple[str, ...]:
    """Axes of a run's arrays: time, but for what each main bearing has one of."""
    return ("main_bearing",) if name.rpartition("/")[2] == "film_temperature_c" else ("time",)


def of_run_up(name: str) -> tuple[str, ...]:
    """Axes of a run-up's arrays."""
    second: Mapping[str, tuple[str, ...]] = {"amplitudes": ("orders",), "extremes": ("extreme",)}
    return ("orders",) if name == "orders" else ("speeds", *second.get(name.partition("/")[0], ()))


def attach_axes(data: Any, axes: Axes) -> None:
    """Give the arrays of an HDF5 group, and of all below it, their axes; what does not fit an axis stays without."""
    found: list[Any] = []
    data.visititems(lambda _, item: found.append(item))
    for item in (data, *found):
        if hasattr(item, "keys") and "time" in item and COORDINATE in item:
            item.attrs["coordinates"] = COORDINATE
    for item in found:
        if hasattr(item, "keys"):
            continue
        for k, axis in enumerate(axes(item.name.removeprefix(f"{data.name}/"))):
            scale = _axis(item, axis, data.name)
            if scale is not None and k < item.ndim and scale.shape == item.shape[k : k + 1] and scale != item:
                item.dims[k].attach_scale(scale)


def _axis(item: Any, name: str, top: str) -> Any:
    """The axis of this name that an array sees, made where it only numbers or labels; None where there is none."""
    group = item.parent
    while name not in group and group.name != top:
        group = group.parent
    if name not in group:
        if name in LABELS:
            group.create_dataset(name, data=LABELS[name], track_times=False)
        elif name in NUMBERS:
            group.create_dataset(name, data=1 + np.arange(item.size), track_times=False)
        else:
            return None
    if not group[name].is_scale:
        group[name].make_scale(name)
    return group[name]


def is_bare_axis(dataset: Any) -> bool:
    """Whether a dataset only numbers or labels what others hold."""
    return bool(dataset.is_scale) and "unit" not in dataset.attrs
