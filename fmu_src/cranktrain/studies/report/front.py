"""First page of a report: the engine, the verdict against its limits, and the settings and versions of the report."""

import math
import platform

import numpy as np

from cranktrain import __version__
from cranktrain.core.units import RPM
from cranktrain.core.user_file import ending
from cranktrain.engine.articulated_rod import dead_centre_angles, dead_centre_heights
from cranktrain.engine.file import engine_path
from cranktrain.engine.firing import firing_text
from cranktrain.engine.model import Engine
from cranktrain.loads.mean_load import mean_torque
from cranktrain.results.free_forces import free_force_table, free_forces
from cranktrain.results.tables import Table
from cranktrain.studies.report.elements import paragraph, table
from cranktrain.studies.report.findings import Findings
from cranktrain.studies.report.verdict import verdict_table, verdict_text, verdicts
from cranktrain.studies.torsion.added_orders import not_linear


def front(found: Findings) -> list[str]:
    """First page: engine, verdict, and origin of the report."""
    all_of = verdicts(found)
    free = free_forces(found.engine, found.speeds[1])
    left = f" Without {', '.join(free['left_out'])}, which are elastic or move with a rod." if free["left_out"] else ""
    note = (
        "Free forces and moments are those of crank, rods, pistons and rigid balancers at constant speed; orders that "
        "are not listed are balanced. Moments are about the middle of the main journals, pitching about the axis "
        f"across the engine.{left}"
    )
    return [
        table(Table("The engine", ("", "value"), tuple(engine_rows(found)))),
        paragraph(verdict_text(all_of)),
        table(verdict_table(all_of)),
        *([table(free_force_table(free))] if free["orders"] else []),
        paragraph(note),
        table(Table("This report", ("", "value"), tuple(_made_rows(found)))),
    ]


def engine_rows(found: Findings) -> list[tuple[str, str]]:
    """Names and texts of the engine's main data."""
    engine = found.engine
    best, rated = engine.best_speed, engine.rated_speed
    trace, power = found.trace(best), rated * mean_torque(engine, found.trace(rated), rated)
    low, high = (end / RPM for end in found.speeds)
    throws = sorted({round(2e3 * throw, 6) for throw in engine.throws})
    angle, ratio = math.degrees(trace.peak_angle), engine.cylinders.compression_ratio
    litres = 1e3 * engine.displacement
    names, reason = ", ".join(body.name for body in engine.additions.body), not_linear(engine)
    left_out = f"; not in the torsion of this report: {reason}" if reason else ""
    rods = "on films" if engine.rods_float else f"without films, rods are {engine.cylinders.rods_on_pin}"
    return [
        ("layout", layout_text(engine)),
        ("bore", f"{1e3 * engine.cylinders.bore:.5g} mm"),
        ("stroke", f"{', '.join(f'{throw:.5g}' for throw in throws)} mm"),
        ("displacement", f"{litres:.4g} l" if litres >= 1.0 else f"{1e3 * litres:.4g} cm³"),
        ("compression ratio", f"{ratio:.4g}"),
        ("firing", firing_text(engine)),
        ("pressures", trace.source),
        ("peak pressure, absolute", f"{1e-5 * trace.peak:.4g} bar, {angle:.1f}° after dead centre"),
        ("indicated mean effective pressure", f"{1e-5 * trace.imep:.4g} bar"),
        ("speed of these pressures", f"{best / RPM:.5g} rev/min"),
        ("rated speed", f"{rated / RPM:.5g} rev/min"),
        ("indicated power at rated speed", f"{1e-3 * power:.4g} kW"),
        ("load", f"{100.0 * found.asked.load:.4g} % of the full-load burn"),
        ("speeds", f"{low:.5g} to {high:.5g} rev/min"),
        *([("added bodies", f"{names}{left_out}")] if names else []),
        ("torsional damper", _none("damper") if engine.damper is None else engine.damper.kind),
        ("block", f"rigid ground, {_none('block')}" if engine.block is None else "flexible"),
        ("big ends", f"without films, {_none('big_end_bearing')}" if engine.big_end_bearing is None else rods),
        *_articulated(engine),
        ("fatigue", _none("crank_strength") if engine.crank_strength is None else "by [crank_strength]"),
    ]


def _articulated(engine: Engine) -> list[tuple[str, str]]:
    """Rows on articulated rods: their master rods, and strokes and dead centres by the true paths of the pistons."""
    found = []
    for c, joint in enumerate(engine.articulations):
        if joint is not None:
            top, bottom = dead_centre_angles(engine, c)
            pin = engine.firing_angles[c]
            high, low = 1e3 * dead_centre_heights(engine, c)
            late = [math.degrees((one - pin + math.pi) % (2.0 * math.pi) - math.pi) for one in (top, bottom + math.pi)]
            found.append((
                f"cylinder {c + 1}, articulated",
                f"hangs on the master rod of cylinder {joint.master + 1}; stroke {high - low:.5g} mm, dead centres "
                f"{late[0]:+.2f}° (top) and {late[1]:+.2f}° (bottom) from where the pin points along the cylinder or "
                "away from it",
            ))  # fmt: skip
    return found


def _none(table: str) -> str:
    return f"no [{table}] in the engine file"


def layout_text(engine: Engine) -> str:
    """Cycle, number and arrangement of the cylinders in words."""
    count, banks = engine.n_cylinders, sorted({round(math.degrees(angle), 3) for angle in engine.cylinders.bank_angles})
    what = "compressor" if engine.compressor is not None else f"{round(engine.cylinders.cycle / math.pi)}-stroke"
    if count == 1:
        return f"{what}, single cylinder"
    apart = float(np.ptp(banks))
    if len(banks) == 1:
        how = "in line"
    elif len(banks) == 2:
        how = "opposed" if abs(apart - 180.0) < 1e-2 else f"V, {apart:.4g}° between the banks"
    else:
        how = f"banks at {', '.join(f'{angle:.4g}' for angle in banks)}°"
    return f"{what}, {count} cylinders, {how}"


def _made_rows(found: Findings) -> list[tuple[str, str]]:
    name = found.asked.name
    file = name if ending(name) == ".toml" else f"{engine_path(name).name}, shipped with cranktrain"
    return [
        ("date", found.date),
        ("engine file", file),
        ("digest of the file, SHA-256", found.digest),
        ("command", found.asked.command),
        ("versions", f"cranktrain {__version__}, Python {platform.python_version()}, NumPy {np.__version__}"),
    ]
