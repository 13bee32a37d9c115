"""Function of the verb ``watch``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.results.views.found import VerbResult


# In one piece: every option of the verb, by keyword.
@of_verb
def watch(
    engine: str | Path | Engine, measured: str | Path | Sequence[str | Path], *,
    healthy: str | Path | Sequence[str | Path],
    output: Literal["pulley.torsion", "flywheel.torsion", "twist"] = "pulley.torsion",
    orders: str | Sequence[float] = (), false_alarms: float = 0.01, load: float = 1.0,
    level: Literal["linear", "harmonic-balance"] = "harmonic-balance", damper: bool = True, inherit: bool = True,
    seed: int = 1,
) -> VerbResult:  # fmt: skip
    """Find misfires, worn dampers and cracked springs from measured orders of the pulley's torsion alone.

    See ``cranktrain watch --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    engine : name of a shipped engine or path of a .toml file
    measured : files of orders, one a recording; several are averaged
    healthy : recordings of the healthy engine, three or more
    output : watched output: pulley.torsion, flywheel.torsion, twist (default pulley.torsion)
    orders : orders that count (default: all)
    false_alarms : fraction of healthy recordings that may raise an alarm (default 0.01)
    load : of the full-load burn (default 1)
    level : of the model: linear, harmonic-balance (default harmonic-balance)
    damper : the engine runs without its damper
    inherit : crank with its structural damping alone
    seed : seed of the draws (default 1)
    """
    return call("watch", locals())
