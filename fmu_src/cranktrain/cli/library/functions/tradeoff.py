"""Function of the verb ``tradeoff``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.results.views.found import VerbResult
    from cranktrain.studies.scene import Scene


# In one piece: every option of the verb, by keyword.
@of_verb
def tradeoff(
    scene: str | Path | Scene | None = None, *, family: Sequence[str] | None = None, total: bool = False,
    quick: bool = False, output: str | Path = "out/tradeoff",
) -> VerbResult:  # fmt: skip
    """Accuracy against speed: error over cost of methods, levels and resolutions, with the Pareto front.

    See ``cranktrain tradeoff --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    scene : scene file (.toml) in place of the usual scenes
    family : measure this family only; may be given several times
    total : total error of levels and steps against the best model, and its parts
    quick : fewer points, one scene, one run each: under three minutes
    output : charts and tables (out/tradeoff)
    """
    return call("tradeoff", locals())
