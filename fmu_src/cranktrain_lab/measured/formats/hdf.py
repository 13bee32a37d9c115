"""Reader of HDF5 with one-dimensional arrays or matrices of columns and units as attributes; also MATLAB 7.3."""

from pathlib import Path

from cranktrain.store.plain_arrays import plain_arrays
from cranktrain_lab.measured.channels import Channel
from cranktrain_lab.measured.formats.arrays import Named, as_channels


def channels(path: Path) -> tuple[list[Channel], list[str]]:
    """List the channels of a file, and remarks."""
    arrays, scalars, remarks = plain_arrays(path)
    named = [Named(one.name, one.unit, one.size, one.columns, one.read, one.step) for one in arrays]
    found, told = as_channels(named, scalars, path.name)
    return found, remarks + told
