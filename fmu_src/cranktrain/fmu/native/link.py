"""Shared libraries of machine code: the objects of the kernels and the C shim, compiled once per state of the sources.

A library is valid for every engine, level and module file of its kind; the differences are data (:mod:`.image`).
Libraries are kept in the user's cache under a digest of their sources, or are part of the package in ``LIBRARIES``.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from hashlib import sha256
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

from cranktrain.core.cache import private_folder
from cranktrain.core.errors import InputError
from cranktrain.core.machine_code import (
    LIBRARIES,
    OFF,
    DamagedError,
    checksum,
    code_digest,
    is_whole,
    library_name,
    this_platform,
)
from cranktrain.core.types import Progress
from cranktrain.fmu.native.platforms import PLATFORMS, Platform

SOURCES = Path(__file__).parent / "c"
FLAGS = "-std=c11", "-Os", "-g0", "-shared", "-fvisibility=hidden", "-ffp-contract=off"
"""Small code: the time of a step is the kernels' time."""
TABLELESS = "-fno-asynchronous-unwind-tables", "-fno-unwind-tables"
"""Nothing is thrown through our code. Not for Windows, whose C library does not compile without unwind tables."""
SETTINGS = {
    "NUMBA_DISABLE_INTEL_SVML": "1",
    "NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING": "1",
    OFF: "1",
}
"""Of numba where it emits. It tries types by errors, whose colours take time."""


def library(kind: str, platform: str = "linux64", say: Progress = lambda text: None, emit: bool = True) -> Path:
    """Path of the library of a kind for a platform; made now where there is none of the present sources.

    Without ``emit`` its kernels are not compiled, which takes a minute or two: what is there is linked.

    Raises
    ------
    InputError
        a platform that is not known or that no compiler here makes, or kernels whose machine code is not there yet
    OSError
        a cache that cannot be written
    """
    row = checked_platform(platform)
    digest = code_digest(kind)
    target = private_folder("native", digest, row.folder) / library_name(kind, row.suffix, _shim_digest())
    for made in (LIBRARIES / row.folder / library_name(kind, row.suffix), target):
        if _is_made(made, digest):
            return made
    command = compiler(row)
    with _alone(private_folder("native", digest)):
        if not _is_made(target, digest):
            if not emit and not (private_folder("native", digest, "programs") / f"{kind}.c").is_file():
                raise InputError("it does not exist yet; run make native or python -m cranktrain.fmu.native")
            programs = _programs(kind, digest, say)
            say(f"{kind}: library for {row.folder}")
            _link(command, kind, digest, row, programs, target)
    return target


@cache
def _shim_digest() -> str:
    """Digest of the C side and of how it is linked, which stands behind a library's code."""
    files = [*sorted(SOURCES.glob("*.[ch]")), Path(__file__)]
    return "shim" + sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:8]


def checked_platform(platform: str) -> Platform:
    """Row of a platform; ``InputError`` for one that is not known."""
    if platform.endswith(("darwin", "darwin64")):
        raise InputError(
            "there is no machine code for macOS, where this program is untested; numba compiles there. Platforms of a "
            f"native FMU are {', '.join(PLATFORMS)}"
        )
    if platform not in PLATFORMS:
        raise InputError(f"platform '{platform}' is not known; take one of {', '.join(PLATFORMS)}")
    return PLATFORMS[platform]


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Let one process after the other work in a folder, where the system can lock files."""
    with (folder / "lock").open("w") as stream:
        if fcntl is not None:
            fcntl.flock(stream, fcntl.LOCK_EX)
        yield


def _is_made(path: Path, digest: str) -> bool:
    try:
        return is_whole(path, digest) and _shim_digest().encode() in path.read_bytes()
    except DamagedError:
        return False


def _programs(kind: str, digest: str, say: Progress) -> Path:
    """Folder of a kind's programs, LLVM's bitcode, and its table of functions; emitted in a process of its own.

    That process compiles for the least processor, whatever this one compiles for.
    """
    folder = private_folder("native", digest, "programs")
    if not (folder / f"{kind}.c").is_file():
        say(f"{kind}: machine code of the kernels is made, once for this state of the sources")
        run = [sys.executable, "-m", "cranktrain.fmu.native.make", kind, str(folder)]
        place = str(Path(__file__).parents[3])
        given = os.environ.get("PYTHONPATH")
        path = place if not given else os.pathsep.join((place, given))
        with subprocess.Popen(run, stdin=subprocess.PIPE, env={**os.environ, **emitting(), "PYTHONPATH": path}) as made:
            made.wait()
        if not (folder / f"{kind}.c").is_file():
            raise InputError(f"{kind}: no machine code was made of its kernels; the lines above say why")
    return folder


def emitting() -> dict[str, str]:
    """Environment in which kernels are emitted: for the least processor, so that every machine emits the same."""
    least = PLATFORMS.get(this_platform())
    return SETTINGS | ({"NUMBA_CPU_NAME": least.cpu, "NUMBA_CPU_FEATURES": ""} if least else {})


def _objects(kind: str, programs: Path, platform: Platform) -> list[Path]:
    """A kind's object files for a platform, and for its faster processors."""
    variants = (False, True) if platform.fast else (False,)
    return [_object(path, kind, platform, fast) for path in sorted(programs.glob(f"{kind}-*.bc")) for fast in variants]


