"""Function of the verb ``identify``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.results.views.found import VerbResult


# In one piece: every option of the verb, by keyword.
@of_verb
def identify(
    engine: str | Path | Engine, measured: str, *, out: str | Path | None = None,
    level: Literal["linear", "harmonic-balance", "time"] = "harmonic-balance",
    crank: Literal["rigid", "torsional", "beam", "solid"] = "torsional",
    above: Literal["next", "none", "rigid", "torsional", "beam", "solid"] = "next", settle: float = 0.001,
    bootstrap: int = 400, profile: bool = True, seed: int = 1,
) -> VerbResult:  # fmt: skip
    """Find parameters of an engine from measured data: damping, damper, inertias, shafts, load, with 95 % intervals.

    See ``cranktrain identify --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    engine : name of a shipped engine or path of a .toml file
    measured : path of a .toml file of measured data and sought parameters
    out : engine file to write; an existing file is not overwritten
    level : last level: linear, harmonic-balance, time (default harmonic-balance)
    crank : crank of runs in time (default torsional)
    above : crank above the fitted one, whose run in time says once what it would move: beam, solid, next that bends
        (default), or none
    settle : largest settling error of runs in time (default 0.001)
    bootstrap : draws (default 400)
    profile : intervals by the covariance alone, which is faster
    seed : seed of starts and draws (default 1)
    """
    return call("identify", locals())
