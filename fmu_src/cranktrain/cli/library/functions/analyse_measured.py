"""Function of the verb ``measured``; written by ``python -m cranktrain.cli.library``, not by hand."""

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
def analyse_measured(
    files: str | Path | Sequence[str | Path], *, channels: str | Sequence[str] | None = None, output: str | Path = "",
    rotation: str = "", teeth: int | None = None, missing: int | None = None,
    edge: Literal["rising", "falling"] | None = None, clock_hz: float | None = None, level: float | None = None,
    learn_teeth: str | Sequence[float] | bool = False, eccentricity: Literal["keep", "remove"] = "keep",
    index: str = "", dead_centre_deg: float = 0.0, firing: str = "", second: str = "", second_teeth: int | None = None,
    second_missing: int | None = None, orders: str | Sequence[float] = (), of: str | Sequence[str] = (),
    integrate: int = 0, step_rpm: float = 0.0, bandwidth_hz: float = 0.0, cycles: int | None = None,
    pressure: str | Sequence[str] = (), engine: str | Path | Engine = "", cylinders: str | Sequence[str] = (),
    unit: str = "", samples_per_cycle: int = 0, first_deg: float = -360.0, speed: float | None = None,
    pegging: Literal["compression", "polytropic", "intake", "keep"] = "compression", exponent: float = 1.34,
    intake_bar: float | None = None, intake_deg_c: float | None = None, low_pass_deg: float = 0.0,
    correct_dead_centre: bool = False,
) -> VerbResult:  # fmt: skip
    """Show and analyse measured signals: channels, rotation from pulses, orders over speed, cylinder pressures.

    Raises ``InputError`` for what cannot be used, ``SolverError`` for a computation that fails.

    Parameters
    ----------
    files : measurement files
    channels : channels to keep, separated by commas
    output : write orders for --measured of plot-runup and report, or mean pressures for pressure
    rotation : channel of pulses, or of rising times of pulses
    teeth : teeth a revolution, those missing included
    missing : teeth missing in the gap (2 for 60-2)
    edge : rising or falling edges (default: rising, unless those beside the gap are wrong)
    clock_hz : clock of a counter, where a channel holds times of pulses in ticks
    level : crossing level in the channel's unit (default: found)
    learn_teeth : learn pitch errors between two times, s; or 'all'
    eccentricity : order 1 of constant size: keep (default) or remove
    index : once-a-revolution pulse that marks tooth 0
    dead_centre_deg : angle from tooth 0 to firing dead centre of cylinder 1
    firing : pressure of cylinder 1, which says in which revolution it fires
    second : pulses of a second place, for the twist between both
    second_teeth : teeth of the second place
    second_missing : teeth missing there
    orders : orders to track, e.g. 0.5-12 or 3,4.5,6
    of : channels whose orders are tracked (default: the torsion)
    integrate : integrals over time: 1 for velocity (vibrometer), 2 for acceleration
    step_rpm : width of the bins of speed (default: a 40th of the range)
    bandwidth_hz : track by the Vold-Kalman filter of this bandwidth in place of fits over cycles
    cycles : cycles that a fit spans (default: what it needs)
    pressure : channels of cylinder pressure
    engine : engine of these pressures
    cylinders : numbers of their cylinders (default 1, 2, …)
    unit : unit of the pressures, where the file states none
    samples_per_cycle : of encoder-triggered channels
    first_deg : crank angle of their first sample after dead centre of cylinder 1 (default -360)
    speed : speed of encoder-triggered channels, or one that pulses are checked against
    pegging : zero by compression, polytropic, intake, keep
    exponent : of pegging polytropic (default 1.34)
    intake_bar : absolute intake pressure of pegging intake
    intake_deg_c : intake temperature (default: the engine's)
    low_pass_deg : remove waves shorter than this crank angle
    correct_dead_centre : move the cycles by the shift found
    """
    return call("measured", locals())
