"""Function of the verb ``bearing-loads``; written by ``python -m cranktrain.cli.library``, not by hand."""

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
def bearing_loads(
    engine: str | Path | Engine, *, mesh: str | Path | None = None, mesh_unit: Literal["m", "mm", "in"] = "m",
    speeds_rpm: float | Sequence[float] | None = None, result: str | Path | Sequence[str | Path] | None = None,
    run_up: str | Path | None = None, cycles: int | None = None, settle: float = 0.001,
    plots: str | Path | None = None, crank: Literal["rigid", "torsional", "beam", "solid"] = "solid",
    bearings: Literal["auto", "held", "linear", "impedance", "table", "reynolds", "ehd", "ehd:fine", "roller"] = "auto",
    big_ends: Literal["rigid", "impedance", "table", "ehd", "ehd:fine"] | None = None,
    block: Literal["auto", "ground", "flexible"] = "auto", block_mesh: str | Path | None = None,
    pistons: Literal["auto", "rigid", "guided"] = "auto", damper: bool = False,
    load: float | Literal["balanced"] | None = None, inherit: bool = True, drive_line: str | Path | None = None,
    pressure: str | Path | Pressures | None = None, pressure_unit: str | None = None,
    pressure_tdc_deg: float | None = None, encoder: Literal["pin", "pulley", "flywheel"] = "pin",
    axial_force_n: float | None = None, damper_temperature: Literal["engine", "heat-balance"] = "engine",
    film_temperature: Literal["engine", "heat-balance", "adiabatic"] = "engine",
    integrator: Literal["backward-euler", "trapezoidal", "hht", "generalised-alpha", "bdf2", "tr-bdf2", "sdirk2",
        "sdirk3", "sdirk4", "esdirk3", "esdirk4", "esdirk5", "esdirk47", "esdirk57"] | None = None,
    step_deg: float | None = None, tolerance: float | None = None,
) -> VerbResult:  # fmt: skip
    """Bearings over a cycle at one speed or several: loads, films, friction, oil flow, held against limits.

    Raises ``InputError`` for what cannot be used, ``SolverError`` for a computation that fails.

    Parameters
    ----------
    engine : name of a shipped engine (diesel_i6) or path of a .toml file
    mesh : own mesh (.msh, .inp, .unv, .bdf) with named journal surfaces; for crank torsional also a table of discs and
        shafts (.csv, .toml): pulley, flywheel and pin[1] …, or main[1] … between which the pins turn; or own reduced
        crankshaft in place of a mesh: .h5, .npz or folder of reduce --output, or a superelement of another program
        (.toml)
    mesh_unit : unit of own meshes: m, mm, in (default m)
    speeds_rpm : speeds, rev/min; each runs until its cycles repeat
    result : results of 'cranktrain simulate' instead of runs
    run_up : result of 'cranktrain runup --outputs bearings': all its speeds
    cycles : exactly this many cycles a speed (default: until the outputs repeat)
    settle : run until the settling error of every output family is below this (default 0.001)
    plots : folder for polar load diagrams and, with several speeds, a picture of the worst bearing over speed
    crank : rigid; torsional; beam; solid; default solid
    bearings : held (no bearings: journals locked on their axis); linear (springs and dampers); impedance (oil film read
        from an impedance map); table (oil film that feels tilt, read from a film table, with asperities); reynolds (oil
        film that feels tilt, Reynolds' equation solved online, with asperities); ehd (oil film in an elastic bore,
        solved online, with cavitation and asperities); ehd:fine (the same on a finer grid: least films and pressure
        peaks); roller (cylindrical rollers); default impedance, roller where the mains are rollers, held at crank
        torsional
    big_ends : rigid; impedance; table; ehd; ehd:fine; default impedance
    block : ground (main bores at rest); flexible (elastic modes of the finite-element block on its mounts); default
        ground, flexible where the mains are rollers
    block_mesh : own block (.msh, .inp, .unv, .bdf) with named surfaces; needs block flexible; or own reduced block in
        place of a mesh: .h5, .npz or folder of reduce --block-output, or a superelement of another program (.toml)
    pistons : rigid (pistons on their axes); guided (springs between skirt and liner); default rigid, in a flexible
        block guided
    damper : with the engine's torsional damper on the pulley
    load : fraction of the full-load burn, or 'balanced': the burn whose mean torque is that of the engine file's [load]
        (default: balanced where the file has [load], else 1)
    inherit : torsional crank with its structural damping alone, without damping inherited from the level above
    drive_line : discs and shafts (TOML or CSV) from 'flywheel' to 'dynamometer' in place of the connecting shaft
    pressure : measured pressures: a .csv file of crank angle in degrees and pressure, one column or one for each
        cylinder; or a folder of such files named by speed (1500.csv), or an index file of speed_rpm, load, file; or an
        array over one cycle (Pa), (angle, pressure), a dict by cylinder, or a function of the crank angle (rad) and the
        speed (rad/s)
    pressure_unit : Pa, kPa, bar or MPa (default: from header or size of the peak)
    pressure_tdc_deg : angle of the firing dead centre in the pressure file (of cylinder 1)
    encoder : place whose angle the pressures of pressure belong to: pulley or flywheel, where the encoder of the
        measurement sat, or pin (default), each cylinder's own crank pin
    axial_force_n : steady axial force on the flywheel, positive away from the pulley (default: the engine file's)
    damper_temperature : engine (default), by its speed; or heat-balance, from the damper's own losses
    film_temperature : temperature of the main bearings' oil: engine (default), by its speed; or heat-balance or
        adiabatic, each film warmed by its own friction (the run repeats, at most 6 times; big ends and thrust bearing
        stay at the engine's)
    integrator : backward-euler, trapezoidal, hht, generalised-alpha, bdf2, tr-bdf2, sdirk2, sdirk3, sdirk4, esdirk3,
        esdirk4, esdirk5, esdirk47, esdirk57; default esdirk47, at level ehd esdirk3, at level ehd:fine esdirk3; elastic
        films refuse sdirk4, esdirk5, esdirk57
    step_deg : internal step in degrees of crank angle; default 5, at level held 6, at level ehd 2, at level ehd:fine 2,
        at level roller 3
    tolerance : adaptive steps: step_deg is divided until the error of a step is below this, e.g. 1e-4
    """
    return call("bearing-loads", locals())
