"""Build the FMU of an engine, ``python build_fmu.py diesel_i6 [-o dist]``, of a scene or of a module.

The same as ``cranktrain fmu``, from the sources beside this file.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

SOURCES = Path(__file__).resolve().parent / "fmu_src"
if str(SOURCES) not in sys.path:
    sys.path.insert(0, str(SOURCES))

from cranktrain.cli import main as command  # noqa: E402


def main(arguments: Sequence[str] | None = None) -> int:
    """Build from the command line; the exit code is that of ``cranktrain``."""
    return command.main(["fmu", *(sys.argv[1:] if arguments is None else arguments)])


if __name__ == "__main__":
    sys.exit(main())
