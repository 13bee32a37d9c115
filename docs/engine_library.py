"""Library of engines: one per usual layout, with bore, stroke and power of an existing or typical engine.

    python docs/engine_library.py [ENGINE ...]

writes their files into the package. All other sizes are those of ``cranktrain new``. ``MORE`` has additional tables
(balancer shafts, a dual-mass flywheel, a generator behind an elastic coupling). Bore, stroke and power are
makers' published figures of engines of the kind that the row names; nothing else of these engines is in the files.
The low-speed two-stroke ``two_stroke_six`` and the reference's engines are files of their own.
"""

import json
import math
import sys
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from cranktrain.cli.engines import TABLE
from cranktrain.core.units import RPM
from cranktrain.engine.file import engine_folder, engine_names, load_engine
from cranktrain.engine.firing import firing_summary
from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.store.whole_file import whole_file
from cranktrain.studies.design.document import Document
from cranktrain.studies.design.layouts import layout
from cranktrain.studies.design.rules import first_design
from cranktrain.studies.design.sizes import HANDBOOK, sizes

SAME_DEG = 1e-6
"""Difference (deg) below which two bank angles count as equal."""
SHIP = "two_stroke_six"
"""Low-speed two-stroke engine of the library, whose file is not written by this module."""
STIFF = 2.0e8
"""Stiffness of the balancers' bearings, and of their gear meshes over width, N/m; chosen, usual for steel and films."""


class Row(NamedTuple):
    """An engine of the library: sizes in mm, power in kW, rated speed in rev/min, and their source."""

    name: str
    title: str
    layout: str
    bore: float
    stroke: float
    fuel: str
    power: float
    rated: float
    source: str
    more: Callable[[Engine], str] | None = None


def balanced_four(engine: Engine) -> str:
    """Tables of two counter-rotating balancer shafts at twice the speed, and of a dual-mass flywheel."""
    crank, rod = engine.crankshaft, engine.rod
    a = crank.throw / rod.length
    oscillating = rod.small_end_mass + engine.cylinders.piston_mass
    # Two eccentric masses at 2 ω balance the second order of four pistons, 4 m r ω² λ (1 + λ²/4 + 15 λ⁴/128).
    moment = 0.5 * oscillating * crank.throw * a * (1.0 + a**2 / 4.0 + 15.0 * a**4 / 128.0)
    mass, across, below = 1.5, 45.0, -1e3 * (crank.throw + 0.9 * engine.cylinders.bore)
    middle = 1e3 * crank.main_positions[2]
    front, rear = 1e3 * crank.main_positions[1], 1e3 * crank.main_positions[3]
    note = "mass times eccentricity is half of one cylinder's second order, m r^2/L (1 + a^2/4 + 15 a^4/128), a = r/L"
    lines = ["", "# Balancer shafts against the second order: twice the crank's speed, one each way."]
    for k, (name, ratio, x) in enumerate((("backwards", -2, -across), ("forwards", 2, across)), 1):
        places = f'x = {{ value = [{x:g}, {x:g}, {x:g}], unit = "mm", origin = "chosen" }}'
        lines += [
            "", "[[frame]]", f'name = "{name}"', f'ratio = {{ value = {ratio}, unit = "1", origin = "chosen" }}',
            f'axis = {{ value = [{x:g}, {below:.4g}], unit = "mm", origin = "chosen" }}',
            "", "[[body]]", f'name = "balancer[{k}]"', f'frame = "{name}"',
            f'mass = {{ value = {mass:g}, unit = "kg", origin = "chosen" }}',
            'inertia = { value = [5e-3, 5e-3, 6e-4], unit = "kg m^2", origin = "chosen" }',
            f"centre = {{ value = [{x:g}, {below - 1e3 * moment / mass:.7g}, {middle:.6g}], unit = \"mm\", "
            f'origin = "derived", note = "{note}" }}',
            'interfaces = ["front", "gear", "rear"]', places,
            f"y = {{ value = [{below:.4g}, {below:.4g}, {below:.4g}], unit = \"mm\", origin = \"chosen\" }}",
            f"z = {{ value = [{front:.6g}, {middle:.6g}, {rear:.6g}], unit = \"mm\", origin = \"chosen\" }}",
        ]  # fmt: skip
    meshes = {
        "crank_gear": ("crank.main[3]", "balancer[1].gear"),
        "balancer_gear": ("balancer[1].gear", "balancer[2].gear"),
    }
    for name, (first, second) in meshes.items():
        lines += [
            "", "[[connection]]", f'name = "{name}"', 'law = "gear_mesh"', f'ends = ["{first}", "{second}"]',
            f'stiffness = {{ value = {STIFF:g}, unit = "N/m", origin = "chosen" }}',
            'damping = { value = 3e3, unit = "N s/m", origin = "chosen" }',
            'pressure_angle = { value = 20, unit = "deg", origin = "chosen" }',
        ]  # fmt: skip
    for k, x in ((1, -across), (2, across)):
        for end, z, main in (("front", front, 2), ("gear", middle, 3), ("rear", rear, 4)):
            along = (0.0, 0.0, 1e7) if end == "gear" else (STIFF, STIFF, 0.0)
            lines += [
                "", "[[connection]]", f'name = "{end}_{k}"', 'law = "spring"',
                f'ends = ["balancer[{k}].{end}", "block.bore[{main}]"]',
                f'place = {{ value = [{x:g}, {below:.4g}, {z:.6g}], unit = "mm", origin = "chosen" }}',
                f'stiffness = {{ value = [{", ".join(f"{v:g}" for v in along)}], unit = "N/m", origin = "chosen" }}',
                f'damping = {{ value = [{", ".join(f"{2e-5 * v:g}" for v in along)}], unit = "N s/m", '
                'origin = "chosen" }',
            ]  # fmt: skip
    return "\n".join([*dual_mass(engine), *lines]) + "\n"


