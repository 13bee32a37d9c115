"""Tables of texts for reports, pictures and the command line, with computed and published values."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from cranktrain.core.units import RPM
from cranktrain.engine.model import Engine
from cranktrain.results.columns import NOTHING
from cranktrain.results.energy import SHARES
from cranktrain.results.summary import CLOSING


class Table(NamedTuple):
    """A table of texts: title, header, and rows of the header's length."""

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


# Least modal assurance criterion of the crank's shapes at which two modes are shown as the same.
SAME_SHAPE = 0.5


def frequency_tables(engine: Engine, report: Mapping[str, Any]) -> list[Table]:
    """Tables of a modal report's frequencies and critical speeds, compared with published values."""
    return [
        free_table(engine, report["crankshaft_free"]),
        cranktrain_table(engine, report["cranktrain"]),
        critical_speed_table(engine, report["critical_speeds"]),
    ]


def free_table(engine: Engine, part: Mapping[str, Any]) -> Table:
    """Table of the free crankshaft's modes with all parts attached; torsional modes compared with published values."""
    ours = part["torsional_hz"]
    published = [("torsional", hz, 0.0, own) for hz, own in zip(engine.published.free_torsional_hz, ours, strict=False)]
    rows = tuple(row[:-1] for row in _beside(part["modes"], published, 6))
    parts = "flywheel, clutch and pulley" if engine.clutch else "flywheel and pulley"
    return Table(f"Free crankshaft with {parts}, no rods", _HEADER[:-1], rows)


def cranktrain_table(engine: Engine, part: Mapping[str, Any]) -> Table:
    """Table of the cranktrain's modes at rest, compared with published computed and measured values."""
    title = "Cranktrain at rest: rods as mean masses, linear bearings, thrust closed"
    return Table(title, _HEADER, tuple(_beside(part["modes"], _published(engine, part), 7)))


def named_text(part: Mapping[str, Any], sought_to: float) -> str:
    """One line on the first and second torsional and the first axial mode of a cranktrain at rest."""
    names = {"first torsional": "first_torsional_hz", "second torsional": "second_torsional_hz",
             "first axial": "first_axial_hz"}  # fmt: skip
    found = (
        f"{name} {f'none up to {sought_to:g} Hz' if part[key] is None else f'{part[key]:.1f} Hz'}"
        for name, key in names.items()
    )
    return f"Modes by name: {', '.join(found)}."


def housed_table(engine: Engine, part: Mapping[str, Any]) -> Table:
    """Table of the cranktrain's modes in its flexible block; each mode is named by the crank's main kind of motion.

    Modes with most of their energy in the block are left out.
    """
    modes = []
    for mode in part["modes"]:
        shares = {kind: share for kind, share in mode["shares"].items() if kind != "block"}
        if mode["shares"]["block"] < 0.5:
            modes.append({**mode, "shape": max(shares, key=lambda kind: float(shares[kind]))})
    title = "Cranktrain in its flexible block on mounts, at rest; the block holds the rest of 100 %"
    published = _published(engine, {"first_torsional_hz": part["first_torsional_hz"]})
    return Table(title, _HEADER, tuple(_beside(modes, published, 7)))


def _published(engine: Engine, part: Mapping[str, Any]) -> "list[Entry]":
    """Published modes of the cranktrain, each with the frequency of the computed mode that the report assigns to it."""
    p = engine.published
    ours = {"torsional": part.get("first_torsional_hz"), "axial": part.get("first_axial_hz")}
    published: list[Entry] = [
        (shape, hz, measured, ours.get(shape))
        for shape, hz, measured in zip(p.cranktrain_shapes, p.cranktrain_hz, p.measured_hz, strict=True)
    ]
    if p.second_torsional_hz:
        published.append(("torsional", p.second_torsional_hz, 0.0, part.get("second_torsional_hz")))
    return published


def critical_speed_table(engine: Engine, speeds: Sequence[Mapping[str, float]]) -> Table:
    """Table of critical speeds of the first torsional mode at rest by order, compared with published values."""
    p = engine.published
    known = {
        order: (speed / RPM, measured / RPM)
        for order, speed, measured in zip(p.critical_orders, p.critical_speeds, p.measured_critical_speeds, strict=True)
    }
    rows = []
    for entry in speeds:
        published, measured = known.get(entry["order"], (0.0, 0.0))
        rows.append(
            (
                f"{entry['order']:g}",
                f"{entry['rpm']:.0f}",
                f"{100.0 * entry['excitation']:.0f}" if "excitation" in entry else NOTHING,
                _number(published, ".0f"),
                _deviation(entry["rpm"], published),
                _number(measured, ".0f"),
            )
        )
    header = ("order", "rev/min", "excitation / %", "published", "deviation", "measured")
    return Table("Critical speeds of the first torsional mode at rest", header, tuple(rows))


