"""Machine code of kernels: the same bits as where numba runs them, no Python inside, records as numba lays them out."""

import ctypes
import math
import shutil
import subprocess
from typing import NamedTuple

import numpy as np
import pytest

from cranktrain.core.kernel import call_kernel, kernel, kernel_address, kernel_name
from cranktrain.core.records import layout, leaves, record_image
from cranktrain.fmu.native.emit import Emission
from cranktrain.fmu.native.objects import object_code
from cranktrain.fmu.native.platforms import PLATFORMS

HERE = "linux64"


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


@pytest.fixture(scope="module")
def code(tmp_path_factory):
    """The two kernels in one library, linked by the machine's own compiler, with the least processor's instructions."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler here")
    with Emission() as emission:
        emission.entry("step", record(), step)
        emission.function("law", law, (np.zeros(1), 0))
        program = emission.program()
    folder = tmp_path_factory.mktemp("code")
    (folder / "kernels.o").write_bytes(object_code(program, PLATFORMS[HERE]))
    (folder / "address.c").write_text(
        "extern int law(); void *address(void); void *address(void) { return law; }\n"
        "long call(void *, double); extern long step(void *, double);\n"
        "long call(void *run, double x) { return step(run, x); }\n"
    )
    path = folder / "kernels.so"
    subprocess.run(
        [compiler, "-shared", "-fPIC", "-o", path, folder / "kernels.o", folder / "address.c", "-lm"], check=True
    )
    return path


def test_a_library_gives_the_bits_that_python_gets(code):
    loaded = ctypes.CDLL(str(code))
    loaded.address.restype, loaded.call.restype = ctypes.c_void_p, ctypes.c_long
    ours, theirs = record(), record()
    ours.law[0] = kernel_address(law, ours.values, 0)
    theirs.law[0] = loaded.address()
    image = record_image(theirs)
    for k in range(100):
        x = 0.01 * k
        assert step(ours, x) == 3
        assert loaded.call(ctypes.c_void_p(image.ctypes.data), ctypes.c_double(x)) == 3
    assert np.array_equal(ours.values, theirs.values)
    assert ours.values[0] > record().values[0]


def test_a_library_needs_the_mathematical_library_and_nothing_else(code):
    found = subprocess.run(["nm", "-u", code.with_name("kernels.o")], check=True, capture_output=True, text=True).stdout
    assert set(found.replace("U", "").split()) <= {"exp", "sin", "pow", "atan2"}


def test_every_platform_has_its_object(code):
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
