"""Axes of stored arrays as HDF5 dimension scales, which netCDF readers (xarray, h5netcdf) use.

An axis is a one-dimensional dataset next to the arrays that it describes, such as time, speeds or orders. Axes that
only contain numbers or names (main bearings, outputs, least and largest) are made here. They have no unit, and our own
readers ignore them.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

Axes = Callable[[str], tuple[str, ...]]
"""Function that returns the names of an array's axes for the array's name, which may contain ``/``."""
Labels = Mapping[str, Sequence[str]]
"""Names of the entries along an axis, by the name of the axis."""
NUMBERED = "main_bearing"
"""Name of the axis that numbers its entries from 1."""
RUN_UP_AXES = {
    **dict.fromkeys(("cycles", "repeats", "left", "parting"), ("speeds",)),
    "amplitudes": ("amplitude_output", "speeds", "orders"),
    "extremes": ("extreme_output", "speeds", "extreme"),
    "amplitude_unit": ("amplitude_output",),
    "extreme_unit": ("extreme_output",),
}
COORDINATES = {"time": "angle", "speeds": "amplitude_unit extreme_unit"}
"""Datasets that give positions along further axes (netCDF attribute ``coordinates``), by the group's main axis."""


def of_result(name: str) -> tuple[str, ...]:
    """Names of the axes of a run's array: time, except for arrays with one value per main bearing."""
    return ("main_bearing",) if name.rpartition("/")[2] == "film_temperature_c" else ("time",)


def of_run_up(name: str) -> tuple[str, ...]:
    """Names of the axes of a run-up's array, such as speeds and orders."""
    return RUN_UP_AXES.get(name, ())


def attach_axes(data: Any, axes: Axes, labels: Labels | None = None) -> None:
    """Attach axes to the arrays of an HDF5 group and of its subgroups; arrays that fit no axis get none."""
    for name, texts in (labels or {}).items():
        data.create_dataset(name, data=list(texts), track_times=False)
    found: list[Any] = [data]
    data.visititems(lambda _, item: found.append(item))
    for item in found:
        if hasattr(item, "keys"):
            named = [others for axis, others in COORDINATES.items() if axis in item]
            beside = [name for others in named for name in others.split() if name in item]
            if beside:
                item.attrs["coordinates"] = " ".join(beside)
            continue
        for k, axis in enumerate(axes(item.name.removeprefix(f"{data.name}/"))):
            scale = _axis(item, axis)
            if scale is not None and k < item.ndim and scale.shape == item.shape[k : k + 1] and scale != item:
                item.dims[k].attach_scale(scale)


def _axis(item: Any, name: str) -> Any:
    """Dataset of the axis ``name`` next to an array; a numbering axis is made if missing. None for an unknown axis."""
    group = item.parent
    if name not in group:
        if name != NUMBERED:
            return None
        group.create_dataset(name, data=1 + np.arange(item.size), track_times=False)
    if not group[name].is_scale:
        group[name].make_scale(name)
    return group[name]
