"""Engines whose bodies are made in seconds, and their FMUs, for tests of the FMU.

Crankshafts are coarse, blocks are boxes: these tests are about the FMU, not about its bodies.
"""

import zipfile
from dataclasses import replace
from functools import cache

from box_block import box_block

from cranktrain.engine.file import load_engine
from cranktrain.engine.levels import CRANKS
from cranktrain.fmu import engine_fmu
from cranktrain.fmu.flat import FlatModel
from cranktrain.loads.damper import with_damper_housing
from cranktrain.structure.assembly import running_crank

COARSE = {"diesel_i6": 0.025, "diesel_v8": 0.05}  # m; meshes of seconds


@cache
def coarse(name):
    """An engine on a coarse mesh with all that a run can need but film tables and elastic bores: a ``FlatModel``."""
    engine = load_engine(name)
    engine = replace(engine, crankshaft=replace(engine.crankshaft, mesh_size=COARSE[name]))
    cranks, damped = (
        {level: running_crank(fitted, level) for level in CRANKS} for fitted in (engine, with_damper_housing(engine))
    )
    return FlatModel(engine, cranks, damped, block=box_block(engine))


NATIVE = ("linux64",)
"""Platforms of a native FMU that runs here."""


def built(model, folder, platforms=()):
    """Build the FMU of a ``FlatModel``, a native one for ``platforms``."""
    return engine_fmu.build(model, folder, print, platforms=platforms)


def is_native(fmu):
    """Whether an FMU needs no Python."""
    return "resources/native.bin" in zipfile.ZipFile(fmu).namelist()
