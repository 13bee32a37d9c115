"""Function of the verb ``stress``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.loads.given_pressure import Pressures
    from cranktrain.results.views.found import VerbResult


# In one piece: every option of the verb, by keyword.
@of_verb
def stress(
    engine: str | Path | Engine, *, speed_rpm: float, mesh: str | Path | None = None,
    mesh_unit: Literal["m", "mm", "in"] = "m",
    bearings: Literal["auto", "held", "linear", "impedance", "table", "reynolds", "ehd", "ehd:fine", "roller"] = "auto",
    big_ends: Literal["rigid", "impedance", "table", "ehd", "ehd:fine"] = "rigid",
    block: Literal["auto", "ground", "flexible"] = "auto", block_mesh: str | Path | None = None,
    pistons: Literal["auto", "rigid", "guided"] = "auto", damper: bool = False, load: float = 1.0,
    settle: float = 0.001, drive_line: str | Path | None = None, pressure: str | Path | Pressures | None = None,
    pressure_unit: str | None = None, pressure_tdc_deg: float | None = None,
    encoder: Literal["pin", "pulley", "flywheel"] = "pin", fillets: str | None = None, check: bool = True,
    plots: str | Path | None = None, output: str | Path | None = None,
) -> VerbResult:  # fmt: skip
    """Stress tensor and von Mises stress of the solid crankshaft's surface over a cycle.

    See ``cranktrain stress --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    engine : name of a shipped engine (diesel_i6) or path of a .toml file
    speed_rpm : rev/min, at least 20
    mesh : own mesh (.msh, .inp, .unv, .bdf) with named journal surfaces; for --crank torsional also a table of discs
        and shafts (.csv, .toml): pulley, flywheel and pin[1] …, or main[1] … between which the pins turn
    mesh_unit : unit of own meshes: m, mm, in (default m)
    bearings : held (no bearings: journals locked on their axis); linear (springs and dampers); impedance (oil film read
        from an impedance map); table (oil film that feels tilt, read from a film table, with asperities); reynolds (oil
        film that feels tilt, Reynolds' equation solved online, with asperities); ehd (oil film in an elastic bore,
        solved online, with cavitation and asperities); ehd:fine (the same on a finer grid: least films and pressure
        peaks); roller (cylindrical rollers); default impedance, roller where the mains are rollers, held at --crank
        torsional
    big_ends : rigid; impedance; table; ehd; ehd:fine; default rigid
    block : ground (main bores at rest); flexible (elastic modes of the finite-element block on its mounts); default
        ground, flexible where the mains are rollers
    block_mesh : own block (.msh, .inp, .unv, .bdf) with named surfaces; needs block flexible; or own reduced block in
        place of a mesh: .h5, .npz or folder of reduce --block-output, or a superelement of another program (.toml)
    pistons : rigid (pistons on their axes); guided (springs between skirt and liner); default rigid, in a flexible
        block guided
    damper : with the engine's torsional damper on the pulley
    load : fraction of the full-load burn (default 1)
    settle : run until the settling error of every output family is below this (default 0.001)
    drive_line : discs and shafts (TOML or CSV) from 'flywheel' to 'dynamometer' in place of the connecting shaft
    pressure : measured pressures: a .csv file of crank angle in degrees and pressure, one column or one for each
        cylinder; or a folder of such files named by speed (1500.csv), or an index file of speed_rpm, load, file; or an
        array over one cycle (Pa), (angle, pressure), a dict by cylinder, or a function of the crank angle (rad) and the
        speed (rad/s)
    pressure_unit : Pa, kPa, bar or MPa (default: from header or size of the peak)
    pressure_tdc_deg : angle of the firing dead centre in the pressure file (of cylinder 1)
    encoder : place whose angle the pressures of pressure belong to: pulley or flywheel, where the encoder of the
        measurement sat, or pin (default), each cylinder's own crank pin
    fillets : also the peaks in fillets and at oil bores by fine sub-models of these throws: all, or numbers such as
        1,6; minutes and 3 to 4 GB the first time, then kept
    check : no comparison with direct solutions, which takes half a minute
    plots : folder for pictures: surface at 0, 90 … 630 degrees, envelope
    output : result file (default: ENGINE_SPEEDrpm_stress.h5, with options other than the default in its name)
    """
    return call("stress", locals())
