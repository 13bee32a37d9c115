"""The register of modules, and the module files for engines.

A module file is TOML that names its ``module``, its ``engine`` (the source of the geometry), a ``name`` and a
``title``; its tables belong to the module. ``build_fmu.py`` accepts its name or its path.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.named import Named, resolve
from cranktrain.core.user_file import ending, read_toml, user_path

FOLDER = Path(__file__).parent


class Contents(NamedTuple):
    """Contents of a module file: name, title, sizes of the variable families, start values, data, and kind of file."""

    name: str
    title: str
    counts: Mapping[str, int]
    starts: Mapping[str, Any]
    data: bytes
    variant: str


@dataclass(frozen=True)
class Module:
    """One module of a virtual engine.

    Attributes
    ----------
    name : name in module files, with which their names begin
    title : purpose in one line
    running : Python module with the functions for the FMU's slave, see ``cranktrain_slave.py``
    file : description of its module files, a :class:`.module_file.ModuleFile`
    """

    name: str
    title: str
    running: str
    file: Named

    @property
    def folder(self) -> Path:
        """Folder of the module's interface, documentation and data."""
        return FOLDER / self.running.split(".")[-2]

    def read(self, path: Path) -> Contents:
        """Contents of a module file; ``InputError`` if it cannot be used."""
        made = resolve(self.file).contents(path)
        assert isinstance(made, Contents)
        return made


MODULES = {
    module.name: module
    for module in (
        Module(
            "combustion",
            "cylinder pressures from a single-zone cycle with gas exchange",
            "cranktrain.modules.combustion.running",
            "cranktrain.modules.combustion.file:FILE",
        ),
        Module(
            "valvetrain",
            "valve lifts, cam and drive forces and the camshaft's torque on the crank",
            "cranktrain.modules.valve_train.running",
            "cranktrain.modules.valve_train.file:FILE",
        ),
    )
}


def module_files() -> dict[str, Path]:
    """Module files that ship with the package, by name."""
    return {path.stem: path for row in MODULES.values() for path in sorted((row.folder / "data").glob("*.toml"))}


def shipped_for_engines(module: str) -> dict[str, str]:
    """Names of a module's files that ship with the package, by engine."""
    return {
        str(read_toml(path, "module file", "").get("engine")): name
        for name, path in module_files().items()
        if module_of(path).name == module
    }


def module_beside(module: str, engine: str | Path) -> Path:
    """Path of the module file that belongs to an engine file: ``NAME_module.toml`` beside ``NAME.toml``."""
    return Path(engine).with_name(f"{Path(engine).stem}_{module}.toml")


def module_of_engine(module: str, engine: str, file: str | Path = "") -> str:
    """Module file for an engine: path of the one beside its ``file``, or name of the one that ships for it.

    ``InputError`` if there is neither.
    """
    own = module_beside(module, file) if ending(str(file)) == ".toml" else None
    if own is not None and own.exists():
        return str(own)
    shipped = shipped_for_engines(module)
    if engine not in shipped:
        place = "" if own is None else f", and {own.name} is not beside it"
        maker = " (cranktrain new writes one with an engine)" if module == "combustion" else ""
        raise InputError(
            f"no {module} ships for engine '{engine}', only for {', '.join(shipped)}{place}; build its FMU from a "
            f"module file of your own{maker}, and give its path"
        )
    return shipped[engine]


def module_path(name: str | Path) -> Path | None:
    """Path of a module file from its name or path; None if it is not a module file.

    ``InputError`` for an unknown name that begins like a module's files.
    """
    text = str(name)
    if ending(text) != ".toml":
        known = module_files()
        if text in known:
            return known[text]
        if text.partition("_")[0] in MODULES:
            raise InputError(
                f"unknown module '{text}': {nearest(text, known)} (or give the path of a .toml module file)"
            )
        return None
    try:
        return user_path(name) if "module" in read_toml(name, "module file", "") else None
    except InputError:
        return None


def module_of(path: Path) -> Module:
    """Module that a module file names; ``InputError`` if it is unknown."""
    named = read_toml(path, "module file", f"shipped: {', '.join(module_files())}").get("module")
    if not isinstance(named, str) or named not in MODULES:
        raise InputError(f"{path.name}: module: '{named}' is not known; {nearest(str(named), MODULES)}")
    return MODULES[named]
