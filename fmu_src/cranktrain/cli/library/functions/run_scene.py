"""Function of the verb ``run``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.results.views.found import VerbResult
    from cranktrain.studies.scene import Scene


# In one piece: every option of the verb, by keyword.
@of_verb
def run_scene(
    scene: str | Path | Scene, *, verify: bool = False, all_levels: bool = False, with_ehd: bool = False,
    output: str | Path | None = None,
) -> VerbResult:  # fmt: skip
    """Plan a scene and run it, speed by speed; write an HDF5 result and print a summary of the wanted outputs.

    Raises ``InputError`` for what cannot be used, ``SolverError`` for a computation that fails.

    Parameters
    ----------
    scene : path of a scene.toml
    verify : check the predicted error by one run at the next level
    all_levels : run every level; report differences from the top
    with_ehd : with all_levels: elastic films too, minutes
    output : result file (default: SCENE.h5)
    """
    return call("run", locals())
