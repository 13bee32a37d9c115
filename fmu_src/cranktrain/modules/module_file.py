"""Reader of module files: texts, tables of values with units and origins, and the named engine."""

from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, fields, make_dataclass
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import Any, Generic, TypeVar, get_type_hints

from cranktrain.core.errors import InputError
from cranktrain.core.typed_file import record
from cranktrain.core.user_file import beside, ending, read_toml, user_path
from cranktrain.engine import quantities
from cranktrain.engine.entries import part_of, said, stated, table_of
from cranktrain.engine.file import TEXT_KINDS, check_name, check_title, load_engine
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import check_values
from cranktrain.modules.module_settings import to_bytes
from cranktrain.modules.register import Contents

Settings = TypeVar("Settings", bound=Any)


@dataclass(frozen=True)
class ModuleFile(Generic[Settings]):
    """Contents of a module's files: tables with the settings marked by :func:`.module_settings.stated`.

    Attributes
    ----------
    own : module of the quantities that the settings' annotations call ``own``; ``q`` is the engine's module
    settings : class of the module's settings
    make : function that makes and checks the settings from their values, engine, name and title
    like : path of a shipped file as an example
    about : names of the tables, with a description of each
    further : values that are not settings, by ``table.key``, and their quantities
    """

    own: ModuleType
    settings: type[Settings]
    make: Callable[[dict[str, Any], Engine, str, str], Settings]
    like: str
    about: Mapping[str, str]
    further: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def places(self) -> dict[str, str]:
        """Settings and other values by their location ``table.key``."""
        found = {entry.metadata["file"]: entry.name for entry in fields(self.settings) if "file" in entry.metadata}
        return found | {place: place for place in self.further}

    @cached_property
    def tables(self) -> dict[str, type]:
        """Dataclasses of the TOML tables of a module file, by name."""
        known = {"q": quantities, "own": self.own}
        hints = get_type_hints(self.settings, localns=known, include_extras=True) | dict(self.further)
        usual = {entry.name: entry.metadata["default"] for entry in fields(self.settings) if "file" in entry.metadata}
        found = {}
        for table, about in self.about.items():
            keys: list[Any] = []
            for place, name in self.places.items():
                if place.partition(".")[0] == table:
                    keys.append((place.partition(".")[2], hints[name], field(default=usual.get(name, MISSING))))
            space = {"__doc__": about, "__module__": self.own.__name__}
            found[table] = make_dataclass(table.title(), keys, namespace=space, frozen=True, kw_only=True)
        return found

    @cached_property
    def document(self) -> Any:
        """Struct type of the document of a module file, see :mod:`cranktrain.engine.entries`."""
        keys: list[Any] = [("module", str), *TEXT_KINDS.items(), ("engine", str)]
        keys += [(name, stated(kind, self.like)) for name, kind in self.tables.items()]
        return table_of(self.settings.__name__, keys, self.settings.__doc__, self.like)

    def load(self, path: str | Path) -> Settings:
        """Settings from a module file and its engine.

        Raises
        ------
        InputError
            one line with file, table and key, for anything unknown, missing or impossible
        """
        path = user_path(path)
        read = record(self.document, read_toml(path, "module file", f"an example is {self.like}"), path.name, said)
        check_name(read.name, f"{path.name}: name")
        check_title(read.title, f"{path.name}: title")
        found = {name: part_of(kind, getattr(read, name), f"{path.name}: {name}") for name, kind in self.tables.items()}
        engine = load_engine(beside(path, read.engine) if ending(read.engine) == ".toml" else read.engine)
        try:
            for name, table in found.items():
                check_values(table, name)
            values = {}
            for place, name in self.places.items():
                table, _, key = place.partition(".")
                values[name] = getattr(found[table], key)
            return self.make(values, engine, read.name, read.title)
        except InputError as error:
            raise InputError(f"{path.name}: {error}") from None

    def contents(self, path: Path) -> Contents:
        """Contents of the FMU for a module file."""
        settings = self.load(path)
        starts = {entry.name: getattr(settings, entry.name) for entry in fields(settings)}
        counts = {"cylinders": len(settings.firing_angles)}
        return Contents(settings.name, settings.title, counts, starts, to_bytes(settings))
