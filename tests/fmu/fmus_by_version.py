"""Native FMUs of both versions of FMI: of engines with the torsional crank alone, and of the six with its modules."""

from __future__ import annotations

from pathlib import Path

import pytest
from fmpy import read_model_description

from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.fmu import archive
from cranktrain.fmu.build import build_fmu
from cranktrain.fmu.engine_fmu import build, engine_interface, with_starts
from cranktrain.fmu.flat import FlatModel
from cranktrain.modules.register import module_files
from cranktrain.structure.assembly import running_crank
from cranktrain_lab.coupling.modules import COMBUSTION, CRANKTRAIN, VALVETRAIN

VERSIONS = ("2.0", "3.0")
MODULES = [name for name in module_files() if name.endswith("_i6")]


def torsional_fmu(name: str, folder: Path, fmi: str = "3.0", clocks: bool = False) -> Path:
    """An engine's FMU with the torsional crank alone; skips where its library cannot be made."""
    engine = load_engine(name)
    model = FlatModel(engine, {"torsional": running_crank(engine, "torsional")})
    interface = with_starts(engine_interface(engine, clocks), {"crank.level": "torsional"})
    try:
        return build(model, folder, interface=interface, platforms=("linux64",), fmi=fmi)
    except InputError as error:
        pytest.skip(str(error))


def check_counts(path: Path) -> None:
    """The table of FMUs in the documentation counts inputs, outputs and parameters of this one."""
    text = (archive.ROOT / "docs" / "fmu.md").read_text("utf-8")
    row = next(line for line in text.splitlines() if line.startswith(f"| `{path.name}`"))
    causes = [v.causality for v in read_model_description(str(path)).modelVariables]
    assert [int(cell) for cell in row.split("|")[3:6]] == [causes.count(k) for k in ("input", "output", "parameter")]


def module_fmu(name: str, folder: Path, fmi: str = "2.0") -> Path:
    """A module's; skips likewise."""
    try:
        return build_fmu(name, folder, platforms=("linux64",), fmi=fmi)
    except InputError as error:
        pytest.skip(str(error))


def six(folder: Path, fmi: str) -> dict[str, Path]:
    """The six by module: cranktrain, combustion, valve train."""
    return {
        CRANKTRAIN: torsional_fmu("diesel_i6", folder, fmi),
        COMBUSTION: module_fmu("combustion_i6", folder, fmi),
        VALVETRAIN: module_fmu("valvetrain_i6", folder, fmi),
    }
