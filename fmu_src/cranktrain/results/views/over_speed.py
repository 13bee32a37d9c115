"""Run-ups and natural frequencies over speed, with methods for users of the library."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.core.units import RPM, UNITS
from cranktrain.dynamics.outputs.register import nearest_output
from cranktrain.results.figures import save_figure
from cranktrain.results.files import output_unit
from cranktrain.results.orders.modes_over_speed import ModesOverSpeed
from cranktrain.results.run_up.figures import order_figure
from cranktrain.results.run_up.plot_data import Beside, figure_of, quantity_of
from cranktrain.results.run_up.plots import plot_campbell
from cranktrain.results.run_up.run_up import TORSION, RunUp
from cranktrain.results.views.plot_data import Series, for_notebook, html_table, interactive_lines, optional

STRONGEST = 6
"""Number of orders that an interactive picture shows by default."""


@dataclass(frozen=True, repr=False)
class OrdersOverSpeed(RunUp):
    """A run-up: ``run_up["pulley.torsion", 6]`` is the amplitude of order 6, (s,) over ``speeds_rpm``.

    Attributes
    ----------
    report : report of verb ``runup`` (resonances, firing, settling); empty for a run-up read from a file
    """

    report: Mapping[str, Any] = field(default_factory=dict, compare=False)

    @classmethod
    def of(cls, run_up: RunUp, report: Mapping[str, Any] | None = None) -> "OrdersOverSpeed":
        """Make the object from a run-up and its report."""
        return cls(**{own.name: getattr(run_up, own.name) for own in fields(RunUp)}, report=report or {})

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all outputs."""
        return tuple(self.amplitudes)

    def __getitem__(self, place: str | tuple[str, float]) -> Series:
        """Zero-to-peak amplitudes of an output for all orders, (s, o), or for one, (s,); SI, with unit."""
        name, order = place if isinstance(place, tuple) else (place, None)
        if name not in self.amplitudes:
            raise InputError(f"output '{name}' is not in this run-up; {nearest_output(str(name), self.amplitudes)}")
        found = self.amplitudes[name] if order is None else self.order(order, name)
        return Series(np.abs(found), output_unit(name), name)

    def to_dataframe(self, name: str = TORSION) -> Any:
        """Pandas ``DataFrame`` of an output's amplitudes, speeds (rev/min) by orders; the unit is ``attrs["unit"]``."""
        import pandas

        index = pandas.Index(self.speeds_rpm, name="speed_rpm")
        frame = pandas.DataFrame(np.asarray(self[name]), index, pandas.Index(self.orders, name="order"))
        frame.attrs.update(output=name, unit=output_unit(name), engine=self._engine_name)
        return frame

    def to_xarray(self) -> Any:
        """Complex amplitudes of all outputs as an xarray ``Dataset`` over speed and order, with units."""
        xarray = optional("xarray", "to_xarray")
        axes = ("speed_rpm", "order")
        variables = {name: (axes, found, {"units": output_unit(name)}) for name, found in self.amplitudes.items()}
        coordinates = {"speed_rpm": ("speed_rpm", self.speeds_rpm, {"units": "rev/min"}), "order": self.orders}
        return xarray.Dataset(variables, coordinates, dict(self.attributes))

    def plot(self, name: str = TORSION, orders: Sequence[float] = (), path: str | Path | None = None) -> Any:
        """Figure (matplotlib) of the given or the strongest orders over speed, also written to ``path`` if given."""
        self[name]
        for order in orders:
            self.order(order, name)
        figure = order_figure(self, quantity_of(name), Beside(orders=tuple(orders)), self._engine_name)
        if path is not None:
            save_figure(figure, path)
        return for_notebook(figure)

    def iplot(self, name: str = TORSION, orders: Sequence[float] = ()) -> Any:
        """Bokeh figure of orders over speed; ``InputError`` if Bokeh is not installed."""
        found, unit = self[name], output_unit(name)
        if unit == "rad":
            found, unit = found.to("deg"), "deg"
        strongest = self.orders[np.argsort(-np.nan_to_num(np.asarray(found)).max(axis=0))[:STRONGEST]]
        lines = {}
        for order in orders or sorted(strongest.tolist()):
            self.order(order, name)
            lines[f"order {order:g}"] = np.asarray(found)[:, int(np.argmin(np.abs(self.orders - order)))]
        return interactive_lines(self.speeds_rpm, lines, "engine speed / rev/min", f"{name} / {unit}", self.title)

    @property
    def title(self) -> str:
        """Title with engine, speeds and crank level."""
        ends = f"{self.speeds_rpm[0]:.5g} to {self.speeds_rpm[-1]:.5g} rev/min" if self.speeds.size else "no speeds"
        return f"{self._engine_name}, {ends}, crank {self.attributes.get('crank')}"

    @property
    def _engine_name(self) -> str:
        return str(self.attributes.get("engine", "engine"))

    def _peaks(self) -> list[tuple[str, str, str]]:
        """Texts of order, size and speed of the largest amplitudes of the pulley's torsion, or of the first output."""
        name = TORSION if TORSION in self.amplitudes else next(iter(self.amplitudes), "")
        if not name or not self.speeds.size:
            return []
        sizes, unit = np.nan_to_num(np.asarray(self[name])), output_unit(name)
        shown = UNITS["angle"]["deg"] if unit == "rad" else 1.0
        unit = "deg" if unit == "rad" else unit
        peaks = []
        for k in np.argsort(-sizes.max(axis=0))[:3]:
            at = int(sizes[:, k].argmax())
            peaks.append((f"{self.orders[k]:g}", f"{sizes[at, k] / shown:.3g} {unit}", f"{self.speeds_rpm[at]:.5g}"))
        return peaks

    def __repr__(self) -> str:
        peaks = "; ".join(f"order {order} {size} at {rpm} rev/min" for order, size, rpm in self._peaks())
        return (
            f"<{type(self).__name__}: {self.title}\n {self.speeds.size} speeds, {self.orders.size} orders of "
            f"{', '.join(self.names[:4])}{', …' if len(self.names) > 4 else ''}\n largest: {peaks}\n"
            " speeds_rpm, ['pulley.torsion', 6].to('deg'), report, plot(), iplot(), to_dataframe(), to_xarray()>"
        )

    def _repr_html_(self) -> str:
        """HTML table of the largest amplitudes for a notebook."""
        return html_table(self.title, ("order", "largest amplitude", "at rev/min"), self._peaks())


