"""Function of the verb ``damper-optimum``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.results.views.found import VerbResult


# In one piece: every option of the verb, by keyword.
@of_verb
def damper_optimum(
    engine: str | Path | Engine | None = None, *, inertia_ratio: float | None = None, mode: int | None = None,
    mesh: str | Path | None = None, mesh_unit: Literal["m", "mm", "in"] = "m",
) -> VerbResult:  # fmt: skip
    """Optimum damping of a torsional damper, for two masses or for a torsional mode of an engine.

    See ``cranktrain damper-optimum --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError``
    for a computation that fails.

    Parameters
    ----------
    engine : name of a shipped engine or path of a .toml file
    inertia_ratio : ring over hub inertia; takes no ENGINE
    mode : first (default) or second torsional mode of the engine
    mesh : own mesh (.msh, .inp, .unv, .bdf) with named journal surfaces
    mesh_unit : unit of its coordinates: m, mm, in (default m)
    """
    return call("damper-optimum", locals())
