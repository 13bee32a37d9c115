"""Contents of a run-up's pictures: quantities, additional data, and choice of labelled orders and peaks."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.reduced_body import Array
from cranktrain.core.units import RPM
from cranktrain.engine.model import Engine
from cranktrain.results.files import output_unit
from cranktrain.results.orders.measured import Measured, band_of
from cranktrain.results.orders.measured_points import Point, points_at, reach_of
from cranktrain.results.orders.modes_over_speed import ModesOverSpeed
from cranktrain.results.orders.resonances import Peak, peaks
from cranktrain.results.plots import largest
from cranktrain.results.run_up.run_up import AXIAL, TORSION, TWIST, RunUp

COLOURED, LABELLED = 8, 8
"""Number of orders with their own colour in addition to published orders, and number of labelled peaks."""
WORTH = 0.05
"""Fraction of the largest amplitude from which a peak is labelled."""
DROWNED = 0.05
"""A resonance below this fraction of the largest amplitude is not visible on a linear scale."""
BROADEST = 0.2
"""Largest damping ratio of a peak that counts as a resonance. A peak with more damping magnifies less than 2.5 times
and is a maximum of the excitation."""
NEAR = 0.08
"""Largest relative difference between the speed of a peak and the published critical speed to which it belongs."""
SAME = 1.0e-3
"""Largest relative difference in speed between entries of the same peak in two lists."""
PARTS = {"crank": "axial.crank", "bearing": "axial.bearing", "engine": "axial.engine"}
"""Output of each part of the axial motion."""


class Quantity(NamedTuple):
    """Output with its name, unit and factor from SI in pictures, and the kind of modes that it shows."""

    output: str
    name: str
    unit: str
    scale: float
    kind: str

    @property
    def peak_to_peak(self) -> "Quantity":
        """Quantity with amplitudes peak to peak, which are twice as large."""
        return self._replace(name=self.name.replace("zero to peak", "peak to peak"), scale=2.0 * self.scale)


TORSIONAL = Quantity(TORSION, "torsion of the pulley, zero to peak", "deg", 180.0 / math.pi, "torsional")
TWISTING = Quantity(TWIST, "twist from pulley to flywheel, zero to peak", "deg", 180.0 / math.pi, "torsional")
ALONG = Quantity(AXIAL, "axial motion of the pulley, zero to peak", "µm", 1e6, "axial")


def quantity_of(output: str) -> Quantity:
    """Name, unit and factor of an output in pictures; rad shown in degrees."""
    unit = output_unit(output)
    scale, unit = (180.0 / math.pi, "deg") if unit == "rad" else (1.0, unit or "1")
    known = {one.output: one for one in (TORSIONAL, TWISTING, ALONG)}
    return known.get(output) or Quantity(output, f"{output}, zero to peak", unit, scale, "")


LEAST_AXIS_HZ, AXIS_SHARE, ROUND_HZ = 500.0, 1.5, 100.0
"""End of a frequency axis: its least value, Hz; its least ratio to the first torsional frequency; the step, Hz, to
which it is rounded."""


class Beside(NamedTuple):
    """Additional contents of a run-up's pictures: published speeds of its engine, modes over speed, measured orders.

    ``modes`` are modes at rest on the stand-in springs of the bearings. ``motion`` are peaks of the pulley's torsion
    with the torsional mode in motion of the run's own levels, if known. ``stresses`` are those of drive-line shafts
    (:func:`cranktrain.results.strength.iacs_m68.shaft_stresses`). ``orders`` are the orders to be drawn, by default the
    strongest. ``log`` selects a logarithmic scale; None: only if resonances are :func:`drowned`.
    """

    engine: Engine | None = None
    modes: ModesOverSpeed | None = None
    measured: Measured | None = None
    motion: Sequence[Peak] = ()
    stresses: Sequence[Mapping[str, Any]] = ()
    orders: Sequence[float] = ()
    log: bool | None = None

    def logarithmic(self, run_up: RunUp, quantity: Quantity) -> bool:
        """True if amplitudes are drawn on a logarithmic scale, by request or because resonances are small."""
        return drowned(run_up, quantity.output, self.orders) if self.log is None else self.log

    def published(self, quantity: Quantity) -> dict[float, float]:
        """Published critical speeds of the first torsional mode, rev/min, by order."""
        if self.engine is None or quantity.kind != "torsional":
            return {}
        p = self.engine.published
        return {order: speed / RPM for order, speed in zip(p.critical_orders, p.critical_speeds, strict=True)}

    def highest_hz(self, run_up: RunUp) -> float:
        """End of a frequency axis, Hz, above the first torsional mode but not above the highest excited frequency."""
        found = [] if self.modes is None else [k for k, kind in enumerate(self.modes.kinds) if kind == "torsional"]
        first = 0.0 if not found or self.modes is None else float(self.modes.hz[:, found[0]].max())
        excited = float(run_up.orders[-1] * run_up.speeds[-1]) / (2.0 * math.pi)
        return min(max(LEAST_AXIS_HZ, ROUND_HZ * math.ceil(AXIS_SHARE * first / ROUND_HZ)), excited)

    def motion_hz(self, peak: Peak, quantity: Quantity) -> float:
        """Frequency in motion, Hz, of the torsional mode to which a peak belongs; NaN if not known."""
        if quantity.kind != "torsional":
            return math.nan
        same = [
            own.motion_hz for own in self.motion if own.order == peak.order and abs(own.speed / peak.speed - 1.0) < SAME
        ]
        return next((hz for hz in same if math.isfinite(hz)), math.nan)

    def measured_of(self, quantity: Quantity, order: float) -> tuple[Array, Array] | None:
        """Measured speeds (k,) rev/min and amplitudes (k,) of an order in the picture's unit; None if not measured."""
        found = (self.measured or {}).get(quantity.output, {}).get(order)
        return None if found is None else (found[0] / RPM, found[1] * quantity.scale)

    def band_of(self, quantity: Quantity, order: float) -> Array | None:
        """Half widths (k,) of the bands of measured amplitudes in the picture's unit; None if not known."""
        found = band_of(self.measured, quantity.output, order)
        return None if found is None else found * quantity.scale

    def points_at(self, quantity: Quantity, run_up: RunUp, at: int) -> list[Point]:
        """Measured orders near a speed of the run-up, in SI."""
        return points_at(self.measured, quantity.output, float(run_up.speeds[at]), reach_of(run_up.speeds))

    def measured_marks(self, quantity: Quantity, orders: Sequence[float]) -> list[tuple[float, Array, Array, Array]]:
        """Measured orders: order, speeds (k,) rev/min, amplitudes (k,), half widths (k,) of bands, 0 without band."""
        found = []
        for order in orders:
            if (points := self.measured_of(quantity, order)) is not None:
                band = self.band_of(quantity, order)
                found.append((order, *points, np.zeros(points[0].size) if band is None else np.nan_to_num(band)))
        return found