class Campbell(ModesOverSpeed):
    """Modes over speed with the rays of orders, result of ``ct.campbell``."""

    __slots__ = ()

    @property
    def speeds_rpm(self) -> Array:
        """Speeds (s,), rev/min."""
        return np.asarray(self.speeds / RPM)

    def to_dataframe(self) -> Any:
        """Pandas ``DataFrame`` of frequencies (Hz), speeds (rev/min) by modes."""
        import pandas

        frame = pandas.DataFrame(self.hz, pandas.Index(self.speeds_rpm, name="speed_rpm"), list(self.names))
        frame.attrs["unit"] = "Hz"
        return frame

    def to_xarray(self) -> Any:
        """Frequencies (Hz) as an xarray ``DataArray`` over speed and mode."""
        xarray = optional("xarray", "to_xarray")
        coordinates = {"speed_rpm": self.speeds_rpm, "mode": list(self.names), "kind": ("mode", list(self.kinds))}
        return xarray.DataArray(self.hz, coordinates, ("speed_rpm", "mode"), "frequency", {"units": "Hz"})

    def plot(
        self, orders: Sequence[float] = (1.0, 2.0, 4.0, 6.0), path: str | Path | None = None, name: str = ""
    ) -> Any:
        """Figure (matplotlib) of frequencies over speed with rays of orders, also written to ``path`` if given.

        ``name`` is the name of the engine for the title.
        """
        figure = figure_of(11.5, 7.5)
        highest = 1.1 * float(self.hz.max()) if self.hz.size else 100.0
        plot_campbell(figure.subplots(), self, tuple(orders), highest)
        figure.suptitle(
            f"Campbell diagram{f' of {name}' if name else ''}, modes at rest on stand-in springs", fontsize=12,
            parse_math=False,
        )  # fmt: skip
        if path is not None:
            save_figure(figure, path)
        return for_notebook(figure)

    def iplot(self, orders: Sequence[float] = (1.0, 2.0, 4.0, 6.0)) -> Any:
        """Bokeh figure of frequencies over speed with rays of orders."""
        lines = {name: self.hz[:, k] for k, name in enumerate(self.names)}
        lines |= {f"order {order:g}": order * self.speeds_rpm / 60.0 for order in orders}
        return interactive_lines(
            self.speeds_rpm, lines, "engine speed / rev/min", "frequency / Hz", "Campbell diagram, modes at rest"
        )

    def __repr__(self) -> str:
        named = ", ".join(f"{name} {hz:.4g} Hz" for name, hz in zip(self.names[:6], self.hz[0, :6], strict=True))
        return (
            f"<Campbell: {self.speeds_rpm[0]:.5g} to {self.speeds_rpm[-1]:.5g} rev/min, {len(self.names)} modes\n"
            f" {named}{', …' if len(self.names) > 6 else ''}\n"
            " speeds_rpm, hz, names, crossings([6]), plot(), iplot(), to_dataframe(), to_xarray()>"
        )

    def _repr_html_(self) -> str:
        """HTML table of each mode at the first and at the last speed for a notebook."""
        rows = [(name, *(f"{self.hz[at, k]:.5g}" for at in (0, -1))) for k, name in enumerate(self.names)]
        ends = (f"Hz at {self.speeds_rpm[at]:.5g} rev/min" for at in (0, -1))
        return html_table("Modes at rest over speed", ("mode", *ends), rows)
