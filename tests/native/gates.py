"""What every library of a native FMU is held to: what it needs, what it shows, what it may write."""

import re
import shutil
import subprocess

import pytest
from mock_unit import SOURCES

LIBC = {
    *("calloc", "free", "memchr", "memcmp", "memcpy", "memmove", "memset", "strcat", "strchr", "strcmp", "strcpy"),
    *(
        "strlen",
        "strncmp",
        "strpbrk",
        "strstr",
        "strtod",
        "strtoul",
        "snprintf",
        "vsnprintf",
        "fprintf",
        "fwrite",
        "stderr",
    ),
    *("open64", "open", "close", "fstat64", "fstat", "__fxstat", "__fxstat64", "mmap64", "mmap", "munmap"),
    *("__errno_location", "bcmp"),
}
LIBM = {
    *(
        "fmax",
        "fmin",
        "nearbyint",
        "ceil",
        "floor",
        "exp",
        "log",
        "log10",
        "log1p",
        "expm1",
        "pow",
        "sqrt",
        "cbrt",
        "hypot",
        "fmod",
    ),
    *("sin", "cos", "tan", "sincos", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "atanh", "erf", "erfc"),
}
CRT = {"_ITM_deregisterTMCloneTable", "_ITM_registerTMCloneTable", "__cxa_finalize", "__gmon_start__"}
"""What a compiler puts into every library."""


def tool(name):
    """The name of a program; skips where this machine has none."""
    if shutil.which(name) is None:
        pytest.skip(f"needs {name}")
    return name


def said(*command):
    return subprocess.run([tool(command[0]), *map(str, command[1:])], capture_output=True, text=True, check=True).stdout


def nothing_but_libc_and_libm_is_needed(binary):
    needed = {line.split()[-1].partition("@")[0] for line in said("nm", "-D", "-u", binary).splitlines()}
    assert needed <= LIBC | LIBM | CRT, needed - LIBC - LIBM - CRT
    loaded = {line.split()[0].rpartition("/")[2] for line in said("ldd", binary).splitlines()}
    assert loaded <= {"linux-vdso.so.1", "libm.so.6", "libc.so.6", "ld-linux-x86-64.so.2"}, loaded


def declared():
    """Functions of FMI 2.0 and 3.0 in our headers."""
    texts = [(SOURCES / f"fmi{version}.h").read_text() for version in (2, 3)]
    return {name for text in texts for name in re.findall(r"\b(fmi[23]\w+)\((?:fmi[23]|void\))", text)}


def nothing_but_the_interface_is_shown(binary, *more):
    """``more`` are symbols beside the interface."""
    shown = {line.split()[-1] for line in said("nm", "-D", "--defined-only", binary).splitlines()} - {"_init", "_fini"}
    assert shown == declared() | set(more) and len(shown) == 34 + 75 + len(more)


def there_is_no_writable_data(binary):
    """Neither .data nor .bss of ours: tables of addresses are read-only once the library is loaded."""
    listed = said("readelf", "-W", "-S", binary)
    rows = re.findall(r"\[ *\d+\] (\.\S+) +\w+ +[0-9a-f]+ [0-9a-f]+ ([0-9a-f]+)", listed)
    sizes = {name: int(size, 16) for name, size in rows}
    assert sizes[".data.rel.ro"] > 0  # the tables
    assert not {".tdata", ".tbss", ".common"} & set(sizes)
    # The C library's start has a pointer in the one and a flag in the other.
    assert sizes.get(".data", 0) <= 8 and sizes.get(".bss", 0) <= 8, sizes


def the_stack_holds_no_code(binary):
    """And no segment is both written and run; what is relocated is read-only afterwards."""
    headers = re.findall(
        r"^ +(\w+) +0x.* ([R ][W ][E ]) +(?:0x)?\w+$", said("readelf", "-W", "-l", binary), re.MULTILINE
    )
    flags = {name: rights for name, rights in headers if name in ("GNU_STACK", "GNU_RELRO")}
    assert flags == {"GNU_STACK": "RW ", "GNU_RELRO": "R  "}, headers
    assert not any("W" in rights and "E" in rights for _, rights in headers)
