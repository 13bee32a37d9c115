"""Function of the verb ``harness``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.results.views.found import VerbResult


# In one piece: every option of the verb, by keyword.
@of_verb
def harness(
    file: str | Path, *, only: str | Path | Sequence[str | Path] = (), output: str | Path | None = None,
    junit: str | Path | None = None, html: str | Path | None = None,
) -> VerbResult:  # fmt: skip
    """Run the scenarios of a harness file and check its assertions.

    See ``cranktrain harness --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    file : path of a harness.toml
    only : run only these, and those they are compared with
    output : folder for a result file of each scenario (default: FILE_results)
    junit : write results as JUnit XML
    html : write a report with plots, one file
    """
    return call("harness", locals())
