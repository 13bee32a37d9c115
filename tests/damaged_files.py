"""Ways in which files of results and bodies may be damaged or hostile, each a function of the file's path."""

from __future__ import annotations

import json
import zipfile

import h5py
import numpy as np

DEEP = "[" * 100_000
"""Brackets that are nested more deeply than a reader goes."""
MATRIX = "%%MatrixMarket matrix {}\n"


def _put(called, value, unit="s"):
    """Another object in place of an array, with a unit where it can have one, and what tests call this."""

    def harm(path, name="time"):
        with h5py.File(path, "r+") as file:
            del file[f"data/{name}"]
            file[f"data/{name}"] = value
            if unit:
                file[f"data/{name}"].attrs["unit"] = file[f"data/{name}"].attrs["units"] = unit

    harm.__name__ = called
    return harm


def link_to_other(path, name="time"):
    """A link into another file that exists: somebody else's data."""
    with h5py.File(path.parent / "other.h5", "w") as other:
        other["x"] = np.arange(50.0)
    _put("link", h5py.ExternalLink("other.h5", "/x"), "")(path, name)


def not_a_number(path, name="time"):
    """NaN among the places along the axis."""
    with h5py.File(path, "r+") as file:
        values = 1.0 * file[f"data/{name}"][()]
    values.flat[values.size // 2] = np.nan
    _put("values", values)(path, name)


def huge(path, name="time"):
    """A stated shape of terabytes, of which nothing is written."""
    with h5py.File(path, "r+") as file:
        del file[f"data/{name}"]
        made = file.create_dataset(f"data/{name}", (1 << 40,), np.float64, chunks=(4096,), maxshape=(None,))
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
    _put("soft_link", h5py.SoftLink("/nowhere"), ""),
    _put("external_link", h5py.ExternalLink("other.h5", "/x"), ""),  # a file that does not exist
    link_to_other,
    _put("texts", np.array([b"x"] * 50)),
    _put("pairs", np.zeros(50, dtype=[("a", float), ("b", int)])),
    _put("nothing", np.zeros(0)),
    _put("no_space", h5py.Empty(float)),
    _put("many_sides", np.zeros((5, 5, 2))),
    not_a_number,
    huge,
    virtual,
    round_about,
    a_group,
)


def _say(**values):
    """Other entries of a body's header."""

    def harm(folder):
        header = json.loads((folder / "body.json").read_text())
        (folder / "body.json").write_text(json.dumps({**header, **values}))

    return harm


def _text(name, text):
    """Another text of one of a body's files."""
    return lambda folder: (folder / name).write_text(text)


def twice_named(folder):
    """Interfaces of one name."""
    header = json.loads((folder / "body.json").read_text())
    _say(interfaces=[header["interfaces"][0]] * len(header["interfaces"]))(folder)


def huge_record(folder):
    """A record of a shape that nothing holds."""
    header = json.loads((folder / "body.json").read_text())
    _say(record_shapes={name: [1 << 40, 1 << 20] for name in header["record_shapes"]})(folder)


FOLDER_HARMS = (
    _text("body.json", DEEP),
    _text("body.json", "[1, 2]"),
    _say(mass=-1.0),
    _say(mass=float("inf")),
    twice_named,
    huge_record,
    _text("mass.mtx", MATRIX.format("coordinate real general") + "1000000000 1000000000 1\n1 1 1\n"),  # exabytes
    _text("shapes.mtx", MATRIX.format("array real general") + "1000000000 1000000\n1.0\n"),  # more than it has
    _text("inertia.mtx", MATRIX.format("array real general") + "3 3\n-1\n0\n0\n0\n-1\n0\n0\n0\n-1\n"),
)


def archive_of(path, stated, name="omega"):
    """NumPy's archive of which one array states a shape."""
    with zipfile.ZipFile(path) as archive:
        entries = {entry: archive.read(entry) for entry in archive.namelist()}
    text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {stated}, }}".ljust(117).encode() + b"\n"
    entries[f"{name}.npy"] = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text
    with zipfile.ZipFile(path, "w") as archive:
        for entry, content in entries.items():
            archive.writestr(entry, content)
