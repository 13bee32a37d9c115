"""Function of the verb ``couple``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.loads.given_pressure import Pressures
    from cranktrain.results.views.found import VerbResult


# In one piece: every option of the verb, by keyword.
@of_verb
def couple(
    engine: str | Path | Engine, *, speed_rpm: float, cycles: int = 10,
    scheme: Literal["jacobi", "gauss-seidel", "iterative", "intermediate", "stages"] = "gauss-seidel",
    reconstruction: Literal["own", "hold", "linear", "quadratic"] = "own", step_deg: float = 1.0,
    error: float | None = None, drive_line: str | Path | None = None, pressure: str | Path | Pressures | None = None,
    pressure_unit: str | None = None, pressure_tdc_deg: float | None = None, cranktrain: str | Path | None = None,
    combustion: str | Path | None = None, valvetrain: str | Path | None = None, no_valvetrain: bool = False,
    values: Sequence[str] = (), export_ssp: str | Path | None = None, output: str | Path | None = None,
) -> VerbResult:  # fmt: skip
    """Couple cranktrain, combustion and valve train as FMUs, and run cycles at constant speed.

    See ``cranktrain couple --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    engine : name of a shipped engine (diesel_i6) or path of a .toml file
    speed_rpm : rev/min
    cycles : of 720 degrees (10)
    scheme : jacobi, gauss-seidel, iterative, intermediate, stages
    reconstruction : own, hold, linear, quadratic
    step_deg : communication step (1)
    error : adapt the step to this error
    drive_line : discs and shafts (TOML or CSV) from 'flywheel' to 'dynamometer' in place of the connecting shaft
    pressure : measured pressures: a .csv file of crank angle in degrees and pressure, one column or one for each
        cylinder; or a folder of such files named by speed (1500.csv), or an index file of speed_rpm, load, file; or an
        array over one cycle (Pa), (angle, pressure), a dict by cylinder, or a function of the crank angle (rad) and the
        speed (rad/s)
    pressure_unit : Pa, kPa, bar or MPa (default: from header or size of the peak)
    pressure_tdc_deg : angle of the firing dead centre in the pressure file (of cylinder 1)
    cranktrain : use this FMU instead of building one
    combustion : use this FMU instead of building one
    valvetrain : use this FMU instead of building one
    no_valvetrain : no valve train: built-in valve lifts, no torque of cams
    values : start value of a unit, e.g. cranktrain.crank.level=torsional; may be given several times
    export_ssp : write the coupled system for other masters, and do not run it
    output : result file (default: ENGINE_SPEEDrpm_coupled.h5, with options other than the default in its name)
    """
    return call("couple", locals())