def block_tables(part: Mapping[str, Any]) -> list[Table]:
    """Tables of the cranktrain's modes: on ground and in its flexible block in pairs, and all modes in the block."""
    header = ("ground / Hz", "shape", "rigid block / Hz", "flexible / Hz", "change", "MAC", "energy in block / %")
    rows = []
    for pair in part["ground"]:
        found = (f"{pair['hz']:.1f}", f"{pair['change_percent']:+z.1f} %", f"{pair['mac']:.2f}")
        energy = f"{100.0 * pair['block_share']:.0f}"
        stiff = f"{pair['rigid_block_hz']:.1f}" if pair["rigid_block_mac"] >= SAME_SHAPE else NOTHING
        alike = (*found, energy) if pair["mac"] >= SAME_SHAPE else 4 * (NOTHING,)
        rows.append((f"{pair['ground_hz']:.1f}", str(pair["shape"]), stiff, *alike))
    kinds = ("bending", "torsional", "axial", "block")
    modes = tuple(
        (f"{mode['hz']:.1f}", str(mode["shape"]), *(f"{100.0 * mode['shares'][kind]:.0f}" for kind in kinds))
        for mode in part["modes"]
    )
    mounts = ", ".join(f"{hz:.1f}" for hz in part["mounts_hz"])
    title = f"Cranktrain in its flexible block; the engine on its mounts at {mounts} Hz"
    return [
        Table("Cranktrain on ground, and in its block on mounts; paired by the crank's shape", header, tuple(rows)),
        Table(title, ("Hz", "shape", *(f"{kind} / %" for kind in kinds)), modes),
    ]


def run_tables(summary: Mapping[str, Any]) -> list[Table]:
    """Tables of a run summary: pulley motion, main bearings with moving journals, big ends, and further parts."""
    rows = []
    motions = {
        "torsion_deg": "torsion / deg",
        "steady_torsion_deg": "torsion / deg, frequency domain",
        "axial_um": "axial / um",
    }
    for name, words in motions.items():
        if name not in summary["pulley"]:
            continue
        motion = summary["pulley"][name]
        strongest = sorted(motion["orders"], key=lambda line: -line[1])[:4]
        rows.append(
            (
                words,
                f"{motion['peak_to_peak']:.4g}" if "peak_to_peak" in motion else NOTHING,
                ", ".join(f"{order:g}: {amplitude:.3g}" for order, amplitude in strongest),
            )
        )
    pulley = Table(
        "Pulley over the last cycle", ("motion", "peak to peak", "strongest orders, zero to peak"), tuple(rows)
    )
    mains = [_bearing_table("Main bearings over the last cycle", summary["bearings"])] if summary["bearings"] else []
    return [
        pulley,
        *mains,
        _bearing_table("Big ends over the last cycle", summary["big_ends"]),
        *engine_tables(summary),
        *([energy_table(summary["energy"])] if summary.get("energy") else []),
    ]


def energy_table(energy: Mapping[str, Any]) -> Table:
    """Table of the energy balance of the last cycle; parts that are zero are left out."""
    gas, losses = energy["gas_work_j"], energy["losses_j"]
    shares = [(share.words, losses[share.key]) for share in SHARES if losses[share.key] != 0.0]
    left = [("gained by bodies and shafts", energy["stored_j"]), ("unaccounted for", energy["residual_j"])]
    rows = [("work of the gas", gas), *shares, *left]
    return Table(
        "Energy of the last cycle",
        ("", "J", "of the gas work"),
        tuple((words, f"{work:.6g}", f"{work / gas:.3g}" if gas else NOTHING) for words, work in rows),
    )


def _speed_table(speeds: Mapping[str, Mapping[str, float]]) -> Table:
    """Table of speeds of the crank's mean rotation and of its ends, with their degree of irregularity."""
    rows = [
        (
            part,
            *(f"{found[key]:.1f}" for key in ("mean_rpm", "least_rpm", "largest_rpm")),
            f"{found['irregularity']:.3g}",
        )
        for part, found in speeds.items()
    ]
    header = ("speed / rev/min", "mean", "least", "largest", "degree of irregularity")
    return Table("Speeds over the last cycle", header, tuple(rows))


