"""History of wear of an engine's main bearings by ``cranktrain run-in --hours``, with its file."""

import csv
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import StoreError
from cranktrain.core.reduced_body import Array
from cranktrain.core.units import RPM
from cranktrain.store.hdf5 import WEAR_REMEDY, read_wear, write_wear
from cranktrain.store.whole_file import marked, whole_file
from cranktrain_lab.wear.schedule import HOUR

TABLE = marked("table of a wear history", "cranktrain wear history")
OVER_TIME: dict[str, str] = {
    "time": "s", "speed": "rad/s", "gas_load": "1", "sigma": "m", "volume": "m^3", "contact_work": "J",
    "contact_load": "N", "load": "N", "contact_power": "W", "friction_power": "W", "largest_pressure": "Pa",
    "least_gap": "m", "profile": "m",
}  # fmt: skip
"""Values of each row with their units; values after ``gas_load`` are per bearing."""


@dataclass(frozen=True)
class WearHistory:
    """Wear history of b bearings at s times, in SI units.

    Attributes
    ----------
    bearings : (b,) bearing numbers, from 1
    zeta : (n,) slices over the width, −1 to 1; ``weight`` (n,) are integration weights, m
    time, speed, gas_load : (s,) time (s), speed (rad/s) and fraction of the full-load burn; each row has the wear so
        far, and values of the next cycle with this wear
    sigma : (s, b) roughness, m
    volume : (s, b) worn volume so far, m³
    contact_work : (s, b) ∫∫ p v dA dt so far, J
    contact_load, load : (s, b) loads of the asperities and of the bearing; means over the row's cycle, N
    contact_power, friction_power : (s, b) power of the asperities, and of film and asperities, W
    largest_pressure, least_gap : (s, b) asperity pressure, Pa, and gap between mean planes, m; extremes of the cycle
    profile : (s, b, n) relief of the shells, m
    worn : (b, angles, n) worn depth over the circumference (axes at rest) and width at the last row, m
    attributes : engine, schedule and settings of the history
    settled : True if wear had ended at the last row
    """

    bearings: Array
    zeta: Array
    weight: Array
    time: Array
    speed: Array
    gas_load: Array
    sigma: Array
    volume: Array
    contact_work: Array
    contact_load: Array
    load: Array
    contact_power: Array
    friction_power: Array
    largest_pressure: Array
    least_gap: Array
    profile: Array
    worn: Array
    attributes: dict[str, str | int | float] = field(default_factory=dict)
    settled: bool = False

    @property
    def hours(self) -> Array:
        """Times of the s rows of the history, h."""
        return np.asarray(self.time / HOUR)

    @property
    def contact_share(self) -> Array:
        """Fraction of each bearing's mean load that asperities carry, (s, b) for s times and b bearings."""
        return np.asarray(self.contact_load / self.load)

    @property
    def deepest(self) -> Array:
        """Largest worn depth of each bearing, m, (s, b) for s times and b bearings."""
        return np.asarray((self.profile - self.profile[0]).max(axis=2))

    def save(self, path: str | Path) -> Path:
        """Write the history's file, whole or not at all; raises ``InputError`` for an invalid path, ``StoreError``."""
        units = OVER_TIME | {"bearings": "1", "zeta": "1", "weight": "m", "worn": "m"}
        datasets = {name: (np.asarray(getattr(self, name)), unit) for name, unit in units.items()}
        return write_wear(path, datasets, {**self.attributes, "settled": int(self.settled)})

    @classmethod
    def load_file(cls, path: str | Path) -> "WearHistory":
        """Read a file that :meth:`save` wrote; raises ``StoreError`` for another or a damaged file."""
        data, attributes = read_wear(path)
        wanted = {one.name for one in fields(cls)} - {"attributes", "settled"}
        if missing := sorted(wanted - set(data)):
            raise StoreError(f"{path}: '{missing[0]}' is missing; {WEAR_REMEDY}")
        settled = bool(attributes.pop("settled", 0))
        return cls(**{name: data[name] for name in wanted}, attributes=attributes, settled=settled)

    def write_table(self, path: str | Path) -> Path:
        """Write a CSV table with a line per time, in engineering units; errors as :meth:`save`."""
        columns = {"hours": self.hours, "speed_rpm": self.speed / RPM, "load": self.gas_load}
        for k, number in enumerate(self.bearings.astype(int)):
            own = {
                "depth_um": 1e6 * self.deepest[:, k], "roughness_um": 1e6 * self.sigma[:, k],
                "volume_mm3": 1e9 * self.volume[:, k], "contact_work_j": self.contact_work[:, k],
                "contact_share": self.contact_share[:, k], "contact_power_w": self.contact_power[:, k],
                "friction_power_w": self.friction_power[:, k],
                "contact_pressure_mpa": 1e-6 * self.largest_pressure[:, k],
                "least_gap_um": 1e6 * self.least_gap[:, k],
            }  # fmt: skip
            columns |= {f"main[{number}].{name}": values for name, values in own.items()}
        with whole_file(path, TABLE) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
            file.write("# cranktrain wear history\n")
            writer = csv.writer(file)
            writer.writerow(columns)
            writer.writerows([[f"{value:.8g}" for value in row] for row in np.array(list(columns.values())).T])
        return Path(path)


def no_history(bearings: Array, zeta: Array, weight: Array, worn: Array, attributes: dict[str, Any]) -> WearHistory:
    """Return a history without rows."""
    b, n = len(bearings), len(zeta)
    shapes = {name: (0,) if name in ("time", "speed", "gas_load") else (0, b) for name in OVER_TIME}
    empty: dict[str, Any] = {name: np.zeros(shape) for name, shape in (shapes | {"profile": (0, b, n)}).items()}
    return WearHistory(bearings=bearings, zeta=zeta, weight=weight, worn=worn, attributes=attributes, **empty)
