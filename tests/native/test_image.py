"""Images of runs: what is kept of their arrays, and how often."""

from typing import NamedTuple

import numpy as np

from cranktrain.fmu.native.file_format import COPIED, SHARED, TRANSPOSED, ZEROS
from cranktrain.fmu.native.image import Images


class Run(NamedTuple):
    """A run of a few arrays."""

    matrix: np.ndarray
    turned: np.ndarray
    table: np.ndarray
    work: np.ndarray
    least: np.ndarray


def run():
    matrix = np.arange(1.0, 7.0).reshape(2, 3)
    return Run(matrix, np.ascontiguousarray(matrix.T), np.ones((8, 8)), np.zeros((4, 2)), np.array([[-0.0]]))


def images():
    return Images({}, lambda path: path == "table")


def test_a_matrix_and_its_transposed_are_kept_once():
    made = images()
    made.add(run(), {})
    rows = made.tables["ARRY"]
    assert [row["kind"] for row in rows] == [COPIED, TRANSPOSED, SHARED, ZEROS, COPIED]
    assert rows[0]["offset"] == rows[1]["offset"] and rows[1]["shape"][:2] == (3, 2)
    blob = made.sections()["BLOB"]
    assert len(blob) == 64 + 512 + 64  # padded to lines of a cache: the matrix, the table, the zero with a sign
    kept = np.frombuffer(blob.tobytes(), count=6, offset=rows[0]["offset"])
    assert np.array_equal(kept.reshape(2, 3).T, run().turned)


def test_a_second_variant_of_equal_arrays_adds_no_row():
    made = images()
    made.add(run(), {})
    rows = len(made.tables["ARRY"])
    made.add(run(), {})
    assert len(made.tables["ARRY"]) == rows and made.tables["SLOT"][:rows] == made.tables["SLOT"][rows:]


def test_a_table_that_is_the_same_object_is_looked_at_once(monkeypatch):
    """Its megabytes are not read again for each of hundreds of variants; another of the same size is."""
    made, one = images(), run()
    made.add(one, {})
    seen = []
    keep = made._kept_row
    monkeypatch.setattr(made, "_kept_row", lambda array, *rest: seen.append(array.shape) or keep(array, *rest))
    made.add(one, {})
    assert (8, 8) not in seen
    made.add(one._replace(table=np.full((8, 8), 2.0)), {})
    assert (8, 8) in seen and len(made.tables["ARRY"]) == 6