def engine_tables(summary: Mapping[str, Any]) -> list[Table]:
    """Tables of speeds, shaft and damper, and of pistons, mounts and the whole engine if they move."""
    shaft, damper = summary["shaft_torque_nm"], summary["damper"]
    rows = [("shaft torque / N m", f"{shaft['mean']:.4g}", f"alternating {shaft['peak_to_peak']:.4g} peak to peak")]
    if damper["temperature_c"] is not None:
        warm = f"{damper['power_w']:.4g} W at {damper['temperature_c']:.1f} degC"
        rows.append(("damper torque / N m", f"{damper['torque_nm']:.4g}", f"largest; {warm}"))
    cover = summary["cover"]["acceleration_m_per_s2"]
    if cover["peak_to_peak"] > 0.0:
        strongest = sorted(cover["orders"], key=lambda line: -line[1])[:3]
        orders = ", ".join(f"{order:g}: {amplitude:.3g}" for order, amplitude in strongest)
        rows.append(("cover / m/s^2", f"{cover['peak_to_peak']:.4g}", f"peak to peak; orders {orders}"))
    tables = [
        _speed_table(summary["speeds"]),
        Table("Drive line and cover over the last cycle", ("quantity", "value", "besides"), tuple(rows)),
    ]
    if summary["mounts"] and cover["peak_to_peak"] > 0.0:
        moved = [
            (f"engine {name} {axis} / {unit}", *(f"{value:.4g}" for value in summary["engine"][key][k]))
            for key, name, unit in (("position_um", "along", "um"), ("rotation_mrad", "about", "mrad"))
            for k, axis in enumerate("xyz")
        ]
        moved += [
            (f"mount[{i}] {axis} / N", *(f"{value:.4g}" for value in mount["force_n"][k]))
            for i, mount in enumerate(summary["mounts"], 1)
            for k, axis in enumerate("xyz")
        ]
        header: tuple[str, ...] = ("", "mean", "least", "largest")
        tables.append(Table("Engine on its mounts over the last cycle", header, tuple(moved)))
    if any(any(piston["lateral_um"]) for piston in summary["pistons"]):
        columns = ("lateral_um", "tilt_mrad", "side_force_n", "friction_n")
        slides = tuple(
            (f"piston[{i}]", *(f"{piston[key][1]:.3g} to {piston[key][2]:.3g}" for key in columns))
            for i, piston in enumerate(summary["pistons"], 1)
        )
        header = ("", "across / um", "tilt / mrad", "side force / N", "friction / N")
        tables.append(Table("Pistons in their liners over the last cycle, least to largest", header, slides))
    return tables


# Columns of a table of bearings: key in the summary, header, scale, format. The last two need a value above 0.
_BEARING_COLUMNS = (
    ("film_temperature_c", "film / degC", 1.0, ".1f"),
    ("peak_load_n", "peak load / kN", 1e-3, ".1f"),
    ("min_film_um", "thinnest film / um", 1.0, ".2f"),
    ("max_eccentricity", "largest eccentricity", 1.0, ".3f"),
    ("max_pressure_pa", "largest pressure / MPa", 1e-6, ".0f"),
    ("max_moment_nm", "largest moment / N m", 1.0, ".1f"),
)


def _bearing_table(title: str, bearings: Sequence[Mapping[str, Any]]) -> Table:
    """Table of bearings with the columns that they have: load, film of floating big ends, moment of tilted films."""
    known, rare = _BEARING_COLUMNS[:-2], _BEARING_COLUMNS[-2:]
    columns = [column for column in known if column[0] in bearings[0]]
    columns += [column for column in rare if any(row.get(column[0], 0.0) for row in bearings)]
    rows = tuple(
        (row["name"], *(format(scale * row[key], form) for key, _, scale, form in columns)) for row in bearings
    )
    return Table(title, ("bearing", *(header for _, header, _, _ in columns)), rows)


def closing_text(names: Sequence[str]) -> str:
    """One line on bearings whose film at an edge is nearly closed."""
    return (
        f"An edge stays less than {1e6 * CLOSING:g} um open in {', '.join(names)}: "
        "the largest film pressure has no meaning there"
    )


MEASURED = {"ground": "on rigid ground", "flexible": "in its flexible block"}
"""Text for each block level at which the errors of film grids were measured."""


