"""Native FMUs of the modules, built as a user builds them, and instances of them."""

from __future__ import annotations

import math
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import pytest
from fmpy import read_model_description
from mock_unit import FLAGS, compiler
from raw_unit import Raw

from cranktrain.core.cache import private_folder
from cranktrain.core.errors import InputError
from cranktrain.core.machine_code import code_digest
from cranktrain.engine.file import load_engine
from cranktrain.fmu.build import build_fmu
from cranktrain.fmu.engine_fmu import build
from cranktrain.fmu.flat import FlatModel
from cranktrain.fmu.native.exported import exported_text
from cranktrain.fmu.native.link import SOURCES
from cranktrain.structure.assembly import running_crank

STEP = math.radians(1.0) / (2000.0 * math.pi / 30.0)
"""s, a degree at 2000 rev/min."""
TURNING = {"angle.source": "speed"}
"""A module turns by itself, without a cranktrain that says where the crank is."""


class Unit(NamedTuple):
    """An unpacked FMU, what its description says, and references by name."""

    folder: Path
    about: object
    references: dict[str, int]

    def binary(self, platform="linux64", suffix=".so"):
        return self.folder / "binaries" / platform / f"{self.about.coSimulation.modelIdentifier}{suffix}"

    def texts(self):
        """Texts that it is run with, by reference, where it has such variables."""
        return {self.references[name]: text for name, text in TURNING.items() if name in self.references}

    def outputs(self):
        return [v.valueReference for v in self.about.modelVariables if v.causality == "output"]

    def inputs(self):
        return [v for v in self.about.modelVariables if v.causality == "input"]

    def fresh(self, start=True, **options):
        one = Raw(self.binary(), self.folder / "resources", self.about.guid, **options)
        one.set("String", self.texts())
        return one.start() if start else one


def unpacked(name, folder, platforms=("linux64",), fmi="2.0"):
    """The FMU of a module or engine; skips where its library cannot be made."""
    return opened(built(name, folder, platforms, fmi))


def built(name, folder, platforms=("linux64",), fmi="2.0"):
    """Its file."""
    try:
        return build_fmu(name, folder, platforms=platforms, fmi=fmi)
    except InputError as error:
        pytest.skip(str(error))


def opened(path):
    """An FMU, unpacked beside itself."""
    folder = path.with_suffix("")
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    about = read_model_description(str(folder))
    return Unit(folder, about, {v.name: v.valueReference for v in about.modelVariables})


def engine_fmu(folder, platforms=("linux64",), cranks=("rigid", "solid"), fmi="2.0"):
    """The six's native FMU on a coarse mesh, without block, damper and film tables: crank rigid or solid."""
    engine = load_engine("diesel_i6")
    engine = replace(engine, crankshaft=replace(engine.crankshaft, mesh_size=0.025))
    model = FlatModel(engine, {level: running_crank(engine, level) for level in cranks})
    try:
        return build(model, folder, platforms=platforms, fmi=fmi)
    except InputError as error:
        pytest.skip(str(error))


def watched_library(unit, folder, options):
    """A module's library, its shim compiled with ``options`` of a sanitizer; ``subprocess.CalledProcessError``."""
    kind = {"CombustionI6": "combustion", "ValvetrainI6": "valvetrain"}[unit.about.modelName]
    digest = code_digest(kind)
    programs = private_folder("native", digest, "programs")
    table = folder / "exported.c"
    table.write_text(exported_text([programs / f"{kind}.json"]))
    sources = [*SOURCES.glob("*.c"), table, *programs.glob(f"{kind}-linux64.o")]
    library = folder / "watched.so"
    command = [
        *(str(compiler()), *FLAGS, *options, "-shared", "-fPIC", "-I", str(SOURCES)),
        *(f'-DCT_DIGEST="{digest}"', *map(str, sources), "-o", str(library), "-lm"),
    ]
    subprocess.run(command, check=True)
    return library
