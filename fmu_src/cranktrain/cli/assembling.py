"""Functions of the library: names of the shipped engines, and the assembly of a checked engine."""

from pathlib import Path

from cranktrain.core.errors import InputError, shown
from cranktrain.core.types import Progress
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import engine_names, load_engine
from cranktrain.engine.model import Engine
from cranktrain.fmu.native.first_use import made_at_first_use
from cranktrain.store.waits import waits
from cranktrain.structure import assembly


def engines() -> dict[str, str]:
    """Names of the engines that ship with the package, each with its title."""
    return {name: load_engine(name).title for name in engine_names()}


def assemble(
    engine: str | Path | Engine,
    settings: Settings,
    *,
    say: Progress | None = None,
    crank_mesh: str | Path | None = None,
    block_mesh: str | Path | None = None,
    table_resolution: str = "default",
    cutoff_hz: float | None = None,
    inherit: bool = True,
) -> assembly.Assembly:
    """Check an engine like an engine file, and make the bodies and parts for runs with these settings.

    Keywords and errors are those of :func:`cranktrain.structure.assembly.assemble`. Without ``say``, a step that takes
    more than a second is printed on stderr.
    """
    if not isinstance(settings, Settings):
        raise InputError(f"assemble: settings are {shown(settings)}; give ct.Settings(crank=...)")
    found = load_engine(engine)
    with waits(found.name) as told, made_at_first_use():
        return assembly.assemble(
            found, settings, say=say or told.tell, crank_mesh=crank_mesh, block_mesh=block_mesh,
            table_resolution=table_resolution, cutoff_hz=cutoff_hz, inherit=inherit,
        )  # fmt: skip
