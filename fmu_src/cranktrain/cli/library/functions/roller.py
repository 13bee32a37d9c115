"""Function of the verb ``roller``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.results.views.found import VerbResult


# In one piece: every option of the verb, by keyword.
@of_verb
def roller(
    *, rollers: int | None = None, length_mm: float | None = None, roller_diameter_mm: float | None = None,
    pitch_mm: float | None = None, clearance_um: float | None = None, engine: str | Path | Engine | None = None,
    load_n: float | None = None, speed_rpm: float | None = None, out: str | Path | None = None, moment_nm: float = 0.0,
    law: Literal["palmgren", "iso16281"] | None = None, profile: str | None = None,
    position: Literal["roller", "between"] = "roller", slices: int = 30, ring: bool = False, rebuild: bool = False,
) -> VerbResult:  # fmt: skip
    """Cylindrical roller bearing: deflection, roller loads, radial and tilting stiffness.

    See ``cranktrain roller --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    rollers : number of rollers, at least 3
    length_mm : effective length of a roller
    roller_diameter_mm : diameter of a roller (default: its length)
    pitch_mm : pitch diameter, on which the rollers' axes lie
    clearance_um : diametral radial clearance (default 0)
    engine : bearings of this engine's [main_roller] instead of the options above
    load_n : radial load, N
    speed_rpm : with engine instead of load_n: speed of a run, rev/min
    out : with speed_rpm: new engine file with the stand-ins; nothing is overwritten
    moment_nm : moment in the plane of the load (default 0)
    law : palmgren or iso16281 (default palmgren, or the engine's)
    profile : none, iso16281 or a number (default none, or the engine's)
    position : roller (default) or between
    slices : Gauss points along a roller (default 30)
    ring : also outer ring and housing in finite elements
    rebuild : compute rings even where stored ones exist
    """
    return call("roller", locals())
