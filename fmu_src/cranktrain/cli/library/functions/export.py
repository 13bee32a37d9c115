"""Function of the verb ``export``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.results.views.found import VerbResult


# In one piece: every option of the verb, by keyword.
@of_verb
def export(
    file: str | Path, *, to: str | Path, group: str = "",
) -> VerbResult:  # fmt: skip
    """Write a result or run-up file as a table: CSV, Parquet (needs pyarrow) or NumPy's archive.

    See ``cranktrain export --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    file : result of simulate or run, or a run-up
    to : table.csv, table.parquet or table.npz
    group : group of a scene's file, e.g. 2000rpm
    """
    return call("export", locals())
