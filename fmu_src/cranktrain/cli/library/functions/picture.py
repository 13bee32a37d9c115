"""Function of the verb ``picture``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.results.views.found import VerbResult


# In one piece: every option of the verb, by keyword.
@of_verb
def picture(
    engine: str | Path | Engine, *, mesh: str | Path | None = None, mesh_unit: Literal["m", "mm", "in"] = "m",
    mode: str | None = None, free: bool = False, speed_rpm: float | None = None, angle_deg: float = 0.0,
    enlarge: float | None = None, output: str | Path | None = None,
    bearings: Literal["auto", "held", "linear", "impedance", "table", "reynolds", "ehd", "ehd:fine", "roller"] = "auto",
    big_ends: Literal["rigid", "impedance", "table", "ehd", "ehd:fine"] = "rigid",
    block: Literal["auto", "ground", "flexible"] = "auto", block_mesh: str | Path | None = None,
    pistons: Literal["auto", "rigid", "guided"] = "auto", damper: bool = False, load: float = 1.0,
    settle: float = 0.001,
) -> VerbResult:  # fmt: skip
    """The crankshaft in three dimensions, in a mode or as it runs: picture (PNG), animation (GIF, MP4) or page (HTML).

    See ``cranktrain picture --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    engine : name of a shipped engine (diesel_i6) or path of a .toml file
    mesh : own mesh (.msh, .inp, .unv, .bdf) with named journal surfaces; for --crank torsional also a table of discs
        and shafts (.csv, .toml): pulley, flywheel and pin[1] …, or main[1] … between which the pins turn; or own
        reduced crankshaft in place of a mesh: .h5, .npz or folder of reduce output, or a superelement of another
        program (.toml)
    mesh_unit : unit of own meshes: m, mm, in (default m)
    mode : number as 'modal' lists them, or first of a kind: bending, torsional, axial (default torsional)
    free : a mode of the free crankshaft; default the cranktrain at rest
    speed_rpm : the running crank at this speed, rev/min
    angle_deg : crank angle of a still of the running crank, to 10 degrees (default 0)
    enlarge : enlargement of the motion (default: the largest is 3 % of the length)
    output : picture, ending in .png, .gif, .mp4 or .html (default ENGINE_WHAT.png)
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
    """
    return call("picture", locals())
