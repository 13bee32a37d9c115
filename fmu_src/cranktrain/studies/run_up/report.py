"""Report of a run-up: orders over speed in engineering units, resonances and critical speeds of linear modes."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.core.units import RPM
from cranktrain.dynamics.simulation import fitted_engine
from cranktrain.engine.levels import crank_level
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Published
from cranktrain.loads.damper import required_damper
from cranktrain.loads.gas_pressure import Gas
from cranktrain.results.columns import NOTHING, cell
from cranktrain.results.orders.resonances import Peak, labelled, peaks
from cranktrain.results.run_up.run_up import AXIAL, TORSION, RunUp
from cranktrain.results.tables import Table
from cranktrain.structure.assembly import Assembly
from cranktrain.structure.block.modal import block_modes
from cranktrain.structure.crank.critical_speeds import critical_speeds
from cranktrain.structure.crank.modal import (
    KINDS,
    cranktrain_matrices,
    cranktrain_modes,
    energy_shares,
    listed_to,
    pulley_answers,
    torsional_frequencies,
)
from cranktrain.studies.torsion.line_modes import LINE, line_modes
from cranktrain.studies.torsion.peak_modes import modes_at_peak

SHOWN = 12
"""Number of peaks in a table."""


def report(run_up: RunUp, found: Sequence[Peak], published: Published | None = None) -> dict[str, Any]:
    """Orders and peaks, JSON-able; keys carry their units. ``published`` has the measured critical speeds."""
    measured = measured_speeds(found, published)
    said: dict[str, Any] = {
        "speeds": run_up.speeds_rpm.tolist(),
        "torsion_orders_deg": _sizes(run_up, TORSION, 180.0 / math.pi),
        "axial_orders_um": _sizes(run_up, AXIAL, 1e6) if AXIAL in run_up.amplitudes else {},
        "orders": {name: _sizes(run_up, name, 1.0) for name in run_up.amplitudes if name not in (TORSION, AXIAL)},
        "peaks": [peak_entry(peak, rpm) for peak, rpm in zip(found, measured, strict=True)],
        "cycles": run_up.cycles.tolist(),
        "repeats_every_cycles": run_up.repeats.tolist(),
        "speeds_without_period": int(np.count_nonzero(without_period(run_up))),
        "settling_left": run_up.left.tolist(),
        "cycles_part_by": [factor if math.isfinite(factor) else None for factor in run_up.parting.tolist()],
    }
    return said


def measured_speeds(found: Sequence[Peak], published: Published | None) -> list[float]:
    """Measured critical speed of each peak, rev/min; NaN if none was measured.

    Of several peaks of an order the one nearest to the measured speed has it.
    """
    result = [math.nan] * len(found)
    if published is None:
        return result
    for order, speed in zip(published.critical_orders, published.measured_critical_speeds, strict=True):
        of_order = [k for k, peak in enumerate(found) if peak.order == order]
        if speed > 0.0 and of_order:
            result[min(of_order, key=lambda k: abs(found[k].speed - speed))] = speed / RPM
    return result


def without_period(run_up: RunUp) -> NDArray[np.bool_]:
    """True for speeds (s,) at which cycles were run and the motion is not periodic."""
    return np.asarray((run_up.repeats == 0) & (run_up.cycles > 0))


def peak_entry(peak: Peak, measured_rpm: float = math.nan) -> dict[str, Any]:
    """Peak of torsion as JSON-able values, amplitude in degrees. Without a measured speed two values are None."""
    rpm = peak.speed / RPM
    measured = math.isfinite(measured_rpm)
    return {
        "order": peak.order,
        "rpm": rpm,
        "measured_rpm": measured_rpm if measured else None,
        "off_measured_percent": 100.0 * (rpm / measured_rpm - 1.0) if measured else None,
        "amplitude": math.degrees(peak.amplitude),
        "mode_hz": peak.mode_hz,
        "mode": peak.kind,
        "hz": peak.hz,
        "damping_ratio": peak.damping,
        "critical_rpm": peak.critical_speed / RPM,
        "off_percent": 100.0 * peak.off,
        "mode_in_motion_hz": peak.motion_hz,
        "mode_in_motion_torsion_percent": 100.0 * peak.motion_torsion,
        "off_in_motion_percent": 100.0 * peak.off_in_motion,
        "periodic": peak.periodic,
    }


def torsional_peaks(run_up: RunUp, made: Assembly) -> list[Peak]:
    """Peaks of the pulley's torsion with the nearest torsional mode of the crank, or mode of the drive line.

    Modes are those of the run's crank and block at rest on the stand-in springs. With the damper they include its ring
    and its damping at the peak. Their frequencies are lower than with the housing alone, because the fluid drags the
    ring along. With damper and flexible block no modes are computed.
    """
    found, fitted = peaks(run_up), fitted_engine(made.engine, made.settings)
    if not crank_level(made.settings.crank).elastic:
        return found
    damped, block = made.settings.damper != "none", made.parts.block
    line = line_modes(fitted, made.body, required_damper(fitted).ring_inertia if damped else 0.0)
    slow, names = line.hz[line.of_line], [name for name in line.names if name.startswith(LINE)]
    torsional = np.zeros(0)
    if not damped:
        torsional = torsional_at_rest(fitted, made.body, block)
        if block is None and fitted.drive_line_chain is not None:
            torsional = line.hz[np.array(line.names) == "torsional"]
    result = []
    for peak in found:
        own = modes_at_peak(fitted, made.body, peak) if damped and block is None else torsional
        result += labelled([peak], np.append(slow, own), names + own.size * ["torsional"])
    return result


def critical_speeds_at_rest(run_up: RunUp, made: Assembly, gas: Gas | None) -> list[dict[str, Any]]:
    """Critical speeds within a run-up by the orders that excite the first torsional mode at rest, on ground.

    None of a rigid crank, and none with the damper, whose ring changes the mode.
    """
    if not crank_level(made.settings.crank).elastic or made.settings.damper != "none":
        return []
    found = critical_speeds(fitted_engine(made.engine, made.settings), made.body, gas)
    return [entry for entry in found if run_up.speeds_rpm[0] <= entry["rpm"] <= run_up.speeds_rpm[-1]]


def critical_speeds_text(found: Sequence[Mapping[str, Any]]) -> str:
    """Sentence on critical speeds, strongest excitation first."""
    ranked = sorted(found, key=lambda entry: -entry["excitation"])
    said = ", ".join(f"{entry['order']:g} at {entry['rpm']:.0f}" for entry in ranked)
    return f"Orders that excite torsion and their critical speeds at rest on ground, strongest first: {said} rev/min"


def torsional_at_rest(engine: Engine, body: ReducedBody, block: ReducedBody | None) -> Array:
    """Torsional modes (k,) Hz of the cranktrain at rest on its stand-in springs, on ground or in its block."""
    if block is None:
        hz, shares, answers = cranktrain_modes(engine, body)
    else:
        hz, crank, _ = block_modes(engine, body, block)
        _, mass = cranktrain_matrices(engine, body)
        part = np.einsum("ik,ij,jk->k", crank, mass, crank)
        shares = np.column_stack((part[:, None] * energy_shares(engine, body, crank, rods=True), 1.0 - part))
        answers = pulley_answers(engine, body, crank, (2.0 * math.pi * hz) ** 2)
    own, highest = hz > 1.0, engine.reduction.running_cutoff_hz
    first = torsional_frequencies(hz[own], shares[own], answers[own], highest)[0]
    listed = (hz > 1.0) & (hz <= listed_to([first]))
    return np.asarray(hz[listed & ((np.argmax(shares, axis=1) == KINDS.index("torsional")) | (hz == first))])


def run_up_tables(said: Mapping[str, Any]) -> list[Table]:
    """Table of peaks with modes, critical speeds and measured speeds."""
    rows = [
        (
            f"{peak['order']:g}", f"{peak['rpm']:.0f}", f"{peak['amplitude']:.3g}", f"{peak['hz']:.1f}",
            cell(peak["damping_ratio"], ".2%"), f"{peak['mode']} {cell(peak['mode_hz'], '.1f')}".strip(),
            cell(peak["critical_rpm"], ".0f"), cell(0.01 * peak["off_percent"], "+.1%"),
            cell(peak["mode_in_motion_hz"], ".1f"), cell(0.01 * peak["off_in_motion_percent"], "+.1%"),
            cell(peak["mode_in_motion_torsion_percent"], ".0f"),
            cell(peak["measured_rpm"], ".0f"),
            NOTHING if (off := peak["off_measured_percent"]) is None else f"{0.01 * off:+.1%}",
            "" if peak["periodic"] else "no period there",
        )
        for peak in said["peaks"][:SHOWN]
    ]  # fmt: skip
    header = (
        "order", "rev/min", "deg", "Hz", "damping", "at rest / Hz", "critical / rev/min", "off",
        "in motion / Hz", "off", "its torsion / %", "measured / rev/min", "off", "",
    )  # fmt: skip
    return [Table("Resonances of the pulley's torsion (amplitudes zero to peak)", header, tuple(rows))]


def closing_text(run_up: RunUp) -> str:
    """Text on the number of cycles per speed, and on speeds without a period."""
    periodic = run_up.repeats == 1
    if not run_up.cycles.any():
        return f"{run_up.speeds.size} speeds"
    lines = [f"{run_up.speeds.size} speeds, {run_up.cycles.mean():.1f} cycles each"]
    if not periodic.all():
        never = run_up.speeds_rpm[without_period(run_up)]
        for every in np.unique(run_up.repeats[run_up.repeats > 1]).tolist():
            lines += [f"repeats every {every} cycles at {_ranges(run_up.speeds_rpm[run_up.repeats == every])} rev/min"]
        lines += [f"no period at {_ranges(never)} rev/min{_parting(run_up)}"] if never.size else []
        if periodic.any():
            lines[0] += f" ({run_up.cycles[periodic].mean():.1f} where the next one is the same)"
    return "; ".join(lines)


def _sizes(run_up: RunUp, output: str, scale: float) -> dict[str, list[float]]:
    return {f"{order:g}": (scale * np.abs(run_up.order(order, output))).tolist() for order in run_up.orders.tolist()}


def _parting(run_up: RunUp) -> str:
    """Text on the largest difference between successive cycles of a run-up."""
    known = run_up.parting[np.isfinite(run_up.parting)]
    if not known.size:
        return ""
    return f": the difference of two similar cycles grows {known.min():.1f} to {known.max():.1f} times in one cycle"


def _ranges(speeds: Array) -> str:
    """Short text of speeds; of many speeds only the first and the last are given."""
    if speeds.size <= 6:
        return ", ".join(f"{speed:.0f}" for speed in speeds)
    return f"{speeds.size} speeds from {speeds[0]:.0f} to {speeds[-1]:.0f}"
