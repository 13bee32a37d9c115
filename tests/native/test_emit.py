"""Machine code of kernels: an object for every platform, records as numba lays them out; bits: test_machine_code.py."""

import math
from typing import NamedTuple

import numpy as np
import pytest

from cranktrain.core.kernel import call_kernel, kernel, kernel_name
from cranktrain.core.records import layout, leaves, record_image
from cranktrain.fmu.native.emit import Emission
from cranktrain.fmu.native.objects import object_code
from cranktrain.fmu.native.platforms import PLATFORMS


class Inner(NamedTuple):
    table: np.ndarray
    factor: float


class Record(NamedTuple):
    inner: Inner
    law: np.ndarray
    count: int
    values: np.ndarray


def record():
    law = np.zeros(2, dtype=np.int64)
    return Record(Inner(np.linspace(0.1, 2.0, 12).reshape(3, 4), 1.5), law, 3, np.arange(4.0))


@kernel
def law(values, place):
    values[0] += math.exp(math.sin(values[place])) ** 1.7
    return place


@kernel
def step(run, x):
    arguments = (run.values, run.count)
    status = call_kernel(run.law[0], arguments)
    for i in range(run.inner.table.shape[0]):
        for j in range(run.inner.table.shape[1]):
            run.values[j] += run.inner.factor * math.atan2(run.inner.table[i, j], x + run.values[j])
    return status


def test_every_platform_has_its_object():
    with Emission() as emission:
        emission.entry("step", record(), step)
        program = emission.program()
    formats = {"linux64": b"\x7fELF", "aarch64-linux": b"\x7fELF", "win64": b"\x64\x86"}
    for name, platform in PLATFORMS.items():
        assert object_code(program, platform).startswith(formats[name])


def test_a_function_that_gives_no_integer_is_refused():
    @kernel
    def real(x):
        return 2.0 * x

    with Emission() as emission, pytest.raises(TypeError, match="real must return an integer"):
        emission.function("real", real, (1.0,))


def test_an_image_is_what_compiled_code_reads():
    """A kernel that is handed the record and one that reads it at its image's address see the same."""
    run = record()
    words = record_image(run)
    assert [path for path, _ in leaves(run)] == ["inner.table", "inner.factor", "law", "count", "values"]
    assert layout(run) == "2f8 float 1i8 int 1f8"
    table = run.inner.table
    assert words[:9].tolist() == [0, 0, 12, 8, table.ctypes.data, 3, 4, 32, 8]
    assert words[9:10].view(np.float64)[0] == 1.5
    assert words[-7:].tolist() == [0, 0, 4, 8, run.values.ctypes.data, 4, 8]
    with pytest.raises(TypeError, match="'1' of tuple is a str"):
        record_image((1.0, "text"))


def test_a_kernel_is_called_by_its_name_in_full():
    assert kernel_name(law) == f"{__name__}:law"
