"""Make the libraries of machine code of the present sources: ``python -m cranktrain.fmu.native [PLATFORM ...]``.

This is done once at an installation. Without a C compiler numba compiles each kernel at its first call instead.
"""

import argparse
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from cranktrain.core.errors import InputError
from cranktrain.core.machine_code import LIBRARIES, RESTS_ON, WHOLE, library_name, this_platform
from cranktrain.fmu.native.link import checked_platform, compiler, library


def main(given: list[str]) -> int:
    """Make the libraries of all kinds for each platform, by default for this machine.

    Returns 2 if a requested platform's library cannot be made, 130 after an interrupt, otherwise 0.
    """
    parser = argparse.ArgumentParser("python -m cranktrain.fmu.native", description="Make libraries of machine code.")
    parser.add_argument("platforms", nargs="*", metavar="PLATFORM", help="linux64, win64; this machine's without any")
    modules = [kind for kind in RESTS_ON if kind not in WHOLE.split("+")]
    alone = [WHOLE.partition("+")[0], *modules]
    parser.add_argument("--kind", choices=alone, help="kernels of this kind alone; cranktrain: without solved films")
    parser.add_argument("--package", action="store_true", help="put them into the package, for a checkout or a wheel")
    chosen = parser.parse_args(given)
    kinds = [chosen.kind] if chosen.kind else [WHOLE, *modules]
    platforms = chosen.platforms or [this_platform()]
    try:
        lacking = [platform for platform in platforms if not _made_for(platform, kinds, chosen.package)]
    except KeyboardInterrupt:
        _say("interrupted; finished parts are kept, and the same command continues from there")
        return 130
    return 2 if lacking and chosen.platforms else 0


def _made_for(platform: str, kinds: list[str], into_package: bool) -> bool:
    """Make the libraries of these module kinds for a platform. Return False if a library is missing afterwards."""
    try:
        compiler(checked_platform(platform))
    except InputError as error:
        _say(f"no machine code for {platform}, so that kernels are compiled when they are first called: {error}")
        return False

    def made(kind: str) -> bool:
        try:
            made = library(kind, platform, _say)
            if into_package:
                _put(made, LIBRARIES / platform / library_name(kind, made.suffix))
        except (InputError, OSError) as error:
            _say(f"{kind}: its kernels are compiled when they are first called: {error}")
            return False
        return True

    # The first kind (the cranktrain) is made alone, because it takes longer than all others together.
    first, *others = kinds
    with ThreadPoolExecutor(1) as beside:
        found = [beside.submit(made, kind) for kind in others]
        try:
            return all([made(first), *(one.result() for one in found)])
        except BaseException:
            beside.shutdown(cancel_futures=True)
            raise


def _put(made: Path, place: Path) -> None:
    """Copy a library to its place, completely or not at all."""
    if made == place:
        return
    place.parent.mkdir(parents=True, exist_ok=True)
    temporary = place.with_suffix(f".{os.getpid()}")
    temporary.write_bytes(made.read_bytes())
    os.replace(temporary, place)


def _say(text: str) -> None:
    print(f"cranktrain: {text}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
