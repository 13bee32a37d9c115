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
    variants : names of the kinds of files, and the tables that only files of one kind have
    """

    own: ModuleType
    settings: type[Settings]
    make: Callable[[dict[str, Any], Engine, str, str], Settings]
    like: str
    about: Mapping[str, str]
    further: Mapping[str, Any] = field(default_factory=dict)
    variants: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @cached_property
    def places(self) -> dict[str, str]:
        """Settings and other values by their location ``table.key``."""
        found = {place: entry.name for entry in fields(self.settings) for place in entry.metadata.get("files", ())}
        return found | {place: place for place in self.further}

    @cached_property
    def tables(self) -> dict[str, type]:
        """Dataclasses of the TOML tables of a module file, by name."""
        known = {"q": quantities, "own": self.own}
        hints = get_type_hints(self.settings, localns=known, include_extras=True) | dict(self.further)
        usual = {place: value for entry in fields(self.settings)
                 for place, value in entry.metadata.get("files", {}).items()}  # fmt: skip
        found = {}
        for table, about in self.about.items():
            keys: list[Any] = []
            for place, name in self.places.items():
                if place.partition(".")[0] == table:
                    keys.append((place.partition(".")[2], hints[name], field(default=usual.get(place, MISSING))))
            space = {"__doc__": about, "__module__": self.own.__name__}
            found[table] = make_dataclass(table.title(), keys, namespace=space, frozen=True, kw_only=True)
        return found

    @cached_property
    def document(self) -> Any:
        """Struct type of the document of a module file, see :mod:`cranktrain.engine.entries`."""
        keys: list[Any] = [("module", str), *TEXT_KINDS.items(), ("engine", str)]
        some = {name for tables in self.variants.values() for name in tables}
        for name, kind in self.tables.items():
            optional = name in some or all(entry.default is not MISSING for entry in fields(kind))
            keys.append((name, stated(kind, self.like) | None, None) if optional else (name, stated(kind, self.like)))
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
        self._check_tables(read, path.name)
        found = {name: part_of(kind, getattr(read, name), f"{path.name}: {name}")
                 for name, kind in self.tables.items() if getattr(read, name) is not None}  # fmt: skip
        engine = load_engine(beside(path, read.engine) if ending(read.engine) == ".toml" else read.engine)
        try:
            for name, table in found.items():
                check_values(table, name)
            values = {}
            for place, name in self.places.items():
                table, _, key = place.partition(".")
                if table in found:
                    values[name] = getattr(found[table], key)
            return self.make(values, engine, read.name, read.title)
        except InputError as error:
            raise InputError(f"{path.name}: {error}") from None

    def _check_tables(self, read: Any, name: str) -> None:
        """Refuse a file without all tables of one kind, or with tables of two kinds; ``InputError``."""
        given = {kind: [one for one in tables if getattr(read, one) is not None]
                 for kind, tables in self.variants.items()}  # fmt: skip
        kinds = [kind for kind, tables in given.items() if tables]
        rule = "; ".join(f"{kind} has {' and '.join(f'[{one}]' for one in tables)}"
                         for kind, tables in self.variants.items())  # fmt: skip
        if len(kinds) > 1:
            first, second = (given[kind][0] for kind in kinds[:2])
            raise InputError(f"{name}: [{first}] and [{second}] do not belong to one engine: {rule}")
        if self.variants and not kinds:
            raise InputError(f"{name}: tables are missing: {rule}")
        for kind in kinds:
            missing = [one for one in self.variants[kind] if one not in given[kind]]
            if missing:
                raise InputError(f"{name}: table '{missing[0]}' is missing; add it as in {self.like}")

    def contents(self, path: Path) -> Contents:
        """Contents of the FMU for a module file."""
        settings = self.load(path)
        starts = {entry.name: getattr(settings, entry.name) for entry in fields(settings)}
        counts = {"cylinders": len(settings.firing_angles)}
        return Contents(
            settings.name, settings.title, counts, starts, to_bytes(settings), getattr(settings, "variant", "")
        )
