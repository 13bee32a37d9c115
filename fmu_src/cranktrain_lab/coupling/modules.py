"""Units of the virtual engine and an engine's own combustion; reconstructions of pressures between points."""

import warnings
from hashlib import sha256
from pathlib import Path

from cranktrain.core.cache import private_folder
from cranktrain.core.errors import InputError
from cranktrain.core.user_file import ending, user_path
from cranktrain.engine.model import Engine
from cranktrain.modules.register import module_of_engine
from cranktrain.studies.design.combustion_file import aim_of, combustion_text
from cranktrain_lab.coupling.reconstruction import DEGREES

CRANKTRAIN, COMBUSTION, VALVETRAIN = "cranktrain", "combustion", "valvetrain"
OWN = "own"
STAGES = "stages"
"""Scheme and input rule of the cranktrain with inputs set at the stages of its integrator."""
RECONSTRUCTIONS = (OWN, *DEGREES)
"""Reconstructions of pressures: by the cranktrain itself (``OWN``), or by the master with a polynomial."""


def combustion_of(engine: Engine, source: str | Path) -> str:
    """Module file of an engine's combustion: the one beside its file, one that ships, or one made by rules of practice.

    ``source`` is the engine's name or the path of its file, "" for an engine in memory, which gets no file made. The
    made one is kept in the cache, and a warning names it. ``InputError`` if the module cannot compute the engine.
    """
    try:
        return module_of_engine(COMBUSTION, engine.name, source)
    except InputError:
        if not str(source):
            raise
    aim = aim_of(engine)
    reference = user_path(source).resolve().as_posix() if ending(str(source)) == ".toml" else str(source)
    text = combustion_text(engine.name, reference, aim)
    path = private_folder("modules", sha256(text.encode()).hexdigest()[:16]) / f"{engine.name}_combustion.toml"
    path.write_text(text, encoding="utf-8")
    warnings.warn(
        f"no combustion is known for engine '{engine.name}': one by rules of practice for {aim.fuel_name} is taken; "
        f"copy {path} beside the engine file to change it",
        stacklevel=2,
    )
    return str(path)
