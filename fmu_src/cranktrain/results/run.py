"""Finished run at constant speed, returned by the library and written by the command line."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cranktrain import __version__
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.cycle_run import Result
from cranktrain.engine.firing import firing_summary
from cranktrain.engine.model import Engine
from cranktrain.film.laws.pressure_peak import PEAK
from cranktrain.film.laws.register import bearing_law
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.results.files import check_target, save_run
from cranktrain.results.free_forces import free_forces
from cranktrain.results.summary import closing_edges, films_not_resolved, grid_errors, online_films, run_summary
from cranktrain.results.views.time_series import TimeSeries


@dataclass(frozen=True, kw_only=True, repr=False)
class Run(TimeSeries, Result):
    """Time series of a run in SI, with its engine: ``run["pulley.torsion"]`` is (n,) over ``run.time``.

    Attributes
    ----------
    engine : the engine
    gas : the pressure trace at full load
    attributes : settings of the run, as in the result file
    steady_orders : orders of the steady state in the frequency domain as [order, deg], if requested
    level_error : total error of the levels (:mod:`cranktrain.studies.planning.level_error`), if requested
    """

    engine: Engine
    gas: GasTrace
    attributes: dict[str, str | int | float]
    steady_orders: list[list[float]] | None = None
    level_error: dict[str, Any] | None = None

    @property
    def _engine_name(self) -> str:
        return self.engine.name

    def last_cycle(self, name: str) -> tuple[Array, Array]:
        """Crank angle (rad, from 0) and values of one output over the last 720°, both ends included."""
        self[name]
        return super().last_cycle(name)

    def __repr__(self) -> str:
        """Short text of the run: text of its time series, and a line on whether it settled."""
        head, rest = TimeSeries.__repr__(self).split("\n", 1)
        return f"{head}\n {self.settling.text}\n{rest}"

    def summary(self, path: str | Path | None = None) -> dict[str, Any]:
        """Summary of the last cycle; keys carry their unit. ``path`` is the path of the result file."""
        found = run_summary(self, str(path or ""))
        found["film_temperature"] = {"source": self.attributes["film_temperature"], "passes": self.passes}
        found["firing"] = firing_summary(self.engine)
        found["free_forces"] = self.free_forces
        if self.level_error is not None:
            found["level_error"] = self.level_error
        found["gas"] = {
            "source": self.gas.source,
            "peak_mpa": 1e-6 * self.gas.peak,
            "imep_mpa": 1e-6 * self.gas.imep,
        }
        law = bearing_law(str(self.attributes["bearings"]))
        if law.tilt and self.engine.main_bearing is not None:
            found["closing_edges"] = closing_edges([found["bearings"][i] for i in self.engine.plain_numbers])
        if self.attributes["bearings"] == "table":
            found["online_films"] = online_films(self.angle, self.outputs)
        if self.steady_orders is not None:
            found["pulley"]["steady_torsion_deg"] = {"orders": self.steady_orders}
        if self.film_peaks is not None:
            found["films_not_resolved"] = films_not_resolved(self.film_peaks)
            rows, peaks = found["bearings"], self.film_peaks[:, PEAK].tolist()
            mains = [(rows[i]["name"], rows[i]["min_film_um"], peaks[i]) for i in self.engine.plain_numbers]
            if errors := grid_errors(self.attributes, mains):
                found["grid_errors"] = errors
        return found

    @property
    def free_forces(self) -> dict[str, Any]:
        """Free forces (N) and moments (N m) of the moving masses by order at the run's speed, for rigid parts."""
        return free_forces(self.engine, float(self.attributes["speed"]))

    def save(self, path: str | Path) -> Path:
        """Write all outputs to an HDF5 file; ``InputError`` for an existing file that is not a result."""
        target = Path(path)
        check_target(target)
        return save_run(target, self, self.file_attributes)

    @property
    def file_attributes(self) -> dict[str, str | int | float]:
        """All attributes of the run for its result file."""
        ended = "finished" if self.complete else "interrupted"
        return {**file_attributes(self.engine, self.gas, self.attributes), "ended": ended}


def file_attributes(
    engine: Engine, gas: GasTrace, attributes: Mapping[str, str | int | float]
) -> dict[str, str | int | float]:
    """Attributes of a result file that are known before the run ends: settings, engine, pressure trace, version."""
    return {"engine": engine.name, **attributes, "gas": gas.source, "version": __version__}