def grid_text(errors: Mapping[str, Any]) -> str:
    """One line on the possible grid errors of elastic films; ``errors`` is ``grid_errors`` of the run's summary."""
    film, pressure = errors["least_film"], errors["largest_pressure"]
    return (
        f"Grid of level {errors['level']}: the least film of {film['name']}, {film['um']:.2f} um, is within "
        f"{100.0 * film['error']:.0f} % and the largest pressure of {pressure['name']}, {1e-6 * pressure['pa']:.0f} "
        f"MPa, within {100.0 * pressure['error']:.0f} % of a converged grid in every engine that was measured "
        f"{MEASURED[errors['block']]} (docs/limits.md)"
    )


def resolution_text(films: Sequence[Mapping[str, Any]]) -> str:
    """One line on the elastic films whose grid does not resolve the pressure peak in axial direction."""
    places = ", ".join(
        f"{film['name']} at {film['crank_angle_deg']:.0f} deg ({100.0 * film['pressure_drop']:.0f} %)" for film in films
    )
    return (
        f"Film not resolved across the bearing (fall of pressure from its peak to the next axial lines): {places}. "
        "Least film and largest pressure are estimates there; relieve the edge, or take more axial lines"
    )


def online_text(online: Mapping[str, Any]) -> str:
    """One line on the films that were solved online because they lay outside the film table."""
    line = (
        f"Films outside the table over the last cycle: {online['solved']} of {online['films']} solved online "
        f"({100.0 * online['share']:.2g} %)"
    )
    if not online["by_crank_angle"]:
        return line
    most = sorted(online["by_crank_angle"], key=lambda entry: -entry[1])[:4]
    places = ", ".join(
        f"{first:g}-{first + online['bin_deg']:g} deg ({100.0 * share:.2g} %)" for first, share in sorted(most)
    )
    return f"{line}; most at {places}"


_HEADER = ("Hz", "shape", "bending / %", "torsional / %", "axial / %", "published / Hz", "deviation", "measured / Hz")

# Published mode: shape, published Hz, measured Hz or 0, and the Hz of the computed mode assigned to it, or None.
Entry = tuple[str, float, float, float | None]


def _beside(modes: Sequence[Mapping[str, Any]], published: Sequence[Entry], first: int) -> list[tuple[str, ...]]:
    """Rows of the ``first`` computed modes and of all modes that belong to a published one."""
    pairs = _answering(modes, published)
    rows = []
    missing = [
        (NOTHING, shape, *3 * (NOTHING,), _number(hz, ".0f"), NOTHING, _number(measured, ".0f"))
        for shape, hz, measured, own in published
        if (shape, hz, measured, own) not in pairs.values()
    ]
    for k, mode in enumerate(modes):
        if k < first or k in pairs:
            _, hz, measured, _ = pairs.get(k, ("", 0.0, 0.0, None))
            shares = (f"{100.0 * mode['shares'][kind]:.0f}" for kind in ("bending", "torsional", "axial"))
            beside = (_number(hz, ".0f"), _deviation(mode["hz"], hz), _number(measured, ".0f"))
            rows.append((f"{mode['hz']:.1f}", str(mode["shape"]), *shares, *beside))
    return rows + missing


def _answering(modes: Sequence[Mapping[str, Any]], published: Sequence[Entry]) -> dict[int, Entry]:
    """Published modes that have an assigned computed mode, by the index of the computed mode.

    An entry with an assigned frequency gets the nearest mode. Other entries are paired shape by shape, in ascending
    order and with the least sum of squared deviations; no deviation may exceed a quarter.
    """
    pairs = {}
    for entry in (entry for entry in published if entry[3] is not None):
        pairs[int(np.argmin([abs(mode["hz"] - entry[3]) for mode in modes]))] = entry
    for shape in dict.fromkeys(entry[0] for entry in published):
        entries = [entry for entry in published if entry[0] == shape and entry[3] is None]
        ours = [k for k, mode in enumerate(modes) if mode["shape"] == shape and k not in pairs]
        away = np.array([[abs(modes[k]["hz"] / entry[1] - 1.0) for k in ours] for entry in entries])
        # A pair of modes that differ by 25 % or more costs more than all other pairs together.
        near = away.reshape(len(entries), len(ours)) < 0.25
        cost = np.where(near, away.reshape(near.shape) ** 2, 1.0 + len(entries))
        for row, column in zip(*linear_sum_assignment(cost), strict=True):
            if near[row, column]:
                pairs[ours[column]] = entries[row]
    return pairs


def _number(value: float, form: str) -> str:
    """Text of a number in a format; a dash if it is 0."""
    return format(value, form) if value else NOTHING


def _deviation(value: float, reference: float) -> str:
    """Text of the deviation from a reference in per cent; a dash without reference."""
    return f"{100.0 * (value / reference - 1.0):+z.1f} %" if reference else NOTHING