def dual_mass(engine: Engine) -> list[str]:
    """Tables of bow springs with friction behind the flywheel as primary mass, and a gearbox on a soft shaft."""
    inertia = 0.8 * engine.flywheel.polar_inertia
    return [
        "", "# Dual-mass flywheel: [flywheel] is its primary mass, bow springs drive the secondary one.",
        "[drive_line_chain]",
        'discs = { value = ["secondary"], origin = "chosen" }',
        f'inertias = {{ value = [{inertia:.4g}], unit = "kg m^2", origin = "chosen", note = "0.8 of the primary" }}',
        'starts = { value = ["flywheel", "secondary"], origin = "chosen" }',
        'ends = { value = ["secondary", "dynamometer"], origin = "chosen" }',
        'stiffnesses = { value = [800, 500], unit = "N m/rad", origin = "chosen", note = "bow springs: 14 N m/deg" }',
        'dampings = { value = [0.5, 5], unit = "N m s/rad", origin = "chosen" }',
        'frictions = { value = [12, 0], unit = "N m", origin = "chosen", note = "bow springs in their channel" }',
    ]  # fmt: skip


def generator_set(engine: Engine) -> str:
    """Tables of an elastic coupling with progressive stiffness, and of the rotor of a four-pole generator on a grid."""
    torque = GasTrace.from_engine(engine).imep * engine.displacement / (4.0 * math.pi)
    rotor = 4.0 * engine.flywheel.polar_inertia
    soft = 2.5 * torque / math.radians(10.0)
    lines = [
        "", "# Elastic coupling, and the generator's rotor, held by the grid.", "[load]",
        'kind = { value = "power", origin = "chosen" }',
        'speed = { value = 1500, unit = "rev/min", origin = "chosen", note = "50 Hz with two pole pairs" }',
        f'power = {{ value = {0.8e-3 * torque * 1500 * RPM:.4g}, unit = "kW", origin = "derived", '
        'note = "0.8 of the indicated power" }',
        "", "[drive_line_chain]",
        'discs = { value = ["rotor"], origin = "chosen" }',
        f'inertias = {{ value = [{rotor:.4g}], unit = "kg m^2", origin = "chosen", note = "four flywheels" }}',
        'starts = { value = ["flywheel", "rotor"], origin = "chosen" }',
        'ends = { value = ["rotor", "dynamometer"], origin = "chosen" }',
        f'stiffnesses = {{ value = [{soft:.4g}, {0.5 * soft:.4g}], unit = "N m/rad", origin = "derived", '
        'note = "2.5 times the mean torque at 10 deg; grid: half of it" }',
        f'dampings = {{ value = [{0.02 * soft:.3g}, {0.02 * soft:.3g}], unit = "N m s/rad", origin = "chosen" }}',
        "point_shafts = { value = [1, 1], origin = \"chosen\" }",
        f'point_stiffnesses = {{ value = [{soft:.4g}, {2.0 * soft:.4g}], unit = "N m/rad", origin = "chosen", '
        'note = "progressive rubber" }',
        f'point_torques = {{ value = [0, {2.0 * torque:.4g}], unit = "N m", origin = "chosen" }}',
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


ROWS = {
    row.name: row
    for row in (
        Row("single_petrol", "0.45 l motocross single", "single", 96.0, 62.1, "petrol", 40.0, 9000.0,
            "bore and stroke of the Honda CRF450R"),
        Row("v_twin", "0.92 l 90 deg V-twin", "v2", 94.0, 66.0, "petrol", 80.0, 9000.0,
            "bore, stroke and power of the Ducati 916"),
        Row("three_petrol", "1.0 l in-line three, charged", "i3", 71.9, 82.0, "petrol", 92.0, 6000.0,
            "bore, stroke and power of the Ford 1.0 EcoBoost"),
        Row("four_petrol", "2.0 l in-line four with balancer shafts and dual-mass flywheel", "i4", 82.5, 92.8, "petrol",
            147.0, 5100.0, "bore, stroke and power of the Volkswagen EA888 2.0 TFSI", balanced_four),
        Row("five_petrol", "2.5 l in-line five, charged", "i5", 82.5, 92.8, "petrol", 250.0, 5400.0,
            "bore, stroke and power of the Audi 2.5 TFSI"),
        Row("v6_split", "3.6 l 60 deg V-six on split pins", "v6_60", 94.0, 85.6, "petrol", 227.0, 6400.0,
            "bore, stroke and power of the General Motors LLT"),
        Row("v8_cross", "6.2 l cross-plane V-eight", "v8", 103.25, 92.0, "petrol", 321.0, 5900.0,
            "bore, stroke and power of the General Motors LS3"),
        Row("v12_petrol", "6.0 l 60 deg V-twelve, charged", "v12", 89.0, 80.0, "petrol", 400.0, 5250.0,
            "bore, stroke and power of the BMW N74"),
        Row("generator_four", "2.2 l in-line four diesel generator set", "i4", 84.0, 100.0, "diesel", 20.3, 1500.0,
            "bore and stroke of the Perkins 404D-22", generator_set),
    )
}  # fmt: skip
"""All engines of the library that this module writes, by name."""


def designed(row: Row) -> Document:
    """Engine file of an engine of the library, without its additional tables."""
    found = sizes(
        layout(row.layout), 1e-3 * row.bore, 1e-3 * row.stroke, row.fuel, power=1e3 * row.power, rated=row.rated * RPM,
        practice=HANDBOOK,
    )  # fmt: skip
    made = first_design(row.name, found)
    head = (f"{row.title}: {row.source};", "all other sizes by the rules of `cranktrain new`, no data of that engine.")
    return made._replace(title=row.title, head=(*head, *made.head[1:]))


def text_of(row: Row) -> str:
    """Text of the engine file of an engine of the library."""
    made = designed(row)
    return made.text + ("" if row.more is None else row.more(made.engine))


def shipped() -> list[dict[str, Any]]:
    """Entries of all engine files that ship, for the verb ``engines``."""
    return [_entry(load_engine(name)) for name in engine_names()]


def _entry(engine: Engine) -> dict[str, Any]:
    return {
        "name": engine.name, "title": engine.title, "layout": _layout(engine), "cylinders": engine.n_cylinders,
        "displacement_l": 1e3 * engine.displacement,
        "firing_order": firing_summary(engine)["order"],
    }  # fmt: skip


def _layout(engine: Engine) -> str:
    """Layout as text: in line, boxer, or V with its bank angle."""
    banks = sorted({round(math.degrees(angle) / SAME_DEG) * SAME_DEG for angle in engine.cylinders.bank_angles})
    if len(banks) == 1:
        return "in line" if engine.n_cylinders > 1 else "single"
    own_pins = len(set(engine.cylinders.pins)) == engine.n_cylinders
    if len(banks) == 2 and abs(banks[1] - banks[0] - 180.0) < SAME_DEG and own_pins:
        return "boxer"
    return f"V of {banks[-1] - banks[0]:g} deg" if len(banks) == 2 else f"{len(banks)} banks"


def main(names: Sequence[str] = ()) -> None:
    """Write the engine files of the named rows, by default of all, and the list of all engines that ship."""
    for name in names or ROWS:
        path = engine_folder() / f"{name}.toml"
        with whole_file(path) as temporary:
            temporary.write_text(text_of(ROWS[name]), encoding="utf-8")
        print(path.name)
    TABLE.write_text(json.dumps(shipped(), indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
