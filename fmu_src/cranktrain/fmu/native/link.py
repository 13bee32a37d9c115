"""Shared libraries of machine code: objects of the kernels and the C shim, compiled once per state of the sources.

A library is valid for every engine, level and module file of its kinds; the differences are data (:mod:`.image`). Each
kind is emitted separately and kept, so an edit of solved films does not recompile the other kernels. Libraries are kept
in the user's cache under a digest of their sources, or are part of the package in ``LIBRARIES``.
"""

import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

try:
    import fcntl
except ImportError:  # Windows has no fcntl
    fcntl = None  # type: ignore[assignment]

from cranktrain.core.cache import private_folder
from cranktrain.core.errors import InputError
from cranktrain.core.machine_code import (
    LIBRARIES,
    OFF,
    DamagedError,
    checksum,
    code_digest,
    folder_of,
    is_whole,
    library_name,
    shares_of,
    this_platform,
)
from cranktrain.core.types import Progress
from cranktrain.fmu.native import exported
from cranktrain.fmu.native.platforms import PLATFORMS, Platform

SOURCES = Path(__file__).parent / "c"
FLAGS = "-std=c11", "-Os", "-g0", "-shared", "-fvisibility=hidden", "-ffp-contract=off"
"""Flags of the C compiler. The shim is optimised for size, because the kernels take nearly all time of a step."""
TABLELESS = "-fno-asynchronous-unwind-tables", "-fno-unwind-tables"
"""Flags without unwind tables, since no exceptions pass through our code; Windows' C library needs the tables."""
SETTINGS = {
    "NUMBA_DISABLE_INTEL_SVML": "1",
    "NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING": "1",
    OFF: "1",
}
"""Environment variables of numba for emission. Coloured error texts are off, because they cost time."""


def library(kind: str, platform: str = "linux64", say: Progress = lambda text: None, emit: bool = True) -> Path:
    """Path of a library for a platform; it is made if there is none for the present sources.

    Parameters
    ----------
    kind : kind of its kernels; several with ``+`` between them
    emit : False if kernels must not be compiled, which takes a minute or two; existing programs are linked

    Raises
    ------
    InputError
        an unknown platform or one for which there is no compiler, or kernels without machine code yet
    OSError
        a cache that cannot be written
    """
    row = checked_platform(platform)
    target = private_folder("native", folder_of(kind), row.folder) / library_name(kind, row.suffix, _shim_digest())
    for made in (LIBRARIES / row.folder / library_name(kind, row.suffix), target):
        if _is_made(made, kind):
            return made
    command = compiler(row)
    with _alone(private_folder("native", folder_of(kind)), say):
        if not _is_made(target, kind):
            programs = _all_programs(kind.split("+"), say, emit)
            say(f"{kind}: library for {row.folder}")
            _link(command, kind, row, programs, target)
    return target


def _all_programs(kinds: Sequence[str], say: Progress, emit: bool) -> list[Path]:
    """Programs (LLVM bitcode) of all shares of these kinds; missing programs are made in parallel processes.

    These processes compile for the oldest supported processor, whatever this one compiles for. ``InputError`` if
    kernels must not be emitted, or emission failed.
    """
    programs = [_program(kind, share) for kind in kinds for share in shares_of(kind)]
    with ExitStack() as stack:
        for folder in dict.fromkeys(program.parent for program in programs):
            stack.enter_context(_alone(folder, say))
        lacking = [program for program in programs if not program.with_suffix(".json").is_file()]
        if lacking and not emit:
            raise InputError("it does not exist yet; run make native or python -m cranktrain.fmu.native")
        running = []
        if lacking:
            named = ", ".join(program.stem for program in lacking)
            say(f"{named}: machine code of the kernels is made, once for these sources, in a minute or two")
        for program in lacking:
            run = "cranktrain.fmu.native.make", program.stem, str(program.parent)
            running.append(stack.enter_context(_process(run, stdin=subprocess.PIPE, env=_environment() | emitting())))
        for one in running:
            one.wait()
    for program in lacking:
        if not program.with_suffix(".json").is_file():
            raise InputError(f"{program.stem}: no machine code was made of its kernels; the lines above say why")
    return programs


@contextmanager
def _process(module: Sequence[str], **given: Any) -> Iterator[subprocess.Popen[Any]]:
    """Python process that runs a module with arguments; it is killed at the end of the block if it still runs.

    It is in a session of its own, because an interrupt from a terminal is the caller's to answer.
    """
    with subprocess.Popen([sys.executable, "-m", *module], start_new_session=True, **given) as process:
        try:
            yield process
        finally:
            process.kill()


def _program(kind: str, share: str) -> Path:
    """File of a share's program in LLVM bitcode; the list of its exports is next to it."""
    return private_folder("native", code_digest(kind), "programs") / f"{share}.bc"


@cache
def _shim_digest() -> str:
    """Digest of the C side and of how it is linked, which is appended to a library's code."""
    files = [*sorted(SOURCES.glob("*.[ch]")), Path(__file__), Path(exported.__file__)]
    return "shim" + sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:8]


