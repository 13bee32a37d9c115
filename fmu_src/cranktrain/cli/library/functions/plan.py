"""Function of the verb ``plan``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.studies.planning.plan import Plan
    from cranktrain.studies.scene import Scene


# In one piece: every option of the verb, by keyword.
@of_verb
def plan(
    scene: str | Path | Scene,
) -> Plan:  # fmt: skip
    """The plan for a scene: which levels and step serve it, why, and with which error and computing time.

    See ``cranktrain plan --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    scene : path of a scene.toml
    """
    return call("plan", locals())
