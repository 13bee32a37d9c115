"""Result of ``cranktrain noise``: recorded modal velocities, panels, their levels; and its file."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError, StoreError, nearest
from cranktrain.core.types import Array
from cranktrain.store.hdf5 import kind_of, opened, read_data, write_data
from cranktrain_lab.noise.radiation import (
    DENSITY,
    POWER_REFERENCE,
    SPEED,
    Bands,
    a_weighting,
    level,
    plate_efficiency,
    third_octaves,
)  # fmt: skip
from cranktrain_lab.noise.recording import Recorded

FORMAT, SCHEMA = "cranktrain noise", 1
NOISE = kind_of(FORMAT)
REMEDY = "run 'cranktrain noise ENGINE' again"
MEASURED, STEPS = ("esdirk4", "esdirk47"), 4.0
"""Integrators whose error of a band's level was measured (``benchmarks/noise_steps.py``), and from how many steps in a
period of the band's upper edge on it is below :data:`DOUBTFUL`."""
DOUBTFUL = 3.0
"""Error of a band's level by the step, dB, above which a result marks the band."""
_PANELS = {
    "area": "m^2", "sides": "m", "critical": "Hz", "products": "m^2/kg", "points": "m", "triangles": "1",
    "normal": "1/kg^0.5",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Panels:
    """Panels of a surface and their motion in the m modes of a running block.

    Attributes
    ----------
    names : (k,)
    area, sides, critical : (k,) m², (k, 2) m and (k,) critical frequency, Hz
    products : (k, m, m) ∫ (n·φ_i)(n·φ_j) dA, m²/kg
    points, triangles : (p, 3) m and (t, 3) surface for maps; points at sharp edges occur several times
    normal : (m, p) motion of the points along their outward normal, 1/kg^0.5
    """

    names: tuple[str, ...]
    area: Array
    sides: Array
    critical: Array
    products: Array
    points: Array
    triangles: NDArray[np.int32]
    normal: NDArray[np.floating]

    def chosen(self, name: str | None) -> NDArray[np.intp]:
        """Rows of a panel, or of all panels; ``InputError`` for an unknown name."""
        if name is None:
            return np.arange(len(self.names))
        if name not in self.names:
            raise InputError(f"no panel is named '{name}'; {nearest(name, self.names)}")
        return np.array([self.names.index(name)])

    def efficiency(self, frequency: Array, assumption: str) -> Array:
        """Radiation efficiency (k, l) at frequencies (l,), Hz, by an assumption of ``EFFICIENCIES``."""
        if assumption == "one":
            return np.ones((len(self.names), frequency.size))
        pairs = zip(self.critical.tolist(), self.sides.tolist(), strict=True)
        return np.stack([plate_efficiency(frequency, critical, (a, b)) for critical, (a, b) in pairs])


@dataclass(frozen=True, eq=False)
class NoiseResult:
    """Vibration of a block's panels at one or several speeds.

    Attributes
    ----------
    panels : the panels
    runs : recorded motion, by increasing speed
    finer : recorded motion with half the steps, in the order of ``runs``; empty if the step was not checked
    highest : frequency, Hz, up to which the block's modes are kept
    attributes : engine, title and settings of the run
    """

    panels: Panels
    runs: tuple[Recorded, ...]
    highest: float
    finer: tuple[Recorded, ...] = ()
    attributes: dict[str, Any] = field(default_factory=dict)

    def velocity_lines(self, run: Recorded) -> Array:
        """Mean square normal velocity (k, l) of each panel and line, (m/s)²."""
        lines = run.lines
        squares = np.stack([np.einsum("lm,lm->l", lines.conj() @ own, lines).real for own in self.panels.products])
        return np.asarray(0.5 * squares / self.panels.area[:, None])

    def power_lines(self, run: Recorded, assumption: str) -> Array:
        """Sound power (k, l) of each panel and line, W."""
        efficiency = self.panels.efficiency(run.frequency, assumption)
        return DENSITY * SPEED * efficiency * self.panels.area[:, None] * self.velocity_lines(run)

    def bands(self, run: Recorded) -> Bands:
        """Third-octave bands from the first harmonic up to the kept modes and half the sampling rate."""
        return third_octaves(float(run.frequency[0]), min(self.highest, float(run.frequency[-1])))

    def unchecked(self, run: Recorded, bands: Bands) -> NDArray[np.bool_]:
        """True (b,) for bands with fewer than ``STEPS`` steps in a period of their upper edge.

        All bands are unchecked if the run's integrator is not one of ``MEASURED``.
        """
        few = np.asarray(bands.high * STEPS * run.period > len(run.velocity) * (1.0 + 1e-9))
        return few | (self.attributes.get("integrator") not in MEASURED)

    def step_errors(self, number: int, assumption: str) -> Array | None:
        """Largest difference (b,), dB, of a band's level, summed over panels, from that at half the step; or None.

        A band without lines has the error 0.
        """
        if not self.finer:
            return None
        run, finer = self.runs[number], self.finer[number]
        bands = self.bands(run)
        pair = [bands.sums(one.frequency, self.power_lines(one, assumption).sum(axis=0)) for one in (run, finer)]
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(pair[0] + pair[1] > 0.0, np.abs(10.0 * np.log10(pair[0] / pair[1])), 0.0)

    def save(self, path: Path) -> Path:
        """Write the result to an HDF5 file, SI."""
        panels = self.panels
        datasets = {f"panels/{name}": (np.asarray(getattr(panels, name)), unit) for name, unit in _PANELS.items()}
        for kind, runs in (("runs", self.runs), ("finer", self.finer)):
            for k, run in enumerate(runs):
                datasets[f"{kind}/{k:04d}"] = (run.velocity, "kg^0.5 m/s")
        for name in ("speed_rpm", "period", "steady"):
            unit = {"speed_rpm": "rev/min", "period": "s"}.get(name, "1")
            datasets[name] = (np.array([float(getattr(run, name)) for run in self.runs]), unit)
        attributes = {**self.attributes, "panels": "\n".join(panels.names), "highest": self.highest}
        return write_data(path, {"format": FORMAT, "schema": SCHEMA}, "run", datasets, attributes, NOISE)

    @classmethod
    def load(cls, path: str | Path) -> "NoiseResult":
        """Read a result; ``StoreError`` if it is missing, damaged or of another kind."""
        with opened(path, FORMAT, SCHEMA, REMEDY) as file:
            data, attributes = read_data(file, "run")
        try:
            panels = Panels(
                tuple(str(attributes.pop("panels")).split("\n")),
                **{name: data[f"panels/{name}"][0] for name in _PANELS},
            )
            rows = list(zip(*(data[name][0].tolist() for name in ("speed_rpm", "period", "steady")), strict=True))

            def runs(kind: str) -> tuple[Recorded, ...]:
                found = sorted(name for name in data if name.startswith(f"{kind}/"))
                return tuple(
                    Recorded(rpm, period, data[name][0], bool(steady))
                    for name, (rpm, period, steady) in zip(found, rows, strict=bool(found))
                )

            made = cls(panels, runs("runs"), float(attributes.pop("highest")), runs("finer"), attributes)
            count = panels.normal.shape[0]
            sound = panels.products.shape == (len(panels.names), count, count) and bool(made.runs)
            if not sound or any(run.velocity.shape[1:] != (count,) for run in (*made.runs, *made.finer)):
                raise ValueError("sizes of arrays differ")
            return made
        except (KeyError, ValueError, TypeError):
            raise StoreError(f"{path}: damaged or incomplete; {REMEDY}") from None


def levels(result: NoiseResult, number: int, assumption: str) -> dict[str, Any]:
    """Levels of one run: total, third-octave bands, panels; numbers for ``--json``, None for silence."""
    run, panels = result.runs[number], result.panels
    bands, frequency = result.bands(run), run.frequency
    inside = (frequency >= bands.low[0]) & (frequency < bands.high[-1])
    power, square = result.power_lines(run, assumption), result.velocity_lines(run)
    weighted = power * a_weighting(frequency)
    of_bands = bands.sums(frequency, power)
    errors, open_bands = result.step_errors(number, assumption), result.unchecked(run, bands)

    rows = [
        {
            "hz": float(bands.nominal[b]),
            "sound_power_db": _db(of_bands[:, b].sum()),
            "step_error_db": None if errors is None else round(float(errors[b]), 2),
            "note": _note(None if errors is None else float(errors[b]), bool(open_bands[b])),
        }
        for b in range(bands.nominal.size)
    ]
    of_panels = [
        {
            "panel": name,
            "area_m2": float(panels.area[k]),
            "critical_hz": float(panels.critical[k]),
            "velocity_mm_s": float(1e3 * np.sqrt(square[k, inside].sum())),
            "sound_power_db": _db(power[k, inside].sum()),
            "sound_power_dba": _db(weighted[k, inside].sum()),
            "bands_db": [_db(one) for one in of_bands[k]],
        }
        for k, name in enumerate(panels.names)
    ]
    return {
        "speed_rpm": run.speed_rpm,
        "steady": run.steady,
        "sound_power_db": _db(power[:, inside].sum()),
        "sound_power_dba": _db(weighted[:, inside].sum()),
        "bands": rows,
        "panels": sorted(of_panels, key=lambda row: -(row["sound_power_dba"] or 0.0)),
    }


def _db(power: float) -> float | None:
    """Level of a sound power, dB to two decimals; None for silence."""
    return round(float(level(power, POWER_REFERENCE)), 2) if power > 0.0 else None


def _note(error: float | None, unchecked: bool) -> str:
    """Word on the error of a band by the step; empty if the error is below ``DOUBTFUL`` or known to be."""
    if error is not None:
        return f"step {error:.1f} dB off" if error > DOUBTFUL else ""
    return "step not checked" if unchecked else ""
