"""Why tests may be skipped here: the start of each known reason, and what would let them run.

A run ends with one line a kind. ``make test`` and ``make test-all`` fail on a reason that is not
in the table.
"""

from collections import Counter

KNOWN = {
    "CalculiX (ccx)": "install calculix-ccx",
    "no Chromium": "install Chromium",
    "pyvista is not installed": "pip install cranktrain[pictures], and libgl1",
    "could not import": "pip install what it names: xarray, parquet, dask, pictures, notebooks, explore, docs",
    "needs PyPI's ziglang": "pip install cranktrain[native]",
    "needs a C compiler": "install gcc, and what else it names",
    "needs gcc": "install gcc",
    "no C compiler": "install gcc",
    "needs clang": "install clang",
    "needs valgrind": "install valgrind",
    "needs nm": "install binutils",
    "needs ldd": "install libc-bin",
    "needs fmusim": "build fmusim from its sources",
    "needs fmuCheck": "build FMUComplianceChecker from its sources",
    "linked; to run it needs qemu-aarch64": "install qemu-user and libc6-arm64-cross",
    "the compiler has no -fsanitize": "install a compiler with sanitizers",
    "needs a C library that counts": "glibc 2.33 or newer",
    "libraries were not made here": "make native",
    "compares machine code of the installation": "make native",
    "measured trace not at": "set CRANKTRAIN_MEASURED to the file",
    "root may read everything": "run as another user",
    "no other Python": "install it, or let pyenv do so",
    "no package index within reach": "a network, or a mirror of PyPI",
    "not in the repository": "run in a checkout",
    "no device that is always full": "Linux",
    "reads /proc": "Linux",
    "needs process groups": "Linux or macOS",
    "needs locks that any program may ignore": "Linux or macOS",
    "Windows keeps": "Linux or macOS",
    "signals of POSIX": "Linux or macOS",
    "rollers have no film": "nothing: this combination does not exist",
    "a native FMU refuses it": "nothing: this combination does not exist",
    "a native FMU has no kernels": "nothing: this combination does not exist",
}


def kinds(reasons):
    """How often each known start, and each reason that is unknown, is among ``reasons``: two counters."""
    known, unknown = Counter(), Counter()
    for reason in reasons:
        start = next((start for start in KNOWN if reason.startswith(start)), None)
        (unknown if start is None else known)[start or reason] += 1
    return known, unknown
