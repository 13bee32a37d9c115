"""A finished run at constant speed, as the library hands it out and the command line writes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cranktrain import __version__
from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.cycle_run import Result
from cranktrain.engine.firing import firing_summary
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import bearing_law
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.results.files import check_target, output_unit, save_run
from cranktrain.results.orders.harmonics import last_cycle, order_spectrum
from cranktrain.results.summary import closing_edges, films_not_resolved, online_films, run_summary


@dataclass(frozen=True, kw_only=True)
class Run(Result):
    """Time series of a run in SI, with its engine: ``run["pulley.torsion"]`` is (n,) over ``run.time``.

    Attributes
    ----------
    engine : the engine
    gas : the pressure trace at full load
    attributes : settings of the run, as in the result file
    """

    engine: Engine
    gas: GasTrace
    attributes: dict[str, str | int | float]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all outputs."""
        return tuple(self.outputs)

    def __getitem__(self, name: str) -> Array:
        """One output over time, (n,) SI; ``InputError`` with the nearest name for one that does not exist."""
        if name not in self.outputs:
            raise InputError(f"output '{name}' does not exist; {nearest(name, self.outputs)}")
        return self.outputs[name]

    def last_cycle(self, name: str) -> tuple[Array, Array]:
        """Crank angle (rad, from 0) and values of one output over the last 720°, both ends included."""
        self[name]
        return super().last_cycle(name)

    def orders(self, name: str, highest: float = 12.0) -> dict[float, float]:
        """Order (0.5, 1, … per revolution) → zero-to-peak amplitude of one output over the last cycle, in its unit."""
        orders, amplitudes = order_spectrum(last_cycle(self.angle, self[name]), highest)
        return dict(zip(orders.tolist(), amplitudes.tolist(), strict=True))

    def plot(self, name: str = "pulley.torsion", path: str | Path | None = None) -> Any:
        """Figure (matplotlib) of one output over the last cycle and of its orders; also written to ``path``.

        Raises ``InputError`` for an output that does not exist, and for a file that is no picture of ours.
        """
        from matplotlib.figure import Figure

        from cranktrain.results.figures import save_figure
        from cranktrain.results.plots import plot_cycle, plot_orders

        cycle, unit = last_cycle(self.angle, self[name]), output_unit(name)
        figure = Figure(figsize=(8.0, 6.0), dpi=120, layout="constrained")
        above, below = figure.subplots(2, 1)
        plot_cycle(above, cycle, name, unit)
        plot_orders(below, *order_spectrum(cycle, 12.0), name, unit)
        if path is not None:
            save_figure(figure, path)
        return figure

    def to_xarray(self) -> Any:
        """All outputs as an xarray ``Dataset`` over time, with units; ``InputError`` where xarray is not installed."""
        try:
            import xarray
        except ImportError:
            raise InputError("to_xarray needs xarray; pip install xarray, or cranktrain[xarray]") from None
        variables = {name: ("time", values, {"units": output_unit(name)}) for name, values in self.outputs.items()}
        coordinates = {"time": ("time", self.time, {"units": "s"}), "angle": ("time", self.angle, {"units": "rad"})}
        return xarray.Dataset(variables, coordinates, {"engine": self.engine.name, **self.attributes})

    def summary(self, path: str | Path | None = None) -> dict[str, Any]:
        """The last cycle in a few numbers; keys carry their unit. ``path`` is that of the result file."""
        found = run_summary(self, str(path or ""))
        found["film_temperature"] = {"source": self.attributes["film_temperature"], "passes": self.passes}
        found["firing"] = firing_summary(self.engine)
        found["gas"] = {
            "source": self.gas.source,
            "peak_mpa": 1e-6 * self.gas.peak,
            "imep_mpa": 1e-6 * self.gas.imep,
        }
        if bearing_law(str(self.attributes["bearings"])).tilt and self.engine.main_bearing is not None:
            found["closing_edges"] = closing_edges(found["bearings"])
        if self.attributes["bearings"] == "table":
            found["online_films"] = online_films(self.angle, self.outputs)
        if self.film_peaks is not None:
            found["films_not_resolved"] = films_not_resolved(self.film_peaks)
        return found

    def save(self, path: str | Path) -> Path:
        """Write all outputs to an HDF5 file; ``InputError`` for a place that a result must not take."""
        target = Path(path)
        check_target(target)
        return save_run(target, self, self.file_attributes)

    @property
    def file_attributes(self) -> dict[str, str | int | float]:
        """All attributes of the run in a result file."""
        ended = "finished" if self.complete else "interrupted"
        return {**file_attributes(self.engine, self.gas, self.attributes), "ended": ended}


def file_attributes(
    engine: Engine, gas: GasTrace, attributes: Mapping[str, str | int | float]
) -> dict[str, str | int | float]:
    """Settings of a run, with engine, pressure trace and version: known before the run ends."""
    return {"engine": engine.name, **attributes, "gas": gas.source, "version": __version__}
