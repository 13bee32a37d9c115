"""Function of the verb ``plot-runup``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.results.views.found import VerbResult


# In one piece: every option of the verb, by keyword.
@of_verb
def plot_runup(
    file: str | Path, others: str | Path | Sequence[str | Path] = (), *, plots: str | Path = "plots",
    measured: str | Path | None = None, with_damper: str | Path | None = None, orders: str | Sequence[float] = (),
    log: bool = False, linear: bool = False, peak_to_peak: bool = False, outputs: str | None = None,
    engine: str | Path | Engine | None = None,
) -> VerbResult:  # fmt: skip
    """Pictures of a run-up.

    Orders and twist over speed, named resonances, waterfall, colour map, Campbell diagram, motion.

    See ``cranktrain plot-runup --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    file : result of cranktrain runup or simulate
    others : results of the same kind, laid over it
    plots : folder for the pictures (default plots)
    measured : measured orders, drawn over the computed ones; table or UFF 58
    with_damper : run-up of the same engine with its damper, drawn below it
    orders : orders to be drawn, separated by commas, e.g. 4.5,6 (default: the strongest)
    log : amplitudes on a logarithmic scale (default: where resonances are below a twentieth of the largest)
    linear : amplitudes on a linear scale whatever they are
    peak_to_peak : amplitudes peak to peak in place of zero to peak
    outputs : of results laid over each other and of results of simulate: outputs, a picture each, separated by commas
        (default pulley.torsion)
    engine : engine file, if the one that the run-up names has moved
    """
    return call("plot-runup", locals())
