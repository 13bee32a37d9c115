"""Function of the verb ``reduce``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.results.views.found import VerbResult


# In one piece: every option of the verb, by keyword.
@of_verb
def reduce(
    engine: str | Path | Engine, *, mesh: str | Path | None = None, mesh_unit: Literal["m", "mm", "in"] = "m",
    rebuild: bool = False, output: str | Path | None = None, block_output: str | Path | None = None,
    block: Literal["ground", "flexible"] = "ground", block_mesh: str | Path | None = None,
) -> VerbResult:  # fmt: skip
    """Make and check the reduced crankshaft, and block, kept in the cache; write them elsewhere.

    Raises ``InputError`` for what cannot be used, ``SolverError`` for a computation that fails.

    Parameters
    ----------
    engine : name of a shipped engine (diesel_i6) or path of a .toml file
    mesh : own mesh (.msh, .inp, .unv, .bdf) with named journal surfaces; for --crank torsional also a table of discs
        and shafts (.csv, .toml): pulley, flywheel and pin[1] …, or main[1] … between which the pins turn; or own
        reduced crankshaft in place of a mesh: .h5, .npz or folder of reduce output, or a superelement of another
        program (.toml)
    mesh_unit : unit of own meshes: m, mm, in (default m)
    rebuild : compute even where a stored model exists
    output : also write the crankshaft: .h5, .npz, or a folder of Matrix Market files
    block_output : also write the block; needs block flexible
    block : ground; flexible; default ground
    block_mesh : own block (.msh, .inp, .unv, .bdf) with named surfaces; needs block flexible; or own reduced block in
        place of a mesh: .h5, .npz or folder of reduce block_output, or a superelement of another program (.toml)
    """
    return call("reduce", locals())