def shown_orders(run_up: RunUp, quantity: Quantity, beside: Beside) -> list[float]:
    """Orders with their own colour: requested orders, or those of the largest amplitudes and of published speeds."""
    if beside.orders:
        return [order for order in beside.orders if order in run_up.orders]
    sizes = np.nan_to_num(np.abs(run_up.amplitudes[quantity.output])).max(axis=0)
    strongest = {float(run_up.orders[k]) for k in np.argsort(-sizes)[:COLOURED]}
    speeds = run_up.speeds_rpm
    within = {o for o, rpm in beside.published(quantity).items() if speeds[0] <= rpm <= speeds[-1]}
    return sorted(strongest | (within & set(run_up.orders.tolist())))


def worthy(run_up: RunUp, quantity: Quantity, orders: Sequence[float], beside: Beside) -> list[Peak]:
    """Peaks to be labelled: high peaks, and peaks near a published speed of their order."""
    found = [peak for peak in peaks(run_up, quantity.output) if peak.order in orders and _sharp(peak)]
    top = max((peak.amplitude for peak in found), default=0.0)
    published = beside.published(quantity)
    return [
        peak
        for peak in found
        if peak.amplitude >= WORTH * top or abs(peak.speed / RPM / published.get(peak.order, math.inf) - 1.0) < NEAR
    ][:LABELLED]


def drowned(run_up: RunUp, output: str, orders: Sequence[float] = ()) -> bool:
    """True if an output's highest resonance is below ``DROWNED`` times its largest amplitude, of ``orders`` or all.

    The usual reason is uneven rotation of a light crank as a whole: that of a four-cylinder engine reaches degrees,
    while resonances of the crank's first mode reach hundredths of a degree.
    """
    own = np.isin(run_up.orders, orders) if len(orders) else np.ones(run_up.orders.size, dtype=bool)
    found = [peak.amplitude for peak in peaks(run_up, output) if own[run_up.orders == peak.order] and _sharp(peak)]
    return bool(found) and max(found) < DROWNED * largest(np.abs(run_up.amplitudes[output][:, own]))


def _sharp(peak: Peak) -> bool:
    """True if a peak is a resonance: its damping ratio is small, or unknown because the peak is too sharp."""
    return not peak.damping > BROADEST


def unsteady(run_up: RunUp) -> NDArray[np.bool_]:
    """True for speeds (s,) whose last cycle differs from the cycle before it; the motion did not settle there."""
    return np.asarray((run_up.repeats != 1) & (run_up.cycles > 0))


def figure_of(width: float, height: float) -> Any:
    """Empty figure of a size in inches; :func:`cranktrain.results.plots.foot` makes room for text below its axes."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    return Figure(figsize=(width, height), dpi=120, layout=ConstrainedLayoutEngine(rect=(0.0, 0.01, 1.0, 0.99)))
