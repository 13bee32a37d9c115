"""The engines that ship, for the library."""

from __future__ import annotations

from cranktrain.engine.file import engine_names, load_engine


def engines() -> dict[str, str]:
    """Names of the engines that ship with the package, each with its title."""
    return {name: load_engine(name).title for name in engine_names()}
