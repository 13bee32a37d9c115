"""Outputs of one run over time, with methods for users of the library."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.dynamics.outputs.register import nearest_output
from cranktrain.results.files import output_unit
from cranktrain.results.orders.harmonics import last_cycle, order_spectrum
from cranktrain.results.views.plot_data import Series, for_notebook, html_table, interactive_lines, optional

SHOWN = ("pulley.torsion", "pulley.axial", "flywheel.torsion", "shaft.torque")
"""Outputs shown in a notebook's table."""
HIGHEST = 12.0


class TimeSeries:
    """Mixin of runs and result files for access to outputs: ``run["pulley.torsion"]`` is (n,) over ``run.time``."""

    time: Array
    angle: Array
    outputs: Mapping[str, Array]
    attributes: Mapping[str, str | int | float]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all outputs."""
        return tuple(self.outputs)

    @property
    def title(self) -> str:
        """Title with engine, speed and levels."""
        own = self.attributes
        speed = float(own.get("speed", math.nan)) / RPM
        return f"{self._engine_name}, {speed:.5g} rev/min, crank {own.get('crank')}, bearings {own.get('bearings')}"

    @property
    def _engine_name(self) -> str:
        return str(self.attributes.get("engine", "engine"))

    def __getitem__(self, name: str) -> Series:
        """One output over time, (n,) SI, with unit; ``InputError`` with the nearest name if it does not exist."""
        if name not in self.outputs:
            raise InputError(f"output '{name}' does not exist; {nearest_output(str(name), self.outputs)}")
        return Series(self.outputs[name], output_unit(name), name)

    def orders(self, name: str, highest: float = HIGHEST) -> dict[float, float]:
        """Zero-to-peak amplitudes of one output over the last cycle, in its unit, by order 0.5, 1, … per revolution."""
        orders, amplitudes = order_spectrum(self._cycle(name), highest)
        return dict(zip(orders.tolist(), amplitudes.tolist(), strict=True))

    def plot(self, name: str = "pulley.torsion", path: str | Path | None = None) -> Any:
        """Figure (matplotlib) of one output over the last cycle and its orders; rad shown in deg.

        The figure is also written to ``path`` if given. Raises ``InputError`` for an output that does not exist, and
        for an existing file that is not a picture of this program.
        """
        from cranktrain.results.figures import motion_figure, save_figure

        figure = motion_figure(self._cycle(name), name, output_unit(name), self.title)
        if path is not None:
            save_figure(figure, path)
        return for_notebook(figure)

    def iplot(self, *names: str) -> Any:
        """Bokeh figure over the crank angle of outputs with the same unit; ``InputError`` if Bokeh is not installed."""
        chosen = {name: self[name] for name in names or ("pulley.torsion",)}
        units = {one.unit: name for name, one in chosen.items()}
        if len(units) > 1:
            raise InputError(f"iplot draws outputs of one unit; {' and '.join(units.values())} have different ones")
        (unit,), label = units, next(iter(chosen)) if len(chosen) == 1 else "outputs"
        if unit == "rad":
            chosen, unit = {name: one.to("deg") for name, one in chosen.items()}, "deg"
        across = np.degrees(self.angle)
        return interactive_lines(across, chosen, "crank angle / deg", f"{label} / {unit or 'no unit'}", self.title)

    def to_dataframe(self, *names: str) -> Any:
        """Pandas ``DataFrame`` over time (s) of all outputs or those named; units are in ``attrs["units"]``."""
        import pandas

        chosen = {name: np.asarray(self[name]) for name in names or self.names}
        frame = pandas.DataFrame({"angle": self.angle, **chosen}, index=pandas.Index(self.time, name="time"))
        units = {"time": "s", "angle": "rad", **{name: output_unit(name) for name in chosen}}
        frame.attrs.update(engine=self._engine_name, units=units)
        return frame

    def to_xarray(self) -> Any:
        """xarray ``Dataset`` of all outputs over time, with units; ``InputError`` if xarray is not installed."""
        xarray = optional("xarray", "to_xarray")
        size = self.time.size
        known = {name: values for name, values in self.outputs.items() if np.shape(values) == (size,)}
        variables = {name: ("time", values, {"units": output_unit(name)}) for name, values in known.items()}
        coordinates = {"time": ("time", self.time, {"units": "s"}), "angle": ("time", self.angle, {"units": "rad"})}
        return xarray.Dataset(variables, coordinates, {"engine": self._engine_name, **self.attributes})

    def _cycle(self, name: str) -> Array:
        """One output over the last cycle at equally spaced crank angles."""
        return last_cycle(self.angle, np.asarray(self[name]))

    def __repr__(self) -> str:
        return (
            f"<{type(self).__name__}: {self.title}\n"
            f" {self.time.size} samples of {len(self.outputs)} outputs over {self.time[-1] - self.time[0]:.3g} s\n"
            " names, ['pulley.torsion'].to('deg'), orders(), plot(), iplot(), to_dataframe(), to_xarray()>"
        )

    def _repr_html_(self) -> str:
        """HTML table of the main outputs over the last cycle for a notebook."""
        rows = []
        for name in [name for name in SHOWN if name in self.outputs] or self.names[:4]:
            cycle = self._cycle(name)
            orders = sorted(self.orders(name).items(), key=lambda one: -one[1])[:3]
            strongest = ", ".join(f"{order:g}: {size:.3g}" for order, size in orders)
            numbers = (f"{value:.4g}" for value in (cycle.min(), cycle.mean(), cycle.max()))
            rows.append((f"{name} / {output_unit(name)}", *numbers, strongest))
        return html_table(self.title, ("output, last cycle", "least", "mean", "largest", "strongest orders"), rows)
