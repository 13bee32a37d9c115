"""Function of the verb ``stability``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.results.views.found import VerbResult


# In one piece: every option of the verb, by keyword.
@of_verb
def stability(
    *, map: Sequence[str] | None = None, quick: bool = False, output: str | Path = "out/stability",
    page: str | Path | None = None, rebuild: bool = False, jobs: int | None = None,
) -> VerbResult:  # fmt: skip
    """Maps of where numerical methods become unstable or inaccurate, beside theory, drawn and explained.

    See ``cranktrain stability --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    map : this map only (may be given more than once)
    quick : coarse maps: all of them within three minutes
    output : folder for pictures (default out/stability)
    page : also write the maps with their explanations as one page
    rebuild : compute even maps that are kept
    jobs : processes (default: as many as processors)
    """
    return call("stability", locals())
