"""Function of the verb ``calibrate``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.results.views.found import VerbResult


# In one piece: every option of the verb, by keyword.
@of_verb
def calibrate(
    engine: str | Path | Engine, targets: str | Path, *, out: str | Path | None = None, seed: int = 1,
    evaluations: int = 20000,
) -> VerbResult:  # fmt: skip
    """Fit values of an engine file, within bounds, so that its frequencies match targets.

    See ``cranktrain calibrate --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    engine : name of a shipped engine or path of a .toml file
    targets : path of a targets .toml file, or name of a shipped engine that has one
    out : engine file to write; an existing file is not overwritten
    seed : seed of the search (default 1)
    evaluations : limit of the search (default 20000; a search with new bodies takes half of it more)
    """
    return call("calibrate", locals())
