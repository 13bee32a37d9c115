"""Variants of a study as a result, with tables, percentiles, sensitivities, Pareto front and picture."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.results.figures import save_figure
from cranktrain.results.views.plot_data import for_notebook, html_table, optional
from cranktrain.store.variant_files import NUMBER, REASON, Column, VariantFiles
from cranktrain_lab.variants.results import statistics
from cranktrain_lab.variants.results.figures import shown_unit, variants_figure

MOST_AT_ONCE = 16_000_000
"""Largest number of values in memory at once for percentiles."""
PERCENTILES = (5.0, 50.0, 95.0)


class Variants:
    """Finished variants of a study in the order of their numbers, in SI; outputs of failed variants are NaN.

    ``variants["twist"]`` is the worst value of each variant over the speeds, ``variants["damper.viscosity"]`` a varied
    value; :meth:`curve` has a value for each speed.
    """

    def __init__(self, files: VariantFiles) -> None:
        self._files = files
        self.numbers = files.column(NUMBER).astype(int)

    @classmethod
    def load(cls, folder: str | Path) -> "Variants":
        """Load variants from a folder that ``vary`` wrote, complete or not; raises ``StoreError``."""
        return cls(VariantFiles.open(folder))

    @property
    def folder(self) -> Path:
        """Folder of the Parquet files."""
        return self._files.folder

    @property
    def about(self) -> dict[str, Any]:
        """Facts of the study: engine, method, number, seed."""
        return self._files.about

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the varied values."""
        return self._files.names

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return tuple(column.name for column in self._files.columns)

    @property
    def speeds_rpm(self) -> Array:
        """Speeds (s,), rev/min."""
        return np.asarray(self._files.speeds / RPM)

    @property
    def failed(self) -> dict[int, str]:
        """Numbers of the failed variants, each with the reason of its failure."""
        reasons = self._files.column(REASON)
        return {int(n): str(why) for n, why in zip(self.numbers, reasons, strict=True) if why}

    def __len__(self) -> int:
        return int(self.numbers.size)

    def __getitem__(self, name: str) -> Array:
        """Return a varied value (n,), or an output's worst value over the speeds; ``InputError`` for another name."""
        if name not in (*self.names, *self.outputs):
            raise InputError(f"variants have no '{name}'; {nearest(name, (*self.names, *self.outputs))}")
        return np.asarray(self._files.column(name), dtype=float)

    @property
    def values(self) -> Array:
        """Return the varied values (n, d)."""
        return np.stack([self[name] for name in self.names], axis=1)

    def output(self, name: str) -> Column:
        """Return an output with its unit; raises ``InputError``."""
        found = next((column for column in self._files.columns if column.name == name), None)
        if found is None:
            raise InputError(f"variants have no output '{name}'; {nearest(name, self.outputs)}")
        return found

    def curve(self, name: str) -> Array:
        """Return an output over the speeds, (n, s); raises ``InputError`` for an output with a single value."""
        if not self.output(name).over_speed:
            raise InputError(f"output '{name}' has one value, not one for each speed; take variants['{name}']")
        return self._files.curve(name)

    def percentiles(self, name: str, shares: Sequence[float] = PERCENTILES) -> Array:
        """Return percentiles (p, s) of an output at each speed; memory does not grow with the number of variants."""
        self.output(name)
        count = self._files.speeds.size
        step = max(1, MOST_AT_ONCE // max(len(self), 1))
        parts = [
            np.nanpercentile(self._files.curve(name, first, min(first + step, count)), shares, axis=0)
            for first in range(0, count, step)
        ]
        return np.concatenate(parts, axis=1)

    def sensitivities(self) -> dict[str, list[dict[str, Any]]]:
        """Return by output a record per value: rank coefficient, and Sobol indices for a design ``sensitivity``."""
        values, whole = self.values, self.about["method"] == "sensitivity"
        n, d = int(self.about["n"]), len(self.names)
        whole = whole and len(self) == n * (d + 2)
        found = {}
        for name in self.outputs:
            outputs = self[name]
            records: list[dict[str, Any]] = [{"value": key} for key in self.names]
            if whole:
                indices = statistics.sobol_indices(outputs, n, d)
                for key, column in zip(("first", "total", "first_error", "total_error"), indices[:4], strict=True):
                    for record, one in zip(records, column, strict=True):
                        record[key] = float(one)
            for record, one in zip(records, statistics.rank_coefficients(values, outputs), strict=True):
                record["rank_coefficient"] = float(one)
            found[name] = records
        return found

    def pareto(self, minimize: Sequence[str] = ()) -> Any:
        """Return the Pareto front (pandas ``DataFrame``) for outputs ``minimize``, by default those of ``[pareto]``."""
        names = tuple(minimize) or tuple(self.about["pareto"])
        if len(names) < 2:
            raise InputError(f"a front needs two outputs or more; name them, e.g. pareto({list(self.outputs[:2])})")
        costs = np.stack([self[self.output(name).name] for name in names], axis=1)
        return self.to_dataframe().iloc[statistics.pareto_front(costs)]

    def to_dataframe(self) -> Any:
        """Return a pandas ``DataFrame`` with a row per variant: values, worst outputs, reason of failure."""
        import pandas

        names = (*self.names, *self.outputs)
        return pandas.DataFrame(
            {**{name: self._files.column(name) for name in names}, REASON: self._files.column(REASON)},
            index=pandas.Index(self.numbers, name=NUMBER),
        )

    def to_xarray(self) -> Any:
        """Return an xarray ``Dataset`` over variant and speed, with units."""
        xarray = optional("xarray", "to_xarray")
        units = dict(zip(self._files.names, self._files.units, strict=True))
        data: dict[str, Any] = {name: ((NUMBER,), self[name], {"units": units[name]}) for name in self.names}
        for column in self._files.columns:
            about = {"units": column.unit}
            if column.over_speed:
                data[column.name] = ((NUMBER, "speed"), self.curve(column.name), about)
            else:
                data[column.name] = ((NUMBER,), self[column.name], about)
        data[REASON] = ((NUMBER,), self._files.column(REASON).astype(str), {})
        axes = {NUMBER: self.numbers, "speed": ("speed", self._files.speeds, {"units": "rad/s"})}
        return xarray.Dataset(data, axes, {key: str(value) for key, value in self.about.items()})

    def plot(self, path: str | Path | None = None) -> Any:
        """Draw a figure (matplotlib): percentiles over the speed or distributions, sensitivities, Pareto front."""
        figure = variants_figure(self)
        if path is not None:
            save_figure(figure, path)
        return for_notebook(figure)

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """Rows of a table: output, unit, percentiles of the worst value, most influential value."""
        found, depends = [], self.sensitivities()
        for column in self._files.columns:
            values = self[column.name]
            unit, factor = shown_unit(column.unit)
            good = values[np.isfinite(values)]
            texts = [f"{factor * p:.4g}" for p in np.percentile(good, PERCENTILES)] if good.size else ["-"] * 3
            key = "total" if "total" in depends[column.name][0] else "rank_coefficient"
            order = sorted(
                depends[column.name], key=lambda record: -abs(record[key]) if record[key] == record[key] else 0
            )
            most = ", ".join(f"{record['value']} {record[key]:+.2f}" for record in order[:3])
            found.append((column.name, unit, *texts, most))
        return found

    def __repr__(self) -> str:
        lost = len(self.failed)
        lines = [f"{name}: {low} / {middle} / {high} {unit}" for name, unit, low, middle, high, _ in self.rows]
        head = f"{len(self)} variants of {self.about['engine']}, {self.about['method']}"
        return f"<{head}" + (f", {lost} failed" if lost else "") + "\n " + "\n ".join(lines) + ">"

    def _repr_html_(self) -> str:
        """Return an HTML table for notebooks."""
        header = ("output", "unit", "5 %", "50 %", "95 %", "depends on")
        return html_table(f"{len(self)} variants of {self.about['engine']}", header, self.rows)
