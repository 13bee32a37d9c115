"""Result of ``modal``: natural frequencies with a figure."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cranktrain.core.errors import InputError
from cranktrain.results.figures import save_figure
from cranktrain.results.run_up.plot_data import figure_of
from cranktrain.results.run_up.plots import KIND_COLOURS
from cranktrain.results.views.found import VerbResult
from cranktrain.results.views.plot_data import for_notebook, interactive_lines


class Frequencies(VerbResult):
    """Result of command ``modal``: natural frequencies of the cranktrain."""

    def _main(self, tables: Mapping[str, Any]) -> str:
        return next((name for name in ("cranktrain.modes", "modes") if name in tables), super()._main(tables))

    def plot(self, table: str = "", path: str | Path | None = None) -> Any:
        """Figure (matplotlib) of the frequencies of a table by shape; by default those of the cranktrain."""
        frame = self.to_dataframe(table)
        if "hz" not in frame:
            others = ", ".join(name for name, rows in self.tables.items() if "hz" in rows[0])
            raise InputError(f"modal: table '{table}' has no frequencies; take one of: {others}")
        figure = figure_of(8.0, 5.0)
        ax = figure.subplots()
        kinds = frame["shape"] if "shape" in frame else ["mode"] * len(frame)
        colours = [KIND_COLOURS.get(kind, "#777777") for kind in kinds]
        numbers = range(1, len(frame) + 1)
        ax.vlines(numbers, 0.0, frame["hz"], color=colours, lw=2.0)
        ax.scatter(numbers, frame["hz"], color=colours, zorder=3)
        for number, hz, kind in zip(numbers, frame["hz"], kinds, strict=True):
            ax.annotate(str(kind), (number, hz), xytext=(0, 5), textcoords="offset points", ha="center", fontsize=7)
        ax.set(xlabel="mode", ylabel="frequency / Hz", ylim=(0.0, 1.12 * float(frame["hz"].max())))
        ax.grid(alpha=0.2)
        if path is not None:
            save_figure(figure, path)
        return for_notebook(figure)

    def iplot(self, table: str = "") -> Any:
        """Bokeh figure of the frequencies of a table."""
        frame = self.to_dataframe(table)
        numbers = range(1, len(frame) + 1)
        return interactive_lines(numbers, {"frequency": frame["hz"]}, "mode", "frequency / Hz", "modes")