def _object(program: Path, kind: str, platform: Platform, fast: bool) -> Path:
    from cranktrain.fmu.native.objects import FAST, object_code

    path = program.with_name(f"{program.stem}-{platform.folder}{FAST if fast else ''}.o")
    if path.is_file():
        return path
    with tempfile.TemporaryDirectory(dir=program.parent) as folder:
        temporary = Path(folder) / path.name
        try:
            temporary.write_bytes(object_code(program.read_bytes(), platform, fast))
        except RuntimeError as error:  # cut short, or of another LLVM
            program.with_name(f"{kind}.c").unlink(missing_ok=True)
            raise InputError(f"{program} cannot be read, so it is made again at the next attempt ({error})") from error
        os.replace(temporary, path)
    return path


_OWN_COMPILERS = {
    "linux64": ("cc", "gcc", "clang", "x86_64-linux-gnu-gcc"),
    "win64": ("x86_64-w64-mingw32-gcc",),
    "aarch64-linux": ("aarch64-linux-gnu-gcc",),
}
"""C compilers of one platform, tried in order where there is none for all."""


def compiler(platform: Platform) -> list[str]:
    """Command of a C compiler for a platform; ``InputError`` where there is none."""
    if importlib.util.find_spec("ziglang") is not None:
        return [sys.executable, "-m", "ziglang", "cc", "-target", platform.zig]
    for name in _OWN_COMPILERS[platform.folder]:
        found = shutil.which(name)
        if found is not None:
            return [found]
    raise InputError(
        f"no C compiler for {platform.folder} was found; install one that compiles for all: pip install ziglang"
    )


def _link(command: Sequence[str], kind: str, digest: str, platform: Platform, programs: Path, target: Path) -> None:
    """Compile the shim and link it with the objects; the library appears whole or not at all."""
    sources = [*sorted(SOURCES.glob("*.c")), programs / f"{kind}.c", *_objects(kind, programs, platform)]
    with tempfile.TemporaryDirectory(dir=target.parent) as folder:
        made = Path(folder) / target.name
        # Windows: the compiler's own C library is 150 kB smaller without what debuggers read, and code counts there.
        own = ["-s", "-Os"]
        if platform.suffix == ".so":
            # Zig's linker does not know the last flag, and does so anyway: code and data share pages, in smaller files.
            pages = "" if "ziglang" in command else ",-z,noseparate-code"
            own = [*TABLELESS, "-s", "-lm", f"-Wl,-z,relro,-z,now,-z,noexecstack{pages}", "-fPIC"]
        run = [
            *command,
            *FLAGS,
            *(["-DCT_FAST"] if platform.fast else []),
            f'-DCT_DIGEST="{digest}"',
            "-I",
            str(SOURCES),
            "-o",
            str(made),
            *map(str, sources),
            *own,
        ]
        done = subprocess.run(run, capture_output=True, text=True)
        if done.returncode:
            raise InputError(f"the C compiler failed for {platform.folder}: {done.stderr.strip() or run}")
        # Digest of the C side after the code, where no linker removes it.
        content = made.read_bytes() + _shim_digest().encode()
        made.write_bytes(content + checksum(content))
        os.replace(made, target)
