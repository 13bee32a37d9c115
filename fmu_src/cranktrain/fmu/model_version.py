"""Version that an FMU states: the version of a release, or one version for all development towards the next.

The version enters the FMU's GUID, so the number of a commit is left out. Between releases equal models then have equal
GUIDs.
"""

import re

import cranktrain


def model_version() -> str:
    """Version ``1.0.0`` for a release, ``1.0.1.dev0`` for every state of the sources between two releases."""
    return stated(cranktrain.__version__)


def stated(version: str) -> str:
    """Version without its commit, that is, without text from ``+`` on and with 0 after ``.dev``."""
    return re.sub(r"\.dev\d+", ".dev0", version.partition("+")[0])
