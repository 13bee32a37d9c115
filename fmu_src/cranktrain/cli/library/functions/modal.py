"""Function of the verb ``modal``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.loads.given_pressure import Pressures
    from cranktrain.results.views.found import Frequencies


# In one piece: every option of the verb, by keyword.
@of_verb
def modal(
    engine: str | Path | Engine, *, mesh: str | Path | None = None, mesh_unit: Literal["m", "mm", "in"] = "m",
    damper: bool = False, crank: Literal["rigid", "torsional", "beam", "solid"] = "solid",
    block: Literal["ground", "flexible"] = "ground", block_mesh: str | Path | None = None,
    bearings: Literal["auto", "held", "linear", "impedance", "table", "reynolds", "ehd", "ehd:fine", "roller"] = "auto",
    speed_rpm: float | None = None, drive_line: str | Path | None = None,
    pressure: str | Path | Pressures | None = None, pressure_unit: str | None = None,
    pressure_tdc_deg: float | None = None,
) -> Frequencies:  # fmt: skip
    """Free crankshaft and cranktrain frequencies beside the reference's, and critical speeds.

    See ``cranktrain modal --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    engine : name of a shipped engine (diesel_i6) or path of a .toml file
    mesh : own mesh (.msh, .inp, .unv, .bdf) with named journal surfaces; for crank torsional also a table of discs and
        shafts (.csv, .toml): pulley, flywheel and pin[1] …, or main[1] … between which the pins turn; or own reduced
        crankshaft in place of a mesh: .h5, .npz or folder of reduce --output, or a superelement of another program
        (.toml)
    mesh_unit : unit of own meshes: m, mm, in (default m)
    damper : also damped modes of the cranktrain with the engine's torsional damper
    crank : rigid; torsional; beam; solid; default solid; frequencies of other levels are compared with solid where that
        is made already
    block : ground; flexible; default ground
    block_mesh : own block (.msh, .inp, .unv, .bdf) with named surfaces; needs block flexible; or own reduced block in
        place of a mesh: .h5, .npz or folder of reduce --block-output, or a superelement of another program (.toml)
    bearings : of the mains, for modes in motion (default as simulate)
    speed_rpm : speed for modes in motion, rev/min (default: combustion.best_speed)
    drive_line : discs and shafts (TOML or CSV) from 'flywheel' to 'dynamometer' in place of the connecting shaft
    pressure : measured pressures: a .csv file of crank angle in degrees and pressure, one column or one for each
        cylinder; or a folder of such files named by speed (1500.csv), or an index file of speed_rpm, load, file; or an
        array over one cycle (Pa), (angle, pressure), a dict by cylinder, or a function of the crank angle (rad) and the
        speed (rad/s)
    pressure_unit : Pa, kPa, bar or MPa (default: from header or size of the peak)
    pressure_tdc_deg : angle of the firing dead centre in the pressure file (of cylinder 1)
    """
    return call("modal", locals())
