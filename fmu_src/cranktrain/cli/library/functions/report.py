"""Function of the verb ``report``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.loads.given_pressure import Pressures
    from cranktrain.results.views.found import VerbResult


# In one piece: every option of the verb, by keyword.
@of_verb
def report(
    engine: str | Path | Engine, *, output: str | Path | None = None, run_up: str | Path | None = None,
    pictures: Sequence[str | Path] = (), make: str | Path | None = None, measured: str | Path | None = None,
    drive_line: str | Path | None = None, pressure: str | Path | Pressures | None = None,
    pressure_unit: str | None = None, pressure_tdc_deg: float | None = None, speeds: Sequence[float] | None = None,
    load: float | None = None, orders: str | Sequence[float] = (), log: bool = False, linear: bool = False,
    peak_to_peak: bool = False, quick: bool = False,
) -> VerbResult:  # fmt: skip
    """Report of an engine as one HTML file.

    Verdict against the limits of its file, frequencies, vibration, bearings, origins.

    See ``cranktrain report --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    engine : name of a shipped engine (diesel_i6) or path of a .toml file
    output : default ENGINE_report.html
    run_up : result of 'cranktrain runup' of the engine: orders with films, axial motion
    pictures : folder that other verbs wrote pictures and results into, by --plots or output; may be given several times
    make : run the verbs whose data is missing, one after the other, into this folder; what it holds is kept and an
        interrupted run-up goes on (minutes to an hour)
    measured : measured orders, drawn over the computed ones: columns speed_rpm, order, amplitude, unit, zero to peak,
        as 'cranktrain measured' writes them, or curves over speed of a UFF file
    drive_line : discs and shafts (TOML or CSV) from 'flywheel' to 'dynamometer' in place of the connecting shaft
    pressure : measured pressures: a .csv file of crank angle in degrees and pressure, one column or one for each
        cylinder; or a folder of such files named by speed (1500.csv), or an index file of speed_rpm, load, file; or an
        array over one cycle (Pa), (angle, pressure), a dict by cylinder, or a function of the crank angle (rad) and the
        speed (rad/s)
    pressure_unit : Pa, kPa, bar or MPa (default: from header or size of the peak)
    pressure_tdc_deg : angle of the firing dead centre in the pressure file (of cylinder 1)
    speeds : range of speeds, rev/min (default: that of oil.temperature_speeds, and a sixth beyond)
    load : fraction of the full-load burn (default 1)
    orders : orders to be drawn, separated by commas, e.g. 4.5,6 (default: the strongest)
    log : amplitudes on a logarithmic scale (default: where resonances are below a twentieth of the largest)
    linear : amplitudes on a linear scale whatever they are
    peak_to_peak : amplitudes peak to peak in place of zero to peak
    quick : torsion at fewer speeds, linear, without inherited damping
    """
    return call("report", locals())
