"""Make the libraries of machine code of the present sources: ``python -m cranktrain.fmu.native [PLATFORM ...]``.

Done once at an installation. Without a C compiler numba compiles kernels when they are first used, as without this.
"""

from __future__ import annotations

import sys

from cranktrain.core.errors import InputError
from cranktrain.core.machine_code import RESTS_ON, this_platform
from cranktrain.fmu.native.link import library


def main(platforms: list[str]) -> int:
    """Make every kind's library for each platform, this machine's without any; 2 where one cannot be made."""
    try:
        for platform in platforms or [this_platform()]:
            for kind in RESTS_ON:
                library(kind, platform, lambda text: print(text, file=sys.stderr, flush=True))
    except InputError as error:
        print(f"libraries of machine code: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
