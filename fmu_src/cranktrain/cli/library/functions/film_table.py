"""Function of the verb ``film-table``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.results.views.found import VerbResult


# In one piece: every option of the verb, by keyword.
@of_verb
def film_table(
    *, length_ratio: float, groove: Literal["none", "circumferential"] = "none", tilt: bool = True,
    tilt_range: float = 0.95, relief: Sequence[float] = (0.0, 0.5, 2.0), roughness: float = 5e-05,
    resolution: Literal["coarse", "default", "fine"] = "default", rebuild: bool = False, jobs: int | None = None,
    output: str | Path | None = None,
) -> VerbResult:  # fmt: skip
    """Make the film table of bearings with one width-to-diameter ratio; it is kept in the cache.

    See ``cranktrain film-table --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    length_ratio : width over diameter, 0.05 to 4
    groove : none or circumferential; none
    tilt : only the table of the aligned journal
    tilt_range : over the possible tilt (default 0.95)
    relief : axial profile of the shell, its depth over the clearance (default: straight)
    roughness : of both surfaces, over the clearance
    resolution : coarse, default, fine
    rebuild : compute even where a stored table exists
    jobs : processes (default: as many as processors)
    output : where the table is kept (default: the cache)
    """
    return call("film-table", locals())
