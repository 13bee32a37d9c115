"""Damage to a file is noticed before the HDF5 library sees it; what others do to it on purpose is not damage."""

import random

import h5py
import numpy as np
import pytest

from cranktrain.core.errors import StoreError
from cranktrain.store.hdf5 import BLOCK, RESULT, check_seal, read_result, seal, write_result


@pytest.fixture
def path(tmp_path):
    return write_result(tmp_path / "run.h5", {"time": (np.linspace(0.0, 1.0, 50), "s")}, {"engine": "diesel_i6"})


def test_any_damage_is_refused(path):
    """Of an unsealed file one in three such changes goes unnoticed, and one in a hundred crashes or hangs HDF5."""
    whole = path.read_bytes()
    for case in range(200):
        rng, content = random.Random(case), bytearray(whole)
        for _ in range(rng.randrange(1, 9)):
            content[rng.randrange(len(whole) - 40)] ^= rng.randrange(1, 256)
        path.write_bytes(content)
        with pytest.raises(StoreError, match=r"damaged.*run 'cranktrain simulate' again"):
            read_result(path)
        with pytest.raises(OSError, match="checksum"):
            RESULT.includes(path)


def test_a_file_that_was_changed_on_purpose_is_read(path):
    for number in range(3):
        with h5py.File(path, "r+") as file:
            file.attrs[f"note {number}"] = 1000 * "measured in the test bed "
            file[f"more {number}"] = np.arange(20.0)
        check_seal(path)
        datasets, attributes = read_result(path)
        assert datasets["time"][0].size == 50 and attributes["engine"] == "diesel_i6"


def test_a_file_that_lost_its_seal_is_read(path):
    whole = path.read_bytes()
    for cut in (1, 20, 30):
        path.write_bytes(whole[:-cut])
        assert read_result(path)[0]["time"][0].size == 50


@pytest.mark.parametrize("size", [0, 1, BLOCK - 1, BLOCK, BLOCK + 1, 3 * BLOCK])
def test_files_of_any_length(tmp_path, size):
    path = tmp_path / "any"
    path.write_bytes(bytes(size))
    seal(path)
    check_seal(path)
    assert path.read_bytes().startswith(bytes(size)) and path.stat().st_size > size
    if size:
        content = bytearray(path.read_bytes())
        content[size - 1] ^= 1
        path.write_bytes(content)
        with pytest.raises(OSError, match="checksum"):
            check_seal(path)