def checked_platform(platform: str) -> Platform:
    """Row of a platform; ``InputError`` if it is unknown."""
    if platform.endswith(("darwin", "darwin64")):
        raise InputError(
            "there is no machine code for macOS, where this program is untested; numba compiles there. Platforms of a "
            f"native FMU are {', '.join(PLATFORMS)}"
        )
    if platform not in PLATFORMS:
        raise InputError(f"platform '{platform}' is not known; take one of {', '.join(PLATFORMS)}")
    return PLATFORMS[platform]


@contextmanager
def _alone(folder: Path, say: Progress) -> Iterator[None]:
    """Context with a lock that admits one process at a time to a folder, if the system can lock files.

    ``say`` is told if another process has the lock, which may be for a minute or two.
    """
    with (folder / "lock").open("w") as stream:
        if fcntl is not None:
            try:
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                say("waiting for another process that makes the same machine code")
                fcntl.flock(stream, fcntl.LOCK_EX)
        yield


def _is_made(path: Path, kind: str) -> bool:
    try:
        sound = all(is_whole(path, code_digest(part)) for part in kind.split("+"))
        return sound and _shim_digest().encode() in path.read_bytes()
    except DamagedError:
        return False


def _environment() -> dict[str, str]:
    """Environment variables for a child process that imports this package."""
    given = os.environ.get("PYTHONPATH")
    place = str(Path(__file__).parents[3])
    return {**os.environ, "PYTHONPATH": place if not given else os.pathsep.join((place, given))}


def emitting() -> dict[str, str]:
    """Environment variables for emission: oldest supported processor, so that every machine emits the same code."""
    least = PLATFORMS.get(this_platform())
    return SETTINGS | ({"NUMBA_CPU_NAME": least.cpu, "NUMBA_CPU_FEATURES": ""} if least else {})


def _objects(programs: Sequence[Path], platform: Platform) -> list[Path]:
    """Object files of programs for a platform, and for its faster processors.

    They are made in parallel, each in a process of its own, because LLVM works in one thread at a time.
    """
    variants = ("", exported.FAST) if platform.fast else ("",)
    wanted = {
        program.with_name(f"{program.stem}-{platform.folder}{fast}.o"): (program, fast)
        for program in programs for fast in variants
    }  # fmt: skip
    with ExitStack() as stack:
        running = {}
        for path, (program, fast) in wanted.items():
            if not path.is_file():
                folder = stack.enter_context(tempfile.TemporaryDirectory(dir=program.parent))
                made = Path(folder) / path.name
                run = "cranktrain.fmu.native.objects", str(program), platform.folder, str(made), *filter(None, [fast])
                running[path] = (
                    made,
                    stack.enter_context(_process(run, stderr=subprocess.PIPE, text=True, env=_environment())),
                )
        for path, (made, process) in running.items():
            said = process.communicate()[1].strip().splitlines()[-1:]
            if process.returncode:  # the program file is cut short, or was made by another version of LLVM
                program, _ = wanted[path]
                program.with_suffix(".json").unlink(missing_ok=True)
                raise InputError(f"{program} cannot be read, so it is made again at the next attempt ({''.join(said)})")
            os.replace(made, path)
    return list(wanted)


_OWN_COMPILERS = {
    "linux64": ("cc", "gcc", "clang", "x86_64-linux-gnu-gcc"),
    "win64": ("x86_64-w64-mingw32-gcc",),
    "aarch64-linux": ("aarch64-linux-gnu-gcc",),
}
"""C compilers for each platform, tried in this order if ziglang, which serves all platforms, is not installed."""


def compiler(platform: Platform) -> list[str]:
    """Command of a C compiler for a platform; ``InputError`` if there is none."""
    if importlib.util.find_spec("ziglang") is not None:
        return [sys.executable, "-m", "ziglang", "cc", "-target", platform.zig]
    for name in _OWN_COMPILERS[platform.folder]:
        found = shutil.which(name)
        if found is not None:
            return [found]
    raise InputError(
        f"no C compiler for {platform.folder} was found; install one that compiles for all: pip install ziglang"
    )


def _link(command: Sequence[str], kind: str, platform: Platform, programs: Sequence[Path], target: Path) -> None:
    """Compile the shim and link it with the objects; the library is written completely or not at all."""
    digests = " ".join(map(code_digest, kind.split("+")))
    with tempfile.TemporaryDirectory(dir=target.parent) as folder:
        made, table = Path(folder) / target.name, Path(folder) / "exported.c"
        table.write_text(exported.exported_text([path.with_suffix(".json") for path in programs]), encoding="utf-8")
        sources = [*sorted(SOURCES.glob("*.c")), table, *_objects(programs, platform)]
        # On Windows, -s removes debug information of the C library (150 kB), and -Os reduces its size.
        own = ["-s", "-Os"]
        if platform.suffix == ".so":
            # Zig's linker does not know the last flag but does the same: code and data share pages, in smaller files.
            pages = "" if "ziglang" in command else ",-z,noseparate-code"
            own = [*TABLELESS, "-s", "-lm", f"-Wl,-z,relro,-z,now,-z,noexecstack{pages}", "-fPIC"]
        run = [
            *command,
            *FLAGS,
            *(["-DCT_FAST"] if platform.fast else []),
            f'-DCT_DIGEST="{digests}"',
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
        # The digest of the C side is appended to the file, where no linker removes it.
        content = made.read_bytes() + _shim_digest().encode()
        made.write_bytes(content + checksum(content))
        os.replace(made, target)
