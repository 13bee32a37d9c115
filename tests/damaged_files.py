"""Ways in which files of results and bodies may be damaged or hostile, each a function of the file's path."""

from __future__ import annotations

import json
import zipfile

import h5py
import numpy as np

HUGE = (1 << 40,)


def soft_link(path, name="time"):
    """A link to nowhere."""
    _put(path, name, h5py.SoftLink("/nowhere"))


def external_link(path, name="time"):
    """A link into a file that does not exist."""
    _put(path, name, h5py.ExternalLink("other.h5", "/x"))


def link_to_other(path, name="time"):
    """A link into another file that exists: somebody else's data."""
    with h5py.File(path.parent / "other.h5", "w") as other:
        other["x"] = np.arange(50.0)
    _put(path, name, h5py.ExternalLink("other.h5", "/x"))


def texts(path, name="time"):
    """Texts in place of numbers."""
    _put(path, name, np.array([b"x"] * 50), unit="s")


def pairs(path, name="time"):
    """A compound type."""
    _put(path, name, np.zeros(50, dtype=[("a", float), ("b", int)]), unit="s")


def nothing(path, name="time"):
    """No values."""
    _put(path, name, np.zeros(0), unit="s")


def no_space(path, name="time"):
    """A dataset without a shape."""
    _put(path, name, h5py.Empty(float), unit="s")


def many_sides(path, name="time"):
    """More dimensions than a series has."""
    _put(path, name, np.zeros((5, 5, 2)), unit="s")


def not_a_number(path, name="time"):
    """NaN among the places along the axis."""
    with h5py.File(path, "r+") as file:
        values = 1.0 * file[f"data/{name}"][()]
    values.flat[values.size // 2] = np.nan
    _put(path, name, values, unit="s")


def huge(path, name="time"):
    """A stated shape of terabytes, of which nothing is written."""
    with h5py.File(path, "r+") as file:
        del file[f"data/{name}"]
        made = file.create_dataset(f"data/{name}", HUGE, np.float64, chunks=(4096,), maxshape=(None,))
        made.attrs["unit"] = made.attrs["units"] = "s"


def virtual(path, name="time"):
    """Values that lie in another file."""
    layout = h5py.VirtualLayout((50,), np.float64)
    layout[:] = h5py.VirtualSource("other.h5", "x", (50,))
    with h5py.File(path, "r+") as file:
        del file[f"data/{name}"]
        file.create_virtual_dataset(f"data/{name}", layout)
        file[f"data/{name}"].attrs["unit"] = "s"


def round_about(path, name="time"):
    """A group within itself."""
    with h5py.File(path, "r+") as file:
        file["data/again"] = file["data"]


def a_group(path, name="time"):
    """A group in place of an array."""
    with h5py.File(path, "r+") as file:
        del file[f"data/{name}"]
        file.create_group(f"data/{name}")


HARMS = (
    soft_link, external_link, link_to_other, texts, pairs, nothing, no_space, many_sides, not_a_number, huge, virtual,
    round_about, a_group,
)  # fmt: skip
DEEP = "[" * 100_000
"""Brackets that are nested more deeply than a reader goes."""


def _put(path, name, value, unit=""):
    with h5py.File(path, "r+") as file:
        del file[f"data/{name}"]
        file[f"data/{name}"] = value
        if unit:
            file[f"data/{name}"].attrs["unit"] = file[f"data/{name}"].attrs["units"] = unit


def deep_header(folder):
    """A body's header of nothing but brackets."""
    (folder / "body.json").write_text(DEEP)


def listed_header(folder):
    """A header that is no table."""
    (folder / "body.json").write_text("[1, 2]")


def negative_mass(folder):
    """A mass below zero."""
    _say(folder, mass=-1.0)


def endless_mass(folder):
    """A mass that is no number."""
    _say(folder, mass=float("inf"))


def twice_named(folder):
    """Interfaces of one name."""
    header = json.loads((folder / "body.json").read_text())
    _say(folder, interfaces=[header["interfaces"][0]] * len(header["interfaces"]))


def huge_record(folder):
    """A record of a shape that nothing holds."""
    header = json.loads((folder / "body.json").read_text())
    _say(folder, record_shapes={name: [1 << 40, 1 << 20] for name in header["record_shapes"]})


def huge_matrix(folder):
    """A sparse matrix of a stated size of exabytes."""
    (folder / "mass.mtx").write_text("%%MatrixMarket matrix coordinate real general\n1000000000 1000000000 1\n1 1 1\n")


def huge_shapes(folder):
    """A full matrix that states more entries than it has."""
    (folder / "shapes.mtx").write_text("%%MatrixMarket matrix array real general\n1000000000 1000000\n1.0\n")


def turned_inertia(folder):
    """Moments of inertia below zero."""
    (folder / "inertia.mtx").write_text("%%MatrixMarket matrix array real general\n3 3\n-1\n0\n0\n0\n-1\n0\n0\n0\n-1\n")


FOLDER_HARMS = (
    deep_header, listed_header, negative_mass, endless_mass, twice_named, huge_record, huge_matrix, huge_shapes,
    turned_inertia,
)  # fmt: skip


def _say(folder, **values):
    header = json.loads((folder / "body.json").read_text())
    (folder / "body.json").write_text(json.dumps({**header, **values}))


def archive_of(path, stated, name="omega"):
    """NumPy's archive of which one array states a shape."""
    with zipfile.ZipFile(path) as archive:
        entries = {entry: archive.read(entry) for entry in archive.namelist()}
    text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {stated}, }}".ljust(117).encode() + b"\n"
    entries[f"{name}.npy"] = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text
    with zipfile.ZipFile(path, "w") as archive:
        for entry, content in entries.items():
            archive.writestr(entry, content)
