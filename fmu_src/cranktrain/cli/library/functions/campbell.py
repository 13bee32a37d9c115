"""Function of the verb ``campbell``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.results.views.over_speed import Campbell


# In one piece: every option of the verb, by keyword.
@of_verb
def campbell(
    engine: str | Path | Engine, *, mesh: str | Path | None = None, mesh_unit: Literal["m", "mm", "in"] = "m",
    from_rpm: float | None = None, to_rpm: float | None = None, step_rpm: float | None = None,
    crank: Literal["rigid", "torsional", "beam", "solid"] = "solid", damper: bool = False,
    highest_hz: float | None = None, orders: str | Sequence[float] = (), drive_line: str | Path | None = None,
    output: str | Path | None = None,
) -> Campbell:  # fmt: skip
    """Campbell diagram: frequencies of the cranktrain at rest over the speed, modes followed through crossings.

    See ``cranktrain campbell --help`` for more. Raises ``InputError`` for what cannot be used, ``SolverError`` for a
    computation that fails.

    Parameters
    ----------
    engine : name of a shipped engine (diesel_i6) or path of a .toml file
    mesh : own mesh (.msh, .inp, .unv, .bdf) with named journal surfaces; for crank torsional also a table of discs and
        shafts (.csv, .toml): pulley, flywheel and pin[1] …, or main[1] … between which the pins turn; or own reduced
        crankshaft in place of a mesh: .h5, .npz or folder of reduce output, or a superelement of another program
        (.toml)
    mesh_unit : unit of own meshes: m, mm, in (default m)
    from_rpm : first speed, rev/min (default: the engine's lowest)
    to_rpm : last speed, rev/min (default: a quarter above the engine's highest)
    step_rpm : distance between speeds, rev/min (default: 21 speeds)
    crank : rigid; torsional; beam; solid; default solid
    damper : with the engine's torsional damper on the pulley
    highest_hz : modes up to this frequency (default: 1000, or the first torsional one)
    orders : orders whose crossings are listed and drawn, e.g. 3,6 (default: those that excite torsion)
    drive_line : discs and shafts (TOML or CSV) from 'flywheel' to 'dynamometer' in place of the connecting shaft
    output : picture of the diagram, ending in .png or .svg
    """
    return call("campbell", locals())
