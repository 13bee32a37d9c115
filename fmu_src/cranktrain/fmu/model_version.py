"""Version that an FMU states of itself: of the release, or of all development that leads to one.

It enters the FMU's GUID, so the number of a commit is left out: between releases equal models have equal GUIDs.
"""

from __future__ import annotations

import re

import cranktrain


def model_version() -> str:
    """``1.0.0`` of a release, ``1.0.1.dev0`` of every state of the sources between two."""
    return stated(cranktrain.__version__)


def stated(version: str) -> str:
    """A version without its commit: what follows ``+``, and the number after ``.dev``."""
    return re.sub(r"\.dev\d+", ".dev0", version.partition("+")[0])
