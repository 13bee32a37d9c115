"""Result of a library function (verb): a dictionary in engineering units with tables and a short display."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Self

from cranktrain.core.errors import InputError, nearest

LINES, LONGEST = 6, 72
"""Largest number of lines of a result's display, and largest number of characters of a value in it."""


class VerbResult(dict[str, Any]):
    """Result of a verb, with the content that ``--json`` prints. Keys carry their unit.

    ``verb`` is the verb's name, ``beside`` holds the objects that the content describes, such as the engine.
    """

    verb = "cranktrain"
    beside: Mapping[str, Any] = MappingProxyType({})

    @classmethod
    def of(cls, found: Mapping[str, Any], verb: str, **beside: Any) -> Self:
        """Make the result of a verb from its dictionary and the objects that it describes."""
        made = cls(found)
        made.verb, made.beside = verb, beside
        return made

    @property
    def tables(self) -> dict[str, list[dict[str, Any]]]:
        """All lists of records in the result, by their path in it, such as ``cranktrain.modes``.

        Lists inside the records of another list are joined to one table, such as ``speeds.mains``. Its rows begin with
        the numbers and texts of the outer record (``scenarios.name`` if both have a ``name``).
        """
        return dict(_tables(self, ""))

    def to_dataframe(self, table: str = "") -> Any:
        """Pandas ``DataFrame`` of the list of records with this path in :attr:`tables`; by default the first list.

        A column is named by its path in the record, such as ``friction_power_w.all``. Raises ``InputError`` if the
        table does not exist.
        """
        import pandas

        tables = self.tables
        if not tables:
            raise InputError(f"{self.verb}: nothing in it is a table; its keys are {', '.join(self)}")
        if table and table not in tables:
            raise InputError(f"{self.verb}: has no table '{table}'; {nearest(table, tables)}")
        wanted = table or self._main(tables)
        within = {place.rpartition(".")[2] for place in tables if place.rpartition(".")[0] == wanted}
        return pandas.json_normalize([{k: v for k, v in row.items() if k not in within} for row in tables[wanted]])

    def _main(self, tables: Mapping[str, Any]) -> str:
        """Path, within the result, of the table that is shown by default."""
        return next(iter(tables))

    def __repr__(self) -> str:
        lines = [f"{key}: {_short(value)}" for key, value in self.items()]
        more = [f"… and {len(lines) - LINES + 1} keys more"] if len(lines) > LINES else []
        shown = lines if not more else lines[: LINES - 1] + more
        return f"<{self.verb}, " + "\n ".join([f"{len(self)} keys", *shown]) + ">"

    def _repr_html_(self) -> str:
        """HTML table for a notebook."""
        from cranktrain.results.views.plot_data import html_table

        return html_table(self.verb, ("", ""), [(key, _short(value)) for key, value in self.items()])


def _tables(found: Mapping[str, Any], place: str) -> Any:
    for key, value in found.items():
        where = f"{place}.{key}" if place else str(key)
        if _are_records(value):
            yield where, value
            yield from _inner_tables(value, where)
        elif isinstance(value, dict):
            yield from _tables(value, where)


def _are_records(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(one, dict) for one in value)


def _inner_tables(records: list[dict[str, Any]], place: str) -> Any:
    """Tables from lists within records: the lists that all records hold under one key are joined to one table."""
    for key in [key for key, value in records[0].items() if _are_records(value)]:
        if all(_are_records(one.get(key)) for one in records):
            own = place.rpartition(".")[2]
            taken = records[0][key][0]
            heads = [
                {f"{own}.{k}" if k in taken else k: v for k, v in one.items() if not isinstance(v, dict | list)}
                for one in records
            ]
            yield f"{place}.{key}", [head | row for head, one in zip(heads, records, strict=True) for row in one[key]]


def _short(value: Any) -> str:
    """Short text for a value."""
    if isinstance(value, dict):
        text = f"{{{', '.join(map(str, value))}}}"
    elif isinstance(value, list) and len(value) > 3:
        text = f"{len(value)} {'records' if isinstance(value[0], dict) else 'values'}"
    elif isinstance(value, float):
        text = f"{value:.6g}"
    else:
        text = str(value)
    text = " ".join(text.split())
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}…"
