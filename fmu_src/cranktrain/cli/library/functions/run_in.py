"""Function of the verb ``run-in``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.results.views.found import VerbResult


# In one piece: every option of the verb, by keyword.
@of_verb
def run_in(
    engine: str | Path | Engine, *, out: str | Path | None = None, speed_rpm: float | None = None,
    crank: str = "solid", passes: int | None = None, cycles: int | None = None, hours: float | None = None,
    schedule: str | Path | None = None, output: str | Path | None = None, table: str | Path | None = None,
    plots: str | Path | None = None, wear_coefficient: float | None = None, end_gap: float | None = None,
    run_in_roughness: float | None = None, run_in_depth: float | None = None, increment: float | None = None,
    alike: bool | None = None, start: Literal["straight", "engine"] | None = None,
) -> VerbResult:  # fmt: skip
    """Axial profile that the shells of the main bearings wear to at the lowest speed of full load.

    See ``cranktrain run-in --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    engine : name of a shipped engine or path of a .toml file
    out : engine file to write; an existing file is not overwritten
    speed_rpm : rev/min (default: lowest at full load)
    crank : solid (default) or beam
    passes : wear passes (default 9)
    cycles : cycles a pass (default 3) or an increment (default 2), of which the last is read
    hours : hours of running
    schedule : table of hours, speed_rpm, load
    output : history, which is kept and continued (default ENGINE_wear.h5)
    table : table of the history to write
    plots : folder for pictures of profiles and of the history
    wear_coefficient : Archard's k (default 1e-08, to be calibrated)
    end_gap : gap over roughness at which wear ends; inf: never (0.5)
    run_in_roughness : run-in over new roughness (default 0.5)
    run_in_depth : wear that smooths, over the roughness (1)
    increment : wear of an increment over the roughness (default 0.25)
    alike : all shells have the deepest profile, as one ordered set
    start : new shells: straight (default) or with the engine file's relief
    """
    return call("run-in", locals())
